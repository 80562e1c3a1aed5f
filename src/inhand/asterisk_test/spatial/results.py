"""Results of trials in space: the same record as in the plane."""

import math

import numpy as np

from inhand.asterisk_test.results import Result
from inhand.asterisk_test.spatial.metrics import measure_in_space
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import DIVERGED


def result_of_spatial(trial: SpatialTrial) -> Result:
    """Return the result of a trial in space."""
    passport = trial.passport
    path, rotation, touching = trial.manipulated()
    reference = 1e3 * trial.reference[:, :3]
    goal = passport.along, passport.about
    metrics = measure_in_space(path, rotation, goal, contact=touching, row_s=passport.period, reference_mm=reference)
    lost = np.flatnonzero(~touching.all(axis=-1) & (trial.outcome != DIVERGED))
    first = " and ".join(np.array(passport.hand.finger_names)[~touching[lost[0]]]) if len(lost) else None
    return Result(
        passport.primitive,
        None,
        passport.trial,
        trial.outcome,
        metrics,
        0.0 if passport.along is None else float((path @ np.array(passport.along)).max()),
        first,
        None,
        None,
        passport.controller,
        _limit(passport.limit, turns=passport.turns),
        trial.force_max_n,
        trial.penetration_max_mm,
        trial.torque_max_nmm,
        trial.penetration_mean_mm,
        trial.penetration_share,
        along=passport.along,
    )


def _limit(limit: float | None, *, turns: bool) -> float | None:
    if limit is None:
        return None
    return math.degrees(limit) if turns else 1e3 * limit
