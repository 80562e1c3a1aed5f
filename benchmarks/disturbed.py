"""What disturbances do to the expert, and what they cost.

The expert carries the cube in 16 directions, several trials each, under single disturbances and under the levels: its
way as a share of the undisturbed way, and how often it loses the object. Then decisions in the grip on one core, of
environments with and without disturbance, taking turns.

Bounds: a batch under `field` is at most 15 % slower than an undisturbed one.
Run: python benchmarks/disturbed.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import inhand
from inhand.control.trial import LOST
from inhand.sim.disturbance import BENCH, FIELD, HARD, Camera, Commands, Differences, Disturbance, Pushes
from timing import best_times, environment, verdict

TRIALS = 6
"""Trials in each direction."""
WORLDS, DECISIONS = 64, 20
"""Environments, and decisions that are timed in one go."""
SLOWER = 1.15
"""Most that a decision under `field` may take of an undisturbed one."""
CASES = (
    Disturbance("friction x 0.7", Differences(friction=(0.7, 0.7))),
    Disturbance("friction x 0.5", Differences(friction=(0.5, 0.5))),
    Disturbance("mass x 4", Differences(mass=(4.0, 4.0))),
    Disturbance("size x 1.1", Differences(size=(1.1, 1.1))),
    Disturbance("torque x 0.5", Differences(torque=(0.5, 0.5))),
    Disturbance("start 3 mm and 5 deg off", Differences(start_mm=3.0, start_deg=5.0)),
    Disturbance("pose noise 1 mm", camera=Camera(noise_mm=1.0)),
    Disturbance("pose bias 2 mm", camera=Camera(bias_mm=2.0)),
    Disturbance("pose late by 20 ms", camera=Camera(delay_ms=(20.0, 20.0))),
    Disturbance("pose late by 40 ms", camera=Camera(delay_ms=(40.0, 40.0))),
    Disturbance("commands late by 40 ms", commands=Commands((40.0, 40.0))),
    Disturbance("one push of 20 mN s", pushes=Pushes(20.0, 1.0, 1)),
    BENCH,
    FIELD,
    HARD,
)


def carried(disturb: str | Disturbance) -> tuple[float, int]:
    """Return how far the expert came on average [mm], and how many objects it lost."""
    found = inhand.asterisk(directions="all", trials=TRIALS, disturb=disturb, engine="planar").table()
    return float(found["carried_mm"].mean()), int(found["outcome"].isin(LOST).sum())


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
    """Compare and print."""
    print(environment())
    usual, lost = carried("none")
    print(f"| disturbance | way | lost of {16 * TRIALS} |\n|---|---|---|\n| none | 1.00 | {lost} |")
    for case in CASES:
        way, lost = carried(case)
        print(f"| {case.name} | {way / usual:.2f} | {lost} |")
    took = decisions()
    for level, microseconds in took.items():
        print(f"{WORLDS} decisions, {level}: {microseconds:,.0f} us, {microseconds / took['none']:.2f} of undisturbed")
    share = took[FIELD.name] / took["none"]
    print(f"field / none  {share:.2f} (at most {SLOWER}: {verdict(share <= SLOWER)})")


if __name__ == "__main__":
    main()
