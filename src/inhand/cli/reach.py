"""`inhand reach`: how far a hand could carry an object."""

import itertools

import numpy as np

from inhand.asterisk_test.config import ReachCommand
from inhand.asterisk_test.reach import MARK, compute_reach, ready_reach
from inhand.cli.terminal import print_table, progress, say
from inhand.folders import run_folder
from inhand.tasks.reach import Limit


def run_reach(config: ReachCommand) -> None:
    """Check everything, compute the limits, write JSON and figures, and print the table."""
    asked = ready_reach(config)
    with run_folder(config.out, overwrite=config.overwrite, mark=MARK) as folder:
        with progress() as tell:
            done = itertools.count(1)
            found = compute_reach(config, asked, lambda name, total: tell(name, next(done), total))
        found.write(folder)
    print_table("Reach", ("Direction", "Limit"), [(f.primitive.name, _shown(f)) for f in found.limits])
    for sentence in (found.subtitle, *found.notes):
        say(sentence)
    say(f"Written to {config.out}: {MARK} and the figures")


def _shown(limit: Limit) -> str:
    if limit.primitive.angle_deg is None:
        return f"{np.rad2deg(limit.distance):.1f} deg"
    return f"{1e3 * limit.distance:.1f} mm"
