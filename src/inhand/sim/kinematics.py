"""Batch kinematics of planar fingers: joints, link angles and Jacobians, in NumPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array, perpendicular
from inhand.sim.hands import FingerSpec, HandSpec


def link_angles(joint_angles: Array) -> Array:
    """Return the absolute angles `(..., n)` [rad] of a finger's links from its joint angles `(..., n)`."""
    return np.cumsum(joint_angles, axis=-1)


def link_direction(angle: Array) -> Array:
    """Return the unit vectors `(..., 2)` along links at absolute angles [rad]; zero points along +y."""
    return np.stack([-np.sin(angle), np.cos(angle)], axis=-1)


def joint_positions(finger: FingerSpec, joint_angles: Array) -> Array:
    """Return the joints and the tip `(..., n + 1, 2)` [m] of a finger in the palm frame."""
    steps = link_direction(link_angles(joint_angles)) * np.array(finger.links)[:, None]
    base = np.broadcast_to(np.array(finger.base), (*steps.shape[:-2], 1, 2))
    return np.concatenate([base, base + np.cumsum(steps, axis=-2)], axis=-2)


def hand_positions(hand: HandSpec, joint_angles: Array) -> Array:
    """Return joints and tips of both fingers `(..., n_joints + 2, 2)` [m], left finger first."""
    parts = [
        joint_positions(finger, joint_angles[..., place])
        for finger, place in zip(hand.fingers, hand.slices, strict=True)
    ]
    return np.concatenate(parts, axis=-2)


def point_jacobian(joints: Array, point: Array) -> Array:
    """Return how a point of the last link moves with the joints, `(..., 2, n)` [m/rad].

    Args:
        joints: positions of the joints in the palm frame, `(..., n, 2)` [m].
        point: the point in the palm frame, `(..., 2)` [m].
    """
    return np.moveaxis(perpendicular(point[..., None, :] - joints), -1, -2)


def link_jacobian(joints: Array, point: Array, link: NDArray[np.int64]) -> Array:
    """Return `point_jacobian` for a point of link `link` `(...)`: joints beyond that link do not move it."""
    jacobian = point_jacobian(joints, point)
    carried = np.arange(joints.shape[-2]) <= link[..., None]
    return np.asarray(jacobian * carried[..., None, :])
