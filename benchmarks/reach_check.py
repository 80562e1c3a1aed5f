"""Reach beside the brute-force search of the tests, for three hands and a cube in all sixteen directions.

Bound: within 1 mm everywhere. Takes about four minutes.
Run: python benchmarks/reach_check.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from inhand.hands.files import load_hand, load_object
from inhand.hands.reach.limits import farthest
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import GROUPS
from timing import environment, verdict

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from brute_contacts import Grid
from brute_reach import brute_reach

HANDS = ("2v2_50.50_50.50_1.1_53", "2v2_65.35_65.35_1.1_53", "2v2_70.30_50.50_0.9.1_53")
"""Two hands that are symmetric, and one that is not."""
GRID = Grid(step=0.002, slide=0.002, turn=np.deg2rad(3.0))
"""The search's grid."""
LARGEST = 1e-3
"""Largest difference [m]."""


def main() -> None:
    """Print both reaches of every hand and direction, and the largest difference."""
    spec = load_object("cube_39")
    print(environment())
    print(f"{'hand':26s} {'direction':13s} brute  reach  difference [mm]")
    largest = 0.0
    for name in HANDS:
        hand = load_hand(name)
        for direction in GROUPS["all"]:
            path = hand.start_pose + straight_path(direction, 0.25).poses
            found = farthest(hand, spec, path)
            brute = brute_reach(hand, spec.size[0], hand.friction * spec.friction, direction.unit, GRID)
            way = -1.0 if found is None else found.way
            largest = max(largest, abs(way - brute))
            print(f"{name:26s} {direction.name:13s} {1e3 * brute:6.2f} {1e3 * way:6.2f} {1e3 * (way - brute):6.2f}")
    print(f"largest difference {1e3 * largest:.2f} mm  (at most 1: {verdict(largest <= LARGEST)})")


if __name__ == "__main__":
    main()
