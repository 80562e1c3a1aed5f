"""The metrics of a trial in space: those of the plane, and how far a turn left its axis.

A turn about an axis is told apart from what else the object was turned: the rotation is a twist about the axis and then
a swing to the side. The twist is counted through every half turn, where a rotation vector would jump.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.asterisk_test.metrics import Metrics, Rows, counted_rows, of_rows, with_contact
from inhand.geometry import Array
from inhand.hands.spatial.hand import Vector


@dataclass(frozen=True)
class SpatialMetrics(Metrics):
    """Metrics of one trial in space in mm and degrees; of a turn also how far it left its axis."""

    swing_max_deg: float | None = None
    """Largest rotation away from the axis of a turn; None where the object is moved."""


def measure_in_space(
    path_mm: Array,
    rotation: Array,
    goal: tuple[Vector | None, Vector | None],
    *,
    contact: NDArray[np.bool_],
    row_s: float,
    reference_mm: Array | None = None,
) -> SpatialMetrics:
    """Return the metrics of one trial; all but the contact counts the rows before the first loss of one.

    Args:
        path_mm: positions `(T, 3)` [mm].
        rotation: rotations from the start as quaternions `(T, 4)`.
        goal: unit vectors of the direction, None where it only turns, and of the axis of a turn.
        contact: whether each finger touches `(T, F)`.
        row_s: time between two rows [s].
        reference_mm: way-points of the reference path `(S, 3)` from the start [mm].
    """
    rows = counted_rows(contact)
    path, turned = path_mm[:rows] - path_mm[0], rotation[:rows]
    ahead, axis = (None if each is None else np.array(each) for each in goal)
    swing = None
    if ahead is None:
        twist, off = twist_and_swing(turned, np.array([0.0, 0.0, 1.0]) if axis is None else axis)
        found = Rows(path, np.zeros(rows), np.linalg.norm(path, axis=-1), np.rad2deg(twist), np.rad2deg(twist))
        swing = float(np.rad2deg(off.max()))
    else:
        along = path @ ahead
        lateral = np.linalg.norm(path - along[:, None] * ahead, axis=-1)
        angle = np.rad2deg(angles_of(turned))
        found = Rows(path, along, lateral, angle, angle)
    metrics = with_contact(of_rows(found, ahead, reference_mm), contact, row_s)
    return SpatialMetrics(**vars(metrics), swing_max_deg=swing)


def angles_of(rotation: Array) -> Array:
    """Return the angles `(T,)` [rad] of rotations as quaternions `(T, 4)`, at most half a turn."""
    return np.asarray(2 * np.arctan2(np.linalg.norm(rotation[:, 1:], axis=-1), np.abs(rotation[:, 0])))


def twist_and_swing(rotation: Array, axis: Array) -> tuple[Array, Array]:
    """Return how far rotations `(T, 4)` turn about an axis `(3,)`, unwrapped, and how far aside of it `(T,)` [rad].

    With a quaternion (w, v) and an axis a the twist is 2 atan2(v a, w), the swing 2 acos sqrt(w^2 + (v a)^2).
    """
    about = rotation[:, 1:] @ axis
    twist = np.unwrap(2 * np.arctan2(about, rotation[:, 0]))
    aside = np.linalg.norm(rotation[:, 1:] - about[:, None] * axis, axis=-1)
    return twist, np.asarray(2 * np.arctan2(aside, np.hypot(rotation[:, 0], about)))
