"""Which grips slides connect with others: the loops over pairs of postures, compiled."""

from __future__ import annotations

import math

import numpy as np

from inhand.compiled import inner, kernel, leaf
from inhand.hands.reach.apart import FAR, keep_apart, seen_from
from inhand.hands.reach.parts import (
    ASKED,
    BITS,
    NONE,
    REACHED,
    UNKNOWN,
    Beside,
    Chain,
    Grips,
    Pairs,
    Postures,
    Sides,
    Stances,
    Step,
)

SIDES = np.stack([np.cos(np.deg2rad(np.arange(0.0, 180.0, 22.5))), np.sin(np.deg2rad(np.arange(0.0, 180.0, 22.5)))], -1)
"""Directions in which two links are looked at from the side, before the exact check."""
SAME_POINT = 1e-18
"""Squared distance of two contacts at one point [m^2]."""
LARGEST_TURN = 0.3
"""Joint angles of neighbouring postures differ by at most this [rad]; separate branches lie farther apart."""


@kernel
def flood(pairs: Pairs, sides: Sides, seen: Sides, fingers: tuple[Chain, Chain], led: tuple[Grips, Step]) -> int:
    """Find the grips that others lead to, and all that slides connect with them; return how many there are.

    Args:
        pairs: room for the pairs; what is known of them is written here.
        sides: the postures of both fingers at a pose.
        seen: the same with the cells as grips before number them.
        fingers: both fingers.
        led: grips at a pose beside it, and how they lead to others; by less than no cells, and all pairs are asked for.
    """
    (before, (cone, hop, cells, others)), (left, right) = led, sides
    _stand(left, fingers[0], pairs.stances[0])
    _stand(right, fingers[1], pairs.stances[1])
    _find_beside(left, left, (1, cells), pairs.slides[0])
    _find_beside(right, right, (1, cells), pairs.slides[1])
    width, count = pairs.known.shape[1], 0
    for i in range(len(left.cell)):
        for j in range(len(right.cell)):
            pairs.known[i, j] = UNKNOWN
            if hop < 0:
                pairs.known[i, j], pairs.stack[count] = ASKED, i * width + j
                count += 1
    if hop >= 0:
        _find_beside(before.sides[0], seen[0], (hop, others), pairs.led[0])
        _find_beside(before.sides[1], seen[1], (hop, others), pairs.led[1])
        count = _ask(pairs, sides, before)
    return _spread(pairs, sides, fingers, cone, count)


@kernel
def find_beside(first: Postures, second: Postures, how: tuple[int, int], beside: Beside) -> None:
    """Write which postures of a second set are neighbours of each of a first; see `_find_beside`."""
    _find_beside(first, second, how, beside)


@leaf
def _find_beside(first: Postures, second: Postures, how: tuple[int, int], beside: Beside) -> None:
    """Write which postures of a second set are neighbours of each of a first: cells near, joints nearly alike.

    Cells may differ by `hop`. Where the first link touches, which has no room to slide, the cell does not matter: as
    the object passes by, a contact leaps along a face that comes to lie on the link, or round a corner that meets the
    link's. Two grips that differ by such a leap alone hold, and so does every grip between them.

    Args:
        first: N postures.
        second: M postures.
        how: by how many the numbers of neighbouring cells differ at most, and how many cells there are.
        beside: room for the neighbours.
    """
    (hop, cells), starts, order = how, beside.cells, beside.order
    starts[: cells + 2] = 0
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


@leaf
def _stand(found: Postures, finger: Chain, stances: Stances) -> None:
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


@leaf
def _ask(pairs: Pairs, sides: Sides, before: Grips) -> int:
    """Ask for the unknown pairs that are beside grips; write them on the stack, and return how many."""
    (left, right), known, count = pairs.led, pairs.known, 0
    held, marked, leads = pairs.held, pairs.marked, pairs.leads
    rows, columns, words = len(sides[0].cell), len(sides[1].cell), (before.held.shape[1] + BITS - 1) // BITS
    # A grip is beside another if both its contacts are: first the left one is moved, then the right one. What is true
    # of each right posture of those before is a bit.
    held[: len(before.held), :words], marked[:rows, :words], leads[:columns, :words] = 0, 0, 0
    for b in range(before.held.shape[1]):
        word, bit = b // BITS, np.uint64(1) << np.uint64(b % BITS)
        for a in range(len(before.held)):
            if before.held[a, b]:
                held[a, word] |= bit
        for k in range(right.start[b], right.start[b + 1]):
            leads[right.neighbours[k], word] |= bit
    for a in range(len(before.held)):
        for k in range(left.start[a], left.start[a + 1]):
            for word in range(words):
                marked[left.neighbours[k], word] |= held[a, word]
    for i in range(rows):
        for j in range(columns):
            asked = np.uint64(0)
            for word in range(words):
                asked |= marked[i, word] & leads[j, word]
            if asked != 0:
                known[i, j], pairs.stack[count] = ASKED, i * known.shape[1] + j
                count += 1
    return count


@leaf
def _spread(pairs: Pairs, sides: Sides, fingers: tuple[Chain, Chain], cone: float, count: int) -> int:
    """Look at the pairs on the stack and at all that slides of one contact connect with grips; return how many are.

    Args:
        pairs: what is known of the pairs.
        sides: their postures.
        fingers: both fingers.
        cone: cosine of the friction cone's half angle.
        count: how many there are on the stack.
    """
    (left, right), stack = pairs.slides, pairs.stack
    known, grips, width = pairs.known, 0, pairs.known.shape[1]
    while count > 0:
        count -= 1
        i, j = stack[count] // width, stack[count] % width
        if not (_closes(pairs, sides, (i, j), cone) and _clear(pairs, fingers, i, j)):
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
def _closes(pairs: Pairs, sides: Sides, pair: tuple[int, int], cone: float) -> bool:
    """Return whether the line between two contacts lies inside both friction cones; see `force_closure`."""
    (left, right), (i, j) = sides, pair
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
