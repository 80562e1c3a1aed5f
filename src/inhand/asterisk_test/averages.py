"""Averages over the trials of one direction: the mean path, and means of metrics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from inhand import geometry
from inhand.asterisk_test.metrics import Metrics, check_rows
from inhand.errors import InputError
from inhand.geometry import Array

BIN_MM = 5.0
"""Width of a bin of progress, about [mm]."""
COMPAT_POINTS = 25
"""Points of the Asterisk Test's average along its target line."""
COMPAT_LENGTH = 0.5
"""Length of that line, normalised."""
COMPAT_HALF_WIDTH = 0.024
"""Half width of its bins, normalised."""


@dataclass(frozen=True, eq=False)
class AveragePath:
    """The mean path of several trials along one direction."""

    angle_deg: float
    """Direction counter-clockwise from +x [deg]."""
    points_mm: Array
    """Mean positions `(N, 2)` from the start, one per bin of progress; NaN where no trial has a row in the bin."""
    lateral_sd_mm: Array
    """Standard deviation across trials of the lateral part `(N,)`: the band. 0 where one trial alone counts."""
    rotation_deg: Array
    """Mean rotation `(N,)`; NaN where it is unknown."""
    count: Array
    """How many trials have a row in each bin `(N,)`."""


@dataclass(frozen=True, eq=False)
class CompatAverage:
    """The mean path by the rule of the Asterisk Test software, normalised."""

    angle_deg: float
    """Direction counter-clockwise from +x [deg]."""
    points: Array
    """Mean positions `(26, 2)`, the first the origin; NaN where no row lies in the bin."""
    rotation_deg: Array
    """Mean rotation `(26,)`."""
    count: Array
    """How many rows, not trials, each mean is over `(26,)`."""


class MeanSd(NamedTuple):
    """Mean and standard deviation of one metric."""

    mean: float
    """Mean over the trials."""
    sd: float
    """Standard deviation (n - 1), 0 for a single trial."""


def average_path(
    paths_mm: Sequence[Array],
    rotations_deg: Sequence[Array] | None,
    angle_deg: float,
    *,
    end_mm: float | None = None,
) -> AveragePath:
    """Return the mean path of several trials, every trial counting once.

    Rows are sorted into bins of progress; in each bin first the mean of each trial, then the mean and the
    standard deviation across trials. So a person who dwells, or walks the object, weighs no more than others.
    Rows after a trial's farthest progress are left out (release, or going back), and the line ends at
    a given progress. The bins are spread evenly, so that the first point is the start and the last that end.

    Args:
        paths_mm: Positions `(T_i, 2)` of each trial [mm], filtered.
        rotations_deg: Rotation `(T_i,)` of each [deg], or None where it is unknown.
        angle_deg: Direction counter-clockwise from +x [deg].
        end_mm: Progress at which the line ends [mm]; None for the mean of the trials' farthest.

    Raises:
        InputError: no trial, unequal numbers of paths and rotations, or rows that are not finite.
    """
    rows = _aligned(paths_mm, rotations_deg, angle_deg)
    rows = [each[: int(np.argmax(each[:, 0])) + 1] - each[0] * (1.0, 1.0, 0.0) for each in rows]
    end = float(np.mean([each[-1, 0] for each in rows])) if end_mm is None else end_mm
    centres = np.linspace(0.0, end, max(round(end / BIN_MM), 1) + 1) if end > 0.0 else np.zeros(1)
    half = centres[1] / 2 if len(centres) > 1 else BIN_MM / 2
    mean, lateral_sd, count = _across_trials(np.stack([_bin_means(each, centres, half) for each in rows]))
    points = geometry.rotate(math.radians(angle_deg), np.column_stack([centres, mean[:, 1]]))
    points[count == 0] = np.nan
    points[0] = 0.0
    return AveragePath(angle_deg, points, lateral_sd, mean[:, 2], count)


def compat_average(paths: Sequence[Array], rotations_deg: Sequence[Array], angle_deg: float) -> CompatAverage:
    """Return the mean path by the rule of the Asterisk Test software, to compare with published figures.

    All unfiltered rows of all trials together: the origin, then for t = linspace(0, 0.5, 25) the mean of the rows
    with |x' - t| <= 0.024, where x' is progress (docs/metrics.md, Averages).

    Args:
        paths: Unfiltered positions `(T_i, 2)` of each trial, normalised, from the trial's origin.
        rotations_deg: Rotation `(T_i,)` of each [deg].
        angle_deg: Direction counter-clockwise from +x [deg].

    Raises:
        InputError: no trial, unequal numbers of paths and rotations, or rows that are not finite.
    """
    rows = np.concatenate(_aligned(paths, rotations_deg, angle_deg))
    mean = np.zeros((COMPAT_POINTS + 1, 3))
    count = np.zeros(COMPAT_POINTS + 1)
    for i, t in enumerate(np.linspace(0.0, COMPAT_LENGTH, COMPAT_POINTS), start=1):
        near = np.abs(rows[:, 0] - t) <= COMPAT_HALF_WIDTH
        count[i] = near.sum()
        mean[i] = rows[near].mean(axis=0) if near.any() else np.nan
    points = geometry.rotate(math.radians(angle_deg), mean[:, :2])
    return CompatAverage(angle_deg, points, mean[:, 2], count)


def summarise(metrics: Sequence[Metrics]) -> dict[str, MeanSd]:
    """Return mean and standard deviation of every metric by its name.

    A metric that some trial does not have (contact, for people) is left out; an unknown rotation gives NaN.

    Raises:
        InputError: no trial.
    """
    if not metrics:
        raise InputError("there is no trial to summarise: give at least one")
    summary = {}
    for field in fields(Metrics):
        values = [getattr(each, field.name) for each in metrics]
        if all(value is not None for value in values):
            sd = float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
            summary[field.name] = MeanSd(float(np.mean(values)), sd)
    return summary


def _aligned(paths: Sequence[Array], rotations_deg: Sequence[Array] | None, angle_deg: float) -> list[Array]:
    """Return rows `(T_i, 3)` of progress, lateral part and rotation (NaN where unknown) of each trial."""
    if not paths:
        raise InputError("there is no trial to average: give at least one path (T, 2)")
    if rotations_deg is not None and len(rotations_deg) != len(paths):
        raise InputError(f"{len(paths)} paths but {len(rotations_deg)} rotations: give one rotation (T,) for each path")
    rows = []
    for i, given in enumerate(paths):
        path = np.asarray(given, dtype=float)
        turn = np.zeros(len(path)) if rotations_deg is None else np.asarray(rotations_deg[i], dtype=float)
        check_rows(path, turn)
        aligned = geometry.rotate(-math.radians(angle_deg), path)
        rows.append(np.column_stack([aligned, np.full(len(path), np.nan) if rotations_deg is None else turn]))
    return rows


def _across_trials(means: Array) -> tuple[Array, Array, Array]:
    """Return mean `(N, 3)`, standard deviation of the lateral part `(N,)` and count `(N,)` across trials.

    Args:
        means: Mean row of each trial in each bin `(n, N, 3)`, NaN where the trial has none there.
    """
    present = ~np.isnan(means[:, :, 1])
    count = present.sum(axis=0)
    mean = np.full(means.shape[1:], np.nan)
    some = count > 0
    mean[some] = np.where(present[:, :, None], means, 0.0).sum(axis=0)[some] / count[some, None]
    spread = np.where(present, means[:, :, 1] - mean[:, 1], 0.0)
    return mean, np.sqrt((spread**2).sum(axis=0) / np.maximum(count - 1, 1)), count.astype(float)


def _bin_means(rows: Array, centres: Array, half: float) -> Array:
    """Return the mean row `(N, 3)` of one trial in each bin, NaN where the trial has none there."""
    means = np.full((len(centres), 3), np.nan)
    for i, centre in enumerate(centres):
        near = np.abs(rows[:, 0] - centre) <= half
        if near.any():
            means[i] = rows[near].mean(axis=0)
    return means
