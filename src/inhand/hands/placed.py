"""Outlines of a finger, the palm and an object where they are, compiled: placed, and whether two of them meet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from inhand.compiled import leaf
from inhand.geometry import Array
from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.polygons import edge_normals
from inhand.hands.shapes import link_outline, palm_outline

Indices: TypeAlias = NDArray[np.int64]


class Shapes(NamedTuple):
    """N convex outlines of at most C corners, x and y in rows of their own."""

    corners: Array
    """Their corners `(N, 2, C)` [m]."""
    outward: Array
    """Outward unit normals of the edges that start there `(N, 2, C)`."""


class Room(NamedTuple):
    """One finger of n links, the palm and the pieces of an object where they are, and room to compute in."""

    shapes: Shapes
    """The outlines in the palm frame: links, palm, pieces."""
    counts: Indices
    """Corners of each of them."""
    angles: Array
    """Joint angles `(n,)` [rad]."""
    places: Array
    """Where they put the joints `(n, 2)` [m]."""
    drift: Array
    """The step that they would like where it does not move the contact `(n,)` [rad]."""
    lowest: Array
    """The lowest corner of another outline over each edge `(C,)` [m]."""
    hit: Array
    """Where the last link is nearest to the object: separation, point and normal `(5,)` [m]."""
    frame: Array
    """The object's frame: cosine, sine and origin `(4,)`."""


class Chain(NamedTuple):
    """A finger."""

    shapes: Shapes
    """Outlines of its links in their own frames."""
    lengths: Array
    """Lengths of the links `(n,)` [m]."""
    base: Array
    """Where it begins `(2,)` [m]."""
    limits: Array
    """Limits of its joints `(n, 2)` [rad]."""


def shapes_of(outlines: Sequence[Array], width: int) -> Shapes:
    """Return outlines `(K, 2)` [m] as the kernels take them, with room for `width` corners."""
    corners, outward = np.zeros((2, len(outlines), 2, width))
    for i, outline in enumerate(outlines):
        corners[i, :, : len(outline)], outward[i, :, : len(outline)] = outline.T, edge_normals(outline).T
    return Shapes(corners, outward)


def chain_of(hand: HandSpec, finger: FingerSpec, pieces: Sequence[int] = ()) -> tuple[Chain, Room]:
    """Return a finger, and room to place it, the palm and pieces of an object of some numbers of corners in."""
    links = [link_outline(hand, finger, link) for link in range(len(finger.links))]
    palm, n = palm_outline(hand), len(links)
    counts = np.array([*map(len, links), len(palm), *pieces])
    width = int(counts.max())
    chain = Chain(shapes_of(links, width), np.array(finger.links), np.array(finger.base), np.array(finger.limits))
    shapes = shapes_of([*links, palm, *(np.zeros((0, 2)) for _ in pieces)], width)
    room = Room(shapes, counts, np.zeros(n), np.zeros((n, 2)), np.zeros(n), np.zeros(width), np.zeros(5), np.zeros(4))
    return chain, room


@leaf
def place_links(chain: Chain, room: Room, first: int) -> None:
    """Find where joint angles put the joints, and the outlines of the links from the `first` on."""
    angle, x, y = 0.0, chain.base[0], chain.base[1]
    for i in range(len(room.angles)):
        angle += room.angles[i]
        cos, sin = math.cos(angle), math.sin(angle)
        room.places[i, 0], room.places[i, 1] = x, y
        if i >= first:
            place(chain.shapes, i, (cos, sin, x, y), room, i)
        x -= chain.lengths[i] * sin
        y += chain.lengths[i] * cos


@leaf
def place(shapes: Shapes, i: int, frame: tuple[float, float, float, float], room: Room, o: int) -> None:
    """Put an outline into a frame: cosine, sine and origin."""
    cos, sin, x, y = frame
    for c in range(room.counts[o]):
        px, py = shapes.corners[i, 0, c], shapes.corners[i, 1, c]
        room.shapes.corners[o, 0, c], room.shapes.corners[o, 1, c] = cos * px - sin * py + x, sin * px + cos * py + y
        nx, ny = shapes.outward[i, 0, c], shapes.outward[i, 1, c]
        room.shapes.outward[o, 0, c], room.shapes.outward[o, 1, c] = cos * nx - sin * ny, sin * nx + cos * ny


@leaf
def apart(one: Room, i: int, other: Room, j: int) -> bool:
    """Return whether two outlines do not meet: an edge of one has all of the other beyond it."""
    return _parts(one, i, other, j) or _parts(other, j, one, i)


@leaf
def _parts(one: Room, i: int, other: Room, j: int) -> bool:
    for e in range(one.counts[i]):
        x, y = one.shapes.outward[i, 0, e], one.shapes.outward[i, 1, e]
        level = x * one.shapes.corners[i, 0, e] + y * one.shapes.corners[i, 1, e]
        beyond = True
        for c in range(other.counts[j]):
            if x * other.shapes.corners[j, 0, c] + y * other.shapes.corners[j, 1, c] <= level:
                beyond = False
                break
        if beyond:
            return True
    return False
