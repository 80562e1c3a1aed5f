"""Rewards of reaching a goal: pure functions of where the object is and where it should be."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inhand.geometry import TURN_ARM, Array, wrap_angle

GoalReward = Literal["sparse", "dense"]
"""`sparse`: -1 until the goal is reached, then 0. `dense`: the way left, counted negative in centimetres."""


def away_from_goal(achieved: ArrayLike, desired: ArrayLike) -> tuple[Array, Array]:
    """Return distance `(...)` [m] and turn `(...)` [rad] between planar poses `(..., 3)` [m, m, rad]."""
    difference = np.asarray(desired, dtype=float) - np.asarray(achieved, dtype=float)
    return np.hypot(difference[..., 0], difference[..., 1]), np.abs(wrap_angle(difference[..., 2]))


def goal_reached(achieved: ArrayLike, desired: ArrayLike, tolerance: tuple[float, float]) -> NDArray[np.bool_]:
    """Return whether poses `(..., 3)` are within a distance [m] and a turn [rad] of their goals `(...)`."""
    distance, turn = away_from_goal(achieved, desired)
    return np.asarray((distance <= tolerance[0]) & (turn <= tolerance[1]))


def goal_reward(achieved: ArrayLike, desired: ArrayLike, tolerance: tuple[float, float], kind: GoalReward) -> Array:
    """Return the rewards `(...)` of poses `(..., 3)` for goals `(..., 3)`, of one world or of any batch.

    Args:
        achieved: planar poses of the object [m, m, rad].
        desired: where it should be.
        tolerance: distance [m] and turn [rad] within which a goal counts as reached.
        kind: `sparse` gives 0 within the tolerance and -1 elsewhere; `dense` gives -1 for each centimetre left, where
            a turn counts as an arc at `TURN_ARM`.
    """
    if kind == "sparse":
        return np.asarray(goal_reached(achieved, desired, tolerance).astype(float) - 1.0)
    distance, turn = away_from_goal(achieved, desired)
    return np.asarray(-100.0 * (distance + TURN_ARM * turn))
