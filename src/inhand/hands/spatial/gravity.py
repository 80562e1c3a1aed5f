"""Which way gravity pulls in the palm frame: by how the palm is held, or along any vector."""

import math
import re

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.hands.spatial.hand import Vector

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""
PALMS: dict[str, Vector] = {"up": (0.0, 0.0, -1.0), "down": (0.0, 0.0, 1.0), "sideways": (0.0, -1.0, 0.0)}
"""Where gravity points by where the palm looks: up (the object lies above it), down (below it), or to the side, with
the hand's +y up."""
USUAL_PALM = "up"
"""How the palm is held where nothing is asked for."""
SHORTEST = 1e-9
"""A vector shorter than this has no direction."""


def gravity_of(word: str) -> Vector:
    """Return gravity in the palm frame [m/s^2] of `up`, `down`, `sideways` or a vector along which it pulls.

    A vector is three numbers in the palm frame, as `0,-1,-1` or `0:-1:-1`; its length does not count.

    Raises:
        InputError: no such word, no three finite numbers, or a vector of no length or one too large to compute with.
    """
    known = word.strip().lower().removeprefix("palm-")
    if known in PALMS:
        x, y, z = PALMS[known]
        return (GRAVITY * x, GRAVITY * y, GRAVITY * z)
    try:
        numbers = [float(each) for each in re.split(r"[,:\s]+", word.strip())]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not math.isfinite(sum(part * part for part in numbers)):
        raise InputError(
            f"gravity {word!r}{near_matches(known, PALMS)}; allowed are {', '.join(PALMS)} (where the palm looks) or"
            " three numbers in the palm frame along which it pulls, such as 0,-1,-1"
        )
    length = float(np.linalg.norm(numbers))
    if length < SHORTEST:
        raise InputError(f"gravity {word!r} has no length, so it pulls nowhere: give a direction such as 0,0,-1")
    x, y, z = (GRAVITY * number / length for number in numbers)
    return (x, y, z)


def gravity_name(gravity: Vector) -> str:
    """Return the word of a gravity [m/s^2], or its vector where there is none."""
    for word in PALMS:
        if np.allclose(gravity, gravity_of(word), rtol=0.0, atol=1e-6):
            return word
    return ",".join(f"{part:g}" for part in gravity)
