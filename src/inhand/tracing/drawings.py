"""Drawings by name: shapes, letters, and the files that people draw in."""

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array, unit
from inhand.hands.line_files import SUFFIXES, read_csv_poses, read_polyline
from inhand.hands.polylines import curve_points
from inhand.hands.sizes import LENGTHS, check_length
from inhand.tracing.drawing import Drawing, larger_side, scaled, unit_drawing
from inhand.tracing.letters import HEIGHT, LETTERS, Arc, Stroke


def find_drawing(text: str) -> Drawing:
    """Return the drawing that a text names.

    Args:
        text: A shape (square, triangle, circle, figure-eight, star; also `figure eight`, `eight` or `8`), a letter A
            to Z in either case (also `letter A`), or the path of a .svg, .csv or .dxf file.

    Raises:
        InputError: it is none of these (the text offers the nearest), or the file cannot be used.
    """
    word = re.sub(r"[\s_-]+", "-", text.strip().lower())
    word = OTHER_NAMES.get(word, word)
    if word in SHAPES:
        return unit_drawing(word, SHAPES[word]())
    letter = re.fullmatch(r"(?:letter-)?([a-z])", word)
    if letter is not None:
        name = letter.group(1).upper()
        return unit_drawing(f"letter {name}", stroke_points(LETTERS[name], HEIGHT))
    if Path(text).suffix.lower() in SUFFIXES:
        return read_drawing(Path(text))
    near = near_matches(word, (*SHAPES, *OTHER_NAMES))
    raise InputError(
        f"unknown drawing {text!r}{near}; allowed are {', '.join(SHAPES)}, a single letter A to Z, or the path of a"
        " .svg, .csv or .dxf file"
    )


def read_drawing(path: Path) -> Drawing:
    """Return the drawing of a file.

    That of a CSV file has its size and its angles: each row is a way-point relative to the object's start, x to the
    right, y away from the palm, theta counter-clockwise. That of an SVG or DXF file has theta 0, and a size where the
    file says how large it is, around the object's start.

    Raises:
        InputError: the file cannot be used, or its way-points are nearly at one place, as those in metres would be.
    """
    what = f"drawing {path}"
    if path.suffix.lower() == ".csv":
        drawing = Drawing(path.stem, read_csv_poses(path, what, turns=True), sized=True)
        if 0.0 < (side := larger_side(drawing)) < LENGTHS[0]:
            cure = "x_mm and y_mm are in mm (1 m is 1000, 1 inch is 25.4)"
            check_length(f"{what}: the larger side of its way-points", side, cure)
        return drawing
    line = read_polyline(path, what)
    drawing = unit_drawing(path.stem, line.points)
    if line.unit is None:
        return drawing
    return scaled(drawing, line.unit * float(np.ptp(line.points, axis=0).max()))


def stroke_points(stroke: Stroke, size: float) -> Array:
    """Return the points `(N, 2)` of a stroke whose larger side is about `size`, in the stroke's unit."""
    return np.concatenate([_arc_points(each, size) if isinstance(each, Arc) else np.array([each]) for each in stroke])


def _arc_points(arc: Arc, size: float) -> Array:
    def curve(share: Array) -> Array:
        angle = np.radians(arc.start_deg + share * (arc.end_deg - arc.start_deg))
        return np.array([arc.x, arc.y]) + unit(angle) * [arc.rx, arc.ry]

    return curve_points(curve, size)


def _closed(corners: Sequence[tuple[float, float]] | Array) -> Array:
    return np.array([*corners, corners[0]])


def _star() -> Array:
    """Return the outline of a pentagram from its upper tip, counter-clockwise."""
    inner = math.sin(math.radians(18)) / math.sin(math.radians(54))
    radii = np.tile([1.0, inner], 5)
    return _closed(radii[:, None] * unit(np.pi / 2 + np.arange(10) * np.pi / 5))


SHAPES: dict[str, Callable[[], Array]] = {
    # Polygons from their lower left corner, round ones from the right or the middle, all counter-clockwise.
    "square": lambda: _closed([(0, 0), (1, 0), (1, 1), (0, 1)]),
    "triangle": lambda: _closed([(0, 0), (1, 0), (0.5, math.sqrt(0.75))]),
    "circle": lambda: stroke_points((Arc(0, 0, 0.5, 0.5, 0, 360),), 1.0),
    # Gerono's lemniscate, lying on its side.
    "figure-eight": lambda: curve_points(
        lambda t: np.column_stack([np.sin(2 * np.pi * t) / 2, np.sin(4 * np.pi * t) / 4])
    ),
    "star": _star,
}
"""The named shapes: what gives the points `(N, 2)` of each, at any size and place."""
OTHER_NAMES = {"eight": "figure-eight", "8": "figure-eight"}
"""Other words for shapes; spaces, underscores and hyphens in a word are alike."""
