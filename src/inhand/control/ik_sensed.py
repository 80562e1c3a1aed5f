"""The expert's law on what a hand can know: an estimator in front of it, and an end of the way that was planned before.

It waits in its grip while the first frames come in, then carries the object along its path, counted from where it is
believed to be then. A constant bias of the camera so drops out. At the end of its way its commands stay as they are:
half of all objects that were lost were lost there, to feedback on an estimate that is noisy.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Task
from inhand.control.estimator import Estimator, EstimatorConfig, waited
from inhand.control.ik import IkConfig, IkController
from inhand.control.seen import SENSED, Seen
from inhand.geometry import Array

SENSED_IK = IkConfig(
    speed=0.06,
    acceleration=0.3,
    grip=3.0,
    integral=8.0,
    integral_limit=(0.004, 0.004, 0.08),
    along=(0.67, 0.0),
    lasting=False,
    damping=0.01,
    friction_share=0.58,
    margin=(0.004, 0.16),
)
"""The expert's numbers on real senses: a firmer grip, for heavier objects and pushes; softer feedback along the path,
as an object that slides is lost to what pushes it on; across it an integral part that is small and lets go where the
object is to stop, as what dragged on it is gone there; faster, as there are pushes all the time. Where no way was
planned, the end that is predicted uses the least friction of `field`."""

SENSED_PRIMITIVE = replace(
    SENSED_IK, proportional=1.0, integral=2.0, integral_limit=(0.003, 0.003, 0.06), along=(1.0, 1.0), lasting=True
)
"""The same for primitives of a sequence, which have to arrive where the next one begins: an integral part lasts."""


class IkSensedController:
    """Carries objects as far as was planned, or as its grip can follow, and holds them there."""

    reads = SENSED

    def __init__(self, task: Task, config: IkConfig = SENSED_IK, estimator: EstimatorConfig | None = None) -> None:
        """Carry objects along the task's paths."""
        self._estimator = Estimator(task.hand, task.objects[0], estimator)
        self._law = IkController(task, config)
        self._waiting = IkController(replace(task, distance=np.zeros(task.n_worlds)), config)

    def begin(self, seen: Seen) -> None:
        """Start from the grip that holds the object now."""
        self._estimator.begin(seen)
        self._began, self._carrying = seen.time, False
        self._state = self._estimator.state(seen)
        self._waiting.begin(self._state)

    def act(self, seen: Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        self._estimator.take(seen)
        self._state = self._estimator.state(seen)
        # Time stands still in a world whose episode has ended: it holds up no other.
        if not self._carrying and bool(waited(self._began, seen).any()):
            self._carrying = True
            self._law.begin(self._state)
        if not self._carrying:
            return self._waiting.act(self._state)
        arrived = self._law.held > 0
        return np.where(arrived[:, None], seen.targets, self._law.act(self._state))

    @property
    def progress(self) -> Array:
        """How far the set point has gone along each path `(B,)` [m]."""
        return (self._law if self._carrying else self._waiting).progress

    def finished(self, seen: Seen) -> NDArray[np.bool_]:
        """Return which worlds have held the end of their way for a while `(B,)`."""
        if not self._carrying:
            return np.zeros(seen.n_worlds, dtype=bool)
        return self._law.finished(self._state)
