"""`inhand trace`: trace a drawing with the object, or do a task, and write the report."""

from __future__ import annotations

from dataclasses import asdict

from inhand.asterisk_test.results import write_json
from inhand.cli.asterisk import write_trials
from inhand.cli.terminal import print_table, progress, say, trials_shown
from inhand.control.catalogue import notes_of
from inhand.folders import run_folder
from inhand.tracing.config import TraceConfig
from inhand.tracing.follow import Followed
from inhand.tracing.report import TraceRun, write_trace
from inhand.tracing.run import TraceSetup, check_trace, prepare_trace, simulate_trace
from inhand.tracing.table import faults, trace_entry, trace_rows, what_was_done
from inhand.tracing.trace import Trace
from inhand.versions import versions

MARK = "trace.json"
"""The file that marks a folder as one of this command."""


def run_trace(config: TraceConfig) -> None:
    """Check everything, simulate, measure, and put the finished run in its place."""
    check_trace(config)
    with run_folder(config.out, overwrite=config.overwrite, mark=MARK) as folder:
        setup = prepared(config)
        followed, traces = simulated(config, setup)
        notes = (*setup.notes, *notes_of(setup.controller, config.hand, config.object))
        write_trials([each.trial for each in followed], folder)
        write_trace(TraceRun(config, setup, followed, traces, notes), folder)
        origin = setup.hand.start_pose
        content = {
            "trials": [trace_entry(each, trace, origin) for each, trace in zip(followed, traces, strict=True)],
            "size_mm": None if setup.size is None else 1e3 * setup.size,
            "config": asdict(config),
            "versions": versions(),
            "seed": config.seed,
        }
        write_json(content, folder / MARK)
    header, rows = trace_rows(traces)
    print_table(f"{what_was_done(setup)}: {config.object}, {config.hand}", header, rows, numbers=2)
    for sentence in (*faults(setup, followed, traces), *notes):
        say(sentence)
    say(f"Report: {config.out / 'report.md'}")


def prepared(config: TraceConfig) -> TraceSetup:
    """Return a run's setup and show how the search for what the hand can reach goes."""
    with progress() as tell:
        return prepare_trace(config, tell)


def simulated(config: TraceConfig, setup: TraceSetup) -> tuple[tuple[Followed, ...], tuple[Trace, ...]]:
    """Run every trial of a setup and show how far it is."""
    with trials_shown(len(setup.plans)) as show:
        return simulate_trace(config, setup, show)
