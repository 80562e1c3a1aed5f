"""`inhand evaluate`: a learned policy beside the expert from the same starts, and what failed and why."""

from inhand.asterisk_test.table import failures
from inhand.cli.answer import Answer, Listing, of_run
from inhand.cli.asterisk import simulated
from inhand.folders import run_folder
from inhand.learning.commands import EvaluateConfig
from inhand.learning.evaluate import finish_evaluation, ready_evaluation

SPARE = ("Contact", "Turn [deg]", "Human [mm]")
"""Columns that a narrow terminal does without, the first first."""


def run_evaluate(config: EvaluateConfig) -> Answer:
    """Check everything, run policy and expert from the same starts, and put the report in its place."""
    known = ready_evaluation(config)
    with run_folder(config.out, overwrite=config.overwrite) as folder:
        found = finish_evaluation(config, known, simulated)
        found.write(folder)
    from inhand.learning.report import summary

    names = f"{found.policy.name} | {found.expert.name}"
    tables = [Listing(f"{title}: {names}", header, cells, spare=SPARE) for title, header, cells in found.tables]
    lost = (f"{found.policy.name}, {sentence}" for sentence in failures(found.policy.results))
    return of_run(found, config.out, tables, (summary(found), *lost, f"Report: {config.out / 'report.html'}"))
