"""Poses of plans as plain numbers: x, y and theta in the plane; x, y, z and a rotation vector in space [m, rad].

In space rotations are counted from how the object starts, and are no longer than half a turn.
"""

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from inhand.geometry import TURN_ARM, Array, planar
from inhand.rotations import multiply, quaternion_of, rotation_between, vector_of

Pose: TypeAlias = tuple[float, ...]
"""x [m], y [m], theta [rad]; or x, y, z [m] and a rotation vector [rad]."""


def places(size: int) -> int:
    """Return how many numbers of a pose of so many say where it is; the others say how it is turned."""
    return (size + 1) // 2


def place(pose: Pose) -> Pose:
    """Return where a pose is [m]."""
    return pose[: places(len(pose))]


def rotation(pose: Pose) -> Pose:
    """Return how a pose is turned [rad]."""
    return pose[places(len(pose)) :]


def plain(pose: Array | Sequence[float]) -> Pose:
    """Return a pose as plain numbers."""
    return tuple(float(value) for value in pose)


def arms(size: int) -> Array:
    """Return what numbers of a pose count as ways: lengths as they are, angles as arcs at `TURN_ARM`."""
    return np.where(np.arange(size) < places(size), 1.0, TURN_ARM)


def poses_of(pose: Array, *, space: bool) -> Array:
    """Return full poses `(..., 7)` as those of plans `(..., 6)` in space, or `(..., 3)`."""
    if not space:
        return planar(pose)
    return np.concatenate([pose[..., :3], vector_of(pose[..., 3:])], axis=-1)


def full(pose: Array) -> Array:
    """Return poses of plans in space `(..., 6)` as full poses `(..., 7)`."""
    return np.concatenate([pose[..., :3], quaternion_of(pose[..., 3:])], axis=-1)


def apart(one: Pose, other: Pose) -> float:
    """Return the angle between how two poses are turned [rad]."""
    if len(one) == 3:
        return abs(math.remainder(other[2] - one[2], 2 * math.pi))
    (a, b, c, d), (w, x, y, z) = _quaternion(rotation(one)), _quaternion(rotation(other))
    return 2 * math.acos(min(abs(a * w + b * x + c * y + d * z), 1.0))


def _quaternion(vector: Pose) -> tuple[float, float, float, float]:
    """Return the quaternion of a rotation vector [rad], without the cost of arrays."""
    size = math.hypot(*vector)
    share = math.sin(size / 2) / size if size > 0 else 0.5
    x, y, z = vector
    return math.cos(size / 2), share * x, share * y, share * z


def between(start: Pose, end: Pose, shares: Array) -> Array:
    """Return poses `(S, k)` straight and turning evenly from one pose to another, at shares `(S,)` of the way."""
    here, there = np.array(start), np.array(end)
    if len(start) == 3:
        return np.asarray(here + shares[:, None] * (there - here))
    from_here = quaternion_of(here[3:])
    whole = rotation_between(from_here, quaternion_of(there[3:]))
    turned = vector_of(multiply(quaternion_of(shares[:, None] * whole), from_here))
    return np.concatenate([here[:3] + shares[:, None] * (there - here)[:3], turned], axis=-1)


def nearest_rotation(start: Pose, end: Pose, pose: Pose) -> Pose:
    """Return, of the rotations on the way from one pose to another, that nearest to how a pose is turned [rad]."""
    if len(pose) == 3:
        return (pose[2] - _beyond(start, end, pose),)
    here = quaternion_of(rotation(start))
    whole = rotation_between(here, quaternion_of(rotation(end)))
    angle = float(np.linalg.norm(whole))
    if angle == 0.0:
        return rotation(start)
    w, *xyz = multiply(quaternion_of(rotation(pose)), here * np.array([1.0, -1.0, -1.0, -1.0])).tolist()
    twist = math.remainder(2 * math.atan2(float(np.dot(xyz, whole / angle)), w), 2 * math.pi)
    share = min(max(twist / angle, 0.0), 1.0)
    return plain(vector_of(multiply(quaternion_of(share * whole), here)))


def turned_beyond(start: Pose, end: Pose, pose: Pose) -> float:
    """Return the angle between how a pose is turned and the nearest rotation on the way between two others [rad]."""
    if len(pose) == 3:
        return abs(_beyond(start, end, pose))
    return apart(pose, (*place(pose), *nearest_rotation(start, end, pose)))


def _beyond(start: Pose, end: Pose, pose: Pose) -> float:
    """Return by how much a pose of the plane is turned beyond two others, signed [rad]."""
    middle, half = (start[2] + end[2]) / 2, abs(end[2] - start[2]) / 2
    away = math.remainder(pose[2] - middle, 2 * math.pi)
    return math.copysign(max(abs(away) - half, 0.0), away)
