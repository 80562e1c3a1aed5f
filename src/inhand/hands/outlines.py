"""Outlines given by their corners: what is refused, the order they are brought into, points along them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array, cross, distance_to
from inhand.hands.polygons import edge_normals
from inhand.hands.sizes import check_outline_size

Corners = tuple[tuple[float, float], ...]
"""Corners of an outline (x, y) [m]."""

TOUCH = 1e-7
"""Points and edges nearer than this are taken to meet [m]."""
STRAIGHT = 1e-6
"""A corner that turns by less than this is no corner [rad]."""
MOST_CORNERS = 1000
"""Corners that an outline may have: every pair of its edges is looked at."""


def clean_outline(name: str, corners: Sequence[Sequence[float]]) -> Corners:
    """Return an outline counter-clockwise, around the centre of its bounding box, without corners that do not turn.

    A last corner that is the first one again, as drawing programs close a line, is dropped.

    Raises:
        InputError: fewer than three corners or more than `MOST_CORNERS`, one that is not finite or repeated, all on one
            line, an outline too small or too large, or edges that meet.
    """
    if len(corners) > 3 and np.abs(np.subtract(corners[0], corners[-1], dtype=float)).max() < TOUCH:
        corners = corners[:-1]
    if len(corners) < 3:
        raise InputError(
            f"object {name!r}: an outline of {len(corners)} corners [{_listed(corners)}]; it needs three or more"
            " corners (x, y): add the missing ones"
        )
    if len(corners) > MOST_CORNERS:
        raise InputError(
            f"object {name!r}: an outline of {len(corners):,} corners; it may have {MOST_CORNERS:,}: leave out those"
            " that hardly turn"
        )
    points = np.array(corners, dtype=float)
    _check_points(name, points)
    _check_edges(name, points)
    points = without_straight_corners(points if signed_area(points) > 0 else points[::-1])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    if np.abs(middle).max() > 1e-12:  # an outline that was cleaned before keeps its bytes
        points = points - middle
    return tuple((float(x), float(y)) for x, y in points)


def stretched(corners: Corners, size: Sequence[float]) -> Corners:
    """Return an outline around its middle stretched to a full extent along x and y [m]."""
    points = np.array(corners)
    scale = np.array(size[:2]) / np.ptp(points, axis=0)
    if np.abs(scale - 1).max() < 1e-9:
        return corners
    return tuple((float(x), float(y)) for x, y in points * scale)


def signed_area(corners: Array) -> float:
    """Return the area [m^2] of a polygon `(K, 2)`, negative where its corners run clockwise."""
    return float(cross(corners, np.roll(corners, -1, axis=0)).sum() / 2)


def centroid(corners: Array) -> Array:
    """Return the centre of area `(2,)` of a polygon `(K, 2)`, counter-clockwise."""
    after = np.roll(corners, -1, axis=0)
    area = corners[:, 0] * after[:, 1] - after[:, 0] * corners[:, 1]
    return np.asarray((area[:, None] * (corners + after)).sum(axis=0) / (3 * area.sum()))


def second_moments(corners: Array) -> Array:
    """Return the mean of (x, y)' (x, y) over a polygon `(K, 2)`, from its centre of area: a matrix `(2, 2)` [m^2]."""
    a = corners - centroid(corners)
    b = np.roll(a, -1, axis=0)
    mixed = a[:, :, None] * b[:, None]
    both = 2 * (a[:, :, None] * a[:, None] + b[:, :, None] * b[:, None]) + mixed + np.swapaxes(mixed, 1, 2)
    return np.asarray((cross(a, b)[:, None, None] * both).sum(axis=0) / (24 * signed_area(a)))


def turns(corners: Array) -> Array:
    """Return the sine of the turn at each corner `(K,)` of a polygon `(K, 2)`; left turns are positive."""
    after = np.roll(corners, -1, axis=0) - corners
    after = after / np.linalg.norm(after, axis=-1, keepdims=True)
    return cross(np.roll(after, 1, axis=0), after)


def without_straight_corners(corners: Array) -> Array:
    """Return a polygon `(K, 2)` without the corners at which it does not turn."""
    return np.asarray(corners[np.abs(turns(corners)) > STRAIGHT])


def points_along(corners: Array, step: float) -> tuple[Array, Array]:
    """Return points `(N, 2)` on the edges, none on a corner, and the outward unit normals there `(N, 2)`.

    The polygon `(K, 2)` [m] is counter-clockwise; neighbouring points are at most a step [m] apart.
    """
    edges = np.roll(corners, -1, axis=0) - corners
    counts = np.maximum(1, np.ceil(np.linalg.norm(edges, axis=-1) / step - 1e-9).astype(int))
    share = np.concatenate([(np.arange(count) + 0.5) / count for count in counts])
    points = np.repeat(corners, counts, axis=0) + share[:, None] * np.repeat(edges, counts, axis=0)
    return points, np.repeat(edge_normals(corners), counts, axis=0)


def segments_meet(first: tuple[Array, Array], second: tuple[Array, Array]) -> NDArray[np.bool_]:
    """Return whether segments, each from points to points `(..., 2)` [m], cross or come nearer than `TOUCH`."""
    (a, b), (c, d) = first, second
    crossing = (cross(b - a, c - a) * cross(b - a, d - a) < 0) & (cross(d - c, a - c) * cross(d - c, b - c) < 0)
    near = [distance_to(point, c, d) for point in (a, b)] + [distance_to(point, a, b) for point in (c, d)]
    return np.asarray(crossing | (np.minimum.reduce(near) < TOUCH))


def _check_points(name: str, points: Array) -> None:
    if not np.isfinite(points).all():
        worst = int(np.argwhere(~np.isfinite(points))[0, 0])
        raise InputError(
            f"object {name!r}: corner {worst + 1} of the outline is {_listed(points[worst : worst + 1])}; give finite"
            " numbers"
        )
    check_outline_size(name, np.ptp(points, axis=0))
    apart = np.linalg.norm(points[:, None] - points, axis=-1) + np.eye(len(points))
    if apart.min() < TOUCH:
        one, other = sorted(int(k) for k in np.argwhere(apart < TOUCH)[0])
        raise InputError(
            f"object {name!r}: corners {one + 1} and {other + 1} of the outline are both"
            f" {_listed(points[one : one + 1])}; give each corner once"
        )
    middle = points - points.mean(axis=0)
    if np.linalg.svd(middle, compute_uv=False)[1] < TOUCH:
        raise InputError(
            f"object {name!r}: the outline's corners {_listed(points)} lie on one line; an outline must have an area"
        )


def _check_edges(name: str, points: Array) -> None:
    count, after = len(points), np.roll(points, -1, axis=0)
    one, other = np.triu_indices(count, 1)
    following = (other - one == 1) | ((one == 0) & (other == count - 1))
    meet = segments_meet((points[one], after[one]), (points[other], after[other])) & ~following
    # An edge that folds back on the one before takes its next neighbour with it: that one meets an edge too.
    if meet.any():
        first, second = (f"{_listed(points[[k]])} to {_listed(after[[k]])}" for k in (one[meet][0], other[meet][0]))
        raise InputError(
            f"object {name!r}: the outline meets itself: the edge from {first} and the edge from {second}; give"
            " the corners in their order round the outline, so that edges share nothing but corners"
        )


def _listed(points: Sequence[Sequence[float]] | Array) -> str:
    """Return points [m] as text in mm."""
    return ", ".join("(" + ", ".join(f"{1e3 * float(value):.6g}" for value in point) + ") mm" for point in points)
