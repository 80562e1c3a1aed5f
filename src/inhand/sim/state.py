"""What the simulator measures: one frozen `State` of a batch of worlds, all from one instant."""

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array, planar, spatial

CONTACT_TOLERANCE = 1e-4
"""A finger touches the object where its distance is at most this [m] (guessed: a tenth of a millimetre)."""

NEAREST = 1e-9
"""Points nearer than this are one [m]."""
LARGEST = 1e6
"""Angles, positions and speeds beyond this [rad, m, rad/s, m/s] are a simulation that diverged (guessed: nothing that
a hand does comes near, and squares of it are still harmless)."""


@dataclass(frozen=True)
class State:
    """A batch of B worlds with F fingers and n joints at one instant, in the palm frame and SI units."""

    time: Array
    """Simulated time `(B,)` [s]."""
    object_pose: Array
    """Pose of the object `(B, 7)`: position [m], unit quaternion w x y z."""
    object_velocity: Array
    """Velocity of the object `(B, 6)`: linear [m/s], angular [rad/s]."""
    joint_angles: Array
    """Joint angles `(B, n)` [rad], finger by finger."""
    joint_velocities: Array
    """Joint velocities `(B, n)` [rad/s]."""
    targets: Array
    """Joint angles last commanded `(B, n)` [rad]."""
    link_gaps: Array
    """Distance of every link to the object `(B, n)` [m], negative where they overlap."""
    contact_links: NDArray[np.int64]
    """The link of each of the F fingers nearest to the object, counted from the palm, `(B, F)`."""
    finger_points: Array
    """The point of each finger nearest to the object `(B, F, 3)` [m]."""
    object_points: Array
    """The point of the object nearest to each finger `(B, F, 3)` [m]."""
    gaps: Array
    """Distance of each finger to the object `(B, F)` [m], negative where they overlap."""
    forces: Array
    """The force of each finger on the object during the last physics step `(B, F, 3)` [N], 0 before the first."""
    diverged: NDArray[np.bool_]
    """Whether the world's simulation has diverged since it was last reset or restored `(B,)`. The simulator puts such
    a world at rest where it was last reset to, so that the other arrays are finite and mean nothing."""

    @cached_property
    def pose(self) -> Array:
        """Planar view x [m], y [m], theta [rad] of the object's pose `(B, 3)`, read only: many ask for it."""
        pose = planar(self.object_pose)
        pose.setflags(write=False)
        return pose

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Whether each finger touches the object `(B, F)`."""
        return self.gaps <= CONTACT_TOLERANCE

    @property
    def normals(self) -> Array:
        """Unit vectors from each finger to the object where they are nearest `(B, F, 3)`.

        Where finger and object meet in one point, they point to the object's origin.
        """
        way = np.where(self.gaps < 0, -1.0, 1.0)[..., None] * (self.object_points - self.finger_points)
        away = np.linalg.norm(way, axis=-1, keepdims=True) < NEAREST
        way = np.where(away, self.object_pose[:, None, :3] - self.finger_points, way)
        return np.asarray(way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), NEAREST))

    @property
    def penetration(self) -> Array:
        """The deepest overlap of a link and the object `(B,)` [m], 0 where none overlaps."""
        return np.asarray(np.maximum(-self.link_gaps.min(axis=1), 0.0))

    @property
    def finger_xy(self) -> Array:
        """Planar view of `finger_points` `(B, F, 2)` [m]."""
        return self.finger_points[..., :2]

    @property
    def object_xy(self) -> Array:
        """Planar view of `object_points` `(B, F, 2)` [m]."""
        return self.object_points[..., :2]

    @property
    def n_worlds(self) -> int:
        """Number of worlds B."""
        return int(self.time.shape[0])


class SpatialState(State):
    """The same of worlds in space, where poses have no planar view."""

    @cached_property
    def pose(self) -> Array:
        """Pose of the object `(B, 7)`."""
        return self.object_pose


def believed(
    time: Array,
    moving: tuple[Array, Array],
    joints: tuple[Array, Array, Array],
    links: NDArray[np.int64],
    points: Array,
) -> State:
    """Return a state of which this much is believed: fingers touch, forces are not known.

    Args:
        time: `(B,)` [s].
        moving: poses `(B, 3)` [m, m, rad] of the objects, and their velocities `(B, 3)` in a second.
        joints: angles, velocities and targets, each `(B, n)`.
        links: the link of each finger that touches `(B, F)`.
        points: where fingers touch `(B, F, 2)` [m].
    """
    (pose, velocity), (count, fingers) = moving, links.shape
    spots = np.concatenate([points, np.zeros((count, fingers, 1))], axis=-1)
    still = np.zeros((count, 3))
    return State(
        time=time,
        object_pose=spatial(pose, 0.0),
        object_velocity=np.concatenate([velocity[:, :2], still, velocity[:, 2:]], axis=-1),
        joint_angles=joints[0],
        joint_velocities=joints[1],
        targets=joints[2],
        link_gaps=np.zeros_like(joints[0]),
        contact_links=links,
        finger_points=spots,
        object_points=spots,
        gaps=np.zeros((count, fingers)),
        forces=np.zeros((count, fingers, 3)),
        diverged=np.zeros(count, dtype=bool),
    )


def believed_in_space(
    time: Array,
    moving: tuple[Array, Array],
    joints: tuple[Array, Array, Array],
    contacts: tuple[NDArray[np.int64], Array, Array],
) -> SpatialState:
    """Return a state in space of which this much is believed: fingers touch, forces are not known.

    Args:
        time: `(B,)` [s].
        moving: poses `(B, 7)` of the objects, and their velocities `(B, 6)` [m/s, rad/s].
        joints: angles, velocities and targets, each `(B, n)`.
        contacts: the link of each finger that touches `(B, F)`, where `(B, F, 3)` [m], and the object's normals there.
    """
    links, points, normals = contacts
    return SpatialState(
        time=time,
        object_pose=moving[0],
        object_velocity=moving[1],
        joint_angles=joints[0],
        joint_velocities=joints[1],
        targets=joints[2],
        link_gaps=np.zeros_like(joints[0]),
        contact_links=links,
        finger_points=points + 2 * NEAREST * normals,  # a little apart, so that they tell the normal
        object_points=points,
        gaps=np.zeros(links.shape),
        forces=np.zeros(points.shape),
        diverged=np.zeros(len(links), dtype=bool),
    )


def ran_away(*parts: Array) -> NDArray[np.bool_]:
    """Return in which worlds angles, positions or speeds `(B, k)` are no numbers or beyond `LARGEST` `(B,)`."""
    return np.asarray(~np.logical_and.reduce([np.abs(part).max(axis=1) <= LARGEST for part in parts]))


def seen_at(pose: Array, state: State) -> State:
    """Return a state whose `pose` is known already, `(B, 3)` or in space `(B, 7)`: it takes a while to find."""
    view = pose.view()
    view.setflags(write=False)
    vars(state)["pose"] = view
    return state


def select(state: State, worlds: NDArray[np.int64] | NDArray[np.bool_] | slice) -> State:
    """Return the state of some worlds alone; arrays are copied unless `worlds` is a slice."""
    return replace(state, **{field.name: getattr(state, field.name)[worlds] for field in fields(State)})


def put(state: State, worlds: NDArray[np.int64], other: State, rows: NDArray[np.int64]) -> State:
    """Return a state in which some worlds are rows of another."""
    found = {
        field.name: put_rows(getattr(state, field.name), worlds, getattr(other, field.name)[rows])
        for field in fields(State)
    }
    return replace(state, **found)


def put_rows(array: NDArray[Any], rows: NDArray[np.int64], values: NDArray[Any]) -> NDArray[Any]:
    """Return a copy with some rows replaced: what was handed out before stays as it was."""
    copy = array.copy()
    copy[rows] = values
    return copy
