"""Rotations in space, against SciPy and against the planar poses."""

import numpy as np
from scipy.spatial.transform import Rotation

from inhand import geometry, rotations
from inhand.geometry import TURN_ARM, Array


def drawn(count: int) -> Array:
    """Quaternions w x y z, with and without a negative w."""
    quaternions = np.random.default_rng(0).standard_normal((count, 4))
    return np.asarray(quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True))


def scipy_of(quaternion: Array) -> Rotation:
    return Rotation.from_quat(np.roll(quaternion, -1, axis=-1))


def test_they_are_those_of_scipy() -> None:
    one, other = drawn(50), drawn(50)[::-1]
    np.testing.assert_allclose(rotations.matrix_of(one), scipy_of(one).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(rotations.vector_of(one), scipy_of(one).as_rotvec(), atol=1e-12)
    product = (scipy_of(one) * scipy_of(other)).as_matrix()
    np.testing.assert_allclose(rotations.matrix_of(rotations.multiply(one, other)), product, atol=1e-12)
    vectors = np.random.default_rng(1).standard_normal((50, 3)) * 3
    made = rotations.quaternion_of(vectors)
    np.testing.assert_allclose(rotations.matrix_of(made), Rotation.from_rotvec(vectors).as_matrix(), atol=1e-12)
    between = (scipy_of(other) * scipy_of(one).inv()).as_rotvec()
    np.testing.assert_allclose(rotations.rotation_between(one, other), between, atol=1e-12)
    np.testing.assert_array_equal(rotations.vector_of(np.array([1.0, 0, 0, 0])), np.zeros(3))
    np.testing.assert_array_equal(rotations.quaternion_of(np.zeros(3)), [1, 0, 0, 0])


def test_poses_are_composed_and_undone() -> None:
    rng = np.random.default_rng(2)
    one, other = (np.concatenate([rng.standard_normal((20, 3)), q], axis=-1) for q in (drawn(20), drawn(20)[::-1]))
    points = rng.standard_normal((20, 3))
    both = rotations.placed(rotations.joined(one, other), points)
    np.testing.assert_allclose(both, rotations.placed(one, rotations.placed(other, points)), atol=1e-12)
    np.testing.assert_allclose(rotations.seen_from(one, rotations.placed(one, points)), points, atol=1e-12)


def test_turns_are_counted_past_half_a_turn() -> None:
    turns = np.deg2rad(np.arange(0, 271.0))[:, None] * np.array([0, 0, 1.0])
    path = rotations.SpatialPath(np.zeros_like(turns), turns)
    np.testing.assert_allclose(path.length, TURN_ARM * np.deg2rad(270))
    move, turned = path.at(TURN_ARM * np.deg2rad(200.5))
    np.testing.assert_allclose((move, turned), (np.zeros(3), [0, 0, np.deg2rad(200.5)]), atol=1e-12)


def test_upright_paths_are_the_planar_ones() -> None:
    poses = np.random.default_rng(3).standard_normal((2, 9, 3)) * [0.02, 0.02, 0.5]
    poses[:, 0] = 0
    zero = np.zeros((2, 9, 1))
    path = rotations.SpatialPath(
        np.concatenate([poses[..., :2], zero], axis=-1), np.concatenate([zero, zero, poses[..., 2:]], axis=-1)
    )
    np.testing.assert_allclose(path.way, geometry.Path(poses).way)
    start = geometry.spatial(np.array([0.01, 0.1, 0.3]), 0.05)
    lifted = path.poses(np.tile(start, (2, 1)))
    expected = geometry.spatial(poses + np.array([0.01, 0.1, 0.3]), 0.05)
    np.testing.assert_allclose(lifted, expected, atol=1e-12)
    moves, turns = path.at(np.array([0.01, 0.02]))
    planar = geometry.Path(poses).at(np.array([0.01, 0.02]))
    np.testing.assert_allclose(np.concatenate([moves[:, :2], turns[:, 2:]], axis=-1), planar, atol=1e-12)
