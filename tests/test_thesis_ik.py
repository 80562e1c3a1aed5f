"""The thesis's inverse kinematics controller: expected contacts, recovery, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from inhand.control.controller import Task
from inhand.control.thesis_ik import ThesisIkConfig, ThesisIkController
from inhand.geometry import Array, Path, inverse_transform, spatial, transform
from inhand.hands.kinematics import joint_positions
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.hands.touch import touch
from inhand.sim.state import State

HAND = parse_hand_name("2v2_50.50_50.50_1.1_53")
CUBE = OBJECTS["cube_39"]
CENTRE = np.array([0.0, 0.0936])
"""Where the object stands at the start, 0.65 of 144 mm from the palm [m]."""
EXACT = ThesisIkConfig(damping=1e-4, iterations=40)
"""Least squares that arrive, so that the goals can be read off the joints."""


def holding(contacts: Array, pose: Array) -> State:
    """Return one world whose fingertips touch the cube's left and right face at points in its frame `(2, 2)` [m].

    The fingers press 0.05 mm into it, so that its points are not the fingers'.
    """
    normals = np.array([(-1.0, 0.0), (1.0, 0.0)])
    points = transform(pose, contacts)
    joints = np.concatenate(
        [touch(HAND, finger, points[i], normals[i]).joints for i, finger in enumerate(HAND.fingers)]
    )
    return State(
        time=np.zeros(1),
        object_pose=spatial(pose[None], CUBE.height / 2),
        object_velocity=np.zeros((1, 6)),
        joint_angles=joints[None],
        joint_velocities=np.zeros((1, 4)),
        targets=joints[None],
        link_gaps=np.zeros((1, 4)),
        contact_links=np.array([[1, 1]]),
        finger_points=np.pad(points - 5e-5 * normals, ((0, 0), (0, 1)))[None],
        object_points=np.pad(points, ((0, 0), (0, 1)))[None],
        gaps=np.zeros((1, 2)),
        forces=np.zeros((1, 2, 3)),
        diverged=np.zeros(1, dtype=bool),
    )


def following(poses: Array, config: ThesisIkConfig = EXACT) -> ThesisIkController:
    """Return a controller for one world along relative poses `(S, 3)`."""
    task = Task(HAND, (CUBE,), Path(poses[None]), 0.004)
    return ThesisIkController(task, config)


def where_points_go(state: State, targets: Array) -> Array:
    """Return where the touching points `(2, 2)` [m] of the last links lie at commanded joints."""
    moved = []
    for i, (finger, place) in enumerate(zip(HAND.fingers, HAND.slices, strict=True)):
        before, after = (
            np.array([*joint_positions(finger, joints)[1], joints.sum()])
            for joints in (state.joint_angles[0, place], targets[0, place])
        )
        moved.append(transform(after, inverse_transform(before, state.finger_xy[0, i])))
    return np.stack(moved)


def test_eq_3_2_shifts_the_contacts_with_the_path() -> None:
    """The object should go 1 mm right and 2 mm out, so both contacts should."""
    pose = np.array([*CENTRE, 0.0])
    state = holding(np.array([(-0.0195, 0.002), (0.0195, -0.001)]), pose)
    controller = following(np.array([(0, 0, 0), (0.001, 0.002, 0), (0.005, 0.002, 0)]))
    controller.begin(state)
    reached = where_points_go(state, controller.act(state))
    np.testing.assert_allclose(reached, [(-0.0185, 0.0976), (0.0205, 0.0946)], atol=2e-6)


def test_eq_3_2_turns_the_contacts_about_the_object() -> None:
    """A turn of 0.1 rad in place: (-19.5, 0) goes to 19.5 (-cos 0.1, -sin 0.1) about the centre."""
    pose = np.array([*CENTRE, 0.0])
    state = holding(np.array([(-0.0195, 0.0), (0.0195, 0.0)]), pose)
    controller = following(np.array([(0, 0, 0), (0, 0, 0.1), (0, 0, 0.2)]))
    controller.begin(state)
    reached = where_points_go(state, controller.act(state))
    expected = [(-0.01940258, 0.09165325), (0.01940258, 0.09554675)]
    np.testing.assert_allclose(reached, expected, atol=2e-6)


def test_eq_3_2_takes_the_contacts_of_now_and_the_path_of_the_start() -> None:
    """The object lags 1 mm and a contact slid 2 mm: the slid contact is carried to where the path should be."""
    pose = np.array([*CENTRE, 0.0])
    started = holding(np.array([(-0.0195, 0.0), (0.0195, 0.0)]), pose)
    controller = following(np.array([(0, 0, 0), (0.0, 0.001, 0), (0.0, 0.002, 0), (0.0, 0.003, 0)]))
    controller.begin(started)
    controller.act(started)
    lagging = holding(np.array([(-0.0195, -0.002), (0.0195, 0.0)]), pose + np.array([0, 0.001, 0]))
    reached = where_points_go(lagging, controller.act(lagging))
    np.testing.assert_allclose(reached, [(-0.0195, 0.0936), (0.0195, 0.0956)], atol=2e-6)


@pytest.mark.parametrize("finger", [0, 1])
def test_a_lost_finger_moves_towards_the_centre_and_the_path_waits(finger: int) -> None:
    pose = np.array([*CENTRE, 0.0])
    held = holding(np.array([(-0.0195, 0.004), (0.0195, 0.004)]), pose)
    gaps = np.zeros((1, 2))
    gaps[0, finger] = 0.002
    lost = replace(held, gaps=gaps)
    controller = following(np.array([(0, 0, 0), (0.0, 0.001, 0), (0.0, 0.002, 0)]))
    controller.begin(held)
    for _ in range(5):
        reached = where_points_go(lost, controller.act(lost))
        assert not controller.finished(lost)[0]
    away = CENTRE - held.finger_xy[0, finger]
    step = reached[finger] - held.finger_xy[0, finger]
    np.testing.assert_allclose(step, EXACT.recovery * away / np.linalg.norm(away), atol=2e-6)
    np.testing.assert_allclose(reached[1 - finger], held.object_xy[0, 1 - finger], atol=2e-6)


def test_it_finishes_with_its_last_waypoint() -> None:
    state = holding(np.array([(-0.0195, 0.0), (0.0195, 0.0)]), np.array([*CENTRE, 0.0]))
    controller = following(np.array([(0, 0, 0), (0, 0.001, 0), (0, 0.002, 0), (0, 0.003, 0)]))
    controller.begin(state)
    finished = []
    for _ in range(4):
        controller.act(state)
        finished.append(bool(controller.finished(state)[0]))
    assert finished == [False, False, True, True]


def test_damping_shortens_the_step_but_not_its_direction() -> None:
    pose = np.array([*CENTRE, 0.0])
    state = holding(np.array([(-0.0195, 0.0), (0.0195, 0.0)]), pose)
    steps = []
    for damping in (1e-4, 0.05):
        config = ThesisIkConfig(damping=damping, iterations=1)
        controller = following(np.array([(0, 0, 0), (0.0, 0.003, 0)]), config)
        controller.begin(state)
        steps.append((where_points_go(state, controller.act(state)) - state.finger_xy[0])[0])
    assert 0.0025 < steps[0][1] < 0.0035
    assert 0 < steps[1][1] < 0.9 * steps[0][1]
