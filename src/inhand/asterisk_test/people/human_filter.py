"""Smoothing of recorded paths without lag."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from inhand.geometry import Array

MEDIAN_ROWS = 5
"""Window of the running median; takes out jumps of up to two frames."""
MEAN_ROWS = 15
"""Window of the running mean: the width that the Asterisk Test used for its own filtered columns."""


def smooth(values: Array) -> Array:
    """Return columns `(T, K)` after a centred running median and a centred running mean.

    The filtered columns of the files are a trailing mean, which lags 7 rows and keeps a third of every jump; a
    window centred on each row keeps their width and has no lag. Towards the ends the windows shrink on both sides
    alike, so that a path which stops at full speed ends where it ended.
    """
    return _means(_medians(np.array(values, dtype=float)))


def _medians(values: Array) -> Array:
    """Return running medians, the ends by Tukey's rule (Exploratory Data Analysis, 1977, 7A).

    The rule takes the median of the end, its neighbour and what the two rows before would lead to, so that one frame of
    release does not decide where a trial ended.
    """
    found = values.copy()
    for half in range(1, MEDIAN_ROWS // 2 + 1):
        if len(values) > 2 * half:
            windows = sliding_window_view(values, 2 * half + 1, axis=0)
            found[half : len(values) - half] = np.median(windows, axis=-1)
    if len(values) > 2:
        for end, one, two in ((0, 1, 2), (-1, -2, -3)):
            found[end] = np.median([values[end], found[one], 3 * found[one] - 2 * found[two]], axis=0)
    return found


def _means(values: Array) -> Array:
    """Return means over as many rows before as after each row, up to the whole window."""
    count = len(values)
    row = np.arange(count)
    half = np.minimum(MEAN_ROWS // 2, np.minimum(row, count - 1 - row))
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    return np.asarray((sums[row + half + 1] - sums[row - half]) / (2 * half + 1)[:, None])
