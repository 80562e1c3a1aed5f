"""Where the object is in space, from encoders, commands, and late and noisy frames of a camera."""

import numpy as np

from inhand.control.estimator import LATELY, SOON, EstimatorConfig, PoseFilter
from inhand.control.seen import Seen
from inhand.geometry import Array
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.kinematics import measure, point_jacobian
from inhand.hands.spatial.objects import SolidSpec
from inhand.rotations import change_between, pose_from, seen_from
from inhand.sim.state import SpatialState, believed_in_space

REGULAR = np.repeat([1e-6, 1e-9], 3)
"""Keeps the equations of a carried object solvable where its contacts fall together."""
FASTEST = np.repeat([0.004, 0.1], 3)
"""An object moves and turns at most so far in a decision along and about each axis [m, rad]: as in the plane."""


class SpatialEstimator(PoseFilter):
    """Estimates of B worlds in space."""

    def __init__(self, hand: SpatialHand, spec: SolidSpec, config: EstimatorConfig | None = None) -> None:
        """Estimate worlds of a hand and an object."""
        super().__init__(config)
        self._hand, self._spec = hand, spec
        self._last = np.array([len(finger.links) - 1 for finger in hand.fingers])

    def state(self, seen: Seen) -> SpatialState:
        """Return what is believed of the worlds: pose, joints and contacts; of forces nothing is known."""
        count, joints = len(self._joints), (self._joints, seen.joint_velocities, seen.targets)
        contacts = np.tile(self._last, (count, 1)), self._points, self._normals
        return believed_in_space(seen.time, (self._pose, np.zeros((count, 6))), joints, contacts)

    @property
    def grip(self) -> tuple[Array, Array]:
        """Where fingers are believed to touch, in the object's frame, and its normals there, `(B, F, 3)` each [m]."""
        return seen_from(self._pose[:, None], self._points), self._normals

    @property
    def velocity(self) -> Array:
        """How objects are believed to have moved in the last few decisions `(B, 6)` [m/s, rad/s]."""
        moved = self.off(self._poses[-1], self._poses[-1 - LATELY])
        return np.asarray(moved / np.maximum(self._times[-1] - self._times[-1 - LATELY], SOON)[:, None])

    def _axes(self, each: tuple[float, float, float]) -> Array:
        return np.repeat([each[0], each[2]], 3)

    def _meet(self) -> None:
        told = measure(self._hand, self._spec, self._joints, self._pose)
        self._places, self._hinges = told.places, told.axes
        self._gaps, self._points, self._normals = told.gaps.T, told.points, told.normals

    def _carried(self, moved: Array) -> Array:
        """Return how the object moves by least squares over the contacts, each of which moves with its finger."""
        rows, motion = self._rows(), np.empty_like(self._points)
        for i, own in enumerate(self._hand.slices):
            jacobian = point_jacobian(self._places[:, own], self._hinges[:, own], self._points[:, i])
            motion[:, i] = (jacobian * moved[:, None, own]).sum(axis=-1)
        matrix = rows.reshape(len(moved), -1, 6)
        across = matrix.transpose(0, 2, 1)
        sides = across @ motion.reshape(len(moved), -1, 1)
        return np.clip(np.linalg.solve(across @ matrix + np.diag(REGULAR), sides)[..., 0], -FASTEST, FASTEST)

    def _rows(self) -> Array:
        """Return how each contact's point of the object moves with it `(B, F, 3, 6)`."""
        x, y, z = np.moveaxis(self._points - self._pose[:, None, :3], -1, 0)
        none = np.zeros_like(x)
        turned = np.stack([np.stack(row, axis=-1) for row in ((none, z, -y), (-z, none, x), (y, -x, none))], axis=-2)
        return np.concatenate([np.broadcast_to(np.eye(3), turned.shape), turned], axis=-1)

    def _away(self) -> Array:
        return np.asarray(-(self._normals[:, :, None] @ self._rows())[:, :, 0])

    def moved(self, pose: Array, change: Array) -> Array:
        """Return poses moved, and turned about the palm frame's axes."""
        return pose_from(pose, change[:, :3], change[:, 3:])

    def off(self, pose: Array, other: Array) -> Array:
        """Return how far they are moved and turned from others."""
        return change_between(other, pose)

    def _between(self, one: Array, other: Array, share: Array) -> Array:
        near = one * (1 - share) + other * share
        return np.concatenate([near[:, :3], near[:, 3:] / np.linalg.norm(near[:, 3:], axis=-1, keepdims=True)], axis=-1)
