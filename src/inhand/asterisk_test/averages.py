"""Averages over the trials of one direction: the mean path, and means of metrics."""

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

    points_mm: Array
    """Mean positions `(N, 2)` from the start, one per bin of progress; NaN where no trial has a row in the bin."""
    lateral_sd_mm: Array
    """Standard deviation across trials of the lateral part `(N,)`: the band. 0 where one trial alone counts."""


class MeanSd(NamedTuple):
    """Mean and standard deviation of one metric."""

    mean: float
    sd: float
    """Standard deviation (n - 1), 0 for a single trial."""


def average_path(paths_mm: Sequence[Array], angle_deg: float, end_mm: float) -> AveragePath:
    """Return the mean path of several trials `(T_i, 2)` [mm], filtered, along a direction, every trial counting once.

    Rows are sorted into bins of progress; in each bin first the mean of each trial, then the mean and the
    standard deviation across trials. So a person who dwells, or walks the object, weighs no more than others.
    Rows after a trial's farthest progress are left out (release, or going back), and the line ends at
    a given progress. The bins are spread evenly, so that the first point is the start and the last that end.

    Raises:
        InputError: no trial, or rows that are not finite.
    """
    rows = [each[: int(np.argmax(each[:, 0])) + 1] - each[0] for each in _aligned(paths_mm, angle_deg)]
    centres = np.linspace(0.0, end_mm, max(round(end_mm / BIN_MM), 1) + 1) if end_mm > 0.0 else np.zeros(1)
    half = centres[1] / 2 if end_mm > BIN_MM else BIN_MM / 2
    lateral = np.stack([_bin_means(each, centres, half)[:, 1] for each in rows])
    present = ~np.isnan(lateral)
    count = present.sum(axis=0)
    mean = np.where(count > 0, np.where(present, lateral, 0.0).sum(axis=0) / np.maximum(count, 1), np.nan)
    spread = np.where(present, lateral - mean, 0.0)
    points = geometry.rotate(math.radians(angle_deg), np.column_stack([centres, mean]))
    points[0] = 0.0
    return AveragePath(points, np.sqrt((spread**2).sum(axis=0) / np.maximum(count - 1, 1)))


def compat_average(paths: Sequence[Array], angle_deg: float) -> Array:
    """Return the mean path `(26, 2)` by the rule of the Asterisk Test software, to compare with published figures.

    All unfiltered rows of all trials `(T_i, 2)`, normalised, from their origin, together: the origin, then for
    t = linspace(0, 0.5, 25) the mean of the rows with |x' - t| <= 0.024, where x' is progress (docs/metrics.md,
    Averages); NaN where there is none.

    Raises:
        InputError: no trial, or rows that are not finite.
    """
    centres = np.linspace(0.0, COMPAT_LENGTH, COMPAT_POINTS)
    mean = _bin_means(np.concatenate(_aligned(paths, angle_deg)), centres, COMPAT_HALF_WIDTH)
    return geometry.rotate(math.radians(angle_deg), np.concatenate([np.zeros((1, 2)), mean]))


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


def _aligned(paths: Sequence[Array], angle_deg: float) -> list[Array]:
    """Return rows `(T_i, 2)` of progress and lateral part of each trial."""
    if not paths:
        raise InputError("there is no trial to average: give at least one path (T, 2)")
    for path in paths:
        check_rows(np.asarray(path), np.zeros(len(path)))
    return [geometry.rotate(-math.radians(angle_deg), path) for path in paths]


def _bin_means(rows: Array, centres: Array, half: float) -> Array:
    """Return the mean row `(N, 2)` of those in each bin, NaN where there are none."""
    near = [np.abs(rows[:, 0] - centre) <= half for centre in centres]
    return np.array([rows[mine].mean(axis=0) if mine.any() else (np.nan, np.nan) for mine in near])
