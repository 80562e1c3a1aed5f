"""Saved runs, back as the values that made them."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from inhand.asterisk_test.asterisk import people_of
from inhand.asterisk_test.beside import load_beside, settings_of
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.report import Run
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.asterisk_test.sweep.run import SweepRun, run_sweep
from inhand.control.trial import Trial, load_trial
from inhand.errors import InputError
from inhand.records import read_json, read_record
from inhand.tasks.primitives import parse_directions

C = TypeVar("C", AsteriskConfig, SweepConfig)


def load(place: str | Path) -> Run | SweepRun:
    """Return the run of a folder that `save` or a command wrote, or the run of one trial's `.npz` file alone.

    Metrics are measured again from the trials, by this version's rules.

    Raises:
        InputError: there is no run of the Asterisk Test, no sweep and no trial, or one that cannot be read.
    """
    path = Path(place)
    if path.is_file():
        return _one(path)
    if (path / "sweep.json").is_file():
        return run_sweep(_config(path / "sweep.json", SweepConfig, path))
    if (path / "metrics.json").is_file():
        return _run(path)
    raise InputError(
        f"{path} holds no run: give the folder of a run of `inhand asterisk`, of a sweep, or a trial's .npz file"
    )


def _run(folder: Path) -> Run:
    config = _config(folder / "metrics.json", AsteriskConfig, folder)
    files = sorted((folder / "trials").glob("*.npz"))
    if not files:
        raise InputError(f"{folder} holds no trials: give the whole folder of a run")
    loaded = [load_trial(path) for path in files]
    order = [each.name for each in parse_directions(config.directions)]
    trials = tuple(sorted(loaded, key=lambda trial: (_place(trial, order), trial.passport.trial)))
    results = tuple(result_of_trial(trial, compatible=config.compatible, metrics=config.metrics) for trial in trials)
    people = people_of(config)
    name, beside = load_beside(config.beside, settings_of(trials[0].passport), config.label)
    return Run(config, trials, results, people.trials, people.notes, beside, name)


def _place(trial: Trial, order: list[str]) -> int:
    """Return where a trial's direction stands in a run; those that hold a twist stand as they were saved."""
    name = trial.passport.primitive
    return order.index(name) if name in order else len(order)


def _one(path: Path) -> Run:
    trial = load_trial(path)
    passport = trial.passport
    config = AsteriskConfig(
        hand=passport.hand.name,
        object=passport.object.name,
        controller=passport.controller,
        directions=passport.primitive,
        trials=1,
        seed=passport.seed,
    )
    return Run(config, (trial,), (result_of_trial(trial),))


def _config(file: Path, kind: type[C], folder: Path) -> C:
    """Return the configuration that a run's JSON holds, its folder put in."""
    found = read_json(file.read_bytes())
    entry = found.get("config") if isinstance(found, dict) else None
    if not isinstance(entry, dict):
        raise InputError(f"{file} holds no configuration of a run")
    try:
        return read_record(entry | {"out": str(folder)}, kind)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
