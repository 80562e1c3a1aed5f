"""Planar poses, frames and the planar view of full poses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from inhand.geometry import (
    Array,
    compose,
    cross,
    interpolate,
    inverse_transform,
    perpendicular,
    planar,
    rotate,
    spatial,
    transform,
    unit,
    way_along,
    wrap_angle,
    yaw,
)

LENGTH = st.floats(-1.0, 1.0)
ANGLE = st.floats(-20.0, 20.0)
POINT = st.builds(lambda x, y: np.array([x, y]), LENGTH, LENGTH)
POSE = st.builds(lambda x, y, turn: np.array([x, y, turn]), LENGTH, LENGTH, ANGLE)


def matrix(pose: Array) -> Array:
    """The homogeneous matrix of a planar pose, written out."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    return np.array([[cos, -sin, pose[0]], [sin, cos, pose[1]], [0, 0, 1]])


@given(ANGLE)
def test_a_wrapped_angle_is_the_same_turn_in_the_half_open_range(angle: float) -> None:
    wrapped = float(wrap_angle(angle))
    assert -np.pi <= wrapped < np.pi
    np.testing.assert_allclose(unit(wrapped), unit(angle), atol=1e-12)


def test_half_a_turn_wraps_to_minus_pi() -> None:
    np.testing.assert_allclose(wrap_angle([np.pi, -np.pi, 3 * np.pi, 0.5]), [-np.pi, -np.pi, -np.pi, 0.5])


@given(POSE, POSE, POINT)
def test_poses_act_like_homogeneous_matrices(pose_a_b: Array, pose_b_c: Array, point: Array) -> None:
    one = np.append(point, 1.0)
    np.testing.assert_allclose(transform(pose_a_b, point), (matrix(pose_a_b) @ one)[:2], atol=1e-12)
    np.testing.assert_allclose(matrix(compose(pose_a_b, pose_b_c)), matrix(pose_a_b) @ matrix(pose_b_c), atol=1e-12)


@given(POSE, POINT)
def test_inverse_transform_undoes_transform(pose: Array, point: Array) -> None:
    np.testing.assert_allclose(inverse_transform(pose, transform(pose, point)), point, atol=1e-12)


def test_composed_angles_keep_full_turns() -> None:
    assert compose(np.array([0.0, 0.0, 4.0]), np.array([0.0, 0.0, 4.0]))[2] == 8.0


@given(ANGLE, POINT, POINT)
def test_rotation_keeps_lengths_and_cross_products(angle: float, a: Array, b: Array) -> None:
    np.testing.assert_allclose(np.linalg.norm(rotate(angle, a)), np.linalg.norm(a), atol=1e-12)
    np.testing.assert_allclose(cross(rotate(angle, a), rotate(angle, b)), cross(a, b), atol=1e-12)


@given(POINT, POINT)
def test_perpendicular_is_a_quarter_turn_counter_clockwise(a: Array, b: Array) -> None:
    np.testing.assert_allclose(perpendicular(a), rotate(np.pi / 2, a), atol=1e-12)
    np.testing.assert_allclose(cross(a, b), (perpendicular(a) * b).sum(), atol=1e-12)


@given(st.floats(-3.1, 3.1), st.floats(-1.0, 1.0), st.floats(-0.4, 0.4))
def test_yaw_of_a_tilted_body_is_the_first_of_its_zyx_angles(turn: float, pitch: float, roll: float) -> None:
    quaternions = [
        np.array([np.cos(angle / 2), *(np.sin(angle / 2) * np.array(axis))])
        for angle, axis in ((turn, (0, 0, 1)), (pitch, (0, 1, 0)), (roll, (1, 0, 0)))
    ]
    turned = _product(_product(quaternions[0], quaternions[1]), quaternions[2])
    np.testing.assert_allclose(yaw(turned), turn, atol=1e-9)
    np.testing.assert_allclose(yaw(-turned), turn, atol=1e-9)


def _product(a: Array, b: Array) -> Array:
    scalar = a[0] * b[0] - a[1:] @ b[1:]
    return np.array([scalar, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


@given(POSE)
def test_the_planar_view_of_a_standing_pose_gives_it_back(pose: Array) -> None:
    full = spatial(pose, 0.05)
    assert full[2] == 0.05
    np.testing.assert_allclose(np.linalg.norm(full[3:]), 1.0, rtol=1e-12)
    np.testing.assert_allclose(planar(full)[:2], pose[:2])
    np.testing.assert_allclose(unit(planar(full)[2]), unit(pose[2]), atol=1e-9)


@pytest.mark.parametrize("batch", [(), (3,), (2, 5)])
def test_every_function_takes_any_batch_axes(batch: tuple[int, ...]) -> None:
    rng = np.random.default_rng(1)
    poses, points = rng.normal(size=(*batch, 3)), rng.normal(size=(*batch, 2))
    assert transform(poses, points).shape == inverse_transform(poses, points).shape == (*batch, 2)
    assert compose(poses, poses).shape == planar(spatial(poses, 0.1)).shape == (*batch, 3)
    assert cross(points, points).shape == wrap_angle(poses[..., 2]).shape == batch
    first = (0,) * len(batch)
    np.testing.assert_array_equal(transform(poses, points)[first], transform(poses[first], points[first]))


def test_many_points_of_one_frame_broadcast() -> None:
    poses = np.array([[0.0, 0.0, np.pi / 2], [1.0, 0.0, 0.0]])
    points = np.array([[1.0, 0.0], [0.0, 2.0]])
    expected = [[[0, 1], [-2, 0]], [[2, 0], [1, 2]]]
    np.testing.assert_allclose(transform(poses[:, None], points), expected, atol=1e-12)


def test_interpolated_poses_lie_on_the_path_and_ends_are_held() -> None:
    path = np.array([(0.0, 0.0, 0.0), (0.03, 0.04, 0.0), (0.03, 0.04, 0.5)])
    way = way_along(path)
    found = interpolate([-1.0, 0.0, 0.025, way[1], (way[1] + way[2]) / 2, 1.0], way, path)
    expected = [path[0], path[0], (0.015, 0.02, 0.0), path[1], (0.03, 0.04, 0.25), path[2]]
    np.testing.assert_allclose(found, expected, atol=1e-15)
    assert interpolate(0.025, way, path).shape == (3,)
    assert interpolate(np.zeros((2, 4)), way, path).shape == (2, 4, 3)
