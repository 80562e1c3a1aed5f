"""From trials, results and limits in space to what figures and pages draw: mean paths, turns."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from inhand.asterisk_test.results import Result, by_direction
from inhand.control.spatial_trial import SpatialTrial
from inhand.geometry import Array, interpolate
from inhand.plots.spatial_asterisk import SpatialCurve, Turned
from inhand.tasks.spatial.reach import SpatialLimit

POINTS = 60
"""Points of a mean path."""
Drawn: TypeAlias = tuple[list[SpatialCurve], list[Turned]]
"""Directions, and turns."""


def drawn(trials: Sequence[SpatialTrial], results: Sequence[Result]) -> Drawn:
    """Return the mean path of every direction, and the mean angle of every turn."""
    named = {(trial.passport.primitive, trial.passport.trial): trial for trial in trials}
    curves, turns = list[SpatialCurve](), list[Turned]()
    for name, group in by_direction(results).items():
        reached, failed = float(np.mean([result.reached for result in group])), any(result.lost for result in group)
        along, limit = group[0].along, group[0].limit
        if along is None:
            turns.append(Turned(name, reached, limit, failed))
            continue
        mean = np.mean([mean_points(named[name, result.trial]) for result in group], axis=0)
        curves.append(SpatialCurve(name, np.array(along), mean, reached, limit, failed))
    return curves, turns


def mean_points(trial: SpatialTrial) -> Array:
    """Return evenly spread points `(POINTS, 3)` [mm] of a trial's path, as far as its distance counts."""
    path, _, touching = trial.manipulated()
    lost = np.flatnonzero(~touching.all(axis=-1))
    rows = path[: max(int(lost[0]), 1)] if len(lost) else path
    return interpolate(np.linspace(0.0, len(rows) - 1.0, POINTS), np.arange(len(rows), dtype=float), rows)


def limits_drawn(limits: Sequence[SpatialLimit]) -> Drawn:
    """Return straight lines to limits, and the angles of turns."""
    curves, turns = list[SpatialCurve](), list[Turned]()
    for limit in limits:
        primitive, far = limit.primitive, limit.distance
        if primitive.direction is None:
            turns.append(Turned(primitive.name, float(np.rad2deg(far))))
        else:
            direction = np.array(primitive.direction)
            line = 1e3 * far * np.linspace(0.0, 1.0, 2)[:, None] * direction
            curves.append(SpatialCurve(primitive.name, direction, line, 1e3 * far))
    return curves, turns
