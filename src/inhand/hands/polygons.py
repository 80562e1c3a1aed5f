"""Contact and overlap of convex polygons, vectorised over any leading axes; corners counter-clockwise."""

import math

import numpy as np

from inhand.geometry import Array, from_parts

MANY = 8
"""Cases from which on contacts are found by compiled code."""


def is_box(corners: Array) -> bool:
    """Return whether an outline `(K, 2)` is a rectangle along x and y."""
    if len(corners) != 4:
        return False
    low, high = corners.min(axis=0), corners.max(axis=0)
    return bool((np.isclose(corners, low) | np.isclose(corners, high)).all())


def edge_normals(corners: Array) -> Array:
    """Return the outward unit normals `(..., K, 2)` of the edges that start at each corner `(..., K, 2)`."""
    edge = np.roll(corners, -1, axis=-2) - corners
    normal = from_parts(edge[..., 1], -edge[..., 0])
    return np.asarray(normal / np.linalg.norm(normal, axis=-1, keepdims=True))


def with_corners(corners: Array, count: int) -> Array:
    """Return the same polygon `(K, 2)` with more corners, `(count, 2)`: those missing lie on its last edge."""
    share = np.arange(1, count - len(corners) + 1)[:, None] / (count - len(corners) + 1)
    return np.concatenate([corners, corners[-1] + share * (corners[0] - corners[-1])])


def contact(first: Array, second: Array) -> tuple[Array, Array, Array]:
    """Return separation `(...)` [m], contact point `(..., 2)` [m] and normal `(..., 2)` of two convex polygons.

    By separating axes over the edges of both: the separation is negative where they overlap and, where a gap is
    bridged corner to corner, a lower bound. The contact is the other polygon's corner nearest to the separating
    edge; the normal points from the second polygon to the first. Of many cases it is compiled, to the same bytes: a
    real hand, which is one, needs NumPy alone.
    """
    if math.prod(np.broadcast_shapes(first.shape[:-2], second.shape[:-2])) >= MANY:
        from inhand.hands.contact_kernels import met

        return met(first, second)
    batch, one, other = _lanes(first, second)
    from_second, corner_first, normal_second = _deepest(other, one)
    from_first, corner_second, normal_first = _deepest(one, other)
    by_second = from_second >= from_first
    separation = np.where(by_second, from_second, from_first)
    point = np.where(by_second, corner_first, corner_second)
    normal = np.where(by_second, normal_second, -normal_first)
    return separation.reshape(batch), point.T.reshape(*batch, 2), normal.T.reshape(*batch, 2)


def separation(first: Array, second: Array) -> Array:
    """Return the separation of convex polygons `(...)` [m], negative where they overlap; see `contact`."""
    batch, one, other = _lanes(first, second)
    by_first, by_second = _lowest(one, _normals(one), other).max(0), _lowest(other, _normals(other), one).max(0)
    return np.asarray(np.maximum(by_first, by_second).reshape(batch))


def _lanes(first: Array, second: Array) -> tuple[tuple[int, ...], Array, Array]:
    """Return the common leading axes, and both polygons as x and y of their corners over N cases, `(2, K, N or 1)`.

    With the cases last and in one row of memory every operation runs over long rows instead of pairs of numbers,
    several times as fast. It costs nothing where the corners already lie in memory like that (`link_polygons`).
    """
    batch = np.broadcast_shapes(first.shape[:-2], second.shape[:-2])
    many = [
        np.broadcast_to(corners, (*batch, *corners.shape[-2:])) if corners.ndim > 2 else corners
        for corners in (first, second)
    ]
    one, other = (np.ascontiguousarray(each.reshape(-1, *each.shape[-2:]).T) for each in many)
    return batch, one, other


def _normals(faces: Array) -> Array:
    """Return the outward unit normals `(2, E, N)` of the edges that start at each corner `(2, E, N)`."""
    x, y = np.concatenate([faces[:, 1:], faces[:, :1]], axis=1) - faces
    return np.asarray(np.stack([y, -x]) / np.sqrt(x * x + y * y))


def _lowest(faces: Array, normals: Array, corners: Array) -> Array:
    """Return the height `(E, N)` of the lowest of one polygon's corners `(2, K, N)` over every edge of the other."""
    height = normals[0][:, None] * corners[0]
    height += normals[1][:, None] * corners[1]
    return np.asarray(height.min(axis=1) - (normals * faces).sum(axis=0))


def _deepest(faces: Array, corners: Array) -> tuple[Array, Array, Array]:
    """Return the largest separation by one polygon's edges, the other's corner there, and that edge's normal."""
    normals = _normals(faces)
    lowest = _lowest(faces, normals, corners)
    count = lowest.shape[-1]
    edge, cases = lowest.argmax(axis=0), np.arange(count)
    normal = np.broadcast_to(normals, (*normals.shape[:2], count))[:, edge, cases]
    corner = (normal[0] * corners[0] + normal[1] * corners[1]).argmin(axis=0)
    point = np.broadcast_to(corners, (*corners.shape[:2], count))[:, corner, cases]
    return lowest[edge, cases], point, normal
