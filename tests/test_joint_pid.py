"""The joint controller of the place and grasp phases."""

from dataclasses import replace

import numpy as np
import pytest

from inhand.control.controller import Task
from inhand.control.joint import JointPid, PidConfig
from inhand.geometry import Array, Path
from inhand.hands.hand import HandSpec
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.state import State
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import TRAIN

STANDARD = "2v2_50.50_50.50_1.1_53"
TOLERANCE = np.deg2rad(1.5)
"""How far past or short of its goal a free joint may come to rest [rad]: a little more than the integral part."""


def worlds(hand: HandSpec, count: int) -> tuple[MujocoSimulator, Task]:
    """Return worlds whose object stands out of the fingers' way, and their task."""
    simulator = MujocoSimulator(hand, [OBJECTS["cube_39"]] * count)
    path = straight_path(TRAIN[0])
    paths = np.tile(path.poses, (count, 1, 1))
    return simulator, Task(hand, simulator.objects, Path(paths), simulator.timestep)


def moved(hand: HandSpec, start: Array, goal: Array) -> tuple[list[State], list[bool]]:
    """Move free fingers until every world has finished; return the states and whether all had finished in each."""
    simulator, task = worlds(hand, len(goal))
    away = np.tile([0.0, 0.6, 0.0], (len(goal), 1))
    states, finished = [simulator.reset(away, start)], []
    controller = JointPid(task, goal)
    controller.begin(states[0])
    for _ in range(100):
        states.append(simulator.step(controller.act(states[-1]), 5))
        finished.append(bool(controller.finished(states[-1]).all()))
        if finished[-1]:
            break
    return states, finished


@pytest.mark.parametrize("name", [STANDARD, "3v3_25.40.35_40.35.25_1.1_63"])
def test_every_joint_arrives_without_passing_its_goal(name: str) -> None:
    hand = parse_hand_name(name)
    outward = np.concatenate([np.full(len(finger.links), -0.05 * finger.bend) for finger in hand.fingers])
    start = np.tile(outward, (2, 1))
    goal = start * np.array([[4.0], [12.0]])
    states, finished = moved(hand, start, goal)
    assert finished[-1]
    assert not any(finished[:-1])
    angles = np.stack([state.joint_angles for state in states])
    way = np.sign(goal - start)
    assert ((angles - goal) * way).max() < TOLERANCE
    np.testing.assert_allclose(angles[-1], goal, atol=TOLERANCE)
    assert np.abs(states[-1].joint_velocities).max() < PidConfig().rest


def test_all_joints_move_along_one_straight_line_at_the_speed_asked_for() -> None:
    hand = parse_hand_name(STANDARD)
    start = np.array([[0.3, -0.2, -0.3, 0.2]])
    goal = start + np.array([[0.6, -0.15, -0.3, 0.0]])
    states, _ = moved(hand, start, goal)
    speeds = np.stack([state.joint_velocities[0] for state in states])
    assert np.abs(speeds).max() < 1.2 * PidConfig().speed
    share = np.stack([(state.joint_angles[0] - start[0])[:3] / (goal - start)[0, :3] for state in states])
    assert np.ptp(share, axis=1).max() < 0.1
    assert states[-1].time[0] == pytest.approx(0.6 / PidConfig().speed, abs=0.3)


def test_a_blocked_joint_is_pushed_with_a_bounded_command() -> None:
    hand = parse_hand_name(STANDARD)
    simulator, task = worlds(hand, 1)
    state = simulator.reset(np.array([[0.0, 0.6, 0.0]]), np.zeros((1, 4)))
    goal = np.array([[0.1, -0.1, 0.05, 0.0]])
    controller = JointPid(task, goal)
    controller.begin(state)
    commands = np.stack([controller.act(state) for _ in range(500)])
    config = PidConfig()
    largest = config.proportional * np.abs(goal) + config.integral_limit
    assert (np.abs(commands) <= largest + 1e-12).all()
    np.testing.assert_allclose(commands[-1, 0], goal[0] + config.integral_limit * np.sign(goal[0]), atol=1e-12)


def test_the_integral_grows_once_the_set_point_has_arrived() -> None:
    """A blocked joint is told where the set point is, 0.024 rad a decision, and more and more from its arrival on."""
    hand = parse_hand_name(STANDARD)
    simulator, task = worlds(hand, 1)
    state = simulator.reset(np.array([[0.0, 0.6, 0.0]]), np.zeros((1, 4)))
    controller = JointPid(task, np.array([[0.06, -0.03, 0.0, 0.0]]))
    controller.begin(state)
    commands = np.stack([controller.act(state)[0, :2] for _ in range(5)])
    expected = [[0.024, -0.012], [0.048, -0.024], [0.0624, -0.0312], [0.0648, -0.0324], [0.0672, -0.0336]]
    np.testing.assert_allclose(commands, expected, atol=1e-12)


def test_fingers_that_press_on_an_object_finish_although_their_goal_lies_inside() -> None:
    hand = parse_hand_name(STANDARD)
    simulator, task = worlds(hand, 1)
    state = simulator.reset(np.array([[0.0, *hand.start_position[1:], 0.0]]), np.array([[0.95, -1.5, -0.95, 1.5]]))
    goal = np.array([[0.4, -1.5, -0.4, 1.5]])
    controller = JointPid(task, goal)
    controller.begin(state)
    for _ in range(80):
        state = simulator.step(controller.act(state), 5)
        if controller.finished(state)[0]:
            break
    assert controller.finished(state)[0]
    assert state.touching.all()
    assert np.abs(state.joint_angles - goal).max() > 4 * TOLERANCE


def test_a_moving_joint_has_not_finished_even_at_its_goal() -> None:
    hand = parse_hand_name(STANDARD)
    simulator, task = worlds(hand, 2)
    state = simulator.reset(np.tile([0.0, 0.6, 0.0], (2, 1)), np.zeros((2, 4)))
    controller = JointPid(task, np.zeros((2, 4)))
    controller.begin(state)
    controller.act(state)
    speed = np.zeros((2, 4))
    speed[1, 3] = 2 * PidConfig().rest
    np.testing.assert_array_equal(controller.finished(replace(state, joint_velocities=speed)), [True, False])


def test_beginning_again_forgets_the_integral() -> None:
    hand = parse_hand_name(STANDARD)
    simulator, task = worlds(hand, 1)
    state = simulator.reset(np.array([[0.0, 0.6, 0.0]]), np.zeros((1, 4)))
    controller = JointPid(task, np.full((1, 4), 0.05))
    controller.begin(state)
    first = controller.act(state)
    for _ in range(50):
        controller.act(state)
    controller.begin(state)
    np.testing.assert_array_equal(controller.act(state), first)


def test_the_derivative_takes_the_joints_speed_from_the_command() -> None:
    hand = parse_hand_name(STANDARD)
    simulator, task = worlds(hand, 1)
    state = simulator.reset(np.array([[0.0, 0.6, 0.0]]), np.zeros((1, 4)))
    moving = replace(state, joint_velocities=np.array([[0.5, -1.0, 0.0, 2.0]]))
    commands = []
    for derivative in (0.0, 0.1):
        controller = JointPid(task, np.full((1, 4), 0.3), PidConfig(derivative=derivative))
        controller.begin(moving)
        commands.append(controller.act(moving))
    np.testing.assert_allclose(commands[0] - commands[1], 0.1 * moving.joint_velocities)
