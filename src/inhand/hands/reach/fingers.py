"""Where one finger can touch an object, for many poses at once.

The contact of a finger's link with the object is a pair of places on the two normal bundles. The pair fixes the link's
angle and the place of its joint relative to the object,

    phi = angle(-n) - angle(m),   d = c - R(phi) s,

with point c and normal n of the object and point s and normal m of the link; both outlines being convex, they do not
overlap there. What is left is whether the links before can bring the joint to d: a link of two joints asks
|d - base| = first link, one of three has room to spare, and the first link turns on its base alone. The loops over
poses, cells and places are compiled (`touching`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inhand.geometry import Array
from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.reach.bundles import Bundle
from inhand.hands.reach.parts import NORMAL_ARM, Indices, Postures, Toucher, cells_near, room_for, toucher

EXPECTED = 4
"""Postures of a finger for each cell and pose for which room is made at first."""


@dataclass(frozen=True)
class Body:
    """The object: its outline's cells and its convex pieces, in its own frame."""

    cells: Bundle
    """Cells of the outline, U of them."""
    pieces: tuple[Array, ...]
    """Convex pieces `(M, 2)` [m]."""

    def nearest(self, points: Array, normals: Array) -> Indices:
        """Return the cells `(N,)` nearest to points `(N, 2)` [m] with outward unit normals `(N, 2)`."""
        away = np.linalg.norm(points[:, None] - self.cells.points, axis=-1)
        turned = np.linalg.norm(normals[:, None] - self.cells.normals, axis=-1)
        return np.asarray((away + NORMAL_ARM * turned).argmin(axis=-1))


def touching_postures(hand: HandSpec, finger: FingerSpec, body: Body, poses: Array) -> Postures:
    """Return how a finger can touch the object at poses `(P, 3)` in the palm frame, sorted by pose.

    Any link may touch. Joint limits are kept, and no link overlaps object or palm.
    """
    return touched(toucher(hand, finger, body.cells, body.pieces), len(body.cells), poses)


def touched(by: Toucher, cells: int, poses: Array) -> Postures:
    """Return `touching_postures` of a finger and an object whose outline has so many cells."""
    from inhand.hands.reach.touching import touch_near

    poses = np.array(poses, order="C")  # of one kind, which is compiled once: may be written, lies row by row
    near, size, none = cells_near(cells), EXPECTED * cells * len(poses), np.empty(0, dtype=np.int64)
    near.near[:] = True
    while True:
        room = room_for(by, cells, size)
        touch_near((by, by), ((none, none), 0, 1), (near, near), poses, (room, room))
        count = int(room.counts[0])
        if count <= size:
            return room.found.only(slice(count))
        size = count
