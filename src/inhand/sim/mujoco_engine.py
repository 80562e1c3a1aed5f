"""The default engine: MuJoCo, all worlds stepped on all cores without a Python loop over them."""

from collections.abc import Iterator, Sequence
from functools import lru_cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from inhand.cores import usable
from inhand.errors import InputError
from inhand.geometry import Array, spatial, turn
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, convex_pieces
from inhand.hands.polygons import is_box
from inhand.sim.engine import LINK_SENSOR_SIZE
from inhand.sim.model import build_measuring_model, build_model
from inhand.sim.mujoco_worlds import MujocoWorlds, model_batch
from inhand.sim.scene import SceneSpec
from inhand.sim.snapshot import Snapshot, centre_of, nowhere
from inhand.sim.state import State


class MujocoSimulator(MujocoWorlds):
    """Worlds in MuJoCo.

    A step advances a batch that computes no sensors; a second batch, without contacts, then measures positions
    and distances of the new state. (MuJoCo's own sensors lag one physics step behind the positions.)
    """

    def __init__(
        self,
        hand: HandSpec | Sequence[HandSpec],
        objects: Sequence[ObjectSpec],
        scenes: SceneSpec | Sequence[SceneSpec] | None = None,
        threads: int = 0,
        *,
        kinds: NDArray[np.int64] | None = None,
    ) -> None:
        """Build a world for each object, to step on some threads; 0 uses every core.

        The objects are of one shape and, as polygons, of as many corners in every convex piece; sizes and masses may
        differ. The scenes have all as many walls.

        Raises:
            InputError: worlds that differ in more, or what no simulator takes.
        """
        super().__init__(hand, objects, scenes, kinds)
        _check_alike(objects, [scene for _, _, scene in self._kinds])
        models = {kind: _models_of(*kind) for kind in set(self._kinds)}
        self._models = [models[kind] for kind in self._kinds]
        threads = min(threads or usable(), self.n_worlds)
        self._batch, self._meter = (model_batch([*own], threads) for own in self._models_now())
        self._bind()
        self._measured_qpos, self._sensors = self._meter.bind("qpos"), self._meter.bind("sensordata")

    def _measure(self, active: NDArray[np.bool_]) -> State:
        self._put_back()
        self._measured_qpos[:] = self._now["qpos"]
        self._meter.forward(active, stage=mujoco.mjtStage.mjSTAGE_POS)
        now, n = self._now, self.hand.n_joints
        qpos, qvel = now["qpos"].copy(), now["qvel"].copy()
        velocity = np.concatenate([qvel[:, n : n + 3], turn(qpos[:, n + 3 :], qvel[:, n + 3 :])], axis=-1)
        links = _nearest_piece(self._sensors.reshape(len(qpos), n, -1, LINK_SENSOR_SIZE))
        return self._state(now["time"].copy(), (qpos[:, n:], velocity), (qpos[:, :n], qvel[:, :n]), now["ctrl"], links)

    def snapshot(self) -> Snapshot:
        """Return copies of all that the worlds' future depends on: one of like hand, object and scene goes on alike."""
        kept = self._copies()
        centre = centre_of(kept["qpos"], kept["qvel"], self._centre)
        return Snapshot(**kept, centre=centre, held=nowhere(self.n_worlds))

    def _place(self, object_pose: Array, joint_angles: Array) -> None:
        n, qpos = self.hand.n_joints, self._now["qpos"]
        self._batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        qpos[:, :n] = self._now["ctrl"][:] = joint_angles
        qpos[:, n:] = spatial(object_pose, 0.0)
        qpos[:, n + 2] = self._height
        self._start[:] = qpos

    def _models_now(self) -> Iterator[tuple[mujoco.MjModel, ...]]:
        """Give the model of each world, for stepping and for measuring."""
        return zip(*(self._models[kind] for kind in self._kind.tolist()), strict=True)

    def _become(self, worlds: NDArray[np.int64]) -> None:
        del worlds
        for batch, models in zip((self._batch, self._meter), self._models_now(), strict=True):
            batch.set_models([*models])


@lru_cache(maxsize=64)
def _models_of(hand: HandSpec, spec: ObjectSpec, scene: SceneSpec) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """Return the models for stepping and for measuring, which nothing changes: compiling them takes 10 ms."""
    return build_model(hand, spec, scene), build_measuring_model(hand, spec, scene)


def _check_alike(objects: Sequence[ObjectSpec], scenes: Sequence[SceneSpec]) -> None:
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


def _nearest_piece(readings: Array) -> Array:
    """Return of every link's readings `(B, n, pieces, size)` those of the piece of the object nearest to it."""
    if readings.shape[2] == 1:
        return readings[:, :, 0]
    nearest = readings[..., 0].argmin(axis=2)
    return np.take_along_axis(readings, nearest[..., None, None], axis=2)[:, :, 0]
