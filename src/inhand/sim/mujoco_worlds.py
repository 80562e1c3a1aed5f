"""What both engines in MuJoCo do alike, with hands in the plane and in space: worlds as arrays, kept and put back."""

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.sim.engine import Simulator
from inhand.sim.snapshot import Snapshot
from inhand.sim.state import ran_away

KEPT = ("time", "qpos", "qvel", "ctrl", "qacc_warmstart")
"""Arrays that a snapshot has under the engine's names."""
FORCES = "sensordata"
"""The engine's name of what it measures in stepping: the fingers' forces on the object."""


class MujocoWorlds(Simulator):
    """Worlds that a batch of MuJoCo's steps."""

    engine = "mujoco"

    _batch: Batch
    _now: dict[str, Array]
    """Live views of the batch's arrays by name, bound once."""
    _start: Array
    """`qpos` as worlds were last reset to."""

    def _bind(self, *more: str) -> None:
        """Take up the arrays of the batch that are kept, the forces and some more."""
        self._now = {name: self._batch.bind(name) for name in (*KEPT, FORCES, *more)}
        self._start = self._now["qpos"].copy()

    def _copies(self) -> dict[str, Array]:
        """Return copies of what a snapshot has under the engine's names, and of the forces."""
        return {name: self._now[name].copy() for name in KEPT} | {"forces": self._forces.copy()}

    def _advance(self, targets: Array, substeps: int, active: NDArray[np.bool_]) -> None:
        self._now["ctrl"][active] = targets[active]
        self._batch.step(active, nstep=substeps)
        self._forces[active] = self._now[FORCES].reshape(self._forces.shape)[active]

    def _hold(self, targets: Array, substeps: int, active: NDArray[np.bool_]) -> None:
        """Advance all steps in one call also where targets lag: a call for each step would take a quarter longer."""
        if not self.lag.any():
            super()._hold(targets, substeps, active)
            return
        arrived = self.lag[:, None] <= np.arange(substeps)
        told = np.where(arrived[..., None], targets[:, None], self._held[:, None])
        before = self._now["time"].copy()
        self._batch.rollout(substeps, told[active], record=(), ids=active)
        # A world that warns stops there, and goes on step by step.
        done = np.rint((self._now["time"] - before) / self.timestep)
        for step in range(int(done[active].min(initial=substeps)), substeps):
            self._advance(told[:, step], 1, active & (done <= step))
        self._now["ctrl"][active] = told[active, -1]
        self._forces[active] = self._now[FORCES].reshape(self._forces.shape)[active]
        self._held = np.where(active[:, None], targets, self._held)

    def _put(self, worlds: NDArray[np.int64], snapshot: Snapshot, rows: NDArray[np.int64]) -> None:
        for name in KEPT:
            self._now[name][worlds] = getattr(snapshot, name)[rows]

    def _knock(self, worlds: NDArray[np.int64], impulse: Array) -> None:
        n = self.hand.n_joints
        self._now["qvel"][worlds, n : n + 3] += impulse / self._mass[worlds, None]

    def _put_back(self) -> NDArray[np.bool_]:
        """Find worlds that diverged `(B,)` and put them at rest where they were last reset to; their time goes on.

        MuJoCo's own answer, a reset to the model's defaults with the clock at 0, is off (`build_model`): it would look
        like a measurement.
        """
        now = self._now
        wild = ran_away(now["qpos"], now["qvel"])
        if wild.any():
            self._diverged |= wild
            now["qpos"][wild] = self._start[wild]
            for array in (now["qvel"], now["qacc_warmstart"], self._forces):
                array[wild] = 0.0
        return wild


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
