"""`inhand sweep`: every hand with every object, and which hand is best at what."""

from __future__ import annotations

import time

from inhand.asterisk_test.sweep import tables
from inhand.asterisk_test.sweep.cells import read_cell
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.asterisk_test.sweep.page import write_sweep
from inhand.asterisk_test.sweep.summary import sweep_of
from inhand.asterisk_test.sweep.sweep import Plan, computed, plan
from inhand.cli.terminal import print_table, progress, say
from inhand.tasks.primitives import parse_directions

SPEED_OVER_S = 3600.0
"""The time left is told from the cells of the last hour [s]: a cell can take longer than rich's half minute."""


def run_sweep(config: SweepConfig) -> None:
    """Compute what the folder does not hold yet, write report and heat maps, and print the answer."""
    began = time.perf_counter()
    found = plan(config)
    total, waiting = len(found.jobs), len(found.waiting)
    say(f"{total} cells, {total - waiting} of them already in {config.out}, {waiting} to compute")
    _compute(found, config.jobs)
    sweep = sweep_of((read_cell(job.path) for job in found.jobs), parse_directions(config.directions))
    write_sweep(config, sweep, time.perf_counter() - began)
    for make in (tables.hands_table, tables.best_by_direction, tables.best_by_object):
        table = make(sweep)
        print_table(table.title, table.header, table.rows)
    for sentence in (*tables.summary(sweep), *tables.failures(sweep)):
        say(sentence)
    for sentence in tables.beyond(sweep):
        say(f"Beyond the limit: {sentence}")
    say(f"Report: {config.out / 'report.md'}")


def _compute(found: Plan, at_a_time: int) -> None:
    """Compute the waiting cells and show how far it is; where nobody watches, one line for each cell."""
    total, done = len(found.jobs), len(found.jobs) - len(found.waiting)
    with progress(spoken=True, over_s=SPEED_OVER_S) as tell:
        tell("cells", done, total)
        try:
            for job in computed(found.waiting, at_a_time):
                done += 1
                tell(" with ".join(job.names), done, total)
        except KeyboardInterrupt:
            say(f"{done} of {total} cells are computed; the same command goes on from there")
            raise
