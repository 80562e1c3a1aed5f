"""Earlier runs, to set beside a new one, and names that tell them apart."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path
from typing import Any

from inhand.asterisk_test.results import Result, result_of_trial
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import load_any
from inhand.errors import InputError
from inhand.pages import counted
from inhand.sim.disturbance_files import NONE

MOST = 2
"""Runs that fit beside people and the new run in one figure."""
SETTINGS = ("hand", "object", "controller", "engine", "disturb")
"""What tells runs apart, before their folders do."""
THIS = "this run"
"""What stands for the folder of the new run, which may have none yet."""


@dataclass(frozen=True, eq=False)
class Beside:
    """An earlier run."""

    name: str
    """What tells it from the others."""
    trials: tuple[Any, ...]
    """In the plane or in space."""
    results: tuple[Result, ...]
    """Their results, in the same order."""
    told: str = "an earlier run"
    """What a reader must know of it."""

    @property
    def settings(self) -> tuple[str, ...]:
        """Its hand, object, controller, engine and disturbance, and in space its gravity."""
        return tuple(self.trials[0].passport.settings)

    @property
    def told_settings(self) -> str:
        """The same in words; nothing of a disturbance where there is none."""
        return ", ".join(word for word in self.settings if word != NONE)

    def only(self, wanted: Callable[[Any], bool]) -> Beside:
        """Return the run with some of its trials."""
        pairs = [(t, r) for t, r in zip(self.trials, self.results, strict=True) if wanted(t)]
        return replace(self, trials=tuple(t for t, _ in pairs), results=tuple(r for _, r in pairs))


def load_beside(
    folders: Sequence[Path], own: Sequence[str], labels: Sequence[str] = (), *, space: bool = False
) -> tuple[str, tuple[Beside, ...]]:
    """Return the name of a new run and the runs that earlier calls left in folders, each with its name.

    Args:
        folders: of the earlier runs.
        own: hand, object, controller, engine and disturbance of the new run, and in space its gravity.
        labels: names of the new run and of the earlier ones; without them names are what differs in those settings,
            and the folder where they are the same.
        space: whether the new run is one in space, as all then have to be.

    Raises:
        InputError: too many folders, one twice, or one without the trials of a run, or with those of the other kind of
            hand; labels that are not one for each.
    """
    if len(folders) > MOST:
        raise InputError(f"--beside names {len(folders)} runs; at most {MOST} fit beside a new one: leave some out")
    _check_labels(labels, 1 + len(folders))
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise InputError(f"--beside names {folders[0]} twice: give each run once")
    runs = [_load(folder, space) for folder in folders]
    if not (folders or labels):
        return own[2], ()
    names = labels or names_of([tuple(own), *(run.settings for run in runs)], folders)
    return names[0], tuple(replace(run, name=name) for run, name in zip(runs, names[1:], strict=True))


def _load(folder: Path, space: bool) -> Beside:
    files = sorted((folder / "trials").glob("*.npz"))
    if not files:
        raise InputError(f"--beside {folder} holds no trials of a run; give the --out folder of an earlier run")
    trials = tuple(load_any(path) for path in files)
    if isinstance(trials[0], SpatialTrial) != space:
        there, here = ("the plane", "space") if space else ("space", "the plane")
        raise InputError(f"--beside {folder} is a run in {there}, and this one is in {here}: give one of the same kind")
    return Beside(trials[0].passport.controller, trials, tuple(result_of_trial(trial) for trial in trials))


def names_of(settings: Sequence[tuple[str, ...]], folders: Sequence[Path]) -> list[str]:
    """Return what tells runs apart: what differs in their settings, and their folders where that is the same.

    Of a first run without a folder, the new one, `THIS` stands for it.
    """
    differs = [len(set(values)) > 1 for values in zip(*settings, strict=True)]
    names = [", ".join(compress(each, differs)) for each in settings]
    parts = [folder.resolve().parts for folder in folders]
    depth = next(n for n in range(1, 2 + max(map(len, parts))) if len({each[-n:] for each in parts}) == len(parts))
    places = [THIS] * (len(settings) - len(folders)) + ["/".join(each[-depth:]) for each in parts]
    counts = Counter(names)
    told = [place if not name else f"{name} ({place})" for name, place in zip(names, places, strict=True)]
    return [name if counts[name] == 1 else more for name, more in zip(names, told, strict=True)]


def _check_labels(labels: Sequence[str], runs: int) -> None:
    if labels and len(labels) != runs:
        raise InputError(
            f"--label gives {len(labels)} names for {counted(runs, 'run')}: give one for this run and one"
            " for each of --beside, in that order"
        )
    for label in labels:
        if not label.strip() or labels.count(label) > 1:
            raise InputError(f"--label {label!r}: give each run a name of its own")
