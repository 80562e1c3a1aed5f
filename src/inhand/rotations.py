"""Poses in space: unit quaternions (w, x, y, z), rotation vectors, and paths whose turns pass 180 degrees.

A pose in space is an array `(..., 7)`: position [m], unit quaternion. Every function takes any leading batch axes and
broadcasts them. The planar poses of `geometry` are the special case that `geometry.spatial` lifts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from inhand.geometry import Array, Path, from_parts, inverse_quaternion, turn

SMALL = 1e-12
"""Half angles below this are none [rad]."""


def multiply(one: Array, other: Array) -> Array:
    """Return the quaternions `(..., 4)` that turn by `other` first and by `one` after it."""
    a, b, c, d = (one[..., k] for k in range(4))
    w, x, y, z = (other[..., k] for k in range(4))
    return from_parts(
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def quaternion_of(vector: ArrayLike) -> Array:
    """Return the unit quaternions `(..., 4)` of rotation vectors `(..., 3)` [rad]."""
    vector = np.asarray(vector, dtype=float)
    half = np.linalg.norm(vector, axis=-1, keepdims=True) / 2
    share = np.where(half > SMALL, np.sin(half) / np.maximum(2 * half, SMALL), 0.5)
    return np.concatenate([np.cos(half), share * vector], axis=-1)


def vector_of(quaternion: Array) -> Array:
    """Return the rotation vectors `(..., 3)` [rad] of unit quaternions `(..., 4)`, at most pi long.

    A turn of more than pi is told as one the other way: set points know how far they turned, measure from those.
    """
    sign = np.where(quaternion[..., :1] < 0, -1.0, 1.0)
    w, xyz = sign * quaternion[..., :1], sign * quaternion[..., 1:]
    size = np.linalg.norm(xyz, axis=-1, keepdims=True)
    return np.asarray(np.where(size > SMALL, 2 * np.arctan2(size, w) / np.maximum(size, SMALL), 2.0) * xyz)


def matrix_of(quaternion: Array) -> Array:
    """Return the rotation matrices `(..., 3, 3)` of unit quaternions `(..., 4)`."""
    w, x, y, z = (quaternion[..., k] for k in range(4))
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([from_parts(*row) for row in rows], axis=-2)


def rotation_between(one: Array, other: Array) -> Array:
    """Return the rotation vectors `(..., 3)` [rad], at most pi long, that bring quaternions `one` to `other`."""
    return vector_of(multiply(other, inverse_quaternion(one)))


def placed(pose: Array, points: Array) -> Array:
    """Return points `(..., 3)` [m] of frame b in frame a, with `pose` = pose_a_b `(..., 7)`."""
    return np.asarray(pose[..., :3] + turn(pose[..., 3:], points))


def seen_from(pose: Array, points: Array) -> Array:
    """Return points `(..., 3)` [m] of frame a in frame b, with `pose` = pose_a_b `(..., 7)`."""
    return turn(inverse_quaternion(pose[..., 3:]), points - pose[..., :3])


def joined(pose_a_b: Array, pose_b_c: Array) -> Array:
    """Return pose_a_c `(..., 7)`."""
    position, quaternion = placed(pose_a_b, pose_b_c[..., :3]), multiply(pose_a_b[..., 3:], pose_b_c[..., 3:])
    return np.concatenate([position, quaternion], axis=-1)


@dataclass(frozen=True, eq=False)
class SpatialPath:
    """What objects are carried along in space, one path or one for each of B worlds: to be followed, not timed.

    A pose is told by where it is from the start and by a rotation vector, along the palm's axes. A rotation vector may
    be longer than pi, so a turn about one axis is counted beyond half a turn.
    """

    moves: Array
    """Positions from the start `(..., S, 3)` [m]."""
    turns: Array
    """Rotation vectors from the start `(..., S, 3)` [rad]."""

    @classmethod
    def still(cls, count: int) -> SpatialPath:
        """Return paths that stay on the spot."""
        return cls(np.zeros((count, 2, 3)), np.zeros((count, 2, 3)))

    @cached_property
    def path(self) -> Path:
        """The same with places and rotation vectors in one array `(..., S, 6)`."""
        return Path(np.concatenate([self.moves, self.turns], axis=-1))

    @property
    def way(self) -> Array:
        """Way from the first pose to each of them `(..., S)` [m]; a turn counts as an arc at `TURN_ARM`."""
        return self.path.way

    @property
    def length(self) -> Array:
        """Way from the first pose to the last `(...)` [m]."""
        return self.path.length

    def at(self, way: ArrayLike) -> tuple[Array, Array]:
        """Return positions and rotation vectors `(..., 3)` at ways `(...)` [m], as `Path.at` has them."""
        pose = self.path.at(way)
        return pose[..., :3], pose[..., 3:]

    def poses(self, start: Array) -> Array:
        """Return the poses `(..., S, 7)` of objects that start at poses `(..., 7)`."""
        return pose_from(start[..., None, :], self.moves, self.turns)


def pose_from(start: Array, move: Array, turned: Array) -> Array:
    """Return poses `(..., 7)` moved `(..., 3)` [m] and turned `(..., 3)` [rad] from a start `(..., 7)`."""
    quaternion = multiply(quaternion_of(turned), start[..., 3:])
    position = np.broadcast_to(start[..., :3] + move, (*quaternion.shape[:-1], 3))
    return np.concatenate([position, quaternion], axis=-1)


def change_between(pose: Array, other: Array) -> Array:
    """Return by what way [m] and rotation vector [rad] poses `(..., 7)` become others: `(..., 6)`, for `pose_from`."""
    return np.concatenate([other[..., :3] - pose[..., :3], rotation_between(pose[..., 3:], other[..., 3:])], axis=-1)


def carried(motion: Array, arm: Array) -> Array:
    """Return how a point at `arm` `(B, 3)` from the object's middle moves with motions `(B, 6)`."""
    u, v, w = motion[:, 3:].T
    x, y, z = arm.T
    return np.asarray(motion[:, :3] + from_parts(v * z - w * y, w * x - u * z, u * y - v * x))
