"""Objects over any outline in the engines: mass, contacts and gaps of all their convex pieces."""

from dataclasses import fields, replace
from itertools import combinations

import mujoco
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from brute_contacts import nearest_contact
from inhand.control.catalogue import planned_grasp
from inhand.errors import InputError
from inhand.geometry import Array, cross, inverse_transform, rotate, transform, unit
from inhand.hands.convex import convex_parts
from inhand.hands.grasp_search import plan_grasps
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE, ObjectSpec, convex_pieces, polygon, polygon_object
from inhand.hands.outlines import signed_area
from inhand.hands.polygons import separation
from inhand.hands.rolling import Starts, roll
from inhand.hands.shapes import link_polygons
from inhand.sim.bullet_engine import BulletSimulator
from inhand.sim.bullet_model import build_world, load_pybullet, prism_inertia
from inhand.sim.bullet_servo import FINER
from inhand.sim.engine import Simulator
from inhand.sim.model import build_measuring_model, build_model
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.scene import SceneSpec
from inhand.sim.state import State

HAND = parse_hand_name("2v2_50.50_50.50_1.1_53")
START = HAND.start_pose
ELL = polygon_object("ell", [(x / 1e3, y / 1e3) for x, y in ((0, 0), (45, 0), (45, 15), (15, 15), (15, 40), (0, 40))])
POLYGONS = [*(spec for spec in CATALOGUE.values() if spec.shape == "polygon"), ELL]
every_polygon = pytest.mark.parametrize("spec", POLYGONS, ids=lambda spec: spec.name)


def moments(corners: Array) -> tuple[float, Array, Array]:
    """Area [m^2], centre `(2,)` [m] and second moments about it `(2, 2)` [m^4] of a polygon, by Green's theorem."""
    a, b = corners, np.roll(corners, -1, axis=0)
    w = cross(a, b)
    area = w.sum() / 2
    centre = (w[:, None] * (a + b)).sum(axis=0) / (6 * area)
    second = (
        w[:, None, None]
        * sum(p[:, :, None] * q[:, None, :] * share for p, q, share in ((a, a, 2), (b, b, 2), (a, b, 1), (b, a, 1)))
    ).sum(axis=0) / 24
    return float(area), centre, second - area * np.outer(centre, centre)


def gripped(simulator: Simulator, spec: ObjectSpec, seconds: float) -> list[State]:
    """Close on the contacts that are planned for the way out in 0.4 s, hold them, and return the states while held."""
    path = START + np.stack([np.zeros(5), np.linspace(0, 0.01, 5), np.zeros(5)], axis=-1)
    grasp = planned_grasp(HAND, spec, path[None])
    simulator.reset(START[None], grasp.opened)
    for share in np.linspace(0.05, 1.0, 20):
        simulator.step(grasp.opened + share * (grasp.closed - grasp.opened), 5)
    return [simulator.step(grasp.closed, 5) for _ in range(round(seconds / 0.02))]


@every_polygon
def test_mass_centre_and_inertia_are_those_of_the_prism(spec: ObjectSpec) -> None:
    spec = replace(spec, mass=0.04)
    area, centre, second = moments(polygon(spec))
    for model in (build_model(HAND, spec, SceneSpec()), build_measuring_model(HAND, spec, SceneSpec())):
        body = model.body("object")
        np.testing.assert_allclose(body.mass, 0.04, rtol=1e-9)
        np.testing.assert_allclose(body.ipos, [*centre, 0.0], atol=1e-7)
        along = np.linalg.eigvalsh(second) / area + spec.height**2 / 12
        expected = 0.04 * np.array([*along, np.trace(second) / area])
        np.testing.assert_allclose(np.sort(body.inertia), np.sort(expected), rtol=1e-9)
        # The full matrix, turned back into the body's frame, has the products of inertia too.
        w, _, _, z = body.iquat
        axes = rotate(2 * np.arctan2(z, w), np.eye(2)).T
        in_plane = axes @ np.diag(body.inertia[:2]) @ axes.T / 0.04
        (xx, xy), (_, yy) = second / area
        np.testing.assert_allclose(in_plane - np.eye(2) * spec.height**2 / 12, [[yy, -xy], [-xy, xx]], atol=1e-9)
    assert np.abs(centre).max() > 1e-3 or spec.name in ("hourglass", "concave_square")


@every_polygon
def test_every_piece_touches_floor_palm_and_links(spec: ObjectSpec) -> None:
    model = build_model(HAND, spec, SceneSpec())
    pieces = ["object", *(f"object_{k}" for k in range(1, len(convex_pieces(spec))))]
    pairs = {
        frozenset((model.geom(one).name, model.geom(other).name))
        for one, other in zip(model.pair_geom1, model.pair_geom2, strict=True)
    }
    others = ("floor", "palm", "left_0", "left_1_low", "left_1_high", "right_0", "right_1_low", "right_1_high")
    assert {frozenset((piece, other)) for piece in pieces for other in others} <= pairs
    assert sum(any(name.startswith("object") for name in pair) for pair in pairs) == len(pieces) * len(others)


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (0.004, -0.006, 0.2), (0.0, 0.005, -1.2)])
@every_polygon
def test_gaps_are_those_of_the_outlines(spec: ObjectSpec, pose: tuple[float, float, float]) -> None:
    placed = START + np.array(pose)
    joints = np.array([0.95, -1.2, -0.9, 1.1])
    state = MujocoSimulator(HAND, [spec]).reset(placed[None], joints[None])
    links = [link for finger, p in zip(HAND.fingers, HAND.slices, strict=True)
             for link in link_polygons(HAND, finger, joints[p])]  # fmt: skip
    body = transform(placed, polygon(spec))
    for i, link in enumerate(links):
        np.testing.assert_allclose(state.link_gaps[0, i], apart(link, body), atol=2e-6)
    for side in range(2):
        link = links[2 * side + state.contact_links[0, side]]
        np.testing.assert_allclose(state.gaps[0, side], apart(link, body), atol=2e-6)
        assert from_edges(state.object_xy[0, side], body) < 2e-6
        assert from_edges(state.finger_xy[0, side], link) < 2e-6


def from_edges(point: Array, corners: Array) -> float:
    """Distance of a point `(2,)` to the nearest edge of a polygon `(K, 2)` [m]."""
    ways = np.roll(corners, -1, axis=0) - corners
    share = np.clip(((point - corners) * ways).sum(-1) / (ways * ways).sum(-1), 0, 1)
    return float(np.linalg.norm(point - corners - share[:, None] * ways, axis=-1).min())


def apart(first: Array, second: Array) -> float:
    """Distance of two outlines that do not overlap [m]: from the corners of each to the edges of the other."""
    return min(
        *(from_edges(corner, second) for corner in first),
        *(from_edges(corner, first) for corner in second),
    )


@pytest.mark.parametrize("engine", [MujocoSimulator, BulletSimulator])
@pytest.mark.parametrize("depth", [0.0, 0.002])
def test_a_fingertip_in_a_notch_reads_its_distance_to_the_notch(engine: type, depth: float) -> None:
    if engine is BulletSimulator:
        pytest.importorskip("pybullet", reason='PyBullet is an extra: pip install "inhand[bullet]"')
    spec = CATALOGUE["hourglass"]
    joints = np.array([0.72, -1.4, -0.72, 1.4])
    left, right = (link_polygons(HAND, f, joints[p])[-1] for f, p in zip(HAND.fingers, HAND.slices, strict=True))
    # The waist is level with the tips' innermost corners, so that each tip reaches over the wide ends' sides.
    tip = right[right[:, 0].argmin()]
    placed = np.array([tip[0] - 0.014 - 0.003 + depth, tip[1], 0.0])
    body = transform(placed, polygon(spec))
    state = engine(HAND, [spec]).reset(placed[None], joints[None])
    expected = apart(right, body)
    assert body[:, 0].max() > tip[0]  # the tip is inside the outline's hull
    assert 2e-4 < expected <= 0.003 - depth + 1e-9
    np.testing.assert_allclose(state.gaps[0, 1], expected, atol=5e-4 if engine is BulletSimulator else 2e-6)
    assert apart(left, body) > expected


@pytest.mark.parametrize("name", ["triangle", "teardrop", "pentagon", "trapezoid", "hourglass", "concave_square"])
def test_two_fingers_hold_an_object_of_any_outline_still(name: str) -> None:
    spec = CATALOGUE[name]
    states = gripped(MujocoSimulator(HAND, [spec]), spec, 1.0)
    assert all(state.touching.all() for state in states)
    still = np.abs(np.array([state.pose[0] for state in states[10:]]) - states[10].pose[0])
    assert still[:, :2].max() < 5e-4
    assert still[:, 2].max() < np.deg2rad(1.0)
    assert np.abs(states[-1].pose[0, :2] - START[:2]).max() < 6e-3


def test_a_rectangle_given_by_its_corners_moves_as_the_box() -> None:
    box = CATALOGUE["cube_39"]
    square = replace(box, shape="polygon", corners=tuple((float(x), float(y)) for x, y in polygon(box)))
    ours, theirs = (gripped(MujocoSimulator(HAND, [spec]), box, 0.2) for spec in (square, box))
    for field in fields(State):
        np.testing.assert_array_equal(getattr(ours[-1], field.name), getattr(theirs[-1], field.name), field.name)


@pytest.mark.parametrize("name", ["triangle", "concave_square"])
def test_polygons_of_other_sizes_and_outlines_share_a_simulator(name: str) -> None:
    spec = CATALOGUE[name]
    other = polygon_object("other", (np.array(spec.corners) * [1.0, 0.9]).tolist())
    specs = [spec, replace(spec, size=(0.03, 0.036, 0.1), mass=0.02), other]
    joints = np.array([0.9, -1.2, -0.9, 1.2])
    together = MujocoSimulator(HAND, specs)
    together.reset(np.tile(START, (3, 1)), np.tile(joints, (3, 1)))
    state = together.step(np.tile(joints, (3, 1)), 50)
    for world, spec in enumerate(specs):
        single = MujocoSimulator(HAND, [spec])
        single.reset(START[None], joints[None])
        alone = single.step(joints[None], 50)
        np.testing.assert_array_equal(state.link_gaps[world], alone.link_gaps[0])
        np.testing.assert_array_equal(state.object_pose[world], alone.object_pose[0])


def test_polygons_of_different_pieces_need_a_simulator_each() -> None:
    text = r"objects whose convex pieces are of 3 corners and of 4 corners \+ 4 corners in one simulator; use one"
    with pytest.raises(InputError, match=text):
        MujocoSimulator(HAND, [CATALOGUE[name] for name in ("hourglass", "triangle", "hourglass")])
    box = polygon_object("box", [(0, 0), (0.04, 0), (0.04, 0.03), (0, 0.03)])
    with pytest.raises(InputError, match="are of 4 corners and of a box in one simulator"):
        MujocoSimulator(HAND, [CATALOGUE["trapezoid"], box])
    square = CATALOGUE["concave_square"]
    lopsided = np.array(square.corners) * np.where(np.array(square.corners)[:, 1:] > 0.01, [0.8, 1.0], 1.0)
    with pytest.raises(InputError, match="one that is symmetric and one that is not: use one simulator for each"):
        MujocoSimulator(HAND, [square, polygon_object("lopsided", lopsided.tolist())])


def test_a_track_does_not_start_inside_a_piece_of_the_object() -> None:
    hand, spec = HAND, CATALOGUE["hourglass"]
    joints = np.array([[0.72, -1.4]])
    tip = link_polygons(hand, hand.left, joints[0])[-1]
    far = tip[tip[:, 0].argmax()]
    for inside, held in ((-0.0002, True), (0.002, False)):
        # The lower wide end's corner against the tip's innermost one.
        pose = np.array([[[far[0] + 0.02 - inside, far[1] + 0.02, 0.0]]])
        gap, point, _ = nearest_contact(tip, [transform(pose[0], piece) for piece in convex_pieces(spec)])
        assert (gap > -4e-4) == held
        points = rotate(0.0, point - pose[0, 0, :2])[None]
        assert roll(hand, hand.left, Starts(points, joints, convex_pieces(spec)), pose).held[0, 0] == held


def test_a_finger_rolls_along_a_notch_and_stays_off_the_other_piece() -> None:
    spec = CATALOGUE["concave_square"]
    steps = np.linspace(0, 0.02, 11)
    path = START + np.stack([steps * 0, steps, steps * 0], axis=-1)
    ((plan, *_),) = plan_grasps(HAND, spec, path[None])
    assert plan.reach == len(path)
    place = HAND.slices[0]
    pieces = convex_pieces(spec)
    simulator = MujocoSimulator(HAND, [spec])
    state = gripped(simulator, spec, 0.2)[-1]
    path = path + state.pose[0] - START  # closing the fingers has moved it a little
    starts = Starts(inverse_transform(state.pose, state.object_xy[:, 0]), state.joint_angles[:, place], pieces)
    tracks = roll(HAND, HAND.left, starts, path[None])
    for k in np.flatnonzero(tracks.held[0]):
        link = link_polygons(HAND, HAND.left, tracks.joints[0, k])[-1]
        gaps = [float(separation(link, transform(path[k], piece))) for piece in pieces]
        assert abs(min(gaps)) < 5e-4
    assert tracks.held[0].sum() >= 8


def test_the_witness_weighs_and_measures_every_piece() -> None:
    pytest.importorskip("pybullet", reason='PyBullet is an extra: pip install "inhand[bullet]"')
    poses = np.array([[*HAND.start_position, 0.0], [0.004, HAND.start_position[1] - 0.005, 0.7]])
    joints = np.tile([0.9, -0.6, -0.95, 0.7], (2, 1))
    for spec in POLYGONS[:-1]:
        ours, witness = (
            engine(HAND, [spec, spec]).reset(poses, joints) for engine in (MujocoSimulator, BulletSimulator)
        )
        np.testing.assert_allclose(witness.object_pose, ours.object_pose, atol=1e-9)
        np.testing.assert_allclose(witness.link_gaps, ours.link_gaps, atol=1.2e-3, err_msg=spec.name)  # round corners
    inertia = prism_inertia(polygon(ELL), ELL.height, 0.03)
    area, _, second = moments(polygon(ELL))
    (xx, _), (_, yy) = second / area
    expected = 0.03 * np.array([yy + 0.01 / 12, xx + 0.01 / 12, xx + yy])
    np.testing.assert_allclose(inertia, expected, rtol=1e-9)


@every_polygon
def test_the_witness_moves_the_prisms_mass_and_inertia(spec: ObjectSpec) -> None:
    pytest.importorskip("pybullet", reason='PyBullet is an extra: pip install "inhand[bullet]"')
    spec = replace(spec, mass=0.04)
    _, centre, second = moments(polygon(spec))
    area = signed_area(polygon(spec))
    (xx, _), (_, yy) = second / area
    thick, up = spec.height**2 / 12, np.array([0.0, 0.0, 1.0])
    for force, torque in ((up[[2, 0, 1]], 0 * up), (0 * up, 1e-3 * up)):
        linear, angular = kicked(spec, np.array([*centre, 0.0]), force, torque)
        np.testing.assert_allclose(spec.mass * linear, force * STEP, atol=1e-6, err_msg="mass")
        np.testing.assert_allclose(spec.mass * (xx + yy) * angular[2], torque[2] * STEP, atol=1e-9, err_msg="inertia")
    if len(convex_pieces(spec)) == 1:
        _, angular = kicked(spec, np.array([*centre, 0.0]), 0 * up, 1e-3 * up[[2, 0, 1]])
        np.testing.assert_allclose(spec.mass * (yy + thick) * angular[0], 1e-3 * STEP, rtol=1e-3)


STEP = 0.004
"""PyBullet's step of a kicked object [s]."""


def kicked(spec: ObjectSpec, centre: Array, force: Array, torque: Array) -> tuple[Array, Array]:
    """Return velocities `(3,)` that an object in free space has after a step under a force [N] and a torque [N m].

    The force acts at the centre of mass, whose velocity it is.
    """
    engine = load_pybullet()
    client = engine.connect(engine.DIRECT)
    world = build_world(engine, client, HAND, spec, SceneSpec(timestep=FINER * STEP, gravity=0.0))
    origin = np.array([0.0, 0.5, 0.5])
    base = origin + np.array([*world.middle, 0.0])
    engine.resetBasePositionAndOrientation(world.object, base.tolist(), [0, 0, 0, 1], physicsClientId=client)
    arm = origin + centre - base
    turning = torque + np.cross(arm, force)  # PyBullet takes both at the first piece
    engine.applyExternalForce(world.object, -1, force.tolist(), base.tolist(), engine.WORLD_FRAME, client)
    engine.applyExternalTorque(world.object, -1, turning.tolist(), engine.WORLD_FRAME, client)
    engine.stepSimulation(client)
    linear, angular = (np.array(v) for v in engine.getBaseVelocity(world.object, physicsClientId=client))
    engine.disconnect(client)
    return linear + np.cross(angular, arm), angular


@pytest.mark.parametrize("name", ["triangle", "hourglass"])
def test_an_object_off_its_centre_of_mass_stands_and_is_held_in_both_engines(name: str) -> None:
    pytest.importorskip("pybullet", reason='PyBullet is an extra: pip install "inhand[bullet]"')
    spec = CATALOGUE[name]
    witness = gripped(BulletSimulator(HAND, [spec]), spec, 0.5)
    assert all(state.touching.all() for state in witness)
    assert np.abs(witness[-1].pose[0, :2] - START[:2]).max() < 6e-3
    velocity = np.array([state.object_velocity[0] for state in witness])
    assert np.abs(velocity[-10:, :3]).max() < 0.02


def test_a_sensor_is_there_for_every_link_and_piece() -> None:
    model = build_measuring_model(HAND, CATALOGUE["concave_square"], SceneSpec())
    assert model.nsensordata == 4 * 3 * 7
    assert model.nsensor == 4 * 3 * 2
    assert model.sensor_type[0] == mujoco.mjtSensor.mjSENS_GEOMDIST


@pytest.mark.parametrize("seed", [6, 28, 39])
def test_no_two_pieces_of_an_outline_would_be_convex_together(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(8, 16))
    angle, radius = np.sort(rng.uniform(0, 2 * np.pi, count)), rng.uniform(0.4, 1, count)
    corners = radius[:, None] * unit(angle)
    pieces = convex_parts(corners)
    assert sum(map(signed_area, pieces)) == pytest.approx(signed_area(corners))
    for one, other in combinations(pieces, 2):
        whole = ConvexHull(np.concatenate([one, other])).volume  # in two dimensions its area
        assert whole > signed_area(one) + signed_area(other) + 1e-6
