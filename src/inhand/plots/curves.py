"""What an asterisk is drawn from: one curve per direction, and the shapes that follow from it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array, perpendicular, unit
from inhand.plots.shapes import Extent, SceneOutline, check_points, extent_of, joined, scene_points

LABEL_SHARE = 0.12
"""Room around the curves for the distances at their tips, as a share of their width: in panels three digits need as
much, or they would cover the numbers of the axis."""


@dataclass(frozen=True, eq=False)
class PathCurve:
    """One line of an asterisk: a trial, or the average of several, along one direction.

    Raises:
        InputError: the points are not `(N, 2)`, the band has another length, or the angle is not finite.
    """

    angle_deg: float
    """The direction [deg], counter-clockwise from +x."""
    name: str
    """What the legend says: the thesis name of the direction."""
    points_mm: Array
    """The path `(N, 2)` [mm] from the object's start; NaN rows are gaps, N may be 0."""
    label_mm: float
    """The distance to write at the tip [mm]; NaN writes nothing."""
    band_mm: Array | None = None
    """Spread `(N,)` of the lateral part [mm], drawn to both sides as a band."""
    failed: bool = False
    """Whether the contact was lost; marked at the end of the path."""
    limit_mm: float | None = None
    """How far the hand can reach in this direction [mm], drawn as the end of the target line."""
    target_mm: Array | None = None
    """A reference path `(M, 2)` [mm] that is not straight; None for the straight line along the direction."""

    def __post_init__(self) -> None:
        """Check the shapes once, where the curve is made."""
        check_points(self.points_mm, f"path {self.name!r}")
        if self.target_mm is not None:
            check_points(self.target_mm, f"target of path {self.name!r}")
        if not np.isfinite(self.angle_deg):
            raise InputError(f"path {self.name!r} has angle {self.angle_deg}: give a finite angle in degrees")
        if self.band_mm is not None and np.shape(self.band_mm) != (len(self.points_mm),):
            raise InputError(
                f"path {self.name!r} has a band of shape {np.shape(self.band_mm)} for {len(self.points_mm)} points: "
                "give one number [mm] per point"
            )


def true_runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first index and length of every unbroken run of True in `(N,)`."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(first), int(last - first)) for first, last in edges.reshape(-1, 2)]


def tip(curve: PathCurve) -> Array:
    """Return the last finite point `(2,)` [mm] of a curve, the origin where there is none."""
    finite = curve.points_mm[np.isfinite(curve.points_mm).all(axis=1)]
    return np.asarray(finite[-1] if len(finite) else np.zeros(2), dtype=float)


def band_polygons(curve: PathCurve) -> list[Array]:
    """Return the corners `(2 M, 2)` [mm] of the band, one polygon for each stretch without a gap.

    The band lies across the direction of the curve, not across the line, because it is the spread of the
    lateral part.
    """
    if curve.band_mm is None:
        return []
    across = perpendicular(unit(np.deg2rad(curve.angle_deg))) * curve.band_mm[:, None]
    finite = np.isfinite(curve.points_mm).all(axis=1) & np.isfinite(curve.band_mm)
    stretches = [slice(first, first + length) for first, length in true_runs(finite) if length > 1]
    left, right = curve.points_mm + across, curve.points_mm - across
    return [np.concatenate([left[part], right[part][::-1]]) for part in stretches]


def clockwise_from_out(curves: Sequence[PathCurve]) -> list[PathCurve]:
    """Return the curves in the order of the test: Out first, then clockwise."""
    return sorted(curves, key=lambda curve: (90.0 - curve.angle_deg) % 360.0)


def target_length(curves: Sequence[PathCurve]) -> float:
    """Return the common length of the target lines [mm]: the farthest progress, rounded up to ten."""
    farthest = [10.0]
    for curve in curves:
        along = curve.points_mm @ unit(np.deg2rad(curve.angle_deg))
        farthest.extend(float(value) for value in (*along, curve.label_mm) if np.isfinite(value))
    return float(np.ceil(max(farthest) / 10.0) * 10.0)


def target_path(curve: PathCurve, common_mm: float) -> Array:
    """Return a curve's target `(M, 2)` [mm]: its own, or straight to its reach limit, or else of the common length."""
    if curve.target_mm is not None:
        return curve.target_mm
    length = common_mm if curve.limit_mm is None else curve.limit_mm
    return np.stack([np.zeros(2), length * unit(np.deg2rad(curve.angle_deg))])


def limit_outline(curves: Sequence[PathCurve]) -> Array:
    """Return the corners `(N, 2)` [mm] of the outline through the reach limits; none for fewer than three of them."""
    known = [curve for curve in curves if curve.limit_mm is not None]
    limits = {curve.angle_deg % 360.0: target_path(curve, 0.0)[-1] for curve in known}
    return np.array([limits[angle] for angle in sorted(limits)]) if len(limits) > 2 else np.empty((0, 2))


def curves_extent(curves: Sequence[PathCurve], outline: SceneOutline | None, target_mm: float) -> Extent:
    """Return what the axes of an asterisk must show: every curve, target and label, and the whole outline."""
    drawn = [np.zeros((1, 2))]
    for curve in curves:
        drawn += [curve.points_mm, target_path(curve, target_mm), *band_polygons(curve)]
    points = np.concatenate(drawn)
    left, right, _, _ = extent_of(points, 0.0)
    around = extent_of(points, LABEL_SHARE * (right - left), least_mm=40.0)
    return around if outline is None else joined([around, extent_of(scene_points(outline), 6.0)])
