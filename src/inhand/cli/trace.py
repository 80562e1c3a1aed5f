"""`inhand trace`: trace a drawing with the object, or do a task, write the report and print its table."""

from inhand.aside import second_process
from inhand.cli.answer import Answer, Listing, of_run
from inhand.cli.terminal import progress, trials_shown
from inhand.folders import run_folder
from inhand.sim.engines import compile_aside
from inhand.tracing import tracing
from inhand.tracing.config import MARK, TraceConfig
from inhand.tracing.follow import Followed
from inhand.tracing.run import TraceSetup, check_trace, prepare_trace, simulate_trace
from inhand.tracing.table import faults, trace_rows, what_was_done
from inhand.tracing.trace import Trace

SPARE = ("Overlap [mm]", "Force [N]", "Fréchet [mm]", "Time [s]")
"""Columns that a narrow terminal does without, the first first."""


def run_trace(config: TraceConfig) -> Answer:
    """Check everything, simulate, measure, put the finished run in its place, and return its table."""
    check_trace(config)
    with (
        run_folder(config.out, overwrite=config.overwrite, mark=MARK) as folder,
        second_process("inhand.plots.replay") as aside,
    ):
        compile_aside(aside, config.engine)
        run = tracing.run_trace(config, prepared, simulated)
        run.write(folder, aside)
    header, rows = trace_rows(run.traces)
    title = f"{what_was_done(run.setup)}: {run.setup.object.name}, {run.setup.hand.name}"
    told = (*faults(run.setup, run.followed, run.traces), *run.notes, f"Report: {config.out / 'report.html'}")
    return of_run(run, config.out, [Listing(title, header, rows, numbers=2, spare=SPARE)], told)


def prepared(config: TraceConfig) -> TraceSetup:
    """Return a run's setup and show how the search for what the hand can reach goes."""
    with progress() as tell:
        return prepare_trace(config, tell)


def simulated(config: TraceConfig, setup: TraceSetup) -> tuple[tuple[Followed, ...], tuple[Trace, ...]]:
    """Run every trial of a setup and show how far it is."""
    with trials_shown(len(setup.plans)) as show:
        return simulate_trace(config, setup, show)
