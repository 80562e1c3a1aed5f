"""Batch kinematics of fingers in space: points, Jacobians, contacts, damped least squares and inverse kinematics."""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.spatial.hand import SpatialFinger, SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.rotations import matrix_of

if TYPE_CHECKING:
    from inhand.hands.spatial.chains import Chain, Room
    from inhand.hands.spatial.measuring import Measured
    from inhand.hands.spatial.surfaces import Surface

IK_DAMPING = 0.004
"""Damping of inverse kinematics [m/rad]."""
IK_STEP = 0.3
"""Largest joint step of inverse kinematics [rad]."""
IK_ROUNDS = 40
"""Most steps of inverse kinematics from one start."""
MISS = 2e-5
"""A tip this near to its point has reached it [m]."""
STARTS = (0.2, 0.5, 0.8)
"""Where between its limits each joint starts: every combination, as fingers of many joints need several (guessed)."""
MOST_STARTS = 243
"""Starts of one finger, drawn evenly from all combinations where there are more."""
ALIKE = 0.2
"""Postures that differ by less in every joint are one [rad]."""


def place(hand: SpatialHand, joints: Array) -> Measured:
    """Return where joint angles `(B, n)` [rad] put hinges, axes and tips; nothing is measured of an object."""
    from inhand.hands.spatial.measuring import place_fingers

    told = _told(hand, len(joints))
    for numbers, (chain, room) in zip(_numbers(hand), _chains(hand), strict=True):
        place_fingers(chain, room, numbers, np.ascontiguousarray(joints), told)
    return told


def measure(hand: SpatialHand, spec: SolidSpec, joints: Array, pose: Array) -> Measured:
    """Return what joint angles `(B, n)` [rad] and poses of the object `(B, 7)` come to: contacts, normals, gaps too."""
    return measure_each(hand, (surfaces((spec,)), np.zeros(len(joints), dtype=np.int64)), joints, pose)


def measure_each(hand: SpatialHand, solids: tuple[Surface, NDArray[np.int64]], joints: Array, pose: Array) -> Measured:
    """Return the same of worlds whose objects differ: their surfaces, and which of them each world has `(B,)`."""
    from inhand.hands.spatial.measuring import measure_fingers

    told = _told(hand, len(joints))
    seen = (*solids, rows_of(pose), np.ascontiguousarray(joints))
    for numbers, (chain, room) in zip(_numbers(hand), _chains(hand), strict=True):
        measure_fingers(chain, room, numbers, seen, told)
    return told


def bodies_of(hand: SpatialHand, joints: Array, most: int) -> Array:
    """Return ends and radius of each finger's capsules, and of its tip, in the palm frame `(B, F, most, 7)` [m].

    Fingers of fewer bodies have others of no radius.
    """
    from inhand.hands.spatial.measuring import tell_bodies

    bodies = np.zeros((len(joints), len(hand.fingers), most, 7))
    for numbers, (chain, room) in zip(_numbers(hand), _chains(hand), strict=True):
        tell_bodies(chain, room, numbers, np.ascontiguousarray(joints), bodies)
    return bodies


def point_jacobian(places: Array, axes: Array, point: Array) -> Array:
    """Return how a point `(..., 3)` [m] of the last link moves with joints at `(..., n, 3)`: `(..., 3, n)` [m/rad]."""
    arm = point[..., None, :] - places
    x, y, z = (arm[..., k] for k in range(3))
    u, v, w = (axes[..., k] for k in range(3))
    return np.stack([v * z - w * y, w * x - u * z, u * y - v * x], axis=-2)


def damped_least_squares(jacobian: Array, step: Array, damping: float, posture: Array | None = None) -> Array:
    """Return joint steps `(..., n)` [rad] that move a point by `step` `(..., 3)` [m].

    Minimises |J dq - dx|^2 + damping^2 |dq|^2 with J `(..., 3, n)` [m/rad]; a posture step `(..., n)` [rad] is added
    where it does not move the point. The 3 x 3 system is solved by cross products, column by column (Wampler 1986).
    """
    u, v, w = (jacobian[..., k, :] for k in range(3))
    wanted = step if posture is None else step - (jacobian * posture[..., None, :]).sum(axis=-1)
    x, y, z = (wanted[..., k] for k in range(3))
    squared = damping * damping
    a, b, c = ((row * row).sum(axis=-1) + squared for row in (u, v, w))
    d, e, f = (u * v).sum(axis=-1), (u * w).sum(axis=-1), (v * w).sum(axis=-1)
    p, q, r, s, t, o = b * c - f * f, e * f - d * c, d * f - e * b, a * c - e * e, d * e - a * f, a * b - d * d
    determinant = a * p + d * q + e * r
    first, second, third = (
        ((p * x + q * y + r * z) / determinant)[..., None],
        ((q * x + s * y + t * z) / determinant)[..., None],
        ((r * x + t * y + o * z) / determinant)[..., None],
    )
    joint_step = u * first + v * second + w * third
    return np.asarray(joint_step if posture is None else joint_step + posture)


def inverse(finger: SpatialFinger, points: Array, starts: Array | None = None) -> tuple[Array, Array]:
    """Return joint angles `(K, M, n)` [rad] that bring the tip's centre to points `(K, 3)` [m], and what they miss [m].

    Each of M starts `(M, n)` or `(K, M, n)` gives one posture; without them `starts_of` the finger. What is farther
    than `MISS` from its point has not reached it.
    """
    from inhand.hands.spatial.measuring import reach_points

    own, room = chain(finger)
    begun = starts_of(finger) if starts is None else starts
    joints = np.array(np.broadcast_to(begun, (len(points), *begun.shape[-2:])), order="C")
    misses = np.empty(joints.shape[:2])
    rules = (IK_DAMPING, IK_STEP, float(IK_ROUNDS))
    reach_points(own, room, (np.ascontiguousarray(points), joints, misses), rules)
    return joints, misses


@lru_cache(maxsize=64)
def starts_of(finger: SpatialFinger) -> Array:
    """Return joint angles `(M, n)` [rad] from which inverse kinematics starts, between the finger's limits."""
    low, high = finger.limits.T
    shares = np.array(list(product(STARTS, repeat=len(finger.links))))
    if len(shares) > MOST_STARTS:
        shares = shares[np.linspace(0, len(shares) - 1, MOST_STARTS).astype(int)]
    return np.asarray(low + shares * (high - low))


def rows_of(pose: Array) -> Array:
    """Return poses `(..., 7)` as kernels read them: place and rotation row by row `(..., 12)`."""
    rotation = matrix_of(pose[..., 3:]).reshape(*pose.shape[:-1], 9)
    return np.ascontiguousarray(np.concatenate([pose[..., :3], rotation], axis=-1))


@lru_cache(maxsize=64)
def surface(spec: SolidSpec) -> Surface:
    """Return an object's surface for kernels."""
    from inhand.hands.spatial.surfaces import surface_of

    return surface_of(spec)


@lru_cache(maxsize=64)
def surfaces(specs: tuple[SolidSpec, ...]) -> Surface:
    """Return the surfaces of objects of one shape for kernels, stacked."""
    from inhand.hands.spatial.surfaces import stacked_surfaces

    return stacked_surfaces(specs)


@lru_cache(maxsize=256)
def chain(finger: SpatialFinger) -> tuple[Chain, Room]:
    """Return a finger for kernels, and room for it."""
    from inhand.hands.spatial.chains import chain_of, room_for

    return chain_of(finger), room_for(len(finger.links))


def _chains(hand: SpatialHand) -> list[tuple[Chain, Room]]:
    return [chain(finger) for finger in hand.fingers]


def _numbers(hand: SpatialHand) -> list[tuple[int, int]]:
    """Return each finger's number and the place of its first joint."""
    return [(f, place.start) for f, place in enumerate(hand.slices)]


def _told(hand: SpatialHand, worlds: int) -> Measured:
    from inhand.hands.spatial.measuring import Measured

    n, f = hand.n_joints, len(hand.fingers)
    sizes = ((n, 3), (n, 3), (f, 3), (f, 3), (f, 3), (f,), (n,))
    return Measured(*(np.zeros((worlds, *size)) for size in sizes))
