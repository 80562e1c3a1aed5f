"""Numbers packed as text for a page: columns in 16-bit steps, a seventh of what they take as decimals."""

from __future__ import annotations

import base64
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array

STEPS = 2**16 - 1
"""Steps between the least and the largest number of a column."""


@dataclass(frozen=True)
class Packed:
    """Columns of numbers; a number is `low` and as many `step` as its 16 bits say, so half a step off at most."""

    data: str
    """The numbers of steps, column by column, low byte first, as base64."""
    rows: int
    low: tuple[float, ...]
    """The least number of each column."""
    step: tuple[float, ...]


def packed(columns: Array) -> Packed:
    """Return columns `(T, k)` of finite numbers, packed."""
    low, high = columns.min(axis=0), columns.max(axis=0)
    step = np.where(high > low, (high - low) / STEPS, 1.0)
    counts = np.rint((columns - low) / step).astype("<u2")
    return Packed(_text(np.ascontiguousarray(counts.T)), len(columns), tuple(low.tolist()), tuple(step.tolist()))


def packed_flags(flags: NDArray[np.bool_]) -> str:
    """Return up to eight flags `(T, k)` of each row as the bits of a byte, the first the lowest, as base64."""
    return _text((flags.astype(np.uint8) << np.arange(flags.shape[1], dtype=np.uint8)).sum(axis=1).astype(np.uint8))


def _text(array: NDArray[np.uint8] | NDArray[np.uint16]) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")
