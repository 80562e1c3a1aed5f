"""What a hand outside the simulator tells, and what a controller then sees of it: one `Seen` after another.

A hand tells joint angles and camera frames, each with the time at which it was taken, by one clock. They come late, in
any order, twice or never: what is older than what is known already is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inhand.control.seen import Seen
from inhand.errors import InputError
from inhand.geometry import Array

AHEAD = 0.02
"""A frame that was taken later than the joints were read, by more than this, has another clock [s]: guessed, a decision
of 20 ms between two looks at one clock."""


@dataclass(frozen=True)
class Frame:
    """One look of a camera."""

    time: float
    """When it was taken, by the hand's clock [s]."""
    pose: Sequence[float] | Array
    """The object's pose in the palm frame: x, y, theta [m, m, rad]."""


@dataclass(frozen=True)
class Reading:
    """What a hand tells when it is asked."""

    time: float
    """When the encoders were read, by the hand's clock [s]."""
    joints: Sequence[float] | Array
    """Joint angles in the hand's order (docs/frames.md) [rad]."""
    frames: Sequence[Frame] = ()
    """Frames that have come in, in any order; those that are known already may be told again."""


class Looks:
    """The newest of all that a hand with n joints has told."""

    def __init__(self, n_joints: int) -> None:
        """Know nothing yet."""
        self._n_joints = n_joints
        self.time, self.frame_time = -np.inf, -np.inf
        """When joints were read last, and when the newest frame was taken, by the hand's clock [s]."""
        self.joints, self.velocities = np.zeros(n_joints), np.zeros(n_joints)
        """Joint angles `(n,)` [rad], and their differences over the time between two readings [rad/s]."""
        self.pose = np.zeros(3)
        """The object's pose in the newest frame `(3,)` [m, m, rad]."""

    @property
    def age(self) -> float:
        """How much older the newest frame is than the joint angles [s]."""
        return self.time - self.frame_time

    def take(self, reading: Reading | None) -> bool:
        """Take in a reading, None where the hand had none, and return whether its joint angles are new.

        Angles and frames that are not finite count as not told.

        Raises:
            InputError: another number of joints, a pose that is none, or frames from another clock.
        """
        if reading is None:
            return False
        joints = np.asarray(reading.joints, dtype=float)
        if joints.shape != (self._n_joints,):
            raise InputError(
                f"read gave joint angles of shape {joints.shape}; the hand has {self._n_joints} joints: give one number"
                " for each, finger by finger, from the palm outwards"
            )
        fresh = bool(reading.time > self.time and np.isfinite(reading.time) and np.isfinite(joints).all())
        if fresh:
            known = np.isfinite(self.time)
            self.velocities = (joints - self.joints) / (reading.time - self.time) if known else np.zeros(len(joints))
            self.time, self.joints = float(reading.time), joints
        for frame in reading.frames:
            self._look(frame)
        return fresh

    def seen(self, targets: Array) -> Seen:
        """Return what a controller sees of it, when targets `(n,)` [rad] were commanded last: one world."""
        rows = self.time, self.joints, self.velocities, targets, self.pose, self.frame_time
        return Seen(*(np.asarray(row, dtype=float)[None] for row in rows))

    def _look(self, frame: Frame) -> None:
        pose = np.asarray(frame.pose, dtype=float)
        if pose.shape != (3,):
            raise InputError(f"read gave a frame of shape {pose.shape}; a pose is x, y, theta in the palm frame")
        if frame.time > self.time + AHEAD:
            raise InputError(
                f"read gave a frame taken at {frame.time:g} s and joint angles read at {self.time:g} s, before it: give"
                " both by one clock, the hand's"
            )
        if frame.time > self.frame_time and np.isfinite(pose).all():
            self.frame_time, self.pose = float(frame.time), pose
