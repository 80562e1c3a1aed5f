"""`inhand asterisk`: run the Asterisk Test and write its report."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

from inhand.asterisk_test.beside import load_beside
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.people.human import HumanFolder, read_human_folder
from inhand.asterisk_test.report import Run, file_name, write_report
from inhand.asterisk_test.results import as_entry, result_of_trial, summary_of, write_json
from inhand.asterisk_test.run import Setup, prepare, simulate
from inhand.asterisk_test.table import failures, shown_columns, table_rows, with_beside
from inhand.cli.terminal import print_table, say, trials_shown
from inhand.control.catalogue import notes_of
from inhand.control.trial import Trial, save_trial
from inhand.errors import InputError
from inhand.folders import run_folder
from inhand.versions import versions


def run_asterisk(config: AsteriskConfig) -> None:
    """Check everything, simulate, measure, and put the finished run in its place."""
    people, beside = people_of(config), load_beside(config.beside)
    setup = prepare(config, people.trials)
    with run_folder(config.out, overwrite=config.overwrite) as folder:
        trials = simulated(config, setup)
        results = tuple(result_of_trial(trial, compatible=config.compatible) for trial in trials)
        notes = (*people.notes, *notes_of(setup.controller, config.hand, config.object))
        run = Run(config, trials, results, people.trials, notes, beside)
        write_trials(trials, folder)
        write_report(run, folder)
        content = {
            "trials": [as_entry(result) for result in results],
            "directions": summary_of(results),
            "config": asdict(config),
            "versions": versions(),
            "seed": config.seed,
        }
        write_json(content, folder / "metrics.json")
    header, rows = with_beside(*shown_columns(table_rows(results, people.trials)), beside)
    print_table(f"{run.name} on {config.object}, {config.hand}", header, rows)
    for sentence in failures(results):
        say(sentence)
    say(f"Report: {config.out / 'report.md'}")


def people_of(config: AsteriskConfig) -> HumanFolder:
    """Return the recorded human trials that a run asks for."""
    if config.human is not None:
        return read_human_folder(config.human)
    if config.paths == "human":
        raise InputError("--paths human needs the recorded trials to follow: give their folder with --human DIR")
    return HumanFolder((), ())


def simulated(config: AsteriskConfig, setup: Setup) -> tuple[Trial, ...]:
    """Run every trial of a setup and show how far it is."""
    with trials_shown(len(setup.assignments)) as show:
        return simulate(config, setup, show)


def write_trials(trials: Iterable[Trial], folder: Path) -> None:
    """Write trials to the folder `trials` of a run's folder."""
    place = folder / "trials"
    place.mkdir(parents=True)
    for trial in trials:
        save_trial(trial, place / f"{file_name(trial.passport.primitive)}_{trial.passport.trial}.npz")
