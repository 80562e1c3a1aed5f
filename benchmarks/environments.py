"""Environment steps per second in the grip: State, observation, reward and auto-reset of the vector environment.

Small random steps around the hold, on all cores. Compared with bare `simulator.step`, which measures the same `State`
of as many worlds held by the same grips, in interleaved turns: what is left is the price of being an environment.

Bound: at least 60,000 environment steps/s on two cores; one is a decision of 5 physics steps.
Run: python benchmarks/environments.py
"""

from __future__ import annotations

import time

import numpy as np

from inhand.learning.environment_config import EnvironmentConfig
from inhand.learning.environments import AsteriskVectorEnv
from inhand.sim.engines import make_simulator
from inhand.sim.scene import SUBSTEPS
from inhand.tasks.decisions import LARGEST_STEP
from timing import best_times, environment, verdict

BATCHES = (64, 256, 1024)
"""Numbers of environments side by side."""
LEAST = 60_000
"""Least environment steps per second of the best batch."""
SHAKE = 0.1
"""Standard deviation of the actions: 4 mrad a decision."""
DRAWN = 64
"""Actions drawn before the clock runs, taken in turn."""


def measure(count: int) -> tuple[float, float]:
    """Return environment steps and bare simulator steps per second of so many worlds, each a decision of one world."""
    envs = AsteriskVectorEnv(count, actions="steps")
    envs.reset(seed=0)
    config = EnvironmentConfig()
    hand, spec = config.held
    actions = SHAKE * np.random.default_rng(0).standard_normal((DRAWN, count, hand.n_joints))
    pool, every = config.pool(), np.arange(count)
    bare = make_simulator(config.engine, hand, [spec] * count)
    bare.restore(every, pool.snapshot, every % len(pool))
    held = bare.measure().targets
    turn = {"env": 0, "bare": 0}

    def step() -> None:
        turn["env"] += 1
        envs.step(actions[turn["env"] % DRAWN])

    def step_bare() -> None:
        turn["bare"] += 1
        bare.step(held + LARGEST_STEP * actions[turn["bare"] % DRAWN], SUBSTEPS)

    best = best_times({"env": step, "bare": step_bare}, time.perf_counter, repeats=60)
    return count / best["env"], count / best["bare"]


def main() -> None:
    """Time every batch and print the rates."""
    found = {count: measure(count) for count in BATCHES}
    print(environment())
    for count, (ours, bare) in found.items():
        print(f"{count:5d} environments  {ours:9,.0f} steps/s   bare simulator {bare:9,.0f}   ratio {ours / bare:.2f}")
    best = max(ours for ours, _ in found.values())
    print(f"best {best:,.0f} environment steps/s  (at least {LEAST:,}: {verdict(best >= LEAST)})")


if __name__ == "__main__":
    main()
