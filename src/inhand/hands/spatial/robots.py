"""A hand in space from a URDF or MJCF file: serial fingers of hinges on a palm that stands still.

The palm's body or site gives the axes of the palm frame. A link's frame lies on its hinge, along its body's axes, so
that our joint angles are the file's, less their reference. What a link touches with are capsules in the place of its
collision shapes; a fingertip is a sphere that the hand file gives.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.robot_chains import (
    JOINT_TYPES,
    Kind,
    below,
    check_chain,
    check_free,
    find_part,
    first_joint_above,
    palm_axes,
    tip_place,
)
from inhand.hands.robot_files import load_model
from inhand.hands.robot_outlines import collision_geoms, solid_points
from inhand.hands.spatial.hand import Box, Inertia, Link, Quaternion, SpatialFinger, SpatialHand, Vector
from inhand.hands.spatial.robot_bodies import capsules_of, mass_of
from inhand.hands.spatial.robot_starts import best_start
from inhand.hands.spatial.rolling import MOST_BODIES

FREE = (-np.pi, np.pi)
"""Limits of a joint that the file gives none [rad]."""


@dataclass(frozen=True)
class RobotFinger:
    """What a finger's parts are called in a robot file."""

    name: str
    joints: tuple[str, ...]
    """Hinges from the palm outwards."""
    tip: str
    """Body or site at the fingertip."""
    tip_radius: float
    """Radius of the fingertip [m]."""
    tip_offset: Vector = (0.0, 0.0, 0.0)
    """Its centre in the frame of the tip's body or site [m]."""


@dataclass(frozen=True)
class RobotParts:
    """What the parts of a hand in space are called in a robot file."""

    palm: str
    """Body or site whose axes are those of the palm frame."""
    fingers: tuple[RobotFinger, ...]
    palm_x: str = "x"
    """Axis of the palm's body that points right."""
    palm_y: str = "y"
    """Axis of the palm's body that points up the palm; the palm looks along x times y."""
    origin: Vector = (0.0, 0.0, 0.0)
    """Origin of the palm frame from that of the body or site, along the frame's own axes [m]."""
    start: Vector | None = None
    """Where the object starts in the palm frame [m]; None for where the tips find most room round it."""


def read_spatial_robot(
    path: Path, name: str, parts: RobotParts, numbers: Mapping[str, float] | None = None
) -> tuple[SpatialHand, tuple[str, ...]]:
    """Return the hand of a URDF or MJCF file, and notes on what was left out or assumed, a sentence each.

    Args:
        path: the file.
        name: what to call the hand.
        parts: what palm, joints and tips are called in it.
        numbers: fields of `SpatialHand` that are given, such as `friction`; others have its defaults.

    Raises:
        InputError: no readable robot, a name that is not in it, chains that branch or slide, a tip on no link.
    """
    model, notes = load_model(path, tuple(joint for finger in parts.fingers for joint in finger.joints))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    try:
        body, origin, axes = _palm(model, data, parts)
        palm_box = _palm_box(model, data, body, (origin, axes))
        fingers = tuple(_finger(model, data, (body, origin, axes), finger) for finger in parts.fingers)
        hand = SpatialHand(name, fingers, palm_box, parts.start or (0.0, 0.0, 0.1), **dict(numbers or {}))
    except InputError as error:
        raise InputError(f"robot file {path}: {error}") from error
    if parts.start is None:
        hand = replace(hand, start_position=best_start(hand))
    held = first_joint_above(model, body, 0)
    if held is not None:
        above = model.joint(held).name or f"a {JOINT_TYPES[model.jnt_type[held]]} joint"
        notes = (*notes, f"The palm stands still: {above} and whatever else is above it do not move.")
    return hand, notes


def _palm(model: mujoco.MjModel, data: mujoco.MjData, parts: RobotParts) -> tuple[int, Array, Array]:
    """Return the palm's body, and origin and rows of the palm frame in the world."""
    kind, number = find_part(model, (Kind.mjOBJ_BODY, Kind.mjOBJ_SITE), parts.palm, "palm")
    on_body = kind == Kind.mjOBJ_BODY
    body = number if on_body else int(model.site_bodyid[number])
    matrix = np.array(data.xmat[number] if on_body else data.site_xmat[number]).reshape(3, 3)
    place = np.array(data.xpos[number] if on_body else data.site_xpos[number])
    axes = palm_axes(matrix, (parts.palm_x, parts.palm_y))
    return body, place + np.array(parts.origin) @ axes, axes


def _palm_box(model: mujoco.MjModel, data: mujoco.MjData, body: int, frame: tuple[Array, Array]) -> Box:
    """Return the box along the palm's axes round the collision shapes of the palm; a point where it has none."""
    origin, axes = frame
    rigid = [b for b in below(model, body) if model.body_weldid[b] == model.body_weldid[body]]
    geoms = collision_geoms(model, rigid)
    if not geoms:
        return Box((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    points = solid_points(model, data, geoms, axes) - origin @ axes.T
    low, high = points.min(axis=0), points.max(axis=0)
    return Box(_vector((low + high) / 2), _vector((high - low) / 2))


def _finger(
    model: mujoco.MjModel, data: mujoco.MjData, palm: tuple[int, Array, Array], names: RobotFinger
) -> SpatialFinger:
    joints = _hinges(model, names)
    check_chain(model, joints, palm[0], names.name)
    check_free(model, list(joints))
    place, frame = palm[1], palm[2]
    links = []
    for joint in joints:
        body = int(model.jnt_bodyid[joint])
        rotation, anchor = np.array(data.xmat[body]).reshape(3, 3), np.array(data.xanchor[joint])
        bodies = np.flatnonzero(model.body_weldid == model.body_weldid[body]).tolist()
        own = (anchor, rotation)
        mass, centre, inertia = mass_of(model, data, bodies, own)
        reference = float(model.qpos0[model.jnt_qposadr[joint]])
        low, high = (model.jnt_range[joint] - reference).tolist() if model.jnt_limited[joint] else FREE
        links.append(
            Link(
                _vector(frame @ (anchor - place)),
                _unit(rotation.T @ data.xaxis[joint]),
                (low, high),
                _quaternion(frame @ rotation),
                capsules_of(model, data, bodies, own),
                mass,
                _vector(centre),
                _inertia(inertia),
            )
        )
        place, frame = anchor, rotation.T
    shapes = sum(len(link.capsules) for link in links)
    if shapes >= MOST_BODIES:
        raise InputError(
            f"finger {names.name!r} has {shapes} collision shapes, a finger at most {MOST_BODIES - 1}: join"
            " some, or leave those out that touch nothing"
        )
    tip = tip_place(model, data, joints[-1], names.tip, names.name)
    tip = tip + _tip_frame(model, data, names.tip) @ np.array(names.tip_offset)
    return SpatialFinger(names.name, tuple(links), _vector(frame @ (tip - place)), names.tip_radius)


def _hinges(model: mujoco.MjModel, names: RobotFinger) -> tuple[int, ...]:
    if not names.joints:
        raise InputError(f"finger {names.name!r} names no joints: name its hinges from the palm outwards")
    found = []
    for joint in names.joints:
        number = find_part(model, (Kind.mjOBJ_JOINT,), joint, f"finger {names.name!r}")[1]
        kind = JOINT_TYPES[model.jnt_type[number]]
        if kind != "hinge":
            raise InputError(
                f"joint {joint!r} of finger {names.name!r} is of type {kind}; joints of a finger are hinges (URDF:"
                " revolute)"
            )
        found.append(number)
    return tuple(found)


def _tip_frame(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> Array:
    kind, number = find_part(model, (Kind.mjOBJ_BODY, Kind.mjOBJ_SITE), name, "tip")
    return np.array(data.xmat[number] if kind == Kind.mjOBJ_BODY else data.site_xmat[number]).reshape(3, 3)


def _vector(numbers: Array) -> Vector:
    x, y, z = (float(number) for number in np.round(numbers, 12) + 0.0)
    return (x, y, z)


def _unit(numbers: Array) -> Vector:
    return _vector(numbers / np.linalg.norm(numbers))


def _quaternion(rotation: Array) -> Quaternion:
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(rotation).ravel())
    w, x, y, z = (float(number) for number in found / np.linalg.norm(found))
    return (w, x, y, z)


def _inertia(moments: Array) -> Inertia:
    return (
        float(moments[0, 0]),
        float(moments[1, 1]),
        float(moments[2, 2]),
        float(moments[0, 1]),
        float(moments[0, 2]),
        float(moments[1, 2]),
    )
