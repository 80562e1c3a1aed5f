"""`inhand evaluate`: a learned policy beside the expert from the same starts, and what failed and why."""

from __future__ import annotations

import shlex
from dataclasses import asdict
from pathlib import Path

from inhand.asterisk_test.asterisk import people_of
from inhand.asterisk_test.comparison import GROUPS, HEADER, Evaluation, rows, with_more
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import as_entry, result_of_trial, summary_of
from inhand.asterisk_test.run import prepare
from inhand.asterisk_test.table import failures
from inhand.cli.asterisk import simulated
from inhand.cli.learning_config import EvaluateConfig
from inhand.cli.terminal import print_table, say
from inhand.control.catalogue import SHIPPED, ControllerEntry, find_controller, notes_of
from inhand.control.trial import write_json, write_trials
from inhand.errors import InputError
from inhand.folders import run_folder
from inhand.learning.progress import JOURNAL, Learned, read_learning
from inhand.learning.report import Compared, summary, write_evaluation
from inhand.pages import options
from inhand.versions import versions

EXPERT = "ik"
"""The controller that a policy is set beside."""


def run_evaluate(config: EvaluateConfig) -> None:
    """Check everything, run policy and expert from the same starts, and put the report in its place."""
    name = name_of(config)
    entry = find_controller(name)
    test = asterisk_of(config, name, entry)
    people = people_of(test)
    setup = with_more(prepare(test), config.episodes)
    expert = with_more(prepare(_by(test, EXPERT)), config.episodes)
    with run_folder(config.out, overwrite=config.overwrite) as folder:
        found = []
        for each in (setup, expert):
            trials = simulated(_by(test, each.controller.name), each)
            results = tuple(result_of_trial(trial) for trial in trials)
            found.append(Evaluation(each.controller.name, trials, results, config.trials))
        notes = (*people.notes, *notes_of(entry, test.hand, test.object))
        again = shlex.join(["inhand", "evaluate", config.run, *options(config, without=("run",))])
        compared = Compared(test, found[0], found[1], people.trials, notes, _learned(config.run), again)
        write_trials(compared.policy.first[0], folder)
        write_trials(compared.expert.first[0], folder / EXPERT)
        write_trials([trial for trial, _ in compared.policy.failed], folder / "failed")
        write_evaluation(compared, folder)
        _write_numbers(config, entry, compared, folder)
    _tell(compared)
    say(f"Report: {config.out / 'report.md'}")


def name_of(config: EvaluateConfig) -> str:
    """Return what the policy to evaluate is called as a controller.

    Raises:
        InputError: --last of something that has none.
    """
    if not config.last:
        return config.run
    if config.run == SHIPPED or not (Path(config.run) / "last").is_dir():
        raise InputError(f"--last: {config.run} holds no last policy; give the folder of a run of `inhand train`")
    return str(Path(config.run) / "last")


def asterisk_of(config: EvaluateConfig, name: str, entry: ControllerEntry) -> AsteriskConfig:
    """Return the run of the Asterisk Test that evaluates a policy, by default with what it was trained with.

    Raises:
        InputError: the controller is no learned policy.
    """
    if entry.policy is None:
        raise InputError(
            f"{name!r} is no learned policy: give the folder of a run of `inhand train`; for other controllers there is"
            " `inhand asterisk --controller`"
        )
    trained = entry.policy.trained
    return AsteriskConfig(
        hand=config.hand or trained["hand"],
        object=config.object or trained["object"],
        controller=name,
        engine=config.engine,
        human=config.human,
        trials=config.trials,
        seed=config.seed,
        noise_mm=config.noise_mm,
        noise_deg=config.noise_deg,
        out=config.out,
    )


def _by(test: AsteriskConfig, name: str) -> AsteriskConfig:
    return AsteriskConfig(**(vars(test) | {"controller": name}))


def _learned(run: str) -> Learned | None:
    """Return the record of a policy's training, where its folder has one."""
    return read_learning(Path(run)) if (Path(run) / JOURNAL).is_file() else None


def _write_numbers(config: EvaluateConfig, entry: ControllerEntry, found: Compared, folder: Path) -> None:
    """Write `metrics.json`: every trial of both, and both by direction over the trials that are shown."""
    each = {"policy": found.policy, "expert": found.expert}
    content = {
        "trials": [as_entry(result) for result in found.policy.results],
        "directions": summary_of(found.policy.first[1]),
        "expert": {
            "controller": found.expert.name,
            "trials": [as_entry(result) for result in found.expert.results],
            "directions": summary_of(found.expert.first[1]),
        },
        "failed": {name: [f"{r.direction} {r.trial}" for _, r in e.failed] for name, e in each.items()},
        "policy": entry.policy.trained if entry.policy else None,
        "config": asdict(config),
        "versions": versions(),
        "seed": config.seed,
    }
    write_json(content, folder / "metrics.json")


def _tell(found: Compared) -> None:
    """Print both tables and what failed."""
    for title, group in GROUPS:
        both = f"{title}: {found.policy.name} | {found.expert.name}"
        print_table(both, HEADER, rows(found.policy, found.expert, found.people, group))
    say(summary(found))
    for sentence in failures(found.policy.results):
        say(f"{found.policy.name}, {sentence}")
