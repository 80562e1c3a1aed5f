"""Time of the reach of a hand and an object in all sixteen directions, on one core.

The time is that of this process, so that other work on the machine counts less.

Before it was compiled it took 3.7, 3.4, 7.5, 5.7 and 28 s (commit f1c438a; limits and grips are the same in 72 pairs of
hand and object, to 2e-15 rad). Results that are kept on disk are not used here.
Run: OMP_NUM_THREADS=1 taskset -c 0 python benchmarks/reach_time.py
"""

from __future__ import annotations

import time

import numpy as np

from inhand.hands.family import HandFamily
from inhand.hands.files import load_hand, load_object
from inhand.hands.hand import HandSpec
from inhand.hands.reach.limits import farthest
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import GROUPS
from timing import best_times, environment, verdict

CASES = (
    ("2v2_50.50_50.50_1.1_53", "cube_39", 0.8),
    ("2v2_70.30_50.50_0.9.1_53", "cube_39", 0.8),
    ("2v2_50.50_50.50_1.1_53", "cylinder_40", 1.5),
    ("2v2_50.50_50.50_1.1_53", "hourglass", 1.5),
    ("3v3_25.40.35_40.35.25_1.1_63", "cube_39", 2.0),
)
"""Hands and objects, and the longest time [s]."""
DRAWN, OBJECTS, LONGEST = 20, ("cube_39", "cylinder_40", "triangle"), 2.0
"""Hands that are drawn from the laboratory's range, objects, and the longest time of any [s]."""


def reach(given: str | HandSpec, object_name: str) -> None:
    """Compute the reach in all sixteen directions."""
    hand, spec = load_hand(given), load_object(object_name)
    start = hand.start_pose
    for direction in GROUPS["all"]:
        farthest(hand, spec, start + straight_path(direction, 0.25).poses)


def drawn() -> None:
    """Time hands of the whole family, each once, and print the median and the slowest."""
    rng, family, times = np.random.default_rng(0), HandFamily(limits=("free", "lab")), {}
    for k in range(DRAWN):
        hand = family.drawn(f"hand {k}", rng)
        told = "v".join(str(len(finger.links)) for finger in hand.fingers)
        for name in OBJECTS:
            began = time.process_time()
            reach(hand, name)
            times[f"{told}, palm {1e3 * hand.palm_width:.0f} mm, {name}"] = time.process_time() - began
    slowest = max(times, key=lambda name: times[name])
    print(f"{DRAWN} drawn hands x {len(OBJECTS)} objects: median {np.median(list(times.values())):.2f} s")
    print(f"{slowest:42s} {times[slowest]:6.2f} s  (at most {LONGEST}: {verdict(times[slowest] < LONGEST)})")


def main() -> None:
    """Time all cases and print the results."""
    cases = {f"{hand} {spec}": (lambda hand=hand, spec=spec: reach(hand, spec)) for hand, spec, _ in CASES}
    times = best_times(cases, time.process_time, repeats=3, calls=1)
    print(environment())
    for (name, seconds), (*_, longest) in zip(times.items(), CASES, strict=True):
        print(f"{name:42s} {seconds:6.2f} s  (at most {longest}: {verdict(seconds < longest)})")
    drawn()


if __name__ == "__main__":
    main()
