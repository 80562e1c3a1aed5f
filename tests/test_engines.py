"""What every engine's simulator does alike: made by name, pushed, put back, told the forces of its fingers."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

import inhand
from inhand.control.catalogue import rough_grasp
from inhand.errors import InputError
from inhand.geometry import Array, inverse_quaternion, turn
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE
from inhand.sim.engine import Simulator
from inhand.sim.engines import make_simulator
from inhand.sim.names import Engine
from inhand.sim.scene import SceneSpec
from inhand.sim.state import State

HAND = parse_hand_name("2v2_50.50_50.50_1.1_53")
CUBE = CATALOGUE["cube_39"]
START = np.array([[*HAND.start_position, 0.0]])
GRASP = rough_grasp(HAND, CUBE, START[:, None])
ENGINES: tuple[Engine, ...] = ("mujoco", "planar", "bullet")


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    if request.param == "bullet":
        pytest.importorskip("pybullet", reason="the witness needs the extra `bullet`")
    return str(request.param)


def worlds(engine: str, count: int = 2) -> Simulator:
    """Return worlds whose fingers stand off the object."""
    simulator = make_simulator(engine, HAND, [CUBE] * count)
    simulator.reset(np.repeat(START, count, axis=0), np.repeat(GRASP.opened, count, axis=0))
    return simulator


def gripped(simulator: Simulator, decisions: int = 40) -> State:
    """Close the fingers and return the state after it."""
    closed = np.repeat(GRASP.closed, len(simulator.objects), axis=0)
    for _ in range(decisions):
        state = simulator.step(closed, 5)
    return state


def test_an_engine_that_there_is_not_is_refused_with_the_nearest() -> None:
    with pytest.raises(InputError, match=r"unknown engine 'mujocco'.*mujoco.*allowed are planar, mujoco, bullet"):
        make_simulator("mujocco", HAND, [CUBE])


def test_only_the_sim_room_names_an_engines_class() -> None:
    source = Path(inhand.__file__).parent
    naming = {
        str(path.relative_to(source))
        for path in source.rglob("*.py")
        if any(
            word in path.read_text(encoding="utf-8")
            for word in ("MujocoSimulator", "PlanarSimulator", "BulletSimulator")
        )
    }
    assert naming == {"sim/mujoco_engine.py", "sim/planar/engine.py", "sim/bullet_engine.py", "sim/engines.py"}


def test_a_push_gives_the_object_its_impulse_in_its_world_alone(engine: str) -> None:
    simulator = worlds(engine)
    simulator.push(np.array([1]), np.array([[0.002, 0.001, 0.0]]))
    state = simulator.measure()
    np.testing.assert_allclose(CUBE.mass * state.object_velocity[1, :3], [0.002, 0.001, 0.0], atol=1e-9)
    np.testing.assert_allclose(state.object_velocity[1, 3:], 0.0, atol=1e-9)
    np.testing.assert_array_equal(state.object_velocity[0], 0.0)
    moved = simulator.step(np.repeat(GRASP.opened, 2, axis=0), 5).pose - state.pose
    assert moved[1, 0] > 5e-4
    assert np.abs(moved[0]).max() < 1e-5


@pytest.mark.parametrize(
    ("which", "impulse", "text"),
    [([2], [[0, 0, 0]], "world 2 of 2"), ([0], [[0, 0]], "of shape"), ([0], [[np.nan, 0, 0]], "give finite values")],
)
def test_a_push_that_cannot_be_is_refused(engine: str, which: list[int], impulse: list[list[float]], text: str) -> None:
    with pytest.raises(InputError, match=text):
        worlds(engine).push(np.array(which), np.array(impulse, dtype=float))


def test_worlds_that_are_not_active_stand_still_and_the_others_do_not_notice(engine: str) -> None:
    both, one = worlds(engine), worlds(engine)
    begun = one.measure()
    closed = np.repeat(GRASP.closed, 2, axis=0)
    for _ in range(20):
        expected, state = both.step(closed, 5), one.step(closed, 5, np.array([True, False]))
    for each in fields(State):
        mine = getattr(state, each.name)
        np.testing.assert_array_equal(mine[0], getattr(expected, each.name)[0], err_msg=each.name)
        np.testing.assert_array_equal(mine[1], getattr(begun, each.name)[1], err_msg=each.name)
    for _ in range(20):
        state = one.step(closed, 5, np.array([False, True]))
    for each in fields(State):
        mine, there = getattr(state, each.name), getattr(expected, each.name)
        np.testing.assert_array_equal(mine, there, err_msg=each.name)


def test_fingers_press_the_object_from_both_sides_with_what_their_servos_give(engine: str) -> None:
    state = gripped(worlds(engine, 1))
    (left, right) = state.forces[0]
    assert left[0] > 0.2
    np.testing.assert_allclose(left[0], -right[0], rtol=0.1)
    assert (np.abs(state.forces[0, :, 1]) < 0.3 * left[0]).all()
    assert 0 < state.penetration[0] < 1e-3
    np.testing.assert_allclose(state.normals[0, :, 0], [1.0, -1.0], atol=1e-3)


def test_fingers_that_do_not_touch_press_nothing_and_overlap_nothing(engine: str) -> None:
    state = worlds(engine).step(np.repeat(GRASP.opened, 2, axis=0), 5)
    np.testing.assert_array_equal(state.forces, 0.0)
    np.testing.assert_array_equal(state.penetration, 0.0)
    np.testing.assert_allclose(state.normals[0, :, 0], [1.0, -1.0], atol=0.2)


def test_forces_do_what_newton_says() -> None:
    simulator = worlds("mujoco", 1)
    gripped(simulator)
    simulator.push(np.array([0]), np.array([[0.0, 0.0, 0.003]]))
    before = simulator.measure()
    after = simulator.step(GRASP.closed, 1)
    gained = CUBE.mass * (after.object_velocity[0, :3] - before.object_velocity[0, :3]) / simulator.timestep
    weight = np.array([0.0, 0.0, -9.81 * CUBE.mass])  # off the floor, fingers and weight are all there is
    np.testing.assert_allclose(after.forces[0].sum(axis=0) + weight, gained, atol=0.02)


def test_worlds_go_back_to_a_snapshot_of_either_engine(engine: str) -> None:
    simulator, other = worlds(engine), worlds("mujoco")
    there = gripped(other)
    simulator.restore(np.array([1]), other.snapshot(), np.array([0]))
    state = simulator.measure()
    flat = engine == "planar"  # which takes over nothing that leans or is off the floor
    for name in ("joint_angles", "joint_velocities", "targets", "pose", *(() if flat else ("object_pose",))):
        np.testing.assert_allclose(getattr(state, name)[1], getattr(there, name)[0], atol=1e-9, err_msg=name)
    moving = [0, 1, 5] if flat else slice(None)
    np.testing.assert_allclose(state.object_velocity[1, moving], there.object_velocity[0, moving], atol=1e-9)
    assert state.time.tolist() == pytest.approx([0.0, 0.8])
    kept = simulator.snapshot()
    gripped(simulator, 5)
    simulator.restore(np.array([0, 1]), kept, np.array([0, 1]))
    again = simulator.measure()
    np.testing.assert_allclose(again.object_pose, state.object_pose, atol=1e-12)
    np.testing.assert_allclose(again.joint_angles, state.joint_angles, atol=1e-12)


def test_hands_may_differ_in_numbers_and_leave_each_other_alone(engine: str) -> None:
    soft = replace(HAND, stiffness=0.5 * HAND.stiffness, torque=0.5 * HAND.torque)
    both = make_simulator(engine, [HAND, soft], [CUBE] * 2)
    alone = make_simulator(engine, HAND, [CUBE])
    for simulator, count in ((both, 2), (alone, 1)):
        simulator.reset(np.repeat(START, count, axis=0), np.repeat(GRASP.opened, count, axis=0))
    pair, single = gripped(both), gripped(alone)
    np.testing.assert_array_equal(pair.joint_angles[0], single.joint_angles[0])
    assert np.abs(pair.joint_angles[1] - pair.joint_angles[0]).max() > 1e-4


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (["2v2_50.50_50.50_1.1_53"] * 3, "3 hands for 2 objects"),
        (["2v2_50.50_50.50_1.1_53", "2v3_25.75_25.35.40_1.1_53"], "links in one"),
    ],
)
def test_hands_of_another_number_or_of_other_joints_are_refused(engine: str, names: list[str], text: str) -> None:
    with pytest.raises(InputError, match=text):
        make_simulator(engine, [parse_hand_name(name) for name in names], [CUBE] * 2)


def test_angular_velocity_is_in_the_palms_frame(engine: str) -> None:
    if engine == "planar":
        pytest.skip("in the plane there is one axis to turn about")
    simulator = make_simulator(engine, HAND, [CUBE], SceneSpec(gravity=0.0))
    simulator.reset(START, GRASP.opened)
    kept, n = simulator.snapshot(), HAND.n_joints
    tilted = np.array([0.8, 0.4, -0.4, 0.2])  # far from upright, so that the object's own frame is another
    kept.qpos[0, n:] = [0.3, 0.5, 0.5, *tilted]
    kept.qvel[0, n:] = [0.0, 0.0, 0.0, 1.0, -2.0, 3.0]
    simulator.restore(np.array([0]), kept, np.array([0]))
    before = simulator.measure()
    after = simulator.step(GRASP.opened, 1)
    change = product_of(after.object_pose[0, 3:], inverse_quaternion(before.object_pose[0, 3:]))
    turned = 2 * change[1:] * np.sign(change[0]) / simulator.timestep
    np.testing.assert_allclose(before.object_velocity[0, 3:], turn(tilted, np.array([1.0, -2.0, 3.0])), atol=1e-9)
    np.testing.assert_allclose(after.object_velocity[0, 3:], turned, atol=0.05)


def product_of(a: Array, b: Array) -> Array:
    """Return the quaternion `(4,)` that turns by b and then by a."""
    w, x, y, z = a
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]]) @ b


def test_the_deepest_overlap_is_that_of_any_link() -> None:
    state = worlds("mujoco", 3).measure()
    gaps = np.array([[0.01, -2e-4, 0.0, 0.01], [-3e-4, 0.0, -5e-4, -1e-4], [0.1, 0.2, 0.3, 0.4]])
    np.testing.assert_allclose(replace(state, link_gaps=gaps).penetration, [2e-4, 5e-4, 0.0])
