"""Kinematics of planar fingers, against finite differences and closed forms."""

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from inhand.geometry import Array
from inhand.hands.hand import FINGER_NAMES, FingerSpec
from inhand.hands.kinematics import (
    hand_positions,
    joint_positions,
    link_angles,
    link_direction,
    link_jacobian,
    point_jacobian,
)
from inhand.hands.names import CATALOGUE, parse_hand_name
from inhand.hands.objects import parse_object_name
from inhand.sim.model import build_model
from inhand.sim.scene import SceneSpec

FINGERS = [finger for name in CATALOGUE for finger in parse_hand_name(name).fingers]
finger_and_angles = st.sampled_from(FINGERS).flatmap(
    lambda finger: st.tuples(
        st.just(finger),
        st.lists(st.floats(-3.1, 3.1), min_size=len(finger.links), max_size=len(finger.links)).map(np.array),
    )
)


def carried_point(finger: FingerSpec, angles: Array, link: int, along: float, across: float) -> Array:
    """Where a point fixed to a link is, by its lengths along and across that link."""
    joints, absolute = joint_positions(finger, angles), link_angles(angles)
    u = link_direction(absolute[link])
    return np.asarray(joints[link] + along * u + across * np.array([u[1], -u[0]]))


def differences(finger: FingerSpec, angles: Array, link: int, along: float, across: float) -> Array:
    """Central differences of that point, (2, n) [m/rad]."""
    step = 1e-6
    columns = []
    for joint in range(len(angles)):
        move = np.zeros_like(angles)
        move[joint] = step
        ahead = carried_point(finger, angles + move, link, along, across)
        behind = carried_point(finger, angles - move, link, along, across)
        columns.append((ahead - behind) / (2 * step))
    return np.stack(columns, axis=-1)


@given(finger_and_angles, st.floats(-0.05, 0.15), st.floats(-0.03, 0.03))
def test_the_jacobian_is_the_finite_difference(case: tuple[FingerSpec, Array], along: float, across: float) -> None:
    finger, angles = case
    last = len(angles) - 1
    point = carried_point(finger, angles, last, along, across)
    jacobian = point_jacobian(joint_positions(finger, angles)[:-1], point)
    np.testing.assert_allclose(jacobian, differences(finger, angles, last, along, across), atol=1e-9)


@given(finger_and_angles, st.integers(0, 2), st.floats(-0.05, 0.15))
def test_joints_beyond_a_link_do_not_move_it(case: tuple[FingerSpec, Array], link: int, along: float) -> None:
    finger, angles = case
    link = min(link, len(angles) - 1)
    point = carried_point(finger, angles, link, along, 0.01)
    jacobian = link_jacobian(joint_positions(finger, angles)[:-1], point, np.array(link))
    np.testing.assert_allclose(jacobian, differences(finger, angles, link, along, 0.01), atol=1e-9)
    assert not jacobian[:, link + 1 :].any()


@given(finger_and_angles)
def test_links_keep_their_lengths_and_turn_by_their_joints(case: tuple[FingerSpec, Array]) -> None:
    finger, angles = case
    joints = joint_positions(finger, angles)
    np.testing.assert_array_equal(joints[0], finger.base)
    links = np.diff(joints, axis=0)
    np.testing.assert_allclose(np.linalg.norm(links, axis=-1), finger.links)
    headings = np.arctan2(links[:, 1], links[:, 0]) - np.pi / 2
    np.testing.assert_allclose(np.exp(1j * np.diff(headings, prepend=0.0)), np.exp(1j * angles), atol=1e-9)


def test_a_straight_finger_points_along_y_and_turns_counter_clockwise() -> None:
    finger = parse_hand_name(CATALOGUE[0]).right
    base = np.array(finger.base)
    np.testing.assert_allclose(joint_positions(finger, np.zeros(2)) - base, [(0, 0), (0, 0.072), (0, 0.144)])
    bent = joint_positions(finger, np.array([0.0, np.pi / 2])) - base
    np.testing.assert_allclose(bent[-1], (-0.072, 0.072), atol=1e-12)


@pytest.mark.parametrize("name", CATALOGUE)
def test_a_batch_is_its_members_and_the_hand_its_fingers(name: str) -> None:
    hand = parse_hand_name(name)
    angles = np.random.default_rng(2).uniform(-2, 2, (3, 5, hand.n_joints))
    positions = hand_positions(hand, angles)
    assert positions.shape == (3, 5, hand.n_joints + 2, 2)
    left, right = hand.slices
    expected = [joint_positions(hand.left, angles[2, 4, left]), joint_positions(hand.right, angles[2, 4, right])]
    np.testing.assert_array_equal(positions[2, 4], np.concatenate(expected))
    joints = joint_positions(hand.left, angles[..., left])
    batch = point_jacobian(joints[..., :-1, :], joints[..., -1, :])
    np.testing.assert_array_equal(batch[1, 3], point_jacobian(joints[1, 3, :-1], joints[1, 3, -1]))
    links = np.array([[0, 1, 1, 0, 1]] * 3)
    some = link_jacobian(joints[..., :-1, :], joints[..., -1, :], links)
    np.testing.assert_array_equal(some[0, 0, :, 1:], 0)
    np.testing.assert_array_equal(some[0, 1, :, :2], batch[0, 1, :, :2])


@pytest.mark.parametrize("name", CATALOGUE)
def test_mirrored_joints_give_mirrored_positions(name: str) -> None:
    finger = parse_hand_name(name).left
    other = FingerSpec((-finger.base[0], finger.base[1]), finger.links, finger.limits, -finger.bend)
    angles = np.random.default_rng(3).uniform(-2, 2, (20, len(finger.links)))
    np.testing.assert_allclose(joint_positions(other, -angles), joint_positions(finger, angles) * (-1, 1), atol=1e-15)


@pytest.mark.parametrize("name", CATALOGUE)
def test_joints_and_tips_are_where_the_simulator_puts_its_bodies(name: str) -> None:
    hand = parse_hand_name(name)
    model = build_model(hand, parse_object_name("cube_39"), SceneSpec())
    data = mujoco.MjData(model)
    for angles in np.random.default_rng(27).uniform(-2, 2, (10, hand.n_joints)):
        data.qpos[: hand.n_joints] = angles
        mujoco.mj_kinematics(model, data)
        for finger, side, place in zip(hand.fingers, FINGER_NAMES, hand.slices, strict=True):
            joints = joint_positions(finger, angles[place])
            bodies = [data.body(f"{side}_{i}") for i in range(len(finger.links))]
            tip = bodies[-1].xpos + bodies[-1].xmat.reshape(3, 3) @ [0, finger.links[-1], 0]
            np.testing.assert_allclose([*(body.xpos[:2] for body in bodies), tip[:2]], joints, atol=1e-12)
