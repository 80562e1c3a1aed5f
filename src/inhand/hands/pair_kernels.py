"""What the search asks of pairs of fingers, compiled: how long they hold, and when their links meet."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from inhand.compiled import kernel, leaf
from inhand.geometry import Array
from inhand.hands.placed import Chain, Room, apart, place_links

Indices: TypeAlias = NDArray[np.int64]


class Contacts(NamedTuple):
    """Tracks of one finger along one path."""

    points: Array
    normals: Array
    held: NDArray[np.bool_]


@kernel
def common_reach(left: Contacts, right: Contacts, least: tuple[float, float], reach: Indices) -> None:
    """Write for how many poses each pair `(L, R)` holds the object.

    The grip line's cosine with both normals is to be at least one number at the start, and another on the way.
    """
    for i in range(len(left.held)):
        for j in range(len(right.held)):
            count = 0
            for s in range(left.held.shape[1]):
                if not (left.held[i, s] and right.held[j, s]):
                    break
                x = right.points[j, s, 0] - left.points[i, s, 0]
                y = right.points[j, s, 1] - left.points[i, s, 1]
                size = max(math.sqrt(x * x + y * y), 1e-9)
                x, y = x / size, y / size
                one = -(x * left.normals[i, s, 0] + y * left.normals[i, s, 1])
                other = x * right.normals[j, s, 0] + y * right.normals[j, s, 1]
                if min(one, other) < least[min(s, 1)]:
                    break
                count += 1
            reach[i, j] = count


@kernel
def shorten(chains: tuple[Chain, Chain], rooms: tuple[Room, Room], joints: tuple[Array, Array], most: Indices) -> None:
    """Shorten numbers of poses `(N,)` to those before links of two fingers meet, at joint angles `(N, S, n)` each."""
    left, right = rooms
    for k in range(len(most)):
        for s in range(most[k]):
            for i in range(len(left.angles)):
                left.angles[i] = joints[0][k, s, i]
            for i in range(len(right.angles)):
                right.angles[i] = joints[1][k, s, i]
            place_links(chains[0], left, 0)
            place_links(chains[1], right, 0)
            if _fingers_meet(left, right):
                most[k] = s
                break


@leaf
def _fingers_meet(left: Room, right: Room) -> bool:
    for i in range(len(left.angles)):
        for j in range(len(right.angles)):
            if not apart(left, i, right, j):
                return True
    return False
