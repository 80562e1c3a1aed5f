"""Time of the reach of a hand and an object in all sixteen directions, on one core.

The time is that of this process, so that other work on the machine counts less.

Bound: two-link fingers and a cube in less than 5 s.
Run: OMP_NUM_THREADS=1 taskset -c 0 python benchmarks/reach_time.py
"""

from __future__ import annotations

import time

from inhand.hands.files import load_hand, load_object
from inhand.hands.reach.limits import farthest
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import GROUPS
from timing import best_times, environment, verdict

LONGEST = 5.0
"""Longest time for two-link fingers and a cube [s]."""
CASES = (
    ("2v2_50.50_50.50_1.1_53", "cube_39"),
    ("2v2_70.30_50.50_0.9.1_53", "cube_39"),
    ("2v2_50.50_50.50_1.1_53", "cylinder_40"),
    ("2v2_50.50_50.50_1.1_53", "hourglass"),
    ("3v3_25.40.35_40.35.25_1.1_63", "cube_39"),
)
"""Hands and objects."""


def reach(hand_name: str, object_name: str) -> None:
    """Compute the reach in all sixteen directions."""
    hand, spec = load_hand(hand_name), load_object(object_name)
    start = hand.start_pose
    for direction in GROUPS["all"]:
        farthest(hand, spec, start + straight_path(direction, 0.25).poses)


def main() -> None:
    """Time all cases and print the results."""
    cases = {f"{hand} {spec}": (lambda hand=hand, spec=spec: reach(hand, spec)) for hand, spec in CASES}
    times = best_times(cases, time.process_time, repeats=2, calls=1)
    print(environment())
    for number, (name, seconds) in enumerate(times.items()):
        bound = f"  (at most {LONGEST}: {verdict(seconds < LONGEST)})" if number < 2 else ""
        print(f"{name:42s} {seconds:6.1f} s{bound}")


if __name__ == "__main__":
    main()
