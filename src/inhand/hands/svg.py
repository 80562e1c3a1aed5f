"""The lines and curves of an SVG file, and its unit.

`svgpathtools` reads the file, its path data and shapes. What it makes of transforms is not used: it misplaces arcs that
are mirrored, or turned and stretched (1.8.0), and gives the shapes sorted by kind, not in the file's order.
"""

import copy
import re
import warnings
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.polylines import COARSE, LARGEST, MOST, UNITS, curve_points
from inhand.hands.svg_shown import LENGTH, PHYSICAL, length_in, shown_elements, tag_of

Curve = Callable[[Array], Array]
"""The points `(N, 2)` at shares `(N,)` of the way along a line or curve, in the file's units, y down."""

LARGEST_FILE = 2_000_000
"""Bytes that a file may have (guessed); one of `MOST` lines has about 200,000."""
UNREADABLE = {
    "text": "convert it to a path, in Inkscape by Path > Object to Path",
    "use": "make it an object of its own, in Inkscape by Edit > Clone > Unlink Clone",
    "image": "remove it, or trace it to a path, in Inkscape by Path > Trace Bitmap",
    "a": "take what is in it out of the link",
    "svg": "take what is in it out of the inner drawing",
    "switch": "take what is in it out of the switch",
}
"""Elements that show something which is not read, and what to do about each."""
GEOMETRY = ("x", "y", "width", "height", "cx", "cy", "r", "rx", "ry", "x1", "y1", "x2", "y2")
"""Attributes of shapes that may have a unit."""


def svg_lines(path: Path, close: float) -> tuple[list[Array], float | None]:
    """Return the lines of an SVG file, each `(N, 2)` with y up, and the metres in one of its units if it says so.

    They are all its paths and basic shapes (circle, ellipse, line, polygon, polyline, rect) in the file's order.
    Transforms of groups and elements apply, and what the drawing hides is left out. Corners and ends are points; on
    curves there are so many that the line through them is no farther off than a share `close` of the larger side.

    The file says how large it is where its width or height, or a length of a shape, is in mm, cm, in, pt or pc. Such a
    length is that length on paper, whatever its view box scales; a px is one of the file's units.

    Raises:
        InputError: no SVG, no path or shape in it, text or another element that cannot be read, path data or a
            transform that SVG does not know, numbers that are not finite, or no length.
    """
    root = _root(path)
    unit = _unit(root)
    shapes = _shapes(root, unit or UNITS["px"])
    sized = unit is not None or any(_has_unit(element) for element, _ in shapes)
    curves = [curve for element, matrix in shapes for curve in _curves(element, matrix, unit or UNITS["px"])]
    if len(curves) > MOST:
        raise InputError(f"it has {len(curves):,} lines and curves; a drawing may have {MOST:,}: simplify it")
    coarse = [curve(np.linspace(0.0, 1.0, COARSE + 1)) for curve in curves]
    if not all((np.abs(points) < LARGEST).all() for points in coarse):
        raise InputError("a coordinate is not finite, or too large to compute with: mend the number in the file")
    size = np.ptp(np.concatenate(coarse), axis=0).max() if coarse else 0.0
    if size * LARGEST < 1.0:
        raise InputError("its path has no length, so there is nothing to trace: draw a line that goes somewhere")
    lines = [curve_points(curve, size, close) * [1.0, -1.0] for curve in curves]
    return lines, (unit or UNITS["px"]) if sized else None


def _root(path: Path) -> Element:
    from svgpathtools import Document

    try:
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(f"it has more than {LARGEST_FILE / 1e6:g} MB; leave out what is not to be traced")
        root: Element = Document(str(path)).root
    except (ParseError, ValueError, LookupError, OSError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"it is not an SVG file ({error}); export it as plain SVG") from error
    if tag_of(root) != "svg":
        raise InputError(f"it is not an SVG file: its outermost element is <{root.tag}>, not <svg>; export it as SVG")
    return root


def _unit(root: Element) -> float | None:
    """Return the metres in one of the file's units, by its width or height and its view box; None if it says none."""
    box = root.get("viewBox", "").replace(",", " ").split()
    try:
        sides = [float(word) for word in box[2:]] if box else [0.0, 0.0]
    except ValueError:
        sides = []
    if len(box) not in {0, 4} or len(sides) != 2 or (box and not all(0 < side < LARGEST for side in sides)):
        raise InputError(f"its viewBox is {root.get('viewBox')!r}; it must be four numbers: x, y, width and height")
    units = []
    for name, side in zip(("width", "height"), sides, strict=True):
        found = LENGTH.fullmatch(root.get(name, ""))
        if found is not None and found["unit"] in PHYSICAL:
            units.append(float(found["number"]) * UNITS[found["unit"]] / side if box else UNITS["px"])
    if not all(1 / LARGEST < each < LARGEST for each in units):
        raise InputError(f"its width and height are {root.get('width')!r} and {root.get('height')!r}: mend them")
    return min(units, default=None)


def _shapes(root: Element, unit: float) -> list[tuple[Element, Array]]:
    """Return each element that is a path or a basic shape, with the matrix `(3, 3)` of its transforms."""
    from svgpathtools import CONVERSIONS

    shown = list(shown_elements(root, unit))
    for tag in (tag_of(element) for element, _ in shown):
        if tag in UNREADABLE:
            raise InputError(f"it holds <{tag}>, which is neither a path nor a basic shape: {UNREADABLE[tag]}")
    shapes = [(element, matrix) for element, matrix in shown if tag_of(element) in CONVERSIONS]
    if not shapes:
        held = sorted({tag_of(element) for element in root.iter() if element is not root} - {""})
        raise InputError(
            f"it shows no path and no shape; its elements are {', '.join(held) or '(none)'}; draw one of"
            f" {', '.join(sorted(CONVERSIONS))}"
        )
    return shapes


def _has_unit(element: Element) -> bool:
    """Return whether a length of a shape says how long it is on paper."""
    found = (LENGTH.fullmatch(element.get(name, "")) for name in GEOMETRY)
    return any(each is not None and each["unit"] in PHYSICAL for each in found)


def _curves(element: Element, matrix: Array, unit: float) -> Iterable[Curve]:
    """Return the lines and curves of one element, transformed."""
    from svgpathtools import parse_path

    tag = tag_of(element)
    try:
        data = _path_data(_without_units(element, unit))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of arcs without a radius, which become lines as SVG has it
            return [partial(_points, segment.point, matrix) for segment in parse_path(data)]
    except (TypeError, LookupError, ArithmeticError, AssertionError, ValueError) as error:
        what = "a radius is missing" if isinstance(error, TypeError) else str(error) or "an arc ends where it starts"
        raise InputError(
            f"<{tag}> cannot be read ({what}); it needs plain numbers, or lengths in {', '.join(PHYSICAL)} or px:"
            " mend it"
        ) from error


def _without_units(element: Element, unit: float) -> Element:
    """Return a copy of a shape whose lengths are all in the file's units."""
    plain = copy.copy(element)
    for name in GEOMETRY:
        found = LENGTH.fullmatch(element.get(name, ""))
        if found is not None and found["unit"]:
            plain.set(name, repr(length_in(unit, found)))
    return plain


def _path_data(element: Element) -> str:
    """Return an element's path data, which holds nothing that its reader would pass over."""
    from svgpathtools import CONVERSIONS

    tag = tag_of(element)
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
