"""MuJoCo with hands in space: a free object, gravity along any vector, all worlds stepped without a Python loop."""

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from inhand.cores import usable
from inhand.errors import InputError
from inhand.geometry import Array, turn
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.kinematics import measure_each, surfaces
from inhand.hands.spatial.objects import SolidSpec
from inhand.sim.mujoco_worlds import MujocoWorlds, model_batch
from inhand.sim.scene import PALM_UP, SceneSpec
from inhand.sim.snapshot import Snapshot
from inhand.sim.spatial_model import build_spatial_model
from inhand.sim.state import NEAREST, SpatialState


class SpatialSimulator(MujocoWorlds):
    """Worlds of hands in space.

    Where worlds differ in gravity alone they share one model, of which each has its own gravity; where they differ in
    hands or objects each has a model of its own.
    """

    pose_size = 7

    def __init__(
        self,
        hand: SpatialHand | Sequence[SpatialHand],
        objects: Sequence[SolidSpec],
        scenes: SceneSpec | Sequence[SceneSpec] | None = None,
        threads: int = 0,
        *,
        kinds: NDArray[np.int64] | None = None,
    ) -> None:
        """Build a world for each object, to step on some threads; 0 uses every core.

        Raises:
            InputError: objects of different shapes, meshes of other triangles, or walls, which no hand in space has.
        """
        super().__init__(hand, objects, scenes, kinds)
        _check_alike(objects, [scene for _, _, scene in self._kinds])
        alike = len({kind[:2] for kind in self._kinds}) == 1
        bodies = dict.fromkeys(spec for _, spec, _ in self._kinds)
        self._surfaces = surfaces(tuple(bodies))
        self._surface = _numbers([spec for _, spec, _ in self._kinds])
        # Hands may differ in friction and servos: what is measured depends on their fingers alone.
        self._hands: list[SpatialHand] = list({own.fingers: own for own, _, _ in self._kinds}.values())
        self._fingers = _numbers([own.fingers for own, _, _ in self._kinds])
        models = {kind: build_spatial_model(*kind) for kind in (self._kinds[:1] if alike else set(self._kinds))}
        self._models = [models[self._kinds[0] if alike else kind] for kind in self._kinds]
        self._gravity = np.array([scene.pull or PALM_UP for _, _, scene in self._kinds])
        threads = min(threads or usable(), self.n_worlds)
        self._batch = model_batch([self._models[kind] for kind in self._kind.tolist()], threads)
        self._pull = self._batch.expand("opt.gravity") if alike else None
        self._become(np.arange(self.n_worlds))
        self._bind("eq_active", "mocap_pos", "mocap_quat")
        self._last_links = np.array([len(finger.links) - 1 for finger in self.hand.fingers])

    @property
    def gravity(self) -> Array:
        """Gravity of each world in the palm frame `(B, 3)` [m/s^2]."""
        return np.asarray(self._gravity[self._kind])

    def let_go(self, worlds: NDArray[np.bool_]) -> None:
        """Let go of the objects of some worlds `(B,)`: from now on only the fingers hold them."""
        self._now["eq_active"][worlds] = 0.0

    def snapshot(self) -> Snapshot:
        """Return copies of all that the worlds' future depends on: one of like hand, object and scene goes on alike."""
        now = self._now
        held = np.concatenate([now["eq_active"], now["mocap_pos"][:, 0], now["mocap_quat"][:, 0]], axis=-1)
        return Snapshot(**self._copies(), centre=np.zeros((self.n_worlds, 6)), held=held)

    def _measure(self, active: NDArray[np.bool_]) -> SpatialState:
        del active
        self._put_back()
        now, n = self._now, self.hand.n_joints
        qpos, qvel = now["qpos"].copy(), now["qvel"].copy()
        joints, pose = qpos[:, :n], qpos[:, n:]
        points, normals, gaps, link_gaps = self._touch(joints, pose)
        # Points of a finger that just touches are kept a little apart, so that they tell the normal.
        apart = np.copysign(np.maximum(np.abs(gaps), 2 * NEAREST), gaps)[..., None]
        return SpatialState(
            time=now["time"].copy(),
            object_pose=pose,
            object_velocity=np.concatenate([qvel[:, n : n + 3], turn(pose[:, 3:], qvel[:, n + 3 :])], axis=-1),
            joint_angles=joints,
            joint_velocities=qvel[:, :n],
            targets=now["ctrl"].copy(),
            link_gaps=link_gaps,
            contact_links=np.tile(self._last_links, (self.n_worlds, 1)),
            finger_points=points + apart * normals,
            object_points=points,
            gaps=gaps,
            forces=self._forces.copy(),
            diverged=self._diverged.copy(),
        )

    def _touch(self, joints: Array, pose: Array) -> tuple[Array, Array, Array, Array]:
        """Return where objects are nearest to fingertips, the normals and distances there, and distances of links."""
        count, fingers = self.n_worlds, len(self.hand.fingers)
        points, normals, gaps = np.empty((count, fingers, 3)), np.empty((count, fingers, 3)), np.empty((count, fingers))
        link_gaps, mine, body = np.empty(joints.shape), self._fingers[self._kind], self._surface[self._kind]
        for number in np.unique(mine).tolist():
            rows = mine == number
            told = measure_each(self._hands[number], (self._surfaces, body[rows]), joints[rows], pose[rows])
            points[rows], normals[rows], gaps[rows] = told.points, told.normals, told.gaps
            link_gaps[rows] = told.link_gaps
        return points, normals, gaps, link_gaps

    def _place(self, object_pose: Array, joint_angles: Array) -> None:
        now, n = self._now, self.hand.n_joints
        self._batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        now["qpos"][:, :n] = now["ctrl"][:] = joint_angles
        now["qpos"][:, n:] = object_pose
        now["mocap_pos"][:, 0], now["mocap_quat"][:, 0] = object_pose[:, :3], object_pose[:, 3:]
        now["eq_active"][:] = 1.0
        self._start[:] = now["qpos"]

    def _become(self, worlds: NDArray[np.int64]) -> None:
        if self._pull is not None:
            self._pull[worlds] = self.gravity[worlds]
            return
        self._batch.set_models([self._models[kind] for kind in self._kind.tolist()])

    def _put(self, worlds: NDArray[np.int64], snapshot: Snapshot, rows: NDArray[np.int64]) -> None:
        super()._put(worlds, snapshot, rows)
        now, held = self._now, snapshot.held[rows]
        now["eq_active"][worlds] = held[:, :1]
        now["mocap_pos"][worlds, 0], now["mocap_quat"][worlds, 0] = held[:, 1:4], held[:, 4:]

    def _put_back(self) -> NDArray[np.bool_]:
        """Put worlds that diverged back, their objects held again."""
        wild = super()._put_back()
        self._now["eq_active"][wild] = 1.0
        return wild


def _numbers(things: Sequence[object]) -> NDArray[np.int64]:
    """Return for each thing its number among those that differ, counted as they first come."""
    known = {thing: number for number, thing in enumerate(dict.fromkeys(things))}
    return np.array([known[thing] for thing in things])


def _check_alike(objects: Sequence[SolidSpec], scenes: Sequence[SceneSpec]) -> None:
    if len({spec.shape for spec in objects}) > 1:
        raise InputError("objects of different shapes in one simulator; use one simulator for each shape")
    meshes = {None if spec.mesh is None else spec.mesh.triangles for spec in objects}
    if len(meshes) > 1:
        raise InputError("different meshes in one simulator; use one simulator for each mesh (its size may differ)")
    if any(scene.walls for scene in scenes):
        raise InputError("walls with a hand in space, which has none: leave them out, or use a hand in the plane")
