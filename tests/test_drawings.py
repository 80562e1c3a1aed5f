"""Shapes and letters: their boxes, ends and curves, how they are named and scaled."""

import asyncio
import math
import re
import string
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from inhand.errors import InputError
from inhand.geometry import Array, cross
from inhand.hands.polylines import curve_points
from inhand.tracing.drawing import Drawing, larger_side, scaled, unit_drawing
from inhand.tracing.drawings import SHAPES, find_drawing

LETTERS = tuple(string.ascii_uppercase)
NAMES = (*SHAPES, *LETTERS)
CLOSED = {*SHAPES, "B", "D", "O"}
ALLOWED = "; allowed are square, triangle, circle, figure-eight, star, a single letter A to Z, or the path of a .svg,"
HOP = Drawing("hop", np.array([(0.01, 0.02, 0.1), (0.05, 0.0, 0.2), (0.03, 0.04, -0.3)]), sized=True)


def points_of(name: str) -> Array:
    return find_drawing(name).poses[:, :2]


def box_middle(points: Array) -> Array:
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)


def farthest_from_line(points: Array, line: Array) -> float:
    """The largest distance of points `(K, 2)` from the polyline through `(N, 2)`."""
    start, way = line[:-1], np.diff(line, axis=0)
    apart = points[:, None] - start
    share = np.clip((apart * way).sum(axis=-1) / (way**2).sum(axis=-1), 0.0, 1.0)
    return float(np.linalg.norm(apart - share[..., None] * way, axis=-1).min(axis=1).max())


@pytest.mark.parametrize("name", NAMES)
def test_a_named_drawing_has_size_one_around_the_origin(name: str) -> None:
    drawing = find_drawing(name)
    assert drawing.poses.ndim == 2
    assert drawing.poses.shape[1] == 3
    assert np.isfinite(drawing.poses).all()
    assert not drawing.sized
    assert not drawing.poses[:, 2].any()
    assert larger_side(drawing) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(box_middle(drawing.poses[:, :2]), 0.0, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_closed_figures_end_exactly_where_they_start(name: str) -> None:
    points = points_of(name)
    assert (name in CLOSED) == np.array_equal(points[0], points[-1])


@pytest.mark.parametrize("name", NAMES)
def test_no_way_point_repeats_the_one_before(name: str) -> None:
    assert np.linalg.norm(np.diff(points_of(name), axis=0), axis=-1).min() > 1e-3


def test_letters_differ_from_each_other() -> None:
    spread = {letter: _along(points_of(letter)) for letter in LETTERS}
    for i, one in enumerate(LETTERS):
        for other in LETTERS[i + 1 :]:
            assert np.abs(spread[one] - spread[other]).max() > 0.05, (one, other)


def _along(points: Array) -> Array:
    """Return 200 points evenly along a polyline."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=-1))])
    even = np.linspace(0.0, way[-1], 200)
    return np.column_stack([np.interp(even, way, points[:, i]) for i in range(2)])


def test_letters_are_upright() -> None:
    assert not [letter for letter in LETTERS if np.ptp(points_of(letter)[:, 1]) < 0.999]
    apex = points_of("A")
    assert apex[apex[:, 1].argmax()] == pytest.approx([0.0, 0.5])  # its tip is away from the palm
    assert points_of("L")[-1] == pytest.approx([0.3, -0.5])  # its foot is to the right
    bowl = points_of("P")
    assert bowl[bowl[:, 0].argmax(), 1] > 0.1


def test_strokes_go_back_over_the_same_line() -> None:
    inside, outside = points_of("Q")[-2:]
    assert farthest_from_line(points_of("Q")[:1], np.array([inside, outside])) < 2e-4
    legs = points_of("A")
    assert farthest_from_line(legs[3:4], legs[1:3]) < 1e-12
    assert farthest_from_line(legs[4:5], legs[:2]) < 1e-12
    arms = points_of("K")
    assert farthest_from_line(arms[4:5], arms[2:4]) < 1e-12


def test_the_square_goes_round_from_a_corner() -> None:
    np.testing.assert_allclose(
        points_of("square"), [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)], atol=1e-15
    )


def test_the_triangle_has_three_equal_sides_and_a_corner_up() -> None:
    points = points_of("triangle")
    np.testing.assert_allclose(np.linalg.norm(np.diff(points, axis=0), axis=-1), 1.0)
    assert len(points) == 4
    assert points[2] == pytest.approx([0.0, math.sqrt(0.75) / 2])


def test_the_circle_has_the_radius_one_half() -> None:
    points = points_of("circle")
    np.testing.assert_allclose(np.linalg.norm(points, axis=-1), 0.5, atol=1e-12)
    chords = (points[:-1] + points[1:]) / 2
    assert np.linalg.norm(chords, axis=-1).min() > 0.5 - 0.001


def test_the_star_has_ten_corners_and_points_up() -> None:
    corners = points_of("star")[:-1]
    assert len(corners) == 10
    turns = cross(corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners)
    assert list(np.sign(turns)) == [1, -1] * 5
    assert corners[0] == pytest.approx([0.0, corners[:, 1].max()])
    # The sides of a pentagram: each tip, the two inner corners and the tip beyond lie on one line.
    for i in range(0, 10, 2):
        tip, inner, beyond = corners[i], corners[(i + 1) % 10], corners[(i + 4) % 10]
        assert abs(float(cross(inner - tip, beyond - tip))) < 1e-12


def test_the_figure_eight_is_smooth_and_starts_at_its_crossing() -> None:
    points = points_of("figure-eight")
    middle = len(points) // 2
    np.testing.assert_allclose(points[[0, middle, -1]], 0.0, atol=1e-12)
    ways = np.diff(points, axis=0)
    angle = np.arctan2(cross(ways[:-1], ways[1:]), (ways[:-1] * ways[1:]).sum(axis=-1))
    assert np.abs(angle).max() < 0.15
    assert angle.sum() == pytest.approx(0.0, abs=1e-9)  # as much to the left as to the right
    t = np.linspace(0.0, 2 * np.pi, 5001)
    assert farthest_from_line(np.column_stack([np.sin(t) / 2, np.sin(2 * t) / 4]), points) < 0.001


def test_round_letters_stay_near_their_ellipse() -> None:
    angle = np.linspace(0.0, 2 * np.pi, 5001)
    ellipse = np.column_stack([np.cos(angle) * 5 / 12, np.sin(angle) / 2])
    assert farthest_from_line(ellipse, points_of("O")) < 0.001


@settings(deadline=None)
@given(st.floats(0.01, 40.0), st.floats(1e-3, 1e3))
def test_a_curve_has_as_many_points_as_its_bend_asks_for(angle: float, size: float) -> None:
    def arc(share: Array) -> Array:
        turned = share * angle / 6
        return size * np.column_stack([np.cos(turned), np.sin(turned)])

    points = curve_points(arc, size)
    np.testing.assert_allclose(points[[0, -1]], arc(np.array([0.0, 1.0])))
    assert farthest_from_line(arc(np.linspace(0.0, 1.0, 500)), points) < 0.00031 * size
    assert len(points) < 120 + 20 * angle


def test_a_straight_curve_has_two_points() -> None:
    assert len(curve_points(lambda share: np.column_stack([3.0 * share, 1e5 - share]))) == 2


def test_unit_drawings_leave_repeated_points_out() -> None:
    points = np.array([(2.0, 2.0), (2.0, 2.0), (6.0, 2.0), (6.0, 4.0), (6.0, 4.0 + 1e-7), (2.0, 2.0 + 1e-7)])
    drawing = unit_drawing("wedge", points)
    np.testing.assert_allclose(drawing.poses, [(-0.5, -0.25, 0), (0.5, -0.25, 0), (0.5, 0.25, 0), (-0.5, -0.25, 0)])
    assert np.array_equal(drawing.poses[0], drawing.poses[-1])


@pytest.mark.parametrize("text", ["figure-eight", "figure eight", "figure_eight", " Figure  Eight ", "eight", "8"])
def test_the_figure_eight_has_many_names(text: str) -> None:
    assert find_drawing(text).name == "figure-eight"
    np.testing.assert_array_equal(find_drawing(text).poses, find_drawing("figure-eight").poses)


@pytest.mark.parametrize("text", ["q", "Q", "letter Q", "Letter_q"])
def test_a_letter_may_be_written_small(text: str) -> None:
    assert find_drawing(text).name == "letter Q"
    np.testing.assert_array_equal(find_drawing(text).poses, find_drawing("Q").poses)


@pytest.mark.parametrize("name", NAMES)
def test_a_drawing_is_found_again_by_its_own_name(name: str) -> None:
    assert find_drawing(find_drawing(name).name).name == find_drawing(name).name


@pytest.mark.parametrize(
    ("text", "near"),
    [
        ("sqare", "; did you mean square"),
        ("figure-ate", "; did you mean figure-eight"),
        ("AB", ""),
        ("É", ""),
        ("", ""),
        ("picture.png", ""),
    ],
)
def test_what_is_no_drawing_is_told_what_is(text: str, near: str) -> None:
    with pytest.raises(InputError, match=re.escape(f"unknown drawing {text!r}{near}")) as error:
        find_drawing(text)
    assert ALLOWED in str(error.value)
    assert ("did you mean" in str(error.value)) == bool(near)


@settings(deadline=None)
@given(st.sampled_from(NAMES), st.floats(1e-3, 1.0))
def test_a_drawing_without_a_size_is_scaled_around_the_origin(name: str, size: float) -> None:
    drawing = find_drawing(name)
    got = scaled(drawing, size)
    assert (got.name, got.sized) == (drawing.name, True)
    assert larger_side(got) == pytest.approx(size)
    np.testing.assert_allclose(got.poses, drawing.poses * size, atol=1e-12)


@settings(deadline=None)
@given(st.floats(1e-3, 1.0))
def test_a_drawing_with_a_size_is_scaled_about_the_start_that_its_way_points_count_from(size: float) -> None:
    got = scaled(HOP, size)
    assert got.sized
    assert larger_side(HOP) == pytest.approx(0.04)
    assert larger_side(got) == pytest.approx(size)
    np.testing.assert_allclose(got.poses[:, :2], HOP.poses[:, :2] * (size / 0.04), atol=1e-12)
    np.testing.assert_array_equal(got.poses[:, 2], HOP.poses[:, 2])


@pytest.mark.parametrize("size", [0.0, -0.02, math.nan, math.inf])
def test_a_size_is_positive_and_finite(size: float) -> None:
    with pytest.raises(InputError, match=r"^size .* of drawing 'square': give a positive, finite number of metres$"):
        scaled(find_drawing("square"), size)


@pytest.mark.parametrize(("size", "told"), [(0.0009, "0.9 mm, too small"), (1.1, "1100 mm, too large")])
def test_a_size_that_no_drawing_has_asks_for_the_unit(size: float, told: str) -> None:
    with pytest.raises(InputError, match=rf"^the size of drawing 'square' is {told}.*--size and files give mm, Python"):
        scaled(find_drawing("square"), size)


def test_a_drawing_without_an_extent_cannot_be_scaled() -> None:
    spin = Drawing("spin", np.array([(0.01, 0.0, 0.0), (0.01, 0.0, 1.0)]), sized=True)
    assert larger_side(spin) == 0.0
    with pytest.raises(
        InputError, match=r"^drawing 'spin' has no extent: all its 2 way-points are at one place \(x, y"
    ):
        scaled(spin, 0.02)


def test_drawings_are_named_without_loading_the_reader_of_svg() -> None:
    code = (
        "import sys; from inhand.tracing import drawings; drawings.find_drawing('A');"
        " raise SystemExit(bool({'svgpathtools', 'cssselect2', 'ezdxf'} & {*sys.modules}))"
    )

    async def run() -> int:
        process = await asyncio.create_subprocess_exec(sys.executable, "-c", code)
        return await process.wait()

    assert asyncio.run(run()) == 0
