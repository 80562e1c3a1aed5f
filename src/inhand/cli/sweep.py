"""`inhand sweep`: every hand with every object, and which hand is best at what."""

from collections.abc import Iterator

from inhand.asterisk_test.sweep import run
from inhand.asterisk_test.sweep.cells import Job
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.asterisk_test.sweep.sweep import Plan, computed
from inhand.cli.terminal import print_table, progress, say

SPARE = (
    "Least",
    "Median",
    "Limit [L]",
    "Farthest for its size",
    "Distance [L]",
    "Second",
    "Its distance",
    "Kept",
    "Limit [mm]",
)
"""Columns that a narrow terminal does without, the first first."""
SPEED_OVER_S = 3600.0
"""The time left is told from the cells of the last hour [s]: a cell can take longer than rich's half minute."""


def run_sweep(config: SweepConfig) -> None:
    """Compute what the folder does not hold yet, write report and heat maps, and print the answer."""

    def compute(found: Plan, at_a_time: int) -> Iterator[Job]:
        total, waiting = len(found.jobs), len(found.waiting)
        say(f"{total} cells, {total - waiting} of them already in {config.out}, {waiting} to compute")
        return _shown(found, at_a_time)

    done = run.run_sweep(config, compute)
    done.save(config.out)
    from inhand.asterisk_test.sweep import tables

    for make in (tables.hands_table, tables.best_by_direction, tables.best_by_object):
        table = make(done.sweep)
        print_table(table.title, table.header, table.rows, spare=SPARE)
    for sentence in (*tables.summary(done.sweep), *done.notes, *tables.failures(done.sweep)):
        say(sentence)
    for sentence in tables.beyond(done.sweep):
        say(f"Beyond the limit: {sentence}")
    say(f"Report: {config.out / 'report.md'}")


def _shown(found: Plan, at_a_time: int) -> Iterator[Job]:
    """Compute the waiting cells and show how far it is; where nobody watches, one line for each cell."""
    total, done = len(found.jobs), len(found.jobs) - len(found.waiting)
    with progress(spoken=True, over_s=SPEED_OVER_S) as tell:
        tell("cells", done, total)
        try:
            for job in computed(found.waiting, at_a_time):
                done += 1
                tell(" with ".join(job.names), done, total)
                yield job
        except KeyboardInterrupt:
            say(f"{done} of {total} cells are computed; the same command goes on from there")
            raise
