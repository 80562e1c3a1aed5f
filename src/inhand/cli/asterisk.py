"""`inhand asterisk`: run the Asterisk Test, write its report and print its table."""

from inhand.aside import second_process
from inhand.asterisk_test.asterisk import finish, ready, run_setup
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.regrasped import HEADER, TITLE
from inhand.asterisk_test.run import Setup
from inhand.asterisk_test.spatial.run import SpatialSetup
from inhand.asterisk_test.table import failures, shown_columns, with_beside
from inhand.cli.answer import Answer, Listing, of_run
from inhand.cli.terminal import trials_shown
from inhand.control.trial import AnyTrial
from inhand.folders import run_folder
from inhand.sim.engines import compile_aside

SPARE = ("Overlap", "Force", "Gap [s]", "Contact", "Eff.", "Turn", "Lateral", "Of limit", "Limit [mm]")
"""Columns that a narrow terminal does without, the first first."""


def run_asterisk(config: AsteriskConfig) -> Answer:
    """Check everything, simulate, measure, put the finished run in its place, and return its table."""
    known = ready(config)
    with (
        run_folder(config.out, overwrite=config.overwrite) as folder,
        second_process("inhand.asterisk_test.report") as aside,
    ):
        if isinstance(known.setup, Setup):
            compile_aside(aside, config.engine)
        run = finish(config, known, simulated)
        run.write(folder, aside)
    header, rows = with_beside(*shown_columns(run.rows), run.name, run.beside)
    sentences = (*failures(run.results), *run.notes, f"Report: {config.out / 'report.html'}")
    tables = [Listing(run.subject, header, rows, spare=SPARE)]
    if run.apart_rows:
        tables.append(Listing(TITLE, HEADER, run.apart_rows))
    return of_run(run, config.out, tables, sentences)


def simulated(config: AsteriskConfig, setup: Setup | SpatialSetup) -> tuple[AnyTrial, ...]:
    """Run every trial of a setup and show how far it is."""
    with trials_shown(len(setup.assignments)) as show:
        return run_setup(config, setup, show)
