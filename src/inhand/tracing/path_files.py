"""Drawings from files: SVG, of which one stroke is read, and CSV with way-points.

`svgpathtools` reads the file, its path data and shapes. What it makes of transforms is not used: it misplaces arcs that
are mirrored, or turned and stretched (1.8.0), and gives the shapes sorted by kind, not in the file's order.
"""

from __future__ import annotations

import copy
import re
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import numpy as np

from inhand.columns import Header, read_columns
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.tracing.drawing import COARSE, Drawing, curve_points, unit_drawing

Curve = Callable[[Array], Array]
"""The points `(N, 2)` at shares `(N,)` of the way along a line or curve, in the file's units, y down."""

JOIN = 0.001
"""Ends that are farther apart than this share of the larger side do not meet."""
LARGEST = 1e100
"""Coordinates that are larger cannot be squared safely, nor sizes that are smaller than its inverse."""
SVG = "http://www.w3.org/2000/svg"
UNREADABLE = {
    "text": "convert it to a path, in Inkscape by Path > Object to Path",
    "use": "make it an object of its own, in Inkscape by Edit > Clone > Unlink Clone",
    "image": "remove it, or trace it to a path, in Inkscape by Path > Trace Bitmap",
    "a": "take what is in it out of the link",
    "svg": "take what is in it out of the inner drawing",
    "switch": "take what is in it out of the switch",
}
"""Elements that show something which is not read, and what to do about each."""
REQUIRED = ("x_mm", "y_mm")
"""Columns that a CSV file must have."""


def read_svg(path: Path) -> Drawing:
    """Return the drawing of an SVG file, without a size.

    All its paths and basic shapes (circle, ellipse, line, polygon, polyline, rect), in the file's order, together are
    one stroke. Transforms of groups and elements apply; whatever has display none is left out. SVG's y, which goes
    down, is turned over. Corners and ends are way-points; on curves there are so many that the line through them stays
    within 0.001 of the curve at size 1. Theta is 0.

    Raises:
        InputError: no such file, no SVG, no path or shape in it, text or another element that cannot be read, path data
            or a transform that SVG does not know, numbers that are not finite, a jump between sub-paths or elements,
            or no length. Points in the text are in the file's units, with every transform applied and y down.
    """
    try:
        return _drawing_of(path)
    except InputError as error:
        raise InputError(f"drawing {path}: {error}") from error


def read_csv(path: Path) -> Drawing:
    """Return the drawing of a CSV file, with its size.

    Its first line names the columns `x_mm`, `y_mm` and, if the object is to turn, `theta_deg`, in any order. Each row
    is a way-point relative to the object's start: x to the right, y away from the palm, theta counter-clockwise. Theta
    is not wrapped, so 360 is one whole turn; without the column it is 0.

    Raises:
        InputError: no such file, no text, a column that is missing, unknown or there twice, fewer than two
            way-points, or a row that is cut off or holds something that is no finite number.
    """
    found = read_columns(path, f"drawing {path}", Header(REQUIRED, optional=("theta_deg",)))
    columns, count = found.columns, len(found.columns["x_mm"])
    if count < 2:
        raise InputError(
            f"drawing {path}, line {found.lines[-1]}: the file ends with {count} way-point{'s' * (count != 1)}; a"
            " drawing needs two or more: add the missing ones"
        )
    theta = np.radians(columns["theta_deg"]) if "theta_deg" in columns else np.zeros(count)
    poses = np.column_stack([columns["x_mm"] / 1e3, columns["y_mm"] / 1e3, theta])
    return Drawing(path.stem, poses, sized=True)


def _drawing_of(path: Path) -> Drawing:
    curves = [curve for element, matrix in _shapes(_root(path)) for curve in _curves(element, matrix)]
    coarse = [curve(np.linspace(0.0, 1.0, COARSE + 1)) for curve in curves]
    if not all((np.abs(points) < LARGEST).all() for points in coarse):
        raise InputError("a coordinate is not finite, or too large to compute with: mend the number in the file")
    size = np.ptp(np.concatenate(coarse), axis=0).max() if coarse else 0.0
    if size * LARGEST < 1.0:
        raise InputError("its path has no length, so there is nothing to trace: draw a line that goes somewhere")
    for one, other in pairwise(coarse):
        _check_join(one[-1], other[0], size)
    return unit_drawing(path.stem, np.concatenate([curve_points(curve, size) for curve in curves]) * [1.0, -1.0])


def _check_join(end: Array, start: Array, size: float) -> None:
    gap = float(np.linalg.norm(start - end))
    if gap > JOIN * size:
        raise InputError(
            f"the path jumps from ({end[0]:.6g}, {end[1]:.6g}) to ({start[0]:.6g}, {start[1]:.6g}), {gap:.3g} of the"
            " file's units, and the hand cannot lift the object: join the parts into one line, in the order in which to"
            " draw them, or trace each from a file of its own"
        )


def _root(path: Path) -> Element:
    """Return the outermost element of an SVG file."""
    from svgpathtools import Document

    if not path.is_file():
        raise InputError("there is no such file; give the path of a .svg file that is there")
    try:
        root: Element = Document(str(path)).root
    except (ParseError, ValueError, LookupError, OSError) as error:
        raise InputError(f"it is not an SVG file ({error}); export it as plain SVG") from error
    if _tag(root) != "svg":
        raise InputError(f"it is not an SVG file: its outermost element is <{root.tag}>, not <svg>; export it as SVG")
    return root


def _tag(element: Element) -> str:
    """Return the name of an SVG element, with or without SVG's namespace; empty if it has another one."""
    space, _, name = element.tag.rpartition("}")
    return name if space in {"", "{" + SVG} else ""


def _shapes(root: Element) -> list[tuple[Element, Array]]:
    """Return each element that is a path or a basic shape, with the matrix `(3, 3)` of its transforms."""
    from svgpathtools import CONVERSIONS

    shown = list(_shown(root, _transform(root)))
    for tag in (_tag(element) for element, _ in shown):
        if tag in UNREADABLE:
            raise InputError(f"it holds <{tag}>, which is neither a path nor a basic shape: {UNREADABLE[tag]}")
    shapes = [(element, matrix) for element, matrix in shown if _tag(element) in CONVERSIONS]
    if not shapes:
        held = sorted({_tag(element) for element in root.iter() if element is not root} - {""})
        raise InputError(
            f"it shows no path and no shape; its elements are {', '.join(held) or '(none)'}; draw one of"
            f" {', '.join(sorted(CONVERSIONS))}"
        )
    return shapes


def _shown(parent: Element, matrix: Array) -> Iterator[tuple[Element, Array]]:
    """Give the elements below one, in the file's order and through all groups, with their transforms."""
    for element in parent:
        hidden = element.get("display") == "none" or re.search(r"display\s*:\s*none", element.get("style", ""))
        if not hidden:
            below = matrix @ _transform(element)
            if _tag(element) == "g":
                yield from _shown(element, below)
            else:
                yield element, below


def _transform(element: Element) -> Array:
    """Return the matrix `(3, 3)` of an element's own transform."""
    from svgpathtools import parse_transform

    text = element.get("transform")
    try:
        return np.asarray(parse_transform(text, strict=True))
    except ValueError as error:
        raise InputError(
            f"<{_tag(element)}> has the transform {text!r}, which cannot be read ({error}); SVG has matrix, translate,"
            " scale, rotate, skewX and skewY of plain numbers: mend it"
        ) from error


def _curves(element: Element, matrix: Array) -> list[Curve]:
    """Return the lines and curves of one element, transformed."""
    from svgpathtools import parse_path

    tag = _tag(element)
    try:
        data = _path_data(element)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of arcs without a radius, which become lines as SVG has it
            return [partial(_points, segment.point, matrix) for segment in parse_path(data)]
    except (TypeError, LookupError, ArithmeticError, AssertionError, ValueError) as error:
        what = "a radius is missing" if isinstance(error, TypeError) else str(error) or "an arc ends where it starts"
        raise InputError(f"<{tag}> cannot be read ({what}); it needs plain numbers without a unit: mend it") from error


def _path_data(element: Element) -> str:
    """Return an element's path data, which holds nothing that its reader would pass over."""
    from svgpathtools import CONVERSIONS

    tag = _tag(element)
    data = str(CONVERSIONS[tag](_with_roundings(element) if tag == "rect" else element))
    strange = re.search(r"inf|nan|[^MmZzLlHhVvCcSsQqTtAaeE\d.,+\-\s]", data + element.get("points", ""))
    if strange is not None:
        raise ValueError(f"{strange.group()!r} is no number and no command")
    if data.strip() and data.strip()[0] not in "Mm":
        raise ValueError(f"it starts with {data.strip()[0]!r} instead of M")
    return data


def _with_roundings(rect: Element) -> Element:
    """Return a copy of a rect whose corners are no rounder than its sides allow, as SVG has it."""
    rounded = copy.copy(rect)
    for key, other, side in (("rx", "ry", "width"), ("ry", "rx", "height")):
        radius = rect.get(key, rect.get(other))
        if radius is not None:
            rounded.set(key, str(min(float(radius), float(rect.get(side, 0)) / 2)))
    return rounded


def _points(place: Callable[[Array], object], matrix: Array, shares: Array) -> Array:
    """Return the points `(N, 2)` at shares `(N,)` of the way along a line or curve, transformed."""
    with np.errstate(over="ignore", invalid="ignore"):
        places = np.asarray(place(shares), dtype=complex)
        return np.asarray(np.column_stack([places.real, places.imag]) @ matrix[:2, :2].T + matrix[:2, 2])
