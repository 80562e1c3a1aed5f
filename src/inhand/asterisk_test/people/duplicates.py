"""Recordings that lie in a folder twice under different names."""

import itertools
from collections.abc import Sequence

import numpy as np

from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.geometry import Array, interpolate

SAME_MM = 1.3
"""RMS distance below which two paths are one recording: copies are 0.95 mm apart, two trials of one person 2.4 mm
or more (measured on the sample recordings)."""
SAME_DEG = 0.6
"""The same for the rotation: copies are 0.3 deg apart, trials 0.9 deg or more."""
MEAN_ROWS = 7
"""Window that hides what different smoothing of the copies leaves."""
SHARE = 0.8
"""Share of the shorter recording that must overlap."""
SMALLEST_EXTENT = 10.0
"""Two trials in which nothing moved this far [mm or deg] look the same and are not compared."""


def leave_out_duplicates(trials: Sequence[HumanTrial]) -> tuple[tuple[HumanTrial, ...], tuple[str, ...]]:
    """Return the trials without second copies, in their order, and a note for each copy left out.

    Of two copies the one with more rows stays, of equal ones the first. Only trials of one hand, direction and
    twist are compared.
    """
    dropped: dict[str, str] = {}
    series = {trial.source: _series(trial) for trial in trials}
    for first, second in itertools.combinations(trials, 2):
        if _task(first) != _task(second) or dropped.keys() & {first.source, second.source}:
            continue
        apart = distance_between(series[first.source], series[second.source])
        if (
            apart is not None
            and apart[0] < SAME_MM
            and (apart[1] < SAME_DEG or not (first.rotation_usable and second.rotation_usable))
        ):
            keep, leave = (second, first) if len(second.path_mm) > len(first.path_mm) else (first, second)
            dropped[leave.source] = (
                f"{leave.source} left out: it is the same recording as {keep.source} ({apart[0]:.1f} mm apart)"
            )
    return tuple(trial for trial in trials if trial.source not in dropped), tuple(dropped.values())


def distance_between(first: Array, second: Array) -> tuple[float, float] | None:
    """Return the RMS distance [mm] and RMS rotation [deg] of two recordings at the shift that fits best.

    Rows are x [mm], y [mm] and rotation [deg] of each frame. With a the longer one, the squared distance at shift k is
    sum a^2 + sum b^2 - 2 sum a b over the overlap; the last sum, for every k at once, is a correlation.

    Returns:
        None where one of them hardly moves, because then every shift fits.
    """
    from scipy.signal import correlate

    a, b = (first, second) if len(first) >= len(second) else (second, first)
    if min(np.ptp(a, axis=0).max(), np.ptp(b, axis=0).max()) < SMALLEST_EXTENT:
        return None
    shift = np.arange(-(len(b) - 1), len(a))
    low, high = np.maximum(shift, 0), np.minimum(shift + len(b), len(a))
    product = np.column_stack([correlate(a[:, i], b[:, i], mode="full", method="direct") for i in range(3)])
    squares = [np.vstack([np.zeros(3), np.cumsum(each**2, axis=0)]) for each in (a, b)]
    sums = squares[0][high] - squares[0][low] + squares[1][high - shift] - squares[1][low - shift] - 2 * product
    mean = np.maximum(sums, 0.0) / (high - low)[:, None]
    mean[high - low < SHARE * len(b)] = np.inf
    best = int(np.argmin(mean[:, 0] + mean[:, 1]))
    return float(np.sqrt(mean[best, 0] + mean[best, 1])), float(np.sqrt(mean[best, 2]))


def _task(trial: HumanTrial) -> tuple[str, str, float]:
    return (trial.hand, trial.primitive, trial.twist_deg)


def _series(trial: HumanTrial) -> Array:
    """Return x, y and rotation `(F, 3)` with one row per frame, dropped frames filled in, lightly smoothed."""
    from scipy.ndimage import uniform_filter1d

    rotation = trial.rotation_deg if trial.rotation_usable else np.zeros(len(trial.path_mm))
    values = np.column_stack([trial.path_mm + trial.start_mm, rotation])
    frame = trial.frame
    if np.all(np.diff(frame) >= 1.0) and frame[-1] - frame[0] < 10 * len(frame):
        values = interpolate(np.arange(frame[0], frame[-1] + 1.0), frame, values)
    return np.asarray(uniform_filter1d(values, MEAN_ROWS, axis=0, mode="nearest"))
