"""What a learned controller does: numbers within [-1, 1] for each joint, turned into joint targets."""

from __future__ import annotations

import reprlib
from typing import Literal

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.sim.state import State

Actions = Literal["angles", "steps", "fine"]
"""`angles`: joint targets over the joints' ranges (thesis 3.3.2). `steps`: how far the last targets move on.
`fine`: the same in small steps, with which chance holds the object for longer."""

LARGEST_STEP = 0.04
"""How far a step of 1 moves a joint target in one decision [rad]: 2 rad/s, guessed."""
FINE_STEP = 0.01
"""How far a fine step of 1 does [rad]: 0.5 rad/s, guessed; the expert's 40 mm/s take no more."""


def checked_actions(given: object, shape: tuple[int, ...]) -> Array:
    """Return actions as numbers `(B, n)`.

    Raises:
        InputError: no numbers, another shape, or one that is not finite.
    """
    try:
        found = np.asarray(given)
    except ValueError:
        found = np.asarray(None)
    if found.dtype.kind not in "fiu":
        raise InputError(f"actions {reprlib.repr(given)}: give numbers {shape} within [-1, 1]")
    if found.shape != shape:
        raise InputError(
            f"actions of shape {found.shape}; {shape[0]} worlds need {shape}, a number within [-1, 1] for each joint"
        )
    if not np.isfinite(found).all():
        world, joint = np.argwhere(~np.isfinite(found))[0]
        raise InputError(f"the action of joint {joint} in world {world} is {found[world, joint]}; give one in [-1, 1]")
    return found.astype(float)


def largest_step(kind: Actions) -> float:
    """Return how far an action of 1 moves a joint target in one decision, where actions are steps [rad]."""
    return FINE_STEP if kind == "fine" else LARGEST_STEP


def targets_of(actions: Array, kind: Actions, hand: HandSpec, state: State) -> Array:
    """Return joint targets `(B, n)` [rad] of actions `(B, n)`, which are cut to [-1, 1]."""
    cut, limits = np.clip(actions, -1.0, 1.0), hand.limits
    if kind == "angles":
        return np.asarray(limits[:, 0] + (cut + 1.0) / 2.0 * np.ptp(limits, axis=-1))
    return np.asarray(np.clip(state.targets + largest_step(kind) * cut, limits[:, 0], limits[:, 1]))


def actions_of(targets: Array, kind: Actions, hand: HandSpec, state: State) -> Array:
    """Return the actions `(B, n)` within [-1, 1] that come nearest to commanding joint targets `(B, n)` [rad]."""
    limits = hand.limits
    if kind == "angles":
        return np.asarray(np.clip(2.0 * (targets - limits[:, 0]) / np.ptp(limits, axis=-1) - 1.0, -1.0, 1.0))
    return np.asarray(np.clip((targets - state.targets) / largest_step(kind), -1.0, 1.0))
