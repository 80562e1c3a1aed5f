"""Trials that nobody simulated: what a test does not say of them is plain."""

from typing import Any

import numpy as np

from inhand.control.trial import REACHED, Passport, Trial
from inhand.geometry import Array, spatial
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE


def passport(**told: Any) -> Passport:
    """Return the passport of the expert's first trial of the standard pair straight out, and what is told of it."""
    known: dict[str, Any] = {
        "hand": parse_hand_name("2v2_50.50_50.50_1.1_53"),
        "object": CATALOGUE["cube_39"],
        "controller": "ik",
        "primitive": "Out",
        "angle_deg": 90.0,
        "rotation_deg": 0.0,
        "path": "Out",
        "trial": 1,
        "seed": 0,
        "substeps": 5,
        "timestep": 0.004,
        "versions": {"inhand": "0"},
    }
    return Passport(**known | told)


def trial_at(pose: Array, signed: Passport, **told: Any) -> Trial:
    """Return a trial whose object was at poses `(T, 3)` [m, m, rad], and what is told of it; the rest is zero."""
    rows, joints, fingers = len(pose), signed.hand.n_joints, len(signed.hand.fingers)
    known: dict[str, Any] = {
        "outcome": REACHED,
        "time": signed.period * np.arange(rows, dtype=float),
        "object_pose": spatial(pose, 0.05),
        "joint_angles": np.zeros((rows, joints)),
        "targets": np.zeros((rows, joints)),
        "gaps": np.zeros((rows, fingers)),
        "contact_links": np.ones((rows, fingers), dtype=np.int64),
        "penetration": np.zeros(rows),
    }
    known |= {name: np.zeros((rows, fingers, 3)) for name in ("finger_points", "object_points", "forces")}
    return Trial(passport=signed, **known | told)
