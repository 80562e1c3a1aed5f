"""How a controller fares under each level of disturbance: drops, and how much of its undisturbed way it keeps.

The Asterisk Test in 16 directions with the standard hand and cube; a dropped object counts as no way. Drops have Wilson
95 % intervals (Wilson 1927), retention one by bootstrap over the trials (1,000 draws).

Bounds for `ik-sensed` at `field`: retention at least 0.85, drops at most 3 %.
Run: python benchmarks/levels.py [CONTROLLER] [TRIALS] [SEED]     (ik-sensed, 63 trials, seed 11: some minutes)
"""

from __future__ import annotations

import sys

import numpy as np
import pandas as pd

import inhand
from inhand.geometry import Array
from inhand.sim.disturbance import DISTURBANCES
from timing import environment

LOST = ("lost contact", "no grasp", "diverged")
COLUMNS = ("level", "trials", "drops", "95 %", "share", "least", "retention", "95 %", "lateral [mm]", "turn [deg]")


def wilson(count: int, total: int) -> tuple[float, float]:
    """Return the 95 % interval of a share."""
    z = 1.96
    middle, width = count + z * z / 2, z * np.sqrt(count * (1 - count / total) + z * z / 4)
    return (middle - width) / (total + z * z), (middle + width) / (total + z * z)


def row(level: str, table: pd.DataFrame, whole: Array) -> str:
    """Return a row of the table; `whole` are the undisturbed ways of the same trials [mm]."""
    lost = table.outcome.isin(LOST).to_numpy()
    way = np.where(lost, 0.0, table.distance_mm)
    low, high = wilson(int(lost.sum()), len(lost))
    drawn = np.random.default_rng(0).integers(len(way), size=(1000, len(way)))
    kept = np.quantile(way[drawn].mean(axis=1) / whole[drawn].mean(axis=1), (0.025, 0.975))
    share = (way / table.limit_mm).groupby(table.direction).mean()
    lateral, turn = (table[~lost][name].quantile([0.5, 0.95]) for name in ("lateral_max_mm", "rotation_max_deg"))
    cells = [
        *(level, str(len(way)), str(lost.sum()), f"{100 * low:.1f} to {100 * high:.1f} %"),
        *(f"{share.mean():.3f}", f"{share.min():.2f}"),
        *(f"{way.mean() / whole.mean():.3f}", f"{kept[0]:.3f} to {kept[1]:.3f}"),
        *(f"{each[0.5]:.1f}, {each[0.95]:.1f}" for each in (lateral, turn)),
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Run every level and print the table."""
    controller, trials, seed = (*sys.argv[1:], *("ik-sensed", "63", "11")[len(sys.argv) - 1 :])
    print(environment(), f"controller {controller}, seed {seed}; lateral and turn: median and 95 % of what was kept")
    print(f"| {' | '.join(COLUMNS)} |")
    print("|---" * len(COLUMNS) + "|")
    whole = None
    for level in ("none", *DISTURBANCES):
        run = inhand.asterisk(controller=controller, trials=int(trials), seed=int(seed), disturb=level)
        table = run.table()
        whole = table.distance_mm.to_numpy() if whole is None else whole
        print(row(level, table, whole), flush=True)


if __name__ == "__main__":
    main()
