"""The lazy rehearsal against carrying every grasp: the same choices, and the time that they take.

Both close the grasps of 16 directions, three noisy starts each, in the planar engine; the time is that of the process.
Prints too what the search takes, without its cache, and how many of the grasps are carried. The standard pair is then
rehearsed by the last commit without the lazy rehearsal, in the same engine, and by this one, in turns: besides the
candidates that are not carried, worlds that ended are not stepped since, and predictions are compiled.

Bound: the standard pair is rehearsed at least 2.8 times as fast as by that commit.
Run: OMP_NUM_THREADS=1 python benchmarks/rehearsal.py
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from before import checkout
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
from timing import best_times, environment, verdict, wall_time

PAIRS = (
    ("2v2_50.50_50.50_1.1_53", "cube_39"),
    ("2v2_65.35_65.35_1.1_53", "cylinder_40"),
    ("2v3_25.75_25.35.40_1.1_53", "ellipse_40x25"),
)
TRIALS = 3
BOUND = 2.8
BEFORE = "2b74c62"
"""The last commit without the lazy rehearsal."""
REHEARSED = """
import sys, time
import numpy as np
from inhand.control import rehearsal
from inhand.control.draws import start_noise
from inhand.control.run_config import RunConfig
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import GROUPS
held = Held(load_hand("2v2_50.50_50.50_1.1_53"), load_object("cube_39"))
poses = np.stack([held.hand.start_pose + straight_path(each).poses for each in GROUPS["all"] for _ in range(3)])
whose = [(each.angle_deg, 0.0, k) for each in GROUPS["all"] for k in range(3)]
starts = held.hand.start_pose + start_noise(RunConfig(), whose)
found, search = {}, rehearsal.plan_grasps
def searched(*args, **named):
    key = args[2].tobytes(), str(args[3:]), str(named)
    if key not in found:
        found[key] = search(*args, **named)
    return found[key]
rehearsal.plan_grasps = searched
choose = getattr(rehearsal, "rehearsed", None) or rehearsal.best_grasps
times = []
for _ in range(4):
    begin = time.process_time()
    choose(held, poses, starts, engine="planar")
    times.append(time.process_time() - begin)
open(sys.argv[1], "w").write(str(min(times[1:])))
"""
"""Rehearses the standard pair's grasps in either commit, searched for before, and writes the least time [s]."""
Find = Callable[[NDArray[np.int64]], Array]


def best_of_all(worth: Array, most: Array, owner: NDArray[np.int64], find: Find) -> list[int]:
    """Choose as `rehearsal.first_best` does, but carry every grasp."""
    del most
    unknown = np.flatnonzero(np.isneginf(worth))
    worth[unknown] = find(unknown)
    return [int(np.flatnonzero(owner == k)[worth[owner == k].argmax()]) for k in range(owner[-1] + 1)]


def row(hand_name: str, object_name: str) -> str:
    """Return the line of one pair, with how many times as fast it is."""
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
    line = f"{hand_name} {object_name}: {same} of {len(groups)} choices the same; search {searched:.2f} s, {told}"
    return f"{line}: {times['all'] / times['lazy']:.2f} times"


def rehearsed_by(root: Path) -> float:
    """Return the processor time in which a checkout rehearses the standard pair [s]."""
    with tempfile.TemporaryDirectory() as folder:
        variables, told = os.environ | {"PYTHONPATH": str(root / "src"), PLACE: folder}, Path(folder) / "seconds"
        wall_time([sys.executable, "-c", REHEARSED, str(told)], variables)
        return float(told.read_text(encoding="utf-8"))


def main() -> None:
    """Compare and print."""
    os.environ[PLACE] = "off"
    print(environment())
    row(*PAIRS[0])  # compiles, or reads what was compiled
    for pair in PAIRS:
        print(row(*pair), flush=True)
    with checkout(BEFORE) as before:
        roots = {"before": before, "now": Path(__file__).resolve().parents[1]}
        turns = [{name: rehearsed_by(root) for name, root in roots.items()} for _ in range(3)]
    took = {name: min(turn[name] for turn in turns) for name in roots}
    faster = took["before"] / took["now"]
    told = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in took.items())
    print(f"all of it, by {BEFORE} and now: {told}: {faster:.2f} times (at least {BOUND}: {verdict(faster >= BOUND)})")


if __name__ == "__main__":
    main()
