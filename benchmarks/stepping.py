"""Physics steps per second with the cube held and the whole `State` measured every 5 steps.

Compares, per core: our batch of 64 worlds; PyBullet with the same `State` at the same moments; and bare
`mujoco.rollout` on the same model and targets, which measures nothing and starts each call from the last state of the
one before, as a controller in the loop demands. Then our batch on all cores, and the planar engine.

Bounds: ours at least 2.5 times PyBullet per core, bare rollout at most 1.25 times ours, planar at least 5 times ours.
Run: python benchmarks/stepping.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import mujoco
import numpy as np
from mujoco.rollout import Rollout

import grip
from inhand.geometry import Array
from inhand.sim.bullet_engine import BulletSimulator
from inhand.sim.engines import make_simulator
from inhand.sim.model import build_model
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.scene import SUBSTEPS, SceneSpec
from inhand.sim.state import State
from timing import best_times, environment, verdict

WORLDS = 64
"""Worlds of a batch."""
OVER_PYBULLET = 2.5
"""Least ratio of our speed to PyBullet's, per core."""
UNDER_ROLLOUT = 1.25
"""Largest ratio of bare rollout's speed to ours, per core."""

PLANAR_OVER_OURS = 5.0
"""Least ratio of the planar engine's speed to the three-dimensional one's, per core."""


def bare_rollout(state: State, targets: Array) -> Callable[[], None]:
    """Return a function that advances the held grip by one decision with `mujoco.rollout` on the calling thread."""
    hand, spec = grip.scene()
    model = build_model(hand, spec, SceneSpec())
    data = mujoco.MjData(model)
    rollout = Rollout(nthread=0)
    controls = np.repeat(targets[:, None], SUBSTEPS, axis=1)
    qpos = np.concatenate([state.joint_angles, state.object_pose], axis=1)
    qvel = np.concatenate([state.joint_velocities, state.object_velocity], axis=1)
    latest = np.concatenate([state.time[:, None], qpos, qvel], axis=1)

    def advance() -> None:
        nonlocal latest
        states, _ = rollout.rollout([model], data, latest, controls)
        latest = states[:, -1]

    return advance


def main() -> None:
    """Time everything and print the ratios."""
    hand, spec = grip.scene()
    ours = MujocoSimulator(hand, [spec] * WORLDS, threads=1)
    every_core = MujocoSimulator(hand, [spec] * WORLDS)
    plane = make_simulator("planar", hand, [spec] * WORLDS, threads=1)
    witness = BulletSimulator(hand, [spec])
    state, targets = grip.hold(ours)
    grip.hold(every_core)
    _, plane_targets = grip.hold(plane)
    _, witness_targets = grip.hold(witness)
    single = {
        "ours": lambda: ours.step(targets, SUBSTEPS),
        "rollout": bare_rollout(state, targets),
        "planar": lambda: plane.step(plane_targets, SUBSTEPS),
        "pybullet": lambda: witness.step(witness_targets, SUBSTEPS),
    }
    worlds = {"ours": WORLDS, "rollout": WORLDS, "planar": WORLDS, "pybullet": 1}
    best = best_times(single, time.process_time)
    rate = {name: worlds[name] * SUBSTEPS / seconds for name, seconds in best.items()}
    together = best_times({"all": lambda: every_core.step(targets, SUBSTEPS)}, time.perf_counter)["all"]
    over, under = rate["ours"] / rate["pybullet"], rate["rollout"] / rate["ours"]
    print(environment())
    print(f"inhand, State every {SUBSTEPS} steps, one core   {rate['ours']:9,.0f} steps/s")
    print(f"PyBullet, same State, one core         {rate['pybullet']:9,.0f} steps/s")
    print(f"mujoco.rollout, nothing measured       {rate['rollout']:9,.0f} steps/s")
    print(f"inhand, planar engine, one core        {rate['planar']:9,.0f} steps/s")
    print(f"inhand, all cores                      {WORLDS * SUBSTEPS / together:9,.0f} steps/s")
    print(f"inhand / PyBullet        {over:5.2f}  (at least {OVER_PYBULLET}: {verdict(over >= OVER_PYBULLET)})")
    faster = rate["planar"] / rate["ours"]
    meets = verdict(faster >= PLANAR_OVER_OURS)
    print(f"planar / inhand          {faster:5.2f}  (at least {PLANAR_OVER_OURS}: {meets})")
    print(f"mujoco.rollout / inhand  {under:5.2f}  (at most {UNDER_ROLLOUT}: {verdict(under <= UNDER_ROLLOUT)})")


if __name__ == "__main__":
    main()
