"""Control decisions per second of the two inverse kinematics controllers, in a batch of 64 worlds; what forces cost.

Times `controller.act` alone, in the middle of 'Right': no physics, no measuring, on one core. Then the physics of one
decision with the sensors of the contact forces and without them, from the same grip.

Bound: the expert `ik` makes at least 20,000 decisions per second; forces cost at most 5 % of a simulator's step.
Run: python benchmarks/decisions.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import mujoco
from mujoco.batch import Batch

import grip
from inhand.control.catalogue import find_controller
from inhand.geometry import Array
from inhand.sim.model import build_model
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.scene import SUBSTEPS, SceneSpec
from timing import best_times, environment, verdict

WORLDS = 64
"""Worlds of a batch."""
LEAST = 20_000
"""Decisions per second asked of the expert."""
MOST = 0.05
"""Share of a step that the contact forces may take."""
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


def held(simulator: MujocoSimulator, *, sensors: bool) -> Callable[[], object]:
    """Return a function that makes the physics of one decision in the held worlds of a simulator."""
    model = build_model(*grip.scene(), SceneSpec())
    if not sensors:
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    batch, snapshot = Batch(model, WORLDS, 1, persistent=False), simulator.snapshot()
    for name in ("qpos", "qvel", "ctrl", "qacc_warmstart"):
        batch.bind(name)[:] = getattr(snapshot, name)
    return lambda: batch.step(nstep=SUBSTEPS)


def forces_cost() -> float:
    """Return the share of a simulator's step that the contact forces take."""
    hand, spec = grip.scene()
    simulator = MujocoSimulator(hand, [spec] * WORLDS, threads=1)
    _, targets = grip.hold(simulator)
    cases = {"with": held(simulator, sensors=True), "without": held(simulator, sensors=False)}
    best = best_times(cases | {"step": lambda: simulator.step(targets, SUBSTEPS)}, time.process_time)
    return (best["with"] - best["without"]) / best["step"]


def main() -> None:
    """Time both controllers and the forces, and print what they take."""
    best = best_times({name: midway(name) for name in ("ik", "thesis-ik")}, time.process_time)
    rate = {name: WORLDS / seconds for name, seconds in best.items()}
    print(environment())
    print(f"ik         {rate['ik']:9,.0f} decisions/s  (at least {LEAST:,}: {verdict(rate['ik'] >= LEAST)})")
    print(f"thesis-ik  {rate['thesis-ik']:9,.0f} decisions/s")
    cost = forces_cost()
    print(f"contact forces: {100 * cost:.1f} % of a step  (at most {100 * MOST:.0f} %: {verdict(cost <= MOST)})")


if __name__ == "__main__":
    main()
