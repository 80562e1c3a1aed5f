"""Labels of a trial: what went wrong with it, and whether averages may use it."""

from __future__ import annotations

import math
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np

from inhand import geometry
from inhand.asterisk_test.metrics import check_rows
from inhand.geometry import Array

NO_MOVEMENT = "no movement"
NOT_CENTRED = "not centred"
DEVIATED = "deviated"
END_DEVIATED = "end deviated"
ROTATION_DEVIATED = "rotation deviated"
BACKTRACKING = "backtracking"

LEFT_OUT = frozenset({DEVIATED, END_DEVIATED, ROTATION_DEVIATED})
"""Labels that keep a trial out of averages."""


@dataclass(frozen=True)
class LabelRules:
    """Limits of the labels in normalised units; the defaults are the Asterisk Test's (docs/metrics.md)."""

    movement: float = 0.1
    """Least progress of a trial that moved."""
    turn_deg: float = 10.0
    """Least rotation of a rotation-only trial that moved [deg] (the Asterisk Test software)."""
    centre: float = 0.05
    """Distance from the origin within which one of the first rows must lie."""
    first_rows: int = 10
    """How many rows count as the first."""
    lateral: float = 0.2
    """Lateral distance beyond which a row deviates."""
    rotation_deg: float = 75.0
    """Rotation beyond which a row deviates [deg]."""
    share: float = 0.1
    """Share of rows that may deviate, and the share at the end in which none may."""
    backtrack: float = 0.1
    """How far progress may fall below its running maximum."""


def labels_of(
    path_normalised: Array, rotation_deg: Array | None, angle_deg: float | None, config: LabelRules | None = None
) -> frozenset[str]:
    """Return the labels of a trial.

    Args:
        path_normalised: Positions `(T, 2)` from the trial's origin, not from its first row (for a recording
            `normalise(start_mm + path_mm, hand)`), or `not centred` can never be found.
        rotation_deg: Rotation `(T,)` [deg], or None where it is unknown.
        angle_deg: Direction counter-clockwise from +x [deg], or None for a trial that only rotates, which gets
            only `no movement` and `not centred`.
        config: The limits, by default `LabelRules()`.

    Raises:
        InputError: wrong shapes, no row, or a value that is not finite.
    """
    rules = config or LabelRules()
    path = np.asarray(path_normalised, dtype=float)
    turn = np.zeros(len(path)) if rotation_deg is None else np.asarray(rotation_deg, dtype=float)
    check_rows(path, turn)
    centred = bool(np.any(np.linalg.norm(path[: rules.first_rows], axis=1) <= rules.centre))
    if angle_deg is None:
        found = {NO_MOVEMENT: np.abs(turn).max() < rules.turn_deg, NOT_CENTRED: not centred}
    else:
        along, across = geometry.rotate(-math.radians(angle_deg), path).T
        off = np.abs(across) > rules.lateral
        last = math.ceil(rules.share * len(path))
        found = {
            NO_MOVEMENT: along.max() < rules.movement,
            NOT_CENTRED: not centred,
            DEVIATED: off.mean() > rules.share,
            END_DEVIATED: off[len(off) - last :].any(),
            ROTATION_DEVIATED: np.mean(np.abs(turn) > rules.rotation_deg) > rules.share,
            BACKTRACKING: np.any(np.maximum.accumulate(along) - along > rules.backtrack),
        }
    return frozenset(label for label, holds in found.items() if holds)


def is_averaged(labels: AbstractSet[str]) -> bool:
    """Return whether averages use a trial with these labels: they leave out the deviated kinds."""
    return LEFT_OUT.isdisjoint(labels)
