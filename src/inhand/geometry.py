"""Planar poses and frames.

A planar pose is an array `(..., 3)` of x [m], y [m] and theta [rad], counter-clockwise. `pose_a_b` is the
pose of frame b seen from frame a, so `compose(pose_a_b, pose_b_c)` is `pose_a_c`. Every function takes any
leading batch axes and broadcasts them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.float64]
TURN_ARM = 0.025
"""Arm at which a turn counts as a way along a path [m]: about the half width of the objects."""
SAME = 1e-9
"""Ways and angles closer than this are one [m or rad]."""


@dataclass(frozen=True, eq=False)
class Path:
    """Poses that objects are carried along, one path or one for each of B worlds: to be followed, not timed."""

    poses: Array
    """Poses in their order `(..., S, 3)` [m, m, rad], or in space `(..., S, 6)`: places and rotation vectors."""

    @cached_property
    def way(self) -> Array:
        """Way from the first pose to each of them `(..., S)` [m]; a turn counts as an arc at `TURN_ARM`."""
        return way_along(self.poses)

    @property
    def length(self) -> Array:
        """Way from the first pose to the last `(...)` [m]."""
        return self.way[..., -1]

    def at(self, way: ArrayLike) -> Array:
        """Return poses `(..., k)` at ways `(...)` [m], one along each of many paths or any along one.

        They are linear between two poses of the path; before its start and beyond its end they are those.
        """
        wanted, paths = np.asarray(way, dtype=float), tuple(np.indices(self.way.shape[:-1]))
        above = np.minimum((self.way < wanted[..., None]).sum(axis=-1), self.way.shape[-1] - 1)
        below = np.maximum(above - 1, 0)
        low, high = self.way[(*paths, below)], self.way[(*paths, above)]
        share = np.clip((wanted - low) / np.maximum(high - low, 1e-12), 0.0, 1.0)[..., None]
        return np.asarray((1 - share) * self.poses[(*paths, below)] + share * self.poses[(*paths, above)])

    def beyond(self, way: float) -> Path:
        """Return what is left of one path from a way on [m]."""
        return Path(np.concatenate([self.at([way]), self.poses[self.way > way + SAME]]))


def fixed(numbers: ArrayLike) -> Array:
    """Return an array that all who ask share, and nobody may change."""
    array = np.array(numbers, dtype=float)
    array.setflags(write=False)
    return array


def way_along(poses: Array) -> Array:
    """Return the way `(..., S)` [m] from the first of poses `(..., S, k)`; a turn counts as an arc at `TURN_ARM`.

    Poses are of the plane, `(..., 3)`, or of space, places and rotation vectors `(..., 6)`.
    """
    steps = np.diff(poses, axis=-2)
    if poses.shape[-1] > 3:
        moved, turned = (np.linalg.norm(part, axis=-1) for part in (steps[..., :3], steps[..., 3:]))
    else:
        moved, turned = np.linalg.norm(steps[..., :2], axis=-1), np.abs(steps[..., 2])
    steps = moved + TURN_ARM * turned
    return np.concatenate([np.zeros((*steps.shape[:-1], 1)), np.cumsum(steps, axis=-1)], axis=-1)


def length(points: Array) -> float:
    """Return the length of a path `(T, k)`."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def frechet(one: Array, other: Array) -> float:
    """Return the discrete Frechet distance of two lists of points `(N, d)` and `(M, d)`.

    It is how far two points, one on each list, must come apart at least, where both go from start to end and never back
    (Eiter and Mannila 1994). Pairs are looked at a diagonal at a time, of which each needs the two before it.
    """
    short, long = sorted((one, other), key=len)
    count = len(short)
    squares = sum(np.square(a[:, None] - b) for a, b in zip(short.T, long.T, strict=True))
    padded = np.pad(squares, ((0, 0), (0, count)), constant_values=np.inf)
    diagonals = padded.ravel()[:-count].reshape(count, -1).T.copy()  # that row shifted by its number
    before, last, now = np.full((3, count + 1), np.inf)
    last[1] = squares[0, 0]
    for diagonal in diagonals[1:]:
        least = np.minimum(before[:-1], last[:-1], out=now[1:])
        np.minimum(least, last[1:], out=least)
        np.maximum(least, diagonal, out=least)
        before, last, now = last, now, before
    return float(np.sqrt(last[-1]))


def interpolate(wanted: ArrayLike, knots: Array, rows: Array) -> Array:
    """Return rows `(..., k)` at places `(...)`, linear between rows `(S, k)` at knots `(S,)`, the ends held."""
    return np.stack([np.interp(np.asarray(wanted, dtype=float), knots, column) for column in rows.T], axis=-1)


def longest_run(flags: NDArray[np.bool_]) -> int:
    """Return the length of the longest run of true flags `(T,)`."""
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return int(np.max(bounds[1::2] - bounds[::2], initial=0))


def wrap_angle(angle: ArrayLike) -> Array:
    """Return angles [rad] moved into [-pi, pi)."""
    return np.asarray((np.asarray(angle, dtype=float) + np.pi) % (2 * np.pi) - np.pi)


def unit(angle: ArrayLike) -> Array:
    """Return the unit vectors `(..., 2)` at angles [rad] counter-clockwise from +x."""
    angle = np.asarray(angle, dtype=float)
    return from_parts(np.cos(angle), np.sin(angle))


def from_parts(*parts: Array) -> Array:
    """Return vectors `(..., k)` of k coordinates `(...)`: `np.stack` takes two to three times as long where few."""
    found = np.empty((*parts[0].shape, len(parts)))
    for k, part in enumerate(parts):
        found[..., k] = part
    return found


def rotate(angle: ArrayLike, vectors: ArrayLike) -> Array:
    """Return vectors `(..., 2)` turned counter-clockwise by angles `(...)` [rad]."""
    angle = np.asarray(angle, dtype=float)
    vectors = np.asarray(vectors, dtype=float)
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return from_parts(cos * x - sin * y, sin * x + cos * y)


def cross(a: Array, b: Array) -> Array:
    """Return the planar cross product a_x b_y - a_y b_x of vectors `(..., 2)`."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def perpendicular(vectors: Array) -> Array:
    """Return vectors `(..., 2)` turned a quarter counter-clockwise."""
    return from_parts(-vectors[..., 1], vectors[..., 0])


def transform(pose: Array, points: Array) -> Array:
    """Return points `(..., 2)` [m] of frame b in frame a, with `pose` = pose_a_b `(..., 3)`."""
    return rotate(pose[..., 2], points) + pose[..., :2]


def inverse_transform(pose: Array, points: Array) -> Array:
    """Return points `(..., 2)` [m] of frame a in frame b, with `pose` = pose_a_b `(..., 3)`."""
    return rotate(-pose[..., 2], points - pose[..., :2])


def compose(pose_a_b: Array, pose_b_c: Array) -> Array:
    """Return pose_a_c `(..., 3)`; the angle is the plain sum, so that full turns are kept."""
    position = transform(pose_a_b, pose_b_c[..., :2])
    angle = pose_a_b[..., 2] + pose_b_c[..., 2]
    return np.concatenate([position, angle[..., None]], axis=-1)


def chain(base: ArrayLike, links: ArrayLike, joint_angles: Array) -> Array:
    """Return the joints and the end `(..., n + 1, 2)` [m] of a chain of links [m] from a base `(2,)` [m].

    Each joint angle `(..., n)` [rad] counts from the link before; at zero all links point along +y.
    """
    steps = perpendicular(unit(np.cumsum(joint_angles, axis=-1))) * np.asarray(links)[:, None]
    joints = np.empty((*steps.shape[:-2], steps.shape[-2] + 1, 2))
    joints[..., 0, :] = base
    np.add(base, np.cumsum(steps, axis=-2), out=joints[..., 1:, :])
    return joints


def yaw(quaternion: ArrayLike) -> Array:
    """Return the rotation about z [rad] of unit quaternions `(..., 4)` (w, x, y, z)."""
    parts = np.asarray(quaternion, dtype=float)
    w, x, y, z = (parts[..., k] for k in range(4))
    return np.asarray(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def turn(quaternion: Array, vectors: Array) -> Array:
    """Return vectors `(..., 3)` turned by unit quaternions `(..., 4)` (w, x, y, z): v + 2 u x (u x v + w v)."""
    w, x, y, z = (quaternion[..., k] for k in range(4))
    a, b, c = (vectors[..., k] for k in range(3))
    p, q, r = y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c
    return from_parts(a + 2 * (y * r - z * q), b + 2 * (z * p - x * r), c + 2 * (x * q - y * p))


def inverse_quaternion(quaternion: Array) -> Array:
    """Return the unit quaternions `(..., 4)` (w, x, y, z) that turn back."""
    return np.asarray(quaternion * np.array([1.0, -1.0, -1.0, -1.0]))


def planar(pose: ArrayLike) -> Array:
    """Return the planar view `(..., 3)` of full poses `(..., 7)` (position [m], quaternion w x y z)."""
    pose = np.asarray(pose, dtype=float)
    return np.concatenate([pose[..., :2], yaw(pose[..., 3:])[..., None]], axis=-1)


def spatial(pose: ArrayLike, height: float | Array) -> Array:
    """Return full poses `(..., 7)` standing upright at `height` [m] from planar poses `(..., 3)`."""
    pose = np.asarray(pose, dtype=float)
    half = pose[..., 2] / 2
    parts = np.zeros((*pose.shape[:-1], 7))
    parts[..., :2], parts[..., 2] = pose[..., :2], height
    parts[..., 3], parts[..., 6] = np.cos(half), np.sin(half)
    return parts


def distance_to(points: Array, start: Array, end: Array) -> Array:
    """Return the distance `(...,)` of points `(..., d)` from the straight line between two others, ends included."""
    chord = end - start
    size = np.maximum((chord**2).sum(axis=-1, keepdims=True), 1e-18)
    share = np.clip(((points - start) * chord).sum(axis=-1, keepdims=True) / size, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - share * chord, axis=-1))
