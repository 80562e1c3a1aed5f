"""How steady the expert is towards the palm: many noisy starts of In-Right and In-Left, one batch for each direction.

Prints one Markdown row for each direction: shares of the hand's own limit, trials under the bound, trials lost.

Bound: no trial under 0.78 of the limit.
Run: python benchmarks/starts.py
"""

from __future__ import annotations

from itertools import product

import numpy as np

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare, simulate

DIRECTIONS = ("In-Right", "In-Left")
TRIALS = 300
"""Starts of each direction."""
SEEDS = (23, 7, 11)
LEAST = 0.78
"""Share of the limit asked of every trial."""


def row(direction: str, seed: int) -> str:
    """Return the Markdown row of one direction."""
    config = AsteriskConfig(directions=direction, trials=TRIALS, seed=seed)
    results = [result_of_trial(trial) for trial in simulate(config, prepare(config))]
    shares = np.array([result.reached / (result.limit or np.inf) for result in results])
    levels = (shares.min(), np.quantile(shares, 0.01), np.median(shares), shares.mean())
    counts = int((shares < LEAST).sum()), sum(not result.kept for result in results)
    return "| " + " | ".join([direction, str(seed), *(f"{level:.3f}" for level in levels), *map(str, counts)]) + " |"


def main() -> None:
    """Run both directions with each seed and print the table."""
    print(f"{TRIALS} starts each\n")
    print(f"| direction | seed | least | 1 % | median | mean | under {LEAST} | lost |")
    print("| --- " * 8 + "|")
    for seed, direction in product(SEEDS, DIRECTIONS):
        print(row(direction, seed), flush=True)


if __name__ == "__main__":
    main()
