"""The MuJoCo model of a hand and an object, built from their specs with MjSpec.

The world frame is the palm frame with its plane z = 0 on the floor. The fingers move at half the object's
height (guessed: the recordings do not say). Contacts are declared pair by pair, each with the product of both
bodies' friction coefficients, as in the thesis's engine.
"""

from __future__ import annotations

from itertools import chain, combinations, product

import mujoco
import numpy as np

from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, centre_of_mass, convex_pieces, polygon
from inhand.hands.outlines import second_moments
from inhand.hands.polygons import is_box
from inhand.hands.shapes import link_outline, palm_outline
from inhand.sim.scene import FAR, SceneSpec
from inhand.sim.walls import Wall

RIMS = ("low", "high")
"""The rims of a fingertip that touch the object, and the ribs of a wall."""
RIM_HEIGHT = 0.003
"""Half the height of a rim [m], guessed."""
RIM_TAPER = 0.97
"""Size of a rim's ends against its middle, guessed: steep enough that only the middle touches."""
WALL_MARGIN = 0.01
"""How far a wall stands above the object and the fingers [m], guessed."""
RIB_HEIGHT = 0.0005
"""Half the height of a wall's rib [m], guessed."""
POINT = 1e-6
"""Radius of the points on the corners of an object [m], guessed: far below the depth of a contact."""
NET_FORCE = 3
"""MuJoCo's number for contact sensors that add all forces up."""


def build_model(hand: HandSpec, spec: ObjectSpec, scene: SceneSpec) -> mujoco.MjModel:
    """Return the compiled model for stepping: finger joints in the hand's order, then the object's free joint."""
    return describe_model(hand, spec, scene).compile()


def describe_model(hand: HandSpec, spec: ObjectSpec, scene: SceneSpec) -> mujoco.MjSpec:
    """Return the model for stepping before it is compiled."""
    mj, links = _bodies(hand, spec, scene)
    _add_surroundings(mj, hand, spec)
    for finger, names in zip(hand.fingers, links, strict=True):
        _add_rims(mj, names[-1], link_outline(hand, finger, len(finger.links) - 1), hand.thickness)
    _add_pairs(mj, links, hand, spec, scene)
    _add_walls(mj, list(chain(*links)), hand, spec, scene)
    for names in links:
        add_force(mj, names[0])
    return mj


def build_measuring_model(hand: HandSpec, spec: ObjectSpec, scene: SceneSpec) -> mujoco.MjModel:
    """Return the same links and object, no contacts, but `LINK_SENSOR_SIZE` readings for every link and piece."""
    mj, links = _bodies(hand, spec, scene)
    mj.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    for name in list(chain(*links)):
        for piece in _piece_names(spec):
            for kind in (mujoco.mjtSensor.mjSENS_GEOMDIST, mujoco.mjtSensor.mjSENS_GEOMFROMTO):
                _add_distance(mj, kind, name, piece)
    return mj.compile()


def _bodies(hand: HandSpec, spec: ObjectSpec, scene: SceneSpec) -> tuple[mujoco.MjSpec, list[list[str]]]:
    mj = mujoco.MjSpec()
    mj.modelname = "inhand"
    mj.compiler.degree = False
    mj.option.timestep = scene.timestep
    mj.option.gravity = [0, 0, -scene.gravity]
    mj.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    mj.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    mj.option.impratio = 10
    # Several contacts of one pair would be clipped between nearly parallel faces and take a facet's normal, up to
    # 6 deg off the face it rests on (4.0.1): a frictionless grip shot the cube out. One contact has the true normal.
    flags = mujoco.mjtDisableBit
    mj.option.disableflags = int(flags.mjDSBL_AUTORESET) | int(flags.mjDSBL_MULTICCD)
    links = [_add_finger(mj, hand, index, spec.height / 2) for index in range(len(hand.fingers))]
    _add_object(mj, spec)
    return mj, links


def _add_surroundings(mj: mujoco.MjSpec, hand: HandSpec, spec: ObjectSpec) -> None:
    world = mj.worldbody
    add_geom(world, "floor", mujoco.mjtGeom.mjGEOM_PLANE, [0.5, 0.5, 0.01])
    _add_prism(mj, world, "palm", palm_outline(hand), height=hand.thickness, mass=0.0, middle=spec.height / 2)


def _add_finger(mj: mujoco.MjSpec, hand: HandSpec, index: int, height: float) -> list[str]:
    """Add one finger's bodies, joints and servos; return the names of its links."""
    finger, names = hand.fingers[index], []
    parent, position = mj.worldbody, [*finger.base, height]
    for i, length in enumerate(finger.links):
        name = f"{hand.finger_names[index]}_{i}"
        body = parent.add_body(name=name, pos=position)
        joint = body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        joint.range = finger.limits[i]
        joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.armature = hand.armature
        joint.damping = [hand.damping, 0, 0]
        mass = hand.mass(finger, i)
        _add_prism(mj, body, name, link_outline(hand, finger, i), height=hand.thickness, mass=mass)
        servo = mj.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=hand.stiffness)
        servo.forcerange = [-hand.torque, hand.torque]
        servo.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
        parent, position = body, [0, length, 0]
        names.append(name)
    return names


def _piece_names(spec: ObjectSpec) -> list[str]:
    """Return the names of an object's geoms, one for each convex piece; the first is called object."""
    return ["object", *(f"object_{k}" for k in range(1, len(convex_pieces(spec))))]


def _add_object(mj: mujoco.MjSpec, spec: ObjectSpec) -> None:
    body = mj.worldbody.add_body(name="object", pos=[0, 0.1, spec.height / 2])
    body.add_freejoint(name="object")
    half = [s / 2 for s in spec.size]
    if spec.shape == "box":
        add_geom(body, "object", mujoco.mjtGeom.mjGEOM_BOX, half, mass=spec.mass)
    elif spec.shape == "cylinder":
        add_geom(body, "object", mujoco.mjtGeom.mjGEOM_CYLINDER, [half[0], half[2], 0], mass=spec.mass)
    else:
        for name, piece in zip(_piece_names(spec), convex_pieces(spec), strict=True):
            _add_prism(mj, body, name, piece, height=spec.height, mass=spec.mass)
        if spec.shape == "polygon" and not is_box(polygon(spec)) and not any(spec.centre):
            _set_inertia(body, spec)
    if any(spec.centre):
        _set_inertia(body, spec)


def _set_inertia(body: mujoco.MjsBody, spec: ObjectSpec) -> None:
    """Give a body the mass, centre of mass and principal moments of inertia of an upright prism.

    MuJoCo would add those of the pieces; their rounding decides whether it takes a symmetric body for a simple one,
    and bodies of both kinds cannot share a batch.
    """
    middle = centre_of_mass(spec)
    round_moments = np.eye(2) * spec.size[0] ** 2 / 16
    (xx, xy), (_, yy) = round_moments if spec.shape == "cylinder" else second_moments(polygon(spec))
    angle = 0.5 * np.arctan2(2 * xy, xx - yy) if abs(xy) > 1e-9 * (xx + yy) else 0.0
    c, s = np.cos(angle), np.sin(angle)
    along, across = xx * c * c + 2 * xy * c * s + yy * s * s, xx * s * s - 2 * xy * c * s + yy * c * c
    thick = spec.height**2 / 12
    body.explicitinertial = True
    body.mass = spec.mass
    body.ipos = [*np.where(np.abs(middle) > 1e-9, middle, 0.0), 0.0]
    body.iquat = [np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)]
    body.inertia = spec.mass * np.array([across + thick, along + thick, along + across])


def _add_prism(
    mj: mujoco.MjSpec,
    body: mujoco.MjsBody,
    name: str,
    corners: Array,
    *,
    height: float,
    mass: float,
    middle: float = 0.0,
) -> None:
    """Add an upright prism over a convex outline `(K, 2)` [m], its middle at a height; a box where it is one."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    if is_box(corners):
        half = [*(high - low) / 2, height / 2]
        add_geom(body, name, mujoco.mjtGeom.mjGEOM_BOX, half, mass=mass, pos=[*(high + low) / 2, middle])
        return
    mesh = mj.add_mesh(name=name)
    mesh.uservert = np.concatenate([_at_height(corners, z) for z in (-height / 2, height / 2)]).ravel()
    geom = add_geom(body, name, mujoco.mjtGeom.mjGEOM_MESH, None, mass=mass, pos=[0, 0, middle])
    geom.meshname = name


def _add_rims(mj: mujoco.MjSpec, name: str, corners: Array, thickness: float) -> None:
    """Add two massless rims to a fingertip, near its top and bottom; one contact each keeps the object upright.

    A rim is the outline with a shrunken copy above and below it, so that it touches at one known height.
    """
    inner = corners.mean(axis=0) + RIM_TAPER * (corners - corners.mean(axis=0))
    for side, height in zip(RIMS, (RIM_HEIGHT - thickness / 2, thickness / 2 - RIM_HEIGHT), strict=True):
        mesh = mj.add_mesh(name=f"{name}_{side}")
        layers = ((inner, height - RIM_HEIGHT), (corners, height), (inner, height + RIM_HEIGHT))
        mesh.uservert = np.concatenate([_at_height(outline, z) for outline, z in layers]).ravel()
        geom = add_geom(mj.body(name), f"{name}_{side}", mujoco.mjtGeom.mjGEOM_MESH, None)
        geom.meshname = f"{name}_{side}"


def _at_height(corners: Array, height: float) -> Array:
    return np.column_stack([corners, np.full(len(corners), height)])


def add_geom(
    body: mujoco.MjsBody,
    name: str,
    kind: mujoco.mjtGeom,
    size: list[float] | None,
    *,
    mass: float = 0.0,
    pos: list[float] | None = None,
) -> mujoco.MjsGeom:
    """Add a shape to a body that touches only what pairs say, and return it."""
    geom = body.add_geom(name=name, type=kind, contype=0, conaffinity=0, mass=mass, pos=pos or [0, 0, 0])
    if size is not None:
        geom.size = size
    return geom


def _add_pairs(mj: mujoco.MjSpec, links: list[list[str]], hand: HandSpec, spec: ObjectSpec, scene: SceneSpec) -> None:
    grip, pieces = hand.friction * spec.friction, _piece_names(spec)
    for finger in links:
        for name in (*finger[:-1], *(f"{finger[-1]}_{side}" for side in RIMS)):
            for piece in pieces:
                _pair(mj, name, piece, grip, scene)
        for name in finger[1:]:
            _pair(mj, name, "palm", hand.friction**2, scene)
    for one, other in combinations(links, 2):
        for first, second in product(one, other):
            _pair(mj, first, second, hand.friction**2, scene)
    for piece in pieces:
        _pair(mj, "palm", piece, grip, scene)
        _pair(mj, "floor", piece, scene.floor_friction * spec.friction, scene)


def _add_walls(mj: mujoco.MjSpec, links: list[str], hand: HandSpec, spec: ObjectSpec, scene: SceneSpec) -> None:
    """Add the walls, each a box with two ribs in its face, and what they touch.

    Objects that are no boxes would have one contact with a box, anywhere on a side that lies on its face, and tip or
    rock. They touch the ribs instead, low and high, and polygons the box with points on their corners as well.
    """
    points = _add_points(mj, spec) if scene.walls and spec.shape == "polygon" and not is_box(polygon(spec)) else []
    top = max(spec.height, (spec.height + hand.thickness) / 2) + WALL_MARGIN
    for number, wall in enumerate(scene.walls):
        name = f"wall_{number}"
        ribs = [f"{name}_{side}" for side in RIMS]
        _add_wall_box(mj, name, wall, (0.0, top))
        for rib, height in zip(ribs, _rib_heights(spec), strict=True):
            _add_wall_box(mj, rib, wall, (height - RIB_HEIGHT, height + RIB_HEIGHT))
        for link in links:
            _pair(mj, name, link, wall.friction * hand.friction, scene)
        touching = [(name, point) for point in points]
        for piece, corners in zip(_piece_names(spec), convex_pieces(spec), strict=True):
            touching += [(part, piece) for part in ([name] if is_box(corners) else ribs)]
        for part, piece in touching:
            _pair(mj, part, piece, wall.friction * spec.friction, scene)


def _rib_heights(spec: ObjectSpec) -> tuple[float, float]:
    """Return the heights above the floor [m] at which an object that is no box touches walls."""
    return spec.height / 4, 3 * spec.height / 4


def _add_points(mj: mujoco.MjSpec, spec: ObjectSpec) -> list[str]:
    """Add massless points on the corners of a polygon, low and high; return their names."""
    names = []
    for number, corner in enumerate(polygon(spec)):
        for side, height in zip(RIMS, _rib_heights(spec), strict=True):
            names.append(f"corner_{number}_{side}")
            place = [*corner, height - spec.height / 2]
            add_geom(mj.body("object"), names[-1], mujoco.mjtGeom.mjGEOM_SPHERE, [POINT, 0, 0], pos=place)
    return names


def _add_wall_box(mj: mujoco.MjSpec, name: str, wall: Wall, heights: tuple[float, float]) -> None:
    """Add a box over a wall's outline between two heights [m]."""
    low, high = heights
    half = [wall.thickness / 2, wall.length / 2, (high - low) / 2]
    place = [*wall.outline.mean(axis=0), (low + high) / 2]
    geom = add_geom(mj.worldbody, name, mujoco.mjtGeom.mjGEOM_BOX, half, pos=place)
    angle = np.deg2rad(wall.normal_deg)
    geom.quat = [np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)]


def _pair(mj: mujoco.MjSpec, first: str, second: str, friction: float, scene: SceneSpec) -> None:
    pair = mj.add_pair(geomname1=first, geomname2=second, condim=3)
    floor = 1e-5  # MuJoCo's smallest friction
    pair.solref = [2 * scene.timestep, 1.0]  # the stiffest contact that this step can hold
    pair.friction = [max(friction, floor), max(friction, floor), floor, floor, floor]


def add_force(mj: mujoco.MjSpec, base: str) -> None:
    """Add a sensor of the net contact force that the links from `base` on put on the object, in palm axes [N]."""
    sensor = mj.add_sensor(type=mujoco.mjtSensor.mjSENS_CONTACT, objtype=mujoco.mjtObj.mjOBJ_XBODY, objname=base)
    sensor.reftype = mujoco.mjtObj.mjOBJ_XBODY
    sensor.refname = "object"
    sensor.intprm[:3] = [1 << int(mujoco.mjtConDataField.mjCONDATA_FORCE), NET_FORCE, 1]


def _add_distance(mj: mujoco.MjSpec, kind: mujoco.mjtSensor, link: str, piece: str) -> None:
    sensor = mj.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_GEOM, objname=link)
    sensor.reftype = mujoco.mjtObj.mjOBJ_GEOM
    sensor.refname = piece
    sensor.cutoff = FAR
