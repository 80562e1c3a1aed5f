"""A learned policy for hands in space, as a controller."""

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import SpatialTask
from inhand.control.policy import STILL_TIME, STILL_WAY, Policy
from inhand.control.seen import PRIVILEGED
from inhand.control.spatial_follow import Ending, margin_at, spatial_limit
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial.following import FollowRules
from inhand.rotations import SpatialPath
from inhand.sim.state import State
from inhand.tasks.decisions import targets_of
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import Scene, observe
from inhand.tasks.spatial.aims import SpatialAim

MARGIN = (0.003, 0.12)
"""What a policy keeps from where its grip is predicted to end: distance [m], and angle [rad] where the path turns. A
little more than the expert, whose integral part brings the object to its place exactly."""
SHORTER = (0.003, 0.1)
"""How much less far a policy is told to go than the expert found that a grip carries [m], and turned [rad]: it holds
the end of its way less exactly, and a grip is lost just beyond it."""
BENT = 1e-6
"""Paths that turn or leave their line by more are not straight [m or rad]."""


class SpatialPolicyController:
    """Moves or turns the object of every world as a policy says, and ends where the policy holds."""

    reads = PRIVILEGED

    def __init__(self, task: SpatialTask, policy: Policy) -> None:
        """Carry objects along the task's paths, straight or turns on the spot, or hold them where paths have no length.

        Raises:
            InputError: other paths.
        """
        self._task, self._policy, self._period = task, policy, task.control_period
        self._layout = find_layout(policy.observation)
        self._along, self._about = units_of(task.path)
        self._scene = Scene(task.hand, task.objects, gravity=task.gravity)

    def begin(self, state: State) -> None:
        """Start a primitive where the object is now."""
        self._aim = SpatialAim(self._along, self._about, self._task.origin(state), self._distance(state))
        self._best, self._still = np.zeros((2, state.n_worlds))

    def _distance(self, state: State) -> Array:
        """Return the way to go `(B,)` [m]: as the task says, or as far as the grip held now is predicted to reach."""
        length = self._task.path.length
        if self._task.distance is not None:
            return np.minimum(self._task.distance, length)
        return np.minimum(spatial_limit(self._task, state, Ending(FollowRules(), MARGIN)), length)

    def act(self, state: State) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        action = self._policy(observe(self._layout, state, self._aim, self._scene))
        return targets_of(action, self._policy.actions, self._task.hand, state)

    def finished(self, state: State) -> NDArray[np.bool_]:
        """Return which worlds have gained nothing of what is asked for a while `(B,)`."""
        come = self._aim.come(self._aim.shift(state.object_pose))
        gained = come > self._best + STILL_WAY
        self._best = np.where(gained, come, self._best)
        self._still = np.where(gained, 0.0, self._still + self._period)
        return np.asarray(self._still >= STILL_TIME)


def shorter(path: SpatialPath, way: Array) -> Array:
    """Return the ways `(B,)` [m] that a policy is told to go where the expert goes some way along paths."""
    return np.asarray(np.maximum(way - margin_at(path, way, SHORTER), 0.0))


def units_of(path: SpatialPath) -> tuple[Array, Array]:
    """Return directions and axes, unit vectors or 0 `(B, 3)` each, of paths that go straight or turn on the spot.

    Raises:
        InputError: a path that bends, or turns while it moves.
    """
    found = []
    for rows in (path.moves, path.turns):
        end = rows[:, -1]
        size = np.linalg.norm(end, axis=-1, keepdims=True)
        unit = np.where(size > BENT, end / np.maximum(size, BENT), 0.0)
        beside = rows - (rows * unit[:, None]).sum(axis=-1, keepdims=True) * unit[:, None]
        if np.abs(beside).max() > BENT:
            raise InputError(
                "a learned policy knows straight primitives and turns about one axis; for paths that bend use the"
                " controller 'ik'"
            )
        found.append(unit)
    if (found[0].any(axis=-1) & found[1].any(axis=-1)).any():
        raise InputError(
            "a learned policy moves an object or turns it, one after the other; for paths that do both at once use the"
            " controller 'ik'"
        )
    return found[0], found[1]
