"""What every figure shares: its colours, type sizes, and the look of a series."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from matplotlib.colors import to_hex, to_rgb

from inhand.errors import InputError
from inhand.geometry import Array

INK = "#1c2530"
"""Text and everything that must be read."""
MUTED = "#65707c"
"""Second-rank text: subtitles, tick labels, key lines."""
RULE = "#b9c1c9"
"""Axis lines."""
GRID = "#e8ebee"
"""Grid lines."""

TITLE_POINTS = 11.0
LABEL_POINTS = 9.5
TICK_POINTS = 9.0

Dashes: TypeAlias = Literal["-", "--", "-.", ":"]

DIRECTION_WHEEL = (
    ("tab:red", 0.0),
    ("tab:purple", 45.0),
    ("tab:blue", 90.0),
    ("tab:orange", 135.0),
    ("tab:pink", 180.0),
    ("tab:green", 225.0),
    ("tab:cyan", 270.0),
    ("tab:olive", 315.0),
)
"""Colours of the eight thesis directions by angle [deg], as the public Asterisk Test software draws them."""

OKLAB_CONE = np.array(
    [
        (0.4122214708, 0.5363325363, 0.0514459929),
        (0.2119034982, 0.6806995451, 0.1073969566),
        (0.0883024619, 0.2817188376, 0.6299787005),
    ]
)
"""Linear sRGB to cone response (Ottosson 2020, "A perceptual color space for image processing")."""
OKLAB_OPPONENT = np.array(
    [
        (0.2104542553, 0.7936177850, -0.0040720468),
        (1.9779984951, -2.4285922050, 0.4505937099),
        (0.0259040371, 0.7827717662, -0.8086757660),
    ]
)
"""Cube roots of cone response to lightness and the two opponent axes (same source)."""


@dataclass(frozen=True)
class SeriesLook:
    """How one series of several is drawn; colour, dash and marker all differ, so no reader needs the colour."""

    colour: str
    dashes: Dashes
    marker: str


SERIES_LOOKS = (
    SeriesLook("#0072b2", "-", "o"),
    SeriesLook("#d55e00", "--", "s"),
    SeriesLook("#009e73", "-.", "^"),
    SeriesLook("#cc79a7", ":", "D"),
    SeriesLook("#56b4e9", "-", "v"),
    SeriesLook("#4d4d4d", "--", "P"),
)
"""Okabe and Ito's colours, which people with the common colour-vision deficiencies can tell apart."""


def series_look(index: int) -> SeriesLook:
    """Return the look of series number `index`, counted from 0; after six they repeat."""
    return SERIES_LOOKS[index % len(SERIES_LOOKS)]


def direction_colour(angle_deg: float) -> str:
    """Return the colour `#rrggbb` of a direction [deg, counter-clockwise from +x].

    The eight thesis directions have the colours of the public software. Between two of them the colour is mixed
    in OKLab, with the chroma kept up and the lightness a little lower: a plain mix of two opposite colours is grey.

    Raises:
        InputError: the angle is not a finite number.
    """
    if not np.isfinite(angle_deg):
        raise InputError(f"direction angle {angle_deg} has no colour: give a finite angle in degrees")
    position = (float(angle_deg) % 360.0) / 45.0
    first = int(position) % len(DIRECTION_WHEEL)
    share = position - int(position)
    below = DIRECTION_WHEEL[first][0]
    if share < 1e-9:
        return to_hex(below)
    above = DIRECTION_WHEEL[(first + 1) % len(DIRECTION_WHEEL)][0]
    lab_below, lab_above = _oklab(below), _oklab(above)
    mixed = (1 - share) * lab_below + share * lab_above
    chroma = (1 - share) * np.hypot(*lab_below[1:]) + share * np.hypot(*lab_above[1:])
    mixed[1:] *= 0.85 * chroma / max(float(np.hypot(*mixed[1:])), 1e-6)
    mixed[0] -= 0.06 * np.sin(np.pi * share)
    return _hex(_from_oklab(mixed))


def darker(colour: str, share: float = 0.25) -> str:
    """Return `colour` mixed with `share` (0 to 1) of ink, for text that must be read on white."""
    return _hex((1 - share) * np.array(to_rgb(colour)) + share * np.array(to_rgb(INK)))


def _hex(rgb: Array) -> str:
    return to_hex((float(rgb[0]), float(rgb[1]), float(rgb[2])))


def _oklab(colour: str) -> Array:
    """Return lightness and the two opponent axes `(3,)` of a colour."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return np.asarray(OKLAB_OPPONENT @ np.cbrt(OKLAB_CONE @ linear))


def _from_oklab(lab: Array) -> Array:
    """Return the sRGB colour `(3,)` of OKLab values, cut to what a screen can show."""
    linear = np.linalg.solve(OKLAB_CONE, np.linalg.solve(OKLAB_OPPONENT, lab) ** 3)
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
