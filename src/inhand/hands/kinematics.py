"""Batch kinematics of planar fingers: joints, link angles, Jacobians and their damped least-squares inverse."""

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array, chain, perpendicular, unit
from inhand.hands.hand import FingerSpec, HandSpec


def link_angles(joint_angles: Array) -> Array:
    """Return the absolute angles `(..., n)` [rad] of a finger's links from its joint angles `(..., n)`."""
    return np.cumsum(joint_angles, axis=-1)


def link_direction(angle: Array) -> Array:
    """Return the unit vectors `(..., 2)` along links at absolute angles [rad]; zero points along +y."""
    return perpendicular(unit(angle))


def joint_positions(finger: FingerSpec, joint_angles: Array) -> Array:
    """Return the joints and the tip `(..., n + 1, 2)` [m] of a finger in the palm frame."""
    return chain(finger.base, finger.links, joint_angles)


def hand_positions(hand: HandSpec, joint_angles: Array) -> Array:
    """Return joints and tips of all F fingers `(..., n_joints + F, 2)` [m], finger by finger."""
    parts = [
        joint_positions(finger, joint_angles[..., place])
        for finger, place in zip(hand.fingers, hand.slices, strict=True)
    ]
    return np.concatenate(parts, axis=-2)


def point_jacobian(joints: Array, point: Array) -> Array:
    """Return how a point `(..., 2)` [m] of the last link moves with the joints at `(..., n, 2)` [m]: `(..., 2, n)`."""
    return perpendicular(point[..., None, :] - joints).swapaxes(-1, -2)


def link_jacobian(joints: Array, point: Array, link: NDArray[np.int64]) -> Array:
    """Return `point_jacobian` for a point of link `link` `(...)`: joints beyond that link do not move it."""
    jacobian = point_jacobian(joints, point)
    carried = np.arange(joints.shape[-2]) <= link[..., None]
    return np.asarray(jacobian * carried[..., None, :])


def damped_least_squares(jacobian: Array, step: Array, damping: float, posture: Array | None = None) -> Array:
    """Return joint steps `(..., n)` [rad] that move a point by `step` `(..., 2)` [m].

    Minimises |J dq - dx|^2 + damping^2 |dq|^2 with J `(..., 2, n)` [m/rad], so dq = J' (J J' + damping^2 I)^-1 dx. A
    posture step `(..., n)` [rad] is added where it does not move the point (only fingers of three links have room for
    it). The weights are mink's with unit cost on position (Wampler 1986; thesis 3.2).
    """
    a = (jacobian[..., 0, :] ** 2).sum(-1) + damping**2
    b = (jacobian[..., 0, :] * jacobian[..., 1, :]).sum(-1)
    c = (jacobian[..., 1, :] ** 2).sum(-1) + damping**2
    wanted = step
    if posture is not None:
        wanted = step - (jacobian * posture[..., None, :]).sum(-1)
    determinant = a * c - b * b
    first = (c * wanted[..., 0] - b * wanted[..., 1]) / determinant
    second = (a * wanted[..., 1] - b * wanted[..., 0]) / determinant
    joint_step = jacobian[..., 0, :] * first[..., None] + jacobian[..., 1, :] * second[..., None]
    return np.asarray(joint_step if posture is None else joint_step + posture)
