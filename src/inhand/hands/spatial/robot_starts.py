"""Where an object starts between the fingers of a robot's hand: where they can follow it farthest in all directions."""

import numpy as np

from inhand.geometry import Array
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.hand import SpatialHand, Vector

POSTURES = 1500
"""Postures that are drawn, the same in every call."""
CENTRES = 200
"""Points that are tried, drawn among the middles of all tips."""
OBJECT = 0.02
"""Half the size of an object that the hand is meant for [m], guessed."""
NEAR = 0.008
"""How far a tip may be from touching it to count [m]."""
MOVES = (0.0, 0.02, 0.04)
"""How far it is moved along each axis, to see whether the tips still find it [m]."""
HEIGHT = 0.005
"""How far the object keeps off the palm [m]."""


def best_start(hand: SpatialHand) -> Vector:
    """Return the point from which a ball of `OBJECT`, moved along each axis, is best touched by every finger.

    A place is worth the logarithm of the number of postures, among many drawn evenly, in which the finger that has the
    fewest touches the ball there; a point is worth the least of the six places at each distance. So it lies in the
    middle of what the fingers reach together.
    """
    rng = np.random.default_rng(0)
    low, high = hand.limits.T
    tips = kinematics.place(hand, low + rng.random((POSTURES, hand.n_joints)) * (high - low)).tips
    centres = tips.mean(axis=1)[rng.permutation(POSTURES)[:CENTRES]]
    best = centres[_worth(hand, tips, centres).argmax()]
    near = np.concatenate([best[None], best + NEAR * rng.standard_normal((CENTRES // 4, 3))])
    x, y, z = near[_worth(hand, tips, near).argmax()].round(4).tolist()
    return (x, y, z)


def _worth(hand: SpatialHand, tips: Array, centres: Array) -> Array:
    """Return what each centre is worth `(C,)`; nothing too near to the palm."""
    radii = np.array([finger.tip_radius for finger in hand.fingers])
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    worth = np.zeros(len(centres))
    for move in MOVES:
        places = centres[:, None] + (move * axes if move else np.zeros((1, 3)))
        counts = []
        for f, radius in enumerate(radii):
            square = ((places[:, :, None] - tips[None, None, :, f]) ** 2).sum(axis=-1)
            touching = (square > (OBJECT + radius - NEAR) ** 2) & (square < (OBJECT + radius + NEAR) ** 2)
            counts.append(touching.sum(axis=-1))
        worth += np.log1p(np.min(counts, axis=0)).min(axis=-1)
    return np.where(centres[:, 2] - OBJECT > hand.palm.top + HEIGHT, worth, -1.0)
