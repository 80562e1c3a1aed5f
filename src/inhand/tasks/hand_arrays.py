"""Hands and objects of many worlds as arrays of one shape, whatever hands they are: a slot for each joint that one has.

A finger has three slots, from the palm outwards; where it has two links the third stays empty: a link of no length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array, cross, unit
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, polygon

PER_FINGER = 3
"""Slots of a finger."""
SLOTS = 2 * PER_FINGER
"""Slots of a hand."""
RAYS = 16
"""Angles at which an outline is told."""


@dataclass(frozen=True, eq=False)
class HandArrays:
    """What B worlds' hands and objects are; hands of one number of joints of each finger."""

    base: Array
    """Proximal joints `(B, 2, 2)` [m]."""
    links: Array
    """Link lengths `(B, 2, 3)` [m], 0 where there is none."""
    there: Array
    """1 where there is a joint `(B, 2, 3)`, else 0."""
    limits: Array
    """Joint limits `(B, n_joints, 2)` [rad], in the order of every array of joints."""
    gains: Array
    """Stiffness [N m/rad], damping over stiffness [s], largest torque [N m] and friction of each world `(B, 4)`."""
    outline: Array
    """Distances from the object's origin to its outline at `RAYS` angles from its own x axis `(B, RAYS)` [m]."""
    start: Array
    """Where objects start in the palm frame `(B, 2)` [m]."""

    @property
    def places(self) -> NDArray[np.int64]:
        """Slot of each joint `(n_joints,)`."""
        return np.flatnonzero(self.there[0].ravel())

    def take(self, rows: NDArray[np.int64]) -> HandArrays:
        """Return those of some worlds."""
        return HandArrays(**{each.name: getattr(self, each.name)[rows] for each in fields(self)})

    def slotted(self, joints: Array) -> Array:
        """Return numbers of the joints `(B, n_joints)` in their slots `(B, SLOTS)`, 0 in those that are empty."""
        return slotted(joints, self.places)


def slots_of(hand: HandSpec) -> NDArray[np.int64]:
    """Return the slot of each joint of a hand `(n_joints,)`."""
    return np.array([PER_FINGER * i + k for i, finger in enumerate(hand.fingers) for k in range(len(finger.links))])


def slotted(joints: Array, places: NDArray[np.int64]) -> Array:
    """Return numbers of joints `(B, n_joints)` at their places among all slots `(B, SLOTS)`, 0 elsewhere."""
    found = np.zeros((len(joints), SLOTS))
    found[:, places] = joints
    return found


def arrays_of(hands: Sequence[HandSpec], objects: Sequence[ObjectSpec]) -> HandArrays:
    """Return the arrays of B worlds, the hand and the object of each."""
    pairs = list(zip(hands, objects, strict=True))
    known = {pair: number for number, pair in enumerate(dict.fromkeys(pairs))}
    each = [_one(*pair) for pair in known]
    whole = HandArrays(**{f.name: np.concatenate([getattr(one, f.name) for one in each]) for f in fields(HandArrays)})
    return whole.take(np.array([known[pair] for pair in pairs]))


@lru_cache(maxsize=1024)
def _one(hand: HandSpec, spec: ObjectSpec) -> HandArrays:
    links, there = np.zeros((2, 1, 2, PER_FINGER))
    for i, finger in enumerate(hand.fingers):
        links[0, i, : len(finger.links)] = finger.links
        there[0, i, : len(finger.links)] = 1.0
    gains = hand.stiffness, hand.damping / hand.stiffness, hand.torque, hand.friction * spec.friction
    base, start = np.array([finger.base for finger in hand.fingers])[None], np.array([hand.start_position])
    return HandArrays(base, links, there, hand.limits[None], np.array([gains]), ray_lengths(spec)[None], start)


def ray_lengths(spec: ObjectSpec, count: int = RAYS) -> Array:
    """Return the distances from an object's origin to the farthest point of its outline at even angles `(count,)` [m].

    A ray that meets no edge, of an outline that does not hold its own origin, has 0.
    """
    corners, rays = polygon(spec), unit(np.arange(count) * 2 * np.pi / count)
    edges = np.roll(corners, -1, axis=0) - corners
    # origin + t ray = corner + s edge, t >= 0 and 0 <= s <= 1
    bottom = cross(rays[:, None], edges)
    safe = np.where(np.abs(bottom) < 1e-12, 1.0, bottom)
    along = cross(corners, edges) / safe
    share = -cross(rays[:, None], corners) / safe
    met = (np.abs(bottom) >= 1e-12) & (along >= 0) & (share >= -1e-9) & (share <= 1 + 1e-9)
    return np.asarray(np.where(met, along, 0.0).max(axis=-1))
