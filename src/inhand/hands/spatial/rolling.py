"""How a finger follows an object in space: quasi-static rolling without slip, as in the plane, or a contact that stays.

The touching point of the tip moves with the object, damped least squares moves the joints, and the contact is found
anew between sphere and solid: that rolls a tip on faces and round bodies alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec

DAMPING = 1e-4
"""Damping of the joint steps [m/rad]; only singular postures feel it."""
CORRECTIONS = 2
"""Corrections of the remaining gap after each step."""
POSTURE_GAIN = 0.05
"""Share of the way back to the start posture that a redundant finger takes at each step."""
LARGEST_STEP = 0.3
"""A joint step beyond this ends a track: the finger is at a singular posture [rad]."""


MOST_BODIES = 32
"""Capsules that a finger may have, its tip among them."""


@dataclass(frozen=True)
class Margins:
    """What a finger that follows keeps; the defaults are those of planning."""

    tolerance: float = 4e-4
    """A tip that misses its contact by more has lost it [m]."""
    links: float = 0.0007
    """What links keep off the object [m]; the last link half of what its tip stands out, where that is less."""
    edge: float = 0.001
    """What contacts keep off edges [m]."""
    fingers: float = 0.0025
    """What fingers keep off each other [m], but never more than the straight hand has."""
    joints: float = 0.04
    """What joints keep off their limits [rad]."""
    palm: float = 0.001
    """What the object keeps off the palm [m]."""


NONE = Margins(links=0.0, edge=0.0, fingers=0.0, joints=0.0, palm=0.0)
"""No margins: what bodies allow."""


@dataclass(frozen=True, eq=False)
class Tracks:
    """Contacts of one finger: K starts (axis 0) along S poses (axis 1); what is beyond its length is nothing."""

    points: Array
    """Contacts in the object frame `(K, S, 3)` [m]."""
    normals: Array
    """Outward normals there in its frame `(K, S, 3)`."""
    joints: Array
    """Joint angles `(K, S, n)` [rad]."""
    bodies: Array
    """Ends and radius of each capsule, and of the tip, in the palm frame `(K, S, M + 1, 7)` [m]."""
    lengths: NDArray[np.int64]
    """How many poses the finger has been able to follow `(K,)`."""


@dataclass(frozen=True, eq=False)
class Starts:
    """Where K tracks of one finger start."""

    points: Array
    """Contacts in the object frame `(K, 3)` [m]."""
    normals: Array
    """Outward normals there `(K, 3)`."""
    joints: Array
    """Joint angles that touch them `(K, n)` [rad]."""


def roll(
    held: tuple[SpatialHand, SolidSpec],
    finger: int,
    starts: Starts,
    rows: Array,
    margins: Margins,
    *,
    fixed: bool = False,
) -> Tracks:
    """Return the tracks of a hand's finger along poses of its object, a few millimetres and degrees apart.

    Args:
        held: hand and object.
        finger: the number of the finger.
        starts: first contacts; a tip may be pressed in or stand a little off, it is seated before it is judged.
        rows: poses `(1, S, 12)` for all tracks or `(K, S, 12)`, as `kinematics.rows_of` gives them.
        margins: what the finger keeps.
        fixed: whether contacts stay where they are on the object instead of rolling.
    """
    from inhand.hands.spatial.rolling_kernels import Rolling, Rules, roll_tracks

    hand, spec = held
    chain, room = kinematics.chain(hand.fingers[finger])
    (count, n), steps, bodies = starts.joints.shape, rows.shape[1], len(chain.capsules) + 1
    sizes = ((3,), (3,), (n,), (bodies, 7))
    points, normals, joints, shapes = (np.empty((count, steps, *size)) for size in sizes)
    points[:, 0], normals[:, 0] = starts.points, starts.normals
    rules = Rules(
        DAMPING, CORRECTIONS, margins.tolerance, POSTURE_GAIN, LARGEST_STEP, margins.joints, margins.edge, fixed
    )
    told = points, normals, joints, shapes, np.zeros(count, dtype=np.int64)
    rest = np.ascontiguousarray(starts.joints)
    palm, clears, spared = _kept(hand, finger, margins)
    seen = kinematics.surface(spec)
    roll_tracks(Rolling(rules, chain, room, seen, palm, clears, spared, rows, rest, *told))
    return Tracks(*told)


def _kept(hand: SpatialHand, finger: int, margins: Margins) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return the palm's box, what each capsule of a finger keeps off the object, and which may end in the palm."""
    chain, _ = kinematics.chain(hand.fingers[finger])
    out = chain.radius - chain.capsules[:, 6]  # a last link may be as thick as its tip, which then is its end
    last = chain.carriers == len(chain.origins) - 1
    clears = np.where(
        last, np.minimum(margins.links, np.where(out > 0, out / 2, out - margins.tolerance)), margins.links
    )
    palm = np.array([*hand.palm.centre, *hand.palm.half])
    straight = kinematics.bodies_of(hand, np.clip(np.zeros((1, hand.n_joints)), *hand.limits.T), MOST_BODIES)
    return palm, clears, (np.abs(straight[0, finger, :, 3:6] - palm[:3]) < palm[3:]).all(axis=-1)


def off_the_palm(hand: SpatialHand, spec: SolidSpec, rows: Array, margin: float) -> NDArray[np.bool_]:
    """Return whether an object at poses `(..., S, 12)` is above the palm from the first on `(..., S)`."""
    x, y, z = rows[..., 9], rows[..., 10], rows[..., 11]
    a, b, c = spec.half
    if spec.mesh is not None:
        reach = -(rows[..., None, 9:] * np.array(spec.mesh.corners)).sum(axis=-1).min(axis=-1)
    elif spec.shape == "box":
        reach = abs(x) * a + abs(y) * b + abs(z) * c
    elif spec.shape == "cylinder":
        reach = abs(z) * c + a * np.hypot(x, y)
    else:
        reach = np.sqrt((a * x) ** 2 + (b * y) ** 2 + (c * z) ** 2)
    return np.asarray(np.logical_and.accumulate(rows[..., 2] - reach > hand.palm.top + margin, axis=-1))
