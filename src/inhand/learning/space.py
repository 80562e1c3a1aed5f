"""What starts of a hand in space are asked to do, and the gravity under which they are held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.sim.scene import SceneSpec


@dataclass(frozen=True, eq=False)
class Space:
    """Directions, axes and gravities of N starts in space."""

    along: Array
    """Unit vectors to move along `(N, 3)`, 0 of those that are to turn."""
    about: Array
    """Unit vectors to turn about `(N, 3)`, 0 of those that are to move."""
    gravity: Array
    """Gravity in the palm frame `(N, 3)` [m/s^2]."""

    def take(self, rows: NDArray[np.int64]) -> Space:
        """Return those of some starts."""
        return Space(self.along[rows], self.about[rows], self.gravity[rows])

    @property
    def scenes(self) -> list[SceneSpec]:
        """What surrounds the object of each start."""
        return [SceneSpec(pull=(x, y, z)) for x, y, z in self.gravity.tolist()]


def joined_spaces(parts: Sequence[Space]) -> Space | None:
    """Return those of several pools as one; None of none."""
    if not parts:
        return None
    return Space(**{each.name: np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Space)})
