"""Walls: what a spec may be, where they stand, and that object and fingers run against them."""

import re
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest

from inhand.control.catalogue import planned_grasp
from inhand.control.controller import Task
from inhand.control.ik import IkController
from inhand.errors import InputError
from inhand.geometry import Array, Path, perpendicular, transform, turn, unit
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.hands.objects import ObjectSpec, convex_pieces, polygon, polygon_object
from inhand.hands.polygons import is_box, separation
from inhand.hands.shapes import link_polygons
from inhand.sim.model import POINT, build_measuring_model, build_model
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.scene import SceneSpec
from inhand.sim.state import State
from inhand.sim.walls import Wall, clearance
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import primitive_at
from test_simulator import assert_same, run, shaken

HAND = parse_hand_name("2v2_50.50_50.50_1.1_53")
START = HAND.start_pose
CUBE = OBJECTS["cube_39"]
ASIDE = np.array([[2.5, 0.0, -2.5, 0.0]])
"""Joint angles that hold the fingers beside the palm, out of the way."""
FAR_AWAY = Wall((0.0, 0.9), -90.0)
every_object = pytest.mark.parametrize("spec", OBJECTS.values(), ids=OBJECTS.keys())


def facing(
    spec: ObjectSpec, pose: Array, angle_deg: float, gap: float, *, length: float = 0.1, friction: float = 0.5
) -> Wall:
    """Return the wall that lies in a direction from an object at a pose `(3,)` and looks at it from a gap [m]."""
    wall = Wall((float(pose[0]), float(pose[1])), angle_deg + 180.0, length=length, friction=friction)
    x, y = pose[:2] - (gap - clearance(wall, spec, pose[None])[0]) * wall.normal
    return replace(wall, middle=(float(x), float(y)))


def lean(state: State) -> Array:
    """Return how far each object is from upright `(B,)` [rad]."""
    up = turn(state.object_pose[:, 3:], np.tile([0.0, 0.0, 1.0], (state.n_worlds, 1)))
    return np.asarray(np.arccos(np.minimum(up[:, 2], 1.0)))


# The spec.


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"middle": (0.1, np.nan)}, "wall: middle [100, nan] mm; the middle of its face needs two finite numbers"),
        ({"middle": (0.1,)}, "wall: middle [100] mm; the middle of its face needs two finite numbers, x and y"),
        ({"middle": (0.1, 0.0, 0.0)}, "wall: middle [100, 0, 0] mm; the middle of its face needs two"),
        ({"normal_deg": np.inf}, "wall: normal_deg inf; the direction of its face must be a finite angle"),
        ({"length": 0.0}, "wall: length 0 mm; it must be a positive length"),
        ({"length": np.nan}, "wall: length nan mm; it must be a positive length"),
        ({"thickness": -0.01}, "wall: thickness -10 mm; it must be at least 1 mm, or corners of objects go through"),
        ({"thickness": 0.0009}, "wall: thickness 0.9 mm; it must be at least 1 mm, or corners of objects go through"),
        ({"thickness": np.inf}, "wall: thickness inf mm; it must be at least 1 mm"),
        ({"friction": -0.1}, "wall: friction -0.1; friction must be 0 or more"),
        ({"friction": np.nan}, "wall: friction nan; friction must be 0 or more"),
    ],
)
def test_walls_that_cannot_be_are_refused(changes: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        replace(FAR_AWAY, **changes)


def test_scenes_of_equal_walls_are_one_key() -> None:
    one, other = (SceneSpec(walls=(Wall((0.0, 0.1), -90.0), Wall((0.1, 0.0), 180.0, friction=0.0))) for _ in range(2))
    assert len({one, other, SceneSpec(walls=one.walls[:1]), SceneSpec(walls=one.walls[::-1]), SceneSpec()}) == 4


@pytest.mark.parametrize(
    ("angle", "corners"),
    [
        (90.0, [(30, 20), (-10, 20), (-10, 10), (30, 10)]),
        (0.0, [(10, 0), (10, 40), (0, 40), (0, 0)]),
        (-450.0, [(-10, 20), (30, 20), (30, 30), (-10, 30)]),
    ],
)
def test_the_outline_starts_with_the_face(angle: float, corners: list[tuple[int, int]]) -> None:
    wall = Wall((0.01, 0.02), angle, length=0.04, thickness=0.01)
    np.testing.assert_allclose(wall.outline, np.array(corners) / 1e3, atol=1e-12)
    np.testing.assert_allclose(wall.normal, unit(np.deg2rad(angle)))


# How far the object is from it.

ROOT = np.sqrt(0.5)


@pytest.mark.parametrize(
    ("name", "pose", "angle", "expected"),
    [
        ("cube_39", (0.0, 0.065, 0.0), -90.0, 0.035 - 0.0195),
        ("cube_39", (0.3, 0.065, 0.0), -90.0, 0.035 - 0.0195),
        ("cube_39", (0.0, 0.065, np.pi / 4), -90.0, 0.035 - 0.039 * ROOT),
        ("cube_39", (0.0, 0.065, np.pi / 2), -45.0, 0.035 * ROOT - 0.039 * ROOT),
        ("cube_39", (0.0, 0.065, np.pi / 4), -45.0, 0.035 * ROOT - 0.0195),
        ("cube_39", (0.0, 0.095, 0.0), -90.0, 0.005 - 0.0195),
        ("cube_39", (0.0, 0.15, 0.0), -90.0, -0.05 - 0.0195),
        ("rectangle_38x19", (0.02, 0.1, np.deg2rad(30)), 0.0, 0.02 - 0.0189 * np.sqrt(0.75) - 0.00945 / 2),
        ("cylinder_40", (0.0, 0.065, 0.3), -90.0, 0.015),
        ("cylinder_40", (0.0, 0.065, 1.7), -45.0, 0.035 * ROOT - 0.02),
        ("ellipse_40x25", (0.03, 0.1, np.pi / 2), 0.0, 0.03 - 0.0125),
        ("triangle", (0.0, 0.065, 0.0), -90.0, 0.035 - 0.0178),
        ("hourglass", (0.0, 0.065, 0.0), -90.0, 0.015),
    ],
)
def test_clearance_is_what_a_ruler_shows(
    name: str, pose: tuple[float, float, float], angle: float, expected: float
) -> None:
    """The middle of every face is at (0, 100) mm."""
    for length in (0.01, 0.1):
        found = clearance(Wall((0.0, 0.1), angle, length), OBJECTS[name], np.array([pose, pose]))
        tolerance = 3e-5 if name.startswith("ellipse") else 1e-9  # an ellipse has 48 corners, as in the engine
        np.testing.assert_allclose(found, [expected, expected], atol=tolerance)


@every_object
def test_clearance_is_the_separation_from_a_wall_without_ends(spec: ObjectSpec) -> None:
    rng = np.random.default_rng(5)
    poses = np.column_stack([rng.uniform(-0.1, 0.1, (50, 2)), rng.uniform(-4, 4, 50)])
    for angle in (0.0, 77.0, -130.0):
        wall = Wall((0.02, -0.03), angle, length=100.0, thickness=100.0)
        pieces = (polygon(spec, 720),) if spec.shape == "cylinder" else convex_pieces(spec)
        apart = np.min([separation(wall.outline, transform(poses[:, None], piece)) for piece in pieces], axis=0)
        np.testing.assert_allclose(clearance(wall, spec, poses), apart, atol=3e-7)


@every_object
def test_the_engine_sees_the_wall_where_clearance_does(spec: ObjectSpec) -> None:
    wall = facing(spec, START, 70.0, 0.02)
    for change in ((0.0, 0.0, 0.0), (0.01, 0.0, 0.2), (-0.01, -0.01, -0.5)):
        pose = START + np.array(change)
        model = build_model(HAND, spec, SceneSpec(walls=(FAR_AWAY, wall)))
        data = placed(model, spec, pose, ASIDE[0])
        expected = clearance(wall, spec, pose[None])[0]
        assert expected > 0
        pieces = [g for g in range(model.ngeom) if model.geom(g).name.startswith("object")]
        for name in ("wall_1", "wall_1_low", "wall_1_high"):
            found = min(mujoco.mj_geomDistance(model, data, model.geom(name).id, g, 1.0, None) for g in pieces)
            assert found == pytest.approx(expected, abs=2e-6)


def placed(model: mujoco.MjModel, spec: ObjectSpec, pose: Array, joints: Array) -> mujoco.MjData:
    """Return the data of a model with joints at angles `(n,)` and its object upright at a pose `(3,)`."""
    data = mujoco.MjData(model)
    half = pose[2] / 2
    data.qpos[:] = [*joints, *pose[:2], spec.height / 2, np.cos(half), 0.0, 0.0, np.sin(half)]
    mujoco.mj_forward(model, data)
    return data


# What the model is made of.


@every_object
def test_every_part_that_can_meet_a_wall_is_declared(spec: ObjectSpec) -> None:
    spec = replace(spec, friction=0.8)
    walls = (Wall((0.0, 0.12), -90.0, friction=0.3), replace(FAR_AWAY, friction=0.9))
    plain, model = build_model(HAND, spec, SceneSpec()), build_model(HAND, spec, SceneSpec(walls=walls))
    pairs = {
        (model.geom(one).name, model.geom(other).name): (model.pair_friction[k], model.pair_solref[k])
        for k, (one, other) in enumerate(zip(model.pair_geom1, model.pair_geom2, strict=True))
    }
    named = {frozenset(pair): values for pair, values in pairs.items()}
    assert len(named) == model.npair
    expected = plain.npair
    for number, wall in enumerate(walls):
        with_object = []
        for name, piece in zip(pieces_of(spec), convex_pieces(spec), strict=True):
            parts = (f"wall_{number}",) if is_box(piece) else (f"wall_{number}_low", f"wall_{number}_high")
            with_object += [(part, name) for part in parts]
        with_object += [(f"wall_{number}", point) for point in points_of(spec)]
        with_links = [(f"wall_{number}", link) for link in ("left_0", "left_1", "right_0", "right_1")]
        for meeting, friction in ((with_object, 0.8), (with_links, HAND.friction)):
            for pair in meeting:
                found, solref = named[frozenset(pair)]
                np.testing.assert_allclose(found[:2], wall.friction * friction)
                np.testing.assert_array_equal(solref, plain.pair_solref[0])
        expected += len(with_object) + len(with_links)
    assert model.npair == expected


def pieces_of(spec: ObjectSpec) -> list[str]:
    return ["object", *(f"object_{k}" for k in range(1, len(convex_pieces(spec))))]


def points_of(spec: ObjectSpec) -> list[str]:
    if spec.shape != "polygon":
        return []
    return [f"corner_{k}_{side}" for k in range(len(spec.corners)) for side in ("low", "high")]


@every_object
def test_walls_stand_still_from_the_floor_to_above_everything_and_weigh_nothing(spec: ObjectSpec) -> None:
    wall = Wall((0.03, 0.14), -110.0, length=0.07, thickness=0.012)
    flat = replace(spec, size=(*spec.size[:2], 0.02))
    for thing in (spec, flat):
        plain, model = build_model(HAND, thing, SceneSpec()), build_model(HAND, thing, SceneSpec(walls=(wall,)))
        for name in ("body_mass", "body_inertia", "body_ipos", "body_iquat"):
            np.testing.assert_array_equal(getattr(model, name), getattr(plain, name), name)
        data = placed(model, thing, START, ASIDE[0])
        for name in ("wall_0", "wall_0_low", "wall_0_high"):
            geom = model.geom(name)
            assert geom.bodyid == 0
            corners = np.array([(1, -1), (1, 1), (-1, 1), (-1, -1)]) * geom.size[:2]
            axes = data.geom(name).xmat.reshape(3, 3)
            np.testing.assert_allclose(corners @ axes[:2, :2].T + geom.pos[:2], wall.outline, atol=1e-12)
        box = model.geom("wall_0")
        assert box.pos[2] - box.size[2] == pytest.approx(0.0, abs=1e-12)
        assert box.pos[2] + box.size[2] > max(thing.height, (thing.height + HAND.thickness) / 2)
        for k, point in enumerate(points_of(thing)):
            expected = transform(START, np.array(polygon(thing)[k // 2]))
            np.testing.assert_allclose(data.geom(point).xpos[:2], expected, atol=1e-12)
            assert model.geom(point).size[0] == POINT


def test_the_measuring_model_has_no_wall() -> None:
    plain, walled = (build_measuring_model(HAND, CUBE, SceneSpec(walls=walls)) for walls in ((), (FAR_AWAY,)))
    assert walled.ngeom == plain.ngeom
    assert walled.nsensordata == plain.nsensordata


# What runs against it.


def slide(spec: ObjectSpec, wall: Wall, pose: Array, velocity: Array, steps: int) -> list[State]:
    """Return the states, one for each physics step, of an object that slides freely with a velocity `(2,)` [m/s]."""
    simulator = MujocoSimulator(HAND, [spec], SceneSpec(walls=(wall,), floor_friction=0.0), threads=1)
    simulator.reset(pose[None], ASIDE)
    snapshot, world = simulator.snapshot(), np.zeros(1, dtype=np.int64)
    snapshot.qvel[:, HAND.n_joints : HAND.n_joints + 2] = velocity
    simulator.restore(world, snapshot, world)
    return [simulator.measure(), *(simulator.step(ASIDE, 1) for _ in range(steps))]


def velocities(states: list[State]) -> Array:
    return np.array([state.object_velocity[0, :2] for state in states])


SLIDING = pytest.mark.parametrize("name", ["cube_39", "cylinder_40", "triangle", "trapezoid", "hourglass"])


@SLIDING
@pytest.mark.parametrize("angle", [90.0, 0.0, -150.0])
def test_a_smooth_wall_takes_the_speed_into_it_and_no_other(name: str, angle: float) -> None:
    """The impulse acts along the normal: a change of speed along the face would come from another direction."""
    spec, pose = OBJECTS[name], np.array([0.05, 0.3, np.deg2rad(angle - 90)])
    wall = facing(spec, pose, angle, 0.0031, friction=0.0)
    along = perpendicular(wall.normal)
    states = slide(spec, wall, pose, -0.05 * wall.normal + 0.08 * along, 40)
    into, beside = -velocities(states) @ wall.normal, velocities(states) @ along
    assert into[0] == pytest.approx(0.05)
    assert -0.01 < into[-1] < 1e-4
    np.testing.assert_allclose(beside, 0.08, atol=5e-5)
    assert np.concatenate([clearance(wall, spec, state.pose) for state in states]).min() > -1.5e-4
    assert max(lean(state)[0] for state in states) < np.deg2rad(0.1)


@pytest.mark.parametrize("name", ["cube_39", "cylinder_40", "hourglass"])
def test_a_rough_wall_takes_speed_along_it_by_the_product_of_frictions(name: str) -> None:
    spec, pose = replace(OBJECTS[name], friction=0.5), np.array([0.05, 0.3, 0.0])
    wall = facing(spec, pose, 90.0, 0.0031, friction=0.8)
    states = slide(spec, wall, pose, np.array([0.2, 0.05]), 40)
    lost = velocities(states)[0] - velocities(states)[-1]
    assert lost[0] / lost[1] == pytest.approx(0.4, rel=0.01)


def carried(name: str, angle: float, walls: list[Wall]) -> tuple[list[State], float]:
    """Carry an object in a direction with the expert in a world for each wall; return the states and the way asked."""
    spec, count, line = OBJECTS[name], len(walls), straight_path(primitive_at(angle), 0.06)
    simulator = MujocoSimulator(HAND, [spec] * count, [SceneSpec(walls=(wall,)) for wall in walls])
    paths = np.tile(line.poses, (count, 1, 1))
    grasp = planned_grasp(HAND, spec, START + line.poses[None])
    closed = np.tile(grasp.closed, (count, 1))
    state = simulator.reset(np.tile(START, (count, 1)), closed)
    for _ in range(15):
        state = simulator.step(closed, 5)
    controller = IkController(Task(HAND, simulator.objects, Path(paths), 0.004))
    controller.begin(state)
    states = [state]
    for _ in range(80):
        states.append(simulator.step(controller.act(states[-1]), 5))
    return states, float(controller.limit.min())


@pytest.mark.parametrize(
    ("name", "angle", "gap"),
    [
        ("cube_39", 90.0, 0.020),
        ("cube_39", 60.0, 0.020),
        ("cube_39", 120.0, 0.025),
        ("cylinder_40", 90.0, 0.025),
        ("ellipse_40x25", 90.0, 0.025),
        ("triangle", 90.0, 0.020),
        ("hourglass", 90.0, 0.020),
        ("concave_square", 120.0, 0.020),
    ],
)
def test_a_grip_carries_the_object_to_the_face_and_no_farther(name: str, angle: float, gap: float) -> None:
    spec = OBJECTS[name]
    near = facing(spec, START, angle, gap)
    states, way = carried(name, angle, [near, FAR_AWAY])
    assert way > gap + 0.02
    room = np.stack([clearance(near, spec, state.pose) for state in states])
    assert room[0, 0] == pytest.approx(gap, abs=1.2e-3)
    assert room[-1, 1] < -0.018  # without the wall the object is past it
    arrived = int((room[:, 0] < 5e-4).argmax())
    assert 0 < arrived < 50
    assert np.abs(room[arrived:, 0]).max() < 5e-4
    for state in states:
        assert state.gaps[0].max() < 6e-4
        assert lean(state)[0] < np.deg2rad(0.5)
    assert all(state.touching.all() for state in states[-15:])


@pytest.mark.parametrize("link", [0, 1])
@pytest.mark.parametrize("finger", [0, 1])
def test_a_finger_stops_at_a_wall(link: int, finger: int) -> None:
    side, place = HAND.fingers[finger].bend, HAND.slices[finger]
    # The right finger points straight out and turns clockwise; walls beside its inner link and beside its tip.
    wall = Wall((side * (HAND.right.base[0] + 0.025), 0.03 if link == 0 else 0.085), 90 + side * 90, length=0.02)
    plain, walled = SceneSpec(walls=(FAR_AWAY,)), SceneSpec(walls=(wall,))
    simulator = MujocoSimulator(HAND, [CUBE] * 2, [plain, walled], threads=1)
    targets = np.zeros((2, HAND.n_joints))
    simulator.reset(np.tile([0.0, 0.4, 0.0], (2, 1)), targets)
    measured = []
    for angle in np.linspace(0.0, 0.8, 80):
        targets[:, place.start] = -side * angle
        measured.append(meets(simulator.step(targets, 5), wall, finger))
    depth = np.stack(measured)
    assert depth[:, 0].min() < -0.005
    assert -5e-4 < depth[:, 1].min() < 1e-4
    assert abs(depth[-1, 1]) < 5e-4


def meets(state: State, wall: Wall, finger: int) -> Array:
    """Return how far a finger's links are from a wall in every world `(B,)` [m]."""
    links = link_polygons(HAND, HAND.fingers[finger], state.joint_angles[:, HAND.slices[finger]])
    return np.asarray(np.min([separation(wall.outline, link) for link in links], axis=0))


@pytest.mark.parametrize("name", ["cube_39", "cylinder_40", "triangle", "hourglass"])
def test_the_edge_of_a_wall_stops_a_side_too(name: str) -> None:
    spec, pose = OBJECTS[name], np.array([0.0, 0.3, 0.0])
    post = facing(spec, pose, -90.0, 0.0031, length=0.004, friction=0.0)
    states = slide(spec, post, pose, np.array([0.0, -0.05]), 40)
    assert velocities(states)[-1, 1] > -1e-4
    for state in states:
        outlines = [transform(state.pose[0], piece) for piece in convex_pieces(spec)]
        assert min(float(separation(post.outline, outline)) for outline in outlines) > -1.5e-4
        assert lean(state)[0] < np.deg2rad(0.1)


# Many worlds.


@pytest.mark.parametrize("name", ["cube_39", "cylinder_40", "hourglass"])
def test_worlds_with_walls_in_other_places_share_a_simulator(name: str) -> None:
    spec, targets = OBJECTS[name], shaken(HAND, CUBE, 12, seed=3)
    walls = [
        (facing(spec, START, 90.0, 0.0001), FAR_AWAY),
        (FAR_AWAY, FAR_AWAY),
        (facing(spec, START, 60.0, 0.0001, length=0.05, friction=0.9), facing(spec, START, -90.0, 0.001)),
    ]
    scenes = [SceneSpec(walls=pair) for pair in walls]
    together = run(MujocoSimulator(HAND, [spec] * 3, scenes, threads=2), targets)
    for world, scene in enumerate(scenes):
        assert_same(run(MujocoSimulator(HAND, [spec], scene, threads=1), targets), together, slice(world, world + 1))
    plain = run(MujocoSimulator(HAND, [spec], threads=1), targets)
    assert_same(plain, together, slice(1, 2))  # walls out of reach change no byte
    ends = together[-1].pose
    assert np.abs(ends[[0, 2]] - ends[1]).max(axis=1).min() > 1e-5


def test_objects_of_other_sizes_share_a_simulator_with_walls() -> None:
    wide = OBJECTS["triangle"]
    other = polygon_object("other", [(0.0, 0.0), (0.04, 0.0), (0.01, 0.03)])
    specs = [wide, replace(wide, size=(0.03, 0.03, 0.06), mass=0.02), other]
    simulator = MujocoSimulator(HAND, specs, [SceneSpec(walls=(facing(spec, START, 90.0, 0.01),)) for spec in specs])
    state = simulator.reset(np.tile(START, (3, 1)), ASIDE.repeat(3, axis=0))
    assert not state.diverged.any()


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 0), (0, 2, 1), (0, 0, 1)])
def test_scenes_of_other_numbers_of_walls_need_a_simulator_each(order: tuple[int, ...]) -> None:
    scenes = [SceneSpec(walls=(FAR_AWAY,) * number) for number in order]
    given = " and of ".join(str(number) for number in sorted(set(order)))
    text = f"scenes of {given} walls in one simulator; give every scene as many (a wall out of reach does nothing), or"
    with pytest.raises(InputError, match=re.escape(text)):
        MujocoSimulator(HAND, [CUBE] * 3, scenes)
