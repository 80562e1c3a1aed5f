"""A hand from a URDF or MJCF file: two chains of hinges on a still palm, brought into the palm frame and our angles.

The palm's body or site gives the directions of the palm frame; its origin moves to the middle between the proximal
joints. With a joint's axis along s z (s = +-1) and the file's own angle q, our angle is

    theta = zero + s q,

where zero is the angle between the link and the one before (for the first, between the link and +y) at q = 0. A link
reaches from its joint's axis to the next, the last to the tip. Its outline is the convex hull of its collision geoms.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from inhand.errors import InputError
from inhand.folders import is_file
from inhand.geometry import Array, rotate, wrap_angle
from inhand.hands.hand import FINGER_NAMES, Corners, FingerSpec, HandSpec
from inhand.hands.robot_chains import Chain, Parts, RobotNames, find_parts
from inhand.hands.robot_meshes import leave_out
from inhand.hands.robot_outlines import DECIMALS, collision_geoms, convex_outline, solid_points
from inhand.hands.robot_text import read_text
from inhand.hands.sizes import check_length

SUFFIXES = (".urdf", ".xml", ".mjcf")
"""Endings of robot files."""
SHORTEST_LINK = 1e-3
"""Joints whose axes are closer than this have no link between them [m]."""
SCALE = "a robot file is in metres; if this one is in millimetres, give scale = 0.001 in the hand file"
MESH_SCALE = (
    'a mesh in millimetres needs scale="0.001 0.001 0.001" in its <mesh>; if the whole file is in millimetres, give'
    " scale = 0.001 in the hand file"
)


@dataclass(frozen=True, eq=False)
class RobotHand:
    """A hand and how its robot file counts the joint angles."""

    hand: HandSpec
    """The hand, in the palm frame."""
    signs: Array
    """+1 where the file's angle grows counter-clockwise about the palm's +z, else -1 `(n_joints,)`."""
    zeros: Array
    """Our angles where the file's are zero `(n_joints,)` [rad]."""
    notes: tuple[str, ...] = ()
    """What was left out of the file or assumed, a sentence each."""

    def hand_angles(self, file_angles: Array) -> Array:
        """Return our joint angles `(..., n_joints)` [rad] of the file's; both in the hand's order of joints."""
        return np.asarray(self.zeros + self.signs * file_angles)

    def file_angles(self, hand_angles: Array) -> Array:
        """Return the file's joint angles `(..., n_joints)` [rad] of ours."""
        return np.asarray(self.signs * (hand_angles - self.zeros))


@dataclass(frozen=True)
class _Finger:
    """A finger in the plane of the palm's axes, its origin still that of the file."""

    base: Array
    lengths: tuple[float, ...]
    zeros: Array
    signs: Array
    limits: tuple[tuple[float, float], ...]
    outlines: tuple[Corners, ...]
    masses: tuple[float, ...]
    thickness: float


def read_robot(
    path: Path, name: str, names: RobotNames, numbers: Mapping[str, float] | None = None, scale: float = 1.0
) -> RobotHand:
    """Return the hand of a URDF or MJCF file.

    Args:
        path: the file.
        name: what to call the hand.
        names: what palm, joints and tips are called in it.
        numbers: fields of `HandSpec` that are given instead of read, such as `friction`; friction, stiffness and
            whatever the file leaves out have the defaults of `HandSpec`.
        scale: metres in one of the file's units of length; 0.001 for a file in mm.

    Raises:
        InputError: no readable robot, a name that is not in it, or a mechanism that is no two-finger planar hand.
    """
    model, notes = load_model(path, (*names.left.joints, *names.right.joints))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    try:
        parts = find_parts(model, data, names)
        parts = replace(parts, axes=scale * parts.axes)
        fingers = [_finger(model, data, parts, index) for index in range(2)]
        robot = _assemble(model, data, name, (parts, fingers), dict(numbers or {}))
        return replace(robot, notes=(*notes, *_assumed(model, parts)))
    except InputError as error:
        raise InputError(f"robot file {path}: {error}") from error


def load_model(path: Path, joints: tuple[str, ...]) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """Return the model of a URDF or MJCF file, whose named joints can move, and notes on what was left out of it.

    Raises:
        InputError: no such file, or none that the engine reads.
    """
    if not is_file(path):
        raise InputError(f"no robot file {path}: robot names a URDF or MJCF file, seen from the hand file's folder")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"robot file {path}: unknown ending {path.suffix!r}; allowed are {', '.join(SUFFIXES)}")
    robot = read_text(path, joints)
    try:
        if path.suffix in SUFFIXES[1:]:
            spec = mujoco.MjSpec.from_file(str(path))
        else:
            spec = mujoco.MjSpec.from_string(robot.text, assets=robot.meshes)
            spec.modelfiledir = str(path.parent)
        spec.compiler.fusestatic = False  # else fixed links, the palm and the tips, lose their names
        notes = () if path.suffix.lower() == ".urdf" else leave_out(spec, path)
        return spec.compile(), (*robot.notes, *notes)
    except InputError:
        raise
    except ValueError as error:
        text = " ".join(str(error).split())
        raise InputError(f"{path} is not a robot that MuJoCo reads: {text}; mend the file") from error


def _assumed(model: mujoco.MjModel, parts: Parts) -> tuple[str, ...]:
    joints = [joint for chain in parts.chains for joint in chain.joints if not model.jnt_limited[joint]]
    named = ", ".join(model.joint(joint).name for joint in joints)
    return (f"The robot file gives no limits for {named}: they turn freely, +-180 deg.",) if joints else ()


def _finger(model: mujoco.MjModel, data: mujoco.MjData, parts: Parts, index: int) -> _Finger:
    chain, side = parts.chains[index], FINGER_NAMES[index]
    joints = list(chain.joints)
    corners = np.concatenate([data.xanchor[joints], parts.tips[index][None]]) @ parts.axes[:2].T
    steps = np.diff(corners, axis=0)
    lengths = np.linalg.norm(steps, axis=-1)
    for i, length in enumerate(lengths):
        if length < SHORTEST_LINK:
            raise InputError(
                f"link {i} of the {side} finger is {1e3 * length:g} mm long, from the axis of"
                f" {model.joint(joints[i]).name!r} to the next axis or the tip; name joints and a tip that lie apart,"
                " or give `scale` in the hand file if the robot file is not in metres"
            )
        check_length(f"link {i} of the {side} finger", float(length), SCALE)
    headings = np.arctan2(-steps[:, 0], steps[:, 1])
    signs = np.sign(data.xaxis[joints] @ parts.axes[2])
    reference = np.array(model.qpos0[model.jnt_qposadr[joints]])
    zeros = wrap_angle(np.diff(headings, prepend=0.0)) - signs * reference
    limits = []
    for i, joint in enumerate(joints):
        span = zeros[i] + signs[i] * model.jnt_range[joint] if model.jnt_limited[joint] else np.array([-np.pi, np.pi])
        turns = 2 * np.pi * np.round(span.mean() / (2 * np.pi))
        zeros[i] -= turns
        limits.append((float(span.min() - turns), float(span.max() - turns)))
    outlines, thickness = _links(model, data, parts, chain, (corners, headings, side))
    masses = tuple(float(model.body_mass[list(bodies)].sum()) for bodies in chain.bodies)
    tidy = tuple(float(length) for length in np.round(lengths, DECIMALS))
    return _Finger(corners[0], tidy, zeros, signs, tuple(limits), outlines, masses, thickness)


def _links(
    model: mujoco.MjModel, data: mujoco.MjData, parts: Parts, chain: Chain, plane: tuple[Array, Array, str]
) -> tuple[tuple[Corners, ...], float]:
    """Return the outlines of a finger's links in their own frames and their largest height [m]."""
    corners, headings, side = plane
    outlines, heights = [], []
    for i, bodies in enumerate(chain.bodies):
        what = f"link {i} of the {side} finger"
        points = _points(model, data, bodies, parts.axes, what)
        heights.append(float(np.ptp(points[:, 2])))
        outlines.append(_outline(rotate(-headings[i], points[:, :2] - corners[i]), what))
    return tuple(outlines), max(heights)


def _points(model: mujoco.MjModel, data: mujoco.MjData, bodies: tuple[int, ...], axes: Array, what: str) -> Array:
    geoms = collision_geoms(model, bodies)
    if not geoms:
        named = ", ".join(repr(model.body(body).name) for body in bodies)
        raise InputError(
            f"{what} ({named}) has no collision geoms, and its outline comes from them; add <collision> (URDF) or geoms"
            " with contype 1 (MJCF)"
        )
    return solid_points(model, data, geoms, axes)


def _outline(points: Array, what: str) -> Corners:
    try:
        corners = convex_outline(points)
    except InputError as error:
        raise InputError(f"{what}: {error}") from error
    check_length(f"the outline of {what}", float(np.ptp(corners, axis=0).max()), MESH_SCALE)
    return corners


def _assemble(
    model: mujoco.MjModel, data: mujoco.MjData, name: str, found: tuple[Parts, list[_Finger]], numbers: dict[str, Any]
) -> RobotHand:
    parts, fingers = found
    origin = (fingers[0].base + fingers[1].base) / 2
    left, right = (np.round(finger.base - origin, DECIMALS) for finger in fingers)
    if left[0] >= right[0]:
        raise InputError(
            f"the left finger starts at x = {1e3 * left[0]:g} mm and the right one at {1e3 * right[0]:g} mm in the palm"
            " frame: swap [left] and [right], or turn the frame with palm_x and palm_y"
        )
    joints = [joint for chain in parts.chains for joint in chain.joints]
    numbers = _numbers(model, joints, numbers) | numbers
    numbers.setdefault("thickness", round(max(finger.thickness for finger in fingers), DECIMALS))
    palm = _points(model, data, parts.palm, parts.axes, "the palm")[:, :2]
    specs = [
        FingerSpec(
            (float(base[0]), float(base[1])),
            finger.lengths,
            finger.limits,
            bend,
            finger.outlines,
            None if "link_mass" in numbers else finger.masses,
        )
        for base, finger, bend in zip((left, right), fingers, (-1, 1), strict=True)
    ]
    width = round(float(np.linalg.norm(right - left)), DECIMALS)
    hand = HandSpec(name, specs[0], specs[1], width, palm=_outline(palm - origin, "the palm"))
    signs, zeros = (np.concatenate([getattr(f, what) for f in fingers]) for what in ("signs", "zeros"))
    return RobotHand(replace(hand, **numbers), signs, zeros)


def _numbers(model: mujoco.MjModel, joints: list[int], given: dict[str, Any]) -> dict[str, float]:
    """Return damping, rotor inertia and torque of the joints; what the file leaves at zero is left out."""
    dofs = model.jnt_dofadr[joints]
    rows = {
        "damping": ("damping", np.array(model.dof_damping[dofs])),
        "armature": ("armature_kg_m2", np.array(model.dof_armature[dofs])),
        "torque": ("torque_nm", np.array([_torque(model, joint) for joint in joints])),
    }
    numbers = {}
    for field, (key, values) in rows.items():
        if field in given or not values.any():
            continue
        if np.ptp(values) > 1e-9:
            raise InputError(
                f"the joints have the {field} {', '.join(f'{value:g}' for value in values)}; a hand has one for all:"
                f" give {key} in the hand file"
            )
        numbers[field] = float(values[0])
    return numbers


def _torque(model: mujoco.MjModel, joint: int) -> float:
    """Return the largest torque of a joint, by its own limit (URDF: effort) or its motor's, or 0 [N m]."""
    if model.jnt_actfrclimited[joint]:
        return float(np.abs(model.jnt_actfrcrange[joint]).min())
    at_joint = (model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT) & (model.actuator_trnid[:, 0] == joint)
    limits = [
        float(np.abs(model.actuator_forcerange[i]).min() * abs(model.actuator_gear[i, 0]))
        for i in np.flatnonzero(at_joint)
        if model.actuator_forcelimited[i]
    ]
    return sum(limits)
