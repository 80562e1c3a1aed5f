"""`inhand sweep`: every hand with every object, and which hand is best at what."""

from inhand.asterisk_test.sweep import run
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.cli.cells import shown
from inhand.cli.terminal import print_table, say

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


def run_sweep(config: SweepConfig) -> None:
    """Compute what the folder does not hold yet, write report and heat maps, and print the answer."""
    done = run.run_sweep(config, shown(config.out))
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
