"""What a learned controller does: numbers within [-1, 1] for each joint, turned into joint targets."""

from __future__ import annotations

from typing import Literal

import numpy as np

from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.sim.state import State

Actions = Literal["angles", "steps"]
"""`angles`: joint targets over the joints' ranges (thesis 3.3.2). `steps`: how far the last targets move on."""

LARGEST_STEP = 0.04
"""How far a step of 1 moves a joint target in one decision [rad]: 2 rad/s, guessed."""


def targets_of(actions: Array, kind: Actions, hand: HandSpec, state: State) -> Array:
    """Return joint targets `(B, n)` [rad] of actions `(B, n)`, which are cut to [-1, 1]."""
    cut, limits = np.clip(actions, -1.0, 1.0), hand.limits
    if kind == "angles":
        return np.asarray(limits[:, 0] + (cut + 1.0) / 2.0 * np.ptp(limits, axis=-1))
    return np.asarray(np.clip(state.targets + LARGEST_STEP * cut, limits[:, 0], limits[:, 1]))


def actions_of(targets: Array, kind: Actions, hand: HandSpec, state: State) -> Array:
    """Return the actions `(B, n)` within [-1, 1] that come nearest to commanding joint targets `(B, n)` [rad]."""
    limits = hand.limits
    if kind == "angles":
        return np.asarray(np.clip(2.0 * (targets - limits[:, 0]) / np.ptp(limits, axis=-1) - 1.0, -1.0, 1.0))
    return np.asarray(np.clip((targets - state.targets) / LARGEST_STEP, -1.0, 1.0))
