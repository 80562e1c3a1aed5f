"""Learned policies that were trained on a whole task, as controllers: they follow whole paths, without a sequence.

A new aim lies a little ahead of where each object has come to, at every decision (`tasks/routes.py`). Nothing is asked
of how far the grip carries.
"""

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Task
from inhand.control.knowing import check_task
from inhand.control.memory import Memory
from inhand.control.policy import Policy
from inhand.control.seen import SENSED, Seen
from inhand.control.underway import Deciding
from inhand.geometry import Array
from inhand.hands.fit import Held
from inhand.sim.state import State
from inhand.tasks.observations import Aim, Scene
from inhand.tasks.routes import routes_of

STILL = 1.5
"""A policy that has come no farther for this time is done, or stuck [s]."""


class OnRoutes:
    """What both kinds have in common: the places on their routes that objects have come to."""

    def __init__(self, task: Task, policy: Policy) -> None:
        """Follow the task's paths.

        Raises:
            InputError: a hand with another number of joints than the policy knows, or another rate than its contract's.
        """
        check_task(policy, task)
        self._task, self._period = task, task.control_period
        self._decide = Deciding(policy, Scene(task.hand, task.objects))
        self._rows = np.arange(task.n_worlds)
        self.came: list[Array] = []
        """Way along its route that each world had come at every decision `(B,)` [m]."""

    def _start(self, start: Array) -> None:
        """Start at the beginning of every route, which begin at poses `(B, 3)`."""
        self._routes = routes_of(list(start[:, None] + self._task.path.poses))
        self._come, self._still = np.zeros(len(start), dtype=np.int64), np.zeros(len(start))

    def _aim(self, pose: Array) -> Aim:
        """Return what is asked of objects that have come to poses `(B, 3)`."""
        before, self._come = self._come, self._routes.advance(self._rows, self._come, pose)
        self._still = np.where(self._come > before, 0.0, self._still + self._period)
        self.came.append(self._routes.way[self._rows, self._come])
        return self._routes.aim(self._rows, self._come)

    def _stands(self) -> NDArray[np.bool_]:
        """Return which worlds have come no farther along their route for a while `(B,)`."""
        return np.asarray(self._still >= STILL)


class RouteController(OnRoutes):
    """Follows the whole path of every world as a policy says, on perfect knowledge."""

    def begin(self, state: State) -> None:
        """Start at the beginning of every route."""
        self._start(self._task.origin(state))

    def act(self, state: State) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        return self._decide(state, self._aim(state.pose))

    def finished(self, state: State) -> NDArray[np.bool_]:
        """Return which worlds have come no farther along their route for a while `(B,)`."""
        del state
        return self._stands()


class SensedRouteController(OnRoutes):
    """The same on what a hand can know: where objects are is what it believes, once its first frames are in."""

    reads = SENSED

    def begin(self, seen: Seen) -> None:
        """Start at the beginning of every route."""
        self._memory = Memory(Held(self._task.hand, self._task.objects[0]), seen)
        self._start(seen.frame_pose if self._task.start is None else self._task.start)

    def act(self, seen: Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        self._memory.take(seen)
        past = self._memory.past
        return self._decide(*past.planned(self._aim(past.pose)))

    def finished(self, seen: Seen) -> NDArray[np.bool_]:
        """Return which worlds have come no farther along their route for a while `(B,)`."""
        del seen
        return self._stands()
