"""Outlines as cells: every point with every normal that a contact there can have.

A face has one normal and many points, a convex corner one point and a fan of normals. Laid end to end they make one
closed line, the normal bundle of the outline. Two convex bodies touch where a cell of one meets a cell of the other
with the opposite normal, so a contact of any two outlines is a pair of places on two such lines.
"""

from dataclasses import dataclass

import numpy as np

from inhand.geometry import Array, unit, wrap_angle
from inhand.hands.polygons import edge_normals

SMALLEST_FAN = 1e-6
"""Corners that turn by less have no fan of their own [rad]."""


@dataclass(frozen=True)
class Bundle:
    """Places on an outline's normal bundle, counter-clockwise, in the outline's frame."""

    points: Array
    """Points `(U, 2)` [m]."""
    angles: Array
    """Directions of the outward normals `(U,)`, growing along the line where the outline is convex [rad]."""

    @property
    def normals(self) -> Array:
        """Outward unit normals `(U, 2)`."""
        return unit(self.angles)

    def __len__(self) -> int:
        """Return the number of places."""
        return len(self.points)


def cells(corners: Array, spacing: float, fan: float) -> Bundle:
    """Return the middles of cells that cover the bundle of any simple outline `(K, 2)` [m], counter-clockwise.

    A cell is at most `spacing` [m] long on a face and `fan` [rad] wide on a corner; a concave corner has none.
    """
    points, angles = [], []
    for corner, after, start, turn in _corners(corners):
        length = float(np.linalg.norm(after - corner))
        if turn > SMALLEST_FAN:
            count = int(np.ceil(turn / fan - 1e-9))
            points.append(np.repeat(corner[None], count, axis=0))
            angles.append(start + turn * (np.arange(count) + 0.5) / count)
        count = max(int(np.ceil(length / spacing - 1e-9)), 1)
        share = (np.arange(count) + 0.5) / count
        points.append(corner + share[:, None] * (after - corner))
        angles.append(np.full(count, start + turn))
    return Bundle(np.concatenate(points), np.concatenate(angles))


def knots(corners: Array, spacing: float, fan: float) -> Bundle:
    """Return places along the bundle of a convex outline `(K, 2)` [m] that include both ends of every face and fan.

    The first place comes again at the end, a full turn later, so that neighbours bracket every place between.
    """
    points, angles = [], []
    for corner, after, start, turn in _corners(corners):
        length = float(np.linalg.norm(after - corner))
        count = max(int(np.ceil(turn / fan - 1e-9)), 1)
        points.append(np.repeat(corner[None], count + 1, axis=0))
        angles.append(start + turn * np.arange(count + 1) / count)
        count = int(np.ceil(length / spacing - 1e-9))
        share = np.arange(1, count) / count
        points.append(corner + share[:, None] * (after - corner))
        angles.append(np.full(len(share), start + turn))
    first = angles[0][0]
    return Bundle(np.concatenate([*points, points[0][:1]]), np.concatenate([*angles, [first + 2 * np.pi]]))


def _corners(corners: Array) -> list[tuple[Array, Array, float, float]]:
    """Return each corner, the next one, the normal's angle before it and its turn there [rad], angles unwrapped."""
    normals = edge_normals(corners)
    angle = np.arctan2(normals[:, 1], normals[:, 0])
    turns = wrap_angle(angle - np.roll(angle, 1))
    before = angle[-1] + np.concatenate([[0.0], np.cumsum(turns)[:-1]])
    after = np.roll(corners, -1, axis=0)
    return [(corners[k], after[k], float(before[k]), float(turns[k])) for k in range(len(corners))]
