"""The physical state of worlds, kept to go back to it: what a simulator needs to go on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array, perpendicular, planar, rotate


@dataclass(frozen=True)
class Snapshot:
    """B worlds of one hand at one instant each, n joints and one object."""

    time: Array
    """Simulated time `(B,)` [s]."""
    qpos: Array
    """Joint angles [rad], then the object's position [m] and quaternion w x y z `(B, n + 7)`."""
    qvel: Array
    """Joint velocities [rad/s], then the object's linear [m/s] and, in its own frame, angular [rad/s] `(B, n + 6)`."""
    ctrl: Array
    """Joint angles last commanded `(B, n)` [rad]."""
    qacc_warmstart: Array
    """Accelerations from which the contact solver starts its next search `(B, n + 6)`; without them it ends at other
    last digits."""
    forces: Array
    """What was last measured of the fingers' forces on the object `(B, F, 3)` [N]; nothing depends on it."""

    centre: Array
    """Pose of the object's centre of mass in the plane, x, y [m] and theta [rad], and its rates `(B, 6)`: what the
    planar engine goes on from, where `qpos` and `qvel` are of the object's frame."""
    held: Array
    """Where the world itself holds the object `(B, 8)`: 1 where it does and 0 where not, then the pose [m]."""

    @property
    def n_worlds(self) -> int:
        """Number of worlds B."""
        return int(self.time.shape[0])

    def take(self, rows: NDArray[np.int64]) -> Snapshot:
        """Return copies of some rows `(K,)`, in the order given; a row may be taken more than once.

        Raises:
            InputError: a row that is not there.
        """
        check_indices(rows, self.n_worlds, "row")
        return Snapshot(**{field.name: getattr(self, field.name)[rows] for field in fields(Snapshot)})


def nowhere(n_worlds: int) -> Array:
    """Return what `Snapshot.held` is of worlds that hold no object themselves `(B, 8)`."""
    return np.zeros((n_worlds, 8))


def centre_of(qpos: Array, qvel: Array, offset: Array) -> Array:
    """Return pose and rates of centres of mass in the plane `(B, 6)`.

    Args:
        qpos: joint angles, then the object's pose `(B, n + 7)`.
        qvel: their rates `(B, n + 6)`.
        offset: centres of mass in the objects' frames `(B, 2)` [m].
    """
    pose, rates = planar(qpos[:, -7:]), qvel[:, [-6, -5, -1]]
    arm = rotate(pose[:, 2], offset)
    pose[:, :2] += arm
    rates[:, :2] += rates[:, 2:] * perpendicular(arm)
    return np.concatenate([pose, rates], axis=-1)


def join(snapshots: Sequence[Snapshot]) -> Snapshot:
    """Return the worlds of several snapshots, one after another, as one.

    Raises:
        InputError: none are given, or they are of hands with different numbers of joints.
    """
    if not snapshots:
        raise InputError("no snapshots to join: give at least one")
    joints = {snapshot.ctrl.shape[1] for snapshot in snapshots}
    if len(joints) > 1:
        given = " and of ".join(str(count) for count in sorted(joints))
        raise InputError(f"snapshots of {given} joints to join: join those of one hand")
    columns = {field.name: [getattr(snapshot, field.name) for snapshot in snapshots] for field in fields(Snapshot)}
    return Snapshot(**{name: np.concatenate(column) for name, column in columns.items()})


def check_indices(indices: NDArray[np.int64], count: int, what: str) -> None:
    """Refuse indices that are no whole numbers from 0 to `count` - 1 in one axis.

    Raises:
        InputError: the text names the first bad one.
    """
    if indices.ndim != 1 or indices.dtype.kind not in "iu":
        raise InputError(
            f"{what}s of shape {indices.shape} and type {indices.dtype}; give one axis of whole numbers (of a mask,"
            " np.flatnonzero)"
        )
    bad = (indices < 0) | (indices >= count)
    if bad.any():
        raise InputError(f"{what} {indices[bad][0]} of {count}; {what}s count from 0 to {count - 1}")


def check_restore(
    worlds: NDArray[np.int64], n_worlds: int, snapshot: Snapshot, rows: NDArray[np.int64], n_joints: int
) -> None:
    """Refuse to put rows `(K,)` of a snapshot into worlds `(K,)` that are not there, too few, too many or named twice.

    Raises:
        InputError: the text says which.
    """
    check_indices(worlds, n_worlds, "world")
    check_indices(rows, snapshot.n_worlds, "row")
    if len(rows) != len(worlds):
        raise InputError(f"{len(rows)} rows for {len(worlds)} worlds; give one row of the snapshot for each world")
    named, times = np.unique(worlds, return_counts=True)
    if (times > 1).any():
        raise InputError(f"world {named[times > 1][0]} is named twice; a world can go back to one state only")
    if snapshot.ctrl.shape[1] != n_joints:
        raise InputError(
            f"a snapshot of a hand of {snapshot.ctrl.shape[1]} joints for one of {n_joints}; put worlds back to"
            " snapshots of their own hand"
        )
