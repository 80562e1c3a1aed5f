"""`inhand sweep`: every hand with every object, and which hand is best at what."""

from inhand.asterisk_test.sweep import run
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.cli.answer import Answer, Listing, of_run
from inhand.cli.cells import shown

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


def run_sweep(config: SweepConfig) -> Answer:
    """Compute what the folder does not hold yet, write report and heat maps, and return the answer."""
    done = run.run_sweep(config, shown(config.out))
    done.save(config.out)
    from inhand.asterisk_test.sweep import tables

    found = (make(done.sweep) for make in (tables.hands_table, tables.best_by_direction, tables.best_by_object))
    shown_tables = (*found, *tables.anew_tables(done.sweep))
    listings = [Listing(table.title, table.header, table.rows, spare=SPARE) for table in shown_tables]
    beyond = (f"Beyond the limit: {sentence}" for sentence in tables.beyond(done.sweep))
    told = (*tables.summary(done.sweep), *done.notes, *tables.failures(done.sweep), *beyond)
    return of_run(done, config.out, listings, (*told, f"Report: {config.out / 'report.html'}"))
