"""A PyBullet world of a hand and an object, built from the same specs and outlines as the MuJoCo model.

Frames, heights and the pairs of bodies that can touch are those of `inhand.sim.model`. PyBullet multiplies the
friction coefficients of two bodies by itself. Its servos are those of `bullet_servo`.
"""

import importlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from types import ModuleType

import numpy as np

from inhand.errors import needs_extra
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, convex_pieces
from inhand.hands.outlines import centroid, second_moments, signed_area
from inhand.hands.polygons import edge_normals, is_box
from inhand.hands.shapes import link_outline, palm_outline
from inhand.sim.bullet_servo import FINER, LINKS, added_inertia
from inhand.sim.scene import SceneSpec

BASE = -1
"""PyBullet's number of a body's base; its links count from 0."""

HULL_MARGIN = 1e-3
"""PyBullet grows convex meshes by this on every side, with round corners [m]; its default, fixed for links."""

ITERATIONS = 50
"""Sweeps of PyBullet's solver in a step."""

HAND = 4e3, 20.0
"""Stiffness [N/m] and damping [N s/m] of each point that touches a link: fingertips, with two or more such points, lie
about as deep as in MuJoCo's scene (`benchmarks/matching.py`)."""
FLOOR = 1.4e5, 60.0
"""The same of each point on the floor for each kilogram of an object [1/s^2, 1/s]: corners lie as deep as MuJoCo's.
On a hard floor upright forces of the fingers, up to a third of their grip, stay for good and press the object down."""

Part = tuple[int, int]
"""PyBullet's numbers of a body and of a link of it."""


@dataclass(frozen=True)
class World:
    """PyBullet's numbers of one world's connection and of the bodies in it."""

    client: int
    """The connection."""
    hand: int
    """The hand: its base is the palm, its links have the joints' order."""
    object: int
    """The object: its base is its first convex piece, its links are the others, fixed to it."""
    pieces: int
    """Number of the object's convex pieces."""
    middle: tuple[float, float]
    """Where the mass of the object's first piece is centred, in the object's frame [m]."""
    floor: int
    """The plane it stands on."""

    @cached_property
    def parts(self) -> list[Part]:
        """The parts of the object, one for each convex piece."""
        return [(self.object, link) for link in range(BASE, self.pieces - 1)]


def load_pybullet() -> ModuleType:
    """Return the module `pybullet`.

    Raises:
        InputError: it is not installed; the text names the extra that brings it.
    """
    try:
        return importlib.import_module("pybullet")
    except ImportError as error:
        raise needs_extra("bullet", "the engine PyBullet") from error


def build_world(engine: ModuleType, client: int, hand: HandSpec, spec: ObjectSpec, scene: SceneSpec) -> World:
    """Empty a connection, build plane, hand and object in it and return their numbers."""
    engine.resetSimulation(physicsClientId=client)
    engine.setPhysicsEngineParameter(
        fixedTimeStep=scene.timestep / FINER,
        numSolverIterations=ITERATIONS,
        # Its default ends the search at squared impulses of 1e-7, 5 % of a grip's in 4 ms: objects then creep away.
        solverResidualThreshold=0.0,
        deterministicOverlappingPairs=1,
        physicsClientId=client,
    )
    engine.setGravity(0, 0, -scene.gravity, physicsClientId=client)
    plane = engine.createCollisionShape(engine.GEOM_PLANE, physicsClientId=client)
    floor = engine.createMultiBody(0, plane, physicsClientId=client)
    palm = _add_hand(engine, client, hand, spec.height / 2)
    thing = _add_object(engine, client, spec)
    pieces = convex_pieces(spec)
    middle = np.array(spec.centre) + (centroid(pieces[0]) if spec.shape == "polygon" else 0.0)
    world = World(client, palm, thing, len(pieces), (float(middle[0]), float(middle[1])), floor)
    _finish(engine, client, (floor, BASE), scene.floor_friction)
    _soften(engine, client, (floor, BASE), [spec.mass * each for each in FLOOR])
    for part in world.parts:
        _finish(engine, client, part, spec.friction)
    for link in range(BASE, hand.n_joints):
        _finish(engine, client, (palm, link), hand.friction)
        _soften(engine, client, (palm, link), HAND)
    for link, (low, high) in enumerate(hand.limits):
        engine.changeDynamics(palm, link, jointLowerLimit=low, jointUpperLimit=high, physicsClientId=client)
    _free_joints(engine, client, palm, hand, scene.timestep)
    for (first, link), (second, other) in touching_pairs(world, hand):
        engine.setCollisionFilterPair(first, second, link, other, 1, physicsClientId=client)
    return world


def touching_pairs(world: World, hand: HandSpec) -> Iterator[tuple[Part, Part]]:
    """Yield the pairs of parts that can touch: those that the MuJoCo model declares."""
    fingers = [[(world.hand, link) for link in range(place.start, place.stop)] for place in hand.slices]
    palm, things = (world.hand, BASE), world.parts
    for finger in fingers:
        yield from ((link, thing) for link in finger for thing in things)
        yield from ((link, palm) for link in finger[1:])
    for one, other in combinations(fingers, 2):
        yield from product(one, other)
    for thing in things:
        yield palm, thing
        yield (world.floor, BASE), thing


def _add_object(engine: ModuleType, client: int, spec: ObjectSpec) -> int:
    """Add the object: one body, or of a polygon fixed links, each with the mass and inertia of its piece."""
    place = [0, 0.1, spec.height / 2]
    pieces = convex_pieces(spec)
    shapes, centres = zip(*(_prism(engine, client, piece, spec.height) for piece in pieces), strict=True)
    centres = tuple([x + spec.centre[0], y + spec.centre[1], z] for x, y, z in centres)
    if spec.shape != "polygon":
        middle = [*spec.centre, 0.0]
        body = spec.mass, shapes[0], -1, place
        return int(engine.createMultiBody(*body, baseInertialFramePosition=middle, physicsClientId=client))
    areas = np.array([signed_area(piece) for piece in pieces])
    masses, others = spec.mass * areas / areas.sum(), len(pieces) - 1
    thing = engine.createMultiBody(
        masses[0],
        shapes[0],
        basePosition=place,
        baseInertialFramePosition=centres[0],
        linkMasses=masses[1:].tolist(),
        linkCollisionShapeIndices=shapes[1:],
        linkVisualShapeIndices=[-1] * others,
        linkPositions=[[0, 0, 0]] * others,
        linkOrientations=[[0, 0, 0, 1]] * others,
        linkInertialFramePositions=centres[1:],
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * others,
        linkParentIndices=[0] * others,
        linkJointTypes=[engine.JOINT_FIXED] * others,
        linkJointAxis=[[0, 0, 1]] * others,
        physicsClientId=client,
    )
    for link, (piece, mass) in enumerate(zip(pieces, masses, strict=True), start=BASE):
        inertia = prism_inertia(piece, spec.height, float(mass))
        engine.changeDynamics(thing, link, localInertiaDiagonal=inertia, physicsClientId=client)
    return int(thing)


def prism_inertia(corners: Array, height: float, mass: float) -> list[float]:
    """Return the moments of inertia about x, y, z through the centre of an upright prism [kg m^2].

    With xx the mean of x^2 over the outline, and yy likewise, they are m (yy + h^2 / 12), m (xx + h^2 / 12) and
    m (xx + yy). PyBullet would take those of the bounding box.
    """
    xx, yy = np.diag(second_moments(corners))
    return [float(mass * moment) for moment in (yy + height**2 / 12, xx + height**2 / 12, xx + yy)]


def _add_hand(engine: ModuleType, client: int, hand: HandSpec, height: float) -> int:
    """Add the palm at a height [m] and the fingers on it; link frames are the joints', masses at outlines' centres."""
    shapes, centres, joints, parents = [], [], [], []
    for finger in hand.fingers:
        parent, joint = 0, [*finger.base, 0.0]
        for i, length in enumerate(finger.links):
            shape, centre = _prism(engine, client, link_outline(hand, finger, i), hand.thickness)
            shapes.append(shape)
            centres.append(centre)
            joints.append(joint)
            parents.append(parent)
            parent, joint = len(shapes), [0.0, length, 0.0]
    n, upright = hand.n_joints, [[0, 0, 0, 1]] * hand.n_joints
    palm, palm_centre = _prism(engine, client, palm_outline(hand), hand.thickness)
    return int(
        engine.createMultiBody(
            0,
            palm,
            basePosition=[0, 0, height],
            baseInertialFramePosition=palm_centre,
            linkMasses=[hand.mass(finger, i) for finger in hand.fingers for i in range(len(finger.links))],
            linkCollisionShapeIndices=shapes,
            linkVisualShapeIndices=[-1] * n,
            linkPositions=joints,
            linkOrientations=upright,
            linkInertialFramePositions=centres,
            linkInertialFrameOrientations=upright,
            linkParentIndices=parents,
            linkJointTypes=[engine.JOINT_REVOLUTE] * n,
            linkJointAxis=[[0, 0, 1]] * n,
            flags=engine.URDF_USE_SELF_COLLISION,
            physicsClientId=client,
        )
    )


def _free_joints(engine: ModuleType, client: int, palm: int, hand: HandSpec, timestep: float) -> None:
    """Take away PyBullet's motors, and give links their inertia and their share of what rotors and damping add."""
    links = [(finger, i) for finger in hand.fingers for i in range(len(finger.links))]
    for link, (finger, i) in enumerate(links):
        moments = np.array(prism_inertia(link_outline(hand, finger, i), hand.thickness, hand.mass(finger, i)))
        # About all three axes: no body has a moment above the sum of the others, and links turn about one alone.
        inertia = (moments + LINKS * added_inertia(hand, timestep)).tolist()
        engine.changeDynamics(palm, link, localInertiaDiagonal=inertia, physicsClientId=client)
        engine.setJointMotorControl2(palm, link, engine.VELOCITY_CONTROL, force=0.0, physicsClientId=client)


def _prism(engine: ModuleType, client: int, corners: Array, height: float) -> tuple[int, list[float]]:
    """Return the shape of an upright prism over a convex outline `(K, 2)` [m] and its centre of mass [m].

    Box shapes keep their size in PyBullet; other prisms are made smaller by the margin that it adds.
    """
    centre = centroid(corners)
    place = [*centre, 0.0]
    if is_box(corners):
        half = [*np.ptp(corners, axis=0) / 2, height / 2]
        box = engine.createCollisionShape(
            engine.GEOM_BOX, halfExtents=half, collisionFramePosition=place, physicsClientId=client
        )
        return box, place
    inner, top = _inset(corners, HULL_MARGIN) - centre, height / 2 - HULL_MARGIN
    vertices = np.concatenate([np.column_stack([inner, np.full(len(inner), z)]) for z in (-top, top)])
    hull = engine.createCollisionShape(
        engine.GEOM_MESH, vertices=vertices.tolist(), collisionFramePosition=place, physicsClientId=client
    )
    return hull, place


def _inset(corners: Array, distance: float) -> Array:
    """Return a convex polygon `(K, 2)`, counter-clockwise, with every edge moved inwards by a distance [m]."""
    after = edge_normals(corners)
    before = np.roll(after, 1, axis=0)
    return np.asarray(corners - distance * (before + after) / (1 + (before * after).sum(axis=-1, keepdims=True)))


def _soften(engine: ModuleType, client: int, part: Part, contact: Sequence[float]) -> None:
    """Give the contacts of a part with what is hard a stiffness [N/m] and a damping [N s/m]."""
    stiffness, damping = contact
    engine.changeDynamics(*part, contactStiffness=stiffness, contactDamping=damping, physicsClientId=client)


def _finish(engine: ModuleType, client: int, part: Part, friction: float) -> None:
    """Give a part its friction, take away PyBullet's air drag and let it touch nothing but declared partners."""
    body, link = part
    engine.changeDynamics(
        body,
        link,
        lateralFriction=friction,
        linearDamping=0.0,
        angularDamping=0.0,
        jointDamping=0.0,
        physicsClientId=client,
    )
    engine.setCollisionFilterGroupMask(body, link, 0, 0, physicsClientId=client)
