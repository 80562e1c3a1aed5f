"""Where two convex outlines meet, in closed form; compiled.

Polygons by separating axes (Ericson 2005, "Real-time collision detection", 5.2 and 5.4), circles as points with a
radius. Signed distances are negative where outlines overlap.
"""

from __future__ import annotations

import math

from inhand.compiled import inner, leaf
from inhand.sim.planar.parts import Model, Shapes, Work

FAR = 1e9
"""Farther than anything [m]."""


@inner
def place_outline(model: Model, k: int, work: Work, s: int) -> None:
    """Write the corners and normals of an outline in the palm frame, once an instant."""
    if work.placed[s]:
        return
    body = model.body[s]
    c, n, x, y = work.frame[body, 0], work.frame[body, 1], work.frame[body, 2], work.frame[body, 3]
    for i in range(model.corners[k, s]):
        a, b = model.outline[k, s, i, 0], model.outline[k, s, i, 1]
        work.shapes.corners[s, i, 0], work.shapes.corners[s, i, 1] = c * a - n * b + x, n * a + c * b + y
        a, b = model.normal[k, s, i, 0], model.normal[k, s, i, 1]
        work.shapes.outward[s, i, 0], work.shapes.outward[s, i, 1] = c * a - n * b, n * a + c * b
    work.placed[s] = True


@inner
def _middle(model: Model, k: int, work: Work, s: int) -> tuple[float, float]:
    """Return the middle of the circle around an outline in the palm frame [m]."""
    body = model.body[s]
    c, n, a, b = work.frame[body, 0], work.frame[body, 1], model.middle[k, s, 0], model.middle[k, s, 1]
    return c * a - n * b + work.frame[body, 2], n * a + c * b + work.frame[body, 3]


@inner
def near(model: Model, k: int, work: Work, pair: int) -> bool:
    """Return whether the circles around a pair of outlines meet; an outline that a model lacks is never near."""
    s, o = model.pairs[pair, 0], model.pairs[pair, 1]
    if model.corners[k, s] == 0 or model.corners[k, o] == 0:
        return False
    one, other = _middle(model, k, work, s), _middle(model, k, work, o)
    dx, dy = one[0] - other[0], one[1] - other[1]
    reach = model.bound[k, s] + model.bound[k, o]
    return bool(dx * dx + dy * dy < reach * reach)


@leaf
def lowest(shapes: Shapes, s: int, edge: int, other: tuple[int, int]) -> int:
    """Return the corner of another outline that is lowest above an edge; `other` is it and its number of corners."""
    o, count = other
    nx, ny = shapes.outward[s, edge, 0], shapes.outward[s, edge, 1]
    low, corner = FAR, 0
    for j in range(count):
        height = nx * shapes.corners[o, j, 0] + ny * shapes.corners[o, j, 1]
        if height < low:
            low, corner = height, j
    return corner


@leaf
def widest(
    shapes: Shapes, counts: tuple[int, int], pair: tuple[int, int], known: tuple[int, int, float]
) -> tuple[float, int]:
    """Return the largest separation [m] that an edge of one outline sees, and that edge; -1 if none is larger.

    Args:
        shapes: with both outlines placed.
        counts: the corners of both.
        pair: both outlines; the edges are the first's.
        known: two corners of the second, by which most edges are told not to be the one; a separation that is known.
    """
    s, o = pair
    ax, ay = shapes.corners[o, known[0], 0], shapes.corners[o, known[0], 1]
    bx, by = shapes.corners[o, known[1], 0], shapes.corners[o, known[1], 1]
    best, edge = known[2], -1
    for i in range(counts[0]):
        nx, ny = shapes.outward[s, i, 0], shapes.outward[s, i, 1]
        off = nx * shapes.corners[s, i, 0] + ny * shapes.corners[s, i, 1]
        if min(nx * ax + ny * ay, nx * bx + ny * by) - off > best:
            low = FAR
            for j in range(counts[1]):
                low = min(low, nx * shapes.corners[o, j, 0] + ny * shapes.corners[o, j, 1])
            if low - off > best:
                best, edge = low - off, i
    return best, edge


@leaf
def overlap(shapes: Shapes, counts: tuple[int, int], pair: tuple[int, int]) -> tuple[float, int, int]:
    """Return the separation [m] of two polygons, which of them has the edge that sees it, and that edge.

    Positive, it says only that they do not overlap.
    """
    s, o = pair
    half = counts[0] // 2
    by_second, second_edge = widest(shapes, (counts[1], counts[0]), (o, s), (half, half, -FAR))
    if by_second > 0.0:
        return by_second, 1, second_edge
    after = second_edge + 1 if second_edge + 1 < counts[1] else 0
    by_first, first_edge = widest(shapes, counts, pair, (second_edge, after, by_second))
    if first_edge >= 0:
        return by_first, 0, first_edge
    return by_second, 1, second_edge


@inner
def meet(model: Model, k: int, work: Work, pair: int) -> tuple[int, int, int]:
    """Find where a pair of outlines overlaps, deepest: which of both has the edge (-1: they do not), edge and corner.

    `work.hit` then holds the separation, the normal from the second outline to the first, and the overlap's middle.
    """
    s, o = model.pairs[pair, 0], model.pairs[pair, 1]
    place_outline(model, k, work, s)
    place_outline(model, k, work, o)
    if model.corners[k, o] == 1:
        return meet_circle(model, k, work, pair)
    counts = model.corners[k, s], model.corners[k, o]
    gap, owner, edge = overlap(work.shapes, counts, (s, o))
    if gap > 0.0:
        return -1, 0, 0
    one, other, sign = (o, s, 1.0) if owner == 1 else (s, o, -1.0)
    corner = lowest(work.shapes, one, edge, (other, counts[1 - owner]))
    nx, ny = work.shapes.outward[one, edge, 0], work.shapes.outward[one, edge, 1]
    hit = work.hit
    hit[0], hit[1], hit[2] = gap, sign * nx, sign * ny
    hit[3], hit[4] = (
        work.shapes.corners[other, corner, 0] - 0.5 * gap * nx,
        work.shapes.corners[other, corner, 1] - 0.5 * gap * ny,
    )
    return owner, edge, corner


@leaf
def above(shapes: Shapes, count: int, s: int, x: float, y: float) -> float:
    """Return how far a point is above the edge of a polygon that sees it farthest off [m]: at most its distance."""
    most = -FAR
    for i in range(count):
        nx, ny = shapes.outward[s, i, 0], shapes.outward[s, i, 1]
        most = max(most, nx * (x - shapes.corners[s, i, 0]) + ny * (y - shapes.corners[s, i, 1]))
    return most


@leaf
def to_point(shapes: Shapes, count: int, s: int, x: float, y: float) -> tuple[float, float, float]:
    """Return the signed distance [m] of a point to a polygon, and the unit vector from the polygon to it."""
    best, edge = -FAR, 0
    for i in range(count):
        height = shapes.outward[s, i, 0] * (x - shapes.corners[s, i, 0]) + shapes.outward[s, i, 1] * (
            y - shapes.corners[s, i, 1]
        )
        if height > best:
            best, edge = height, i
    nx, ny = shapes.outward[s, edge, 0], shapes.outward[s, edge, 1]
    if best <= 0.0:
        return best, nx, ny
    # Outside, the nearest point lies on the edge that sees the point farthest off, or on one of its ends.
    after = edge + 1 if edge + 1 < count else 0
    for corner, way in ((edge, -1.0), (after, 1.0)):
        dx, dy = x - shapes.corners[s, corner, 0], y - shapes.corners[s, corner, 1]
        if way * (dy * nx - dx * ny) > 0.0:
            away = math.sqrt(dx * dx + dy * dy)
            return away, dx / away, dy / away
    return best, nx, ny


@inner
def meet_circle(model: Model, k: int, work: Work, pair: int) -> tuple[int, int, int]:
    """Find where a polygon overlaps a circle, the second of a pair; like `meet`."""
    s, o = model.pairs[pair, 0], model.pairs[pair, 1]
    x, y, radius = work.shapes.corners[o, 0, 0], work.shapes.corners[o, 0, 1], model.radius[k, o]
    away, nx, ny = to_point(work.shapes, model.corners[k, s], s, x, y)
    gap = away - radius
    if gap > 0.0:
        return -1, 0, 0
    hit = work.hit
    hit[0], hit[1], hit[2] = gap, -nx, -ny
    hit[3], hit[4] = x - (radius + 0.5 * gap) * nx, y - (radius + 0.5 * gap) * ny
    return 2, 0, 0


@inner
def clip(model: Model, k: int, work: Work, found: tuple[int, int, int, int]) -> int:
    """Find the two ends of an overlap along an edge; write their separations and points, return how many there are.

    Args:
        model: the models.
        k: the world's model.
        work: room; `work.hit` holds what `meet` found, and `work.law` becomes separation and point of each end.
        found: the outline with the edge, the other one, that edge, and the other's deepest corner.
    """
    s, o, edge, corner = found
    count, total = model.corners[k, s], model.corners[k, o]
    after = edge + 1 if edge + 1 < count else 0
    nx, ny = work.shapes.outward[s, edge, 0], work.shapes.outward[s, edge, 1]
    tx, ty = -ny, nx
    low = tx * work.shapes.corners[s, edge, 0] + ty * work.shapes.corners[s, edge, 1]
    high = tx * work.shapes.corners[s, after, 0] + ty * work.shapes.corners[s, after, 1]
    face = nx * work.shapes.corners[s, edge, 0] + ny * work.shapes.corners[s, edge, 1]
    # Of the two edges at the deepest corner the one that looks at the face more squarely lies on it.
    before = corner - 1 if corner > 0 else total - 1
    here = nx * work.shapes.outward[o, corner, 0] + ny * work.shapes.outward[o, corner, 1]
    there = nx * work.shapes.outward[o, before, 0] + ny * work.shapes.outward[o, before, 1]
    start = corner if here < there else before
    end = start + 1 if start + 1 < total else 0
    ax, ay = work.shapes.corners[o, start, 0], work.shapes.corners[o, start, 1]
    bx, by = work.shapes.corners[o, end, 0], work.shapes.corners[o, end, 1]
    at, bt = tx * ax + ty * ay, tx * bx + ty * by
    ends = 0
    for want in (low, high):
        place = min(max(want, min(at, bt)), max(at, bt))
        if place < low - 1e-12 or place > high + 1e-12 or at == bt:
            continue
        share = (place - at) / (bt - at)
        x, y = ax + share * (bx - ax), ay + share * (by - ay)
        depth = nx * x + ny * y - face
        if depth <= 0.0:
            work.law[3 * ends] = depth
            work.law[3 * ends + 1], work.law[3 * ends + 2] = x - 0.5 * depth * nx, y - 0.5 * depth * ny
            ends += 1
    return ends
