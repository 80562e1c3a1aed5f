"""Physics steps per second of hands in space, the whole `State` measured every 5 steps, and decisions of the expert.

256 worlds hold the 50 mm cube with the standard hand, gravity of their own each. Compares, on one core, our batch with
bare `mujoco.rollout` of the same model and targets, which measures nothing and starts each call from the last state of
the one before.

Then decisions of the expert for the same worlds, which are not simulated meanwhile, and what a second of bare stepping
would have made of their time.

Bounds: at least 25,000 steps/s and 20,000 decisions/s, and bare rollout at most 1.4 times ours.
Run: python benchmarks/spatial.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import mujoco
import numpy as np
from mujoco.rollout import Rollout

from inhand.control.controller import SpatialTask
from inhand.control.spatial_ik import SpatialIkController
from inhand.geometry import Array
from inhand.hands.spatial.gravity import GRAVITY
from inhand.hands.spatial.kinematics import inverse
from inhand.hands.spatial.names import STANDARD, parse_spatial_name
from inhand.hands.spatial.objects import parse_solid_name
from inhand.rotations import placed
from inhand.sim.scene import SUBSTEPS, SceneSpec
from inhand.sim.spatial_engine import SpatialSimulator
from inhand.sim.spatial_model import build_spatial_model
from inhand.sim.state import State
from inhand.tasks.spatial.paths import spatial_path_of, stacked_paths
from inhand.tasks.spatial.primitives import DIRECTIONS
from timing import best_times, environment, verdict

WORLDS = 256
"""Worlds of the batch."""
LEAST_STEPS = 25_000
"""Least physics steps a second, one core."""
UNDER_ROLLOUT = 1.4
"""Largest ratio of bare rollout's speed to ours, one core."""
LEAST_DECISIONS = 20_000
"""Least decisions a second, one core."""
HAND, CUBE = parse_spatial_name(STANDARD), parse_solid_name("cube_50")
FACES = np.array([[0.0, 0.025, 0.0], [-0.025, -0.008, 0.0], [0.025, -0.008, 0.0]])
"""Contacts in the object's frame [m],"""
NORMALS = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
"""and the normals of the faces there."""


def fingers_at(off: float) -> Array:
    """Return joint angles that hold the tips a little off three faces of the cube [m], or inside of it `(n,)`."""
    found = []
    for finger, contact, normal in zip(HAND.fingers, FACES, NORMALS, strict=True):
        goal = placed(HAND.start_pose, contact + (finger.tip_radius + off) * normal)
        joints, misses = inverse(finger, goal[None])
        found.append(joints[0, misses[0].argmin()])
    return np.concatenate(found)


def held() -> tuple[SpatialSimulator, State]:
    """Return worlds that hold their objects against a gravity of their own, and their state.

    Raises:
        RuntimeError: a finger does not touch.
    """
    pulls = np.random.default_rng(0).standard_normal((WORLDS, 3))
    pulls *= GRAVITY / np.linalg.norm(pulls, axis=-1, keepdims=True)
    scenes = [SceneSpec(pull=(float(x), float(y), float(z))) for x, y, z in pulls]
    simulator = SpatialSimulator(HAND, [CUBE] * WORLDS, scenes, threads=1)
    simulator.reset(np.tile(HAND.start_pose, (WORLDS, 1)), np.tile(fingers_at(0.006), (WORLDS, 1)))
    for share in np.linspace(0.1, 1.0, 20):
        simulator.step(np.tile((1 - share) * fingers_at(0.006) + share * fingers_at(-0.004), (WORLDS, 1)), SUBSTEPS)
    simulator.let_go(np.ones(WORLDS, dtype=bool))
    for _ in range(25):
        state = simulator.step(np.tile(fingers_at(-0.004), (WORLDS, 1)), SUBSTEPS)
    if not state.touching.all():
        raise RuntimeError("the grip does not hold; the benchmark would time falling objects")
    return simulator, state


def bare_rollout(simulator: SpatialSimulator, state: State) -> Callable[[], None]:
    """Return a function that advances the held grips by one decision with `mujoco.rollout` on the calling thread."""
    models = []
    for pull in simulator.gravity:
        model = build_spatial_model(HAND, CUBE, SceneSpec(pull=(float(pull[0]), float(pull[1]), float(pull[2]))))
        model.eq_active0[:] = 0
        models.append(model)
    data, rollout = mujoco.MjData(models[0]), Rollout(nthread=0)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    latest = np.zeros((WORLDS, mujoco.mj_stateSize(models[0], kind)))
    kept = simulator.snapshot()
    for world, model in enumerate(models):
        data.time, data.qpos[:], data.qvel[:], data.eq_active[:] = 0.0, kept.qpos[world], kept.qvel[world], 0
        mujoco.mj_getState(model, data, latest[world], kind)
    controls = np.repeat(state.targets[:, None], SUBSTEPS, axis=1)

    def advance() -> None:
        nonlocal latest
        states, _ = rollout.rollout(models, data, latest, controls)
        latest = states[:, -1]

    return advance


def decisions(simulator: SpatialSimulator, state: State) -> Callable[[], object]:
    """Return a function that decides once for every world, each carried along a direction of its own."""
    path = stacked_paths([spatial_path_of(DIRECTIONS[k % len(DIRECTIONS)]) for k in range(WORLDS)])
    task = SpatialTask(HAND, (CUBE,) * WORLDS, path, gravity=simulator.gravity, distance=path.length)
    expert = SpatialIkController(task)
    expert.begin(state)
    return lambda: expert.act(state)


def main() -> None:
    """Time everything and print the ratios."""
    simulator, state = held()
    cases = {
        "ours": lambda: simulator.step(state.targets, SUBSTEPS),
        "rollout": bare_rollout(simulator, state),
        "expert": decisions(simulator, state),
    }
    best = best_times(cases, time.process_time, repeats=20)
    rate = {name: WORLDS * SUBSTEPS / seconds for name, seconds in best.items()}
    under = rate["rollout"] / rate["ours"]
    print(environment())
    print(f"inhand, State every {SUBSTEPS} steps, one core   {rate['ours']:9,.0f} steps/s", end="  ")
    print(f"(at least {LEAST_STEPS:,}: {verdict(rate['ours'] >= LEAST_STEPS)})")
    print(f"mujoco.rollout, nothing measured       {rate['rollout']:9,.0f} steps/s")
    print(f"mujoco.rollout / inhand  {under:5.2f}  (at most {UNDER_ROLLOUT}: {verdict(under <= UNDER_ROLLOUT)})")
    decided = WORLDS / best["expert"]
    print(f"the expert, one core                   {decided:9,.0f} decisions/s", end="  ")
    print(f"(at least {LEAST_DECISIONS:,}: {verdict(decided >= LEAST_DECISIONS)})")
    print(f"bare steps in the time of a decision   {rate['rollout'] / decided:9.2f}")


if __name__ == "__main__":
    main()
