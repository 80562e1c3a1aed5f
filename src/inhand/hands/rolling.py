"""Fingers that carry an object along a path: contacts that roll without slipping, followed quasi-statically.

At every step the contact moves with the object, the finger follows with the point of it that touches, and the
contact is found anew between the outlines. That covers a rounded tip rolling on a face, a link's flat side
pivoting on a corner, and the change from one to the other, without telling them apart.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.hand import FingerSpec, HandSpec

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
    """Return the tracks of one finger along object poses `(K, S, 3)` in the palm frame, a few millimetres apart.

    At the start a finger may be pressed in or stand a little off; it is seated before it is judged.
    """
    from inhand.hands.placed import chain_of, shapes_of
    from inhand.hands.rolling_kernels import Rolling, Rules, roll_tracks

    (count, steps), n = poses.shape[:2], starts.joints.shape[-1]
    chain, room = chain_of(hand, finger, [piece.shape[-2] for piece in starts.bodies])
    objects = count if starts.bodies[0].ndim > 2 else 1
    pieces = [piece if piece.ndim == 2 else piece[k] for k in range(objects) for piece in starts.bodies]
    points, normals, joints = (np.empty((count, steps, size)) for size in (2, 2, n))
    points[:, 0] = starts.points
    held = np.zeros((count, steps), dtype=bool)
    rules = Rules(DAMPING, CORRECTIONS, TOLERANCE, PRESSED, POSTURE_GAIN, LARGEST_STEP)
    whole = np.ascontiguousarray(poses), np.ascontiguousarray(starts.joints)
    shapes = shapes_of(pieces, len(room.lowest))
    roll_tracks(Rolling(rules, chain, room, shapes, *whole, points, normals, joints, held))
    return Tracks(points, normals, joints, held)
