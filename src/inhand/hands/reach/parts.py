"""What the compiled functions of the reach work on: outlines, a finger, an object's cells, and room to compute in.

Every tuple is a bundle of arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.polygons import edge_normals
from inhand.hands.reach.bundles import Bundle, knots
from inhand.hands.shapes import link_outline, palm_outline

Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]
Words = NDArray[np.uint64]

UNKNOWN, ASKED, NONE, REACHED = 0, 1, 2, 3
"""What is known of a pair of postures: nothing, that it is to be looked at, that it is no grip, that it is one and a
chain of grips leads to it."""
BITS = 64
"""Truths in a word."""
OVERLAP = 2e-5
"""Overlap of two outlines that still counts as touching [m]."""
NORMAL_ARM = 0.01
"""Arm at which the turn of a normal counts as a distance, where the nearest cell is looked for [m]."""
FIRST_LINK_STEP = np.deg2rad(2.0)
"""Step of the first link's angle [rad]."""
STRIDE = 4
"""Of the places on a third link every so many-th is tried, since its posture has room to change."""
LINK_SPACING = 0.004
"""Distance between places on a link's outline, between which the miss is nearly linear [m]."""
LINK_FAN = np.deg2rad(6.0)
"""Angle between places on a link's corner [rad]."""


class Outlines(NamedTuple):
    """N convex outlines of at most K corners, each in its own frame."""

    corners: Array
    """Corners `(N, K, 2)` [m], counter-clockwise."""
    normals: Array
    """Outward normals of the edges that start at the corners `(N, K, 2)`."""
    levels: Array
    """Heights of the edges along their normals `(N, K)` [m]."""
    many: Indices
    """Corners of each outline `(N,)`."""
    middle: Array
    """Mean of the corners `(N, 2)` [m]."""
    size: Array
    """Radius of the circle around the middle that holds the outline `(N,)` [m]."""
    core: Array
    """Radius of the circle around the middle that the outline holds `(N,)` [m]."""
    box: Array
    """Middle and half sides of the box around the outline `(N, 2, 2)` [m]."""


class Chain(NamedTuple):
    """A finger of n links."""

    base: Array
    """Its first joint in the palm frame `(2,)` [m]."""
    links: Array
    """Lengths of its links `(n,)` [m]."""
    limits: Array
    """Lowest and highest angle of each joint `(n, 2)` [rad]."""
    outlines: Outlines
    """Outlines of its links."""
    room: Array
    """How far each outline reaches from the line between the link's joint and the next `(n,)` [m]."""
    palm_top: float
    """How high the palm reaches [m]."""


class Places(NamedTuple):
    """B places on a link's outline, and the contacts they make with U cells of an object, in the object's frame."""

    points: Array
    """Places in the link's frame `(B, 2)` [m]."""
    steps: Array
    """From each to the next: x, y [m], and the turn of the normal [rad] `(B - 1, 3)`."""
    joint: Array
    """Where a contact puts the link's joint `(U, B, 2)` [m]."""
    angle: Array
    """The link's angle there `(U, B)` [rad]."""
    square: Array
    """Squared distance of the joint from the object's origin `(U, B)` [m^2]."""


class Cells(NamedTuple):
    """The middles of U cells of an object's outline, in its frame."""

    points: Array
    """Points `(U, 2)` [m]."""
    normals: Array
    """Outward normals there `(U, 2)`."""


class Postures(NamedTuple):
    """Ways in which one finger touches an object, N of them over several poses."""

    pose: Indices
    """Index of the pose `(N,)`."""
    cell: Indices
    """Cell of the outline that is touched `(N,)`."""
    joints: Array
    """Joint angles `(N, n)` [rad]."""
    fixed: Array
    """The same where the contact fixes them, NaN where they have room to change `(N, n)` [rad]."""
    points: Array
    """The contacts in the object's frame `(N, 2)` [m]."""
    normals: Array
    """The object's outward unit normals there `(N, 2)`."""

    def only(self, chosen: Flags | Indices | slice) -> Postures:
        """Return the chosen postures."""
        numbers, angles = (self.pose[chosen], self.cell[chosen]), (self.joints[chosen], self.fixed[chosen])
        return Postures(*numbers, *angles, self.points[chosen], self.normals[chosen])


Sides: TypeAlias = tuple[Postures, Postures]
"""Postures of the left finger and of the right."""


class Toucher(NamedTuple):
    """A finger and an object, prepared for looking where one touches the other."""

    finger: Chain
    """The finger."""
    others: Outlines
    """The palm, then the object's convex pieces."""
    turned: Array
    """Angles of the first link that are tried, with cosine and sine `(S, 3)` [rad]."""
    second: Places
    """Places on the second link."""
    third: Places
    """Places on the third link, where there is one."""
    cells: Cells
    """The object's outline."""


class Room(NamedTuple):
    """Room to look for postures of one finger."""

    found: Postures
    """What was found."""
    counts: Indices
    """How many were found, also where no room was left, and how many contacts were met `(2,)`."""
    met: Postures
    """At one pose W contacts; joints beyond the touching link, and what is fixed, are not set."""
    order: Indices
    """-1 where a free posture was found or none is looked for any more `(W,)`; of a third link the try that is free."""
    joints: Array
    """Joint angles of the posture that is looked at `(n,)` [rad]."""
    frames: Array
    """Place of each of its links, cosine and sine of its angle, the fingertip last `(n + 1, 4)` [m]."""
    tries: Array
    """Cost, bend, last and first joint angle of the ways to reach one cell with the third link `(T, 4)` [rad]."""


class Stances(NamedTuple):
    """What N postures at one pose come to."""

    frames: Array
    """Place of each link, cosine and sine of its angle `(N, n, 4)` [m]."""
    low: Array
    """Where each link begins, and last the finger, seen from D sides `(N, n + 1, D)` [m]."""
    high: Array
    """Where it ends `(N, n + 1, D)` [m]."""
    depth: Array
    """Height of the contact along its normal `(N,)` [m]."""


class Beside(NamedTuple):
    """For each of N postures its neighbours among M others."""

    start: Indices
    """Where each posture's neighbours begin, and where the last one's end `(N + 1,)`, or longer."""
    neighbours: Indices
    """The neighbours of one posture after the other's, in room for those of each."""
    cells: Indices
    """Where each of U cells begins in an order of the others by their cells `(U + 2,)`, or longer."""
    order: Indices
    """That order `(M,)`, or longer."""


class Grips(NamedTuple):
    """Grips at one pose: pairs of postures, K of the left finger and M of the right, each in one of them at least."""

    sides: Sides
    """The postures of both fingers."""
    held: Flags
    """Which pairs of them are grips `(K, M)`."""


class Pairs(NamedTuple):
    """Room to see which pairs of postures are grips: S of each finger at most, and as many that lead to them."""

    known: NDArray[np.uint8]
    """What is known of each pair `(S, S)`; `UNKNOWN` to `REACHED`."""
    stances: tuple[Stances, Stances]
    """What the postures come to."""
    slides: tuple[Beside, Beside]
    """The neighbours of each among those of its finger."""
    led: tuple[Beside, Beside]
    """For each posture that leads to them its neighbours among those."""
    held: Words
    """With which right postures each left one holds among the grips that lead to them `(S, S / BITS)`."""
    marked: Words
    """With which of those right postures such a grip leads to each left posture `(S, S / BITS)`."""
    leads: Words
    """Which of those right postures lead to each right posture `(S, S / BITS)`."""
    stack: Indices
    """Pairs that wait to be looked at `(S * S,)`."""


class Step(NamedTuple):
    """How grips lead to others."""

    cone: float
    """Cosine of the friction cones' half angle."""
    hop: int
    """By how many cells contacts may differ."""
    cells: int
    """Cells of the outline,"""
    others: int
    """and as many as those before number."""


class Near(NamedTuple):
    """Cells of U that a finger's outer links are looked for at."""

    chosen: Flags
    """Those that may be looked at `(U,)`."""
    near: Flags
    """Those that are near some that were touched before `(U,)`."""
    cells: Indices
    """Room for the numbers of those that are both `(U,)`."""


def outlines(polygons: Sequence[Array]) -> Outlines:
    """Return convex outlines `(K, 2)` [m] of any numbers of corners as one."""
    many = np.array([len(corners) for corners in polygons])
    shape = len(polygons), int(many.max())
    found = Outlines(
        np.zeros((*shape, 2)),
        np.zeros((*shape, 2)),
        np.zeros(shape),
        many,
        np.array([corners.mean(axis=0) for corners in polygons]),
        np.array([np.linalg.norm(corners - corners.mean(axis=0), axis=-1).max() for corners in polygons]),
        np.array(
            [(edge_normals(corners) * (corners - corners.mean(axis=0))).sum(axis=-1).min() for corners in polygons]
        ),
        np.array([[(c.max(axis=0) + c.min(axis=0)) / 2, np.ptp(c, axis=0) / 2] for c in polygons]),
    )
    for k, corners in enumerate(polygons):
        found.corners[k, : many[k]], found.normals[k, : many[k]] = corners, edge_normals(corners)
        found.levels[k, : many[k]] = (edge_normals(corners) * corners).sum(axis=-1)
    return found


def chain_of(hand: HandSpec, finger: FingerSpec) -> Chain:
    """Return a finger as compiled functions take it."""
    shapes = [link_outline(hand, finger, link) for link in range(len(finger.links))]
    room = []
    for shape, length in zip(shapes, finger.links, strict=True):
        along = np.clip(shape[:, 1], 0.0, length)
        room.append(np.hypot(shape[:, 0], shape[:, 1] - along).max())
    given = np.array(finger.base), np.array(finger.links), np.array(finger.limits)
    return Chain(*given, outlines(shapes), np.array(room), float(palm_outline(hand)[:, 1].max()))


def places_of(hand: HandSpec, finger: FingerSpec, link: int, cells: Bundle, stride: int = 1) -> Places:
    """Return every so many-th place on a link's outline with the contacts that it makes with all cells."""
    places = knots(link_outline(hand, finger, link), LINK_SPACING, LINK_FAN)
    # Contiguous, or another layout would be compiled for once more.
    points, angles = (np.ascontiguousarray(each[::stride]) for each in (places.points, places.angles))
    angle = cells.angles[:, None] + np.pi - angles
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = points.T
    joint = cells.points[:, None] - np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
    steps = np.column_stack([np.diff(points, axis=0), np.diff(angles)])
    return Places(points, steps, joint, angle, (joint**2).sum(axis=-1))


def toucher(hand: HandSpec, finger: FingerSpec, cells: Bundle, pieces: Sequence[Array]) -> Toucher:
    """Return a finger and an object of convex pieces `(M, 2)` [m], prepared."""
    low, high = finger.limits[0]
    angles = np.arange(max(low, -np.pi), min(high, np.pi) + FIRST_LINK_STEP, FIRST_LINK_STEP)
    second = places_of(hand, finger, 1, cells)
    return Toucher(
        chain_of(hand, finger),
        outlines([palm_outline(hand), *pieces]),
        np.column_stack([angles, np.cos(angles), np.sin(angles)]),
        second,
        places_of(hand, finger, 2, cells, STRIDE) if len(finger.links) > 2 else second,
        Cells(cells.points, cells.normals),
    )


def room_for(by: Toucher, chosen: int, count: int) -> Room:
    """Return room to look at a number of cells, and for a number of postures."""
    n, tried = len(by.finger.links), 2 * len(by.third.points)
    most = max(chosen * len(by.second.points), 3 * len(by.others.many) * len(by.turned))
    order, joints = np.empty(most, dtype=np.int64), np.empty(n)
    frames, tries = np.empty((n + 1, 4)), np.empty((tried, 4))
    return Room(_postures(count, n), np.zeros(2, dtype=np.int64), _postures(most, n), order, joints, frames, tries)


def cells_near(count: int) -> Near:
    """Return room for a number of cells near some; all are chosen, none is near."""
    return Near(np.ones(count, dtype=bool), np.zeros(count, dtype=bool), np.empty(count, dtype=np.int64))


def _postures(count: int, joints: int) -> Postures:
    """Return postures that are yet to be written."""
    numbers = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    angles = np.empty((count, joints)), np.empty((count, joints))
    return Postures(*numbers, *angles, np.empty((count, 2)), np.empty((count, 2)))
