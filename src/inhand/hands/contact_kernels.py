"""Contact of convex polygons, compiled: see `polygons.contact`."""

from __future__ import annotations

import math

import numpy as np

from inhand.compiled import kernel, leaf
from inhand.geometry import Array


def met(first: Array, second: Array) -> tuple[Array, Array, Array]:
    """Return `contact` of convex polygons `(..., K, 2)` and `(..., M, 2)`."""
    batch, sizes = np.broadcast_shapes(first.shape[:-2], second.shape[:-2]), (first.shape[-2:], second.shape[-2:])
    one, other = np.empty((*batch, *sizes[0])), np.empty((*batch, *sizes[1]))
    one[...], other[...], found = first, second, np.empty((math.prod(batch), 5))
    rows = np.empty((4, max(sizes)[0]))
    meet(one.reshape(-1, *sizes[0]), other.reshape(-1, *sizes[1]), rows, found)
    return found[:, 0].reshape(batch), found[:, 1:3].reshape(*batch, 2), found[:, 3:].reshape(*batch, 2)


@kernel
def meet(first: Array, second: Array, rows: Array, found: Array) -> None:
    """Write separation, point and normal `(N, 5)` of polygons with corners `(N, K, 2)` and `(N, M, 2)`.

    The rows `(4, E)`, of as many numbers as either has edges, are room to compute in.
    """
    for i in range(len(found)):
        e = _deepest(second[i], first[i], rows)
        gap, x, y = rows[3, e], rows[0, e], rows[1, e]
        e = _deepest(first[i], second[i], rows)
        one, other = first[i], second[i]
        if gap < rows[3, e]:
            gap, x, y = rows[3, e], rows[0, e], rows[1, e]
            c = _lowest(other, x, y)
            found[i, 1], found[i, 2], found[i, 3], found[i, 4] = other[c, 0], other[c, 1], -x, -y
        else:
            c = _lowest(one, x, y)
            found[i, 1], found[i, 2], found[i, 3], found[i, 4] = one[c, 0], one[c, 1], x, y
        found[i, 0] = gap


@leaf
def _deepest(faces: Array, corners: Array, rows: Array) -> int:
    """Return by which edge of one polygon the other is separated most; write the edges' normals and separations.

    Over the edges, which lie side by side in memory, the innermost loops run in steps of several numbers.
    """
    count = len(faces)
    for e in range(count):
        after = e + 1 if e + 1 < count else 0
        x, y = faces[after, 0] - faces[e, 0], faces[after, 1] - faces[e, 1]
        length = math.sqrt(x * x + y * y)
        rows[0, e], rows[1, e] = y / length, -x / length
        rows[2, e] = rows[0, e] * faces[e, 0] + rows[1, e] * faces[e, 1]
        rows[3, e] = np.inf
    for c in range(len(corners)):
        x, y = corners[c, 0], corners[c, 1]
        for e in range(count):
            height = rows[0, e] * x + rows[1, e] * y
            rows[3, e] = rows[3, e] if rows[3, e] <= height else height
    best = 0
    for e in range(count):
        rows[3, e] -= rows[2, e]
        if rows[3, e] > rows[3, best]:
            best = e
    return best


@leaf
def _lowest(corners: Array, x: float, y: float) -> int:
    """Return the corner that lies lowest along a direction, the first of several."""
    best, lowest = 0, np.inf
    for c in range(len(corners)):
        height = x * corners[c, 0] + y * corners[c, 1]
        if height < lowest:
            best, lowest = c, height
    return best
