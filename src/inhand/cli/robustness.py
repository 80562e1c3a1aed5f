"""`inhand robustness`: every controller under every disturbance, and what it keeps of its way."""

from inhand.asterisk_test.robustness import run
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.cli.answer import Answer, Listing, of_run
from inhand.cli.cells import shown


def run_robustness(config: RobustnessConfig) -> Answer:
    """Compute what the folder does not hold yet, write report and figures, and return the answer."""
    done = run.run_robustness(config, shown(config.out))
    done.save(config.out)
    from inhand.asterisk_test.robustness import tables

    table = tables.kept_table(done.found)
    told = (*tables.summary(done.found), *done.notes, *done.found.stopped, f"Report: {config.out / 'report.html'}")
    return of_run(done, config.out, [Listing(table.title, table.header, table.rows)], told)
