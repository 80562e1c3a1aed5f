"""Outlines of the laboratory's objects that are neither boxes nor round, for a size x by y [m].

Sizes are the laboratory's. Which way an object points, the trapezoid's short side and the depth of inward corners
are guessed: tips point away from the palm, the teardrop's along its longer size.
"""

from collections.abc import Callable

import numpy as np

from inhand.errors import InputError
from inhand.geometry import unit
from inhand.hands.outlines import Corners

SHORT_SIDE = 0.5
"""A trapezoid's short side against its long one (guessed: half a hexagon is 45 x 19.5 mm, the object 45 x 20)."""
WAIST = 0.7
"""An hourglass's waist against its width (guessed)."""
NOTCH = 0.1
"""How deep each side of a concave square bends inwards against its length (guessed)."""
ROUND = np.deg2rad(7.5)
"""Turn from one corner of a round side to the next [rad], as in the prisms of 48 sides."""


def triangle(x: float, y: float) -> Corners:
    """Return an isosceles triangle, its base of length x towards the palm."""
    return ((-x / 2, -y / 2), (x / 2, -y / 2), (0.0, y / 2))


def pentagon(x: float, y: float) -> Corners:
    """Return a pentagon, regular where x / y is 1.051, with a corner away from the palm."""
    corners = unit(np.pi / 2 + np.arange(5) * 2 * np.pi / 5) * [x, y]
    return tuple((float(a), float(b)) for a, b in corners)


def trapezoid(x: float, y: float) -> Corners:
    """Return a trapezoid, its long side x towards the palm."""
    short = SHORT_SIDE * x / 2
    return ((-x / 2, -y / 2), (x / 2, -y / 2), (short, y / 2), (-short, y / 2))


def teardrop(x: float, y: float) -> Corners:
    """Return a disc with a tip: the shorter size is the disc's diameter, the tip points along +x or +y.

    The tip's sides touch the disc at the angle arccos(r / d) from the tip, d the tip's distance from the middle.
    """
    if np.isclose(x, y):
        raise InputError(
            f"a teardrop of {1e3 * x:g} x {1e3 * y:g} mm has no tip; the shorter size is its disc's diameter: give two"
            " different sizes"
        )
    radius = min(x, y) / 2
    tip = max(x, y) - radius
    start = np.arccos(radius / tip)
    steps = np.arange(ROUND, 2 * np.pi, ROUND)
    angle = np.concatenate([[start], steps[np.abs(steps - np.pi) < np.pi - start - ROUND / 4], [2 * np.pi - start]])
    corners = np.concatenate([[(tip, 0.0)], radius * unit(angle)])
    if y > x:
        corners = np.stack([-corners[:, 1], corners[:, 0]], axis=-1)
    return tuple((float(a), float(b)) for a, b in corners)


def hourglass(x: float, y: float) -> Corners:
    """Return an hourglass, its waist across the hand."""
    waist = WAIST * x / 2
    return ((-x / 2, -y / 2), (x / 2, -y / 2), (waist, 0.0), (x / 2, y / 2), (-x / 2, y / 2), (-waist, 0.0))


def concave_square(x: float, y: float) -> Corners:
    """Return a square, each side of which bends inwards in its middle."""
    a, b = x / 2, y / 2
    inner_a, inner_b = a - NOTCH * x, b - NOTCH * y
    return ((-a, -b), (0.0, -inner_b), (a, -b), (inner_a, 0.0), (a, b), (0.0, inner_b), (-a, b), (-inner_a, 0.0))


FORMS: dict[str, Callable[[float, float], Corners]] = {
    "triangle": triangle,
    "teardrop": teardrop,
    "pentagon": pentagon,
    "trapezoid": trapezoid,
    "hourglass": hourglass,
    "concave_square": concave_square,
}
"""Outlines by the word for them."""
