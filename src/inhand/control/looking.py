"""Closing where an object is seen: frames are averaged while fingers are placed, and the grasp follows them in part.

An object that stands off the plan is held off the plan: of all that `field` draws, the start takes most of the way that
a grip can be trusted with. How much the frames of an object that rests scatter tells how well it is seen.
"""

import numpy as np

from inhand.control.controller import Task
from inhand.control.grades import FIDUCIAL
from inhand.control.joint import JointPid
from inhand.control.seen import Seen, exact
from inhand.geometry import Array, wrap_angle
from inhand.sim.state import State

FEWEST = 3
"""Frames of which a scatter is told."""


class Looking(JointPid):
    """Moves all joints to a goal `(B, n_joints)`, and sees on the way where objects stand."""

    def __init__(self, task: Task, goal: Array, planned: Array) -> None:
        """Aim at joint angles [rad], with objects planned to stand at poses `(B, 3)`."""
        super().__init__(task, goal)
        self._planned = planned

    def begin(self, state: State | Seen) -> None:
        """Start from where the joints are."""
        super().begin(state)
        self._frame = np.full(state.n_worlds, -np.inf)
        self._count = np.zeros((state.n_worlds, 1))
        self._sum, self._squares = np.zeros((2, state.n_worlds, 3))

    def act(self, state: State | Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        self._look(state if isinstance(state, Seen) else exact(state))
        return super().act(state)

    @property
    def off(self) -> Array:
        """How far objects are seen beside where they were planned to stand, on average `(B, 3)` [m, m, rad]."""
        return self._sum / self._count

    @property
    def scatter(self) -> Array:
        """How much frames scatter, in a fiducial's noise `(B,)`; infinitely where there are too few to tell."""
        count = self._count
        variance = np.maximum(self._squares - count * self.off**2, 0.0) / np.maximum(count - 1, 1)
        return np.where(count[:, 0] < FEWEST, np.inf, np.sqrt((variance / FIDUCIAL**2).mean(axis=-1)))

    def _look(self, seen: Seen) -> None:
        off = seen.frame_pose - self._planned
        off[:, 2] = wrap_angle(off[:, 2])
        fresh = (seen.frame_time > self._frame)[:, None]
        self._sum, self._squares = self._sum + fresh * off, self._squares + fresh * off**2
        self._count = self._count + fresh
        self._frame = np.maximum(self._frame, seen.frame_time)
