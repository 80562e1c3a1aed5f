"""The expert's law in space on what a hand can know: an estimator in front of it, and a way that was planned before.

It closes its grip while the world still holds the object, and looks at it meanwhile. From then on the path counts from
where the object is believed, so that a constant bias of the camera drops out.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Controller, SpatialTask
from inhand.control.estimator import EstimatorConfig
from inhand.control.seen import SENSED, Seen
from inhand.control.spatial_estimator import SpatialEstimator
from inhand.control.spatial_ik import SpatialIkConfig, SpatialIkController
from inhand.geometry import Array

SENSED_SPATIAL_IK = SpatialIkConfig(speed=0.045, acceleration=0.15, grip=4.5, friction_share=0.65, follow_share=0.55)
"""The expert's numbers on real senses: a firmer grip, for heavier objects, less friction and pushes; faster, as there
are pushes all the time. Where no way was planned, the end that is predicted uses the least friction of `field`."""
SOFT = replace(SENSED_SPATIAL_IK, proportional=0.5, integral=0.0)
"""The same where an object is to stay, while its world still holds it and when that lets go: what fingers are asked to
mend there builds up as forces. That this keeps more objects is not shown (docs/spatial.md)."""


class SpatialIkSensedController:
    """Carries objects as far as was planned, or as their grips can follow, and holds them there."""

    reads = SENSED

    def __init__(
        self, task: SpatialTask, config: SpatialIkConfig = SENSED_SPATIAL_IK, estimator: EstimatorConfig | None = None
    ) -> None:
        """Carry objects along the task's paths."""
        self.estimator, self._looks = SpatialEstimator(task.hand, task.objects[0], estimator), False
        stays = config == SENSED_SPATIAL_IK and not task.path.length.any()
        self.law = SpatialIkController(task, SOFT if stays else config)

    def take_over(self, before: Controller) -> None:
        """Go on with what the controller of its kind believes and commands that has held the objects."""
        if isinstance(before, SpatialIkSensedController):
            self.estimator, self._looks = before.estimator, True
            self.law.take_over(before.law)

    def begin(self, seen: Seen) -> None:
        """Start from the grip that holds the object now."""
        (self.estimator.take if self._looks else self.estimator.begin)(seen)
        self._state = self.estimator.state(seen)
        self.law.begin(self._state)

    def act(self, seen: Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        self.estimator.take(seen)
        self._state = self.estimator.state(seen)
        return self.law.act(self._state)

    @property
    def progress(self) -> Array:
        """How far the set point has gone along each path `(B,)` [m]."""
        return self.law.progress

    def finished(self, seen: Seen) -> NDArray[np.bool_]:
        """Return which worlds have held the end of their way for a while `(B,)`."""
        del seen
        return self.law.finished(self._state)
