"""Random numbers of many worlds at once, each world's from its own key."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inhand.control.sense_kernels import Drawn
from inhand.sim.drawn import Key

BLOCK = 128
"""Rows that are drawn of a world at a time."""


class Noise:
    """Rows of numbers for B worlds. A row follows from its world's key and its own number alone, in any order."""

    def __init__(self, n_worlds: int, stream: int, normal: int, even: int = 0) -> None:
        """Draw rows of `normal` standard normal numbers, then of `even` ones from 0 to 1, apart from other streams."""
        self._stream, self._normal, self._even = stream, normal, even
        self._keys: list[Key] = [()] * n_worlds
        self.rows = np.zeros((n_worlds, BLOCK, normal + even))
        """A block of rows of each world `(B, BLOCK, normal + even)`,"""
        self.block = np.full(n_worlds, -1)
        """and which block this is `(B,)`: row r is in block r // BLOCK; -1 where none has been drawn."""

    @property
    def drawn(self) -> Drawn:
        """Both, as they will ever be: compiled functions take them."""
        return Drawn(self.rows, self.block)

    def begin(self, worlds: NDArray[np.int64], keys: Sequence[Key]) -> None:
        """Give some worlds new keys."""
        for world, key in zip(worlds.tolist(), keys, strict=True):
            self._keys[world] = key
        self.block[worlds] = -1

    def draw(self, numbers: NDArray[np.int64]) -> None:
        """Draw the blocks that hold a row of each world by its number `(B,)`, 0 or more, where they are not there."""
        blocks = numbers // BLOCK
        for world in np.flatnonzero(blocks != self.block).tolist():
            rng = np.random.default_rng((*self._keys[world], self._stream, int(blocks[world])))
            self.rows[world, :, : self._normal] = rng.standard_normal((BLOCK, self._normal))
            self.rows[world, :, self._normal :] = rng.random((BLOCK, self._even))
        self.block[:] = blocks
