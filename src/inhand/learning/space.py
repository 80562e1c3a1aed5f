"""What starts of a hand in space are asked to do, and the gravity under which they are held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import SpatialTask
from inhand.geometry import Array
from inhand.hands.spatial.pair import SpatialPair
from inhand.sim.scene import SceneSpec
from inhand.tasks.spatial.paths import spatial_path_of, stacked_paths
from inhand.tasks.spatial.primitives import SpatialPrimitive, about, along


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


def primitives_of(space: Space) -> list[SpatialPrimitive]:
    """Return what is asked as primitives."""
    pairs = zip(space.along, space.about, strict=True)
    return [about(axis) if axis.any() else along(direction) for direction, axis in pairs]


def task_in_space(held: SpatialPair, space: Space, distance: Array | None = None) -> SpatialTask:
    """Return the task of doing what is asked, at most so far `(N,)` [m]."""
    path = stacked_paths([spatial_path_of(each) for each in primitives_of(space)])
    return SpatialTask(held.hand, (held.object,) * len(space.along), path, distance=distance, gravity=space.gravity)


def space_of(primitives: Sequence[SpatialPrimitive], gravity: Array) -> Space:
    """Return primitives, each under its gravity `(N, 3)` [m/s^2], as what is asked of starts."""
    moves = np.array([each.direction or (0.0, 0.0, 0.0) for each in primitives])
    turns = np.array([each.axis if each.direction is None else np.zeros(3) for each in primitives])
    return Space(moves, turns, gravity)


def nearest_of(space: Space, known: Sequence[SpatialPrimitive]) -> list[SpatialPrimitive]:
    """Return of known primitives the one that is nearest to what each is asked: of turns a turn, of moves a move."""
    there = space_of(known, np.zeros((1, 3)))
    near = space.along @ there.along.T + space.about @ there.about.T
    return [known[k] for k in near.argmax(axis=-1).tolist()]
