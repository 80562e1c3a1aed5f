"""Memories of worlds whose hands and objects differ: an estimator knows one hand, so each pair has a memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inhand.control.kept import Remembered
from inhand.control.memory import Memory
from inhand.control.seen import Seen
from inhand.geometry import Array
from inhand.hands.spatial.pair import AnyPair
from inhand.learning.pairs import Pairs
from inhand.tasks.past import LAGGED, Past


def memory_of(held: AnyPair, pairs: Pairs | None, rows: NDArray[np.int64], seen: Seen) -> Memory | Memories:
    """Return what remembers worlds of one hand and object or, where starts have pairs, of rows of these `(B,)`."""
    return Memory(held, seen) if pairs is None else Memories(pairs.take(rows), seen)


class Memories:
    """What is remembered of B worlds, as in `Memory`; each keeps its hand and object."""

    def __init__(self, pairs: Pairs, seen: Seen) -> None:
        """Begin in every world with what is seen."""
        self._each = [(rows, Memory(held, seen.select(rows))) for held, rows in pairs.apart()]
        self._count = seen.n_worlds

    def begin(self, worlds: NDArray[np.int64], seen: Seen) -> None:
        """Begin a primitive in some worlds `(K,)`, from what is seen of all."""
        for rows, memory in self._each:
            mine = np.flatnonzero(np.isin(rows, worlds))
            if len(mine):
                memory.begin(mine, seen.select(rows))

    def go_on(self, worlds: NDArray[np.int64], turned: Array) -> None:
        """Begin another primitive in some worlds `(K,)`, in their order, without forgetting anything."""
        for rows, memory in self._each:
            memory.go_on(np.flatnonzero(np.isin(rows, worlds)), turned[np.isin(worlds, rows)])

    def take(self, seen: Seen) -> None:
        """Go on by a decision, unless what is seen is known."""
        for rows, memory in self._each:
            memory.take(seen.select(rows))

    @property
    def waiting(self) -> NDArray[np.bool_]:
        """Which hands wait for frames `(B,)`."""
        found = np.zeros(self._count, dtype=bool)
        for rows, memory in self._each:
            found[rows] = memory.waiting
        return found

    @property
    def past(self) -> Past:
        """What is remembered now."""
        parts = [vars(memory.past) for _, memory in self._each]
        order = np.argsort(np.concatenate([rows for rows, _ in self._each]))
        whole = {}
        for name in parts[0]:
            axis = 1 if name in LAGGED else 0
            whole[name] = np.take(np.concatenate([part[name] for part in parts], axis=axis), order, axis=axis)
        return Past(**whole)

    def state_dict(self) -> Remembered:
        """Return everything that `load_state_dict` needs, arrays by name."""
        kept = [(f"pair {number}.", memory.state_dict()) for number, (_, memory) in enumerate(self._each)]
        return {f"{mine}{name}": array for mine, arrays in kept for name, array in arrays.items()}

    def load_state_dict(self, kept: Remembered) -> None:
        """Go on from what `state_dict` returned, among others, byte for byte."""
        for number, (_, memory) in enumerate(self._each):
            mine = f"pair {number}."
            memory.load_state_dict({n.removeprefix(mine): array for n, array in kept.items() if n.startswith(mine)})
