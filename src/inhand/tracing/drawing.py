"""A drawing: the way-points of one stroke that never lifts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array

CLOSE = 0.0003
"""How far the line through the points of a curve may be off it, as a share of the drawing's larger side.

The box of the points is a little smaller than the curve's, so after scaling to size 1 it may be three times that.
"""
SAME = 1e-6
"""Points nearer than this share of the larger side are one point."""
COARSE = 64
"""In how many steps a curve is looked at to learn how strongly it bends."""
EIGHTHS = 8
"""A curve's count of chords is a multiple of this, so that the quarters of an ellipse are among its points."""


@dataclass(frozen=True, eq=False)
class Drawing:
    """One stroke to trace."""

    name: str
    """What it shows: `square`, `letter A`, or the stem of its file's name."""
    poses: Array
    """Way-points `(N, 3)` in order: x, y, theta [rad]; x right, y away from the palm."""
    sized: bool
    """True: x and y are metres. False: a size has yet to be chosen.

    A drawing with a size is a CSV file's, relative to the object's start, or was scaled. Without one the larger side of
    its bounding box is 1 and the box's middle at the origin.
    """


def scaled(drawing: Drawing, size: float) -> Drawing:
    """Return a drawing with its larger side `size` long, in metres; angles stay.

    One without a size keeps its middle at the origin. One with a size is scaled about its origin, from which its
    way-points count: the object's start.

    Args:
        drawing: What to scale.
        size: Larger side of the bounding box of its way-points [m].

    Raises:
        InputError: the size is not positive and finite, or all way-points are at one place.
    """
    if not (math.isfinite(size) and size > 0.0):
        raise InputError(f"size {size:g} of drawing {drawing.name!r}: give a positive, finite number of metres")
    side = larger_side(drawing)
    if not side > 0.0:
        raise InputError(
            f"drawing {drawing.name!r} has no extent: all its {len(drawing.poses)} way-points are at one place (x, y);"
            " leave its size as it is, or take a drawing that goes somewhere"
        )
    about = np.zeros(2) if drawing.sized else _middle(drawing.poses[:, :2])
    points = about + (drawing.poses[:, :2] - about) * (size / side)
    return replace(drawing, poses=np.column_stack([points, drawing.poses[:, 2]]), sized=True)


def larger_side(drawing: Drawing) -> float:
    """Return the larger side of the way-points' bounding box: metres, or 1 where a size has yet to be chosen."""
    return float(np.ptp(drawing.poses[:, :2], axis=0).max())


def unit_drawing(name: str, points: Array) -> Drawing:
    """Return the drawing through points `(N, 2)`, not all in one place, at size 1 around the origin, theta 0.

    Points that repeat the one before are left out; a last point on the first becomes exactly the first.
    """
    side = np.ptp(points, axis=0).max()
    far = np.linalg.norm(np.diff(points, axis=0), axis=-1) > SAME * side
    flat = (points[np.concatenate([[True], far])] - _middle(points)) / side
    if np.linalg.norm(flat[-1] - flat[0]) <= SAME:
        flat[-1] = flat[0]
    return Drawing(name, np.column_stack([flat, np.zeros(len(flat))]), sized=False)


def curve_points(curve: Callable[[Array], Array], size: float = 1.0) -> Array:
    """Return points `(N, 2)` on a smooth curve, both ends among them; the line through them stays `CLOSE` to it.

    A chord over a step h of the parameter is off by at most h^2 / 8 times the largest second derivative.

    Args:
        curve: Gives the positions `(N, 2)` at parameters `(N,)` from 0 to 1.
        size: Larger side of the whole drawing, in the curve's unit.
    """
    bends = np.diff(curve(np.linspace(0.0, 1.0, COARSE + 1)), 2, axis=0) * COARSE**2
    count = math.ceil(math.sqrt(np.linalg.norm(bends, axis=-1).max() / (8.0 * CLOSE * size)))
    chords = count if count <= 1 else EIGHTHS * math.ceil(count / EIGHTHS)
    return curve(np.linspace(0.0, 1.0, max(chords, 1) + 1))


def _middle(points: Array) -> Array:
    """Return the middle `(2,)` of the bounding box of points `(N, 2)`."""
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)
