"""`inhand evaluate`: a learned policy beside the expert from the same starts, and what failed and why."""

from inhand.asterisk_test.comparison import GROUPS, HEADER, rows
from inhand.asterisk_test.table import failures
from inhand.cli.asterisk import simulated
from inhand.cli.terminal import print_table, say
from inhand.folders import run_folder
from inhand.learning.commands import EvaluateConfig
from inhand.learning.evaluate import finish_evaluation, ready_evaluation

SPARE = ("Contact", "Turn [deg]", "Human [mm]")
"""Columns that a narrow terminal does without, the first first."""


def run_evaluate(config: EvaluateConfig) -> None:
    """Check everything, run policy and expert from the same starts, and put the report in its place."""
    known = ready_evaluation(config)
    with run_folder(config.out, overwrite=config.overwrite) as folder:
        found = finish_evaluation(config, known, simulated)
        found.write(folder)
    from inhand.learning.report import summary

    for title, group in GROUPS:
        both = f"{title}: {found.policy.name} | {found.expert.name}"
        print_table(both, HEADER, rows(found.policy, found.expert, found.people, group), spare=SPARE)
    say(summary(found))
    for sentence in failures(found.policy.results):
        say(f"{found.policy.name}, {sentence}")
    say(f"Report: {config.out / 'report.md'}")
