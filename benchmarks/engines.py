"""The planar engine against the three-dimensional scene: where trials end, and what an environment's decision takes.

The expert carries five pairs of hand and object in 16 directions, one trial each, in both engines, from the same
starts. Then random decisions in the grip, on one core.

Bounds: trials end within 0.5 mm of each other in the mean of every pair.
Run: python benchmarks/engines.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import inhand
from inhand.geometry import Array
from inhand.sim.names import Engine
from timing import best_times, environment, verdict

PAIRS = (
    ("2v2_50.50_50.50_1.1_53", "cube_39"),
    ("2v2_65.35_65.35_1.1_53", "cylinder_40"),
    ("2v2_35.65_50.50_1.1_63", "rectangle_33x22"),
    ("2v3_25.75_25.35.40_1.1_53", "ellipse_40x25"),
    ("2v2_50.50_50.50_1.1_53", "hourglass"),
)
ENGINES: tuple[Engine, Engine] = ("mujoco", "planar")
APART = 0.5
"""Most that the ends of a pair's trials differ in the mean [mm]."""
WORLDS = 64
DECISIONS = 20
"""Decisions that are timed in one go."""


def ends(hand: str, spec: str) -> dict[str, Array]:
    """Return how far the object came in each direction `(16,)` [mm], in each engine."""
    runs = {each: inhand.asterisk(hand=hand, object=spec, directions="all", trials=1, engine=each) for each in ENGINES}
    return {each: run.table()["distance_mm"].to_numpy() for each, run in runs.items()}


def decisions() -> dict[str, float]:
    """Return the environment decisions a second on one core, in each engine."""
    batches = {each: inhand.make("easy", num_envs=WORLDS, engine=each, threads=1) for each in ENGINES}
    for batch in batches.values():
        batch.reset(seed=0)
    shape = (DECISIONS, *(batches["mujoco"].action_space.shape or ()))
    actions = np.random.default_rng(0).uniform(-1, 1, shape)

    def deciding(engine: Engine) -> Callable[[], None]:
        def decide() -> None:
            for action in actions:
                batches[engine].step(action)

        return decide

    best = best_times({each: deciding(each) for each in ENGINES}, time.process_time)
    return {each: WORLDS * DECISIONS / seconds for each, seconds in best.items()}


def main() -> None:
    """Compare and print."""
    print(environment())
    for hand, spec in PAIRS:
        found = ends(hand, spec)
        apart = np.abs(found["planar"] - found["mujoco"])
        told = f"mean {apart.mean():.3f}, most {apart.max():.3f} mm"
        print(f"{hand} {spec}: {told} apart (mean at most {APART}: {verdict(apart.mean() <= APART)})")
    rate = decisions()
    print(f"environment decisions: mujoco {rate['mujoco']:,.0f}/s, planar {rate['planar']:,.0f}/s")
    print(f"planar / mujoco  {rate['planar'] / rate['mujoco']:5.2f}")


if __name__ == "__main__":
    main()
