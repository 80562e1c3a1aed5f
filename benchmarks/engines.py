"""The planar engine against the three-dimensional scene: where trials end, and what an environment's decision takes.

The expert carries five pairs of hand and object in 16 directions, one trial each, in both engines, from the same
starts: with the grasps that each engine's rehearsal chooses, with those of the planar one in both, and with those on a
floor without friction. Then random decisions in the grip, on one core.

Bounds: trials end within 0.5 mm of each other in the mean of every pair; decisions 5 times as fast.
Run: python benchmarks/engines.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import inhand
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.run import prepare
from inhand.control.controller import Task
from inhand.control.draws import start_noise
from inhand.control.loop import Bench, simulate
from inhand.control.phases import Grasp
from inhand.geometry import Array, Path
from inhand.sim.names import Engine
from inhand.sim.scene import SceneSpec
from inhand.tasks.paths import stacked
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
FASTER = 5.0
"""How many times as many decisions the planar engine makes."""
WORLDS = 64
DECISIONS = 20
"""Decisions that are timed in one go."""


def compare(hand: str, spec: str) -> dict[str, Array]:
    """Return how far apart the two engines end the trials of a pair `(16,)` [mm], by what is the same in both."""
    config = AsteriskConfig(hand=hand, object=spec, trials=1)
    setup = prepare(config)
    whose = [(each.primitive.angle_deg, each.primitive.rotation_deg, each.trial) for each in setup.assignments]
    paths = stacked([each.path.poses for each in setup.assignments])
    task = Task(setup.hand, (setup.object,) * len(paths), Path(paths))
    starts = setup.hand.start_pose + start_noise(config, whose)
    choose = setup.controller.grasp
    poses = setup.hand.start_pose + paths
    grasps = {each: choose(setup.hand, setup.object, poses, starts, engine=each) for each in ENGINES}

    def ends(engine: Engine, grasp: Grasp, scene: SceneSpec) -> Array:
        _, found = simulate(task, grasp, starts, setup.controller.manipulate, Bench(engine, scene))
        return np.array([found.states[last].pose[world, :2] for world, last in enumerate(found.last)])

    chosen, floor, smooth = grasps["planar"], SceneSpec(), SceneSpec(floor_friction=0.0)
    own = [ends(each, grasps[each], floor) for each in ENGINES]
    pairs = {"": own} | {
        name: [ends(each, chosen, scene) for each in ENGINES]
        for name, scene in (("same grasps", floor), ("same grasps, smooth floor", smooth))
    }
    return {name: 1e3 * np.linalg.norm(a - b, axis=-1) for name, (a, b) in pairs.items()}


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
        for name, apart in compare(hand, spec).items():
            told = f"mean {apart.mean():.3f}, median {np.median(apart):.3f}, most {apart.max():.3f} mm apart"
            asked = f" (mean at most {APART}: {verdict(apart.mean() <= APART)})" if not name else ""
            print(f"{hand} {spec}{', ' * bool(name)}{name}: {told}{asked}", flush=True)
    rate = decisions()
    print(f"environment decisions: mujoco {rate['mujoco']:,.0f}/s, planar {rate['planar']:,.0f}/s")
    ratio = rate["planar"] / rate["mujoco"]
    print(f"planar / mujoco  {ratio:5.2f}  (at least {FASTER}: {verdict(ratio >= FASTER)})")


if __name__ == "__main__":
    main()
