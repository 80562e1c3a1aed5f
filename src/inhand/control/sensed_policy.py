"""A learned policy on what a hand can know: it waits for its first frames, then goes the way that it is told."""

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Task
from inhand.control.follow import follow_limit
from inhand.control.ik_sensed import SENSED_IK
from inhand.control.knowing import check_task
from inhand.control.memory import Memory
from inhand.control.policy import Policy, aims_of
from inhand.control.seen import SENSED, Seen
from inhand.geometry import Array
from inhand.hands.fit import Held
from inhand.tasks.decisions import targets_of
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import Aim, Scene, observe

ARRIVED = 0.001
"""Less than this left to go [m] is nothing: from then on commands stay as they are, as those of `ik-sensed` do."""
GAINED = 5e-4
"""A hand whose object is believed to have come no farther than this along its way [m] during"""
STILL_TIME = 0.4
"""this time [s] holds, and its episode is over."""


class SensedPolicyController:
    """Moves or turns the object of every world as a policy says, and ends where the policy holds."""

    reads = SENSED

    def __init__(self, task: Task, policy: Policy) -> None:
        """Carry objects along the task's paths, which are straight or turn on the spot.

        Raises:
            InputError: other paths, or a hand with another number of joints than the policy knows.
        """
        check_task(policy, task)
        self._task, self._policy = task, policy
        self._angle, self._turn = aims_of(task.path.poses)
        self._layout, self._scene = find_layout(policy.observation), Scene(task.hand, task.objects)

    def begin(self, seen: Seen) -> None:
        """Start a primitive where the object is now."""
        self._memory, self._taken = Memory(Held(self._task.hand, self._task.objects[0]), seen), True
        self._asked = Aim(self._angle, seen.frame_pose, self._way(seen), turn=self._turn)
        self.progress = np.zeros(seen.n_worlds)
        """How far each object is believed to have come along its path `(B,)` [m]."""
        self._arrived = np.zeros(seen.n_worlds, dtype=bool)
        self._best = np.zeros(seen.n_worlds)
        self._still = np.zeros(seen.n_worlds)

    def act(self, seen: Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        if not self._taken:
            self._memory.take(seen)
        self._taken = False
        self._past = self._memory.past
        aim = self._past.aimed(self._asked)
        self.progress = aim.come(self._past.shift(aim))
        self._arrived |= ~self._past.waiting & (aim.distance - self.progress < ARRIVED)
        action = self._policy(observe(self._layout, self._past, aim, self._scene))
        targets = targets_of(action, self._policy.actions, self._task.hand, self._past)
        return np.where(self._arrived[:, None], seen.targets, targets)

    def finished(self, seen: Seen) -> NDArray[np.bool_]:
        """Return which worlds have gained nothing on their way for a while `(B,)`."""
        del seen
        gained = (self.progress > self._best + GAINED) | self._past.waiting
        self._best = np.where(gained, self.progress, self._best)
        self._still = np.where(gained, 0.0, self._still + self._task.control_period)
        return np.asarray(self._still >= STILL_TIME)

    def _way(self, seen: Seen) -> Array:
        """Return the way to go `(B,)` [m]: as the task says, or as far as the grip is predicted to carry."""
        if self._task.distance is not None:
            return np.minimum(self._task.distance, self._task.path.length)
        return follow_limit(self._task, self._memory.state(seen), SENSED_IK.friction_share, SENSED_IK.margin)
