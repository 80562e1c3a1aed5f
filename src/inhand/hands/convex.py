"""Convex decomposition: an outline cut into convex pieces along diagonals that start at its inward corners."""

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.outlines import STRAIGHT, segments_meet, turns, without_straight_corners

EDGE_ON = 1e-9
"""A diagonal this near to an edge's direction would cut nothing off [rad]."""
MOST_PIECES = 32
"""Convex pieces that an outline may be cut into (guessed): every step looks at each of them against every link."""


def is_convex(corners: Array) -> bool:
    """Return whether a polygon `(K, 2)`, counter-clockwise, has no inward corner."""
    return bool((turns(corners) >= -STRAIGHT).all())


def convex_parts(corners: Array) -> tuple[Array, ...]:
    """Return convex polygons, counter-clockwise, that together are a simple polygon `(K, 2)`, counter-clockwise.

    Of the diagonals from inward corners the one that straightens out most of its two ends is cut, of several the
    shortest, until no inward corner is left. Every inward corner has a diagonal, and each cut leaves fewer corners.

    Raises:
        InputError: more than `MOST_PIECES` pieces, or corners so near to each other's edges that rounding leaves no
            diagonal.
    """
    inward = int((turns(corners) < -STRAIGHT).sum())
    if inward > 2 * (MOST_PIECES - 1):  # a cut straightens two corners at most
        raise _too_many(f"at least {inward // 2 + 1}")
    left, found = [corners], []
    while left:
        piece = without_straight_corners(left.pop())
        if is_convex(piece):
            found.append(piece)
        else:
            i, j = _best_diagonal(piece)
            left += [np.concatenate([piece[j:], piece[: i + 1]]), piece[i : j + 1]]
    pieces = _merged(found)
    if len(pieces) > MOST_PIECES:
        raise _too_many(str(len(pieces)))
    return tuple(pieces)


def _too_many(count: str) -> InputError:
    return InputError(
        f"an outline falls into {count} convex pieces; it may have {MOST_PIECES}: leave out inward corners"
    )


def _merged(pieces: list[Array]) -> list[Array]:
    """Return convex pieces of which no two that share a side are convex together (Hertel and Mehlhorn 1983)."""
    for k, first in enumerate(pieces):
        for other in range(k + 1, len(pieces)):
            whole = _joined(first, pieces[other])
            if whole is not None and is_convex(whole):
                rest = [piece for number, piece in enumerate(pieces) if number not in (k, other)]
                return _merged([*rest, without_straight_corners(whole)])
    return pieces


def _joined(first: Array, second: Array) -> Array | None:
    """Return the polygon that two make along the side they share, None where they share none."""
    same = (first[:, None] == second).all(axis=-1)
    starts, ends = np.nonzero(same & np.roll(same, (-1, 1), axis=(0, 1)))
    if len(starts) == 0:
        return None
    i, j = int(starts[0]), int(ends[0])  # first goes from its corner i to i + 1, second from j - 1 to j
    return np.concatenate([np.roll(first, -i - 1, axis=0), np.roll(second, -j, axis=0)[1:-1]])


def _best_diagonal(corners: Array) -> tuple[int, int]:
    inward = turns(corners) < -STRAIGHT
    inside, straightens = _directions(corners)
    i, j = np.nonzero(np.triu(inside & inside.T & (inward[:, None] | inward), 2))
    free = _unobstructed(corners, i, j)
    if not free.any():
        raise InputError(
            f"an outline near ({1e3 * corners[0, 0]:.6g}, {1e3 * corners[0, 1]:.6g}) mm cannot be cut into convex"
            " pieces: corners and edges are too near to each other; move them apart or leave corners out"
        )
    i, j = i[free], j[free]
    solved = (straightens & inward[:, None])[i, j].astype(int) + (straightens & inward[:, None])[j, i]
    best = np.lexsort((np.linalg.norm(corners[i] - corners[j], axis=-1), -solved))[0]
    return int(i[best]), int(j[best])


def _directions(corners: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return whether the way from corner i to corner j starts inside, and leaves no inward corner at i `(K, K)`."""
    way = corners[None] - corners[:, None]
    heading = np.arctan2(way[..., 1], way[..., 0])
    rows = np.arange(len(corners))
    after = heading[rows, (rows + 1) % len(corners)]
    opening = np.mod(heading[rows, rows - 1] - after, 2 * np.pi)[:, None]
    angle = np.mod(heading - after[:, None], 2 * np.pi)
    inside = (angle > EDGE_ON) & (angle < opening - EDGE_ON)
    return inside, (angle <= np.pi) & (opening - angle <= np.pi)


def _unobstructed(corners: Array, i: NDArray[np.int64], j: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which ways from corner i to corner j `(N,)` meet no edge but those that end there."""
    count = len(corners)
    edge, after = np.arange(count), (np.arange(count) + 1) % count
    ends = (edge == i[:, None]) | (edge == j[:, None]) | (after == i[:, None]) | (after == j[:, None])
    meet = segments_meet((corners[i][:, None], corners[j][:, None]), (corners[edge], corners[after]))
    return np.asarray(~(meet & ~ends).any(axis=-1))
