"""Which grips slides connect with others: the loops over pairs of postures, compiled."""

from __future__ import annotations

import math

import numpy as np

from inhand.compiled import inner, kernel
from inhand.hands.reach.apart import FAR, keep_apart, seen_from
from inhand.hands.reach.parts import (
    ASKED,
    NONE,
    REACHED,
    UNKNOWN,
    Beside,
    Chain,
    Flags,
    Indices,
    Pairs,
    Postures,
    Sources,
    Stances,
)

SIDES = np.stack([np.cos(np.deg2rad(np.arange(0.0, 180.0, 22.5))), np.sin(np.deg2rad(np.arange(0.0, 180.0, 22.5)))], -1)
"""Directions in which two links are looked at from the side, before the exact check."""
SAME_POINT = 1e-18
"""Squared distance of two contacts at one point [m^2]."""
LARGEST_TURN = 0.3
"""Joint angles of neighbouring postures differ by at most this [rad]; separate branches lie farther apart."""


@kernel
def find_beside(first: Postures, second: Postures, hop: int, by_cell: tuple[Indices, Indices], beside: Beside) -> None:
    """Write which postures of a second set are neighbours of each of a first: cells near, joints nearly alike.

    Cells may differ by `hop`. Where the first link touches, which has no room to slide, the cell does not matter: as
    the object passes by, a contact leaps along a face that comes to lie on the link, or round a corner that meets the
    link's. Two grips that differ by such a leap alone hold, and so does every grip between them.

    Args:
        first: N postures.
        second: M postures.
        hop: by how many the numbers of neighbouring cells differ at most.
        by_cell: room for where each of the U cells begins in an order of the second set `(U + 2,)`, and that `(M,)`.
        beside: room for the neighbours.
    """
    starts, order = by_cell
    cells = len(starts) - 2
    starts[:] = 0
    for j in range(len(second.cell)):
        starts[second.cell[j] + 2] += 1
    for c in range(cells):
        starts[c + 2] += starts[c + 1]
    for j in range(len(second.cell)):
        order[starts[second.cell[j] + 1]] = j
        starts[second.cell[j] + 1] += 1
    count = 0
    for i in range(len(first.cell)):
        beside.start[i] = count
        anywhere = _by_first_link(first, i)
        for d in range(min(2 * hop + 1, cells)):
            c = (first.cell[i] - hop + d) % cells
            for k in range(starts[c], starts[c + 1]):
                j = order[k]
                if not (anywhere and _by_first_link(second, j)) and _alike(first, i, second, j):
                    beside.neighbours[count] = j
                    count += 1
        for j in range(len(second.cell) if anywhere else 0):
            if _by_first_link(second, j) and _alike(first, i, second, j):
                beside.neighbours[count] = j
                count += 1
    beside.start[len(first.cell)] = count


@inner
def _by_first_link(found: Postures, i: int) -> bool:
    """Return whether the first link touches in a posture: its joint alone is fixed."""
    return not math.isnan(found.fixed[i, 0]) and math.isnan(found.fixed[i, 1])


@inner
def _alike(first: Postures, i: int, second: Postures, j: int) -> bool:
    """Return whether the joints that both contacts fix are nearly alike."""
    alike = True
    for n in range(first.fixed.shape[1]):
        alike = alike and not abs(first.fixed[i, n] - second.fixed[j, n]) > LARGEST_TURN
    return alike


@kernel
def stand(found: Postures, finger: Chain, stances: Stances) -> None:
    """Write where the links of postures are, and how the boxes around them look from the side."""
    links, n = finger.outlines, len(finger.links)
    for k in range(len(found.cell)):
        stances.depth[k] = found.points[k, 0] * found.normals[k, 0] + found.points[k, 1] * found.normals[k, 1]
        stances.low[k, n], stances.high[k, n] = FAR, -FAR
        x, y, angle = finger.base[0], finger.base[1], 0.0
        for i in range(n):
            angle += found.joints[k, i]
            cos, sin = math.cos(angle), math.sin(angle)
            frame = stances.frames[k, i]
            frame[0], frame[1], frame[2], frame[3] = x, y, cos, sin
            for d in range(len(SIDES)):
                ax, ay = cos * SIDES[d, 0] + sin * SIDES[d, 1], cos * SIDES[d, 1] - sin * SIDES[d, 0]
                middle = ax * links.box[i, 0, 0] + ay * links.box[i, 0, 1] + x * SIDES[d, 0] + y * SIDES[d, 1]
                half = abs(ax) * links.box[i, 1, 0] + abs(ay) * links.box[i, 1, 1]
                stances.low[k, i, d], stances.high[k, i, d] = middle - half, middle + half
                stances.low[k, n, d] = min(stances.low[k, n, d], middle - half)
                stances.high[k, n, d] = max(stances.high[k, n, d], middle + half)
            x, y = x - sin * finger.links[i], y + cos * finger.links[i]


@kernel
def ask(pairs: Pairs, sources: Sources, marked: Flags, stack: Indices) -> int:
    """Ask for the unknown pairs that are beside grips of a source; write them on a stack, and return how many.

    Args:
        pairs: the pairs `(L, R)`.
        sources: the grips `(K, M)`.
        marked: room `(L, M)`.
        stack: room for all pairs.
    """
    left, right, held, known, count = sources.left, sources.right, sources.held, pairs.known, 0
    # A grip is beside another if both its contacts are: first the left one is moved, then the right one.
    marked[:] = False
    for a in range(len(held)):
        for k in range(left.start[a], left.start[a + 1]):
            i = left.neighbours[k]
            for b in range(held.shape[1]):
                marked[i, b] |= held[a, b]
    for i in range(len(known)):
        for b in range(held.shape[1]):
            if marked[i, b]:
                for k in range(right.start[b], right.start[b + 1]):
                    j = right.neighbours[k]
                    if known[i, j] == UNKNOWN:
                        known[i, j], stack[count] = ASKED, i * known.shape[1] + j
                        count += 1
    return count


@kernel
def spread(pairs: Pairs, fingers: tuple[Chain, Chain], cone: float, stack: Indices, count: int) -> int:
    """Look at the pairs on a stack and at all that slides of one contact connect with grips; return how many are grips.

    Args:
        pairs: the pairs `(L, R)`.
        fingers: both fingers.
        cone: cosine of the friction cone's half angle.
        stack: pairs that are asked for, with room for all.
        count: how many there are.
    """
    left, right = pairs.slides
    known, grips, width = pairs.known, 0, pairs.known.shape[1]
    while count > 0:
        count -= 1
        i, j = stack[count] // width, stack[count] % width
        if not (_closes(pairs, i, j, cone) and _clear(pairs, fingers, i, j)):
            known[i, j] = NONE
            continue
        known[i, j] = REACHED
        grips += 1
        for k in range(left.start[i], left.start[i + 1]):
            a = left.neighbours[k]
            if known[a, j] == UNKNOWN:
                known[a, j], stack[count] = ASKED, a * width + j
                count += 1
        for k in range(right.start[j], right.start[j + 1]):
            b = right.neighbours[k]
            if known[i, b] == UNKNOWN:
                known[i, b], stack[count] = ASKED, i * width + b
                count += 1
    return grips


@inner
def _closes(pairs: Pairs, i: int, j: int, cone: float) -> bool:
    """Return whether the line between two contacts lies inside both friction cones; see `force_closure`."""
    left, right = pairs.sides
    x, y = right.points[j, 0] - left.points[i, 0], right.points[j, 1] - left.points[i, 1]
    square = x * x + y * y
    least = cone * math.sqrt(square)
    ours = left.normals[i, 0] * right.points[j, 0] + left.normals[i, 1] * right.points[j, 1]
    theirs = left.points[i, 0] * right.normals[j, 0] + left.points[i, 1] * right.normals[j, 1]
    inside = pairs.stances[0].depth[i] - ours >= least and pairs.stances[1].depth[j] - theirs >= least
    return bool(inside and square > SAME_POINT)


@inner
def _clear(pairs: Pairs, fingers: tuple[Chain, Chain], i: int, j: int) -> bool:
    """Return whether no links of two postures meet."""
    left, right = pairs.stances
    n, m = left.frames.shape[1], right.frames.shape[1]
    if _beside_each_other(pairs, (i, n), (j, m)):
        return True
    for a in range(n):
        for b in range(m):
            if _beside_each_other(pairs, (i, a), (j, b)):
                continue
            one, other = left.frames[i, a], right.frames[j, b]
            frame = seen_from((one[0], one[1], one[2], one[3]), (other[0], other[1], other[2], other[3]))
            if not keep_apart(fingers[0].outlines, a, fingers[1].outlines, b, frame):
                return False
    return True


@inner
def _beside_each_other(pairs: Pairs, ours: tuple[int, int], theirs: tuple[int, int]) -> bool:
    """Return whether two links, or whole fingers, are apart as they look from some side."""
    left, right = pairs.stances
    for d in range(len(SIDES)):
        if left.high[ours[0], ours[1], d] < right.low[theirs[0], theirs[1], d]:
            return True
        if right.high[theirs[0], theirs[1], d] < left.low[ours[0], ours[1], d]:
            return True
    return False
