"""Random numbers of many worlds at once, each world's from its own key."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.sim.drawn import Key

BLOCK = 128
"""Rows that are drawn of a world at a time."""


class Noise:
    """Rows of numbers for B worlds. A row follows from its world's key and its own number alone, in any order."""

    def __init__(self, n_worlds: int, stream: int, normal: int, even: int = 0) -> None:
        """Draw rows of `normal` standard normal numbers, then of `even` ones from 0 to 1, apart from other streams."""
        self._stream, self._normal, self._even = stream, normal, even
        self._keys: list[Key] = [()] * n_worlds
        self._block = np.full(n_worlds, -1)
        self._numbers = np.zeros((n_worlds, BLOCK, normal + even))

    def begin(self, worlds: NDArray[np.int64], keys: Sequence[Key]) -> None:
        """Give some worlds new keys."""
        for world, key in zip(worlds.tolist(), keys, strict=True):
            self._keys[world] = key
        self._block[worlds] = -1

    def rows(self, numbers: NDArray[np.int64], worlds: NDArray[np.int64]) -> Array:
        """Return a row of some worlds `(K,)` each, `(K, normal + even)`, by its number `(K,)`, 0 or more."""
        block, row = np.divmod(numbers, BLOCK)
        stale = block != self._block[worlds]
        if stale.any():
            for place in np.flatnonzero(stale).tolist():
                world, now = worlds[place], int(block[place])
                rng = np.random.default_rng((*self._keys[world], self._stream, now))
                self._numbers[world, :, : self._normal] = rng.standard_normal((BLOCK, self._normal))
                self._numbers[world, :, self._normal :] = rng.random((BLOCK, self._even))
                self._block[world] = now
        return np.asarray(self._numbers[worlds, row])
