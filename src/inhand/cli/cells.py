"""The cells of a study as they are computed, shown."""

from collections.abc import Iterator
from pathlib import Path

from inhand.asterisk_test.cells import Job
from inhand.asterisk_test.spread import Compute, Plan, computed
from inhand.cli.terminal import progress, say
from inhand.control.run_config import SpreadConfig

SPEED_OVER_S = 3600.0
"""The time left is told from the cells of the last hour [s]: a cell can take longer than rich's half minute."""


def shown(out: Path) -> Compute:
    """Return what computes the cells of a study in a folder and shows how far it is."""

    def compute(found: Plan, config: SpreadConfig) -> Iterator[Job]:
        total, waiting = len(found.jobs), len(found.waiting)
        say(f"{total} cells, {total - waiting} of them already in {out}, {waiting} to compute")
        return _shown(found, config)

    return compute


def _shown(found: Plan, config: SpreadConfig) -> Iterator[Job]:
    """Compute the waiting cells and show how far it is; where nobody watches, one line for each cell."""
    total, done = len(found.jobs), len(found.jobs) - len(found.waiting)
    with progress(spoken=True, over_s=SPEED_OVER_S) as tell:
        tell("cells", done, total)
        try:
            for job in computed(found, config):
                done += 1
                tell(job.label, done, total)
                yield job
        except KeyboardInterrupt:
            say(f"{done} of {total} cells are computed; the same command goes on from there")
            raise
