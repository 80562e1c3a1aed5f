"""Drawings by name: shapes, letters, and the files that people draw in."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array, unit
from inhand.tracing.drawing import Drawing, curve_points, unit_drawing
from inhand.tracing.letters import HEIGHT, LETTERS, Arc, Stroke
from inhand.tracing.path_files import read_csv, read_svg


def find_drawing(text: str) -> Drawing:
    """Return the drawing that a text names.

    Args:
        text: A shape (square, triangle, circle, figure-eight, star; also `figure eight`, `eight` or `8`), a letter A
            to Z in either case (also `letter A`), or the path of a .svg or .csv file.

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
    suffix = Path(text).suffix.lower()
    if suffix in {".svg", ".csv"}:
        return (read_svg if suffix == ".svg" else read_csv)(Path(text))
    near = near_matches(word, (*SHAPES, *OTHER_NAMES))
    raise InputError(
        f"unknown drawing {text!r}{near}; allowed are {', '.join(SHAPES)}, a single letter A to Z, or the path of a"
        " .svg or .csv file"
    )


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


def _square() -> Array:
    """Return the corners from the one at the lower left, counter-clockwise."""
    return _closed([(0, 0), (1, 0), (1, 1), (0, 1)])


def _triangle() -> Array:
    """Return an equilateral triangle from its lower left corner, counter-clockwise; one corner points up."""
    return _closed([(0, 0), (1, 0), (0.5, math.sqrt(0.75))])


def _circle() -> Array:
    """Return a circle from its rightmost point, counter-clockwise."""
    return stroke_points((Arc(0, 0, 0.5, 0.5, 0, 360),), 1.0)


def _figure_eight() -> Array:
    """Return Gerono's lemniscate, lying on its side, from its crossing up to the right."""
    return curve_points(lambda t: np.column_stack([np.sin(2 * np.pi * t) / 2, np.sin(4 * np.pi * t) / 4]))


def _star() -> Array:
    """Return the outline of a pentagram from its upper tip, counter-clockwise."""
    inner = math.sin(math.radians(18)) / math.sin(math.radians(54))
    radii = np.tile([1.0, inner], 5)
    return _closed(radii[:, None] * unit(np.pi / 2 + np.arange(10) * np.pi / 5))


SHAPES: dict[str, Callable[[], Array]] = {
    "square": _square,
    "triangle": _triangle,
    "circle": _circle,
    "figure-eight": _figure_eight,
    "star": _star,
}
"""The named shapes: what gives the points `(N, 2)` of each, at any size and place."""
OTHER_NAMES = {"eight": "figure-eight", "8": "figure-eight"}
"""Other words for shapes; spaces, underscores and hyphens in a word are alike."""
