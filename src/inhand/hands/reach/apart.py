"""Whether convex outlines keep apart, by separating axes; compiled.

A frame is x, y [m], cosine and sine of an angle. As `hands/polygons.py`, for one pair at a time, in the frame of the
outline whose edges are looked at, where its normals are always the same.
"""

from __future__ import annotations

from typing import TypeAlias

from inhand.compiled import inner, leaf
from inhand.hands.reach.parts import OVERLAP, Outlines

Frame: TypeAlias = tuple[float, float, float, float]
FAR = 1e9
"""Farther than anything [m]."""


@inner
def seen_from(one: Frame, other: Frame) -> Frame:
    """Return a frame as it is seen from another."""
    x, y = other[0] - one[0], other[1] - one[1]
    cos, sin = one[2] * other[2] + one[3] * other[3], one[2] * other[3] - one[3] * other[2]
    return one[2] * x + one[3] * y, one[2] * y - one[3] * x, cos, sin


@inner
def placed(frame: Frame, x: float, y: float) -> tuple[float, float]:
    """Return a point of a frame [m] where the frame is seen."""
    return frame[2] * x - frame[3] * y + frame[0], frame[3] * x + frame[2] * y + frame[1]


@inner
def _lowest(one: Outlines, i: int, edge: int, other: tuple[Outlines, int, Frame]) -> tuple[float, int]:
    """Return the height over an edge of the lowest corner of another outline, whose frame is seen, and that corner."""
    shapes, o, frame = other
    nx, ny = one.normals[i, edge, 0], one.normals[i, edge, 1]
    ax, ay = frame[2] * nx + frame[3] * ny, frame[2] * ny - frame[3] * nx
    low, corner = FAR, 0
    for k in range(shapes.many[o]):
        height = ax * shapes.corners[o, k, 0] + ay * shapes.corners[o, k, 1]
        if height < low:
            low, corner = height, k
    return low + nx * frame[0] + ny * frame[1] - one.levels[i, edge], corner


@inner
def _faces(one: Outlines, i: int, edge: int, x: float, y: float) -> bool:
    """Return whether an edge is what is nearest to a point outside of it, and not a corner."""
    after = edge + 1 if edge + 1 < one.many[i] else 0
    ax, ay = one.corners[i, edge, 0], one.corners[i, edge, 1]
    dx, dy = one.corners[i, after, 0] - ax, one.corners[i, after, 1] - ay
    along = (x - ax) * dx + (y - ay) * dy
    return bool(0 <= along <= dx * dx + dy * dy)


@leaf
def deepest(one: Outlines, i: int, other: Outlines, o: int, frame: Frame) -> tuple[float, int, int]:
    """Return the largest separation by an outline's edges, that edge, and the other's corner there.

    Args:
        one: the outline,
        i: by its number.
        other: the other outline,
        o: by its number.
        frame: the other's frame as the first one sees it.
    """
    most, edge, corner = -FAR, 0, 0
    for e in range(one.many[i]):
        height, lower = _lowest(one, i, e, (other, o, frame))
        if height > most:
            most, edge, corner = height, e, lower
    return most, edge, corner


@inner
def keep_apart(one: Outlines, i: int, other: Outlines, o: int, frame: Frame) -> bool:
    """Return whether two outlines overlap by less than `OVERLAP`, with the arguments of `deepest`.

    The circles around and inside the other one settle most.
    """
    x, y = placed(frame, other.middle[o, 0], other.middle[o, 1])
    height, edge = -FAR, 0
    for e in range(one.many[i]):
        over = one.normals[i, e, 0] * x + one.normals[i, e, 1] * y - one.levels[i, e]
        if over > height:
            height, edge = over, e
    if height < other.core[o] - 2 * OVERLAP and (height <= 0 or _faces(one, i, edge, x, y)):
        return False
    apart = height > other.size[o]
    if height > 0:
        for e in range(one.many[i]):
            apart = apart or _lowest(one, i, e, (other, o, frame))[0] > -OVERLAP
    back = seen_from(frame, (0.0, 0.0, 1.0, 0.0))
    for e in range(other.many[o]):
        apart = apart or _lowest(other, o, e, (one, i, back))[0] > -OVERLAP
    return bool(apart)
