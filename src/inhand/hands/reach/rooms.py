"""Room to compute in that a walk along a path takes once."""

from __future__ import annotations

import numpy as np

from inhand.geometry import Array
from inhand.hands.reach.fingers import EXPECTED
from inhand.hands.reach.pairs import room_for_pairs
from inhand.hands.reach.parts import Flags, Grips, Indices, Pairs, Room, Sides, Toucher, cells_near, room_for


class Rooms:
    """Room to compute in, which grows where it has to."""

    def __init__(self, touchers: tuple[Toucher, Toucher], n_cells: int) -> None:
        """Take room for two fingers and an outline of cells, all of which may be looked at."""
        self.n_cells, self._touchers = n_cells, touchers
        self.near = cells_near(n_cells), cells_near(n_cells)
        self._touched = self._postures(EXPECTED * n_cells)
        self._pairs: Pairs | None = None

    def choose(self, chosen: tuple[Flags, Flags]) -> None:
        """Have each finger's outer links looked for at some cells `(U,)` alone."""
        for near, flags in zip(self.near, chosen, strict=True):
            near.chosen[:] = flags

    def sides(self, pose: Array, used: tuple[Indices, Indices], around: int) -> Sides:
        """Return the postures of both fingers at a pose `(1, 3)`, at cells near some more; they lie in this room."""
        from inhand.hands.reach.touching import touch_near

        pose = np.array(pose)  # of a path that cannot be written to, for which all would be compiled once more
        while True:
            touch_near(self._touchers, (used, around, 2), self.near, pose, self._touched)
            counts = [int(room.counts[0]) for room in self._touched]
            if max(counts) <= len(self._touched[0].found.cell):
                left, right = (room.found.only(slice(count)) for room, count in zip(self._touched, counts, strict=True))
                return left, right
            self._touched = self._postures(max(counts))

    def pairs(self, sides: Sides, before: Grips | None) -> Pairs:
        """Return room for pairs of postures and for those before."""
        size = max(len(side.cell) for side in (*sides, *(before.sides if before else ())))
        if self._pairs is None or len(self._pairs.known) < size:
            self._pairs = room_for_pairs(sides, 2 * size, self.n_cells)
        return self._pairs

    def holds(self, found: Grips) -> bool:
        """Return whether all chosen cells beside those of grips were looked at."""
        for near, side in zip(self.near, found.sides, strict=True):
            looked_at = near.near | ~near.chosen
            if not (looked_at[side.cell - 1].all() and looked_at[(side.cell + 1) % self.n_cells].all()):
                return False
        return True

    def _postures(self, count: int) -> tuple[Room, Room]:
        left, right = (room_for(by, self.n_cells, count) for by in self._touchers)
        return left, right
