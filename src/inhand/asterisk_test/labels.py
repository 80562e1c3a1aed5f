"""Labels of a trial: what went wrong with it, and whether averages may use it."""

import math
from collections.abc import Set as AbstractSet

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


# The limits of the Asterisk Test, in normalised units (docs/metrics.md).
MOVEMENT, TURN_DEG = 0.1, 10.0
"""Least progress of a trial that moved, and least rotation [deg] of one that only rotates."""
CENTRE, FIRST_ROWS = 0.05, 10
"""Distance from the origin within which one of so many first rows must lie."""
LATERAL, ROTATION_DEG = 0.2, 75.0
"""Lateral distance, and rotation [deg], beyond which a row deviates."""
SHARE = 0.1
"""Share of rows that may deviate, and the share at the end in which none may."""
BACKTRACK = 0.1
"""How far progress may fall below its running maximum."""


def labels_of(path_normalised: Array, rotation_deg: Array | None, angle_deg: float | None) -> frozenset[str]:
    """Return the labels of a trial.

    Args:
        path_normalised: Positions `(T, 2)` from the trial's origin, not from its first row (for a recording
            `normalise(start_mm + path_mm, hand)`), or `not centred` can never be found.
        rotation_deg: Rotation `(T,)` [deg], or None where it is unknown.
        angle_deg: Direction counter-clockwise from +x [deg], or None for a trial that only rotates, which gets
            only `no movement` and `not centred`.

    Raises:
        InputError: wrong shapes, no row, or a value that is not finite.
    """
    path = np.asarray(path_normalised, dtype=float)
    turn = np.zeros(len(path)) if rotation_deg is None else np.asarray(rotation_deg, dtype=float)
    check_rows(path, turn)
    centred = bool(np.any(np.linalg.norm(path[:FIRST_ROWS], axis=1) <= CENTRE))
    if angle_deg is None:
        found = {NO_MOVEMENT: np.abs(turn).max() < TURN_DEG, NOT_CENTRED: not centred}
    else:
        along, across = geometry.rotate(-math.radians(angle_deg), path).T
        off = np.abs(across) > LATERAL
        last = math.ceil(SHARE * len(path))
        found = {
            NO_MOVEMENT: along.max() < MOVEMENT,
            NOT_CENTRED: not centred,
            DEVIATED: off.mean() > SHARE,
            END_DEVIATED: off[len(off) - last :].any(),
            ROTATION_DEVIATED: np.mean(np.abs(turn) > ROTATION_DEG) > SHARE,
            BACKTRACKING: np.any(np.maximum.accumulate(along) - along > BACKTRACK),
        }
    return frozenset(label for label, holds in found.items() if holds)


def is_averaged(labels: AbstractSet[str]) -> bool:
    """Return whether averages use a trial with these labels: they leave out the deviated kinds."""
    return LEFT_OUT.isdisjoint(labels)
