"""What disturbances cost: decisions in the grip on one core, of environments with and without, taking turns.

Bounds: a batch under `field` is at most 15 % slower than an undisturbed one.
Run: python benchmarks/disturbed.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import inhand
from inhand.sim.disturbance import BENCH, FIELD, HARD
from timing import best_times, environment, verdict

WORLDS, DECISIONS = 64, 20
"""Environments, and decisions that are timed in one go."""
SLOWER = 1.15
"""Most that a decision under `field` may take of an undisturbed one."""


def decisions() -> dict[str, float]:
    """Return what a decision of environments takes on one core [us], undisturbed and under the levels."""
    levels = ("none", BENCH.name, FIELD.name, HARD.name)
    settings = {"starts": WORLDS, "grasp": "rough", "engine": "planar", "threads": 1}
    batches = {each: inhand.make("easy", num_envs=WORLDS, disturb=each, **settings) for each in levels}
    for batch in batches.values():
        batch.reset(seed=0)
    shape = (DECISIONS, *(batches["none"].action_space.shape or ()))
    actions = np.random.default_rng(0).uniform(-0.1, 0.1, shape)

    def deciding(level: str) -> Callable[[], None]:
        def decide() -> None:
            for action in actions:
                batches[level].step(action)

        return decide

    best = best_times({each: deciding(each) for each in levels}, time.process_time, repeats=40, calls=1)
    return {each: 1e6 * seconds / DECISIONS for each, seconds in best.items()}


def main() -> None:
    """Measure and print."""
    print(environment())
    took = decisions()
    for level, microseconds in took.items():
        print(f"{WORLDS} decisions, {level}: {microseconds:,.0f} us, {microseconds / took['none']:.2f} of undisturbed")
    share = took[FIELD.name] / took["none"]
    print(f"field / none  {share:.2f} (at most {SLOWER}: {verdict(share <= SLOWER)})")


if __name__ == "__main__":
    main()
