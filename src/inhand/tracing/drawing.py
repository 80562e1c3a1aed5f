"""A drawing: the way-points of one stroke that never lifts."""

import math
from dataclasses import dataclass, replace

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.polylines import without_repeats
from inhand.hands.sizes import check_length
from inhand.tracing.poses import places


@dataclass(frozen=True, eq=False)
class Drawing:
    """One stroke to trace."""

    name: str
    """What it shows: `square`, `letter A`, or the stem of its file's name."""
    poses: Array
    """Way-points `(N, 3)` in order: x, y, theta [rad], x right, y away from the palm; or those of space `(N, 6)`."""
    sized: bool
    """True: x and y are metres. False: a size has yet to be chosen.

    A drawing with a size was scaled, or its file says how large it is; a CSV file's is relative to the object's start.
    Any other has its box's middle at the origin, and without a size the box's larger side is 1.
    """


def scaled(drawing: Drawing, size: float) -> Drawing:
    """Return a drawing with the larger side of its way-points `size` long, in metres; angles stay.

    One without a size keeps its middle at the origin. One with a size is scaled about its origin, from which its
    way-points count: the object's start.

    Raises:
        InputError: a size that no drawing can have, or all way-points are at one place.
    """
    if not 0.0 < size < math.inf:
        raise InputError(f"size {size:g} of drawing {drawing.name!r}: give a positive, finite number of metres")
    check_length(f"the size of drawing {drawing.name!r}", size, "--size and files give mm, Python gives metres")
    side = larger_side(drawing)
    if not side > 0.0:
        axes = " (x, y)" if drawing.poses.shape[1] == 3 else ""
        raise InputError(
            f"drawing {drawing.name!r} has no extent: all its {len(drawing.poses)} way-points are at one place{axes};"
            " leave its size as it is, or take a drawing that goes somewhere"
        )
    first = places(drawing.poses.shape[1])
    points, turned = drawing.poses[:, :first], drawing.poses[:, first:]
    about = np.zeros(first) if drawing.sized else _middle(points)
    return replace(drawing, poses=np.column_stack([about + (points - about) * (size / side), turned]), sized=True)


def larger_side(drawing: Drawing) -> float:
    """Return the larger side of the way-points' bounding box: metres, or 1 where a size has yet to be chosen."""
    return float(np.ptp(drawing.poses[:, : places(drawing.poses.shape[1])], axis=0).max())


def unit_drawing(name: str, points: Array) -> Drawing:
    """Return the drawing through points `(N, 2)`, not all in one place, at size 1 around the origin, theta 0.

    Points that repeat the one before are left out; a last point on the first becomes exactly the first.
    """
    flat = (without_repeats(points) - _middle(points)) / np.ptp(points, axis=0).max()
    return Drawing(name, np.column_stack([flat, np.zeros(len(flat))]), sized=False)


def _middle(points: Array) -> Array:
    """Return the middle `(2,)` of the bounding box of points `(N, 2)`."""
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)
