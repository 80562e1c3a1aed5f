"""The named parts of a robot file: a still palm and two chains of hinges that end in a tip, or why they are not one."""

from dataclasses import dataclass

import mujoco
import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.hands.hand import FINGER_NAMES

AXIS_TOLERANCE = np.deg2rad(0.5)
"""Hinges may lean by this from the palm's z axis [rad]."""
AXES = ("x", "-x", "y", "-y", "z", "-z")
"""Axes of the palm's body that palm_x and palm_y may name."""

Kind = mujoco.mjtObj
_WORDS = {Kind.mjOBJ_BODY: "body", Kind.mjOBJ_SITE: "site", Kind.mjOBJ_JOINT: "joint"}
JOINT_TYPES = ("free", "ball", "slide", "hinge")


@dataclass(frozen=True)
class FingerNames:
    """What a finger's parts are called in a robot file."""

    joints: tuple[str, ...]
    """Two or three hinges from the palm outwards."""
    tip: str
    """Body or site at the fingertip."""


@dataclass(frozen=True)
class RobotNames:
    """What the parts of a hand are called in a robot file."""

    palm: str
    """Body or site whose axes are those of the palm frame."""
    left: FingerNames
    right: FingerNames
    palm_x: str = "x"
    """Axis of the palm's body that points right, one of `AXES`."""
    palm_y: str = "y"
    """Axis of the palm's body that points away from the palm, one of `AXES`."""


@dataclass(frozen=True)
class Chain:
    """One finger, by the model's numbers."""

    joints: tuple[int, ...]
    """Hinges from the palm outwards."""
    bodies: tuple[tuple[int, ...], ...]
    """Bodies that each of them moves rigidly."""


@dataclass(frozen=True, eq=False)
class Parts:
    """The hand's parts, by the model's numbers."""

    axes: Array
    """Rows: x, y and z of the palm frame in the world `(3, 3)`, as long as one of the file's units is in metres."""
    palm: tuple[int, ...]
    """The palm's body and those fixed to it."""
    chains: tuple[Chain, ...]
    """Left and right finger."""
    tips: tuple[Array, ...]
    """Their fingertips in the world, each `(3,)` [m]."""


def find_parts(model: mujoco.MjModel, data: mujoco.MjData, names: RobotNames) -> Parts:
    """Return the named parts of a robot whose kinematics are computed.

    Raises:
        InputError: a name is not in the file, or the parts are no two-finger planar hand on a still palm.
    """
    kind, number = find_part(model, (Kind.mjOBJ_BODY, Kind.mjOBJ_SITE), names.palm, "palm")
    body = number if kind == Kind.mjOBJ_BODY else int(model.site_bodyid[number])
    matrix = data.xmat[number] if kind == Kind.mjOBJ_BODY else data.site_xmat[number]
    axes = palm_axes(np.array(matrix).reshape(3, 3), (names.palm_x, names.palm_y))
    _check_still(model, body, names.palm)
    chains, tips = [], []
    for side, finger in zip(FINGER_NAMES, (names.left, names.right), strict=True):
        joints = _find_joints(model, finger, side)
        check_chain(model, joints, body, side)
        _check_axes(model, data, joints, axes)
        moved = (np.flatnonzero(model.body_weldid == model.jnt_bodyid[joint]) for joint in joints)
        chains.append(Chain(joints, tuple(tuple(bodies.tolist()) for bodies in moved)))
        tips.append(tip_place(model, data, joints[-1], finger.tip, side))
    check_free(model, [joint for chain in chains for joint in chain.joints])
    rigid = tuple(b for b in below(model, body) if model.body_weldid[b] == 0)
    return Parts(axes, rigid, tuple(chains), tuple(tips))


def find_part(
    model: mujoco.MjModel, kinds: tuple[mujoco.mjtObj, ...], name: str, what: str
) -> tuple[mujoco.mjtObj, int]:
    """Return of which of the kinds a named part is, and its number.

    Raises:
        InputError: there is none; the text offers near matches.
    """
    for kind in kinds:
        number = mujoco.mj_name2id(model, kind, name)
        if number >= 0:
            return kind, int(number)
    counts = {Kind.mjOBJ_BODY: model.nbody, Kind.mjOBJ_SITE: model.nsite, Kind.mjOBJ_JOINT: model.njnt}
    there = [mujoco.mj_id2name(model, kind, i) for kind in kinds for i in range(counts[kind])]
    there = [known for known in there if known]
    words = " or ".join(_WORDS[kind] for kind in kinds)
    raise InputError(f"no {words} {name!r} for {what}{near_matches(name, there)}; the file has {', '.join(there)}")


def palm_axes(matrix: Array, words: tuple[str, str]) -> Array:
    """Return the rows x, y, z of the palm frame from the columns of its body's frame, and the words for x and y.

    Raises:
        InputError: words of no axis, or both of one.
    """
    found = []
    for key, axis in zip(("palm_x", "palm_y"), words, strict=True):
        if axis not in AXES:
            raise InputError(f"{key} = {axis!r}; it must be an axis of the palm's body: {', '.join(AXES)}")
        found.append((-1 if axis.startswith("-") else 1) * matrix[:, "xyz".index(axis[-1])])
    if words[0][-1] == words[1][-1]:
        raise InputError(f"palm_x = {words[0]!r} and palm_y = {words[1]!r}; name two different axes")
    right, away = found
    return np.stack([right, away, np.cross(right, away)])


def _check_still(model: mujoco.MjModel, body: int, palm: str) -> None:
    joint = first_joint_above(model, body, 0)
    if joint is not None:
        raise InputError(
            f"the palm {palm!r} moves: {JOINT_TYPES[model.jnt_type[joint]]} joint {model.joint(joint).name!r} is above"
            " it; the palm must stand still in the world: make that joint fixed (URDF), or remove it (MJCF)"
        )


def first_joint_above(model: mujoco.MjModel, body: int, end: int) -> int | None:
    """Return a joint of a body or of one of those between it and `end`."""
    while body not in {0, end}:
        if model.body_jntnum[body]:
            return int(model.body_jntadr[body])
        body = int(model.body_parentid[body])
    return None


def _find_joints(model: mujoco.MjModel, finger: FingerNames, side: str) -> tuple[int, ...]:
    if len(finger.joints) not in {2, 3}:
        raise InputError(f"[{side}] names {len(finger.joints)} joints; a finger has 2 or 3, from the palm outwards")
    found = tuple(find_part(model, (Kind.mjOBJ_JOINT,), name, f"[{side}] joints")[1] for name in finger.joints)
    for name, joint in zip(finger.joints, found, strict=True):
        kind = JOINT_TYPES[model.jnt_type[joint]]
        if kind != "hinge":
            raise InputError(f"joint {name!r} is of type {kind}; joints of a finger are hinges (URDF: revolute)")
    return found


def check_chain(model: mujoco.MjModel, joints: tuple[int, ...], palm: int, side: str) -> None:
    """Refuse joints that do not follow each other from the palm outwards, and moving parts that are not named.

    Raises:
        InputError: the text says which joint.
    """
    bodies = [int(model.jnt_bodyid[joint]) for joint in joints]
    given = [model.joint(joint).name for joint in joints]
    if bodies[0] not in below(model, palm) or bodies[0] == palm:
        raise InputError(
            f"joint {given[0]!r} does not hang from the palm {model.body(palm).name!r}; name as palm the body that"
            " carries both fingers"
        )
    for i in range(len(joints) - 1):
        if bodies[i + 1] not in below(model, bodies[i]) or bodies[i + 1] == bodies[i]:
            raise InputError(
                f"joint {given[i + 1]!r} does not hang from the link of {given[i]!r}; name the joints of [{side}] from"
                " the palm outwards, each on its own body"
            )
    between = bodies_above(model, bodies[0], palm)
    for joint in range(model.njnt):
        body = int(model.jnt_bodyid[joint])
        if joint not in joints and (body in between or body in below(model, bodies[0])):
            raise InputError(
                f"joint {model.joint(joint).name!r} moves a part of the {side} finger and is not named; name it in"
                f" [{side}] joints, or make it fixed (URDF), or remove it (MJCF)"
            )


def _check_axes(model: mujoco.MjModel, data: mujoco.MjData, joints: tuple[int, ...], axes: Array) -> None:
    for joint in joints:
        lean = float(np.arccos(np.clip(abs(data.xaxis[joint] @ axes[2]), 0, 1)))
        if lean > AXIS_TOLERANCE:
            raise InputError(
                f"the axis of joint {model.joint(joint).name!r} leans {np.rad2deg(lean):.1f} deg from the palm's z"
                f" axis, allowed are {np.rad2deg(AXIS_TOLERANCE):g} deg: name with palm_x and palm_y the axes of the"
                " palm's body that point right and away from the palm, or use a planar hand"
            )


def tip_place(model: mujoco.MjModel, data: mujoco.MjData, joint: int, name: str, side: str) -> Array:
    """Return where a tip is in the world `(3,)` [m].

    Raises:
        InputError: no such body or site, or one that is not on the link of a joint.
    """
    kind, number = find_part(model, (Kind.mjOBJ_BODY, Kind.mjOBJ_SITE), name, f"[{side}] tip")
    body = number if kind == Kind.mjOBJ_BODY else int(model.site_bodyid[number])
    if model.body_weldid[body] != model.jnt_bodyid[joint]:
        raise InputError(
            f"the tip {name!r} is not fixed to the link of {model.joint(joint).name!r}, the last joint of [{side}];"
            " name a body or site on that link"
        )
    return np.array(data.xpos[number] if kind == Kind.mjOBJ_BODY else data.site_xpos[number])


def check_free(model: mujoco.MjModel, joints: list[int]) -> None:
    """Refuse joints that are coupled to others, and links that are tied by a constraint.

    Raises:
        InputError: the text says which.
    """
    for e in range(model.neq):
        first, second = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        if model.eq_type[e] != mujoco.mjtEq.mjEQ_JOINT:
            raise InputError(
                f"the file ties parts together with an equality constraint (number {e}); every joint of a hand has a"
                " motor of its own: remove the constraint"
            )
        coupled = [model.joint(joint).name for joint in (first, second) if joint in joints]
        if coupled:
            raise InputError(
                f"joint {' and '.join(map(repr, coupled))} is coupled to another (URDF: mimic; MJCF: equality); every"
                " joint of a hand has a motor of its own: remove the coupling"
            )


def below(model: mujoco.MjModel, body: int) -> set[int]:
    """Return a body and all that hang from it; bodies are numbered parents first."""
    found = {body}
    for b in range(body + 1, model.nbody):
        if int(model.body_parentid[b]) in found:
            found.add(b)
    return found


def bodies_above(model: mujoco.MjModel, body: int, end: int) -> set[int]:
    """Return the bodies that carry a body, up to `end`, which is left out."""
    found: set[int] = set()
    parent = int(model.body_parentid[body])
    while parent not in {0, end}:
        found.add(parent)
        parent = int(model.body_parentid[parent])
    return found
