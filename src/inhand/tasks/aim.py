"""What a learned controller is asked: move the object along a direction from where it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inhand.geometry import Array, perpendicular, unit, wrap_angle


@dataclass(frozen=True)
class Aim:
    """The primitive of each of B worlds: a direction, and the pose from which it starts."""

    angle: Array
    """Direction `(B,)`, counter-clockwise from +x [rad]."""
    start: Array
    """Pose of the object where the primitive starts, in the palm frame `(B, 3)` [m, m, rad]."""
    distance: Array | float = np.inf
    """Way along the direction at which the object is to stay `(B,)` [m]; infinite where none was given."""
    share: Array | float = 0.0
    """Share of a whole route that the object has come `(B,)`; 0 of a primitive."""
    end: Array | None = None
    """Pose at the end of a whole route, in the palm frame `(B, 3)`; None of a primitive."""

    def shift(self, pose: Array) -> Array:
        """Return the way along the direction, the way to its left [m] and the angle turned [rad] of poses `(B, 3)`."""
        way, direction = pose[:, :2] - self.start[:, :2], unit(self.angle)
        along = (way * direction).sum(axis=-1)
        left = (way * perpendicular(direction)).sum(axis=-1)
        return np.stack([along, left, wrap_angle(pose[:, 2] - self.start[:, 2])], axis=-1)

    def left(self, pose: Array) -> Array:
        """Return the way that poses `(B, 3)` are from where the object is to stay `(B,)` [m]."""
        return np.asarray(self.distance - self.shift(pose)[:, 0])

    def goal(self, distance: Array | float) -> Array:
        """Return the poses `(B, 3)` at a distance [m] along the primitives."""
        way = np.broadcast_to(distance, self.angle.shape)[:, None] * unit(self.angle)
        return np.concatenate([self.start[:, :2] + way, self.start[:, 2:]], axis=-1)
