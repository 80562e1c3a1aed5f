"""The lazy rehearsal against carrying every grasp: the same choices, and the time that they take.

Both close the grasps of 16 directions, three noisy starts each, in the planar engine; the time is that of the process.
Prints too what the search takes, without its cache, and how many of the grasps are carried.

Bound: the standard pair is rehearsed at least 2.8 times as fast.
Run: OMP_NUM_THREADS=1 python benchmarks/rehearsal.py
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from inhand.caches import PLACE
from inhand.control import rehearsal
from inhand.control.draws import start_noise
from inhand.control.run_config import RunConfig
from inhand.geometry import Array
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.hands.grasp_search import PLAN_EVERY, GraspPlan, plan_grasps
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import GROUPS
from timing import best_times, environment, verdict

PAIRS = (
    ("2v2_50.50_50.50_1.1_53", "cube_39"),
    ("2v2_65.35_65.35_1.1_53", "cylinder_40"),
    ("2v3_25.75_25.35.40_1.1_53", "ellipse_40x25"),
)
TRIALS = 3
BOUND = 2.8
Find = Callable[[NDArray[np.int64]], Array]


def best_of_all(worth: Array, most: Array, owner: NDArray[np.int64], find: Find) -> list[int]:
    """Choose as `rehearsal.first_best` does, but carry every grasp."""
    del most
    unknown = np.flatnonzero(np.isneginf(worth))
    worth[unknown] = find(unknown)
    return [int(np.flatnonzero(owner == k)[worth[owner == k].argmax()]) for k in range(owner[-1] + 1)]


def row(hand_name: str, object_name: str) -> tuple[str, float]:
    """Return the line of one pair, and how many times as fast it is."""
    held = Held(load_hand(hand_name), load_object(object_name))
    lines = np.stack([held.hand.start_pose + straight_path(direction).poses for direction in GROUPS["all"]])
    whose = [(direction.angle_deg, 0.0, k) for direction in GROUPS["all"] for k in range(TRIALS)]
    starts = held.hand.start_pose + start_noise(RunConfig(), whose)
    begin = time.process_time()
    plans = plan_grasps(*held, lines[:, ::PLAN_EVERY])
    searched = time.process_time() - begin
    groups, where = [group for group in plans for _ in range(TRIALS)], (np.repeat(lines, TRIALS, axis=0), starts)
    found: dict[str, list[GraspPlan]] = {}

    def rehearse(name: str, choose: Callable[[Array, Array, NDArray[np.int64], Find], list[int]]) -> None:
        with mock.patch.object(rehearsal, "first_best", choose):
            found[name], _ = rehearsal.farthest(held, groups, where, (None, False), "planar")

    cases = {"lazy": rehearsal.first_best, "all": best_of_all}
    turns = {name: (lambda name=name, choose=choose: rehearse(name, choose)) for name, choose in cases.items()}
    times = best_times(turns, time.process_time, repeats=3, calls=1)
    same = sum(one is other for one, other in zip(found["lazy"], found["all"], strict=True))
    told = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in times.items())
    faster = times["all"] / times["lazy"]
    line = f"{hand_name} {object_name}: {same} of {len(groups)} choices the same; search {searched:.2f} s, {told}"
    return f"{line}: {faster:.2f} times", faster


def main() -> None:
    """Compare and print."""
    os.environ[PLACE] = "off"
    print(environment())
    row(*PAIRS[0])  # compiles, or reads what was compiled
    for number, pair in enumerate(PAIRS):
        line, faster = row(*pair)
        print(line + (f" (at least {BOUND}: {verdict(faster >= BOUND)})" if number == 0 else ""), flush=True)


if __name__ == "__main__":
    main()
