"""Drawings from SVG, CSV and DXF files: what is read, how near the points stay to the curves, and what is refused."""

import math
import re
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.tracing.drawing import larger_side
from inhand.tracing.drawings import find_drawing, read_drawing

SHARES = np.linspace(0.0, 1.0, 3001)[:, None]
NUMBER = st.floats(-100, 100).map(lambda value: round(value, 3))
POINT = st.tuples(NUMBER, NUMBER)


def svg(folder: Path, body: str, attributes: str = "") -> Path:
    path = folder / "shape.svg"
    text = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100" {attributes}>{body}</svg>'
    path.write_text(f'<?xml version="1.0" encoding="utf-8"?>\n{text}', encoding="utf-8")
    return path


def points_of(folder: Path, body: str) -> Array:
    return read_drawing(svg(folder, body)).poses[:, :2]


def csv_file(folder: Path, text: str) -> Path:
    path = folder / "walk.csv"
    path.write_text(text, encoding="utf-8")
    return path


def at_unit_size(points: Array) -> Array:
    """What a curve's points `(K, 2)` in SVG's axes should become."""
    turned = points * [1.0, -1.0]
    low, high = turned.min(axis=0), turned.max(axis=0)
    return np.asarray((turned - (low + high) / 2) / (high - low).max())


def apart(points: Array, line: Array) -> float:
    """The largest distance of points `(K, 2)` from the polyline through `(N, 2)`."""
    start, way = line[:-1], np.diff(line, axis=0)
    off = points[:, None] - start
    share = np.clip((off * way).sum(axis=-1) / (way**2).sum(axis=-1), 0.0, 1.0)
    return float(np.linalg.norm(off - share[..., None] * way, axis=-1).min(axis=1).max())


def bezier(*controls: tuple[float, float]) -> Array:
    """Points on a Bezier curve, by de Casteljau's construction."""
    level = [np.array(control) + 0.0 * SHARES for control in controls]
    while len(level) > 1:
        level = [one + SHARES * (other - one) for one, other in pairwise(level)]
    return level[0]


def ellipse(middle: tuple[float, float], rx: float, ry: float) -> Array:
    angle = 2 * np.pi * SHARES[:, 0]
    return np.array(middle) + np.column_stack([rx * np.cos(angle), ry * np.sin(angle)])


def test_a_path_of_lines_keeps_its_corners_and_turns_y_over(tmp_path: Path) -> None:
    drawing = read_drawing(svg(tmp_path, '<path d="M10 10 h20 v10 l-20 20"/>'))
    assert drawing.name == "shape"
    assert not drawing.sized
    expected = [(-1 / 3, 0.5, 0), (1 / 3, 0.5, 0), (1 / 3, 1 / 6, 0), (-1 / 3, -0.5, 0)]
    np.testing.assert_allclose(drawing.poses, expected, atol=1e-12)
    np.testing.assert_array_equal(find_drawing(str(tmp_path / "shape.svg")).poses, drawing.poses)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ('<line x1="1" y1="2" x2="5" y2="4"/>', [(-0.5, 0.25), (0.5, -0.25)]),
        ('<polyline points="0,0 4,0 4 2"/>', [(-0.5, 0.25), (0.5, 0.25), (0.5, -0.25)]),
        ('<polygon points="0,0 4,0 4,2"/>', [(-0.5, 0.25), (0.5, 0.25), (0.5, -0.25), (-0.5, 0.25)]),
        (
            '<rect x="3" y="3" width="4" height="2" rx="0" ry="0"/>',
            [(-0.5, 0.25), (0.5, 0.25), (0.5, -0.25), (-0.5, -0.25), (-0.5, 0.25)],
        ),
    ],
)
def test_basic_shapes_are_paths(tmp_path: Path, body: str, expected: list[tuple[float, float]]) -> None:
    np.testing.assert_allclose(points_of(tmp_path, body), expected, atol=1e-12)


def test_a_file_without_a_namespace_is_read_as_well(tmp_path: Path) -> None:
    path = tmp_path / "plain.svg"
    path.write_text('<svg><g><path d="M0 0 L4 2"/></g></svg>', encoding="utf-8")
    np.testing.assert_allclose(read_drawing(path).poses[:, :2], [(-0.5, 0.25), (0.5, -0.25)])


def test_a_circle_is_one(tmp_path: Path) -> None:
    points = points_of(tmp_path, '<circle cx="50" cy="20" r="12"/>')
    np.testing.assert_allclose(np.linalg.norm(points, axis=-1), 0.5, atol=1e-9)
    assert np.array_equal(points[0], points[-1])


@pytest.mark.parametrize(
    ("body", "curve"),
    [
        ('<ellipse cx="5" cy="5" rx="30" ry="11"/>', ellipse((5, 5), 30, 11)),
        ('<path d="M0 0 Q 60 5 10 50"/>', bezier((0, 0), (60, 5), (10, 50))),
        ('<path d="M0 0 C 200 0 -160 10 40 10"/>', bezier((0, 0), (200, 0), (-160, 10), (40, 10))),
        ('<path d="M0 0 C 40 40 -40 40 0 0"/>', bezier((0, 0), (40, 40), (-40, 40), (0, 0))),
        ('<path d="M1000 0 C 1001 0 1001 1 1002 1"/>', bezier((1000, 0), (1001, 0), (1001, 1), (1002, 1))),
    ],
)
def test_points_stay_near_the_curve(tmp_path: Path, body: str, curve: Array) -> None:
    points = points_of(tmp_path, body)
    assert apart(at_unit_size(curve), points) < 0.001
    assert apart((points[:-1] + points[1:]) / 2, at_unit_size(curve)) < 0.001
    assert len(points) < 300


@settings(deadline=None)
@given(st.lists(POINT, min_size=4, max_size=4))
def test_any_cubic_curve_is_followed(
    tmp_path_factory: pytest.TempPathFactory, controls: list[tuple[float, float]]
) -> None:
    curve = bezier(*controls)
    assume(np.ptp(curve, axis=0).max() > 1e-3)
    (x, y), *rest = controls
    data = f"M{x} {y} C" + " ".join(f"{a} {b}" for a, b in rest)
    points = points_of(tmp_path_factory.getbasetemp(), f'<path d="{data}"/>')
    assert apart(at_unit_size(curve)[::10], points) < 0.001


def test_corners_between_curves_are_way_points(tmp_path: Path) -> None:
    points = points_of(tmp_path, '<path d="M0 0 Q 25 25 50 0 Q 75 25 100 0 L 100 50"/>')
    for x, y in ((0, 0), (50, 0), (100, 0), (100, 50)):
        corner = [(x - 50) / 100, (25 - y) / 100]
        assert np.linalg.norm(points - corner, axis=-1).min() < 1e-12


def test_transforms_of_groups_and_elements_apply_in_order(tmp_path: Path) -> None:
    body = (
        '<g transform="translate(10 20)"><g transform="rotate(90)">'
        '<path transform="scale(3 1)" d="M0 0 L10 0 L10 10"/></g></g>'
    )
    # Stretched to (30, 0), (30, 10), then turned from +x to +y, which goes down.
    expected = at_unit_size(np.array([(0.0, 0.0), (0.0, 30.0), (-10.0, 30.0)]))
    np.testing.assert_allclose(points_of(tmp_path, body), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("transform", "matrix"),
    [
        ("matrix(0 1 1 0 7 8)", [(0, 1), (1, 0)]),
        ("scale(-2 1)", [(-2, 0), (0, 1)]),
        ("skewX(30)", [(1, math.tan(math.pi / 6)), (0, 1)]),
    ],
)
def test_an_arc_may_be_mirrored_stretched_and_sheared(
    tmp_path: Path, transform: str, matrix: list[tuple[float, float]]
) -> None:
    # Three quarters of an ellipse of radii 20 and 10 around (0, 0), turned by 30 deg.
    angle = 2 * np.pi * 0.75 * SHARES[:, 0]
    turn = np.array([(math.cos(math.pi / 6), -0.5), (0.5, math.cos(math.pi / 6))])
    curve = np.column_stack([20 * np.cos(angle), 10 * np.sin(angle)]) @ turn.T
    data = f"M{curve[0, 0]} {curve[0, 1]} A20 10 30 1 1 {curve[-1, 0]} {curve[-1, 1]}"
    points = points_of(tmp_path, f'<path d="{data}" transform="{transform}"/>')
    wanted = at_unit_size(curve @ np.array(matrix).T)
    assert apart(wanted, points) < 0.001
    assert np.linalg.norm(points[[0, -1]] - wanted[[0, -1]], axis=-1).max() < 0.001


def test_a_rounding_is_cut_off_at_half_the_side(tmp_path: Path) -> None:
    points = points_of(tmp_path, '<rect width="20" height="20" rx="90"/>')
    np.testing.assert_allclose(np.linalg.norm(points, axis=-1), 0.5, atol=1e-3)
    flat = points_of(tmp_path, '<rect width="20" height="10" ry="3"/>')
    np.testing.assert_allclose(np.ptp(flat, axis=0), [1.0, 0.5], atol=1e-3)


def test_elements_that_meet_are_one_stroke_in_the_files_order(tmp_path: Path) -> None:
    body = '<polyline points="0,0 10,0"/><g><line x1="10" x2="10" y2="10"/></g><path d="M10.005 10 L0 10"/>'
    expected = at_unit_size(np.array([(0, 0), (10.0, 0), (10, 10), (10.005, 10), (0, 10)]))
    np.testing.assert_allclose(points_of(tmp_path, body), expected, atol=1e-12)


def test_what_is_not_shown_is_left_out(tmp_path: Path) -> None:
    body = (
        '<defs><path d="M7 7 L90 90"/></defs><g style="fill:red; display: none"><text>hidden</text></g>'
        '<path display="none" d="M50 50 L60 70"/><!-- a line --><path d="M0 0 L4 2"/><path d="M40 40"/>'
    )
    np.testing.assert_allclose(points_of(tmp_path, body), [(-0.5, 0.25), (0.5, -0.25)])


STROKE = '<path d="M0 0 L4 2"/>'
HIDING = (
    '<path STYLE d="M4 2 L9 9"/>',
    '<g STYLE><path d="M4 2 L9 9"/><text>x</text></g>',
)


@pytest.mark.parametrize("body", HIDING)
@pytest.mark.parametrize(
    "style",
    [
        'display="none"',
        'visibility="hidden"',
        'opacity="0"',
        'style="visibility: collapse"',
        'style="opacity:0.0%; fill:red"',
        'display="inline" style="display:none"',
        'class="note away"',
        'id="sketch"',
        'class="away" style="display:inline"',
    ],
)
def test_what_is_hidden_by_attribute_style_or_class_is_not_traced(tmp_path: Path, body: str, style: str) -> None:
    sheet = "<style>/* notes */ .away {display: none !important} svg #sketch, x:y {visibility: hidden}</style>"
    hidden = sheet.replace(", x:y", "") + STROKE + body.replace("STYLE", style)
    np.testing.assert_allclose(points_of(tmp_path, hidden), [(-0.5, 0.25), (0.5, -0.25)])


@pytest.mark.parametrize(
    ("outer", "inner"),
    [
        ('visibility="hidden"', 'visibility="visible"'),
        ('class="c"', 'style="visibility:visible"'),
        ('opacity="0.01" style="display:inline"', 'visibility="inherit"'),
    ],
)
def test_what_shows_in_a_hidden_group_or_hardly_shows_is_traced(tmp_path: Path, outer: str, inner: str) -> None:
    body = f"<style>.c {{visibility: hidden}} no&#x2f;rule {{</style><g {outer}><path {inner} d='M0 0 L4 2'/></g>"
    np.testing.assert_allclose(points_of(tmp_path, body), [(-0.5, 0.25), (0.5, -0.25)])


@pytest.mark.parametrize(
    ("css", "attribute"),
    [
        ("rotate(90deg)", "rotate(90)"),
        ("rotate(0.25turn) translate(3px, 4px)", "rotate(90) translate(3 4)"),
        ("scaleX(2) translateY(1in)", "scale(2 1) translate(0 96)"),
        ("skewX(0.5rad)", f"skewX({math.degrees(0.5)})"),
    ],
)
def test_a_transform_in_a_style_is_one(tmp_path: Path, css: str, attribute: str) -> None:
    line = '<path d="M0 0 H3 V9"/>'
    by_attribute = points_of(tmp_path, f'<g transform="{attribute}">{line}</g>')
    by_style = f'<style>.t {{transform: {css}}}</style><g transform="scale(7)" class="t">{line}</g>'
    np.testing.assert_allclose(points_of(tmp_path, by_style), by_attribute, atol=1e-12)


@pytest.mark.parametrize(
    ("attributes", "body", "size_mm"),
    [
        ('width="100mm" height="100mm"', '<rect x="10" y="10" width="40mm" height="20mm"/>', (40, 20)),
        ('width="200mm" height="100mm"', '<path d="M0 0 H40 V20"/>', (40, 20)),
        ('width="5cm"', '<rect width="40" height="20"/>', (20, 10)),
        ('height="2in" width="100%"', '<path d="M0 0 H50 V25"/>', (25.4, 12.7)),
        ('width="72pt" height="6pc"', '<path transform="scale(0.5)" d="M0 0 H50 V25"/>', (6.35, 3.175)),
        ("", '<circle r="1cm"/>', (20, 20)),
        ("", '<line x2="96px" y2="1in"/>', (25.4, 25.4)),
    ],
)
def test_lengths_with_a_unit_give_the_size_on_paper(
    tmp_path: Path, attributes: str, body: str, size_mm: tuple[float, float]
) -> None:
    drawing = read_drawing(svg(tmp_path, body, attributes))
    assert drawing.sized
    np.testing.assert_allclose(np.ptp(drawing.poses[:, :2], axis=0), np.array(size_mm) / 1e3, rtol=1e-3)
    np.testing.assert_allclose(drawing.poses[:, :2].min(axis=0) + drawing.poses[:, :2].max(axis=0), 0, atol=1e-12)


def test_pixels_are_no_size_on_paper(tmp_path: Path) -> None:
    assert not read_drawing(svg(tmp_path, '<line x2="10px" y2="4"/>', 'width="90" height="90px"')).sized


@pytest.mark.parametrize(
    ("attributes", "text"),
    [
        ('width="0mm"', "its width and height are '0mm' and None: mend them"),
        ('width="900cm"', "the size of drawing 'shape' is 9000 mm, too large: it may be 1 to 1,000 mm"),
    ],
)
def test_sizes_that_no_drawing_has_are_refused(tmp_path: Path, attributes: str, text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        read_drawing(svg(tmp_path, '<path d="M0 0 H100"/>', attributes))


@pytest.mark.parametrize(
    ("body", "text"),
    [
        (
            "",
            "it shows no path and no shape; its elements are (none); draw one of circle, ellipse, line, path, polygon,"
            " polyline, rect",
        ),
        ('<defs><path d="M0 0"/></defs><title>x</title>', "its elements are defs, path, title; draw one of circle"),
        (
            '<path d="M0 0 L1 1"/><g><text x="3">word</text></g>',
            "it holds <text>, which is neither a path nor a basic shape: convert it to a path, in Inkscape by"
            " Path > Object to Path",
        ),
        ('<use href="#one"/>', "it holds <use>, which is neither a path nor a basic shape: make it an object of its"),
        ('<a><path d="M0 0 L1 1"/></a>', "it holds <a>, which is neither a path nor a basic shape: take what is in it"),
        (
            '<path d="M0 0 H10 M30 0 V5"/>',
            "the path jumps from (10, 0) to (30, 0), 20 of the file's units, but is to be one line: the hand cannot"
            " lift the object, and an outline has no holes; join the parts in the order in which to draw them, or put"
            " each into a file of its own",
        ),
        (
            '<g transform="translate(0 5)"><path d="M0 0 H10"/><path d="M10.02 0 V5"/></g>',
            "the path jumps from (10, 5) to (10.02, 5), 0.02 of the file's units",
        ),
        ('<path d="M 3 3"/>', "its path has no length, so there is nothing to trace: draw a line that goes somewhere"),
        ('<path d="M3 3 L3 3 Z"/>', "its path has no length"),
        ('<path d=""/>', "its path has no length"),
        ('<circle r="0"/>', "its path has no length"),
        ('<path d="M0 0 L4 4" transform="scale(0)"/>', "its path has no length"),
        ('<path d="M0 0 L1e999 5"/>', "a coordinate is not finite, or too large to compute with: mend the number in"),
        ('<path d="M0 0 C 1e300 0 2 2 5 5"/>', "a coordinate is not finite, or too large to compute with"),
        ('<path d="M0 0 L nan 5"/>', "<path> cannot be read ('nan' is no number and no command); it needs plain"),
        ('<circle r="inf"/>', "<circle> cannot be read ('inf' is no number and no command)"),
        ('<polyline points="0,0 nan,5 5,5"/>', "<polyline> cannot be read ('nan' is no number and no command)"),
        ('<path d="M0 0 L 5"/>', "<path> cannot be read (Invalid path string: command 'L' expects 2 values but only 1"),
        ('<path d="L5 5"/>', "<path> cannot be read (it starts with 'L' instead of M); it needs plain numbers, or"),
        ('<path d="M0 0 A1 1 0 0 0 0 0"/>', "<path> cannot be read (an arc ends where it starts); it needs plain"),
        ('<circle r="5em"/>', "<circle> cannot be read (could not convert string to float: '5em'); it needs plain"),
        ('<circle cx="5"/>', "<circle> cannot be read (a radius is missing); it needs plain numbers, or lengths in"),
        ('<line x2="10%"/>', "<line> cannot be read ('%' is no number and no command)"),
        ("<g>" * 100 + "</g>" * 100, "more than 100 groups lie in each other: ungroup them"),
        (
            '<g style="transform: rotate(9deg); transform-origin: 50% 50%"><path d="M0 0 L1 1"/></g>',
            "<g> turns about a transform-origin of '50% 50%', which is not read: write the transform without it",
        ),
        (
            '<path d="M0 0' + " h1" * 10001 + '"/>',
            "it has 10,001 lines and curves; a drawing may have 10,000: simplify",
        ),
        (
            '<path d="M0 0 L1 1" transform="rotate(90"/>',
            "<path> has the transform 'rotate(90', which cannot be read (Invalid SVG transform substring: 'rotate(90');"
            " SVG has matrix, translate, scale, rotate, skewX and skewY of plain numbers: mend it",
        ),
        ('<g transform="turn(90)"><path d="M0 0 L1 1"/></g>', "<g> has the transform 'turn(90)', which cannot be read"),
    ],
)
def test_what_an_svg_file_may_not_hold(tmp_path: Path, body: str, text: str) -> None:
    path = svg(tmp_path, body)
    with pytest.raises(InputError, match=re.escape(text)) as error:
        read_drawing(path)
    assert str(error.value).startswith(f"drawing {path}: ")


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("not XML", "it is not an SVG file (syntax error: line 1, column 0); export it as plain SVG"),
        ("", "it is not an SVG file (no element found: line 1, column 0)"),
        ("<svg><path></svg>", "it is not an SVG file (mismatched tag: line 1, column 13)"),
        ('<?xml version="1.0" encoding="x"?><svg/>', "it is not an SVG file (unknown encoding"),
        ("<html><svg/></html>", "it is not an SVG file: its outermost element is <html>, not <svg>; export it as SVG"),
    ],
)
def test_what_is_no_svg_file(tmp_path: Path, content: str, text: str) -> None:
    path = tmp_path / "word.svg"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(f"drawing {path}: {text}")):
        read_drawing(path)


@pytest.mark.parametrize("ending", ["svg", "csv", "SVG", "CSV"])
def test_a_file_that_is_not_there_is_named(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"nothing.{ending}"
    text = f"drawing {path}: there is no such file; give the path of a .{ending.lower()} file that is there"
    with pytest.raises(InputError, match=f"^{re.escape(text)}$"):
        find_drawing(str(path))


def test_way_points_of_a_csv_file_are_metres_and_radians(tmp_path: Path) -> None:
    path = csv_file(tmp_path, "\ufefftheta_deg, x_mm,y_mm\n0,0,0\n-90,12.5,-3\n\n720,1e1,4\n")
    drawing = read_drawing(path)
    assert (drawing.name, drawing.sized) == ("walk", True)
    expected = [(0, 0, 0), (0.0125, -0.003, -math.pi / 2), (0.01, 0.004, 4 * math.pi)]
    np.testing.assert_allclose(drawing.poses, expected, atol=1e-15)
    np.testing.assert_array_equal(find_drawing(str(path)).poses, drawing.poses)
    assert larger_side(drawing) == pytest.approx(0.0125)


def test_a_csv_file_may_leave_theta_out(tmp_path: Path) -> None:
    drawing = read_drawing(csv_file(tmp_path, "x_mm,y_mm\n5,6\n7,8\n"))
    np.testing.assert_allclose(drawing.poses, [(0.005, 0.006, 0), (0.007, 0.008, 0)])


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (
            "x,y\n1,2\n",
            "line 1: no column x_mm and y_mm among x, y; it needs the columns x_mm, y_mm and may have theta_deg, with"
            " commas between: name them in the first line",
        ),
        ("x_mm;y_mm\n1;2\n", "line 1: no column x_mm and y_mm among x_mm;y_mm; it needs the columns x_mm, y_mm"),
        ("x_mm,theta_deg\n", "line 1: no column y_mm among x_mm, theta_deg; it needs the columns x_mm, y_mm"),
        ("", "line 1: no column x_mm and y_mm among (nothing); it needs the columns x_mm, y_mm"),
        (
            "x_mm,y_mm,theta\n1,2,3\n",
            "line 1: unknown column 'theta'; did you mean theta_deg?; allowed are x_mm, y_mm, theta_deg: rename or",
        ),
        ("x_mm,y_mm,time\n1,2,3\n", "line 1: unknown column 'time'; allowed are x_mm, y_mm, theta_deg: rename or"),
        ("x_mm,y_mm,x_mm\n1,2,3\n", "line 1: column x_mm is there twice; keep one of them"),
        ("x_mm,y_mm\n", "line 1: the file ends with 0 way-points; it needs two or more: add the missing ones"),
        ("x_mm,y_mm\n1,2\n", "line 2: the file ends with 1 way-point; it needs two or more: add the missing"),
        ("x_mm,y_mm\n1,2\n\n3,four\n", "line 4: column y_mm holds 'four', not a finite number; mend or remove the row"),
        ("x_mm,y_mm\n1,2\n,4\n", "line 3: column x_mm holds '', not a finite number; mend or remove the row"),
        ("x_mm,y_mm\nNaN,2\n3,4\n", "line 2: column x_mm holds 'NaN', not a finite number; mend or remove the row"),
        ("x_mm,y_mm,theta_deg\n1,2,-inf\n", "line 2: column theta_deg holds '-inf', not a finite number"),
        ("x_mm,y_mm\n1,2\n3\n", "line 3: 1 cells where the header names 2; mend or remove the row"),
        (
            "x_mm,y_mm\n0,0\n1e300,1\n",
            "line 3: column x_mm holds 1e+300; it may be -1,000 to 1,000 mm: check the unit",
        ),
        ("x_mm,y_mm,theta_deg\n0,0,0\n1,1,1e9", "line 3: column theta_deg holds 1e+09; it may be -3,600 to 3,600 deg"),
        ("x_mm,y_mm\n" + "1,2\n" * 10001, "line 10002: more than 10,000 rows; leave out those that hardly differ"),
    ],
)
def test_what_a_csv_file_may_not_hold(tmp_path: Path, content: str, text: str) -> None:
    path = csv_file(tmp_path, content)
    with pytest.raises(InputError, match=re.escape(f"drawing {path}, {text}")):
        read_drawing(path)


def test_way_points_in_metres_are_told_of_the_unit(tmp_path: Path) -> None:
    side, unit = (
        "larger side of its way-points is 0.05 mm, too small",
        "check the unit: x_mm and y_mm are in mm (1 m is",
    )
    with pytest.raises(InputError, match=re.escape(side) + ".*" + re.escape(unit)):
        read_drawing(csv_file(tmp_path, "x_mm,y_mm,theta_deg\n0,0,0\n0.05,0.01,20\n"))
    assert read_drawing(csv_file(tmp_path, "x_mm,y_mm,theta_deg\n0,0,0\n0,0,20\n")).sized


DXF = """0
SECTION
2
HEADER
9
$INSUNITS
70
{unit}
0
ENDSEC
0
SECTION
2
TABLES
0
TABLE
2
LAYER
70
1
0
LAYER
2
off
70
0
62
-7
6
CONTINUOUS
0
ENDTAB
0
ENDSEC
0
SECTION
2
ENTITIES{entities}
0
ENDSEC
0
EOF
"""


def dxf(folder: Path, *entities: str, unit: int = 4) -> Path:
    """A DXF file of entities, each its kind and pairs of a code and a value."""
    path = folder / "part.dxf"
    text = "".join("\n0\n" + entity.replace(" ", "\n").replace("=", "\n") for entity in entities)
    path.write_text(DXF.format(unit=unit, entities=text), encoding="ascii")
    return path


def line(x0: float, y0: float, x1: float, y1: float, more: str = "") -> str:
    return f"LINE 8=0 10={x0} 20={y0} 11={x1} 21={y1}{more}"


def test_lines_and_arcs_of_a_dxf_file_are_one_whatever_their_order(tmp_path: Path) -> None:
    pytest.importorskip("ezdxf")
    arc = "ARC 8=0 10=20 20=5 40=5 50=270 51=90"
    path = dxf(
        tmp_path,
        line(0, 0, 20, 0),
        line(0, 10, 0, 0),
        arc,
        line(0, 10, 20, 10),
        line(1, 1, 9, 9, " 60=1"),
        "CIRCLE 8=OFF 10=0 20=0 40=99",
    )
    drawing = read_drawing(path)
    assert (drawing.name, drawing.sized) == ("part", True)
    np.testing.assert_allclose(np.ptp(drawing.poses[:, :2], axis=0), [0.025, 0.010], atol=1e-5)
    assert np.linalg.norm(drawing.poses[0, :2] - drawing.poses[-1, :2]) < 1e-9
    round_end = drawing.poses[drawing.poses[:, 0] > 0.0076, :2] - [0.0075, 0.0]
    assert len(round_end) > 8
    np.testing.assert_allclose(np.linalg.norm(round_end, axis=-1), 0.005, atol=3e-5)


@pytest.mark.parametrize(("unit", "size"), [(1, 0.0508), (5, 0.02), (0, None)])
def test_a_polyline_of_a_dxf_file_has_the_size_of_its_unit(tmp_path: Path, unit: int, size: float | None) -> None:
    pytest.importorskip("ezdxf")
    drawing = read_drawing(
        dxf(
            tmp_path,
            "LWPOLYLINE 100=AcDbEntity 8=0 100=AcDbPolyline 90=3 70=0 10=0 20=0 10=2 20=0 10=2 20=1",
            unit=unit,
        )
    )
    assert drawing.sized == (size is not None)
    assert larger_side(drawing) == pytest.approx(size or 1.0)


@pytest.mark.parametrize(
    ("entities", "text"),
    [
        ((), "it shows no line; draw one of LWPOLYLINE, POLYLINE, LINE, ARC, CIRCLE, ELLIPSE, SPLINE"),
        (("TEXT 8=0 10=0 20=0 40=1 1=word",), "it holds TEXT, which is no line (LWPOLYLINE, "),
        ((line(0, 0, 1, 0), line(3, 0, 4, 0)), "its 2 lines are not one: they do not all meet end to end; draw one"),
        ((line(1, 1, 1, 1),), "its lines have no length"),
        ((line(1, 1, 1e200, 1),), "its lines have no length, or one too large to compute with"),
    ],
)
def test_what_a_dxf_file_may_not_hold(tmp_path: Path, entities: tuple[str, ...], text: str) -> None:
    pytest.importorskip("ezdxf")
    with pytest.raises(InputError, match=re.escape(text)):
        read_drawing(dxf(tmp_path, *entities))


def test_what_is_no_dxf_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ezdxf")
    path = tmp_path / "part.dxf"
    path.write_bytes(b"0\nSECTION\n2\nENT")
    with pytest.raises(InputError, match=re.escape(f"drawing {path}: it is not a DXF file (")):
        read_drawing(path)
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(InputError, match=re.escape("a DXF file needs the extra `dxf`: pip install 'inhand[dxf]'")):
        read_drawing(path)


def test_what_is_no_text_is_no_csv_file(tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    path.write_bytes(b"x_mm,y_mm\n\xff\xfe,2\n")
    with pytest.raises(InputError, match=re.escape(f"drawing {path} cannot be read as a CSV text file (") + ".*utf-8"):
        read_drawing(path)
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(InputError, match=re.escape("folder.csv cannot be read as a CSV text file (")):
        read_drawing(tmp_path / "folder.csv")
