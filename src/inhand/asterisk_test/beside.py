"""Earlier runs, to set beside a new one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from inhand.asterisk_test.results import Result, result_of_trial
from inhand.control.trial import Trial, load_trial
from inhand.errors import InputError
from inhand.sim.names import MUJOCO

MOST = 2
"""Runs that fit beside people and the new run in one figure."""


@dataclass(frozen=True, eq=False)
class Beside:
    """An earlier run."""

    name: str
    """Its controller, with the engine where it is not MuJoCo."""
    trials: tuple[Trial, ...]
    """Its trials."""
    results: tuple[Result, ...]
    """Their results, in the same order."""
    told: str = "an earlier run"
    """What a reader must know of it."""

    def only(self, wanted: Callable[[Trial], bool]) -> Beside:
        """Return the run with some of its trials."""
        pairs = [(t, r) for t, r in zip(self.trials, self.results, strict=True) if wanted(t)]
        return replace(self, trials=tuple(t for t, _ in pairs), results=tuple(r for _, r in pairs))


def load_beside(folders: Sequence[Path]) -> tuple[Beside, ...]:
    """Return the runs that earlier calls left in folders.

    Raises:
        InputError: too many folders, or a folder without the trials of a run.
    """
    if len(folders) > MOST:
        raise InputError(f"--beside names {len(folders)} runs; at most {MOST} fit beside a new one: leave some out")
    return tuple(_load(folder) for folder in folders)


def _load(folder: Path) -> Beside:
    files = sorted((folder / "trials").glob("*.npz"))
    if not files:
        raise InputError(f"--beside {folder} holds no trials of a run; give the --out folder of an earlier run")
    trials = tuple(load_trial(path) for path in files)
    passport = trials[0].passport
    name = passport.controller if passport.engine == MUJOCO else f"{passport.controller} ({passport.engine})"
    return Beside(name, trials, tuple(result_of_trial(trial) for trial in trials))
