"""A learned policy on what a hand can know: it waits for its first frames, then goes the way that it is told."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Task
from inhand.control.follow import follow_limit
from inhand.control.ik_sensed import SENSED_IK
from inhand.control.knowing import check_task
from inhand.control.memory import Memory
from inhand.control.policy import Policy, parts_of
from inhand.control.seen import SENSED, Seen
from inhand.control.underway import ARRIVED, Deciding, Underway
from inhand.geometry import TURN_ARM, Array
from inhand.hands.fit import Held
from inhand.tasks.observations import Aim, Scene
from inhand.tasks.past import Past


class OnSenses:
    """A policy that sees what a hand can know, and the paths that it is to follow."""

    reads = SENSED

    def __init__(self, task: Task, policy: Policy) -> None:
        """Follow the task's paths, which turn on the spot or go straight, or one after the other, or have no length.

        Raises:
            InputError: other paths, or a hand with another number of joints than the policy knows.
        """
        check_task(policy, task)
        self._task, self._decide = task, Deciding(policy, Scene(task.hand, task.objects))
        self._period = task.control_period
        self._angle, self._turned = parts_of(task.path.poses)


class SensedPolicyController(OnSenses, Underway):
    """Turns the object of every world on the spot, then moves it, as a policy says; ends where the policy holds."""

    def begin(self, seen: Seen) -> None:
        """Start a primitive where the object is now."""
        self._memory = Memory(Held(self._task.hand, self._task.objects[0]), seen)
        # It stops so much before what it is asked for.
        way, arc = self._way(seen) + ARRIVED, TURN_ARM * np.abs(self._turned)
        first = asked(self._angle, self._turned, seen.frame_pose, np.where(arc > 0, np.minimum(arc, way), way))
        self._set_off(first, np.where(arc > 0, np.maximum(way - arc, 0.0), 0.0))
        self._arrived = way <= ARRIVED  # what is to go nowhere is held: a policy would look for the start, and lose it

    def _move_on(self, worlds: NDArray[np.bool_]) -> None:
        """Ask of some worlds, which have turned, to move."""
        self._memory.go_on(np.flatnonzero(worlds), self._turned[worlds])
        self._gone = np.where(worlds, self._asked.distance, self._gone)
        moving = asked(self._angle, np.zeros_like(self._turned), self._asked.start, self._rest)
        new = {name: np.where(worlds, getattr(moving, name), getattr(self._asked, name)) for name in CHANGED}
        self._asked, self._rest = replace(self._asked, **new), np.where(worlds, 0.0, self._rest)

    def _way(self, seen: Seen) -> Array:
        """Return the way to go `(B,)` [m]: as the task says, or as far as the grip is predicted to carry."""
        if self._task.distance is not None:
            return np.minimum(self._task.distance, self._task.path.length)
        return follow_limit(self._task, self._memory.state(seen), SENSED_IK.friction_share, SENSED_IK.margin)


class PolicyPrimitive(OnSenses):
    """A primitive of a sequence, as a policy says: sees what has been remembered since the sequence began."""

    def begin(self, past: Past) -> None:
        """Start where the task says, or where the object is believed."""
        start = past.pose if self._task.start is None else self._task.start
        distance = self._task.path.length if self._task.distance is None else self._task.distance
        # It stops a little before what it is asked for, and the sequence waits until it has arrived.
        distance = np.broadcast_to(np.where(np.asarray(distance) > 0, distance + ARRIVED, 0.0), len(start))
        self._asked = asked(self._angle, self._turned, start, distance)
        self._first = past.joint_angles

    def act(self, past: Past) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        return self._decide(*self.seen_by(past))

    def seen_by(self, past: Past) -> tuple[Past, Aim]:
        """Return what the policy sees: itself counts from where the primitive starts, once first frames are in."""
        return replace(past, first=self._first).planned(self._asked)

    def finished(self, past: Past) -> NDArray[np.bool_]:
        """Return that nothing is over: the sequence sees where objects have come to."""
        return np.zeros(past.n_worlds, dtype=bool)


CHANGED = ("angle", "distance", "turn")
"""What another primitive asks otherwise."""


def asked(angle: Array, turned: Array, start: Array, distance: Array) -> Aim:
    """Return aims that turn where paths do `(B,)` [rad], and move along directions `(B,)` [rad] where they do not."""
    return Aim(np.where(turned == 0, angle, 0.0), start, distance, turn=np.sign(turned))
