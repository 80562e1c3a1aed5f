"""The default engine: MuJoCo, all worlds stepped on all cores without a Python loop over them."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array, spatial, turn
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, convex_pieces
from inhand.hands.polygons import is_box
from inhand.sim.engine import LINK_SENSOR_SIZE, Simulator
from inhand.sim.model import build_measuring_model, build_model
from inhand.sim.scene import SceneSpec
from inhand.sim.snapshot import Snapshot, centre_of, nowhere
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


_KEPT = tuple(field.name for field in fields(Snapshot) if field.name not in {"forces", "centre", "held"})


class MujocoSimulator(Simulator):
    """Worlds in MuJoCo.

    A step advances a batch that computes no sensors; a second batch, without contacts, then measures positions
    and distances of the new state. (MuJoCo's own sensors lag one physics step behind the positions.)
    """

    engine = "mujoco"

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
        models = {kind: (build_model(*kind), build_measuring_model(*kind)) for kind in set(self._kinds)}
        self._models = [models[kind] for kind in self._kinds]
        threads = min(threads or os.cpu_count() or 1, self.n_worlds)
        self._stepper, self._meter = (model_batch([*own], threads) for own in self._models_now())
        bind = self._stepper.bind
        read = {name: bind(name) for name in _KEPT}
        self._readings = Readings(**read, forces=bind("sensordata"), sensors=self._meter.bind("sensordata"))
        self._measured_qpos = self._meter.bind("qpos")
        self._start = self._readings.qpos.copy()

    def _measure(self, active: NDArray[np.bool_]) -> State:
        self._put_back()
        self._measured_qpos[:] = self._readings.qpos
        self._meter.forward(active, stage=mujoco.mjtStage.mjSTAGE_POS)
        now, n = self._readings, self.hand.n_joints
        qpos, qvel = now.qpos.copy(), now.qvel.copy()
        velocity = np.concatenate([qvel[:, n : n + 3], turn(qpos[:, n + 3 :], qvel[:, n + 3 :])], axis=-1)
        links = _nearest_piece(now.sensors.reshape(len(qpos), n, -1, LINK_SENSOR_SIZE))
        return self._state(now.time.copy(), (qpos[:, n:], velocity), (qpos[:, :n], qvel[:, :n]), now.ctrl, links)

    def snapshot(self) -> Snapshot:
        """Return copies of all that the worlds' future depends on: one of like hand, object and scene goes on alike."""
        kept = {name: getattr(self._readings, name).copy() for name in _KEPT}
        centre = centre_of(kept["qpos"], kept["qvel"], self._centre)
        return Snapshot(**kept, forces=self._forces.copy(), centre=centre, held=nowhere(self.n_worlds))

    def _place(self, object_pose: Array, joint_angles: Array) -> None:
        n = self.hand.n_joints
        self._stepper.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        self._readings.qpos[:, :n] = joint_angles
        self._readings.qpos[:, n:] = spatial(object_pose, 0.0)
        self._readings.qpos[:, n + 2] = self._height
        self._readings.ctrl[:] = joint_angles
        self._start[:] = self._readings.qpos

    def _advance(self, targets: Array, substeps: int, active: NDArray[np.bool_]) -> None:
        self._readings.ctrl[active] = targets[active]
        self._stepper.step(active, nstep=substeps)
        self._forces[active] = self._readings.forces.reshape(self._forces.shape)[active]

    def _models_now(self) -> Iterator[tuple[mujoco.MjModel, ...]]:
        """Give the model of each world, for stepping and for measuring."""
        return zip(*(self._models[kind] for kind in self._kind.tolist()), strict=True)

    def _become(self, worlds: NDArray[np.int64]) -> None:
        del worlds
        for batch, models in zip((self._stepper, self._meter), self._models_now(), strict=True):
            batch.set_models([*models])

    def _put(self, worlds: NDArray[np.int64], snapshot: Snapshot, rows: NDArray[np.int64]) -> None:
        for name in _KEPT:
            getattr(self._readings, name)[worlds] = getattr(snapshot, name)[rows]

    def _knock(self, worlds: NDArray[np.int64], impulse: Array) -> None:
        n = self.hand.n_joints
        self._readings.qvel[worlds, n : n + 3] += impulse / self._mass[worlds, None]

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


def model_batch(models: list[mujoco.MjModel], threads: int) -> Batch:
    """Return a batch of a world for each model.

    Raises:
        InputError: models that differ in more than numbers.
    """
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


def _nearest_piece(readings: Array) -> Array:
    """Return of every link's readings `(B, n, pieces, size)` those of the piece of the object nearest to it."""
    if readings.shape[2] == 1:
        return readings[:, :, 0]
    nearest = readings[..., 0].argmin(axis=2)
    return np.take_along_axis(readings, nearest[..., None, None], axis=2)[:, :, 0]
