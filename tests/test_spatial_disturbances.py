"""Disturbed worlds in space: every quantity acts, in the physics or in what is seen, and no world touches another's."""

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from inhand.asterisk_test.asterisk import Ready, finish
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.people.human import HumanFolder
from inhand.asterisk_test.spatial.run import prepare_in_space, simulate_asterisk_in_space
from inhand.control.between import Between
from inhand.control.episode import SHAPES
from inhand.control.loop import sense
from inhand.control.phases import Grasp
from inhand.control.seen import PRIVILEGED, SENSED
from inhand.control.senses import Senses
from inhand.control.spatial_rehearsal import closed_at
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import load_any, save_trial
from inhand.errors import InputError
from inhand.geometry import Array, inverse_quaternion, turn
from inhand.hands.spatial.grasp_search import SpatialSearchConfig, search_grasps
from inhand.hands.spatial.gravity import gravity_of
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.meshes import solid_of
from inhand.hands.spatial.names import STANDARD
from inhand.hands.spatial.objects import SolidSpec, inertia_of
from inhand.rotations import multiply, pose_from, quaternion_of, vector_of
from inhand.sim.disturbance import DISTURBANCES, FIELD, HARD, Camera, Commands, Differences, Disturbance, Pushes
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.drawn import Disturbed, Drawn, draw, true_starts, truth
from inhand.sim.scene import SceneSpec
from inhand.sim.spatial_engine import SpatialSimulator
from inhand.sim.state import SpatialState, State
from inhand.sim.strengths import scaled
from inhand.tasks.spatial.paths import SpatialReference, whole_spatial_path
from test_disturbances import PERIOD
from test_spatial_asterisk import limited
from test_spatial_engine import CUBE, HAND, fingers_at, gripped

AT = np.tile(HAND.start_pose, (2, 1))
QUICK = SpatialSearchConfig(spacing=0.016, keep=1)


def drawn_worlds(spec: Disturbance, count: int, first: int = 0) -> list[Disturbed]:
    """Return the worlds of some keys."""
    return [draw(spec, (first + number,), HAND.n_joints, space=True) for number in range(count)]


def pair(word: str = "up", **factors: Any) -> SpatialSimulator:
    """Return two worlds, their objects held and the fingers off them: the first as drawn, the second undisturbed."""
    scene = SceneSpec(pull=gravity_of(word))
    hand, spec, around = truth(Drawn((0,), centre=factors.pop("centre", (0.0, 0.0, 0.0)), **factors), HAND, CUBE, scene)
    # A centre of mass of its own is a matter of kind, and 0.1 mm is one too.
    other = replace(CUBE, centre=(1e-4, 0.0, 0.0)) if any(spec.centre) else CUBE
    simulator = SpatialSimulator([hand, HAND], [spec, other], [around, scene], threads=1)
    simulator.reset(AT, np.tile(fingers_at(0.006), (2, 1)))
    return simulator


def state_at(poses: Array, joints: Array, time: float) -> State:
    """Return a state of worlds whose objects are at poses `(B, 7)` and whose joints at angles `(B, n)`."""
    count = len(poses)
    points, still = np.zeros((count, 3, 3)), np.zeros_like(joints)
    links, gaps = np.zeros((count, 3), dtype=np.int64), np.zeros((count, 3))
    moving = np.full(count, time), poses, np.zeros((count, 6)), joints, still, joints
    return SpatialState(*moving, still, links, points, points, gaps, points, np.zeros(count, dtype=bool))


MOVES, TURNS = np.array([0.05, -0.02, 0.03]), np.array([0.3, 0.2, -0.4])


def watched(spec: Disturbance, count: int, decisions: int, first: int = 0) -> tuple[list[Any], Array]:
    """Return what is sensed of objects that move evenly, decision by decision, and how they are `(T, 7)`."""
    worlds, still, senses = drawn_worlds(spec, count, first), np.zeros((count, HAND.n_joints)), None
    seen, poses = [], []
    for number in range(decisions + 1):
        pose = pose_from(HAND.start_pose, number * PERIOD * MOVES, number * PERIOD * TURNS)
        state = state_at(np.tile(pose, (count, 1)), still + number * PERIOD, number * PERIOD)
        if senses is None:
            senses = Senses(spec, state, PERIOD)
            senses.begin(np.arange(count), worlds, state)
        else:
            senses.take(state)
        poses.append(pose)
        seen.append(senses.sensed(state, state.targets))
    return seen, np.array(poses)


def off(seen: list[Any], poses: Array) -> Array:
    """Return how far frames are moved [m] and turned [rad] from poses `(T, 7)`: `(T, B, 6)`."""
    frames = np.array([each.frame_pose for each in seen])
    turned = vector_of(multiply(frames[..., 3:], inverse_quaternion(poses[:, None, 3:])))
    return np.concatenate([frames[..., :3] - poses[:, None, :3], turned], axis=-1)


def test_what_is_drawn_in_space_has_three_axes_and_the_rest_is_as_in_the_plane() -> None:
    worlds = [world.drawn for world in drawn_worlds(FIELD, 400)]
    flat = draw(FIELD, (0,), HAND.n_joints).drawn
    more = {name: getattr(worlds[0], name) for name in ("centre", "start", "bias")}
    assert replace(flat, **more) == worlds[0]
    assert worlds[0].centre[:2] == flat.centre
    starts, bias = (np.array([getattr(world, name) for world in worlds]) for name in ("start", "bias"))
    np.testing.assert_allclose(starts.std(axis=0), [2e-3] * 3 + [np.deg2rad(3.0)] * 3, rtol=0.15)
    for part, size in ((bias[:, :3], 1e-3), (bias[:, 3:], np.deg2rad(1.5))):
        np.testing.assert_allclose(np.linalg.norm(part, axis=-1), size)
        assert np.abs(part.mean(axis=0)).max() < 0.12 * size  # any direction
    centre = 1e3 * np.array([world.centre for world in worlds])
    np.testing.assert_allclose(np.abs(centre).max(axis=0), 5.0, rtol=0.05)


def test_the_truth_is_the_nominal_world_times_the_factors() -> None:
    drawn = Drawn((0,), 0.5, 2.0, 1.1, 3.0, 1.2, 0.7, 0.9, (0.001, -0.002, 0.003))
    hand, spec, _ = truth(drawn, HAND, CUBE, SceneSpec())
    servos = hand.friction, hand.stiffness, hand.damping, hand.torque
    assert servos == (0.5 * HAND.friction, 1.2 * HAND.stiffness, 0.7 * HAND.damping, 0.9 * HAND.torque)
    assert (spec.mass, spec.centre) == (2 * CUBE.mass, (0.001, -0.002, 0.003))
    assert spec.size == pytest.approx([1.1 * side for side in CUBE.size])
    corners = np.array([[0, 0, 0], [0.04, 0, 0], [0, 0.04, 0], [0, 0, 0.04]], dtype=float)
    mesh = solid_of("wedge", corners)
    _, larger, _ = truth(replace(drawn, mass=1.1**3), HAND, mesh, SceneSpec())
    expected = solid_of("wedge", 1.1 * corners)
    assert mesh.mesh is not None
    assert larger.mesh is not None
    assert expected.mesh is not None
    np.testing.assert_allclose(larger.mesh.corners, expected.mesh.corners)
    ratio = larger.mass / expected.mass
    np.testing.assert_allclose(inertia_of(larger), ratio * inertia_of(expected), rtol=1e-9)
    simulator = SpatialSimulator(HAND, [mesh, larger], threads=1)
    gaps = simulator.reset(AT, np.tile(fingers_at(0.006), (2, 1))).gaps
    assert (gaps[1] < gaps[0]).all()


def test_mass_size_and_centre_of_mass_act() -> None:
    simulator = pair(mass=2.0)
    simulator.let_go(np.ones(2, dtype=bool))
    push = np.tile([0.004, 0.002, -0.006], (2, 1))
    simulator.push(np.arange(2), push)
    velocity = simulator.measure().object_velocity
    np.testing.assert_allclose(velocity[:, :3], push / np.array([[2 * CUBE.mass], [CUBE.mass]]))
    gaps = pair(size=1.1).measure().gaps
    np.testing.assert_allclose(gaps[1] - gaps[0], 0.05 * CUBE.size[0], atol=2e-5)
    # An object that spins freely turns about its centre of mass: its origin goes round it.
    away = np.array([0.004, -0.003, 0.002])
    simulator = pair(centre=tuple(away.tolist()))
    simulator.let_go(np.ones(2, dtype=bool))
    kept, spin = simulator.snapshot(), np.array([0.0, 0.0, 5.0])
    qvel = kept.qvel.copy()
    qvel[:, -3:], qvel[0, -6:-3] = spin, -np.cross(spin, away)
    simulator.restore(np.arange(2), replace(kept, qvel=qvel), np.arange(2))
    start = simulator.measure()
    state = simulator.step(start.targets, 10)
    fallen = [0.0, 0.0, -9.81 * 0.004**2 * 55]  # the integrator's sum of ten steps
    moved = state.object_pose[:, :3] - start.object_pose[:, :3] - fallen
    expected = away - turn(state.object_pose[0, 3:], away)
    assert np.linalg.norm(expected) > 4e-4
    np.testing.assert_allclose(moved[0], expected, atol=3e-5)
    np.testing.assert_allclose(moved[1], 0.0, atol=3e-5)


def test_friction_and_the_servos_act() -> None:
    simulator = pair("sideways", friction=0.12)
    state = gripped(simulator, 10)
    slid = np.linalg.norm(state.object_pose[:, :3] - HAND.start_position, axis=-1)
    assert slid[0] > 10 * slid[1]
    for name, factor, step, slower in (
        ("stiffness", 0.5, 0.05, True),
        ("damping", 0.5, 0.3, False),
        ("torque", 0.2, 0.3, True),
    ):
        simulator = pair("up", **{name: factor})
        begun = simulator.measure()
        way = step * np.where(np.arange(HAND.n_joints) % 3 == 2, -1.0, 0.0)
        gone = np.abs(simulator.step(begun.targets + way, 10).joint_angles - begun.joint_angles).sum(axis=1)
        assert (gone[0] < 0.95 * gone[1]) if slower else (gone[0] > 1.05 * gone[1]), name


def test_a_world_goes_its_way_alone_whatever_the_others_are() -> None:
    scene = SceneSpec(pull=gravity_of("down"))
    true = [truth(world.drawn, HAND, CUBE, scene) for world in drawn_worlds(FIELD, 3)]
    hands, things, scenes = (list(part) for part in zip(*true, strict=True))
    together, alone = (SpatialSimulator(hands[k:], things[k:], scenes[k:], threads=1) for k in (0, 2))
    states = []
    for simulator in (together, alone):
        count = simulator.n_worlds
        simulator.reset(np.tile(HAND.start_pose, (count, 1)), np.tile(fingers_at(0.006), (count, 1)))
        states.append(gripped(simulator, 5))
    for name in ("object_pose", "joint_angles", "gaps", "forces", "finger_points"):
        np.testing.assert_array_equal(getattr(states[0], name)[2:], getattr(states[1], name))
    assert np.abs(states[0].object_pose[0] - states[0].object_pose[1]).max() > 1e-7


def test_a_camera_in_space_has_noise_bias_and_delay_about_three_axes() -> None:
    seen, poses = watched(Disturbance(camera=Camera(noise_mm=1.0, noise_deg=2.0)), 20, 100)
    away = off(seen, poses)
    np.testing.assert_allclose(away.std(axis=(0, 1)), [1e-3] * 3 + [np.deg2rad(2.0)] * 3, rtol=0.06)
    np.testing.assert_allclose(np.linalg.norm(seen[9].frame_pose[:, 3:], axis=-1), 1.0)
    spec = Disturbance(camera=Camera(bias_mm=2.0, bias_deg=3.0))
    seen, poses = watched(spec, 3, 10)
    bias = [world.drawn.bias for world in drawn_worlds(spec, 3)]
    np.testing.assert_allclose(off(seen, poses), np.broadcast_to(bias, (11, 3, 6)), atol=1e-12)
    late = Disturbance(camera=Camera(rate_hz=30.0, delay_ms=(40.0, 40.0)))
    seen, _ = watched(late, 1, 30)
    times = np.array([each.frame_time[0] for each in seen])
    assert (PERIOD * np.arange(31) - times).min() >= 0.04 - 1e-9
    then = pose_from(HAND.start_pose, np.maximum(times, 0.0)[:, None] * MOVES, np.maximum(times, 0.0)[:, None] * TURNS)
    np.testing.assert_allclose([each.frame_pose[0] for each in seen], then, atol=1e-5)


@pytest.mark.parametrize("spec", [FIELD, HARD], ids=lambda spec: spec.name)
def test_what_is_seen_of_a_world_is_the_same_alone(spec: Disturbance) -> None:
    whole, _ = watched(spec, 4, 150)
    alone, _ = watched(spec, 1, 150, first=2)
    for together, apart in zip(whole, alone, strict=True):
        for name, values in vars(apart).items():
            np.testing.assert_array_equal(getattr(together, name)[2:3], values)


def test_commands_are_late_zeros_are_off_and_pushes_come_from_everywhere() -> None:
    spec = Disturbance(differs=Differences(zero_deg=1.0), commands=Commands((28.0, 28.0)), pushes=Pushes(6.0, 5.0, 3))
    count, worlds = 40, drawn_worlds(spec, 40)
    simulator = SpatialSimulator(HAND, [CUBE] * count, threads=1)
    start = simulator.reset(np.tile(HAND.start_pose, (count, 1)), np.tile(fingers_at(0.006), (count, 1)))
    between = Between(worlds, start, 0.004, 5)
    zero = np.array([world.drawn.zero for world in worlds])
    np.testing.assert_allclose(between.seen(SENSED).joint_angles, start.joint_angles + zero)
    sent = [between.send(simulator, start.targets + zero + 0.01 * number) for number in range(1, 5)]
    np.testing.assert_array_equal(simulator.lag, 2)
    for arrived, number in zip(sent[1:], range(1, 4), strict=True):
        np.testing.assert_allclose(arrived - start.targets, 0.01 * number, atol=1e-12)
    speeds, between.pushing = [simulator.measure().object_velocity[:, :3].copy()], True
    for _ in range(100):
        between.send(simulator, start.targets)
        speeds.append(simulator.measure().object_velocity[:, :3].copy())
    jumps = np.diff(speeds, axis=0)
    sizes = np.linalg.norm(jumps, axis=-1)
    np.testing.assert_allclose(sizes[sizes > 1e-9], 0.006 / CUBE.mass)
    assert (sizes > 1e-9).sum(axis=0).max() == 3
    directions = jumps[sizes > 1e-9] * CUBE.mass / 0.006
    assert np.abs(directions.mean(axis=0)).max() < 0.25
    np.testing.assert_allclose((directions**2).mean(axis=0), 1 / 3, atol=0.12)  # evenly on the sphere


def test_what_is_sensed_of_an_undisturbed_world_is_exact() -> None:
    state = pair().measure()
    seen = sense(state, reads=SENSED)
    np.testing.assert_array_equal(seen.frame_pose, state.object_pose)
    np.testing.assert_array_equal(seen.joint_angles, state.joint_angles)


def test_objects_start_beside_where_they_are_planned() -> None:
    worlds = drawn_worlds(Disturbance(differs=Differences(start_mm=3.0, start_deg=5.0)), 2)
    starts = true_starts(worlds, AT)
    start = np.array([world.drawn.start for world in worlds])
    np.testing.assert_allclose(starts[:, :3] - AT[:, :3], start[:, :3])
    np.testing.assert_allclose(starts[:, 3:], quaternion_of(start[:, 3:]))


def disturbed_trials(level: object, directions: str = "Down,turn+z") -> list[SpatialTrial]:
    """Return a trial of each direction, from grasps that are searched quickly and not tried out."""

    def grasp(
        hand: SpatialHand,
        spec: SolidSpec,
        paths: Sequence[SpatialReference],
        gravity: Array,
        starts: Array,
        **_: object,
    ) -> Grasp:
        whole = [whole_spatial_path(path) for path in paths]
        found = search_grasps((hand, spec), hand.start_pose, whole, gravity[:1], config=QUICK)
        return replace(closed_at(hand, [each[0] for each in found], starts), way=np.full(len(starts), 0.02))

    planner: Any = grasp
    config = AsteriskConfig(hand=STANDARD, object="cube_50", directions=directions, trials=1, gravity="down")
    config = replace(config, disturb=DISTURBANCES.name_of(level))
    setup = prepare_in_space(config)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("inhand.asterisk_test.spatial.run.limits_in_space", limited)
        return [
            *simulate_asterisk_in_space(config, replace(setup, controller=replace(setup.controller, grasp=planner)))
        ]


@pytest.fixture(scope="module")
def both() -> list[SpatialTrial]:
    """A move and a turn in worlds that are disturbed a little."""
    return disturbed_trials(replace(scaled(FIELD, 0.2), name="gentle"))


def test_a_disturbance_of_no_strength_changes_nothing() -> None:
    assert load_disturbance("field@0") is None
    worlds, scene = drawn_worlds(Disturbance("nought"), 2), SceneSpec(pull=gravity_of("down"))
    assert truth(worlds[0].drawn, HAND, CUBE, scene) == (HAND, CUBE, scene)
    np.testing.assert_array_equal(true_starts(worlds, AT), AT)
    simulator = pair("down")
    start = simulator.measure()
    between = Between(worlds, start, 0.004, 5)
    between.pushing = True
    np.testing.assert_array_equal(between.send(simulator, start.targets + 0.1), start.targets + 0.1)
    state = simulator.step(start.targets + 0.1, 5)
    between.take(state)
    shown, sensed, known = between.seen(PRIVILEGED), between.seen(SENSED), sense(state, reads=SENSED)
    for field in fields(state):
        np.testing.assert_array_equal(getattr(shown, field.name), getattr(state, field.name))
    for name, values in vars(known).items():
        np.testing.assert_array_equal(getattr(sensed, name), values)


def test_a_disturbed_trial_is_the_same_alone_and_says_what_was_drawn(both: list[SpatialTrial], tmp_path: Path) -> None:
    alone = disturbed_trials(replace(scaled(FIELD, 0.2), name="gentle"), "turn+z")[0]
    for name in SHAPES:
        np.testing.assert_array_equal(getattr(alone, name), getattr(both[1], name), err_msg=name)
    passport = both[1].passport
    assert passport.disturbed is not None
    assert (passport.disturb, len(passport.disturbed.drawn.bias), passport.object) == ("gentle", 6, CUBE)
    off = alone.object_pose[0, :3] - disturbed_trials("none", "turn+z")[0].object_pose[0, :3]
    np.testing.assert_allclose(off, passport.disturbed.drawn.start[:3], atol=1e-12)
    save_trial(both[1], tmp_path / "t.npz")
    assert load_any(tmp_path / "t.npz").passport == passport
    config = AsteriskConfig(hand=STANDARD, object="cube_50", directions="Down,turn+z", trials=1, disturb="field")
    known = Ready(prepare_in_space(config), HumanFolder((), ()), (), "")
    run = finish(config, known, lambda *_: tuple(both))
    assert set(run.table()["disturb"]) == {"gentle"}
    notes = [note for note in run.notes if note.startswith(("Disturbed by field", "In space there is no floor"))]
    assert len(notes) == 2


def test_what_cannot_be_drawn_of_a_hand_in_space_is_refused() -> None:
    huge = Disturbance("huge", Differences(size=(1.0, 900.0)))
    with pytest.raises(InputError, match="disturbance 'huge' cannot be drawn: object 'cube_50'"):
        disturbed_trials(huge)
