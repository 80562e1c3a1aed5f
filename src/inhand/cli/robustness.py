"""`inhand robustness`: every controller under every disturbance, and what it keeps of its way."""

from inhand.asterisk_test.robustness import run
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.cli.cells import shown
from inhand.cli.terminal import print_table, say


def run_robustness(config: RobustnessConfig) -> None:
    """Compute what the folder does not hold yet, write report and figures, and print the answer."""
    done = run.run_robustness(config, shown(config.out))
    done.save(config.out)
    from inhand.asterisk_test.robustness import tables

    table = tables.kept_table(done.found)
    print_table(table.title, table.header, table.rows)
    for sentence in (*tables.summary(done.found), *done.notes, *done.found.stopped):
        say(sentence)
    say(f"Report: {config.out / 'report.md'}")
