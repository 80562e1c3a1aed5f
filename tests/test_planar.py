"""The planar engine against MuJoCo with its object held in the plane, against laws, and alone against many."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from inhand import caches, geometry
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.run import prepare, simulate
from inhand.control import loop
from inhand.control.controller import Task
from inhand.control.loop import Bench
from inhand.control.trial import REACHED
from inhand.geometry import Array, rotate, wrap_angle
from inhand.hands.hand import HandSpec
from inhand.hands.names import CATALOGUE as HANDS
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE, ObjectSpec, centre_of_mass, polygon, polygon_object
from inhand.sim.engines import make_simulator
from inhand.sim.model import describe_model
from inhand.sim.planar import engine as planar_engine
from inhand.sim.planar.build import build, friction_arm
from inhand.sim.planar.engine import PlanarSimulator
from inhand.sim.scene import SUBSTEPS, SceneSpec
from inhand.sim.state import State
from inhand.sim.walls import Wall
from inhand.tasks.paths import stacked
from test_simulator import HAND, assert_same, grip, mirrored_joints, open_hand, other_side, run, shaken, start_pose

CUBE = CATALOGUE["cube_39"]
PAIRS = (
    ("2v2_50.50_50.50_1.1_53", "cube_39"),
    ("2v2_50.50_50.50_1.1_53", "cylinder_40"),
    ("2v2_50.50_50.50_1.1_53", "pentagon"),
    ("2v2_50.50_50.50_1.1_53", "concave_square"),
    ("2v2_70.30_50.50_0.9.1_53", "ellipse_40x25"),
    ("2v2_70.30_50.50_0.9.1_53", "hourglass"),
    ("2v2_35.65_50.50_1.1_63", "rectangle_33x22"),
    ("2v3_25.75_25.35.40_1.1_53", "square_44"),
    ("3v3_40.30.30_40.30.30_1.1_53", "triangle"),
    ("2v2_70.30_70.30_1.1_53", "trapezoid"),
)


class Reference:
    """MuJoCo's own model of a world, its object on two slides and a hinge with the floor's friction in them."""

    def __init__(self, hand: HandSpec, spec: ObjectSpec, scene: SceneSpec) -> None:
        """Build it from the model of three dimensions."""
        mj, loss = describe_model(hand, spec, scene), build([(hand, spec, scene)]).loss[0]
        for pair in [pair for pair in mj.pairs if "floor" in {pair.geomname1, pair.geomname2}]:
            mj.delete(pair)
        mj.delete(mj.joint("object"))
        body = mj.body("object")
        body.pos = [0.0, 0.0, spec.height / 2]
        slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
        for name, kind, axis, most in zip("xyz", (slide, slide, hinge), np.eye(3), loss, strict=True):
            joint = body.add_joint(name=name, type=kind, axis=axis, pos=[*centre_of_mass(spec), 0.0])
            joint.frictionloss, joint.solref_friction = float(most), [2 * scene.timestep, 1.0]
        self.model, self.n = mj.compile(), hand.n_joints
        self.model.body_invweight0[self.model.body("object").id, 0] = 1 / spec.mass  # as the free body's
        self.model.opt.ccd_tolerance, self.model.opt.ccd_iterations = 1e-12, 500
        self.data = mujoco.MjData(self.model)
        self.offset = centre_of_mass(spec)

    def begin(self, pose: Array, joints: Array) -> None:
        """Put the object at a pose `(3,)` and the joints at angles `(n,)`, at rest."""
        shift = rotate(pose[2], self.offset) - self.offset
        self.data.qpos[:] = [*joints, *(pose[:2] + shift), pose[2]]

    def step(self, targets: Array, substeps: int) -> None:
        """Hold targets `(n,)` for some physics steps."""
        self.data.ctrl[:] = targets
        mujoco.mj_step(self.model, self.data, substeps)
        mujoco.mj_kinematics(self.model, self.data)

    @property
    def pose(self) -> Array:
        """Pose of the object `(3,)`."""
        return np.array([*self.data.body("object").xpos[:2], self.data.qpos[self.n + 2]])


def differ(
    hand: HandSpec,
    spec: ObjectSpec,
    targets: Array,
    scene: SceneSpec | None = None,
    start: tuple[Array, Array] | None = None,
) -> Array:
    """Follow targets `(S, n)`, three physics steps each, in both; return the largest differences [mm, mm, deg]."""
    scene, (pose, joints) = scene or SceneSpec(), start or (start_pose(hand), grip(hand, spec))
    reference, planar = Reference(hand, spec, scene), PlanarSimulator(hand, [spec], scene)
    reference.begin(pose, joints)
    planar.reset(pose[None], joints[None])
    apart = []
    for row in targets:
        reference.step(row, 3)
        way = planar.step(row[None], 3).pose[0] - reference.pose
        apart.append(np.abs([*1e3 * way[:2], np.rad2deg(wrap_angle(way[2]))]))
    return np.asarray(np.max(apart, axis=0))


@pytest.mark.parametrize(("hand_name", "object_name"), PAIRS)
def test_300_steps_of_shaking_are_mujocos(hand_name: str, object_name: str) -> None:
    hand, spec = parse_hand_name(hand_name), CATALOGUE[object_name]
    apart = differ(hand, spec, shaken(hand, spec, 100, seed=1))
    assert (apart <= [1e-4, 1e-4, 1e-3]).all(), apart


@pytest.mark.parametrize(
    ("hand", "spec", "direction"),
    [
        (PAIRS[0][0], "cube_39", "In-Right"),
        (PAIRS[7][0], "ellipse_40x25", "In-Right"),
        (PAIRS[5][0], "hourglass", "Out"),
    ],
)
def test_whole_trials_are_mujocos(hand: str, spec: str, direction: str) -> None:
    config = AsteriskConfig(hand=hand, object=spec, directions=direction, trials=1, engine="planar")
    setup = prepare(config)
    (trial,) = simulate(config, setup)
    reference, poses = Reference(setup.hand, setup.object, SceneSpec()), geometry.planar(trial.object_pose)
    reference.begin(poses[0], trial.joint_angles[0])
    assert len(poses) > 100  # 2 s, 500 physics steps
    for pose, targets in zip(poses[1:], trial.targets[1:], strict=True):
        reference.step(targets, SUBSTEPS)
        assert np.linalg.norm(pose - reference.pose) < 1e-7


def test_without_the_floors_friction_trials_end_where_three_dimensions_end_them() -> None:
    config = AsteriskConfig(directions="Out,In-Right,Left,In'", trials=1, engine="planar")
    setup = prepare(config)
    paths = [each.path.poses for each in setup.assignments]
    task = Task(setup.hand, (setup.object,) * len(paths), geometry.Path(stacked(paths)))
    starts = np.tile(setup.hand.start_pose, (len(paths), 1))
    grasp = setup.controller.grasp(setup.hand, setup.object, starts[:, None] + task.path.poses, starts, engine="planar")
    ends = []
    for engine in ("planar", "mujoco"):
        bench = Bench(engine, SceneSpec(floor_friction=0.0))
        _, found = loop.simulate(task, grasp, starts, setup.controller.manipulate, bench)
        assert set(found.outcomes) == {REACHED}
        ends.append([found.states[last].pose[world] for world, last in enumerate(found.last)])
    np.testing.assert_allclose(ends[0], ends[1], atol=2e-5)


@pytest.mark.parametrize(("hand_name", "object_name"), PAIRS)
def test_one_step_is_mujocos_with_its_forces(hand_name: str, object_name: str) -> None:
    hand, spec = parse_hand_name(hand_name), CATALOGUE[object_name]
    reference, planar = Reference(hand, spec, SceneSpec()), PlanarSimulator(hand, [spec])
    joints = grip(hand, spec, 0.0003)
    reference.begin(start_pose(hand), joints)
    planar.reset(start_pose(hand)[None], joints[None])
    reference.step(grip(hand, spec, 0.003), 1)
    state = planar.step(grip(hand, spec, 0.003)[None], 1)
    np.testing.assert_allclose(state.joint_velocities[0], reference.data.qvel[: hand.n_joints], atol=1e-6)
    np.testing.assert_allclose(state.forces[0, :, :2], reference.data.sensordata.reshape(-1, 3)[:, :2], atol=2e-5)
    np.testing.assert_allclose(state.pose[0], reference.pose, atol=1e-8)


@pytest.mark.parametrize("wall", [Wall((0.03, 0.0936), 180.0, length=0.06), Wall((-0.03, 0.09), 10.0, length=0.08)])
def test_a_box_lies_on_a_wall_at_two_points_as_in_mujoco(wall: Wall) -> None:
    targets = shaken(HAND, CUBE, 60, seed=2) + 0.2 * np.sin(np.linspace(0, 6, 60))[:, None] * np.array([1, 0, 1, 0])
    assert differ(HAND, CUBE, targets, SceneSpec(walls=(wall,))).max() <= 1e-3


def test_a_box_and_a_palm_and_a_link_push_it_as_in_mujoco() -> None:
    start = np.array([0.01, 0.0185, 0.03]), open_hand(HAND)
    assert differ(HAND, CUBE, np.tile(open_hand(HAND), (40, 1)), start=start).max() <= 1e-4
    inward = open_hand(HAND) + np.linspace(0, 1.4, 60)[:, None] * np.array([-1.0, 0.0, 1.0, 0.0])
    assert differ(HAND, CUBE, inward, start=(np.array([0.0, 0.045, 0.1]), open_hand(HAND))).max() <= 1e-3


def test_links_end_at_their_limits_and_at_each_other_as_in_mujoco() -> None:
    hand = parse_hand_name(PAIRS[0][0])
    away = np.array([0.0, 0.4, 0.0])
    crossing = np.linspace(0, 1, 80)[:, None] * np.array([-0.9, 0.4, 0.9, -0.4])
    assert differ(hand, CUBE, crossing, start=(away, np.zeros(4))).max() <= 1e-6
    reference, planar = Reference(hand, CUBE, SceneSpec()), PlanarSimulator(hand, [CUBE])
    reference.begin(away, np.zeros(4))
    planar.reset(away[None], np.zeros((1, 4)))
    for row in crossing:
        reference.step(row, 3)
        state = planar.step(row[None], 3)
    np.testing.assert_allclose(state.joint_angles[0], reference.data.qpos[:4], atol=1e-7)
    assert np.abs(state.joint_angles[0] - crossing[-1]).max() > 0.02  # they press on each other


@settings(max_examples=20, deadline=None, derandomize=True)
@given(
    corners=st.lists(st.tuples(st.floats(0.012, 0.024), st.floats(0.0, 1.0)), min_size=3, max_size=7),
    seed=st.integers(0, 1000),
    turn=st.floats(-3.0, 3.0),
    friction=st.floats(0.0, 2.0),
)
def test_objects_of_any_convex_outline_move_as_in_mujoco(
    corners: list[tuple[float, float]], seed: int, turn: float, friction: float
) -> None:
    angles = 2 * np.pi * (np.arange(len(corners)) + 0.8 * np.array([share for _, share in corners])) / len(corners)
    radius = np.mean([size for size, _ in corners])
    spec = polygon_object("any", (radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)).tolist())
    spec = ObjectSpec("any", "polygon", spec.size, friction=friction, corners=spec.corners)
    # From a squeeze at once; balanced on a corner, outlines soon fall to either side, and deep ones leave by either.
    start = np.array([*HAND.start_position, turn]), grip(HAND, spec, 0.0003)
    assume(PlanarSimulator(HAND, [spec]).reset(start[0][None], start[1][None]).penetration[0] < 8e-4)
    apart = differ(HAND, spec, shaken(HAND, spec, 30, seed)[:10], start=start)
    assert apart.max() <= 1e-2, apart


def test_mirrored_worlds_move_as_mirror_images() -> None:
    for hand_name, object_name in PAIRS:
        hand, spec = parse_hand_name(hand_name), CATALOGUE[object_name]
        targets = shaken(hand, spec, 30, seed=20)
        image = ObjectSpec("image", spec.shape, spec.size, corners=tuple((-x, y) for x, y in spec.corners))
        states = run(PlanarSimulator(hand, [spec]), targets)
        mirror = run(PlanarSimulator(other_side(hand), [image]), mirrored_joints(hand, targets))
        poses, images = (np.concatenate([state.pose for state in each]) for each in (states, mirror))
        np.testing.assert_allclose(images * (-1, 1, -1), poses, atol=1e-7)


def test_a_free_object_comes_to_rest_as_the_floor_has_it() -> None:
    planar = PlanarSimulator(HAND, [CUBE], threads=1)
    planar.reset(np.array([[0.0, 0.4, 0.0]]), open_hand(HAND)[None])
    planar.push(np.array([0]), CUBE.mass * np.array([[0.3, 0.0, 0.0]]))
    speeds = [planar.step(open_hand(HAND)[None], 5).object_velocity[0] for _ in range(20)]
    slowing = -np.diff([speed[0] for speed in speeds[:4]]) / (5 * planar.timestep)
    np.testing.assert_allclose(slowing, 0.2 * 9.81, rtol=1e-3)
    assert np.abs(speeds[-1]).max() < 1e-4


@pytest.mark.parametrize("name", ["cube_39", "rectangle_46x15", "cylinder_40", "triangle", "pentagon", "trapezoid"])
def test_the_floor_slows_a_turning_object_about_as_three_dimensions_do(name: str) -> None:
    """MuJoCo lets a prism stand on three or four of its corners; which, is its own choice."""
    spec, away = CATALOGUE[name], np.array([[0.0, 0.4, 0.0]])
    turned = []
    for engine in ("planar", "mujoco"):
        simulator = make_simulator(engine, HAND, [spec], threads=1)
        simulator.reset(away, open_hand(HAND)[None])
        for _ in range(5):
            simulator.step(open_hand(HAND)[None], 5)
        kept = simulator.snapshot()
        kept.qvel[0, -1] = kept.centre[0, 5] = 12.0
        simulator.restore(np.array([0]), kept, np.array([0]))
        turned.append(simulator.step(open_hand(HAND)[None], 60).pose[0, 2] - kept.centre[0, 2])
    assert turned[0] == pytest.approx(turned[1], rel=0.1 if polygon(spec).shape[0] == 4 else 0.3)


def test_the_arm_of_a_boxs_friction_is_half_its_diagonal() -> None:
    assert friction_arm(CUBE) == pytest.approx(np.hypot(0.0195, 0.0195))
    assert friction_arm(CATALOGUE["cylinder_40"]) == pytest.approx(0.02)
    away = np.linalg.norm(polygon(CATALOGUE["triangle"]) - centre_of_mass(CATALOGUE["triangle"]), axis=-1)
    assert friction_arm(CATALOGUE["triangle"]) == pytest.approx(away.mean(), rel=1e-4)  # a third of its weight on each


def test_the_arm_of_one_object_is_kept_and_of_worlds_that_differ_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(caches.PLACE, str(tmp_path))
    drawn = [replace(CUBE, size=(0.039 + 1e-4 * k, 0.039, 0.05)) for k in range(3)]
    told = build([(HAND, spec, SceneSpec()) for spec in drawn])
    assert not list(tmp_path.rglob("arm-*"))
    alone = [build([(HAND, spec, SceneSpec())]) for spec in drawn]
    assert len(list(tmp_path.rglob("arm-*"))) == 3
    np.testing.assert_array_equal(told.loss, [each.loss[0] for each in alone])


@pytest.mark.parametrize("worth", [0, planar_engine.WORTH], ids=["on threads", "few worlds"])
def test_worlds_of_any_hands_objects_and_walls_share_a_batch_and_move_as_alone(
    worth: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    handed: list[object] = []

    class Told(ThreadPoolExecutor):
        def _adjust_thread_count(self) -> None:
            handed.append(self)
            super()._adjust_thread_count()

    monkeypatch.setattr(planar_engine, "WORTH", worth)
    monkeypatch.setattr(planar_engine, "ThreadPoolExecutor", Told)
    hands = [HAND, parse_hand_name("2v2_70.30_50.50_0.9.1_53")] * 3
    specs = [CATALOGUE[n] for n in ("cube_39", "cylinder_40", "hourglass", "triangle", "ellipse_40x25", "cube_43")]
    near = SceneSpec(walls=(Wall((0.025, 0.09), 180.0),))
    scenes = [SceneSpec(), near, SceneSpec(), near, near, SceneSpec()]
    targets = np.stack([shaken(h, s, 10, k) for k, (h, s) in enumerate(zip(hands, specs, strict=True))], axis=1)
    poses = np.stack([start_pose(hand) for hand in hands])
    joints = np.stack([grip(hand, spec) for hand, spec in zip(hands, specs, strict=True)])

    def follow(simulator: PlanarSimulator, rows: slice) -> list[State]:
        return [simulator.reset(poses[rows], joints[rows]), *(simulator.step(row[rows], 5) for row in targets)]

    both = [follow(PlanarSimulator(hands, specs, scenes, threads), slice(None)) for threads in (1, 3)]
    assert_same(both[0], both[1])
    assert bool(handed) == (worth == 0)
    for k, world in enumerate(zip(hands, specs, scenes, strict=True)):
        alone = follow(PlanarSimulator(world[0], [world[1]], world[2]), slice(k, k + 1))
        assert_same(alone, both[0], slice(k, k + 1))


@pytest.mark.parametrize("hand_name", HANDS)
def test_every_hand_and_object_of_the_catalogues_can_be_simulated(hand_name: str) -> None:
    """All objects of the catalogue share a batch, some before a wall; nothing diverges while the hand closes."""
    hand, objects = parse_hand_name(hand_name), tuple(CATALOGUE.values())
    scenes = [SceneSpec(walls=(Wall((0.0, 0.3), -90.0),) * (number % 2)) for number in range(len(objects))]
    simulator = PlanarSimulator(hand, objects, scenes, threads=1)
    simulator.reset(np.tile(hand.start_pose, (len(objects), 1)), np.zeros((len(objects), hand.n_joints)))
    state = simulator.step(np.full((len(objects), hand.n_joints), 0.3), 20)
    assert not state.diverged.any()
    assert np.isfinite(state.object_pose).all()
    assert np.isfinite(state.link_gaps).all()


def test_a_world_put_back_goes_on_to_the_same_bytes() -> None:
    specs = [CATALOGUE["triangle"], CATALOGUE["trapezoid"]]
    targets = np.stack([shaken(HAND, spec, 20, k) for k, spec in enumerate(specs)], axis=1)
    simulator = PlanarSimulator(HAND, specs)
    run(simulator, targets[:10])
    kept, instant = simulator.snapshot(), simulator.measure()
    first = [simulator.step(row, 5) for row in targets[10:]]
    other = PlanarSimulator(HAND, [specs[1], specs[0]])
    other.restore(np.array([1, 0]), kept, np.array([0, 1]))
    assert_same([instant], [other.measure()], slice(None, None, -1))
    second = [other.step(row[::-1], 5) for row in targets[10:]]
    assert_same(first, second, slice(None, None, -1))


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e200])
def test_a_world_that_diverges_is_told_and_leaves_the_others_alone(value: float) -> None:
    targets = shaken(HAND, CUBE, 10, seed=3)[:, None].repeat(3, axis=1)
    untouched, other = (PlanarSimulator(HAND, [CUBE] * 3) for _ in range(2))
    begun = [run(simulator, targets[:5])[0] for simulator in (untouched, other)][1]
    spoilt = other.snapshot()
    spoilt.centre[1, 4] = value
    other.restore(np.array([1]), spoilt, np.array([1]))
    for row in targets[5:]:
        expected, state = (simulator.step(row, 5) for simulator in (untouched, other))
        np.testing.assert_array_equal(state.object_pose[[0, 2]], expected.object_pose[[0, 2]])
        np.testing.assert_array_equal(state.diverged, [False, True, False])
        assert np.isfinite(state.object_pose).all()
    np.testing.assert_allclose(begun.pose[1], start_pose(HAND), atol=1e-12)
