"""Where an object is, from what a hand can know: encoders, commands, and late and noisy frames of a camera.

An extended Kalman filter (Kalman 1960; Welch and Bishop 2006) over the object's pose and one number more, how much
larger the object is than its drawing. Between frames the object moves as fingers that roll without slip carry it, and
all stay where fingers touch. A frame is set against the estimate of when it was taken, and what it changes there is
carried on to now: so nothing is late, and the noise of a frame counts as little as slip is rare. What is of the plane
is here, what is of space in `spatial_estimator.py`.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
EVERY = np.ones(1, dtype=bool)
"""Every world of a batch."""
LATELY = 4
"""Decisions over which a velocity is believed: 80 ms, in which noise of a frame is some millimetres a second."""
WAIT = 0.24
"""Time in the grip before the object is moved [s]: seven frames at 30 Hz."""
SOON = 1e-9
"""Times that are less apart are one [s]."""


@dataclass(frozen=True)
class EstimatorConfig:
    """How much is believed of what is sensed; standard deviations. Found in worlds of `field`, but for the camera's.

    In space the numbers of x and y are those of z too, and that of the rotation is about each axis.
    """

    joints: float = 0.6
    """Share of the difference between an encoder's reading and what the commands let expect that is believed."""
    slip: tuple[float, float, float] = (2.5e-5, 2.5e-5, 5e-4)
    """How far the object moves in a decision other than fingers carry it [m, m, rad]."""
    frame: tuple[float, float, float] = (0.001, 0.001, float(np.deg2rad(1.0)))
    """Noise of a frame [m, m, rad]: that of a fiducial."""
    touch: float = 0.001
    """How far a finger seems to stand off the object that it presses on [m]."""
    larger: float = 0.001
    """How much farther out the outline is than drawn [m],"""
    larger_drift: float = 5e-6
    """and how much that changes in a decision, as contacts go round the outline [m]."""
    pressed: float = 1.8e-4
    """Overlap of a finger and the object in a grip [m]."""
    memory: int = 32
    """Decisions that are remembered, for frames that come late."""


def waited(began: Array, seen: Seen) -> NDArray[np.bool_]:
    """Return which hands have waited in their grips since a time [s] for their first frames `(B,)`."""
    return np.asarray(seen.time - began >= WAIT - SOON)


class PoseFilter(ABC):
    """Estimates of B worlds, each with the object of its task in the hand; a pose changes by k numbers."""

    def __init__(self, config: EstimatorConfig | None = None) -> None:
        """Estimate nothing yet."""
        self.config = config or EstimatorConfig()
        self._drift = np.diag([*np.square(self._axes(self.config.slip)), self.config.larger_drift**2])
        self._joints, self._commands, self._pose, self._larger, self._spread, self._frame = (np.zeros(0),) * 6
        self._gaps = np.zeros(0)

    def begin(self, seen: Seen, worlds: NDArray[np.int64] | None = None) -> None:
        """Start from the last frame, with fingers that touch the object; in some worlds `(K,)` while others go on."""
        config, count = self.config, seen.n_worlds
        spread = np.diag([*np.square(self._axes(config.frame)), config.larger**2])
        new: tuple[Array, ...] = (
            seen.joint_angles, seen.targets, seen.frame_pose.copy(), np.zeros(count),
            np.repeat(spread[None], count, axis=0), seen.frame_time,
        )  # fmt: skip
        fresh = np.ones(count, dtype=bool)
        if worlds is None:
            self._times = np.zeros((config.memory, count))
            self._poses = np.zeros((config.memory, *seen.frame_pose.shape))
        else:
            fresh = np.isin(np.arange(count), worlds)
            old = (self._joints, self._commands, self._pose, self._larger, self._spread, self._frame)
            new = tuple(np.where(fresh[(...,) + (None,) * (a.ndim - 1)], a, b) for a, b in zip(new, old, strict=True))
        self._joints, self._commands, self._pose, self._larger, self._spread, self._frame = new
        self._meet()
        self._touch(fresh)
        self._times[:, fresh], self._poses[:, fresh] = seen.time[fresh], self._pose[fresh]

    def knows(self, seen: Seen) -> bool:
        """Return whether what is seen has been taken in: a controller begins with what it is then asked to act on."""
        return bool((seen.time == self._times[-1]).all())

    def take(self, seen: Seen) -> None:
        """Go on by a decision, unless what is seen is known."""
        if self.knows(seen):
            return
        expected = self._joints + seen.targets - self._commands
        joints = expected + self.config.joints * (seen.joint_angles - expected)
        self._pose = self.moved(self._pose, self._carried(joints - self._joints))
        self._joints, self._commands = joints, seen.targets
        self._spread = self._spread + self._drift
        self._meet()
        self._touch()
        self._times = np.concatenate([self._times[1:], seen.time[None]])
        self._poses = np.concatenate([self._poses[1:], self._pose[None]])
        self._look(seen)
        self._meet()

    @property
    def pose(self) -> Array:
        """Where objects are believed `(B, 3)` [m, m, rad], in space `(B, 7)`."""
        return self._pose.copy()

    @property
    @abstractmethod
    def grip(self) -> tuple[Array, Array]:
        """Where fingers are believed to touch, in the object's frame, and how its normals stand there."""

    @property
    @abstractmethod
    def velocity(self) -> Array:
        """How objects are believed to have moved in the last few decisions `(B, k)` in a second."""

    @abstractmethod
    def state(self, seen: Seen) -> State:
        """Return what is believed of the worlds: pose, joints and contacts; of forces nothing is known."""

    @abstractmethod
    def _axes(self, each: tuple[float, float, float]) -> Array:
        """Return what is given of x, y and a rotation for each number by which a pose changes `(k,)`."""

    @abstractmethod
    def _meet(self) -> None:
        """Find where fingers are nearest to the objects that are believed: `_gaps` `(F, B)` [m] among it."""

    @abstractmethod
    def _carried(self, moved: Array) -> Array:
        """Return how the object moves `(B, k)` [m, rad] where joints do `(B, n)` [rad]."""

    @abstractmethod
    def _away(self) -> Array:
        """Return how far each finger's gap grows with each number by which a pose changes `(B, F, k)`."""

    @abstractmethod
    def moved(self, pose: Array, change: Array) -> Array:
        """Return poses `(..., B, p)` changed by `(B, k)`."""

    @abstractmethod
    def off(self, pose: Array, other: Array) -> Array:
        """Return by what poses `(B, p)` are changed from others `(B, k)`."""

    @abstractmethod
    def _between(self, one: Array, other: Array, share: Array) -> Array:
        """Return poses `(B, p)` at shares `(B, 1)` of the way from one to another."""

    def _touch(self, worlds: NDArray[np.bool_] = EVERY) -> None:
        """Correct by that fingers touch: in a grip outlines overlap by a little, but for how much larger it is."""
        away = self._away()
        rows = np.concatenate([away, -np.ones((*away.shape[:2], 1))], axis=-1)
        missed = (-self.config.pressed - self._gaps + self._larger).T
        self._correct(rows, missed, np.full(away.shape[1], self.config.touch), worlds)

    def _look(self, seen: Seen) -> None:
        """Correct by a frame that has come in, at the time at which it was taken."""
        fresh = np.asarray(seen.frame_time > self._frame)
        if not fresh.any():
            return
        missed, noise = self.off(seen.frame_pose, self._before(seen.frame_time)), self._axes(self.config.frame)
        rows = np.broadcast_to(np.eye(len(noise), len(noise) + 1), (len(missed), len(noise), len(noise) + 1))
        self._poses = self.moved(self._poses, self._correct(rows, missed, noise, fresh))
        self._frame = np.where(fresh, seen.frame_time, self._frame)

    def _correct(self, rows: Array, missed: Array, noise: Array, worlds: NDArray[np.bool_]) -> Array:
        """Return by what poses were corrected `(B, k)`: measurements with rows `(B, m, k + 1)` missed `(B, m)`."""
        across = self._spread @ rows.transpose(0, 2, 1)
        gain = across @ np.linalg.inv(rows @ across + np.diag(noise**2))
        change = np.where(worlds[:, None], (gain @ missed[..., None])[..., 0], 0.0)
        spread = self._spread - np.where(worlds[:, None, None], gain @ rows @ self._spread, 0.0)
        self._pose, self._larger = self.moved(self._pose, change[:, :-1]), self._larger + change[:, -1]
        self._spread = (spread + spread.transpose(0, 2, 1)) / 2
        return np.asarray(change[:, :-1])

    def _before(self, when: Array) -> Array:
        """Return the poses `(B, p)` that are believed of a time in the past `(B,)` [s], on the line between two."""
        times, poses = self._times, self._poses
        worlds = np.arange(len(when))
        first = np.clip((times <= when).sum(axis=0) - 1, 0, len(times) - 1)
        second = np.minimum(first + 1, len(times) - 1)
        between = np.maximum(times[second, worlds] - times[first, worlds], 1e-9)
        share = np.clip((when - times[first, worlds]) / between, 0.0, 1.0)[:, None]
        return self._between(poses[first, worlds], poses[second, worlds], share)


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

    def moved(self, pose: Array, change: Array) -> Array:
        """Return the sum."""
        return pose + change

    def off(self, pose: Array, other: Array) -> Array:
        """Return the difference."""
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
