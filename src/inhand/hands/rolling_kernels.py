"""What `hands/rolling.py` computes, compiled: one track after another, pose by pose."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inhand.compiled import kernel, leaf
from inhand.geometry import Array
from inhand.hands.placed import Chain, Room, Shapes, apart, place, place_links


class Rules(NamedTuple):
    """Numbers that `hands/rolling.py` explains."""

    damping: float
    corrections: int
    tolerance: float
    pressed: float
    posture: float
    largest: float


class Rolling(NamedTuple):
    """K tracks of a finger along S poses."""

    rules: Rules
    chain: Chain
    room: Room
    pieces: Shapes
    """Pieces of the objects in their own frames, object by object, or of one object."""
    poses: Array
    """Poses of the objects `(K, S, 3)`."""
    rest: Array
    """Joint angles that touch the first contacts `(K, n)` [rad]."""
    points: Array
    """Contacts in the objects' frames `(K, S, 2)` [m], of which the first are given."""
    normals: Array
    """Outward normals there `(K, S, 2)`."""
    joints: Array
    """Joint angles `(K, S, n)` [rad]."""
    held: NDArray[np.bool_]
    """Whether the finger has been able to follow `(K, S)`."""


@kernel
def roll_tracks(rolling: Rolling) -> None:
    """Fill in tracks; what is lost stays where it was."""
    for k in range(len(rolling.poses)):
        held = _begin(rolling, k)
        for s in range(1, rolling.poses.shape[1]):
            if held:
                held = _go_on(rolling, k, s)
            else:
                for i in range(2):
                    rolling.points[k, s, i] = rolling.points[k, s - 1, i]
                    rolling.normals[k, s, i] = rolling.normals[k, s - 1, i]
                for i in range(rolling.joints.shape[2]):
                    rolling.joints[k, s, i] = rolling.joints[k, s - 1, i]
            rolling.held[k, s] = held


@leaf
def _begin(rolling: Rolling, k: int) -> bool:
    """Seat the finger at the first pose and return whether it holds.

    It may be pressed in or stand a little off; it is seated before it is judged.
    """
    room, rules = rolling.room, rolling.rules
    _place_object(rolling, k, 0)
    for i in range(len(room.angles)):
        room.angles[i] = rolling.rest[k, i]
    x, y = rolling.points[k, 0, 0], rolling.points[k, 0, 1]
    cos, sin = room.frame[0], room.frame[1]
    contact = cos * x - sin * y + room.frame[2], sin * x + cos * y + room.frame[3]
    place_links(rolling.chain, room, len(room.angles) - 1)
    _nearest(room)
    pressed = room.hit[0] > -rules.pressed
    _seat(rolling)
    held = pressed and room.hit[0] > -rules.tolerance and _clear(room)
    _record(rolling, k, 0, contact)
    rolling.held[k, 0] = held
    return bool(held)


@leaf
def _go_on(rolling: Rolling, k: int, s: int) -> bool:
    """Carry the contact along with the object, let the finger follow, and return whether it still holds.

    The finger touches where it then is nearest.
    """
    room, rules, chain = rolling.room, rolling.rules, rolling.chain
    px, py = rolling.points[k, s - 1, 0], rolling.points[k, s - 1, 1]
    cos, sin = room.frame[0], room.frame[1]
    before = cos * px - sin * py + room.frame[2], sin * px + cos * py + room.frame[3]
    _place_object(rolling, k, s)
    cos, sin = room.frame[0], room.frame[1]
    after = cos * px - sin * py + room.frame[2], sin * px + cos * py + room.frame[3]
    # The point of the last link that touches is to move as the object's does; a third link drifts back as well.
    n = len(room.angles)
    for i in range(n):
        room.drift[i] = rules.posture * (rolling.rest[k, i] - room.angles[i]) if n > 2 else 0.0
    kept = _move(room, before, (after[0] - before[0], after[1] - before[1]), rules)
    _seat(rolling)
    for i in range(n):
        kept = kept and chain.limits[i, 0] <= room.angles[i] <= chain.limits[i, 1]
    held = kept and abs(room.hit[0]) < rules.tolerance and _clear(room)
    _record(rolling, k, s, (room.hit[1], room.hit[2]))
    return bool(held)


@leaf
def _seat(rolling: Rolling) -> None:
    """Rest the last link on the object, where it stands a little off or is pressed in; find where it touches."""
    room, rules = rolling.room, rolling.rules
    for i in range(len(room.angles)):
        room.drift[i] = 0.0
    last = len(room.angles) - 1
    for _ in range(rules.corrections):
        place_links(rolling.chain, room, last)
        _nearest(room)
        gap, x, y = room.hit[0], room.hit[3], room.hit[4]
        # Along the normal by the gap; turning moves the nearest point a little, so it is done again.
        _move(room, (room.hit[1], room.hit[2]), (-gap * x, -gap * y), rules)
    place_links(rolling.chain, room, 0)
    _nearest(room)


@leaf
def _move(room: Room, point: tuple[float, float], way: tuple[float, float], rules: Rules) -> bool:
    """Move a point of the last link along a way [m] by damped least squares; return whether no joint's step is cut.

    See `hands/kinematics.py`.
    """
    n = len(room.angles)
    a = c = rules.damping * rules.damping
    b = 0.0
    x, y = way
    for i in range(n):
        along, across = -(point[1] - room.places[i, 1]), point[0] - room.places[i, 0]
        a += along * along
        b += along * across
        c += across * across
        x -= along * room.drift[i]
        y -= across * room.drift[i]
    determinant = a * c - b * b
    first, second = (c * x - b * y) / determinant, (a * y - b * x) / determinant
    small = True
    for i in range(n):
        along, across = -(point[1] - room.places[i, 1]), point[0] - room.places[i, 0]
        step = along * first + across * second + room.drift[i]
        small = small and abs(step) < rules.largest
        room.angles[i] += min(max(step, -rules.largest), rules.largest)
    return small


@leaf
def _place_object(rolling: Rolling, k: int, s: int) -> None:
    room, n = rolling.room, len(rolling.room.angles)
    turn = rolling.poses[k, s, 2]
    frame = math.cos(turn), math.sin(turn), rolling.poses[k, s, 0], rolling.poses[k, s, 1]
    room.frame[0], room.frame[1], room.frame[2], room.frame[3] = frame
    count = len(room.counts) - n - 1
    first = k * count if len(rolling.pieces.corners) > count else 0
    for q in range(count):
        place(rolling.pieces, first + q, frame, room, n + 1 + q)


@leaf
def _record(rolling: Rolling, k: int, s: int, contact: tuple[float, float]) -> None:
    room = rolling.room
    cos, sin = room.frame[0], room.frame[1]
    x, y = contact[0] - room.frame[2], contact[1] - room.frame[3]
    rolling.points[k, s, 0], rolling.points[k, s, 1] = cos * x + sin * y, -sin * x + cos * y
    x, y = room.hit[3], room.hit[4]
    rolling.normals[k, s, 0], rolling.normals[k, s, 1] = cos * x + sin * y, -sin * x + cos * y
    for i in range(len(room.angles)):
        rolling.joints[k, s, i] = room.angles[i]


@leaf
def _clear(room: Room) -> bool:
    """Return whether inner links stay off the object, and the object and all outer links off the palm."""
    palm = len(room.angles)
    for j in range(palm + 1, len(room.counts)):
        if not apart(room, palm, room, j):
            return False
        for i in range(palm - 1):
            if not apart(room, i, room, j):
                return False
    outer = True
    for i in range(1, palm):
        outer = outer and apart(room, i, room, palm)
    return outer


@leaf
def _nearest(room: Room) -> None:
    """Find where the last link is nearest to the object, of several pieces the one from which it is least separated.

    As `contact` of `hands/polygons.py`.
    """
    last, hit = len(room.angles) - 1, room.hit
    hit[0] = np.inf
    for j in range(last + 2, len(room.counts)):
        by_piece, edge_of_piece = _deepest(room, j, last)
        by_link, edge_of_link = _deepest(room, last, j)
        if max(by_piece, by_link) < hit[0]:
            if by_piece >= by_link:
                hit[0] = by_piece
                _touch(room, j, edge_of_piece, last, 1.0)
            else:
                hit[0] = by_link
                _touch(room, last, edge_of_link, j, -1.0)


@leaf
def _deepest(room: Room, i: int, j: int) -> tuple[float, int]:
    """Return the largest separation of an outline from another by the edges of the first, and that edge."""
    count, low = room.counts[i], room.lowest
    outward, corners = room.shapes.outward, room.shapes.corners
    for e in range(count):
        low[e] = np.inf
    for c in range(room.counts[j]):
        x, y = corners[j, 0, c], corners[j, 1, c]
        for e in range(count):  # one corner over many edges: numbers that do not wait for each other
            height = outward[i, 0, e] * x + outward[i, 1, e] * y
            low[e] = height if height < low[e] else low[e]
    best, edge = -np.inf, 0
    for e in range(count):
        level = outward[i, 0, e] * corners[i, 0, e] + outward[i, 1, e] * corners[i, 1, e]
        if low[e] - level > best:
            best, edge = low[e] - level, e
    return best, edge


@leaf
def _touch(room: Room, i: int, edge: int, j: int, sign: float) -> None:
    """Write the corner of an outline that is nearest to another's edge, and the edge's normal, towards the finger."""
    x, y = room.shapes.outward[i, 0, edge], room.shapes.outward[i, 1, edge]
    lowest, corner = np.inf, 0
    for c in range(room.counts[j]):
        height = x * room.shapes.corners[j, 0, c] + y * room.shapes.corners[j, 1, c]
        if height < lowest:
            lowest, corner = height, c
    room.hit[1], room.hit[2] = room.shapes.corners[j, 0, corner], room.shapes.corners[j, 1, corner]
    room.hit[3], room.hit[4] = sign * x, sign * y
