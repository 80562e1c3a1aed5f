"""Routes: whole paths that a controller follows by itself, seen as a straight aim a little ahead of where it is.

A primitive has one aim from its start to its end. A route has a new one at every decision: the direction to a point
`LOOK` farther along, from the place on the route that the object has come to. So a controller that was trained on a
whole task sees the same numbers as one that was trained on primitives (`tasks/observations.py`), and either can be
asked to do what the other one does.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import TURN_ARM, Array, Path, perpendicular, unit, wrap_angle
from inhand.tasks.observations import Aim
from inhand.tasks.paths import stacked

LOOK = 0.006
"""How far ahead on a route the aim lies [m]; a turn counts as an arc at `TURN_ARM`."""
SEEN = 0.012
"""How far ahead the object's place on the route is looked for [m]."""
NEAR = 0.005
"""An object farther from its route than this does not come along it [m]."""
SPACING = 0.0005
"""Spacing of a route's poses [m]."""
STILL = 1e-6
"""A step of the route shorter than this goes nowhere [m]."""


class Routes(Path):
    """A pool of N routes `(N, S, 3)` in the palm frame, their poses `SPACING` apart."""

    def __len__(self) -> int:
        """Return the number of routes."""
        return len(self.poses)

    def advance(self, rows: NDArray[np.int64], come: NDArray[np.int64], pose: Array) -> NDArray[np.int64]:
        """Return the place `(B,)` on routes that objects at poses `(B, 3)` have come to, never back from `come`."""
        last = self.poses.shape[1] - 1
        window = np.minimum(come[:, None] + np.arange(round(SEEN / SPACING) + 1), last)
        way = self.poses[rows[:, None], window] - pose[:, None]
        away = np.hypot(np.hypot(way[..., 0], way[..., 1]), TURN_ARM * wrap_angle(way[..., 2]))
        nearest, worlds = away.argmin(axis=1), np.arange(len(come))
        return np.where(away[worlds, nearest] <= NEAR, window[worlds, nearest], come)

    def aim(self, rows: NDArray[np.int64], come: NDArray[np.int64]) -> Aim:
        """Return what is asked of objects that have come to a place on routes `rows` `(B,)`."""
        start = self.poses[rows, come].copy()
        start[:, 2] = self.poses[rows, self._later[rows, come], 2]
        share = self.way[rows, come] / self.way[rows, -1]
        return Aim(self._heading[rows, come], start, self._straight[rows, come], share, self.poses[rows, -1])

    def off(self, rows: NDArray[np.int64], come: NDArray[np.int64], pose: Array) -> tuple[Array, Array]:
        """Return how far poses `(B, 3)` are beside routes `rows` [m] and turned from them [rad], each `(B,)`."""
        here = self.poses[rows, come]
        left = perpendicular(unit(self._heading[rows, come]))
        across = np.abs(((pose[:, :2] - here[:, :2]) * left).sum(axis=-1))
        return across, np.abs(wrap_angle(pose[:, 2] - here[:, 2]))

    @cached_property
    def _later(self) -> NDArray[np.int64]:
        """The place `LOOK` farther along, of every place `(N, S)`."""
        return np.stack([np.minimum(np.searchsorted(w, w + LOOK), len(w) - 1) for w in self.way])

    @cached_property
    def _heading(self) -> Array:
        """Direction to the place ahead `(N, S)` [rad]; where that is none, the one before."""
        there = np.take_along_axis(self.poses[..., :2], self._later[..., None], axis=1)
        step = there - self.poses[..., :2]
        known = np.hypot(step[..., 0], step[..., 1]) > STILL
        place = np.where(known, np.arange(known.shape[1]), -1)
        place = np.maximum.accumulate(place, axis=1)
        place = np.where(place < 0, known.argmax(axis=1)[:, None], place)
        return np.take_along_axis(np.arctan2(step[..., 1], step[..., 0]), place, axis=1)

    @cached_property
    def _straight(self) -> Array:
        """Way to go before the next turn on the spot, or the end `(N, S)` [m]."""
        moved = np.hypot(*np.moveaxis(np.diff(self.poses[..., :2], axis=1), -1, 0))
        turned = np.abs(np.diff(self.poses[..., 2], axis=1))
        way = np.concatenate([np.zeros((len(moved), 1)), np.cumsum(moved, axis=1)], axis=1)
        stops = (moved <= STILL) & (turned > STILL)
        ends = np.where(np.concatenate([stops, np.ones((len(way), 1), dtype=bool)], axis=1), way, np.inf)
        return np.asarray(np.minimum.accumulate(ends[:, ::-1], axis=1)[:, ::-1] - way)


def routes_of(paths: Sequence[Array]) -> Routes:
    """Return routes over paths of poses `(S, 3)` in the palm frame, of any spacing and length."""
    return Routes(stacked([_spaced(Path(poses)) for poses in paths]))


def _spaced(path: Path) -> Array:
    """Return poses `SPACING` apart along a path, its end among them."""
    whole = path.way[-1]
    return path.at(np.append(np.arange(0.0, whole - SPACING / 2, SPACING), whole))
