"""Span and depth of the hands by which the recordings of 2020 are divided."""

import numpy as np
from numpy.typing import ArrayLike

from inhand.errors import InputError, near_matches
from inhand.geometry import Array

HAND_SIZES_MM = {
    "modelvf": (80.0, 115.0),
    "basic": (82.0, 110.0),
    "m2stiff": (85.0, 105.0),
    "palm1r": (110.0, 122.0),
    "m2active": (130.0, 110.0),
    "2v2": (170.0, 135.0),
    "2v3": (195.0, 140.0),
    "3v3": (210.0, 140.0),
    "barrett": (230.0, 110.0),
    "palm2r": (261.0, 115.0),
}
"""Span (along x) and depth (along y) of each hand [mm], from the public Asterisk Test software."""


def hand_size_mm(hand: str) -> tuple[float, float]:
    """Return span and depth [mm] of a hand of the Asterisk Test.

    Raises:
        InputError: the table has no such hand.
    """
    size = HAND_SIZES_MM.get(hand.lower())
    if size is None:
        raise InputError(
            f"no size known for hand {hand!r}: sizes are known for {', '.join(HAND_SIZES_MM)}"
            f"{near_matches(hand, HAND_SIZES_MM)}; use one of these names, or a recording in mm"
        )
    return size


def normalise(path_mm: ArrayLike, hand: str) -> Array:
    """Return a path `(T, 2)` divided by the span (x) and the depth (y) of a hand.

    Different lengths along x and y bend diagonals (45 deg becomes 51.5 deg on the 2v2 hand): normalised values
    are for comparison with published ones only.

    Raises:
        InputError: no size is known for the hand.
    """
    size = np.array(hand_size_mm(hand))
    return np.asarray(np.asarray(path_mm, dtype=float) / size)
