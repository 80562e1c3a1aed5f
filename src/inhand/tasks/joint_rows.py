"""Any hand and object told alike: a row of numbers for each joint's slot, and what belongs to the whole hand.

Layout `joints` is of one size for all hands of two fingers (`tasks/hand_arrays.py`). Its rows hold what the primitive
asks of each joint: the joint steps, by damped least squares at the measured contact, that would carry the object on,
back to its line or onto a finger that has left it, and the angle that the servo gives way under the grip. What is in
the rows means the same whatever the link lengths are, so what is learned with one hand holds for another
(docs/design.md).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import TURN_ARM, Array, perpendicular, unit
from inhand.hands.kinematics import damped_least_squares, link_jacobian
from inhand.sim.state import State
from inhand.tasks.hand_arrays import PER_FINGER, RAYS, SLOTS, HandArrays
from inhand.tasks.observations import AIMED, CONTACTS, LEFT, Aim, Layout, Part, Scene

DAMPING = 0.005
"""Damping of the least squares, the expert's [m/rad]."""
NEAR = 0.01
"""Way left beyond which a row's step to the end grows no more [m]."""
PRESS = (3.0, 0.6)
"""Grip force that rows tell the joints' angles for [N], or so much of what the motors could make, if that is less."""
PERIOD = 0.02
"""Time for which rows count speeds: a decision [s]."""

COLUMNS = (
    ("there", 1.0),
    ("place from the palm", 2.0),
    ("moves the contact", 1.0),
    ("finger, -1 left and 1 right", 1.0),
    ("command ahead of the joint [rad]", 0.15),
    ("step onto the object [rad]", 0.1),
    ("step back to the line [rad]", 0.1),
    ("step against motion off it [rad]", 0.03),
    ("step for 1 mm on [rad]", 0.03),
    ("step of its motion on [rad]", 0.03),
    ("step to the end, at most 10 mm [rad]", 0.3),
    ("how far the servo lags there [rad]", 0.1),
    ("angle of the grip [rad]", 0.15),
    ("joint velocity [rad/s]", 4.0),
    ("angle [rad]", np.pi),
    ("room to the upper limit [rad]", 0.5),
    ("room to the lower limit [rad]", 0.5),
    ("link length [m]", 0.12),
)
"""What a row holds, and what becomes 1 of it."""


def joint_rows(state: State, aim: Aim, scene: Scene) -> Array:
    """Return the rows of a batch, column by column `(B, len(COLUMNS) * SLOTS)`."""
    arrays, pose, points = scene.arrays, state.pose, state.finger_xy
    slots = arrays.slotted
    angles = slots(state.joint_angles)
    jacobian = _jacobian(arrays, angles, points, state.contact_links)
    turning = np.broadcast_to(aim.turn, aim.angle.shape) != 0
    arm, going = points - pose[:, None, :2], _going(state, aim)

    def step(motion: Array) -> Array:
        moved = motion[:, None, :2] + motion[:, None, 2:] * perpendicular(arm)
        return damped_least_squares(jacobian, moved, DAMPING)

    on = step(_on(aim, turning))
    end = np.clip(aim.left(pose), -NEAR, NEAR)[:, None, None] * on
    onto = np.maximum(state.gaps, 0.0)[..., None] * state.normals[..., :2]
    high, low = arrays.limits[..., 1], arrays.limits[..., 0]
    columns = (
        arrays.there,
        arrays.there * np.arange(PER_FINGER),
        arrays.there * (np.arange(PER_FINGER) <= state.contact_links[..., None]),
        arrays.there * np.array([[-1.0], [1.0]]),
        slots(state.targets - state.joint_angles),
        damped_least_squares(jacobian, onto, DAMPING),
        step(_back(aim.shift(pose), aim, turning)),
        PERIOD * step(_back(going, aim, turning)),
        1e-3 * on,
        PERIOD * aim.come(going)[:, None, None] * on,
        end,
        arrays.gains[:, 1, None, None] / PERIOD * end,
        _grip_angles(jacobian, points, arrays),
        slots(state.joint_velocities),
        angles,
        slots(np.clip(high - state.joint_angles, 0.0, 1.0)),
        slots(np.clip(state.joint_angles - low, 0.0, 1.0)),
        arrays.links,
    )
    rows = [np.broadcast_to(column.reshape(-1, SLOTS), angles.shape) for column in columns]
    return np.concatenate([row / half for row, (_, half) in zip(rows, COLUMNS, strict=True)], axis=-1)


def _jacobian(arrays: HandArrays, angles: Array, points: Array, links: NDArray[np.int64]) -> Array:
    """Return how the nearest points of both fingers `(B, 2, 2)` move with the joints in their slots `(B, 2, 2, 3)`."""
    along = perpendicular(unit(np.cumsum(angles.reshape(-1, 2, PER_FINGER), axis=-1))) * arrays.links[..., None]
    ends = arrays.base[:, :, None] + np.cumsum(along, axis=-2)
    joints = np.concatenate([np.broadcast_to(arrays.base[:, :, None], ends[:, :, :1].shape), ends[:, :, :-1]], axis=-2)
    return np.asarray(link_jacobian(joints, points, links) * arrays.there[:, :, None])


def _going(state: State, aim: Aim) -> Array:
    """Return the object's velocity along the directions, to their left [m/s] and about itself [rad/s] `(B, 3)`."""
    linear, ahead = state.object_velocity[:, :2], aim.direction
    along, left = (linear * ahead).sum(axis=-1), (linear * perpendicular(ahead)).sum(axis=-1)
    return np.stack([along, left, state.object_velocity[:, 5]], axis=-1)


def _on(aim: Aim, turning: NDArray[np.bool_]) -> Array:
    """Return the motion by a metre of what is asked in the palm frame `(B, 3)` [m, m, rad]; a turn counts as an arc."""
    turned = np.broadcast_to(aim.turn, aim.angle.shape) / TURN_ARM
    return np.concatenate([np.where(turning[:, None], 0.0, aim.direction), turned[:, None]], axis=-1)


def _back(off: Array, aim: Aim, turning: NDArray[np.bool_]) -> Array:
    """Return what takes back what the object is off `(B, 3)`: ahead, to the left and turned, less what is asked."""
    away = -off
    away[:, 0] = np.where(turning, away[:, 0], 0.0)
    away[:, 2] = np.where(turning, 0.0, away[:, 2])
    moved = away[:, :1] * aim.direction + away[:, 1:2] * perpendicular(aim.direction)
    return np.concatenate([moved, away[:, 2:]], axis=-1)


def _grip_angles(jacobian: Array, points: Array, arrays: HandArrays) -> Array:
    """Return how far a command lies beyond each joint under the grip `(B, 2, 3)` [rad]: J' f / stiffness."""
    line = points[:, 1] - points[:, 0]
    line = line / np.maximum(np.linalg.norm(line, axis=-1, keepdims=True), 1e-9)
    lever = (jacobian * line[:, None, :, None]).sum(axis=-2)
    strongest = PRESS[1] * arrays.gains[:, 2] / np.maximum(np.abs(lever).max(axis=(1, 2)), 1e-9)
    force = np.minimum(PRESS[0], strongest) / arrays.gains[:, 0]
    return np.asarray(force[:, None, None] * lever * np.array([[1.0], [-1.0]]))


def _line(state: State, aim: Aim, _scene: Scene) -> Array:
    """Return the unit vectors from the left contact to the right one, seen along the directions `(B, 2)`."""
    line = state.finger_xy[:, 1] - state.finger_xy[:, 0]
    line = line / np.maximum(np.linalg.norm(line, axis=-1, keepdims=True), 1e-9)
    return np.stack([(line * aim.direction).sum(axis=-1), (line * perpendicular(aim.direction)).sum(axis=-1)], axis=-1)


def _turn(_state: State, aim: Aim, _scene: Scene) -> Array:
    return np.broadcast_to(aim.turn, aim.angle.shape)[:, None]


ROWS = "for each joint's slot: " + ", ".join(name for name, _ in COLUMNS)
JOINTS = Layout(
    "joints-1",
    (
        Part(ROWS, joint_rows, 1.0, fixed=len(COLUMNS) * SLOTS),
        AIMED[0],
        Part("side to turn to", _turn, 1.0, fixed=1),
        *LEFT,
        *AIMED[1:],
        Part("spin [rad/s]", lambda state, _aim, _scene: state.object_velocity[:, 5:], 2.0, fixed=1),
        Part(
            "object position from its start, orientation [m, m, rad]",
            lambda state, _aim, scene: state.pose - np.pad(scene.arrays.start, ((0, 0), (0, 1))),
            (0.15, 0.15, 1.0),
            fixed=3,
        ),
        *CONTACTS,
        Part("line between the contacts, along and across", _line, 1.0, fixed=2),
        Part(
            "stiffness, damping over stiffness, largest torque, friction",
            lambda state, _aim, scene: np.broadcast_to(scene.arrays.gains, (state.n_worlds, 4)),
            (10.0, 0.1, 1.0, 1.0),
            fixed=4,
        ),
        Part(
            "outline in the object's frame, distances at even angles [m]",
            lambda state, _aim, scene: np.broadcast_to(scene.arrays.outline, (state.n_worlds, RAYS)),
            0.05,
            fixed=RAYS,
        ),
    ),
    columns=len(COLUMNS),
)
"""The same numbers for any hand: rows first, then what belongs to hand, object and aim."""
