"""Lines from files, SVG, DXF or CSV: what drawings are traced along, and what outlines of objects are made of."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from inhand.columns import Columns, Header, read_columns
from inhand.errors import InputError
from inhand.folders import is_file
from inhand.geometry import Array
from inhand.hands.dxf import dxf_lines
from inhand.hands.polylines import CLOSE, MOST, UNITS, joined
from inhand.hands.sizes import LENGTHS

TURNS = 10
"""Whole turns that a way-point may be from the start's angle (guessed)."""
OUTLINE_CLOSE = 0.001
"""How far an outline may be off its curves, as a share of its larger side; a circle has 64 corners (guessed)."""
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
    if not is_file(path):
        raise InputError(f"{what}: there is no such file; give the path of a {kind} file that is there")
    try:
        lines, unit = _reader(kind)(path, close)
        return Polyline(joined(lines), unit)
    except InputError as error:
        raise InputError(f"{what}: {error}") from error


def _reader(kind: str) -> Callable[[Path, float], tuple[list[Array], float | None]]:
    """Return what reads the lines of a kind of file; what reads SVG is slow to import, and few runs need it."""
    if kind != ".svg":
        return dxf_lines
    from inhand.hands.svg import svg_lines

    return svg_lines


def read_outline(path: Path, unit: str | None = None) -> Array:
    """Return the corners `(N, 2)` [m] of the outline that the one line of a file is.

    Args:
        path: a .svg, .dxf or .csv file.
        unit: one of `UNITS`, of the file's numbers; None for what the file says.

    Raises:
        InputError: the file cannot be used, or nobody says its unit.
    """
    what = f"outline {path}"
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{what}: unknown ending {path.suffix!r}; allowed are {', '.join(SUFFIXES)}")
    if path.suffix.lower() == ".csv":
        return read_csv_poses(path, what, unit)[:, :2]
    line = read_polyline(path, what, OUTLINE_CLOSE)
    scale = line.unit if unit is None else UNITS[unit]
    if scale is None:
        raise InputError(
            f'{what}: it says no unit; give that of its numbers, as unit = "mm" in the object\'s file, or :unit=mm'
            f" after this file's name; allowed are {', '.join(UNITS)}"
        )
    return line.points * scale


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
