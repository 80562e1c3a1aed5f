"""A controller that is watched where grasps are tried: how far it had come after every decision, and how straight."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Controller
from inhand.control.loop import Recording
from inhand.control.phases import TakesOver
from inhand.control.seen import SENSED, Seen
from inhand.geometry import SAME, TURN_ARM, Array, Path, wrap_angle

ASTRAY = 0.012
"""Objects farther than this from their path count as lost [m]; 27 deg at `TURN_ARM`."""
OFTEN = 3
"""Of the decisions of a rehearsal one in so many is judged."""
BEHIND, AHEAD = 16, 3
"""Poses of a path behind the set point and ahead of it at which an object may be."""


class Carries(Controller, Protocol):
    """A controller that tells how far it has come."""

    @property
    def progress(self) -> Array:
        """How far along its path each world was to be at the last decision `(B,)` [m]."""


class Watched:
    """A controller with how far it had come after every decision."""

    reads = SENSED

    def __init__(self, controller: Carries) -> None:
        """Watch a controller."""
        self.inner, self.ways = controller, list[Array]()

    def take_over(self, before: Controller) -> None:
        """Let it go on from what has held the objects before it, if it can."""
        if isinstance(self.inner, TakesOver):
            self.inner.take_over(before.inner if isinstance(before, Watched) else before)

    def begin(self, seen: Seen) -> None:
        """Begin, as it does."""
        self.inner.begin(seen)

    def act(self, seen: Seen) -> Array:
        """Return its joint targets `(B, n_joints)` [rad]."""
        targets = self.inner.act(seen)
        self.ways.append(self.inner.progress)
        return targets

    def finished(self, seen: Seen) -> NDArray[np.bool_]:
        """Return what it says is finished `(B,)`."""
        return self.inner.finished(seen)


def ways_along(found: Recording, path: Path, aimed: list[Array], straight: float) -> Array:
    """Return how far along its path each world carried its object, not astray, and how far straight `(B, 2)` [m].

    What is farther from its path than given [m] is not `straight`. It is -1 where it never was held. A path may cross
    itself: an object is on its part near to where the set point was `aimed` in each decision `(B,)` [m].
    """
    carried = int(np.flatnonzero(found.phase == found.phase.max())[0])
    begin, scale = found.states[carried].pose, np.array([1.0, 1.0, TURN_ARM])
    ways, most = np.full((2, len(found.last)), -1.0), np.array([[ASTRAY], [straight]])
    going, aims, worlds = found.last >= carried, path.poses * scale, np.arange(len(found.last))
    window = np.arange(-BEHIND, AHEAD + 1)
    for number in range(carried, len(found.states), OFTEN):
        state = found.states[number]
        moved = state.pose - begin
        moved[:, 2] = wrap_angle(moved[:, 2])
        come = aimed[number - carried]
        place = (path.way < come[:, None]).sum(axis=1)
        near = np.clip(place[:, None] + window, 0, aims.shape[1] - 1)
        off = np.linalg.norm(aims[worlds[:, None], near] - (scale * moved)[:, None], axis=-1)
        closest = off.argmin(axis=1)
        place, away = near[worlds, closest], off[worlds, closest]
        # What is lost for a few decisions may be caught again, what is astray stays so.
        going = going & (number <= found.last) & (away <= most)
        here = going & state.touching.all(axis=-1)
        gone = np.where(come >= path.length - SAME, path.length, path.way[worlds, place])
        ways = np.where(here, np.maximum(ways, gone), ways)
    return ways.T
