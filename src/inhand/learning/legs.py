"""Primitives that follow one another within an episode, as in a sequence: without a pause, from where the object is.

A leg is x, y [m] and an angle [rad]. Where the angle is not 0 the object is to turn on the spot by it, elsewhere to go
straight to that place in the palm frame. NaN is no leg.
"""

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import TURN_ARM, Array, Path
from inhand.hands.fit import Held
from inhand.tasks.observations import Aim
from inhand.tracing import tasks
from inhand.tracing.plan import STEP
from inhand.tracing.walk import SequenceConfig

LEGS = 5
"""Legs after an episode's first primitive: as many as its time allows."""
SHARE = 0.6
"""Share of the hand's reach in which places are drawn: that of drawings without a size."""
TURNING = 0.25
"""Share of the legs that turn,"""
FARTHEST_TURN = float(np.deg2rad(32.0))
"""to an angle of at most this from the start's [rad]: tasks ask for 30 deg."""
ARRIVE, ARRIVE_TURN = SequenceConfig.arrive, TURN_ARM * SequenceConfig.arrive_turn
"""An object has come to the end of a leg within this [m], as in a sequence."""


def drawn_legs(held: Held, count: int, rng: np.random.Generator) -> Array:
    """Return the legs of `count` episodes `(count, LEGS, 3)`."""
    places = held.start[:2] + tasks.draw_points(held, count * LEGS, rng, SHARE).reshape(count, LEGS, 2)
    angles = rng.uniform(-FARTHEST_TURN, FARTHEST_TURN, (count, LEGS))
    turning = rng.random((count, LEGS)) < TURNING
    legs, now = np.zeros((count, LEGS, 3)), np.zeros(count)
    for k in range(LEGS):
        legs[:, k, :2] = places[:, k]
        legs[:, k, 2] = np.where(turning[:, k], angles[:, k] - now, 0.0)
        now = np.where(turning[:, k], angles[:, k], now)
    return legs


def around(held: Held) -> Array:
    """Return the path `(S, 3)` about the start along the edge of where places are drawn, for which legs are gripped."""
    angles, reach = tasks.edge(held)
    corners = SHARE * reach[:, None] * np.stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))], axis=-1)
    edge = Path(held.start + np.concatenate([np.zeros((1, 3)), corners, corners[:1], np.zeros((1, 3))]))
    return np.stack([edge.at(way) for way in np.arange(0.0, float(edge.length), STEP)])


def due(aim: Aim, pose: Array, legs: Array, number: NDArray[np.int64]) -> tuple[NDArray[np.bool_], Array]:
    """Return which objects at poses `(B, 3)` have come to the end of what is asked and have more to do `(B,)`.

    With it comes the leg that is next for each `(B, 3)`, of legs `(B, L, 3)` that of a `number`.
    """
    worlds, count = np.arange(len(legs)), legs.shape[1]
    leg = legs[worlds, np.minimum(number, count - 1)]
    come = aim.left(pose) < np.where(aim.turn == 0, ARRIVE, ARRIVE_TURN)
    return come & (number < count) & ~np.isnan(leg[:, 0]), leg


def next_aim(aim: Aim, pose: Array, legs: Array, due: NDArray[np.bool_]) -> Aim:
    """Return aims in which those that are `due` `(B,)` are their legs `(B, 3)`, the others as they were.

    Legs begin where objects are `(B, 3)`, which are to stay turned as the aims before end.
    """
    start = np.concatenate([pose[:, :2], aim.start[:, 2:] + turned_by(aim)[:, None]], axis=-1)
    turning, way = legs[:, 2] != 0, legs[:, :2] - pose[:, :2]
    distance = np.where(turning, TURN_ARM * np.abs(legs[:, 2]), np.linalg.norm(way, axis=-1))
    angle = np.where(turning, 0.0, np.arctan2(way[:, 1], way[:, 0]))
    turn = np.where(turning, np.sign(legs[:, 2]), 0.0)
    angle, distance, turn = (
        np.where(due, new, old) for new, old in ((angle, aim.angle), (distance, aim.distance), (turn, aim.turn))
    )
    return Aim(angle, np.where(due[:, None], start, aim.start), distance, turn=turn)


def turned_by(aim: Aim) -> Array:
    """Return by how much aims turn an object in all `(B,)` [rad]; 0 of those that move it."""
    return np.asarray(np.where(aim.turn == 0, 0.0, aim.turn * aim.distance / TURN_ARM))
