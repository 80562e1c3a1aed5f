"""The path that a person took, without the time it took."""

import math

import numpy as np

from inhand import geometry
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.tasks.directions import ROTATION_SIGNS
from inhand.tasks.paths import TURN_STEP, ReferencePath

STEP = 0.001
"""Spacing of the waypoints [m]."""
BIN_STEPS = 2.0
"""Half width of a bin of progress, in steps: wide enough that fast frames, up to 5 mm apart, fill most bins."""
SMOOTH_STEPS = 5
"""Window of the mean over neighbouring waypoints."""


def human_path(trial: HumanTrial) -> ReferencePath:
    """Return the path that a person took, as a function of progress instead of time.

    From the filtered rows up to the one of farthest progress (what follows is release): in bins around each
    waypoint the median of the rows' lateral part, gaps filled linearly, then a mean over neighbours that keeps
    the start. So a person who walks the object to and fro leaves one point per step, and dwelling counts once.
    The lateral part of recordings is uncertain by up to 14 mm (docs/metrics.md). A translation keeps theta at 0; a
    trial that only rotates has steps of one degree.

    Raises:
        InputError: the object moved less than one step along its direction.
    """
    rows = slice(*trial.moving)
    place = (trial.filtered_mm[rows] - trial.filtered_mm[rows][0]) / 1000.0
    name = f"{trial.primitive} of {trial.source}"
    if trial.angle_deg is None:
        sign, theta = ROTATION_SIGNS[trial.primitive], np.radians(trial.filtered_rotation_deg[rows])
        progress, drift = _along(name, sign * (theta - theta[0]), place, TURN_STEP)
        return ReferencePath(np.column_stack([drift, sign * progress]), name)
    aligned = geometry.rotate(-math.radians(trial.angle_deg), place)
    progress, across = _along(name, aligned[:, 0], aligned[:, 1:], STEP)
    points = geometry.rotate(math.radians(trial.angle_deg), np.column_stack([progress, across]))
    return ReferencePath(np.column_stack([points, np.zeros(len(points))]), name, math.radians(trial.twist_deg))


def _along(name: str, progress: Array, across: Array, step: float) -> tuple[Array, Array]:
    """Return a grid `(N,)` of progress and, at each of its points, the other columns `(N, K)` minus their start."""
    farthest = int(np.argmax(progress))
    whole_steps = math.floor(progress[farthest] / step + 1e-9)
    if whole_steps < 1:
        raise InputError(
            f"{name}: the object moves less than one step ({step:g}) along its direction, so there is no path to"
            " follow: use another trial"
        )
    grid = step * np.arange(whole_steps + 1)
    rows, values = progress[: farthest + 1], across[: farthest + 1] - across[0]
    medians = np.full((len(grid), values.shape[1]), np.nan)
    for i, centre in enumerate(grid):
        near = np.abs(rows - centre) <= BIN_STEPS * step
        if near.any():
            medians[i] = np.median(values[near], axis=0)
    medians[0] = 0.0
    columns = [_smoothed(_filled(grid, medians[:, k])) for k in range(values.shape[1])]
    return grid, np.column_stack(columns)


def _filled(grid: Array, values: Array) -> Array:
    known = ~np.isnan(values)
    return np.asarray(np.interp(grid, grid[known], values[known]))


def _smoothed(values: Array) -> Array:
    """Return the mean over neighbours; mirrored through its end points, so that start and end stay in place."""
    half = min(SMOOTH_STEPS // 2, len(values) - 1)
    padded = np.pad(values, half, mode="reflect", reflect_type="odd")
    return np.convolve(padded, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="valid")
