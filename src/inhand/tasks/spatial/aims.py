"""What a learned controller is asked in space: a direction to move along, or an axis to turn about, and how far."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import TURN_ARM, Array, inverse_quaternion
from inhand.once import once
from inhand.rotations import multiply, quaternion_of, vector_of
from inhand.sim.state import State


@dataclass(frozen=True)
class SpatialAim:
    """The primitive of each of B worlds, and the pose from which it starts; the counterpart of `Aim` in the plane."""

    KEPT: ClassVar[tuple[str, ...]] = ("along", "about", "start", "distance")
    """What tells one from another."""

    along: Array
    """Unit vectors along which objects are to move, in the palm frame `(B, 3)`; 0 where they are to turn or to stay."""
    about: Array
    """Unit vectors about which they are to turn on the spot `(B, 3)`; 0 where they are to move or to stay."""
    start: Array
    """Pose of the object where the primitive starts, in the palm frame `(B, 7)`."""
    distance: Array | float = np.inf
    """Way at which the object is to stay `(B,)` [m], a turn as an arc at `TURN_ARM`; infinite where none was given."""

    @staticmethod
    def where(state: State) -> Array:
        """Return the poses `(B, 7)` of a state that shifts are of."""
        return state.object_pose

    @cached_property
    def turning(self) -> NDArray[np.bool_]:
        """Which are to turn `(B,)`."""
        return np.asarray(self.about.any(axis=-1))

    @once
    def turned(self, pose: Array) -> Array:
        """Return the angles `(B,)` [rad] by which poses `(B, 7)` are turned about the axes; 0 where nothing is to turn.

        They are counted up to a whole turn each way: an engine's quaternions do not jump, so q and -q differ by one.
        """
        between = multiply(pose[:, 3:], inverse_quaternion(self.start[:, 3:]))
        angle = 2 * np.arctan2((between[:, 1:] * self.about).sum(axis=-1), between[:, 0])
        return np.where(self.turning, angle, 0.0)

    @once
    def off_by(self, pose: Array) -> Array:
        """Return how far poses `(B, 7)` are moved and turned from the nearest on what is asked `(B, 6)` [m, rad]."""
        moved = pose[:, :3] - self.start[:, :3]
        aside = moved - (moved * self.along).sum(axis=-1, keepdims=True) * self.along
        there = multiply(quaternion_of(self.turned(pose)[:, None] * self.about), self.start[:, 3:])
        return np.concatenate([aside, vector_of(multiply(pose[:, 3:], inverse_quaternion(there)))], axis=-1)

    def shift(self, pose: Array) -> Array:
        """Return the way come along what is asked, the distance from it [m] and the angle from it [rad] `(B, 3)`."""
        off, moved = self.off_by(pose), pose[:, :3] - self.start[:, :3]
        come = (moved * self.along).sum(axis=-1) + TURN_ARM * self.turned(pose)
        return np.stack([come, np.linalg.norm(off[:, :3], axis=-1), np.linalg.norm(off[:, 3:], axis=-1)], axis=-1)

    def come(self, shift: Array) -> Array:
        """Return the way along what is asked of shifts `(B, 3)` [m]; an angle turned counts as an arc at `TURN_ARM`."""
        return np.asarray(shift[:, 0])

    def off(self, shift: Array) -> tuple[Array, Array]:
        """Return how far shifts `(B, 3)` are off what is asked [m], and turned from it [rad], each `(B,)`."""
        return shift[:, 1], shift[:, 2]

    def left(self, pose: Array) -> Array:
        """Return the way that poses `(B, 7)` are from where the object is to stay `(B,)` [m]."""
        return np.asarray(self.distance - self.come(self.shift(pose)))

    def take(self, rows: NDArray[np.int64]) -> SpatialAim:
        """Return what is asked of some worlds."""
        distance = np.broadcast_to(self.distance, len(self.along))[rows]
        return SpatialAim(self.along[rows], self.about[rows], self.start[rows], distance)

    @cached_property
    def motion(self) -> Array:
        """How objects move and turn for each metre of way `(B, 6)` [m, rad]."""
        return np.concatenate([self.along, self.about / TURN_ARM], axis=-1)

    def speed(self, state: State) -> Array:
        """Return how fast objects move along what is asked `(B,)` [m/s]; what turns counts as an arc at `TURN_ARM`."""
        velocity = state.object_velocity
        turning = TURN_ARM * (velocity[:, 3:] * self.about).sum(axis=-1)
        return np.asarray((velocity[:, :3] * self.along).sum(axis=-1) + turning)
