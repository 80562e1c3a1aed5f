"""Trials of hands in space."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.control.episode import Episode, Source
from inhand.geometry import Array, inverse_quaternion
from inhand.hands.spatial.gravity import gravity_name
from inhand.hands.spatial.hand import SpatialHand, Vector
from inhand.hands.spatial.objects import SolidSpec
from inhand.rotations import multiply


@dataclass(frozen=True, kw_only=True)
class SpatialPassport(Source):
    """Where a trial of a hand in space comes from."""

    hand: SpatialHand
    object: SolidSpec
    along: Vector | None
    """Unit vector of the primitive's direction, None where it only turns."""
    about: Vector | None
    """Unit vector about which it turns, None where it does not."""
    gravity: Vector
    """Gravity in the palm frame [m/s^2]."""

    @property
    def turns(self) -> bool:
        """Whether the primitive only turns the object."""
        return self.along is None

    @property
    def settings(self) -> tuple[str, ...]:
        """Hand, object, controller, engine, disturbance and gravity by their names."""
        return *super().settings, gravity_name(self.gravity)


@dataclass(frozen=True, eq=False)
class SpatialTrial(Episode[SpatialPassport]):
    """One recorded episode of a hand in space."""

    @property
    def torque_max_nmm(self) -> float:
        """Largest torque of a finger's contact about the object's middle in any row [N mm]."""
        arm = self.object_points - self.object_pose[:, None, :3]
        return 1e3 * float(np.linalg.norm(np.cross(arm, self.forces), axis=-1).max())

    def manipulated(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return positions `(M, 3)` [mm] and rotations `(M, 4)` (quaternions) from the grasp on, and contact.

        A trial whose grasp failed gives one row at the origin without contact.
        """
        rows = self.manipulation
        pose = self.object_pose[rows]
        if len(pose) == 0:
            return np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]), np.zeros((1, self.gaps.shape[1]), dtype=bool)
        turned = multiply(pose[:, 3:], inverse_quaternion(pose[:1, 3:]))
        return 1e3 * (pose[:, :3] - pose[0, :3]), turned, self.touching[rows]
