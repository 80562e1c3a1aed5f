"""A learned policy for hands in space on what a hand can know: it looks a little, then goes the way that it is told."""

import numpy as np

from inhand.control.controller import SpatialTask
from inhand.control.memory import Memory
from inhand.control.policy import Policy
from inhand.control.seen import Seen
from inhand.control.spatial_follow import Ending, spatial_limit
from inhand.control.spatial_policy import MARGIN, units_of
from inhand.control.underway import ARRIVED, Deciding, Underway
from inhand.geometry import Array
from inhand.hands.spatial.following import FollowRules
from inhand.hands.spatial.pair import SpatialPair
from inhand.tasks.observations import Scene
from inhand.tasks.spatial.aims import SpatialAim


class SpatialSensedPolicyController(Underway):
    """Moves or turns the object of every world as a policy says, and keeps its commands at the end of the way."""

    def __init__(self, task: SpatialTask, policy: Policy) -> None:
        """Carry objects along the task's paths, straight or turns on the spot, or hold them where paths have no length.

        Raises:
            InputError: other paths.
        """
        self._task, self._period = task, task.control_period
        self._decide = Deciding(policy, Scene(task.hand, task.objects, gravity=task.gravity))
        self._units = units_of(task.path)

    def begin(self, seen: Seen) -> None:
        """Start a primitive where the object is now."""
        self._memory = Memory(SpatialPair(self._task.hand, self._task.objects[0]), seen)
        # It stops so much before what it is asked for.
        way = self._way(seen) + ARRIVED
        self._set_off(SpatialAim(*self._units, seen.frame_pose, way), np.zeros_like(way))

    def _way(self, seen: Seen) -> Array:
        """Return the way to go `(B,)` [m]: as the task says, or as far as the grip is predicted to carry."""
        task, told = self._task, self._task.distance
        if told is None:
            told = spatial_limit(task, self._memory.state(seen), Ending(FollowRules(), MARGIN))
        return np.minimum(told, task.path.length)
