"""`inhand reach`: how far a hand could carry an object."""

import itertools

import numpy as np

from inhand.asterisk_test.config import ReachCommand
from inhand.asterisk_test.reach import compute_reach, ready_reach
from inhand.asterisk_test.reached import MARK
from inhand.cli.answer import Answer, Listing, of_run
from inhand.cli.terminal import progress
from inhand.folders import run_folder
from inhand.tasks.reach import Limit
from inhand.tasks.spatial.reach import SpatialLimit


def run_reach(config: ReachCommand) -> Answer:
    """Check everything, compute the limits, write JSON and figures, and return the table."""
    asked = ready_reach(config)
    with run_folder(config.out, overwrite=config.overwrite, mark=MARK) as folder:
        with progress() as tell:
            done = itertools.count(1)
            found = compute_reach(config, asked, lambda name, total: tell(name, next(done), total))
        found.write(folder)
    table = Listing("Reach", ("Direction", "Limit"), [(f.primitive.name, _shown(f)) for f in found.limits])
    written = f"Written to {config.out}: {MARK} and the figures"
    return of_run(found, config.out, [table], (found.subtitle, *found.notes, written))


def _shown(limit: Limit | SpatialLimit) -> str:
    where = limit.primitive.direction if isinstance(limit, SpatialLimit) else limit.primitive.angle_deg
    return f"{np.rad2deg(limit.distance):.1f} deg" if where is None else f"{1e3 * limit.distance:.1f} mm"
