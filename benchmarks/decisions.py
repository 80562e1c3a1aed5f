"""Control decisions per second of the two inverse kinematics controllers, in a batch of 64 worlds.

Times `controller.act` alone, in the middle of 'Right': no physics, no measuring, on one core.

Bound: the expert `ik` makes at least 20,000 decisions per second.
Run: python benchmarks/decisions.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import grip
from inhand.control.catalogue import find_controller
from inhand.control.controller import SUBSTEPS
from inhand.geometry import Array
from inhand.sim.mujoco_engine import MujocoSimulator
from timing import best_times, environment, verdict

WORLDS = 64
"""Worlds of a batch."""
LEAST = 20_000
"""Decisions per second asked of the expert."""
UNDER_WAY = 40
"""Decisions before the timing starts: 0.8 s, enough to leave the start."""


def midway(name: str) -> Callable[[], Array]:
    """Return a function that makes one decision for every world, from a state on the way to the right."""
    hand, spec = grip.scene()
    simulator = MujocoSimulator(hand, [spec] * WORLDS)
    task, _ = grip.task_right(simulator)
    state, _ = grip.hold(simulator)
    controller = find_controller(name).manipulate(task)
    controller.begin(state)
    for _ in range(UNDER_WAY):
        state = simulator.step(controller.act(state), SUBSTEPS)
    return lambda: controller.act(state)


def main() -> None:
    """Time both controllers and print their rates."""
    best = best_times({name: midway(name) for name in ("ik", "thesis-ik")}, time.process_time)
    rate = {name: WORLDS / seconds for name, seconds in best.items()}
    print(environment())
    print(f"ik         {rate['ik']:9,.0f} decisions/s  (at least {LEAST:,}: {verdict(rate['ik'] >= LEAST)})")
    print(f"thesis-ik  {rate['thesis-ik']:9,.0f} decisions/s")


if __name__ == "__main__":
    main()
