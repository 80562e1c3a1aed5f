"""Smoothing of recorded paths without lag."""

from __future__ import annotations

import pandas as pd

from inhand.geometry import Array

MEDIAN_ROWS = 5
"""Window of the running median; takes out jumps of up to two frames."""
MEAN_ROWS = 15
"""Window of the running mean: the width that the Asterisk Test used for its own filtered columns."""


def smooth(values: Array) -> Array:
    """Return columns `(T, K)` after a centred running median and a centred running mean.

    The filtered columns of the files are a trailing mean, which lags 7 rows and keeps a third of every jump; a
    window centred on each row keeps their width and has no lag. Windows are cut off at the ends, so that the
    last row is the mean of 8 and one frame of release does not decide where the trial ended; a path that starts
    or stops at full speed loses up to 4 rows of movement at that end.
    """
    frame = pd.DataFrame(values)
    median = frame.rolling(MEDIAN_ROWS, center=True, min_periods=1).median()
    return median.rolling(MEAN_ROWS, center=True, min_periods=1).mean().to_numpy(dtype=float)
