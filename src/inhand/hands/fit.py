"""Whether an object fits into a hand at its start."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import FINGER_NAMES, HandSpec
from inhand.hands.objects import ObjectSpec, polygon
from inhand.hands.touch import touch


class Held(NamedTuple):
    """Which object is in which hand."""

    hand: HandSpec
    object: ObjectSpec

    @property
    def start(self) -> Array:
        """Pose in which the object starts `(3,)` [m, m, rad]."""
        return self.hand.start_pose


ROOM = 0.003
"""Room that a fingertip needs beside the object before it closes [m]."""
PLACES = 5
"""Places along the middle half of an object's sides at which fingertips are tried: joints with limits may not bring
both to the very middle."""


def widest_opening(hand: HandSpec, sides: tuple[float, float] = (0.0, 0.0)) -> float:
    """Return the widest object [m] that both fingertips can straddle at the start with `ROOM` beside each.

    They do so at the same height of its sides, which go from one place along y to another, both from its middle [m].
    """
    coarse = _widest(hand, np.arange(1e-3, hand.finger_length + hand.palm_width, 1e-3), sides)
    if not coarse:
        return 0.0
    return max(2 * _widest(hand, coarse + np.arange(0.0, 1e-3, 1e-4), sides) - 2 * ROOM, 0.0)


def _widest(hand: HandSpec, half: Array, sides: tuple[float, float]) -> float:
    """Return the largest of half widths `(N,)` [m] to which both fingertips come at one of `PLACES`, or 0."""
    height = np.repeat(np.unique(np.linspace(*sides, PLACES) / 2), len(half))
    half = np.resize(half, len(height))
    return float(half[_straddled(hand, half, height)].max(initial=0.0))


def _straddled(hand: HandSpec, half: Array, height: Array) -> NDArray[np.bool_]:
    """Return whether the fingertips come so far to both sides of the start `(N,)` [m], so far along y from it [m]."""
    reached = []
    for sign, finger in zip((-1.0, 1.0), hand.fingers, strict=True):
        points = np.stack([sign * half, height], axis=-1) + np.array(hand.start_position)
        reached.append(touch(hand, finger, points, np.tile([sign, 0.0], (len(half), 1))).reached)
    return np.asarray(reached[0] & reached[1])


def check_fit(hand: HandSpec, spec: ObjectSpec) -> None:
    """Refuse an object that the open hand cannot take in at the start.

    Raises:
        InputError: the object is wider than the hand opens, or reaches into the palm; the text gives the largest
            size that fits.
    """
    corners = polygon(spec)
    width = float(np.ptp(corners[:, 0]))
    # Most objects fit at their very middle, which is soon seen.
    fits = _straddled(hand, np.array([width / 2 + ROOM]), np.zeros(1))[0]
    widest = width if fits else widest_opening(hand, (float(corners[:, 1].min()), float(corners[:, 1].max())))
    if width > widest:
        wide = f"a narrower object or a wider hand ({' and '.join(FINGER_NAMES)} finger straddle the object along x)"
        raise InputError(
            f"object {spec.name!r} is {1e3 * width:.1f} mm wide; hand {hand.name!r} opens to {1e3 * widest:.1f}"
            f" mm at the start: use {wide if widest else _other_limits(hand)}"
        )
    deepest = 2 * hand.start_position[1]
    depth = -2 * float(corners[:, 1].min())
    if depth >= deepest:
        raise InputError(
            f"object {spec.name!r} is {1e3 * depth:.1f} mm deep and reaches into the palm of {hand.name!r}, which"
            f" leaves {1e3 * deepest:.1f} mm at the start: use an object less deep along y"
        )


def _other_limits(hand: HandSpec) -> str:
    """Return what to use instead of joint limits with which fingertips never come to both sides of the start."""
    told = (
        f"{name} {', '.join(f'{low:.4g} to {high:.4g}' for low, high in np.rad2deg(finger.limits))}"
        for name, finger in zip(FINGER_NAMES, hand.fingers, strict=True)
    )
    return (
        f"other joint limits than {'; '.join(told)} deg, which keep the fingertips from its sides: limits_deg is in"
        " degrees, and a left finger bends inwards below 0, a right one above"
    )
