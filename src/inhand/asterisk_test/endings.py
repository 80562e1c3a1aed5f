"""How a trial ended whose controller had done what it could: at the end of its path, of its grip, or where it began."""

from dataclasses import replace

import numpy as np

from inhand.asterisk_test.spatial.metrics import twist_and_swing
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import GRIP_END, NO_MOVEMENT, REACHED, Trial
from inhand.geometry import planar, wrap_angle
from inhand.rotations import quaternion_of, rotation_between

ARRIVED = 0.003, float(np.deg2rad(5.0))
"""An object this near to the end of its path [m, rad] has come to it: guessed, thrice the tracking error."""
STILL_SHARE = 0.1
"""Share of the finger length under which an object has not moved. The Asterisk Test has a tenth of the hand's span or
depth (label `no movement`), which not every hand has."""
STILL_DEG = 10.0
"""Angle under which an object has not been turned [deg] (the Asterisk Test software)."""
STILL_OF_LIMIT = 0.5
"""A hand that can go no farther than twice the lengths above has moved its object from this share of its limit on."""


def ended(trial: Trial) -> Trial:
    """Return a trial whose outcome tells apart what the loop calls reached: that the controller had finished.

    The end of the path stays `reached`. Short of it a controller stops where the grip is predicted to end (`end of
    grip`), unless the object has hardly moved although the hand could have moved it (`no movement`).
    """
    path, rotation, _ = trial.manipulated_path()
    passport = trial.passport
    if trial.outcome != REACHED:
        return trial
    pose = planar(trial.object_pose[trial.manipulation])
    gone = pose[-1] - pose[0]
    x, y, theta = trial.reference[-1] - (gone[0], gone[1], np.unwrap(pose[:, 2])[-1] - pose[0, 2])
    if np.hypot(x, y) <= ARRIVED[0] and abs(wrap_angle(theta)) <= ARRIVED[1]:
        return trial
    moved = float(np.linalg.norm(path, axis=-1).max()) / 1e3, abs(np.deg2rad(rotation[-1]))
    turns = passport.angle_deg is None
    return replace(trial, outcome=_short(moved, passport.hand.finger_length, passport.limit, turns=turns))


def ended_in_space(trial: SpatialTrial) -> SpatialTrial:
    """Return a trial in space with its outcome told apart in the same way."""
    if trial.outcome != REACHED:
        return trial
    path, rotation, _ = trial.manipulated()
    passport, end = trial.passport, trial.reference[-1]
    left = np.linalg.norm(path[-1] / 1e3 - end[:3])
    aside = np.linalg.norm(rotation_between(rotation[-1], quaternion_of(end[3:])))
    if left <= ARRIVED[0] and aside <= ARRIVED[1]:
        return trial
    turned = 0.0 if passport.about is None else twist_and_swing(rotation, np.array(passport.about))[0][-1]
    moved = float(np.linalg.norm(path, axis=-1).max()) / 1e3, float(turned)
    return replace(trial, outcome=_short(moved, passport.hand.finger_length, passport.limit, turns=passport.turns))


def _short(moved: tuple[float, float], finger_length: float, limit: float | None, *, turns: bool) -> str:
    """Return the outcome of a trial that ended short of its path, moved [m] and turned [rad] so far."""
    least = np.deg2rad(STILL_DEG) if turns else STILL_SHARE * finger_length
    if limit is not None:
        least = min(least, STILL_OF_LIMIT * limit)
    return NO_MOVEMENT if moved[turns] < least else GRIP_END
