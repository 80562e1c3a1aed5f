"""What fingers of many worlds measure of a solid: hinges, axes, tips, contacts and gaps, compiled, finger by finger."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inhand.compiled import kernel, leaf
from inhand.geometry import Array
from inhand.hands.spatial.chains import (
    Chain,
    Room,
    capsule_gap,
    into,
    move_point,
    reach_out,
    stretch,
    turned,
    write_bodies,
)
from inhand.hands.spatial.surfaces import Surface, nearest

Indices = NDArray[np.int64]
FAR = 1.0
"""Distance of a link without capsules [m]; larger than any hand."""


class Measured(NamedTuple):
    """B worlds of a hand with F fingers and n joints, in the palm frame."""

    places: Array
    """Hinges `(B, n, 3)` [m]."""
    axes: Array
    """Their axes `(B, n, 3)`."""
    tips: Array
    """Centres of the fingertips `(B, F, 3)` [m]."""
    points: Array
    """Points of the object nearest to the fingertips `(B, F, 3)` [m]."""
    normals: Array
    """Outward normals of the object there `(B, F, 3)`."""
    gaps: Array
    """Distances of the fingertips to the object `(B, F)` [m], negative where they overlap."""
    link_gaps: Array
    """Distances of the links to it `(B, n)` [m], the last ones with their tips; `FAR` where a link has no body."""


@kernel
def place_fingers(chain: Chain, room: Room, numbers: tuple[int, int], joints: Array, told: Measured) -> None:
    """Write hinges, axes and tip of one finger, of a number and a first joint, for joint angles `(B, n)`."""
    for b in range(len(joints)):
        _place(chain, room, numbers, joints, b)
        _tell_finger(room, numbers, b, told)


@kernel
def measure_fingers(
    chain: Chain, room: Room, numbers: tuple[int, int], seen: tuple[Surface, Indices, Array, Array], told: Measured
) -> None:
    """Write all of one finger: `seen` are solids, which each world has `(B,)`, poses `(B, 12)` and angles `(B, n)`."""
    solids, whose, poses, joints = seen
    finger, first = numbers
    last = first + len(room.angles) - 1
    for b in range(len(joints)):
        _place(chain, room, numbers, joints, b)
        _tell_finger(room, numbers, b, told)
        pose, own = poses[b], whose[b]
        surface = Surface(solids.kind, solids.half[own], solids.planes[own], solids.triangles[own])
        for k in range(len(room.angles)):
            told.link_gaps[b, first + k] = FAR
        for m in range(len(chain.capsules)):
            stretch(chain, room, m)
            gap = capsule_gap(surface, pose, room, chain.capsules[m, 6], np.inf)
            k = first + chain.carriers[m]
            told.link_gaps[b, k] = min(told.link_gaps[b, k], gap)
        nearest(surface, into(pose, room.tip[0], room.tip[1], room.tip[2]), room.hit)
        gap = room.hit[0] - chain.radius
        told.gaps[b, finger] = gap
        told.link_gaps[b, last] = min(told.link_gaps[b, last], gap)
        normal = turned(pose, room.hit[4], room.hit[5], room.hit[6])
        for i in range(3):
            told.normals[b, finger, i] = normal[i]
            told.points[b, finger, i] = room.tip[i] - room.hit[0] * normal[i]


@kernel
def tell_bodies(chain: Chain, room: Room, numbers: tuple[int, int], joints: Array, bodies: Array) -> None:
    """Write ends and radius of one finger's capsules, and of its tip `(B, F, M, 7)`."""
    for b in range(len(joints)):
        _place(chain, room, numbers, joints, b)
        write_bodies(chain, room, bodies[b, numbers[0]])


@kernel
def reach_points(
    chain: Chain, room: Room, asked: tuple[Array, Array, Array], rules: tuple[float, float, float]
) -> None:
    """Bring the tip's centre to a point from many starts.

    Asked are points `(K, 3)` [m], joint angles `(K, M, n)` that begin as starts and end as solutions, and the misses to
    be written `(K, M)` [m]. Rules are damping [m/rad], largest step [rad] and most rounds.
    """
    points, joints, misses = asked
    for k in range(len(points)):
        for m in range(joints.shape[1]):
            misses[k, m] = _solve(chain, room, (points, joints), (k, m), rules)


@leaf
def _solve(
    chain: Chain, room: Room, asked: tuple[Array, Array], at: tuple[int, int], rules: tuple[float, float, float]
) -> float:
    points, joints = asked
    k, m = at
    n = len(room.angles)
    for j in range(n):
        room.angles[j] = joints[k, m, j]
        room.drift[j] = 0.0
    miss = np.inf
    for _ in range(int(rules[2])):
        reach_out(chain, room)
        x, y, z = points[k, 0] - room.tip[0], points[k, 1] - room.tip[1], points[k, 2] - room.tip[2]
        miss = (x * x + y * y + z * z) ** 0.5
        if miss < 1e-6:
            break
        move_point(room, (room.tip[0], room.tip[1], room.tip[2]), (x, y, z), (rules[0], rules[1]))
        for j in range(n):
            room.angles[j] = min(max(room.angles[j], chain.limits[j, 0]), chain.limits[j, 1])
    for j in range(n):
        joints[k, m, j] = room.angles[j]
    return miss


@leaf
def _place(chain: Chain, room: Room, numbers: tuple[int, int], joints: Array, b: int) -> None:
    for k in range(len(room.angles)):
        room.angles[k] = joints[b, numbers[1] + k]
    reach_out(chain, room)


@leaf
def _tell_finger(room: Room, numbers: tuple[int, int], b: int, told: Measured) -> None:
    finger, first = numbers
    for i in range(3):
        told.tips[b, finger, i] = room.tip[i]
        for k in range(len(room.angles)):
            told.places[b, first + k, i] = room.places[k, i]
            told.axes[b, first + k, i] = room.axes[k, i]
