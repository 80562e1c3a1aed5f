"""What `hands/spatial/rolling.py` computes, compiled: one track after another, pose by pose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inhand.compiled import kernel, leaf
from inhand.geometry import Array
from inhand.hands.spatial.chains import Chain, Room, capsule_gap, into, move_point, reach_out, turned, write_bodies
from inhand.hands.spatial.surfaces import Surface, nearest, off_edges


class Rules(NamedTuple):
    """Numbers that `hands/spatial/rolling.py` explains."""

    damping: float
    corrections: int
    tolerance: float
    posture: float
    largest: float
    joints: float
    edge: float
    fixed: bool


class Rolling(NamedTuple):
    """K tracks of a finger along S poses."""

    rules: Rules
    chain: Chain
    room: Room
    surface: Surface
    palm: Array
    """Middle and half extent of the palm's box `(6,)` [m]."""
    clears: Array
    """What each capsule keeps off the object `(M,)` [m]."""
    spared: NDArray[np.bool_]
    """Which capsules end in the palm's box in the straight hand, as a thumb's base does, and may do so always."""
    poses: Array
    """Poses of the object for each track, or one for all `(K, S, 12)`."""
    rest: Array
    """Joint angles that touch the first contacts `(K, n)` [rad]."""
    points: Array
    """Contacts in the object's frame `(K, S, 3)` [m], of which the first are given."""
    normals: Array
    """Outward normals there `(K, S, 3)`, of which the first are given."""
    joints: Array
    """Joint angles `(K, S, n)` [rad]."""
    bodies: Array
    """Ends and radius of each capsule, and of the tip, in the palm frame `(K, S, M + 1, 7)` [m]."""
    lengths: NDArray[np.int64]
    """How many poses the finger has been able to follow `(K,)`."""


@kernel
def roll_tracks(rolling: Rolling) -> None:
    """Fill in tracks up to where they are lost."""
    for k in range(len(rolling.rest)):
        _begin(rolling, k)
        s = 0
        while s < rolling.poses.shape[1] and _go_on(rolling, k, s):
            s += 1
        rolling.lengths[k] = s


@leaf
def _begin(rolling: Rolling, k: int) -> None:
    for j in range(len(rolling.room.angles)):
        rolling.room.angles[j] = rolling.rest[k, j]
        rolling.room.drift[j] = 0.0
    reach_out(rolling.chain, rolling.room)


@leaf
def _go_on(rolling: Rolling, k: int, s: int) -> bool:
    """Carry the contact along with the object, let the finger follow, and return whether it still holds."""
    room, rules, chain = rolling.room, rolling.rules, rolling.chain
    poses = rolling.poses[k] if len(rolling.poses) > 1 else rolling.poses[0]
    kept = True
    if s > 0 and not rules.fixed:
        # The point of the tip that touches is to move as the object's does; a redundant finger drifts back as well.
        old = rolling.points[k, s - 1]
        x, y, z = _out_of(poses[s - 1], old[0], old[1], old[2])
        u, v, w = _out_of(poses[s], old[0], old[1], old[2])
        n = len(room.angles)
        for j in range(n):
            room.drift[j] = rules.posture * (rolling.rest[k, j] - room.angles[j]) if n > 3 else 0.0
        kept = move_point(room, (x, y, z), (u - x, v - y, w - z), (rules.damping, rules.largest))
        for j in range(n):
            room.drift[j] = 0.0
        reach_out(chain, room)
    kept = _seat(rolling, k, poses[s]) and kept
    for j in range(len(room.angles)):
        kept = kept and chain.limits[j, 0] + rules.joints <= room.angles[j] <= chain.limits[j, 1] - rules.joints
    nearest(rolling.surface, into(poses[s], room.tip[0], room.tip[1], room.tip[2]), room.hit)
    gap = room.hit[0] - chain.radius
    if not (kept and abs(gap) < rules.tolerance and off_edges(rolling.surface, room.hit, rules.edge)):
        return False
    if rules.fixed and _slipped(rolling, k) > rules.tolerance:
        return False
    _record(rolling, k, s)
    return _clear(rolling, k, s, poses[s])


@leaf
def _seat(rolling: Rolling, k: int, pose: Array) -> bool:
    """Rest the tip on the object where it is nearest, or on its own fixed contact; return whether no step is cut."""
    room, rules, chain = rolling.room, rolling.rules, rolling.chain
    kept = True
    for _ in range(rules.corrections):
        if rules.fixed:
            at, out = rolling.points[k, 0], rolling.normals[k, 0]
            r = chain.radius
            goal = _out_of(pose, at[0] + r * out[0], at[1] + r * out[1], at[2] + r * out[2])
            way = goal[0] - room.tip[0], goal[1] - room.tip[1], goal[2] - room.tip[2]
        else:
            nearest(rolling.surface, into(pose, room.tip[0], room.tip[1], room.tip[2]), room.hit)
            gap = room.hit[0] - chain.radius
            x, y, z = turned(pose, room.hit[4], room.hit[5], room.hit[6])
            way = -gap * x, -gap * y, -gap * z
        kept = move_point(room, (room.tip[0], room.tip[1], room.tip[2]), way, (rules.damping, rules.largest)) and kept
        reach_out(chain, room)
    return kept


@leaf
def _slipped(rolling: Rolling, k: int) -> float:
    """Return how far a contact is from where it is fixed [m]."""
    at, hit = rolling.points[k, 0], rolling.room.hit
    return float(((hit[1] - at[0]) ** 2 + (hit[2] - at[1]) ** 2 + (hit[3] - at[2]) ** 2) ** 0.5)


@leaf
def _record(rolling: Rolling, k: int, s: int) -> None:
    room = rolling.room
    if s > 0 or not rolling.rules.fixed:
        for i in range(3):
            rolling.points[k, s, i] = rolling.points[k, 0, i] if rolling.rules.fixed else room.hit[1 + i]
            rolling.normals[k, s, i] = rolling.normals[k, 0, i] if rolling.rules.fixed else room.hit[4 + i]
    for j in range(len(room.angles)):
        rolling.joints[k, s, j] = room.angles[j]
    write_bodies(rolling.chain, room, rolling.bodies[k, s])


@leaf
def _clear(rolling: Rolling, k: int, s: int, pose: Array) -> bool:
    """Return whether all links stay off the object, and their ends out of the palm."""
    room, palm = rolling.room, rolling.palm
    for m in range(len(rolling.chain.capsules)):
        body = rolling.bodies[k, s, m]
        inside = not rolling.spared[m]
        for i in range(3):
            room.ends[i], room.ends[3 + i] = body[i], body[3 + i]
            inside = inside and abs(body[3 + i] - palm[i]) < palm[3 + i]
        if inside or capsule_gap(rolling.surface, pose, room, body[6], rolling.clears[m]) < rolling.clears[m]:
            return False
    return True


@leaf
def _out_of(pose: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a point of a solid's frame in the palm frame."""
    x, y, z = turned(pose, x, y, z)
    return pose[0] + x, pose[1] + y, pose[2] + z
