"""Fingers that carry an object along a path: contacts that roll without slipping, followed quasi-statically.

At every step the contact moves with the object, the finger follows with the point of it that touches, and the
contact is found anew between the outlines. That covers a rounded tip rolling on a face, a link's flat side
pivoting on a corner, and the change from one to the other, without telling them apart.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array, inverse_transform, rotate, transform
from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.kinematics import damped_least_squares, joint_positions, point_jacobian
from inhand.hands.polygons import apart, nearest_contact
from inhand.hands.shapes import link_polygon, link_polygons, palm_outline
from inhand.hands.touch import within_limits

DAMPING = 1e-4
"""Damping of the joint steps [m/rad]; only singular postures feel it."""
CORRECTIONS = 2
"""Corrections of the remaining gap after each step."""
TOLERANCE = 4e-4
"""A finger that misses its contact by more has lost it [m]."""
PRESSED = 0.001
"""A finger that starts deeper inside the object holds nothing [m]: guessed, twice what short links with stiff servos
sink into it when they close."""
POSTURE_GAIN = 0.1
"""Share of the way back to the start posture that a third link takes at each step."""
LARGEST_STEP = 0.25
"""A joint step beyond this ends a track: the finger is at a singular posture [rad]."""


@dataclass(frozen=True)
class Tracks:
    """Rolling contacts of one finger: K starts (axis 0) over the S poses of a path (axis 1)."""

    points: Array
    """Contacts in the object frame `(K, S, 2)` [m]."""
    normals: Array
    """Normals there, out of the object, in its frame `(K, S, 2)`."""
    joints: Array
    """Joint angles `(K, S, n)` [rad]."""
    held: NDArray[np.bool_]
    """Whether the finger has been able to follow from the start to here `(K, S)`."""


@dataclass(frozen=True)
class Starts:
    """Where K tracks of one finger start."""

    points: Array
    """Contacts in the object frame `(K, 2)` [m]."""
    joints: Array
    """Joint angles that touch them `(K, n)` [rad]."""
    bodies: tuple[Array, ...]
    """Convex pieces of the objects in their own frames, each `(K, M, 2)` or, of one object, `(M, 2)` [m]."""


def roll(hand: HandSpec, finger: FingerSpec, starts: Starts, poses: Array) -> Tracks:
    """Return the tracks of one finger along object poses `(K, S, 3)` in the palm frame, a few millimetres apart."""
    joints, (count, steps) = starts.joints, poses.shape[:2]
    points, normals, angles = (np.empty((count, steps, size)) for size in (2, 2, joints.shape[-1]))
    tracks = Tracks(points, normals, angles, np.zeros((count, steps), dtype=bool))
    rows = np.arange(count)
    body = _placed(starts.bodies, rows, poses[:, 0])
    contacts = transform(poses[:, 0], starts.points)
    # At the start a finger may be pressed in or stand a little off; it is seated before it is judged.
    pressed = _touch(hand, finger, joints, body)[0] > -PRESSED
    joints = _seated(hand, finger, body, joints)
    gap, _, facing, clear = _touch(hand, finger, joints, body)
    held = pressed & clear & (gap > -TOLERANCE)
    _record(tracks, (rows, 0), poses[:, 0], (contacts, facing, joints, held))
    for s in range(1, steps):
        # Only tracks that still hold go on.
        rows, contacts, joints = rows[held], contacts[held], joints[held]
        last = s + 1 if len(rows) else steps
        for values in (tracks.points, tracks.normals, tracks.joints):
            values[:, s:last] = values[:, s - 1 : s]  # what is lost stays where it was
        if len(rows) == 0:
            break
        pose = poses[rows, s]
        # The contact is carried along with the object, the finger follows, and touches where it then is nearest.
        moved = transform(pose, inverse_transform(poses[rows, s - 1], contacts))
        body = _placed(starts.bodies, rows, pose)
        joints, kept = _follow(hand, finger, body, (joints, contacts, moved, starts.joints[rows]))
        gap, contacts, facing, clear = _touch(hand, finger, joints, body)
        held = kept & (np.abs(gap) < TOLERANCE) & within_limits(finger, joints) & clear
        _record(tracks, (rows, s), pose, (contacts, facing, joints, held))
    return tracks


def _placed(pieces: tuple[Array, ...], rows: NDArray[np.int64], poses: Array) -> list[Array]:
    """Return the pieces of some objects at their poses `(R, 3)`, each `(R, M, 2)` [m]."""
    return [transform(poses[:, None], piece[rows] if piece.ndim > 2 else piece) for piece in pieces]


def _follow(
    hand: HandSpec, finger: FingerSpec, body: list[Array], start: tuple[Array, Array, Array, Array]
) -> tuple[Array, NDArray[np.bool_]]:
    """Move the touching points along and close the remaining gap; return joints and whether no step was too large."""
    joints, contacts, moved, rest = start
    # The point of the last link that touches is to move as the object's does; a third link drifts back as well.
    jacobian = point_jacobian(joint_positions(finger, joints)[..., :-1, :], contacts)
    posture = POSTURE_GAIN * (rest - joints) if joints.shape[-1] > 2 else None
    step = damped_least_squares(jacobian, moved - contacts, DAMPING, posture)
    joints = joints + np.clip(step, -LARGEST_STEP, LARGEST_STEP)
    return _seated(hand, finger, body, joints), np.asarray((np.abs(step) < LARGEST_STEP).all(-1))


def _seated(hand: HandSpec, finger: FingerSpec, body: list[Array], joints: Array) -> Array:
    """Return joint angles `(K, n)` whose last link rests on the object, where it stood a little off or pressed in."""
    for _ in range(CORRECTIONS):
        places = joint_positions(finger, joints)
        tip = link_polygon(hand, finger, (joints, places), len(finger.links) - 1)
        gap, contacts, normals = nearest_contact(tip, body)
        jacobian = point_jacobian(places[..., :-1, :], contacts)
        # Along the normal by the gap; turning moves the nearest point a little, so it is done again.
        step = damped_least_squares(jacobian, -gap[..., None] * normals, DAMPING)
        joints = joints + np.clip(step, -LARGEST_STEP, LARGEST_STEP)
    return joints


def _record(
    tracks: Tracks,
    place: tuple[NDArray[np.int64], int],
    pose: Array,
    found: tuple[Array, Array, Array, NDArray[np.bool_]],
) -> None:
    contacts, normals, joints, held = found
    tracks.points[place] = inverse_transform(pose, contacts)
    tracks.normals[place] = rotate(-pose[:, 2], normals)
    tracks.joints[place] = joints
    tracks.held[place] = held


def _touch(
    hand: HandSpec, finger: FingerSpec, joints: Array, body: list[Array]
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Return the last link's gap, contact and normal, and whether nothing else meets `(K,)`.

    Nothing else: inner links stay off the object, and the object and all outer links off the palm.
    """
    links, palm = link_polygons(hand, finger, joints), palm_outline(hand)
    clear = np.ones(joints.shape[:1], dtype=bool)
    for piece in body:
        for part in (palm, *links[:-1]):
            clear &= apart(part, piece)
    for link in links[1:]:
        clear &= apart(link, palm)
    return *nearest_contact(links[-1], body), clear
