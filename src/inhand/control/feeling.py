"""Going on by feel: beyond its planned way a policy goes until a learned risk stops it.

A planned way ends where few objects are lost of all that a camera of its grade may mean. Beyond it a network tells from
what is sensed, and from how that has changed of late, the chance that the object is lost, turned or off its line within
the next decisions (`SOON`). Where that passes a threshold commands stay as they are; planning chooses it for each path
and grade (`control/sensed_plan.py`). `studies/feel.py` teaches the network.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from inhand.caches import name_of
from inhand.control.controller import Task
from inhand.control.grades import TRUSTING
from inhand.control.policy import Policy
from inhand.control.seen import Seen
from inhand.control.sensed_plan import Carrier, graded
from inhand.control.sensed_policy import SensedPolicyController
from inhand.control.underway import ARRIVED
from inhand.geometry import Array
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import Scene, observe

SOON = 10
"""Decisions within which a loss or a turn is told."""
FARTHER = 1.3
"""Where it is stopped at the latest, in planned ways."""
BACK = (12, 30)
"""Decisions back with which what is sensed now is compared; and with when the hand had waited for frames."""
TOLD = 5
"""Numbers of direction and way, which come first."""
NEAR = (1.0, 0.8, 0.5)
"""Shares of a planned way among which that of a policy of the family is chosen."""
QUICK = ((32, 3), (6, 8), (2, 16))
"""Candidates and worlds that a policy of the family plans with."""


def carrier_of(policy: Policy) -> Carrier:
    """Return who carries objects where grasps are planned for a policy on real senses."""
    carrier = Carrier(partial(SensedPolicyController, policy=policy), policy.digest, __name__)
    if find_layout(policy.observation).columns:
        return replace(carrier, shares=NEAR, grades=TRUSTING, apart=True, rounds=QUICK, stays=24)
    if policy.risk is None:
        return graded(carrier)
    felt = f"{policy.digest}, {name_of(policy.risk)} up to {FARTHER}"
    return replace(graded(carrier), digest=felt, feels=partial(FeelingController, policy=policy))


class FeelingController(SensedPolicyController):
    """Goes the planned way, and where that was planned by grades on from there, until the risk passes a threshold."""

    _first: Array | None
    """What was sensed when the wait ended `(B, d)`."""

    def __init__(self, task: Task, policy: Policy) -> None:
        """Follow the task's paths with a policy that has a risk."""
        super().__init__(task, policy)
        self._risk: Callable[[Array], Array] | None = policy.risk
        self._view = find_layout(policy.observation), Scene(task.hand, task.objects)

    def begin(self, seen: Seen) -> None:
        """Start a primitive where the object is now."""
        super().begin(seen)
        self._history, self._first = deque[Array](maxlen=max(BACK) + 1), None

    def act(self, seen: Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        targets = super().act(seen)
        if self._risk is None or np.isinf(self._threshold).all():
            return targets
        beyond = ~self._past.waiting & (self.progress >= self._planned - ARRIVED)
        self._arrived |= (self._risk(self._feel()) >= self._threshold) & beyond
        return np.where(self._arrived[:, None], seen.targets, targets)

    def _way(self, seen: Seen) -> Array:
        """Return how far to go at most `(B,)` [m]: beyond the planned way where nothing turns."""
        self._planned, risk = super()._way(seen), self._task.risk
        self._threshold = np.where(self._turned == 0, np.inf if risk is None else risk, np.inf)
        farthest = np.where(np.isinf(self._threshold), 1.0, FARTHER) * self._planned
        return np.asarray(np.minimum(farthest, self._task.path.length))

    def _feel(self) -> Array:
        """Return direction and way, what the policy sees, and how that has changed of late `(B, d)`."""
        past, aim, (layout, scene) = self._past, self._aim, self._view
        now = np.concatenate(
            [
                10 * past.joint_angles,
                15 * (past.targets - past.joint_angles),
                aim.shift(past.frames[0]) * (10, 100, 5),
                past.shift(aim) * (10, 100, 5),
                125 * past.points.reshape(past.n_worlds, -1),
                6 * past.askew,
            ],
            axis=-1,
        )
        self._first = now if self._first is None else np.where(past.waiting[:, None], now, self._first)
        self._history.append(now)
        lagged = [3 * (now - self._history[max(len(self._history) - 1 - lag, 0)]) for lag in BACK]
        come, planned = self.progress[:, None], self._planned[:, None]
        ahead = 50 * (come - planned), come / np.maximum(planned, ARRIVED), 10 * planned
        told = np.concatenate([aim.heading, *ahead], axis=-1)
        changed = [np.clip(each, -3, 3) for each in (now - self._first, *lagged)]
        return np.concatenate([told, observe(layout, past, aim, scene), *changed], axis=-1)
