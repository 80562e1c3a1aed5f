"""Serial fingers as kernels read them: where joint angles put hinges and links, and how to move a point of the last.

Everything here is compiled; `hands/spatial/kinematics.py` is the same for arrays of worlds.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inhand.compiled import leaf
from inhand.geometry import Array
from inhand.hands.spatial.hand import SpatialFinger
from inhand.hands.spatial.surfaces import Surface, nearest
from inhand.rotations import matrix_of

HALVINGS = 12
"""Times that the line of a capsule is cut to find where it is nearest to a solid: to a hundredth of it."""
GOLDEN = (math.sqrt(5) - 1) / 2
"""Share of the line that each cut leaves."""


class Chain(NamedTuple):
    """A finger of n hinges."""

    origins: Array
    """Hinges in the frame of the link before `(n, 3)` [m]."""
    turns: Array
    """Frames in that of the link before, row by row `(n, 9)`."""
    axes: Array
    """Hinges' axes in their links' frames `(n, 3)`."""
    limits: Array
    """Lowest and highest joint angles `(n, 2)` [rad]."""
    tip: Array
    """The fingertip's centre in the last link's frame `(3,)` [m]."""
    radius: float
    """The fingertip's radius [m]."""
    capsules: Array
    """Ends and radius of each capsule in its link's frame `(M, 7)` [m]."""
    carriers: NDArray[np.int64]
    """The link of each capsule `(M,)`."""


class Room(NamedTuple):
    """Where one finger is, written anew for each world."""

    angles: Array
    """Joint angles `(n,)` [rad]."""
    places: Array
    """Hinges in the palm frame `(n, 3)` [m]."""
    axes: Array
    """Their axes `(n, 3)`."""
    frames: Array
    """Rotations of the links row by row `(n, 9)`."""
    tip: Array
    """Centre of the fingertip `(3,)` [m]."""
    drift: Array
    """Joint steps that are wanted where they do not move the point `(n,)` [rad]."""
    hit: Array
    """Distance, closest point and normal of the last search `(7,)`."""
    ends: Array
    """Ends of one capsule `(6,)` [m]."""


def chain_of(finger: SpatialFinger) -> Chain:
    """Return a finger for kernels."""
    links = finger.links
    capsules = [((*c.start, *c.end, c.radius), k) for k, link in enumerate(links) for c in link.capsules]
    return Chain(
        np.array([link.origin for link in links], dtype=float),
        np.ascontiguousarray(matrix_of(np.array([link.turn for link in links], dtype=float)).reshape(-1, 9)),
        np.array([link.axis for link in links], dtype=float),
        np.array([link.limits for link in links], dtype=float),
        np.array(finger.tip, dtype=float),
        float(finger.tip_radius),
        np.array([numbers for numbers, _ in capsules], dtype=float).reshape(-1, 7),
        np.array([link for _, link in capsules], dtype=np.int64),
    )


def room_for(n: int) -> Room:
    """Return room for one finger of n hinges."""
    sizes = (n, (n, 3), (n, 3), (n, 9), 3, n, 7, 6)
    return Room(*(np.zeros(size) for size in sizes))


@leaf
def reach_out(chain: Chain, room: Room) -> None:
    """Put hinges, axes, links and tip where the room's angles have them."""
    x = y = z = 0.0
    a, b, c, d, e, f, g, h, i = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    for k in range(len(room.angles)):
        ox, oy, oz = chain.origins[k, 0], chain.origins[k, 1], chain.origins[k, 2]
        x, y, z = x + a * ox + b * oy + c * oz, y + d * ox + e * oy + f * oz, z + g * ox + h * oy + i * oz
        t = chain.turns[k]
        a, b, c = a * t[0] + b * t[3] + c * t[6], a * t[1] + b * t[4] + c * t[7], a * t[2] + b * t[5] + c * t[8]
        d, e, f = d * t[0] + e * t[3] + f * t[6], d * t[1] + e * t[4] + f * t[7], d * t[2] + e * t[5] + f * t[8]
        g, h, i = g * t[0] + h * t[3] + i * t[6], g * t[1] + h * t[4] + i * t[7], g * t[2] + h * t[5] + i * t[8]
        u, v, w = chain.axes[k, 0], chain.axes[k, 1], chain.axes[k, 2]
        room.axes[k, 0], room.axes[k, 1], room.axes[k, 2] = (
            a * u + b * v + c * w,
            d * u + e * v + f * w,
            g * u + h * v + i * w,
        )
        # Rodrigues: cos + sin (axis x) + (1 - cos) axis axis'
        cos, sin = math.cos(room.angles[k]), math.sin(room.angles[k])
        r = 1 - cos
        p0, p1, p2 = cos + r * u * u, r * u * v - sin * w, r * u * w + sin * v
        p3, p4, p5 = r * u * v + sin * w, cos + r * v * v, r * v * w - sin * u
        p6, p7, p8 = r * u * w - sin * v, r * v * w + sin * u, cos + r * w * w
        a, b, c = a * p0 + b * p3 + c * p6, a * p1 + b * p4 + c * p7, a * p2 + b * p5 + c * p8
        d, e, f = d * p0 + e * p3 + f * p6, d * p1 + e * p4 + f * p7, d * p2 + e * p5 + f * p8
        g, h, i = g * p0 + h * p3 + i * p6, g * p1 + h * p4 + i * p7, g * p2 + h * p5 + i * p8
        room.places[k, 0], room.places[k, 1], room.places[k, 2] = x, y, z
        frame = room.frames[k]
        frame[0], frame[1], frame[2] = a, b, c
        frame[3], frame[4], frame[5] = d, e, f
        frame[6], frame[7], frame[8] = g, h, i
    ox, oy, oz = chain.tip[0], chain.tip[1], chain.tip[2]
    room.tip[0] = x + a * ox + b * oy + c * oz
    room.tip[1] = y + d * ox + e * oy + f * oz
    room.tip[2] = z + g * ox + h * oy + i * oz


@leaf
def stretch(chain: Chain, room: Room, m: int) -> None:
    """Write the ends of a capsule into `room.ends`."""
    k = chain.carriers[m]
    for end in range(2):
        x, y, z = chain.capsules[m, 3 * end], chain.capsules[m, 3 * end + 1], chain.capsules[m, 3 * end + 2]
        for i in range(3):
            frame = room.frames[k]
            turned = frame[3 * i] * x + frame[3 * i + 1] * y + frame[3 * i + 2] * z
            room.ends[3 * end + i] = room.places[k, i] + turned


@leaf
def write_bodies(chain: Chain, room: Room, bodies: Array) -> None:
    """Write ends and radius of each capsule, and of the tip, in the palm frame `(M + 1, 7)`."""
    count = len(chain.capsules)
    for m in range(count):
        stretch(chain, room, m)
        for i in range(6):
            bodies[m, i] = room.ends[i]
        bodies[m, 6] = chain.capsules[m, 6]
    for i in range(3):
        bodies[count, i] = bodies[count, 3 + i] = room.tip[i]
    bodies[count, 6] = chain.radius


@leaf
def move_point(
    room: Room, point: tuple[float, float, float], way: tuple[float, float, float], rules: tuple[float, float]
) -> bool:
    """Move a point of the last link along a way [m] by damped least squares; return whether no joint's step is cut.

    Minimises |J dq - dx|^2 + damping^2 |dq|^2 where it does not drift; rules are the damping [m/rad] and the largest
    step of a joint [rad]. The 3 x 3 system J J' + damping^2 is solved by cross products.
    """
    damping, largest = rules
    a = b = c = damping * damping
    d = e = f = 0.0
    x, y, z = way
    n = len(room.angles)
    for k in range(n):
        u, v, w = _lever(room, k, point)
        a, b, c = a + u * u, b + v * v, c + w * w
        d, e, f = d + u * v, e + u * w, f + v * w
        x, y, z = x - u * room.drift[k], y - v * room.drift[k], z - w * room.drift[k]
    p, q, r = b * c - f * f, e * f - d * c, d * f - e * b
    determinant = a * p + d * q + e * r
    s, t, o = a * c - e * e, d * e - a * f, a * b - d * d
    first, second, third = (
        (p * x + q * y + r * z) / determinant,
        (q * x + s * y + t * z) / determinant,
        (r * x + t * y + o * z) / determinant,
    )
    small = True
    for k in range(n):
        u, v, w = _lever(room, k, point)
        step = u * first + v * second + w * third + room.drift[k]
        small = small and abs(step) < largest
        room.angles[k] += min(max(step, -largest), largest)
    return small


@leaf
def _lever(room: Room, k: int, point: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return how a point of the last link moves with a joint: axis x (point - hinge) [m/rad]."""
    x, y, z = point[0] - room.places[k, 0], point[1] - room.places[k, 1], point[2] - room.places[k, 2]
    u, v, w = room.axes[k, 0], room.axes[k, 1], room.axes[k, 2]
    return v * z - w * y, w * x - u * z, u * y - v * x


@leaf
def into(pose: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a point of the palm frame in a solid's, whose pose is its place and rotation row by row `(12,)`."""
    x, y, z = x - pose[0], y - pose[1], z - pose[2]
    return (
        pose[3] * x + pose[6] * y + pose[9] * z,
        pose[4] * x + pose[7] * y + pose[10] * z,
        pose[5] * x + pose[8] * y + pose[11] * z,
    )


@leaf
def turned(pose: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a direction of a solid's frame in the palm frame."""
    return (
        pose[3] * x + pose[4] * y + pose[5] * z,
        pose[6] * x + pose[7] * y + pose[8] * z,
        pose[9] * x + pose[10] * y + pose[11] * z,
    )


@leaf
def capsule_gap(surface: Surface, pose: Array, room: Room, radius: float, enough: float) -> float:
    """Return the distance of the capsule of `room.ends` to a solid [m]; `enough` or more where it is surely more.

    Distance to a convex solid is convex along a line, so its least value is found by golden section.
    """
    ends, hit = room.ends, room.hit
    length = math.sqrt((ends[3] - ends[0]) ** 2 + (ends[4] - ends[1]) ** 2 + (ends[5] - ends[2]) ** 2)
    middle = _along(surface, pose, room, 0.5)
    if middle - length / 2 - radius > enough:
        return middle - length / 2 - radius
    low, high = 0.0, 1.0
    one, two = 1 - GOLDEN, GOLDEN
    at_one, at_two = _along(surface, pose, room, one), _along(surface, pose, room, two)
    for _ in range(HALVINGS):
        if at_one < at_two:
            high, two, at_two = two, one, at_one
            one = high - GOLDEN * (high - low)
            at_one = _along(surface, pose, room, one)
        else:
            low, one, at_one = one, two, at_two
            two = low + GOLDEN * (high - low)
            at_two = _along(surface, pose, room, two)
    best = min(at_one, at_two, _along(surface, pose, room, low), _along(surface, pose, room, high))
    hit[0] = best
    return best - radius


@leaf
def _along(surface: Surface, pose: Array, room: Room, share: float) -> float:
    ends = room.ends
    x, y, z = (
        ends[0] + share * (ends[3] - ends[0]),
        ends[1] + share * (ends[4] - ends[1]),
        ends[2] + share * (ends[5] - ends[2]),
    )
    nearest(surface, into(pose, x, y, z), room.hit)
    return float(room.hit[0])
