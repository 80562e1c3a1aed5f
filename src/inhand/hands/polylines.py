"""Lines from files, SVG, DXF or CSV: what drawings are traced along, and what outlines of objects are made of."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from inhand.columns import Columns, Header, read_columns
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.sizes import LENGTHS

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
TURNS = 10
"""Whole turns that a way-point may be from the start's angle (guessed)."""
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "pt": 0.0254 / 72, "pc": 0.0254 / 6, "px": 0.0254 / 96}
"""Metres in each unit; those of px are CSS's."""
SUFFIXES = (".svg", ".csv", ".dxf")
"""Endings of files with lines."""


@dataclass(frozen=True, eq=False)
class Polyline:
    """One line that never lifts."""

    points: Array
    """Corners and ends, and points on curves `(N, 2)`: x right, y up, in the file's unit."""
    unit: float | None
    """Metres in the file's unit; None where the file says none."""


def read_polyline(path: Path, what: str, close: float = CLOSE) -> Polyline:
    """Return the one line of an SVG or DXF file.

    Args:
        path: the file.
        what: what to call it where it cannot be used.
        close: how far the line may be off a curve, as a share of the larger side.

    Raises:
        InputError: the file cannot be used, or its lines do not meet.
    """
    kind = path.suffix.lower()
    if not path.is_file():
        raise InputError(f"{what}: there is no such file; give the path of a {kind} file that is there")
    try:
        if kind == ".svg":
            from inhand.hands.svg import svg_lines as read
        else:
            from inhand.hands.dxf import dxf_lines as read
        lines, unit = read(path, close)
        return Polyline(joined(lines), unit)
    except InputError as error:
        raise InputError(f"{what}: {error}") from error


def read_csv_poses(path: Path, what: str, unit: str | None = None, *, turns: bool = False) -> Array:
    """Return the rows of a CSV file as poses `(N, 3)` [m, m, rad].

    Its first line names the columns `x_mm` and `y_mm`, or `x` and `y` where a unit is given, and may name `theta_deg`
    where turns are allowed, in any order. Theta is not wrapped; without the column it is 0.

    Raises:
        InputError: no such file, no text, a column that is missing, unknown or there twice, or a row that is cut off or
            holds what is no finite number, or one too large to be meant.
    """
    x, y = ("x_mm", "y_mm") if unit is None else ("x", "y")
    scale = UNITS["mm" if unit is None else unit]
    found = read_columns(path, what, Header((x, y), ("theta_deg",) if turns else ()), MOST)
    count = len(found.columns[x])
    if count < 2:
        raise InputError(
            f"{what}, line {found.lines[-1]}: the file ends with {count} way-point{'s' * (count != 1)}; it needs two or"
            " more: add the missing ones"
        )
    for name in found.columns:
        angle = name == "theta_deg"
        most, words = (360.0 * TURNS, "deg") if angle else (LENGTHS[1] / scale, unit or "mm")
        _check_range(found, what, name, (most, words))
    theta = np.radians(found.columns.get("theta_deg", np.zeros(count)))
    # Divided where the file is in mm, which gives the float nearest to the number that was written.
    across = [found.columns[axis] / 1e3 if unit is None else found.columns[axis] * scale for axis in (x, y)]
    return np.column_stack([*across, theta])


def _check_range(found: Columns, what: str, name: str, bound: tuple[float, str]) -> None:
    """Refuse a number that is too large to be meant, by its line."""
    most, unit = bound
    beyond = np.flatnonzero(np.abs(found.columns[name]) > most)
    if len(beyond):
        line, value = found.lines[beyond[0]], found.columns[name][beyond[0]]
        raise InputError(
            f"{what}, line {line}: column {name} holds {value:g}; it may be {-most:,.6g} to {most:,.6g} {unit}: check"
            " the unit"
        )


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
                f"the path jumps from ({a:.6g}, {b:.6g}) to ({c:.6g}, {d:.6g}), {gap:.3g} of the file's units, and the"
                " hand cannot lift the object: join the parts into one line, in the order in which to draw them, or"
                " trace each from a file of its own"
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
