"""MuJoCo's servo for PyBullet's hands: a torque for each joint in each of PyBullet's steps.

A joint with target t, angle q and speed w is turned by

    s = min(max(stiffness (t - q), -torque), torque) - damping w,

which moves links, of mass matrix M, and rotors, of the hand's armature A. MuJoCo takes the damping at the end of its
step h: (M + A + h damping) a = s + g, with g what contacts and all else put on the joints. PyBullet knows no rotors and
takes torques as they are at the start of its own, shorter step d. It is given

    T = N (M + R)^-1 (s + g) - g    with R = A + damping (h + d) / 2,

where N is the mass matrix of its links: free joints then accelerate as MuJoCo's do, and T is s where nothing moves.
g is that of the step before, N times the acceleration that was seen less T. So that T soon settles where a contact
changes, links are given `LINKS` of R as inertia of their own, which is in N and not in M.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.hand import HandSpec

FINER = 4
"""PyBullet's steps in one of ours."""
LINKS = 0.3
"""Share of what rotor and damping add that is in the links; with more, T of a finger of three links would swing."""


def added_inertia(hand: HandSpec, timestep: float) -> float:
    """Return R, what rotor and damping add to a joint [kg m^2] in physics steps of a length [s]."""
    return hand.armature + hand.damping * timestep * (1 + 1 / FINER) / 2


@dataclass(frozen=True)
class Servos:
    """The servos of B hands of n joints."""

    stiffness: Array
    damping: Array
    torque: Array
    """Gain [N m/rad], damping [N m s/rad] and largest torque [N m] of each hand `(B, 1)`."""
    missing: Array
    """M + R - N `(B, n, n)` [kg m^2]: what the links have too little of, and between joints too much."""

    def wanted(self, worlds: NDArray[np.int64], targets: Array, angles: Array, speeds: Array) -> Array:
        """Return s `(K, n)` [N m] in some worlds."""
        most = self.torque[worlds]
        return np.clip(self.stiffness[worlds] * (targets - angles), -most, most) - self.damping[worlds] * speeds


def servos_of(hands: Sequence[HandSpec], timestep: float) -> Servos:
    """Return the servos of hands of the same joints, in physics steps of a length [s]."""
    numbers = np.array([[hand.stiffness, hand.damping, hand.torque, added_inertia(hand, timestep)] for hand in hands])
    own = np.zeros((hands[0].n_joints,) * 2)
    for place in hands[0].slices:
        after = np.arange(place.stop - place.start)[::-1]
        own[place, place] = np.minimum(after[:, None], after) + 1  # a link turns with all joints up to its own
    missing = numbers[:, 3, None, None] * (np.eye(len(own)) - LINKS * own)
    return Servos(numbers[:, :1], numbers[:, 1:2], numbers[:, 2:3], missing)
