"""Where a finger can touch an object at given poses: the loops of `fingers`, compiled."""

from __future__ import annotations

import math

import numpy as np

from inhand.compiled import inner, kernel, leaf
from inhand.geometry import Array
from inhand.hands.reach.apart import FAR, Frame, deepest, keep_apart, placed, seen_from
from inhand.hands.reach.parts import FIRST_LINK_STEP, NORMAL_ARM, Indices, Near, Room, Toucher

FREE_BENDS = np.deg2rad(np.array([0.0, 30.0, -30.0, 60.0, -60.0, 100.0, -100.0, 140.0, -140.0]))
"""Bends tried for a link beyond the one that touches [rad]."""
ROOT_STEPS = 2
"""Steps of false position between two places: 0.2 mm off after one, a few micrometres after two."""
ROUNDS = 16
"""Postures of a three-link finger that are tried for one contact."""


@kernel
def touch_near(
    touchers: tuple[Toucher, Toucher],
    used: tuple[tuple[Indices, Indices], int, int],
    where: tuple[Near, Near],
    poses: Array,
    rooms: tuple[Room, Room],
) -> None:
    """Write how fingers can touch an object at poses `(P, 3)`, their outer links at cells near some that are used.

    The first finger alone is one call of this, too: what is compiled is most of a reach's first seconds.

    Args:
        touchers: both fingers.
        used: cells that each of them touched before, how many cells are near on either side of these, and how many
            fingers are looked at.
        where: cells that may be looked at, and those that are near others; these are added to.
        poses: the object's poses.
        rooms: room for the postures of each finger.
    """
    for k in range(used[2]):
        count = _look_near(used[0][k], used[1], where[k])
        _touch(touchers[k], where[k].cells[:count], poses, rooms[k])


@inner
def _look_near(used: Indices, around: int, where: Near) -> int:
    """Write the cells that are to be looked at, and return how many there are."""
    cells, count = len(where.near), 0
    for k in range(len(used)):
        for d in range(-around, around + 1):
            where.near[(used[k] + d) % cells] = True
    for c in range(cells):
        if where.near[c] and where.chosen[c]:
            where.cells[count] = c
            count += 1
    return count


@leaf
def _touch(by: Toucher, chosen: Indices, poses: Array, room: Room) -> None:
    """Write how a finger can touch an object at poses `(P, 3)`; its outer links are looked for at chosen cells."""
    room.counts[0] = 0
    for p in range(len(poses)):
        theta = poses[p, 2]
        at = (poses[p, 0], poses[p, 1], math.cos(theta), math.sin(theta))
        for link in range(len(by.finger.links)):
            room.counts[1] = 0
            if link == 0:
                _by_first_link(by, at, room)
            elif link == 1:
                _by_second_link(by, chosen, at, theta, room)
            else:
                _by_third_link(by, chosen, at, theta, room)
            if link < 2:
                _settle(by, p, at, link, room)
            else:
                for tried in range(ROUNDS):
                    for k in range(room.counts[1]):
                        if room.order[k] == tried:
                            _write(room, p, k, link)


@inner
def _settle(by: Toucher, p: int, at: Frame, link: int, room: Room) -> None:
    """Write for each contact that a link makes at a pose a posture with the first bend of the rest that is free."""
    n = len(by.finger.links)
    # Before any bend the links up to the touching one are looked at by themselves.
    for b in range(-1, len(FREE_BENDS) if n > link + 1 else 1):
        for k in range(room.counts[1]):
            if room.order[k] < 0:
                continue
            for j in range(n):
                room.joints[j] = room.met.joints[k, j] if j <= link else 0.0
            if b >= 0 and n > link + 1:
                room.joints[link + 1] = FREE_BENDS[b]
            free = _is_free(by, at, link, 0 if b < 0 else link + 1, room)
            if free != (b < 0):
                room.order[k] = -1
            if free and b >= 0:
                for j in range(n):
                    room.met.joints[k, j] = room.joints[j]
                _write(room, p, k, link)


@inner
def _write(room: Room, p: int, k: int, link: int) -> None:
    """Write a posture at a pose in which a link touches, if there is room; a third link fixes no joint."""
    found, met, count = room.found, room.met, room.counts[0]
    room.counts[0] += 1
    if count >= len(found.pose):
        return
    found.pose[count], found.cell[count] = p, met.cell[k]
    for j in range(found.joints.shape[1]):
        found.joints[count, j] = met.joints[k, j]
        found.fixed[count, j] = met.joints[k, j] if j <= link < 2 else math.nan
    for axis in range(2):
        found.points[count, axis], found.normals[count, axis] = met.points[k, axis], met.normals[k, axis]


@leaf
def _is_free(by: Toucher, at: Frame, touching: int, first: int, room: Room) -> bool:
    """Return whether links keep their joints' limits and overlap neither object nor palm.

    Args:
        by: the finger and the object.
        at: the object's frame.
        touching: the link that touches.
        first: the first link that is looked at: 0 with all up to the touching one, or the next with all beyond.
        room: with the joint angles.
    """
    finger, others, frames = by.finger, by.others, room.frames
    last = touching + 1 if first <= touching else len(finger.links)
    x, y, angle = finger.base[0], finger.base[1], 0.0
    for i in range(last):
        if not finger.limits[i, 0] <= room.joints[i] <= finger.limits[i, 1]:
            return False
        angle += room.joints[i]
        frames[i, 0], frames[i, 1], frames[i, 2], frames[i, 3] = x, y, math.cos(angle), math.sin(angle)
        x, y = x - frames[i, 3] * finger.links[i], y + frames[i, 2] * finger.links[i]
    frames[last, 1] = y
    for i in range(first, last):
        # A link that is higher than the palm all along is not compared with it; the first one stands on it.
        low = i > 0 and min(frames[i, 1], frames[i + 1, 1]) - finger.room[i] < finger.palm_top
        # A convex object cannot overlap the link that touches it.
        count = 1 if i == touching and len(others.many) == 2 and i > 0 else len(others.many)
        here = (frames[i, 0], frames[i, 1], frames[i, 2], frames[i, 3])
        for o in range(0 if low else 1, count):
            frame = seen_from(here, at if o > 0 else (0.0, 0.0, 1.0, 0.0))
            if not keep_apart(finger.outlines, i, others, o, frame):
                return False
    return True


@inner
def _by_first_link(by: Toucher, at: Frame, room: Room) -> None:
    """Turn the first link about its base and find where it meets and leaves the object."""
    links, others, base = by.finger.outlines, by.others, by.finger.base
    arm = math.hypot(links.middle[0, 0], links.middle[0, 1])
    for o in range(1, len(others.many)):
        # Both are taken for discs first; a step of the angle is added on either side.
        x, y = placed(at, others.middle[o, 0], others.middle[o, 1])
        far = others.size[o] + links.size[0] + FIRST_LINK_STEP * arm
        before = FAR
        for s in range(len(by.turned)):
            frame = (base[0], base[1], by.turned[s, 1], by.turned[s, 2])
            middle = placed(frame, links.middle[0, 0], links.middle[0, 1])
            gap = FAR
            if (x - middle[0]) ** 2 + (y - middle[1]) ** 2 < far * far:
                gap = deepest(links, 0, others, o, seen_from(frame, at))[0]
                gap = max(gap, deepest(others, o, links, 0, seen_from(at, frame))[0])
            # Steps that were not near are no crossing; between two steps the gap is taken for linear.
            if before < FAR and gap < FAR and (before > 0) != (gap > 0):
                turn = by.turned[s - 1, 0] + before / (before - gap) * FIRST_LINK_STEP
                _first_link_cells(by, (o, at), turn, room)
            before = gap


@leaf
def _first_link_cells(by: Toucher, piece: tuple[int, Frame], turn: float, room: Room) -> None:
    """Write where the first link touches a piece, once for the nearest cell and once for each beside it.

    The contact is where it is; the cells only say which contacts are neighbours.
    """
    o, at = piece
    links, others, cells = by.finger.outlines, by.others, by.cells
    frame = (by.finger.base[0], by.finger.base[1], math.cos(turn), math.sin(turn))
    back = seen_from(at, frame)
    by_piece, edge, corner = deepest(others, o, links, 0, back)
    by_link, own_edge, other = deepest(links, 0, others, o, seen_from(frame, at))
    x, y = placed(back, links.corners[0, corner, 0], links.corners[0, corner, 1])
    nx, ny = others.normals[o, edge, 0], others.normals[o, edge, 1]
    if by_piece < by_link:
        x, y = others.corners[o, other, 0], others.corners[o, other, 1]
        ax, ay = links.normals[0, own_edge, 0], links.normals[0, own_edge, 1]
        nx, ny = back[3] * ay - back[2] * ax, -back[3] * ax - back[2] * ay
    cell, least, count = 0, FAR, len(cells.points)
    for c in range(count):
        away = math.sqrt((x - cells.points[c, 0]) ** 2 + (y - cells.points[c, 1]) ** 2)
        away += NORMAL_ARM * math.sqrt((nx - cells.normals[c, 0]) ** 2 + (ny - cells.normals[c, 1]) ** 2)
        if away < least:
            cell, least = c, away
    # A contact between two cells is a neighbour of both.
    for beside in range(-1, 2):
        met = room.counts[1]
        room.met.cell[met], room.order[met], room.met.joints[met, 0] = (cell + beside) % count, 0, turn
        room.met.points[met, 0], room.met.points[met, 1] = x, y
        room.met.normals[met, 0], room.met.normals[met, 1] = nx, ny
        room.counts[1] += 1


@inner
def _at_cell(by: Toucher, c: int, room: Room) -> None:
    """Write that the contact with the joints that are looked at is the middle of a cell."""
    met = room.counts[1]
    room.counts[1] += 1
    for j in range(len(room.joints)):
        room.met.joints[met, j] = room.joints[j]
    room.met.cell[met], room.order[met] = c, 0
    for axis in range(2):
        room.met.points[met, axis], room.met.normals[met, axis] = by.cells.points[c, axis], by.cells.normals[c, axis]


@inner
def _wrapped(angle: float) -> float:
    """Return an angle in [-pi, pi)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


@inner
def _by_second_link(by: Toucher, chosen: Indices, at: Frame, theta: float, room: Room) -> None:
    """Find |joint - base| = first link between neighbouring places of the second link."""
    places, joints = by.second, room.joints
    bx, by_, _, _ = seen_from(at, (by.finger.base[0], by.finger.base[1], 1.0, 0.0))
    rest = bx * bx + by_ * by_ - by.finger.links[0] ** 2
    for c in chosen:
        before = 0.0
        for k in range(places.square.shape[1]):
            after = places.square[c, k] - 2 * places.joint[c, k, 0] * bx - 2 * places.joint[c, k, 1] * by_ + rest
            # Where the sign changes between two places of the link, one between them is a contact.
            if k > 0 and (before > 0) != (after > 0):
                x, y, turn = _root(by, (c, k - 1), (bx, by_), (before, after))
                # The first link points from the base to the joint; the second's angle was found in the object's frame.
                first = math.atan2(-x, y) + theta
                joints[0], joints[1] = _wrapped(first), _wrapped(turn + theta - first)
                _at_cell(by, c, room)
            before = after


@inner
def _root(
    by: Toucher, place: tuple[int, int], base: tuple[float, float], misses: tuple[float, float]
) -> tuple[float, float, float]:
    """Return, from the base, the joint at |joint - base| = first link, and the link's angle, by false position."""
    (c, k), places, cells = place, by.second, by.cells
    start, end, low, high = 0.0, 1.0, misses[0], misses[1]
    x, y, turn = 0.0, 0.0, 0.0
    for _ in range(ROOT_STEPS):
        share = start if low == high else min(max(start + (end - start) * low / (low - high), 0.0), 1.0)
        turn = places.angle[c, k] - share * places.steps[k, 2]
        px, py = places.points[k, 0] + share * places.steps[k, 0], places.points[k, 1] + share * places.steps[k, 1]
        cos, sin = math.cos(turn), math.sin(turn)
        x = cells.points[c, 0] - (cos * px - sin * py) - base[0]
        y = cells.points[c, 1] - (sin * px + cos * py) - base[1]
        miss = x * x + y * y - by.finger.links[0] ** 2
        # The end of the bracket on the same side as the new place moves to it.
        if (miss > 0) == (low > 0):
            start, low = share, miss
        else:
            end, high = share, miss
    return x, y, turn


@inner
def _by_third_link(by: Toucher, chosen: Indices, at: Frame, theta: float, room: Room) -> None:
    """Reach each cell with the third link, in the least bent posture that is free."""
    bx, by_, _, _ = seen_from(at, (by.finger.base[0], by.finger.base[1], 1.0, 0.0))
    tries, joints = room.tries, room.joints
    for c in chosen:
        count = _ways(by, c, (bx, by_), tries)
        for tried in range(min(ROUNDS, count)):
            # The least bent posture is tried first, the next one where that is not free.
            best = 0
            for t in range(1, count):
                if tries[t, 0] < tries[best, 0]:
                    best = t
            tries[best, 0] = FAR
            joints[0], joints[1], joints[2] = _wrapped(tries[best, 3] + theta), tries[best, 1], tries[best, 2]
            if _is_free(by, at, 2, 0, room):
                _at_cell(by, c, room)
                room.order[room.counts[1] - 1] = tried
                break


@inner
def _ways(by: Toucher, c: int, base: tuple[float, float], tries: Array) -> int:
    """Write the ways to reach a cell with each place of the third link; return how many there are.

    Two links that end at the third's joint: the law of cosines bends them one way or the other.
    """
    first, second, places = by.finger.links[0], by.finger.links[1], by.third
    count = 0
    for k in range(len(places.points)):
        x, y = places.joint[c, k, 0] - base[0], places.joint[c, k, 1] - base[1]
        cosine = (x * x + y * y - first**2 - second**2) / (2 * first * second)
        if not -1 <= cosine <= 1:
            continue
        bend, heading = math.acos(cosine), math.atan2(-x, y)
        offset = math.atan2(second * math.sin(bend), first + second * math.cos(bend))
        for sign in (1.0, -1.0):
            start = heading - sign * offset
            last = _wrapped(places.angle[c, k] - start - sign * bend)
            tries[count, 0], tries[count, 1] = bend * bend + last * last, sign * bend
            tries[count, 2], tries[count, 3] = last, start
            count += 1
    return count
