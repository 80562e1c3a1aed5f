"""Where a finger can touch: joint angles that rest the rounded fingertip on a point of an outline.

The fingertip's cap is half an ellipse with semi-axes a (across the link) and b (along it). A cap touches a face
of outward normal n with its support point in the direction d = -n,

    s(phi, d) = M d / sqrt(d' M d),   M = a^2 w w' + b^2 u u',

seen from the cap's centre, with u along and w across the link of absolute angle phi. It does so where d . u >= 0;
then the whole link lies on its own side of the tangent, so a convex object is never penetrated by it.

A fingertip with an outline of its own touches with that outline's support point instead: a corner, or at the
inclination of one of its faces any point of that face.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array, rotate, wrap_angle
from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.kinematics import link_direction
from inhand.hands.polygons import edge_normals

INCLINATIONS = np.deg2rad(np.linspace(-88.0, 88.0, 45))
"""Angles of the last link against the inward normal that are tried [rad]."""
FACE_BLEND = 1e-3
"""Within this angle of a face's normal the support point moves from one end of the face to the other [rad]: the outline
then sinks in by an eighth of the face's length times this, 5 um for 40 mm."""
BISECTIONS = 24
"""Halvings of a bracket for a fingertip with an outline of its own: 4 deg become 4e-9 rad, far below `FACE_BLEND`."""


@dataclass(frozen=True)
class Touches:
    """Joint angles for points of an outline; arrays share the points' leading axes."""

    joints: Array
    """Joint angles `(..., n)` [rad]; NaN where the point is out of reach."""
    inclination: Array
    """Angle from the inward normal to the last link `(...)` [rad]."""
    reached: NDArray[np.bool_]
    """Whether the finger can touch the point `(...)`."""


def cap_support(hand: HandSpec, angle: Array, direction: Array) -> Array:
    """Return the cap's support point `(..., 2)` [m] seen from its centre.

    The last link has an absolute angle `(...)` [rad]; the unit vectors `(..., 2)` point towards the object.
    """
    u = link_direction(angle)
    along = (direction * u).sum(-1, keepdims=True)
    across = direction - along * u
    a2, b2 = (hand.link_width / 2) ** 2, hand.tip_length**2
    scaled = a2 * across + b2 * along * u
    return np.asarray(scaled / np.sqrt((scaled * direction).sum(-1, keepdims=True)))


def outline_support(corners: Array, angle: Array, direction: Array) -> Array:
    """Return the support point `(..., 2)` [m] of a convex outline turned by an angle, seen from the outline's origin.

    It is the corner of the outline `(K, 2)` [m], counter-clockwise, farthest along the unit vectors `(..., 2)`; close
    to a face's normal it runs along that face, so that it is a continuous function of the angle `(...)` [rad].
    """
    normals = edge_normals(corners)
    heading = np.arctan2(normals[:, 1], normals[:, 0])
    turn = wrap_angle(heading - np.roll(heading, 1))
    blend = np.minimum(FACE_BLEND, np.minimum(turn, np.roll(turn, -1)) / 3)
    knots = np.concatenate([heading - blend, heading + blend])
    ends = np.concatenate([corners, np.roll(corners, -1, axis=0)])
    wanted = np.arctan2(direction[..., 1], direction[..., 0]) - angle
    local = [np.interp(wanted, knots, ends[:, axis], period=2 * np.pi) for axis in range(2)]
    return rotate(angle, np.stack(local, axis=-1))


def touch(hand: HandSpec, finger: FingerSpec, points: Array, normals: Array) -> Touches:
    """Return joint angles that rest the fingertip on points `(..., 2)` [m] with outward normals `(..., 2)`.

    Of several postures the one that bends inwards most, its elbow outwards, is taken; a third link is bent as
    evenly as the second. Limits of the joints are kept; collisions of other links are not looked at.
    """
    inward = np.arctan2(normals[..., 0], -normals[..., 1])  # angle of a link along -normal
    if len(finger.links) == 2:
        inclination, reached = _two_link_inclination(hand, finger, points, -normals, inward)
        joints = _joints(hand, finger, points, -normals, inward + inclination)
        reached &= within_limits(finger, joints)
    else:
        inclination, joints, reached = _three_link_choice(hand, finger, points, -normals, inward)
    return Touches(np.where(reached[..., None], joints, np.nan), inclination, reached)


def _last_joint(hand: HandSpec, finger: FingerSpec, points: Array, direction: Array, angle: Array) -> Array:
    """Return where the last link's joint must be `(..., 2)` [m] for a link at an absolute angle."""
    if finger.outlines is not None:
        return points - outline_support(np.array(finger.outlines[-1]), angle, direction)
    reach = finger.links[-1] - hand.tip_length
    return points - cap_support(hand, angle, direction) - reach * link_direction(angle)


def _two_link_inclination(
    hand: HandSpec, finger: FingerSpec, points: Array, direction: Array, inward: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Solve |last joint - base| = first link for the inclination, by bracketing and regula falsi or bisection."""

    def excess(inclination: Array, points: Array, direction: Array, inward: Array) -> tuple[Array, Array]:
        """Return the miss of the first link's length [m] and the bend inwards [rad]."""
        joint = _last_joint(hand, finger, points, direction, inward + inclination) - np.array(finger.base)
        heading = np.arctan2(-joint[..., 0], joint[..., 1])
        bend = finger.bend * wrap_angle(inward + inclination - heading)
        return np.asarray(np.linalg.norm(joint, axis=-1) - finger.links[0]), bend

    grid = INCLINATIONS
    values, bends = excess(grid, points[..., None, :], direction[..., None, :], inward[..., None])
    crossing = (values[..., 1:] * values[..., :-1]) <= 0
    index = np.where(crossing, bends[..., 1:] + bends[..., :-1], -np.inf).argmax(axis=-1)
    low, high = grid[index], grid[index + 1]
    f_low = np.take_along_axis(values, index[..., None], -1)[..., 0]
    f_high = np.take_along_axis(values, index[..., None] + 1, -1)[..., 0]
    middle = low
    bisect = finger.outlines is not None  # the miss is steep where the tip turns over a face
    for _ in range(BISECTIONS if bisect else 4):
        spread = np.where(f_high == f_low, 1.0, f_high - f_low)
        secant = np.clip(low - f_low * (high - low) / spread, np.minimum(low, high), np.maximum(low, high))
        middle = (low + high) / 2 if bisect else secant
        f_middle, _ = excess(middle, points, direction, inward)
        left = f_middle * f_low <= 0
        low, f_low = np.where(left, low, middle), np.where(left, f_low, f_middle)
        high, f_high = np.where(left, middle, high), np.where(left, f_middle, f_high)
    return middle, np.asarray(crossing.any(axis=-1))


def _joints(hand: HandSpec, finger: FingerSpec, points: Array, direction: Array, angle: Array) -> Array:
    """Return joint angles `(..., n)` [rad] for given absolute angles of the last link."""
    joint = _last_joint(hand, finger, points, direction, angle) - np.array(finger.base)
    heading = np.arctan2(-joint[..., 0], joint[..., 1])
    if len(finger.links) == 2:
        return np.stack([wrap_angle(heading), wrap_angle(angle - heading)], axis=-1)
    first, second = finger.links[:2]
    distance = np.linalg.norm(joint, axis=-1)
    cosine = (distance**2 - first**2 - second**2) / (2 * first * second)
    with np.errstate(invalid="ignore"):
        bend = finger.bend * np.arccos(cosine)
    offset = np.arctan2(second * np.sin(bend), first + second * np.cos(bend))
    start = heading - offset
    return np.stack([wrap_angle(start), bend, wrap_angle(angle - start - bend)], axis=-1)


def _three_link_choice(
    hand: HandSpec, finger: FingerSpec, points: Array, direction: Array, inward: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    angle = inward[..., None] + INCLINATIONS
    joints = _joints(hand, finger, points[..., None, :], direction[..., None, :], angle)
    allowed = within_limits(finger, joints)
    cost = np.where(allowed, (joints[..., 1:] ** 2).sum(-1), np.inf)
    best = cost.argmin(axis=-1)
    chosen = np.take_along_axis(joints, best[..., None, None], axis=-2)[..., 0, :]
    return INCLINATIONS[best], chosen, np.asarray(allowed.any(axis=-1))


def inclined_touches(hand: HandSpec, finger: FingerSpec, points: Array, normals: Array, inclinations: Array) -> Touches:
    """Return how a three-link finger rests its tip on points `(..., 2)` at each of A inclinations, as `(..., A)`.

    Points [m] and outward normals `(..., 2)` are in the palm frame; an inclination is the angle from the inward normal
    to the last link [rad].
    """
    angle = np.arctan2(normals[..., 0], -normals[..., 1])[..., None] + inclinations
    joints = _joints(hand, finger, points[..., None, :], -normals[..., None, :], angle)
    reached = within_limits(finger, joints)
    inclination = np.broadcast_to(inclinations, reached.shape)
    return Touches(np.where(reached[..., None], joints, np.nan), np.asarray(inclination), reached)


def within_limits(finger: FingerSpec, joints: Array) -> NDArray[np.bool_]:
    """Return which joint angles `(..., n)` [rad] keep a finger's limits; NaN does not."""
    limits = np.array(finger.limits)
    with np.errstate(invalid="ignore"):
        return np.asarray(((joints >= limits[:, 0]) & (joints <= limits[:, 1])).all(axis=-1))
