"""The MuJoCo model of a hand in space and the free object in it, built from their specs with MjSpec.

The world frame is the palm frame. There is no floor: gravity pulls along any vector of it, and until the fingers hold
the object a weld to a body that stands still does. Contacts are declared pair by pair, each with the product of both
bodies' friction coefficients. Three numbers keep a grip from creeping, which feedback would hide: cones are elliptic,
`IMPRATIO` is large, and contacts are nearly at their full stiffness from the first touch on (`SOLIMP`).
"""

import math
from itertools import combinations, product

import mujoco

from inhand.hands.spatial.hand import SpatialFinger, SpatialHand
from inhand.hands.spatial.objects import SolidSpec, inertia_of
from inhand.hands.spatial.start_contacts import gaps_of
from inhand.sim.model import add_force, add_geom
from inhand.sim.scene import PALM_UP, SceneSpec

IMPRATIO = 100.0
"""How much stiffer friction is than the normal force: at MuJoCo's own 1 a grip is lost in seconds, at 10 it creeps 0.7
mm/s, at 100 less than 0.1."""
SOLIMP = (0.95, 0.99, 0.001, 0.5, 2.0)
"""Impedance of contacts from the first touch to 1 mm of overlap, the width [m], and the curve between."""
TORSION, ROLLING = 0.003, 1e-4
"""Radii of the spot with which a fingertip touches, against spinning on it and rolling over it [m], guessed: a soft
tip's. With points the largest lateral errors of the expert are two to three times as large."""
SPOT = 4
"""MuJoCo's number of directions of a contact that resists spinning (3: one that does not)."""
OTHERS = 0.3
"""Friction of a finger on another, guessed."""
BALL = 1e-4
"""A capsule shorter than this is a ball [m]: MuJoCo refuses one without a length."""
HOLDER = "holder"
"""Name of the body that stands still, and of the weld to it."""


def build_spatial_model(hand: SpatialHand, spec: SolidSpec, scene: SceneSpec) -> mujoco.MjModel:
    """Return the compiled model: finger joints in the hand's order, then the object's free joint."""
    return describe_spatial_model(hand, spec, scene).compile()


def describe_spatial_model(hand: SpatialHand, spec: SolidSpec, scene: SceneSpec) -> mujoco.MjSpec:
    """Return the model before it is compiled."""
    mj = mujoco.MjSpec()
    mj.modelname = "inhand"
    mj.compiler.degree = False
    mj.option.timestep = scene.timestep
    mj.option.gravity = scene.pull or PALM_UP
    mj.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    mj.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    mj.option.impratio = IMPRATIO
    flags = mujoco.mjtDisableBit
    mj.option.disableflags = int(flags.mjDSBL_AUTORESET) | int(flags.mjDSBL_MULTICCD)
    add_geom(mj.worldbody, "palm", mujoco.mjtGeom.mjGEOM_BOX, list(hand.palm.half)).pos = hand.palm.centre
    parts = [_add_finger(mj, hand, finger, f"finger_{k}") for k, finger in enumerate(hand.fingers)]
    _add_object(mj, hand, spec, scene)
    _add_pairs(mj, parts, hand, spec, scene)
    for k in range(len(hand.fingers)):
        add_force(mj, f"finger_{k}_0")
    return mj


def _add_finger(mj: mujoco.MjSpec, hand: SpatialHand, finger: SpatialFinger, name: str) -> list[str]:
    """Add one finger's bodies, joints and servos; return the names of its geoms, the tip first."""
    parent, geoms = mj.worldbody, list[str]()
    for k, link in enumerate(finger.links):
        own = f"{name}_{k}"
        # The motors carry the links' weight: a servo without an integral part would sag by what they weigh.
        body = parent.add_body(name=own, pos=link.origin, quat=link.turn, gravcomp=1.0)
        joint = body.add_joint(name=own, type=mujoco.mjtJoint.mjJNT_HINGE, axis=link.axis)
        joint.range, joint.limited = link.limits, mujoco.mjtLimited.mjLIMITED_TRUE
        joint.armature, joint.damping = hand.armature, [hand.damping, 0, 0]
        body.explicitinertial = True
        body.mass, body.ipos, body.fullinertia = link.mass, link.centre, link.inertia
        for number, capsule in enumerate(link.capsules):
            geoms.append(f"{own}_{number}")
            size = [capsule.radius, 0, 0]
            if math.dist(capsule.start, capsule.end) < BALL:
                add_geom(body, geoms[-1], mujoco.mjtGeom.mjGEOM_SPHERE, size).pos = capsule.start
            else:
                geom = add_geom(body, geoms[-1], mujoco.mjtGeom.mjGEOM_CAPSULE, size)
                geom.fromto = [*capsule.start, *capsule.end]
        servo = mj.add_actuator(name=own, target=own, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=hand.stiffness)
        servo.forcerange, servo.forcelimited = [-hand.torque, hand.torque], mujoco.mjtLimited.mjLIMITED_TRUE
        parent = body
    add_geom(parent, f"{name}_tip", mujoco.mjtGeom.mjGEOM_SPHERE, [finger.tip_radius, 0, 0]).pos = finger.tip
    return [f"{name}_tip", *geoms]


def _add_object(mj: mujoco.MjSpec, hand: SpatialHand, spec: SolidSpec, scene: SceneSpec) -> None:
    """Add the object with its weld to a body that stands still, which each world lets go when it is held."""
    body = mj.worldbody.add_body(name="object", pos=hand.start_position)
    body.add_freejoint(name="object")
    kinds = {
        "box": (mujoco.mjtGeom.mjGEOM_BOX, list(spec.half)),
        "sphere": (mujoco.mjtGeom.mjGEOM_SPHERE, [spec.half[0], 0, 0]),
        "cylinder": (mujoco.mjtGeom.mjGEOM_CYLINDER, [spec.half[0], spec.half[2], 0]),
        "ellipsoid": (mujoco.mjtGeom.mjGEOM_ELLIPSOID, list(spec.half)),
    }
    if spec.mesh is None:
        add_geom(body, "object", *kinds[spec.shape])
    else:
        mesh = mj.add_mesh(name="object")
        mesh.uservert = [number for corner in spec.mesh.corners for number in corner]
        add_geom(body, "object", mujoco.mjtGeom.mjGEOM_MESH, None).meshname = "object"
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia_of(spec)
    body.explicitinertial = True
    # Without ipos the centre of mass would be at the body's own place in the palm frame (4.0.1).
    body.mass, body.ipos, body.fullinertia = spec.mass, spec.centre, [xx, yy, zz, xy, xz, yz]
    mj.worldbody.add_body(name=HOLDER, mocap=True, pos=hand.start_position)
    weld = mj.add_equality(name=HOLDER, type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY)
    weld.name1, weld.name2, weld.active = HOLDER, "object", True
    weld.data[:11] = [0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1]  # no offset, not turned, a radian counts as a metre
    weld.solref, weld.solimp = [2 * scene.timestep, 1.0], SOLIMP


def _add_pairs(mj: mujoco.MjSpec, parts: list[list[str]], hand: SpatialHand, spec: SolidSpec, scene: SceneSpec) -> None:
    grip = hand.friction * spec.friction
    for tip, *links in parts:
        _pair(mj, (tip, "object"), grip, scene, SPOT)
        for name in links:
            _pair(mj, (name, "object"), grip, scene)
    _pair(mj, ("palm", "object"), grip, scene)
    gaps = gaps_of(hand, 0.0, max(map(len, parts)))
    for i, j in combinations(range(len(parts)), 2):
        links, others = ([*names[1:], names[0]] for names in (parts[i], parts[j]))  # bodies have the tip last
        for (p, one), (q, other) in product(enumerate(links), enumerate(others)):
            if gaps[i, j, p, q] >= 0:  # knuckles that overlap in the straight hand may do so always
                _pair(mj, (one, other), OTHERS, scene)


def _pair(mj: mujoco.MjSpec, names: tuple[str, str], friction: float, scene: SceneSpec, directions: int = 3) -> None:
    pair = mj.add_pair(geomname1=names[0], geomname2=names[1], condim=directions)
    slip = max(friction, 1e-5)  # MuJoCo's smallest friction
    pair.friction = [slip, slip, TORSION, ROLLING, ROLLING]
    pair.solref = [2 * scene.timestep, 1.0]  # the stiffest contact that this step can hold
    pair.solimp = SOLIMP
