"""Which hand and object is in each of many worlds, where they differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.hands.fit import Held


@dataclass(frozen=True, eq=False)
class Pairs:
    """Which hand and object is in each of N worlds, where they differ: hands of one number of joints of each finger."""

    held: tuple[Held, ...]
    """The hands and objects."""
    of: NDArray[np.int64]
    """The number of each world's `(N,)`."""

    def take(self, rows: NDArray[np.int64]) -> Pairs:
        """Return those of some worlds."""
        return Pairs(self.held, self.of[rows])


def all_pairs(parts: Sequence[Pairs]) -> Pairs | None:
    """Return the pairs of several pools as one; None of none."""
    known = {held: number for number, held in enumerate(dict.fromkeys(held for part in parts for held in part.held))}
    numbers = [np.array([known[held] for held in part.held])[part.of] for part in parts]
    return Pairs(tuple(known), np.concatenate(numbers)) if parts else None
