"""The primary metrics of a trial: how far, how straight, how upright, and whether the object was held."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inhand import geometry
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.errors import InputError
from inhand.geometry import Array, distance_to, frechet, interpolate, longest_run

TARGET_POINTS = 100
"""Points on the straight segment of the Frechet distance, as in the Asterisk Test."""
PATH_PIECES = 300
"""About the most points added to a path before its Frechet distance is taken."""


@dataclass(frozen=True)
class Metrics:
    """Metrics of one trial in mm and degrees (docs/metrics.md, Metrics).

    A trial that only rotates has no direction: its distances are 0, its lateral values and its Frechet distance
    describe how far the object drifted from its start, and its rotation is what it turned.
    """

    distance_mm: float
    """From the start to the end along the direction; negative where the object went the other way."""
    max_distance_mm: float
    """Farthest progress along the direction."""
    lateral_max_mm: float
    """Largest distance from the line along the direction; rotation only: from the start."""
    lateral_rms_mm: float
    """Root mean square of the same."""
    rotation_max_deg: float
    """Largest difference from the target rotation; rotation only: largest angle turned. NaN where unknown."""
    rotation_final_deg: float
    """The same at the end."""
    arc_length_mm: float
    """Length of the path."""
    efficiency: float
    """Distance / arc length, at most 1; rotation only: final angle / sum of all turning. 0 where nothing moved."""
    frechet_mm: float
    """Discrete Frechet distance between the path and the straight segment of the same distance."""
    contact_fraction: float | None
    """Share of all rows in which all fingers touch; None for people."""
    longest_gap_s: float | None
    """Longest time without all fingers touching [s]; None for people."""
    path_max_mm: float | None = None
    """Largest distance from the reference path, which need not be straight; None without one."""
    path_rms_mm: float | None = None
    """Root mean square of the same."""


def measure(
    path_mm: Array,
    rotation_deg: Array | None,
    angle_deg: float | None,
    *,
    target_rotation_deg: float = 0.0,
    contact: NDArray[np.bool_] | None = None,
    row_s: float = 1.0,
    reference_mm: Array | None = None,
) -> Metrics:
    """Return the primary metrics of one trial.

    A single row or a trial without movement is ordinary. Where contact is given, everything but the contact
    itself counts only the rows before the first one in which not all fingers touch: a thrown object is not a
    manipulated one. If that is the first row, only the start pose counts.

    Args:
        path_mm: Positions `(T, 2)` [mm], the filtered ones of a recording.
        rotation_deg: Rotation `(T,)`, unwrapped [deg], or None where it is unknown (its metrics become NaN).
        angle_deg: Direction counter-clockwise from +x [deg], or None for a trial that only rotates.
        target_rotation_deg: Rotation to hold [deg]; plays no part in a trial that only rotates.
        contact: Whether each finger touches `(T, F)`, or None for people.
        row_s: Time between two rows [s].
        reference_mm: Way-points of the reference path `(S, 2)` from the start [mm], or None without one.

    Raises:
        InputError: arrays of the wrong shape or of different lengths, no row, or a value that is not finite.
    """
    path = np.asarray(path_mm, dtype=float)
    turn = np.full(len(path), np.nan) if rotation_deg is None else np.asarray(rotation_deg, dtype=float)
    check_rows(path, np.zeros(len(path)) if rotation_deg is None else turn)
    _check_rest(len(path), contact, angle_deg, target_rotation_deg)
    if contact is None:
        return _measure_rows(path, turn, angle_deg, target_rotation_deg, reference_mm)
    rows = counted_rows(contact)
    metrics = _measure_rows(path[:rows], turn[:rows], angle_deg, target_rotation_deg, reference_mm)
    return with_contact(metrics, contact, row_s)


def with_contact(metrics: Metrics, contact: NDArray[np.bool_], row_s: float) -> Metrics:
    """Return metrics with those of the contact of every finger `(T, F)` in all rows, `row_s` apart [s]."""
    held = np.all(contact, axis=1)
    return replace(metrics, contact_fraction=float(held.mean()), longest_gap_s=longest_run(~held) * row_s)


def counted_rows(contact: NDArray[np.bool_]) -> int:
    """Return how many rows come before the first one in which not all fingers touch `(T, F)`, at least one."""
    held = np.asarray(np.all(contact, axis=-1))
    return len(held) if held.all() else max(int(np.argmin(held)), 1)


def progress(path_mm: Array, angle_deg: float) -> Array:
    """Return how far each row of a path is from its start, along a direction and to its left `(T, 2)` [mm]."""
    return geometry.rotate(-math.radians(angle_deg), path_mm - path_mm[0])


def measure_human(trial: HumanTrial) -> Metrics:
    """Return the primary metrics of a recorded trial, from its smoothed rows without the rest before and after."""
    rows = slice(*trial.moving)
    rotation = trial.filtered_rotation_deg[rows] if trial.rotation_usable else None
    return measure(trial.filtered_mm[rows], rotation, trial.angle_deg, target_rotation_deg=trial.twist_deg)


def _measure_rows(
    path: Array, turn: Array, angle_deg: float | None, target_deg: float, reference: Array | None
) -> Metrics:
    """Return the metrics of rows `(T, 2)` and `(T,)` that all count, those of contact left None."""
    path = path - path[0]
    if angle_deg is None:
        along, lateral = np.zeros(len(path)), np.linalg.norm(path, axis=1)
        return of_rows(Rows(path, along, lateral, np.abs(turn - turn[0]), turn), None, reference)
    along, across = progress(path, angle_deg).T
    ahead = geometry.unit(math.radians(angle_deg))
    return of_rows(Rows(path, along, np.abs(across), np.abs(turn - target_deg), turn), ahead, reference)


@dataclass(frozen=True, eq=False)
class Rows:
    """What is measured of T rows that all count, in the plane or in space."""

    path: Array
    """Positions from the start `(T, 2)` or `(T, 3)` [mm]."""
    along: Array
    """Progress along the direction `(T,)` [mm], 0 where it only turns."""
    lateral: Array
    """Distance from the line along the direction, or from the start where it only turns `(T,)` [mm]."""
    error: Array
    """Difference from the target rotation, or the angle turned where it only turns `(T,)` [deg]."""
    turn: Array
    """Rotation, unwrapped `(T,)` [deg]."""


def of_rows(rows: Rows, ahead: Array | None, reference: Array | None) -> Metrics:
    """Return the metrics of rows, those of contact left None.

    Args:
        rows: what is measured of them.
        ahead: unit vector of the direction `(2,)` or `(3,)`, None where it only turns.
        reference: way-points of the reference path `(S, 2)` or `(S, 3)` from the start [mm], or None without one.
    """
    path, along, lateral, error = rows.path, rows.along, rows.lateral, rows.error
    arc = geometry.length(path)
    whole = float(np.abs(np.diff(rows.turn)).sum()) if ahead is None else arc
    off = None if reference is None else distance_to(path[:, None], reference[:-1], reference[1:]).min(axis=1)
    return Metrics(
        distance_mm=float(along[-1]),
        max_distance_mm=float(along.max()),
        lateral_max_mm=float(lateral.max()),
        lateral_rms_mm=float(np.sqrt(np.mean(lateral**2))),
        rotation_max_deg=float(error.max()),
        rotation_final_deg=float(error[-1]),
        arc_length_mm=arc,
        efficiency=_share(float(error[-1] if ahead is None else along[-1]), whole),
        frechet_mm=_frechet(path, float(along[-1]), ahead),
        contact_fraction=None,
        longest_gap_s=None,
        path_max_mm=None if off is None else float(off.max()),
        path_rms_mm=None if off is None else float(np.sqrt(np.mean(off**2))),
    )


def _frechet(path: Array, distance: float, ahead: Array | None) -> float:
    """Return the discrete Frechet distance of a path `(T, d)` to the segment from 0 over `distance`.

    Only the corners of a path are compared, so one with few rows would seem far from the line it lies on: points
    are put between its rows until they lie as close as the segment's. A negative distance has no segment, and
    the start stands for it.
    """
    length = max(distance, 0.0)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    spacing = max(length / (TARGET_POINTS - 1), float(steps.sum()) / PATH_PIECES)
    if spacing > 0.0:
        # The tolerance keeps a step of a whole number of spacings from being cut once more by rounding.
        pieces = np.maximum(np.ceil(steps / spacing - 1e-9), 1).astype(int)
        knots = np.concatenate([[0], np.cumsum(pieces)])
        path = interpolate(np.arange(knots[-1] + 1), knots, path)
    # A rotation has no segment but a point, from which the largest distance is the Frechet distance.
    if ahead is None or not length > 0.0:
        return frechet(path, np.zeros((1, path.shape[1])))
    return frechet(path, np.linspace(0.0, length, TARGET_POINTS)[:, None] * ahead)


def _share(part: float, whole: float) -> float:
    """Return part / whole, at most 1 (rounding can pass it), and 0 where the whole is 0."""
    return min(part / whole, 1.0) if whole != 0.0 else 0.0


def _check_rest(rows: int, contact: NDArray[np.bool_] | None, angle_deg: float | None, target_deg: float) -> None:
    if contact is not None and (np.ndim(contact) != 2 or len(contact) != rows):
        raise InputError(
            f"contact has shape {np.shape(contact)} for {rows} rows: give (T, F), every finger of each row"
        )
    if not math.isfinite(angle_deg or 0.0) or not math.isfinite(target_deg):
        raise InputError(f"direction {angle_deg} and target rotation {target_deg} must be finite angles [deg]")


def check_rows(path: Array, turn: Array) -> None:
    """Refuse positions that are not `(T, 2)`, a rotation that is not `(T,)`, and a value that is not finite.

    Raises:
        InputError: wrong shapes, or a value that is not finite (the text gives its row).
    """
    if path.ndim != 2 or path.shape[1] != 2 or not len(path) or turn.shape != path.shape[:1]:
        raise InputError(
            f"path has shape {path.shape} and rotation {turn.shape}: give a path (T, 2) and a rotation (T,) of the"
            " same T, at least one row"
        )
    bad = np.flatnonzero(~np.isfinite(np.column_stack([path, turn])).all(axis=1))
    if len(bad):
        row = int(bad[0])
        raise InputError(
            f"row {row} is not finite (x {path[row, 0]}, y {path[row, 1]}, rotation {turn[row]}): leave such rows"
            " out, or give None as rotation where it is unknown"
        )
