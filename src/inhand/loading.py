"""Saved runs, back as the values that made them."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from inhand.asterisk_test.asterisk import people_of
from inhand.asterisk_test.beside import load_beside
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.design.config import MARK as DESIGN
from inhand.asterisk_test.design.config import DesignConfig
from inhand.asterisk_test.design.run import DesignRun, read_design
from inhand.asterisk_test.reach import load_reach
from inhand.asterisk_test.regrasped import NAME, PLAIN
from inhand.asterisk_test.report import Run
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.robustness import run as robust
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.spatial.report import SpatialRun
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.asterisk_test.sweep.run import SweepRun, read_sweep
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import AnyTrial, Trial, load_all, load_any
from inhand.errors import InputError
from inhand.hands.spatial.gravity import gravity_name
from inhand.learning.dataset import load_dataset
from inhand.learning.evaluate import load_evaluation
from inhand.learning.train import load_training
from inhand.records import checked, read_json_file
from inhand.shown import Shown, saved
from inhand.sim.names import UNTOLD, Engine
from inhand.tasks.primitives import parse_directions
from inhand.tasks.spatial.primitives import parse_spatial_directions
from inhand.tracing.report import load_trace

UNFINISHED = frozenset({"trials", "cells", "cases", "metrics.jsonl"})
"""What a folder holds before the file that its kind is known by is there."""
MOST_NAMES = 5
"""Names of what a folder holds that a text tells."""


def load(place: str | os.PathLike[str]) -> Shown:
    """Return the run of a folder that `save` or a command wrote, or the run of one trial's `.npz` file alone.

    Metrics are measured again from the trials, by this version's rules.

    Raises:
        InputError: there is nothing of the kind, or something that cannot be read; the text says what was found.
    """
    if not isinstance(place, str | os.PathLike):
        raise InputError(f"{place!r} is no place: give the folder of a run, or a trial's .npz file")
    path = Path(place)
    if path.is_file():
        return _one(path)
    for mark, (_, loaded) in LOADERS.items():
        if (path / mark).is_file():
            return _named(path, mark, loaded)
    there = sorted(each.name for each in path.iterdir()) if path.is_dir() else []
    part = path.with_name(f"{path.name}.part") if path.name else path
    if UNFINISHED & set(there) or (not there and part.is_dir()):
        raise InputError(
            f"{path} holds a run that is not finished: wait for it, or give its command again, which goes on if it can"
        )
    found = ", ".join(there[:MOST_NAMES]) + (" and more" if len(there) > MOST_NAMES else "")
    holds = f"holds {found}" if there else ("is empty" if path.is_dir() else "is not there")
    kinds = ", ".join(f"{mark} ({by})" for mark, (by, _) in LOADERS.items())
    raise InputError(f"{path} {holds}: give a trial's .npz file, or a folder with one of {kinds}")


def _named(path: Path, mark: str, loaded: Callable[[Path], Shown]) -> Shown:
    """Return what is loaded from a folder; an error that names no file of it names the one that it is known by."""
    try:
        return loaded(path)
    except InputError as error:
        raise error if str(path) in str(error) else InputError(f"{path / mark}: {error}") from error


def _tested(folder: Path) -> Shown:
    """Return a run of the Asterisk Test, or an evaluation, which has the same mark."""
    found = read_json_file(folder / "metrics.json")
    return load_evaluation(folder) if isinstance(found, dict) and "expert" in found else _run(folder)


def _in_space(config: AsteriskConfig, found: Sequence[AnyTrial], **told: Any) -> SpatialRun:
    """Return the run of trials in space, in the order of its directions, and what else is told of it."""
    order = [each.name for each in parse_spatial_directions(config.directions, config.twist)]
    trials = [trial for trial in found if isinstance(trial, SpatialTrial)]
    trials.sort(key=lambda trial: (_place(trial, order), trial.passport.trial))
    return SpatialRun(config, tuple(trials), tuple(result_of_trial(trial) for trial in trials), **told)


def _run(folder: Path) -> Run | SpatialRun:
    config, content = saved(folder, "metrics.json", AsteriskConfig, engine=UNTOLD)
    notes: tuple[str, ...] = checked("notes", content.get("notes", ()), tuple[str, ...])
    found = load_all(folder)
    space = isinstance(found[0], SpatialTrial)
    name, beside = load_beside(config.beside, found[0].passport.settings, config.label, space=space)
    if space:
        return _in_space(config, found, notes=notes, beside=beside, label=name)
    order = [each.name for each in parse_directions(config.directions)]
    planar = [trial for trial in found if isinstance(trial, Trial)]
    trials = tuple(sorted(planar, key=lambda trial: (_place(trial, order), trial.passport.trial)))
    results = tuple(result_of_trial(trial, compatible=config.compatible, metrics=config.metrics) for trial in trials)
    return Run(config, trials, results, people_of(config).trials, notes, beside, name)


def _sweep(folder: Path) -> SweepRun:
    return read_sweep(*saved(folder, "sweep.json", SweepConfig, engine=UNTOLD))


def _design(folder: Path) -> DesignRun:
    return read_design(*saved(folder, DESIGN, DesignConfig))


def _robustness(folder: Path) -> robust.RobustnessRun:
    return robust.read_robustness(*saved(folder, robust.MARK, RobustnessConfig))


def _place(trial: AnyTrial, order: list[str]) -> int:
    """Return where a trial's direction stands in a run; those that hold a twist stand as they were saved."""
    name = trial.passport.primitive
    return order.index(name) if name in order else len(order)


def _one(path: Path) -> Run | SpatialRun:
    trial = load_any(path)
    passport = trial.passport
    config = AsteriskConfig(
        hand=passport.hand.name,
        object=passport.object.name,
        controller=PLAIN if (anew := passport.controller == NAME) else passport.controller,
        regrasp=anew,
        directions=passport.primitive,
        trials=1,
        seed=passport.seed,
        engine=checked("engine", passport.engine, Engine),
    )
    if isinstance(trial, SpatialTrial):
        if trial.passport.along is None and trial.passport.about is None:
            raise InputError(
                f"{path} followed {passport.primitive}, which is no primitive, in space: the page of its run replays"
                " it; give the folder of the run of `inhand trace`"
            )
        return _in_space(replace(config, gravity=gravity_name(trial.passport.gravity)), [trial])
    return Run(config, (trial,), (result_of_trial(trial),))


LOADERS: dict[str, tuple[str, Callable[[Path], Shown]]] = {
    "sweep.json": ("inhand sweep", _sweep),
    "robustness.json": ("inhand robustness", _robustness),
    "trace.json": ("inhand trace", load_trace),
    "reach.json": ("inhand reach", load_reach),
    DESIGN: ("inhand design", _design),
    "metrics.json": ("inhand asterisk, inhand evaluate", _tested),
    "config.json": ("inhand train", load_training),
    "data/metadata.json": ("inhand record", load_dataset),
}
"""What each kind of folder is known by, what wrote it, and what loads it."""
