"""Contact and separation of convex polygons, against slow geometry that shares no line with them."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, QhullError

from inhand.geometry import Array, cross, rotate
from inhand.hands.polygons import MANY, contact, edge_normals, separation

COORDINATE = st.floats(-0.05, 0.05)
POINTS = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=3, max_size=12)
SQUARE = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) * 0.02
DIRECTIONS = np.stack([np.cos(np.arange(720) * np.pi / 360), np.sin(np.arange(720) * np.pi / 360)], axis=-1)


def hull(points: list[tuple[float, float]]) -> Array:
    """The convex hull, counter-clockwise, of points that span some area."""
    corners = np.array(points)
    try:
        corners = corners[ConvexHull(corners).vertices]
    except QhullError:
        assume(condition=False)
    edges = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=-1)
    assume(edges.min() > 1e-3)
    assume(cross(corners, np.roll(corners, -1, axis=0)).sum() > 2e-4)
    return np.asarray(corners)


def distance_of(first: Array, second: Array) -> tuple[float, bool]:
    """Distance of two polygons that do not overlap, and whether it is from a corner to the inside of an edge."""
    return min(
        _from_segment(corner, start, end)
        for corners, other in ((first, second), (second, first))
        for corner in corners
        for start, end in zip(other, np.roll(other, -1, axis=0), strict=True)
    )


def _from_segment(point: Array, start: Array, end: Array) -> tuple[float, bool]:
    way = end - start
    share = (point - start) @ way / (way @ way)
    nearest = start + np.clip(share, 0, 1) * way
    return float(np.linalg.norm(point - nearest)), bool(0.001 < share < 0.999)


def overlap_depth(first: Array, second: Array) -> float:
    """The shortest move of `first` that ends the overlap, from below, over many directions; negative where apart."""
    reach = (DIRECTIONS @ first.T).max(axis=1)  # how far each polygon extends in every direction
    behind = (DIRECTIONS @ second.T).min(axis=1)
    return float((reach - behind).min())


def pairs() -> st.SearchStrategy[tuple[Array, Array]]:
    shift = st.floats(-0.12, 0.12)
    return st.builds(lambda a, b, x, y: (hull(a), hull(b) + np.array([x, y])), POINTS, POINTS, shift, shift)


@settings(deadline=None, max_examples=50)
@given(pairs())
def test_separation_is_the_distance_or_corner_to_corner_a_lower_bound(pair: tuple[Array, Array]) -> None:
    first, second = pair
    found = float(separation(first, second))
    assume(overlap_depth(first, second) < -1e-6)
    distance, to_an_edge = distance_of(first, second)
    assert 0 < found <= distance + 1e-12
    if to_an_edge:
        np.testing.assert_allclose(found, distance, rtol=1e-9)


@settings(deadline=None, max_examples=50)
@given(POINTS, st.integers(0, 11), st.floats(0.1, 0.9), st.floats(1e-4, 0.05), st.floats(-0.5, 0.5))
def test_separation_is_the_distance_from_corner_to_face(
    points: list[tuple[float, float]], edge: int, along: float, gap: float, turn: float
) -> None:
    second = hull(points)
    edge %= len(second)
    normal = edge_normals(second)[edge]
    foot = second[edge] + along * (second[(edge + 1) % len(second)] - second[edge])
    # A triangle that stands on its tip over the middle of the face.
    heading = np.arctan2(normal[1], normal[0]) + turn
    first = foot + gap * normal + rotate(heading, np.array([(0.0, 0.0), (0.03, -0.01), (0.03, 0.01)]))
    found, point, towards = contact(first, second)
    np.testing.assert_allclose(found, gap, atol=1e-12)
    np.testing.assert_allclose(found, distance_of(first, second)[0], atol=1e-12)
    np.testing.assert_allclose(point, first[0], atol=1e-12)
    np.testing.assert_allclose(towards, normal, atol=1e-9)
    assert float(separation(first, second)) == float(found)


@settings(deadline=None, max_examples=50)
@given(POINTS, POINTS, st.floats(-0.02, 0.02), st.floats(-0.02, 0.02))
def test_overlap_is_the_shortest_way_out(
    a: list[tuple[float, float]], b: list[tuple[float, float]], x: float, y: float
) -> None:
    first, second = hull(a), hull(b) + np.array([x, y])
    sampled = overlap_depth(first, second)
    assume(sampled > 1e-5)
    depth, _, normal = contact(first, second)
    # Half a degree between the sampled directions leaves at most this, for polygons 0.2 m wide together.
    assert -sampled - 1e-12 <= depth <= -sampled + 0.2 * np.deg2rad(0.25) + 1e-12
    assert abs(overlap_depth(first - depth * normal, second)) <= 0.2 * np.deg2rad(0.25)
    np.testing.assert_allclose(separation(first - depth * normal, second), 0.0, atol=1e-12)


@settings(deadline=None, max_examples=50)
@given(pairs())
def test_the_contact_is_a_corner_at_its_height_over_the_other_polygon(pair: tuple[Array, Array]) -> None:
    first, second = pair
    found, point, normal = contact(first, second)
    on_first = np.linalg.norm(first - point, axis=-1).min() < 1e-15
    on_second = np.linalg.norm(second - point, axis=-1).min() < 1e-15
    assert on_first or on_second
    np.testing.assert_allclose(np.linalg.norm(normal), 1.0)
    np.testing.assert_allclose((first @ normal).min() - (second @ normal).max(), found, atol=1e-12)


@settings(deadline=None, max_examples=50)
@given(pairs(), st.floats(-3.0, 3.0))
def test_frames_and_order_do_not_matter(pair: tuple[Array, Array], turn: float) -> None:
    first, second = pair
    found = separation(first, second)
    np.testing.assert_allclose(separation(second, first), found, atol=1e-12)
    np.testing.assert_allclose(contact(first, second)[0], found, atol=1e-15)
    np.testing.assert_allclose(separation(rotate(turn, first), rotate(turn, second)), found, atol=1e-12)
    mirror = np.array([-1.0, 1.0])
    np.testing.assert_allclose(separation(first[::-1] * mirror, second[::-1] * mirror), found, atol=1e-12)


def test_squares_side_by_side_and_overlapping() -> None:
    gap, point, normal = contact(SQUARE + np.array([0.05, 0.0]), SQUARE)
    np.testing.assert_allclose(gap, 0.01)
    np.testing.assert_allclose(normal, (1, 0))
    np.testing.assert_allclose(np.abs(point - (0.025, 0.0)), (0.005, 0.02))
    depth, _, normal = contact(SQUARE, SQUARE + np.array([0.005, 0.035]))
    np.testing.assert_allclose(depth, -0.005)
    np.testing.assert_allclose(normal, (0, -1), atol=1e-12)


def test_corner_to_corner_is_bounded_from_below() -> None:
    np.testing.assert_allclose(separation(SQUARE + 0.05, SQUARE), 0.01)
    np.testing.assert_allclose(distance_of(SQUARE + 0.05, SQUARE)[0], 0.01 * np.sqrt(2))


def test_edge_normals_point_outwards() -> None:
    np.testing.assert_allclose(edge_normals(SQUARE), [(0, -1), (1, 0), (0, 1), (-1, 0)], atol=1e-15)


def test_leading_axes_broadcast() -> None:
    rng = np.random.default_rng(18)
    first = SQUARE + rng.uniform(-0.08, 0.08, (4, 3, 1, 2))
    second = np.array([(0.0, 0.0), (0.03, 0.0), (0.04, 0.02), (0.0, 0.03), (-0.01, 0.01)])
    batch = contact(first, second)
    assert [part.shape for part in batch] == [(4, 3), (4, 3, 2), (4, 3, 2)]
    swapped = contact(second, first)
    np.testing.assert_array_equal(separation(first, second), batch[0])
    np.testing.assert_allclose(swapped[0], batch[0], atol=1e-15)
    for i, j in np.ndindex(4, 3):
        for part, alone in zip(batch, contact(first[i, j], second), strict=True):
            np.testing.assert_allclose(part[i, j], alone, atol=1e-15)
    many = second + rng.uniform(-0.05, 0.05, (4, 3, 1, 2))
    np.testing.assert_allclose(contact(first, many)[0][2, 1], contact(first[2, 1], many[2, 1])[0], atol=1e-15)


@settings(deadline=None, max_examples=30)
@given(pairs())
def test_many_cases_have_the_bytes_of_one(pair: tuple[Array, Array]) -> None:
    """Compiled code finds the contacts of a batch, NumPy those of a real hand."""
    first, second = pair
    shifts = 0.01 * np.stack([np.cos(np.arange(MANY)), np.sin(np.arange(MANY))], axis=-1)
    together = contact(first + shifts[:, None], second)
    for k, shift in enumerate(shifts):
        for batch, alone in zip(together, contact(first + shift, second), strict=True):
            assert batch[k].tobytes() == alone.tobytes()
    assert np.isnan(contact(first + shifts[:, None] * np.nan, second)[0]).all()
