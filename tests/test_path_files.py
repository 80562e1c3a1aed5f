"""Drawings from SVG and CSV files: what is read, how near the points stay to the curves, and what is refused."""

import math
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.tracing.drawing import larger_side
from inhand.tracing.drawings import find_drawing
from inhand.tracing.path_files import read_csv, read_svg

SHARES = np.linspace(0.0, 1.0, 3001)[:, None]
NUMBER = st.floats(-100, 100).map(lambda value: round(value, 3))
POINT = st.tuples(NUMBER, NUMBER)


def svg(folder: Path, body: str, attributes: str = "") -> Path:
    path = folder / "shape.svg"
    text = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100" {attributes}>{body}</svg>'
    path.write_text(f'<?xml version="1.0" encoding="utf-8"?>\n{text}', encoding="utf-8")
    return path


def points_of(folder: Path, body: str) -> Array:
    return read_svg(svg(folder, body)).poses[:, :2]


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
    drawing = read_svg(svg(tmp_path, '<path d="M10 10 h20 v10 l-20 20"/>'))
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
    np.testing.assert_allclose(read_svg(path).poses[:, :2], [(-0.5, 0.25), (0.5, -0.25)])


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
            "the path jumps from (10, 0) to (30, 0), 20 of the file's units, and the hand cannot lift the object: join"
            " the parts into one line, in the order in which to draw them, or trace each from a file of its own",
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
        ('<path d="L5 5"/>', "<path> cannot be read (it starts with 'L' instead of M); it needs plain numbers without"),
        ('<path d="M0 0 A1 1 0 0 0 0 0"/>', "<path> cannot be read (an arc ends where it starts); it needs plain"),
        ('<circle r="5mm"/>', "<circle> cannot be read (could not convert string to float: '5mm'); it needs plain"),
        ('<circle cx="5"/>', "<circle> cannot be read (a radius is missing); it needs plain numbers without a unit"),
        ('<line x2="10px"/>', "<line> cannot be read ('p' is no number and no command)"),
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
        read_svg(path)
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
        read_svg(path)


@pytest.mark.parametrize("ending", ["svg", "csv", "SVG", "CSV"])
def test_a_file_that_is_not_there_is_named(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"nothing.{ending}"
    text = f"drawing {path}: there is no such file; give the path of a .{ending.lower()} file that is there"
    with pytest.raises(InputError, match=f"^{re.escape(text)}$"):
        find_drawing(str(path))


def test_way_points_of_a_csv_file_are_metres_and_radians(tmp_path: Path) -> None:
    path = csv_file(tmp_path, "\ufefftheta_deg, x_mm,y_mm\n0,0,0\n-90,12.5,-3\n\n720,1e1,4\n")
    drawing = read_csv(path)
    assert (drawing.name, drawing.sized) == ("walk", True)
    expected = [(0, 0, 0), (0.0125, -0.003, -math.pi / 2), (0.01, 0.004, 4 * math.pi)]
    np.testing.assert_allclose(drawing.poses, expected, atol=1e-15)
    np.testing.assert_array_equal(find_drawing(str(path)).poses, drawing.poses)
    assert larger_side(drawing) == pytest.approx(0.0125)


def test_a_csv_file_may_leave_theta_out(tmp_path: Path) -> None:
    drawing = read_csv(csv_file(tmp_path, "x_mm,y_mm\n5,6\n7,8\n"))
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
        ("x_mm,y_mm\n", "line 1: the file ends with 0 way-points; a drawing needs two or more: add the missing ones"),
        ("x_mm,y_mm\n1,2\n", "line 2: the file ends with 1 way-point; a drawing needs two or more: add the missing"),
        ("x_mm,y_mm\n1,2\n\n3,four\n", "line 4: column y_mm holds 'four', not a finite number; mend or remove the row"),
        ("x_mm,y_mm\n1,2\n,4\n", "line 3: column x_mm holds '', not a finite number; mend or remove the row"),
        ("x_mm,y_mm\nNaN,2\n3,4\n", "line 2: column x_mm holds 'NaN', not a finite number; mend or remove the row"),
        ("x_mm,y_mm,theta_deg\n1,2,-inf\n", "line 2: column theta_deg holds '-inf', not a finite number"),
        ("x_mm,y_mm\n1,2\n3\n", "line 3: 1 cells where the header names 2; mend or remove the row"),
    ],
)
def test_what_a_csv_file_may_not_hold(tmp_path: Path, content: str, text: str) -> None:
    path = csv_file(tmp_path, content)
    with pytest.raises(InputError, match=re.escape(f"drawing {path}, {text}")):
        read_csv(path)


def test_what_is_no_text_is_no_csv_file(tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    path.write_bytes(b"x_mm,y_mm\n\xff\xfe,2\n")
    with pytest.raises(InputError, match=re.escape(f"drawing {path} cannot be read as a CSV text file (") + ".*utf-8"):
        read_csv(path)
    with pytest.raises(InputError, match=re.escape(f"drawing {tmp_path} cannot be read as a CSV text file (")):
        read_csv(tmp_path)
