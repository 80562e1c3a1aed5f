"""How servos, contacts and friction act in each engine: the numbers that PyBullet's are matched by.

The standard hand and the 39 mm cube; no controller takes part.
Joints: one target steps by 0.05 rad, away from the object; time from 10 to 90 % of it, most beyond it, what is left
after 0.4 s. Squeeze: fingertips aim inside the middle of both sides; their force, what of it is upright, how deep they
lie. Sides: fingertips press on an object too heavy to move; force along its sides over that on them while they slide at
20 mm/s, the same while they aim 0.4 mm aside and hold, and how fast they creep then.
Floor: how a sliding and a turning object slow down, by friction 0.2.

Run: python benchmarks/matching.py     (a minute; PyBullet needs the extra `bullet`)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from inhand.geometry import Array
from inhand.hands.grasp_search import moved_along
from inhand.hands.kinematics import hand_positions
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import ObjectSpec, parse_object_name
from inhand.hands.sides import side_joints
from inhand.sim.engine import Simulator
from inhand.sim.engines import make_simulator
from inhand.sim.names import Engine
from inhand.sim.scene import SceneSpec
from inhand.sim.state import State
from timing import environment

HAND, CUBE = parse_hand_name("2v2_50.50_50.50_1.1_53"), parse_object_name("cube_39")
ENGINES: tuple[Engine, ...] = ("mujoco", "planar", "bullet")
START, AWAY = HAND.start_pose, np.array([0.0, 0.5, 0.0])
STEP = 0.05
"""Step of a joint's target [rad]."""
AIMS = (0.001, 0.002, 0.004)
"""How far inside the object fingertips aim [m]."""
SLIDE, SHEAR = 0.02, 0.0004
"""How fast fingertips are slid along the sides [m/s], and how far aside they aim to load them [m]."""
HEAVY, ROUGH = 10.0, SceneSpec(floor_friction=1.0)
"""Mass [kg] and floor of an object that fingers do not move."""


def worlds(engine: Engine, spec: ObjectSpec = CUBE, scene: SceneSpec | None = None) -> Simulator:
    """Return one world."""
    return make_simulator(engine, HAND, [spec], scene, threads=1)


def step_response(engine: Engine, joint: int) -> list[float]:
    """Return rise time [ms], overshoot [%] and what is left [mrad] of a joint's step."""
    simulator = worlds(engine)
    start = simulator.reset(AWAY[None], side_joints(HAND, CUBE, 0.02)[None])
    target = start.joint_angles.copy()
    target[0, joint] += STEP
    share = [simulator.step(target, 1).joint_angles[0, joint] - start.joint_angles[0, joint] for _ in range(100)]
    gone = np.array([0.0, *share]) / STEP
    rise = [np.interp(part, gone[: gone.argmax() + 1], np.arange(gone.argmax() + 1)) for part in (0.1, 0.9)]
    return [4 * (rise[1] - rise[0]), 100 * (gone.max() - 1), 1e3 * STEP * (1 - gone[-1])]


def gripped(
    engine: Engine, aim: float, spec: ObjectSpec = CUBE, scene: SceneSpec | None = None
) -> tuple[Simulator, State]:
    """Close on the object in 0.4 s and hold it for as long."""
    simulator = worlds(engine, spec, scene)
    away, closed = side_joints(HAND, CUBE, 0.005), side_joints(HAND, CUBE, -aim)
    simulator.reset(START[None], away[None])
    for share in [*np.linspace(0.05, 1.0, 20), *[1.0] * 20]:
        state = simulator.step((away + share * (closed - away))[None], 5)
    return simulator, state


def squeeze(engine: Engine, aim: float) -> list[float]:
    """Return force [N], the upright part of it [N] and depth [mm] of a fingertip; the mean of both."""
    _, state = gripped(engine, aim)
    forces = state.forces[0]
    return [np.linalg.norm(forces[:, :2], axis=-1).mean(), np.abs(forces[:, 2]).mean(), -1e3 * state.gaps[0].mean()]


def sheared(engine: Engine, way: Array) -> list[State]:
    """Grip an object that does not move; then aim along its sides by a way [m] more in each decision."""
    simulator, state = gripped(engine, AIMS[1], replace(CUBE, mass=HEAVY), ROUGH)
    joints, found = state.targets[0].copy(), []
    for each in way:
        for place, finger, point in zip(HAND.slices, HAND.fingers, state.finger_points[0, :, :2], strict=True):
            joints[place] = moved_along(finger, joints[place], point, np.array([0.0, each]))
        state = simulator.step(joints[None], 5)
        found.append(state)
    return found


def friction(engine: Engine) -> list[float]:
    """Return force along the side over force on it while a fingertip slides, that under a held load, and its creep."""
    slid = sheared(engine, np.full(30, 0.02 * SLIDE))[10:]
    held = sheared(engine, np.array([SHEAR, *[0.0] * 50]))[10:]
    tips = [hand_positions(HAND, state.joint_angles[0])[[2, 5], 1].mean() for state in (held[0], held[-1])]
    mean = [np.abs(np.array([each.forces[0] for each in states])).mean(axis=(0, 1)) for states in (slid, held)]
    return [*(float(each[1] / each[0]) for each in mean), 1e3 * (tips[1] - tips[0]) / 0.8]


def slowing(engine: Engine, rate: int, speed: float) -> float:
    """Return how fast an object slows down on the floor [m/s^2 or rad/s^2] that has a speed at one of its rates."""
    simulator, held = worlds(engine), side_joints(HAND, CUBE, 0.02)[None]
    simulator.reset(AWAY[None], held)
    simulator.step(held, 25)
    kept = simulator.snapshot()
    kept.qvel[0, HAND.n_joints + rate] = speed
    kept.centre[0, 3 + min(rate, 2)] = speed
    simulator.restore(np.array([0]), kept, np.array([0]))
    after = simulator.step(held, 10)
    return float((speed - after.object_velocity[0, rate]) / 0.04)


def rows() -> dict[str, Callable[[Engine], list[float]]]:
    """Return what is measured, by the names of its numbers."""
    steps = {
        f"{name} joint: rise [ms], overshoot [%], left [mrad]": (lambda engine, j=j: step_response(engine, j))
        for j, name in enumerate(("proximal", "distal"))
    }
    squeezes = {
        f"aim {1e3 * aim:g} mm inside: force [N], upright [N], depth [mm]": (
            lambda engine, aim=aim: squeeze(engine, aim)
        )
        for aim in AIMS
    }
    return {
        **steps,
        **squeezes,
        "side: friction while sliding, load when held, creep under it [mm/s]": friction,
        "floor: slowing of 0.2 m/s [m/s^2], of 5 rad/s [rad/s^2]": lambda engine: [
            slowing(engine, 1, 0.2),
            slowing(engine, 5, 5.0),
        ],
    }


def main() -> None:
    """Measure and print the table."""
    print(environment())
    print(f"| | {' | '.join(ENGINES)} |")
    print("|---" * (1 + len(ENGINES)) + "|")
    for name, measure in rows().items():
        cells = [", ".join(f"{value:.3g}" for value in measure(engine)) for engine in ENGINES]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
