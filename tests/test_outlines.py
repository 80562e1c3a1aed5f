"""Outlines given by their corners: what is refused, the order they come into, and the pieces they are cut into."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from brute_contacts import nearest_contact
from inhand.errors import InputError
from inhand.geometry import Array, cross
from inhand.hands.convex import convex_parts
from inhand.hands.files import load_object
from inhand.hands.objects import CATALOGUE, ObjectSpec, convex_pieces, polygon, polygon_object, stacked_pieces
from inhand.hands.outlines import segments_meet
from inhand.hands.polygons import separation, with_corners

ELL = ((0.0, 0.0), (0.03, 0.0), (0.03, 0.01), (0.01, 0.01), (0.01, 0.04), (0.0, 0.04))


def area(corners: Array) -> float:
    """Signed area of a polygon, positive where its corners run counter-clockwise."""
    return float(cross(corners, np.roll(corners, -1, axis=0)).sum() / 2)


def inside(points: Array, corners: Array) -> Array:
    """Whether points `(N, 2)` lie in a polygon `(K, 2)`: a ray to the right crosses an odd number of edges."""
    (x0, y0), (x1, y1) = corners.T, np.roll(corners, -1, axis=0).T
    x, y = points.T[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        ahead = ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return np.asarray(ahead.sum(axis=-1) % 2 == 1)


@pytest.mark.parametrize("corners", [ELL, ELL[::-1], ELL[2:] + ELL[:2]])
def test_an_outline_runs_counter_clockwise_around_the_middle_of_its_box(
    corners: tuple[tuple[float, float], ...],
) -> None:
    spec = polygon_object("ell", corners, 0.09)
    assert spec.shape == "polygon"
    np.testing.assert_allclose(spec.size, (0.03, 0.04, 0.09))
    np.testing.assert_allclose(area(polygon(spec)), 6e-4)
    np.testing.assert_allclose(sorted(spec.corners), sorted((x - 0.015, y - 0.02) for x, y in ELL), atol=1e-15)


def test_corners_that_do_not_turn_are_left_out() -> None:
    square = [(0, 0), (0.01, 0), (0.02, 0), (0.02, 0.02), (0.013, 0.02), (0.006, 0.02), (0, 0.02), (0, 0.007)]
    spec = polygon_object("square", square)
    np.testing.assert_allclose(spec.corners, [(-0.01, -0.01), (0.01, -0.01), (0.01, 0.01), (-0.01, 0.01)], atol=1e-15)


def test_a_size_stretches_the_outline_and_a_cleaned_one_keeps_its_bytes() -> None:
    spec = ObjectSpec("ell", "polygon", (0.06, 0.02, 0.1), corners=ELL)
    np.testing.assert_allclose(np.ptp(np.array(spec.corners), axis=0), (0.06, 0.02))
    np.testing.assert_allclose(area(polygon(spec)), 6e-4)
    assert ObjectSpec("ell", "polygon", spec.size, corners=spec.corners).corners == spec.corners


REFUSED = [
    ([(0, 0), (30, 0)], "object 'x': an outline of 2 corners [(0, 0) mm, (30, 0) mm]; it needs three or more corners"),
    (
        [(0, 0), (40, 40), (40, 0), (0, 40)],
        "object 'x': the outline meets itself: the edge from (0, 0) mm to (40, 40) mm and the edge from (40, 0) mm to"
        " (0, 40) mm; give the corners in their order round the outline, so that edges share nothing but corners",
    ),
    ([(0, 0), (30, 0), (30, 30), (15, 0)], "the edge from (0, 0) mm to (30, 0) mm and the edge from (30, 30) mm to"),
    ([(0, 0), (30, 0), (20, 0), (20, 20)], "the edge from (0, 0) mm to (30, 0) mm and the edge from (20, 0) mm to"),
    ([(0, 0), (30, 0), (30, 20), (30, -10), (0, -20)], "(0, 0) mm to (30, 0) mm and the edge from (30, 20) mm to (30,"),
    ([(0, 0), (30, 0), (30, 30), (30, 0.00001), (10, 20)], "corners 2 and 4 of the outline are both (30, 0) mm; give"),
    ([(0, 0), (30, 0), (0, 0), (30, 30)], "object 'x': corners 1 and 3 of the outline are both (0, 0) mm; give each"),
    ([(0, 0), (30, 0), (30, 0), (0, 30)], "object 'x': corners 2 and 3 of the outline are both (30, 0) mm; give each"),
    ([(0, 0), (10, 10), (30, 30)], "(0, 0) mm, (10, 10) mm, (30, 30) mm lie on one line; an outline must have an area"),
    ([(0, 0), (np.nan, 0), (30, 30)], "object 'x': corner 2 of the outline is (nan, 0) mm; give finite numbers"),
    ([(0, 0), (30, 0), (30, np.inf)], "object 'x': corner 3 of the outline is (30, inf) mm; give finite numbers"),
]


@pytest.mark.parametrize(("corners_mm", "text"), REFUSED)
def test_outlines_that_no_object_has_are_refused(corners_mm: list[tuple[float, float]], text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        polygon_object("x", [(x / 1e3, y / 1e3) for x, y in corners_mm])


FILE = """
name = "ell"
shape = "polygon"
corners_mm = [[0, 0], [0, 40], [10, 40], [10, 10], [30, 10], [30, 0]]
height_mm = 96
mass_kg = 0.045
friction = 0.8
"""


def test_an_object_file_gives_an_outline(tmp_path: Path) -> None:
    path = tmp_path / "ell.toml"
    path.write_text(FILE)
    spec = load_object(path)
    assert (spec.name, spec.shape, spec.mass, spec.friction) == ("ell", "polygon", 0.045, 0.8)
    np.testing.assert_allclose(spec.size, (0.03, 0.04, 0.096))
    np.testing.assert_allclose(sorted(spec.corners), sorted((x - 0.015, y - 0.02) for x, y in ELL), atol=1e-15)
    path.write_text(FILE.replace("mass_kg = 0.045\nfriction = 0.8\n", ""))
    assert (load_object(path).mass, load_object(path).friction) == (0.03, 1.0)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("corners_mm", "corner_mm", "object file {}: unknown key 'corner_mm'; did you mean corners_mm"),
        (
            "height_mm = 96",
            "size_mm = [30, 40, 96]",
            "object file {}: unknown key 'size_mm'; did you mean height_mm?; allowed",
        ),
        ("height_mm = 96", "", "object file {}: no 'height_mm'; it must give name, shape, corners_mm, height_mm"),
        ("[[0, 0], [0, 40],", "[0, [0, 40],", "object file {}: corners_mm = 0; it must be a list of numbers"),
        ("[10, 40]", "[10, 40, 3]", "object file {}: corner 3 of corners_mm is [10.0, 40.0, 3.0]; it must be [x, y]"),
        ("[10, 40]", '[10, "40"]', "object file {}: corners_mm = '40'; it must be a finite number"),
        ("height_mm = 96", "height_mm = -96", "object 'ell': size [30, 40, -96] mm; size needs three positive lengths"),
        ("[30, 10], [30, 0]", "[30, 0], [30, 10]", "object 'ell': the outline meets itself: the edge from"),
        (", [10, 40], [10, 10], [30, 10], [30, 0]]", "]", "object 'ell': an outline of 2 corners"),
    ],
)
def test_what_a_polygon_file_may_not_say(tmp_path: Path, old: str, new: str, text: str) -> None:
    assert old in FILE
    path = tmp_path / "ell.toml"
    path.write_text(FILE.replace(old, new))
    with pytest.raises(InputError, match=re.escape(text.format(path))):
        load_object(path)


def test_corners_that_are_no_list_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "ell.toml"
    path.write_text('name = "e"\nshape = "polygon"\ncorners_mm = "square"\nheight_mm = 9')
    with pytest.raises(InputError, match=r"corners_mm = 'square'; it must be a list of corners \[x, y\] in mm"):
        load_object(path)


def star(seed: int, count: int) -> Array:
    """A polygon whose corners turn once around the origin, at any distances."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(count) + rng.uniform(0.05, 0.95, count)) / count
    return np.asarray(rng.uniform(0.005, 0.03, count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def untangled(seed: int, count: int) -> Array:
    """A polygon through random points: crossings are undone one by one, each of which makes it shorter."""
    points = np.random.default_rng(seed).uniform(-0.03, 0.03, (count, 2))
    for _ in range(1000):
        after = np.roll(points, -1, axis=0)
        i, j = np.triu_indices(count, 2)
        apart = ~((i == 0) & (j == count - 1))
        meet = segments_meet((points[i], after[i]), (points[j], after[j])) & apart
        if not meet.any():
            break
        one, other = int(i[meet][0]), int(j[meet][0])
        points[one + 1 : other + 1] = points[one + 1 : other + 1][::-1].copy()
    return points if area(points) > 0 else points[::-1]


@settings(deadline=None, max_examples=60)
@given(st.sampled_from([star, untangled]), st.integers(0, 10**6), st.integers(3, 24))
def test_convex_pieces_are_convex_and_together_the_outline(make: type, seed: int, count: int) -> None:
    try:
        spec = polygon_object("any", make(seed, count))
    except InputError:
        assume(False)
    corners, pieces = polygon(spec), convex_pieces(spec)
    for piece in pieces:
        before, after = piece - np.roll(piece, 1, axis=0), np.roll(piece, -1, axis=0) - piece
        assert (cross(before, after) > -1e-6 * np.linalg.norm(before, axis=-1) * np.linalg.norm(after, axis=-1)).all()
        np.testing.assert_allclose(np.arctan2(cross(before, after), (before * after).sum(-1)).sum(), 2 * np.pi)
    np.testing.assert_allclose(sum(area(piece) for piece in pieces), area(corners), rtol=1e-5)
    points = np.random.default_rng(seed).uniform(-0.03, 0.03, (500, 2))
    covered = np.sum([inside(points, piece) for piece in pieces], axis=0)
    assert (covered == inside(points, corners)).mean() > 0.998  # a point on a cut may be in both or neither
    inward = corners[_turn(corners) < -1e-6]
    assert len(pieces) <= 2 * len(inward) + 1
    assert len(pieces) >= np.ceil(len(inward) / 2) + (len(inward) > 0)


def _turn(corners: Array) -> Array:
    before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
    return np.asarray(np.arctan2(cross(before, after), (before * after).sum(-1)))


def test_a_convex_object_is_one_piece_the_concave_ones_several() -> None:
    counts = {name: len(convex_pieces(spec)) for name, spec in CATALOGUE.items()}
    assert {name: count for name, count in counts.items() if count > 1} == {"hourglass": 2, "concave_square": 3}
    for spec in CATALOGUE.values():
        if counts[spec.name] == 1:
            np.testing.assert_array_equal(convex_pieces(spec)[0], polygon(spec))


def test_two_inward_corners_that_see_each_other_take_one_cut() -> None:
    low, high = sorted(convex_pieces(CATALOGUE["hourglass"]), key=lambda piece: float(piece[:, 1].mean()))
    np.testing.assert_allclose(sorted(map(tuple, low)), [(-0.02, -0.02), (-0.014, 0), (0.014, 0), (0.02, -0.02)])
    np.testing.assert_allclose(sorted(map(tuple, high)), [(-0.02, 0.02), (-0.014, 0), (0.014, 0), (0.02, 0.02)])


def test_pieces_cannot_be_written_to() -> None:
    with pytest.raises(ValueError, match="read-only"):
        convex_pieces(CATALOGUE["hourglass"])[0][0, 0] = 1.0


def test_corners_too_near_to_cut_apart_are_refused() -> None:
    teeth = np.array([(0, 0), (4, 0), (4, 1), (2, 1e-9), (0, 1)]) * 1e-2
    teeth[3, 1] = 1e-12
    with pytest.raises(InputError, match="cannot be cut into convex pieces: corners and edges are too near"):
        convex_parts(np.concatenate([teeth[:1], [[0.02, 5e-12]], teeth[1:]]))


def test_more_corners_leave_a_polygon_as_it_is() -> None:
    corners = polygon(CATALOGUE["triangle"])
    more = with_corners(corners, 7)
    assert more.shape == (7, 2)
    np.testing.assert_array_equal(more[:3], corners)
    np.testing.assert_allclose(area(more), area(corners))
    far = corners + np.array([0.05, 0.01])
    assert separation(more, far) == pytest.approx(float(separation(corners, far)))
    np.testing.assert_array_equal(with_corners(corners, 3), corners)


def test_objects_of_different_pieces_lie_side_by_side() -> None:
    specs = [CATALOGUE[name] for name in ("concave_square", "triangle", "hourglass")]
    stacks = stacked_pieces(specs)
    assert [stack.shape for stack in stacks] == [(3, 4, 2), (3, 4, 2), (3, 6, 2)]
    point = np.array([(0.03, 0.0), (0.04, -0.01), (0.04, 0.01)])
    for row, spec in enumerate(specs):
        alone = nearest_contact(point, convex_pieces(spec))
        together = nearest_contact(point, [stack[row] for stack in stacks])
        for found, expected in zip(together, alone, strict=True):
            np.testing.assert_allclose(found, expected, atol=1e-15)
