"""A plan followed as one whole by a policy that was trained on a whole task: what a sequence is compared with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Task
from inhand.control.policy import Policy, RouteController
from inhand.geometry import Array
from inhand.sim.state import State
from inhand.tracing.plan import Plan
from inhand.tracing.sequencer import End
from inhand.tracing.walk import Pose

ARRIVED = 0.001
"""A plan is done where the object has come to within this of its end [m]."""


class Whole:
    """Follows every plan with one policy, without primitives and without retries."""

    def __init__(self, task: Task, plans: Sequence[Plan], policy: Policy) -> None:
        """Follow plans, one in each world; the task's paths are their poses."""
        self._controller = RouteController(task, policy)
        self._ways = [plan.way for plan in plans]
        self._come = np.zeros(len(plans))
        self.legs: list[NDArray[np.int64]] = []
        """The primitive that each world would be on, at every decision `(T, B)`."""

    def begin(self, state: State) -> None:
        """Start at the beginning of every plan."""
        self._controller.begin(state)

    def act(self, state: State) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        targets = self._controller.act(state)
        self._come = self._controller.came[-1]
        legs = [
            min(int(np.searchsorted(way, come, side="right")) - 1, len(way) - 2)
            for way, come in zip(self._ways, self._come, strict=True)
        ]
        self.legs.append(np.array(legs))
        return targets

    def finished(self, state: State) -> NDArray[np.bool_]:
        """Return which worlds come no farther `(B,)`."""
        return self._controller.finished(state)

    def end_of(self, world: int, pose: Pose) -> End:
        """Return how one world's plan ended."""
        del pose
        come, whole = float(self._come[world]), float(self._ways[world][-1])
        done = come >= whole - ARRIVED
        return End(done, whole if done else come, ())
