"""Whether an object fits between the fingers of a hand in space at its start."""

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array, fixed
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.forces import GripRules
from inhand.hands.spatial.hand import SpatialHand, Vector
from inhand.hands.spatial.objects import Mesh, SolidSpec
from inhand.hands.spatial.rolling import NONE, off_the_palm
from inhand.hands.spatial.start_contacts import contacts_at
from inhand.hands.spatial.start_tuples import held_together

ACROSS = 4
"""How many contacts are looked for across an object."""
GRIPPING = 1.0
"""Friction with which a grip would be found; whether the object's own is enough is not a matter of its size."""
HALVINGS = 7
"""Times that the largest object is looked for between two sizes: to a hundredth of it."""


class SpatialHeld(NamedTuple):
    """Which object is in which hand in space, and how gravity pulls."""

    hand: SpatialHand
    object: SolidSpec
    gravity: Vector
    """Gravity in the palm frame [m/s^2]."""

    @property
    def start(self) -> Array:
        """Place and rotation vector in which the object starts `(6,)` [m, rad]."""
        return fixed([*self.hand.start_position, 0.0, 0.0, 0.0])


def check_solid_fit(hand: SpatialHand, spec: SolidSpec) -> None:
    """Refuse an object that the hand cannot take in at the start.

    Raises:
        InputError: it reaches into the palm, or a finger finds no place on it; the text gives the largest that fits.
    """
    why = _why_not(hand, spec)
    if why:
        most = _largest(hand, spec)
        shown = " x ".join(f"{1e3 * most * length:.0f}" for length in spec.size)
        cure = f"the largest {spec.shape} of this form that fits is {shown} mm" if most else "no size of this form fits"
        raise InputError(f"object {spec.name!r} does not fit into hand {hand.name!r} at the start: {why}; {cure}")


@lru_cache(maxsize=64)
def _why_not(hand: SpatialHand, spec: SolidSpec) -> str:
    """Return why an object does not fit; empty if it does. Each of many environments asks, and it takes 0.2 s."""
    rows = kinematics.rows_of(hand.start_pose)[None, None]
    if not off_the_palm(hand, spec, rows, 0.0).all():
        room = hand.start_position[2] - hand.palm.top
        return f"it reaches into the palm, which leaves {2e3 * room:.0f} mm of height"
    spacing = max(spec.size) / ACROSS
    for finger, starts in zip(hand.fingers, contacts_at((hand, spec), hand.start_pose, spacing, NONE), strict=True):
        if not len(starts.points):
            return f"{finger.name!r} reaches no place on it that keeps its joints' limits and its links off the object"
    rules = GripRules(friction=GRIPPING)
    together = held_together((hand, spec), hand.start_pose, spacing, NONE, rules)
    if not len(together.holding(together.rows())):
        return "no places that its fingers reach lie so that they could grip it together"
    return ""


def _largest(hand: SpatialHand, spec: SolidSpec) -> float:
    """Return the largest share of an object's size that fits, 0 where none does."""
    high = 1.0
    low = next((share for share in (0.7, 0.5, 0.3, 0.2, 0.1) if not _why_not(hand, scaled(spec, share))), 0.0)
    for _ in range(HALVINGS if low else 0):
        middle = (low + high) / 2
        low, high = (low, middle) if _why_not(hand, scaled(spec, middle)) else (middle, high)
    return low


def scaled(spec: SolidSpec, share: float) -> SolidSpec:
    """Return an object of the same form and mass, a share of the size."""
    x, y, z = (float(np.clip(share * length, 1e-3, 1.0)) for length in spec.size)
    if spec.mesh is None:
        return replace(spec, size=(x, y, z))
    corners = tuple((share * a, share * b, share * c) for a, b, c in spec.mesh.corners)
    xx, yy, zz, xy, xz, yz = (share**2 * moment for moment in spec.mesh.inertia)
    return replace(spec, size=(x, y, z), mesh=Mesh(corners, spec.mesh.triangles, (xx, yy, zz, xy, xz, yz)))
