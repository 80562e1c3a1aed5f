"""The default engine: MuJoCo, all worlds stepped on all cores without a Python loop over them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, fields

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array, spatial, turn
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, centre_of_mass, convex_pieces
from inhand.hands.polygons import is_box
from inhand.sim.engine import check_impulse, check_start, check_substeps, check_targets, hand_of_each
from inhand.sim.model import LINK_SENSOR_SIZE, SceneSpec, build_measuring_model, build_model, scene_of_each
from inhand.sim.names import Engine
from inhand.sim.snapshot import Snapshot, centre_of, check_restore
from inhand.sim.state import State, ran_away


@dataclass(frozen=True)
class Readings:
    """Live views of the engine's arrays, bound once."""

    time: Array
    qpos: Array
    qvel: Array
    ctrl: Array
    qacc_warmstart: Array
    forces: Array
    sensors: Array


_KEPT = tuple(field.name for field in fields(Snapshot) if field.name not in {"forces", "centre"})


class MujocoSimulator:
    """B worlds of one hand, each with its own object and surroundings.

    A step advances a batch that computes no sensors; a second batch, without contacts, then measures positions
    and distances of the new state, so that everything in `State` belongs to the same instant. (MuJoCo's own
    sensors lag one physics step behind the positions.) A world that diverges is put back and told in
    `State.diverged`; the others go on as if nothing had happened.
    """

    engine: Engine = "mujoco"

    def __init__(
        self,
        hand: HandSpec | Sequence[HandSpec],
        objects: Sequence[ObjectSpec],
        scenes: SceneSpec | Sequence[SceneSpec] | None = None,
        threads: int = 0,
    ) -> None:
        """Build a world for each object.

        Args:
            hand: the hand of every world, or one for each; their numbers may differ, not their joints.
            objects: the object of each world; all of one shape and, as polygons, of as many corners in every convex
                piece; sizes and masses may differ.
            scenes: what surrounds them, one for all or one for each world; all with as many walls.
            threads: threads to step on; 0 uses every core.

        Raises:
            InputError: no objects, objects of different shapes, scenes of different timesteps or numbers of walls, or
                as many scenes as objects are not given.
        """
        surroundings = scene_of_each(objects, scenes)
        _check_alike(objects, surroundings)
        hands = hand_of_each(hand, len(objects))
        self.hand = hands[0]
        self.objects = tuple(objects)
        self.timestep = surroundings[0].timestep
        worlds = list(zip(hands, objects, surroundings, strict=True))
        kinds = {world: build_model(*world) for world in set(worlds)}
        meters = {world: build_measuring_model(*world) for world in set(worlds)}
        threads = min(threads or os.cpu_count() or 1, len(objects))
        self._stepper = _batch([kinds[world] for world in worlds], threads)
        self._meter = _batch([meters[world] for world in worlds], threads)
        bind = self._stepper.bind
        read = {name: bind(name) for name in _KEPT}
        self._readings = Readings(**read, forces=bind("sensordata"), sensors=self._meter.bind("sensordata"))
        self._measured_qpos = self._meter.bind("qpos")
        self._mass, self._height = np.array([(spec.mass, spec.height / 2) for spec in objects]).T
        self._centre = np.stack([centre_of_mass(spec) for spec in objects])
        self._forces = np.zeros((len(objects), len(self.hand.fingers), 3))
        self._diverged = np.zeros(len(objects), dtype=bool)
        self._start = self._readings.qpos.copy()

    def reset(self, object_pose: Array, joint_angles: Array) -> State:
        """Place the objects `(B, 3)` upright on the plane and the joints `(B, n)`, all at rest; return the state."""
        n = self.hand.n_joints
        check_targets(joint_angles, len(self.objects), n)
        check_start(object_pose, len(self.objects))
        self._stepper.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        self._readings.qpos[:, :n] = joint_angles
        self._readings.qpos[:, n:] = spatial(object_pose, 0.0)
        self._readings.qpos[:, n + 2] = self._height
        self._readings.ctrl[:] = joint_angles
        self._start[:] = self._readings.qpos
        self._diverged[:] = False
        self._forces[:] = 0.0
        return self.measure()

    def step(self, targets: Array, substeps: int) -> State:
        """Hold joint targets `(B, n)` [rad] for `substeps` physics steps; return the state after the last.

        Raises:
            InputError: a target is not finite; the text names world and joint. Or no physics step was asked for.
        """
        check_substeps(substeps)
        check_targets(targets, len(self.objects), self.hand.n_joints)
        self._readings.ctrl[:] = targets
        self._stepper.step(nstep=substeps)
        self._forces[:] = self._readings.forces.reshape(self._forces.shape)
        return self.measure()

    def snapshot(self) -> Snapshot:
        """Return copies of all that the worlds' future depends on, to put worlds back to it with `restore`."""
        kept = {name: getattr(self._readings, name).copy() for name in _KEPT}
        centre = centre_of(kept["qpos"], kept["qvel"], self._centre)
        return Snapshot(**kept, forces=self._forces.copy(), centre=centre)

    def restore(self, worlds: NDArray[np.int64], snapshot: Snapshot, rows: NDArray[np.int64]) -> None:
        """Put worlds `(K,)` back to rows `(K,)` of a snapshot; the other worlds are not touched.

        The snapshot may be another simulator's, of any number of worlds. A world goes on byte for byte where hand,
        object and scene are those it was taken with; a like object of another size or mass takes the pose over as it
        is. Nothing is measured: `measure` does that, once for all that was put back.

        Raises:
            InputError: worlds or rows that are not there, a world named twice, or a hand of another number of joints.
        """
        check_restore(worlds, len(self.objects), snapshot, rows, self.hand.n_joints)
        for name in _KEPT:
            getattr(self._readings, name)[worlds] = getattr(snapshot, name)[rows]
        self._diverged[worlds] = False
        self._forces[worlds] = snapshot.forces[rows]

    def push(self, worlds: NDArray[np.int64], impulse: Array) -> None:
        """Push the objects of worlds `(K,)` at their centres of mass with impulses `(K, 3)` [N s], at this instant.

        Raises:
            InputError: worlds that are not there, or impulses of another shape or not finite.
        """
        check_impulse(worlds, len(self.objects), impulse)
        n = self.hand.n_joints
        self._readings.qvel[worlds, n : n + 3] += impulse / self._mass[worlds, None]

    def measure(self) -> State:
        """Return the state of the present instant, worlds that diverged put back first."""
        self._put_back()
        self._measured_qpos[:] = self._readings.qpos
        self._meter.forward(stage=mujoco.mjtStage.mjSTAGE_POS)
        return _state_from(self._readings, self.hand, self._diverged.copy(), self._forces.copy())

    def _put_back(self) -> None:
        """Find worlds that diverged and put them at rest where they were last reset to; their time goes on.

        MuJoCo's own answer, a reset to the model's defaults with the clock at 0, is off (`build_model`): it would look
        like a measurement.
        """
        now = self._readings
        wild = ran_away(now.qpos, now.qvel)
        if wild.any():
            self._diverged |= wild
            now.qpos[wild] = self._start[wild]
            now.qvel[wild] = 0.0
            now.qacc_warmstart[wild] = 0.0
            self._forces[wild] = 0.0


def _check_alike(objects: Sequence[ObjectSpec], scenes: Sequence[SceneSpec]) -> None:
    """Refuse objects and scenes whose models would differ in more than numbers."""
    if len({spec.shape for spec in objects}) > 1:
        raise InputError("objects of different shapes in one simulator; use one simulator for each shape")
    cuts = {tuple("a box" if is_box(p) else f"{len(p)} corners" for p in convex_pieces(spec)) for spec in set(objects)}
    if len(cuts) > 1:
        given = " and of ".join(" + ".join(cut) for cut in sorted(cuts))
        raise InputError(
            f"objects whose convex pieces are of {given} in one simulator; use one simulator for each outline (its size"
            " may differ)"
        )
    walls = sorted({len(scene.walls) for scene in scenes})
    if len(walls) > 1:
        raise InputError(
            f"scenes of {' and of '.join(str(number) for number in walls)} walls in one simulator; give every scene as"
            " many (a wall out of reach does nothing), or use one simulator for each number"
        )


def _batch(models: list[mujoco.MjModel], threads: int) -> Batch:
    # One MjData for each thread, not for each world, stays in the cache: a seventh faster, and the same bytes.
    batch = Batch(models[0], len(models), threads, persistent=False)
    if any(model is not models[0] for model in models):
        try:
            batch.set_models(models)
        except mujoco.FatalError as error:
            raise InputError(
                "objects whose models differ in more than numbers in one simulator, as one that is symmetric and one"
                " that is not: use one simulator for each outline"
            ) from error
    return batch


def _state_from(readings: Readings, hand: HandSpec, diverged: NDArray[np.bool_], forces: Array) -> State:
    """Return the state, its arrays copied from the engine's so that a later step cannot change them."""
    n = hand.n_joints
    qpos, qvel = readings.qpos.copy(), readings.qvel.copy()
    links = _nearest_piece(readings.sensors.reshape(len(qpos), n, -1, LINK_SENSOR_SIZE))
    link_gaps = links[..., 0].copy()
    nearest = np.stack([link_gaps[:, place].argmin(axis=1) for place in hand.slices], axis=1)
    chosen = links[np.arange(len(qpos))[:, None], nearest + [place.start for place in hand.slices]]
    return State(
        time=readings.time.copy(),
        object_pose=qpos[:, n:],
        object_velocity=np.concatenate([qvel[:, n : n + 3], turn(qpos[:, n + 3 :], qvel[:, n + 3 :])], axis=-1),
        joint_angles=qpos[:, :n],
        joint_velocities=qvel[:, :n],
        targets=readings.ctrl.copy(),
        link_gaps=link_gaps,
        contact_links=nearest,
        finger_points=chosen[..., 1:4],
        object_points=chosen[..., 4:7],
        gaps=chosen[..., 0],
        forces=forces,
        diverged=diverged,
    )


def _nearest_piece(readings: Array) -> Array:
    """Return of every link's readings `(B, n, pieces, size)` those of the piece of the object nearest to it."""
    if readings.shape[2] == 1:
        return readings[:, :, 0]
    nearest = readings[..., 0].argmin(axis=2)
    return np.take_along_axis(readings, nearest[..., None, None], axis=2)[:, :, 0]
