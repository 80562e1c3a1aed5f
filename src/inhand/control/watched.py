"""A controller that is watched where grasps are tried: how far it had come after every decision."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Controller
from inhand.control.phases import TakesOver
from inhand.control.seen import SENSED, Seen
from inhand.geometry import Array


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
