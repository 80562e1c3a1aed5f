"""Contact and overlap of convex polygons, vectorised over any leading axes; corners counter-clockwise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inhand.geometry import Array


def is_box(corners: Array) -> bool:
    """Return whether an outline `(K, 2)` is a rectangle along x and y."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    return len(corners) == 4 and bool((np.isclose(corners, low) | np.isclose(corners, high)).all())


def edge_normals(corners: Array) -> Array:
    """Return the outward unit normals `(..., K, 2)` of the edges that start at each corner `(..., K, 2)`."""
    edge = np.roll(corners, -1, axis=-2) - corners
    normal = np.stack([edge[..., 1], -edge[..., 0]], axis=-1)
    return np.asarray(normal / np.linalg.norm(normal, axis=-1, keepdims=True))


def with_corners(corners: Array, count: int) -> Array:
    """Return the same polygon `(K, 2)` with more corners, `(count, 2)`: those missing lie on its last edge."""
    share = np.arange(1, count - len(corners) + 1)[:, None] / (count - len(corners) + 1)
    return np.concatenate([corners, corners[-1] + share * (corners[0] - corners[-1])])


def contact(first: Array, second: Array) -> tuple[Array, Array, Array]:
    """Return separation `(...)` [m], contact point `(..., 2)` [m] and normal `(..., 2)` of two convex polygons.

    By separating axes over the edges of both: the separation is negative where they overlap and, where a gap is
    bridged corner to corner, a lower bound. The contact is the other polygon's corner nearest to the separating
    edge; the normal points from the second polygon to the first.
    """
    from_second, corner_first, normal_second = _deepest(second, first)
    from_first, corner_second, normal_first = _deepest(first, second)
    by_second = from_second >= from_first
    separation = np.where(by_second, from_second, from_first)
    point = np.where(by_second[..., None], corner_first, corner_second)
    normal = np.where(by_second[..., None], normal_second, -normal_first)
    return separation, point, normal


def nearest_contact(first: Array, pieces: Sequence[Array]) -> tuple[Array, Array, Array]:
    """Return `contact` of a convex polygon with that of several convex pieces from which it is least separated."""
    if len(pieces) == 1:
        return contact(first, pieces[0])
    gaps, points, normals = (np.stack(part) for part in zip(*(contact(first, p) for p in pieces), strict=True))
    nearest = gaps.argmin(axis=0)[None]
    gap = np.take_along_axis(gaps, nearest, axis=0)[0]
    point, normal = (np.take_along_axis(part, nearest[..., None], axis=0)[0] for part in (points, normals))
    return gap, point, normal


def separation(first: Array, second: Array) -> Array:
    """Return the separation of convex polygons `(...)` [m], negative where they overlap; see `contact`."""
    by_first, by_second = _heights(first, second).min(-1).max(-1), _heights(second, first).min(-1).max(-1)
    return np.asarray(np.maximum(by_first, by_second))


def _heights(faces: Array, corners: Array) -> Array:
    """Return the height of every corner of one polygon over every edge of the other `(..., edges, corners)`."""
    normal = edge_normals(faces)
    offset = (normal * faces).sum(-1)
    return np.asarray(normal @ np.swapaxes(corners, -1, -2) - offset[..., None])


def _deepest(faces: Array, corners: Array) -> tuple[Array, Array, Array]:
    """Return the largest separation by one polygon's edges, the other's corner there, and that edge's normal."""
    height = _heights(faces, corners)
    lowest = height.min(axis=-1)
    edge = lowest.argmax(axis=-1)
    rows = np.take_along_axis(height, edge[..., None, None], axis=-2)[..., 0, :]
    corner = rows.argmin(axis=-1)
    shape = (*edge.shape, *corners.shape[-2:])
    point = np.take_along_axis(np.broadcast_to(corners, shape), corner[..., None, None], axis=-2)[..., 0, :]
    normals = np.broadcast_to(edge_normals(faces), (*edge.shape, *faces.shape[-2:]))
    normal = np.take_along_axis(normals, edge[..., None, None], axis=-2)[..., 0, :]
    return np.take_along_axis(lowest, edge[..., None], axis=-1)[..., 0], point, normal
