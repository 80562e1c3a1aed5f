"""What a learned policy on what a hand can know does along its way, in the plane and in space, until it is there."""

from abc import ABC
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.control.ik_sensed import SENSED_IK
from inhand.control.memory import Memory
from inhand.control.policy import Policy
from inhand.control.seen import SENSED, Seen
from inhand.geometry import Array
from inhand.sim.state import State
from inhand.tasks.decisions import targets_of
from inhand.tasks.hand_arrays import slots_of
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import AnyAim, Scene, observe
from inhand.tasks.past import Past

ARRIVED = 0.001
"""Less than this left to go [m] is nothing: from then on commands stay as they are, as those of `ik-sensed` do."""
SETTLE = SENSED_IK.settle
"""Its episode is over when it has held that end for this time [s], or where the object has come no farther than"""
GAINED, STILL_TIME = 5e-4, 0.4
"""this [m] in this time [s]."""


class Deciding:
    """Joint targets of a policy for what is remembered, or is true of one on perfect knowledge, and asked."""

    def __init__(self, policy: Policy, scene: Scene) -> None:
        """Decide for the hand and the objects of a scene."""
        self._policy, self._layout, self._scene = policy, find_layout(policy.observation), scene

    def __call__(self, past: Past | State, aim: AnyAim) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        action = self._policy(observe(self._layout, past, aim, self._scene))
        if self._layout.columns:
            action = action[..., slots_of(self._scene.hand)]
        return targets_of(action, self._policy.actions, self._scene.hand, past)


class Underway(ABC):
    """A policy that goes as far as was asked and keeps its commands there; what it sees and asks others set up."""

    reads = SENSED
    _memory: Memory
    _decide: Deciding
    _period: float
    _asked: Any
    _rest: Array

    def _set_off(self, asked: AnyAim, rest: Array) -> None:
        """Ask something of every world, and that it moves on by some rest `(B,)` [m] when it is there."""
        self._asked, self._rest = asked, rest
        self._gone, self._best, self._still, self._held = np.zeros((4, len(rest)))
        self.progress = np.zeros(len(rest))
        """How far each object is believed to have come along its path `(B,)` [m]."""
        self._arrived = np.zeros(len(rest), dtype=bool)

    def act(self, seen: Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        self._memory.take(seen)
        self._look()
        turned = self._near & (self._rest > 0)
        if turned.any():
            self._move_on(turned)
            self._look()
        self._arrived |= self._near
        return np.where(self._arrived[:, None], seen.targets, self._decide(self._past, self._aim))

    def finished(self, seen: Seen) -> NDArray[np.bool_]:
        """Return which worlds have held the end of their way, or gained nothing on it, for a while `(B,)`."""
        del seen
        gained = (self.progress > self._best + GAINED) | self._past.waiting
        self._best = np.where(gained, self.progress, self._best)
        self._still = np.where(gained, 0.0, self._still + self._period)
        self._held = np.where(self._arrived, self._held + self._period, 0.0)
        return np.asarray((self._held >= SETTLE) | (self._still >= STILL_TIME))

    def _move_on(self, worlds: NDArray[np.bool_]) -> None:
        """Ask the rest of some worlds that have one."""
        raise NotImplementedError

    def _look(self) -> None:
        """Find out what is remembered, how far objects have come and which are near the end of what is asked."""
        self._past = self._memory.past
        self._aim = self._past.aimed(self._asked)
        come = self._aim.come(self._past.shift(self._aim))
        self._near = ~self._past.waiting & (self._aim.distance - come < ARRIVED)
        self.progress = self._gone + come
