"""How a trial ended whose controller had done what it could: at the end of its path, of its grip, or where it began."""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from inhand.asterisk_test.spatial.metrics import twist_and_swing
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import GRIP_END, NO_MOVEMENT, REACHED, Trial
from inhand.geometry import planar, wrap_angle
from inhand.rotations import quaternion_of, rotation_between

T = TypeVar("T", Trial, SpatialTrial)

ARRIVED = 0.003, float(np.deg2rad(5.0))
"""An object this near to the end of its path [m, rad] has come to it: guessed, thrice the tracking error."""
STILL_SHARE = 0.1
"""Share of the finger length under which an object has not moved. The Asterisk Test has a tenth of the hand's span or
depth (label `no movement`), which not every hand has."""
STILL_DEG = 10.0
"""Angle under which an object has not been turned [deg] (the Asterisk Test software)."""
STILL_OF_LIMIT = 0.5
"""A hand that can go no farther than twice the lengths above has moved its object from this share of its limit on."""


def ended(trial: T) -> T:
    """Return a trial whose outcome tells apart what the loop calls reached: that the controller had finished.

    The end of the path stays `reached`. Short of it a controller stops where the grip is predicted to end (`end of
    grip`), unless the object has hardly moved although the hand could have moved it (`no movement`).
    """
    if trial.outcome != REACHED:
        return trial
    left, moved = _gone_in_space(trial) if isinstance(trial, SpatialTrial) else _gone(trial)
    if left[0] <= ARRIVED[0] and left[1] <= ARRIVED[1]:
        return trial
    passport = trial.passport
    return replace(trial, outcome=_short(moved, passport.hand.finger_length, passport.limit, turns=passport.turns))


def _gone(trial: Trial) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return how far an object is from the end of its path, and how far it was moved [m] and turned [rad]."""
    path, rotation, _ = trial.manipulated_path()
    pose = planar(trial.object_pose[trial.manipulation])
    gone = pose[-1] - pose[0]
    x, y, theta = trial.reference[-1] - (gone[0], gone[1], np.unwrap(pose[:, 2])[-1] - pose[0, 2])
    moved = float(np.linalg.norm(path, axis=-1).max()) / 1e3, float(abs(np.deg2rad(rotation[-1])))
    return (float(np.hypot(x, y)), float(abs(wrap_angle(theta)))), moved


def _gone_in_space(trial: SpatialTrial) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the same of an object in space."""
    path, rotation, _ = trial.manipulated()
    about, end = trial.passport.about, trial.reference[-1]
    left = float(np.linalg.norm(path[-1] / 1e3 - end[:3]))
    aside = float(np.linalg.norm(rotation_between(rotation[-1], quaternion_of(end[3:]))))
    turned = 0.0 if about is None else float(twist_and_swing(rotation, np.array(about))[0][-1])
    return (left, aside), (float(np.linalg.norm(path, axis=-1).max()) / 1e3, turned)


def _short(moved: tuple[float, float], finger_length: float, limit: float | None, *, turns: bool) -> str:
    """Return the outcome of a trial that ended short of its path, moved [m] and turned [rad] so far."""
    least = np.deg2rad(STILL_DEG) if turns else STILL_SHARE * finger_length
    if limit is not None:
        least = min(least, STILL_OF_LIMIT * limit)
    return NO_MOVEMENT if moved[turns] < least else GRIP_END
