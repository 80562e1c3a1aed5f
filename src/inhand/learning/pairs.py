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

    def again(self, rows: NDArray[np.int64], rng: np.random.Generator) -> NDArray[np.int64]:
        """Return for each of some worlds one that is drawn of those with its hand and object."""
        order, number = np.argsort(self.of, kind="stable"), self.of[rows]
        first, end = (np.searchsorted(self.of[order], number, side) for side in ("left", "right"))
        return order[first + (rng.random(len(rows)) * (end - first)).astype(np.int64)]

    def apart(self) -> list[tuple[Held, NDArray[np.int64]]]:
        """Return each hand and object that there is in the worlds, with the numbers of these."""
        each = ((held, np.flatnonzero(self.of == number)) for number, held in enumerate(self.held))
        return [(held, rows) for held, rows in each if len(rows)]


def all_pairs(parts: Sequence[Pairs]) -> Pairs | None:
    """Return the pairs of several pools as one; None of none."""
    known = {held: number for number, held in enumerate(dict.fromkeys(held for part in parts for held in part.held))}
    numbers = [np.array([known[held] for held in part.held])[part.of] for part in parts]
    return Pairs(tuple(known), np.concatenate(numbers)) if parts else None
