"""Where the object is in the plane, from encoders, commands, and late and noisy frames of a camera."""

import numpy as np

from inhand.control.pose_filter import LATELY, SOON, EstimatorConfig, PoseFilter
from inhand.control.seen import Seen
from inhand.geometry import Array, cross, inverse_transform, perpendicular, transform, wrap_angle
from inhand.hands.hand import HandSpec
from inhand.hands.kinematics import joint_positions, point_jacobian
from inhand.hands.objects import ObjectSpec, convex_pieces
from inhand.hands.polygons import contact
from inhand.hands.shapes import link_polygon
from inhand.sim.state import State, believed

REGULAR = (1e-6, 1e-6, 1e-9)
"""Keeps the equations of a carried object solvable where its contacts fall together."""
FASTEST = (0.004, 0.004, 0.1)
"""An object moves at most so far in a decision [m, m, rad]: guessed, ten times as fast as the expert."""


class Estimator(PoseFilter):
    """Estimates of B worlds in the plane."""

    def __init__(self, hand: HandSpec, spec: ObjectSpec, config: EstimatorConfig | None = None) -> None:
        """Estimate worlds of a hand and an object."""
        super().__init__(config)
        self._hand, self._pieces = hand, convex_pieces(spec)
        self._last = np.array([len(finger.links) - 1 for finger in hand.fingers])

    @property
    def grip(self) -> tuple[Array, Array]:
        """Where fingers are believed to touch, in the object's frame `(B, F, 2)` [m], and how askew `(B, F)` [rad].

        That is the angle from the normal into the outline there to the line to the other finger.
        """
        points, inward = np.moveaxis(self._points, 0, 1), -np.moveaxis(self._normals, 0, 1)
        line = points[:, ::-1] - points
        askew = np.arctan2(cross(inward, line), (inward * line).sum(axis=-1))
        return inverse_transform(self.pose[:, None], points), askew

    @property
    def velocity(self) -> Array:
        """How objects are believed to have moved in the last few decisions `(B, 3)` [m/s, m/s, rad/s]."""
        moved = self._poses[-1] - self._poses[-1 - LATELY]
        return np.asarray(moved / np.maximum(self._times[-1] - self._times[-1 - LATELY], SOON)[:, None])

    def state(self, seen: Seen) -> State:
        """Return what is believed of the worlds: pose, joints and contacts; of forces nothing is known."""
        count, joints = len(self._joints), (self._joints, seen.joint_velocities, seen.targets)
        still, links = np.zeros((count, 3)), np.tile(self._last, (count, 1))
        return believed(seen.time, (self._pose, still), joints, links, np.moveaxis(self._points, 0, 1))

    def _axes(self, each: tuple[float, float, float]) -> Array:
        return np.array(each)

    def _meet(self) -> None:
        """Find where the last link of each finger is nearest to the object that is believed."""
        body = [transform(self._pose[:, None], piece) for piece in self._pieces]
        found = []
        for finger, place in zip(self._hand.fingers, self._hand.slices, strict=True):
            angles = self._joints[:, place]
            places = joint_positions(finger, angles)
            tip = link_polygon(self._hand, finger, (angles, places), len(finger.links) - 1)
            found.append(_nearest(tip, body))
        self._gaps, self._points, self._normals = (np.stack(part) for part in zip(*found, strict=True))

    def _carried(self, moved: Array) -> Array:
        """Return how the object moves by least squares over the contacts, each of which moves with its finger."""
        count = len(moved)
        rows, points = [], []
        for point, finger, place in zip(self._points, self._hand.fingers, self._hand.slices, strict=True):
            jacobian = point_jacobian(joint_positions(finger, self._joints[:, place])[:, :-1], point)
            arm = perpendicular(point - self._pose[:, :2])
            unit = np.broadcast_to(np.eye(2), (count, 2, 2))
            rows.append(np.concatenate([unit, arm[..., None]], axis=-1))
            points.append((jacobian * moved[:, None, place]).sum(axis=-1))
        matrix, motion = np.concatenate(rows, axis=1), np.concatenate(points, axis=1)
        across = matrix.transpose(0, 2, 1)
        found = np.linalg.solve(across @ matrix + np.diag(REGULAR), across @ motion[..., None])[..., 0]
        return np.clip(found, [-most for most in FASTEST], FASTEST)

    def _away(self) -> Array:
        turned = cross(self._points - self._pose[:, :2], self._normals)
        return np.moveaxis(-np.concatenate([self._normals, turned[..., None]], axis=-1), 0, 1)

    def _moved(self, pose: Array, change: Array) -> Array:
        return pose + change

    def _off(self, pose: Array, other: Array) -> Array:
        off = pose - other
        off[:, 2] = wrap_angle(off[:, 2])
        return off

    def _between(self, one: Array, other: Array, share: Array) -> Array:
        return np.asarray(one * (1 - share) + other * share)


def _nearest(tip: Array, body: list[Array]) -> tuple[Array, Array, Array]:
    """Return `contact` of outlines `(B, K, 2)` [m] with the piece of an object from which each is least separated."""
    found = [contact(tip, piece) for piece in body]
    nearest = np.argmin([gap for gap, _, _ in found], axis=0), np.arange(len(tip))
    gap, point, normal = (np.stack(part)[nearest] for part in zip(*found, strict=True))
    return gap, point, normal
