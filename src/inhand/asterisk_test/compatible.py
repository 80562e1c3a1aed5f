"""Metrics as the Asterisk Test software defines them, to compare with published figures.

In its normalised units (x by the span, y by the depth of the hand). Differences on purpose: where that software
returns -1, or 1.0 for an area, because something is undefined, this one returns NaN; the window of the largest
area is reported at its own centre, not one step further; any angle is a direction. For everything else use
`inhand.asterisk_test.metrics`.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from inhand import geometry
from inhand.asterisk_test.metrics import check_rows
from inhand.geometry import Array, frechet

LINE_LENGTH = 0.5
"""Length of the target line, normalised."""
LINE_POINTS = 100
"""Points on the target line."""
WINDOW = 0.2
"""Width of the sliding window, as a share of dist."""
WINDOW_STEP = 0.01
"""Step of the sliding window, as a share of dist."""


@dataclass(frozen=True)
class AsteriskMetrics:
    """Metrics of one trial, normalised (docs/metrics.md, Metrics). NaN where one is not defined."""

    dist: float
    """How far the target line is followed; rotation only: largest angle turned [deg]."""
    arc_len: float
    """Length of the path; rotation only: over x, y and degrees."""
    mvt_eff: float
    """dist / arc_len; can pass 1."""
    max_err: float
    """Largest lateral distance of the raw path / arc_len; NaN for rotation only."""
    max_err_rot: float
    """Largest rotation error [deg] / arc_len; NaN for rotation only."""
    t_fd: float
    """Discrete Frechet distance to the target line; rotation only: to the start."""
    fd: float
    """The same over x, y and degrees; rotation only: to turning as recorded without drift."""
    area_btwn: float
    """Area between path and target line, pairing points by index, so not a geometric area."""
    max_a_reg: float
    """Largest area inside a sliding window; NaN where a window holds fewer than two points."""
    max_a_loc: float
    """Centre of that window / 0.5."""


def measure_asterisk(
    path: Array,
    rotation_deg: Array,
    angle_deg: float | None,
    *,
    target_rotation_deg: float = 0.0,
    raw_path: Array | None = None,
) -> AsteriskMetrics:
    """Return the metrics of the Asterisk Test software for one trial.

    Positions `(T, 2)` count from the start, normalised (`hand_sizes.normalise`). Rotations `(T,)` [deg] and the one to
    hold have one sign; a trial that only rotates has no direction. Where `raw_path` gives the unfiltered positions `(U,
    2)`, `max_err` and the sliding window are of those.

    Raises:
        InputError: wrong shapes, no row, or a value that is not finite.
    """
    path, turn = np.asarray(path, dtype=float), np.asarray(rotation_deg, dtype=float)
    raw = path if raw_path is None else np.asarray(raw_path, dtype=float)
    check_rows(path, turn)
    check_rows(raw, np.zeros(len(raw)))
    return _measure(path, turn, raw, angle_deg, target_rotation_deg)


def _measure(path: Array, turn: Array, raw: Array, angle_deg: float | None, target_deg: float) -> AsteriskMetrics:
    if angle_deg is None:  # the target is its own rotation without drift
        target, level, points = np.zeros_like(path), turn, np.column_stack([path, turn])
        dist = float(np.abs(turn).max())
        lateral = rotation = region = centre = math.nan
    else:
        dist, target = _target(path[-1], geometry.unit(math.radians(angle_deg)))
        level, points = np.full(len(target), target_deg), path
        aligned = geometry.rotate(-math.radians(angle_deg), raw)
        region, centre = _largest_window(aligned, dist)
        lateral, rotation = float(np.abs(aligned[:, 1]).max()), float(np.abs(turn - target_deg).max())
    arc_len = geometry.length(points)
    return AsteriskMetrics(
        dist=dist,
        arc_len=arc_len,
        mvt_eff=_over(dist, arc_len),
        max_err=_over(lateral, arc_len),
        max_err_rot=_over(rotation, arc_len),
        t_fd=frechet(path, target),
        fd=frechet(np.column_stack([path, turn]), np.column_stack([target, level])),
        area_btwn=_area(path, target),
        max_a_reg=region,
        max_a_loc=centre / LINE_LENGTH,
    )


def _target(end: Array, direction: Array) -> tuple[float, Array]:
    """Return how far the target line is followed by a path that ends at a point, and the line's points before it."""
    line = np.linspace(0.0, LINE_LENGTH, LINE_POINTS)
    nearest = int(np.argmin(np.linalg.norm(line[:, None] * direction - end, axis=1)))
    # The line ends before the sample nearest to the last pose; where that leaves nothing, its start remains.
    return float(line[min(nearest + 1, LINE_POINTS - 1)]), line[: max(nearest, 1), None] * direction


def _largest_window(aligned: Array, dist: float) -> tuple[float, float]:
    """Return the largest area inside a window sliding along x', and the window's centre, or NaN for both."""
    line = np.column_stack([np.linspace(0.0, LINE_LENGTH, LINE_POINTS), np.zeros(LINE_POINTS)])
    half = 0.5 * WINDOW * dist
    centres = half + WINDOW_STEP * dist * np.arange(round((1.0 - WINDOW) / WINDOW_STEP) + 1)
    areas = np.empty(len(centres))
    for i, centre in enumerate(centres):
        inside, below = (np.abs(each[:, 0] - centre) <= half for each in (aligned, line))
        areas[i] = _area(aligned[inside], line[below])
    # The first NaN wins argmax: without two points in every window the largest area is unknown.
    best = int(np.argmax(areas))
    return float(areas[best]), float(centres[best]) if math.isfinite(areas[best]) else math.nan


def _area(path: Array, target: Array) -> float:
    """Return the library's area between two curves, or NaN where one of them is no curve; it is imported now."""
    import similaritymeasures

    if min(len(path), len(target)) < 2:
        return math.nan
    shorter, longer = sorted((target, path), key=len)  # the longer one comes first, as the library has it
    return float(similaritymeasures.area_between_two_curves(longer, _filled(shorter, len(longer))))


def _filled(curve: Array, count: int) -> Array:
    """Return a curve `(count, 2)` with points put into the middle of its largest gaps.

    The library does the same, but measures all pairs of points again for each that it puts in: seconds for a
    recording of 700 rows.
    """
    points = curve.tolist()
    gaps = [_gap(*pair) for pair in pairwise(points)]
    while len(points) < count:
        k = gaps.index(max(gaps))
        one, other = points[k : k + 2]
        if one[0] >= other[0]:
            one, other = other, one
        middle = (one[0] + other[0]) / 2.0
        points.insert(k + 1, [middle, float(np.interp(middle, [one[0], other[0]], [one[1], other[1]]))])
        gaps[k : k + 1] = [_gap(*pair) for pair in pairwise(points[k : k + 3])]
    return np.array(points)


def _gap(one: list[float], other: list[float]) -> float:
    return math.sqrt((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2)


def _over(part: float, whole: float) -> float:
    """Return part / whole, or NaN where nothing moved."""
    return part / whole if whole > 0.0 else math.nan
