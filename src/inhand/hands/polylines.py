"""Lines through points: curves as lines, lines joined to one, and the units of files that hold them."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array

CLOSE = 0.0003
"""How far the line through the points of a curve may be off it, as a share of the larger side.

The box of the points is a little smaller than the curve's, so after scaling to size 1 it may be three times that.
"""
SAME = 1e-6
"""Points nearer than this share of the larger side are one point."""
JOIN = 0.001
"""Ends that are farther apart than this share of the larger side do not meet."""
COARSE = 64
"""In how many steps a curve is looked at to learn how strongly it bends."""
EIGHTHS = 8
"""A curve's count of chords is a multiple of this, so that the quarters of an ellipse are among its points."""
LARGEST = 1e100
"""Coordinates that are larger cannot be squared safely, nor sizes that are smaller than its inverse."""
MOST = 10_000
"""Way-points of a CSV file, and lines and curves of a drawing, that a file may have (guessed)."""
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "pt": 0.0254 / 72, "pc": 0.0254 / 6, "px": 0.0254 / 96}
"""Metres in each unit; those of px are CSS's."""


def joined(lines: Sequence[Array]) -> Array:
    """Return lines `(N, 2)`, each of which begins where the one before ends, as one without repeated points.

    Raises:
        InputError: a jump.
    """
    points = np.concatenate(lines)
    size = np.ptp(points, axis=0).max()
    for one, other in pairwise(lines):
        gap = float(np.linalg.norm(other[0] - one[-1]))
        if gap > JOIN * size:
            (a, b), (c, d) = one[-1] * [1.0, -1.0] + 0.0, other[0] * [1.0, -1.0] + 0.0
            raise InputError(
                f"the path jumps from ({a:.6g}, {b:.6g}) to ({c:.6g}, {d:.6g}), {gap:.3g} of the file's units, but is"
                " to be one line: the hand cannot lift the object, and an outline has no holes; join the parts in the"
                " order in which to draw them, or put each into a file of its own"
            )
    return without_repeats(points)


def without_repeats(points: Array) -> Array:
    """Return points `(N, 2)` without those that repeat the one before; a last one on the first is exactly the first."""
    same = SAME * np.ptp(points, axis=0).max()
    far = np.linalg.norm(np.diff(points, axis=0), axis=-1) > same
    kept = points[np.concatenate([[True], far])]
    if np.linalg.norm(kept[-1] - kept[0]) <= same:
        kept[-1] = kept[0]
    return np.asarray(kept)


def curve_points(curve: Callable[[Array], Array], size: float = 1.0, close: float = CLOSE) -> Array:
    """Return points `(N, 2)` on a smooth curve, both ends among them; the line through them stays close to it.

    A chord over a step h of the parameter is off by at most h^2 / 8 times the largest second derivative.

    Args:
        curve: gives the positions `(N, 2)` at parameters `(N,)` from 0 to 1.
        size: larger side of the whole drawing, in the curve's unit.
        close: how far the line may be off, as a share of the size.
    """
    bends = np.diff(curve(np.linspace(0.0, 1.0, COARSE + 1)), 2, axis=0) * COARSE**2
    count = math.ceil(math.sqrt(np.linalg.norm(bends, axis=-1).max() / (8.0 * close * size)))
    chords = count if count <= 1 else EIGHTHS * math.ceil(count / EIGHTHS)
    return curve(np.linspace(0.0, 1.0, max(chords, 1) + 1))
