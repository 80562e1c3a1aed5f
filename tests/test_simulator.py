"""Laws of the simulator, over every hand and object of the catalogues."""

import re
from dataclasses import FrozenInstanceError, fields, replace
from typing import Any

import mujoco
import numpy as np
import pytest

from inhand.errors import InputError
from inhand.geometry import Array, planar, transform
from inhand.hands.hand import FINGER_NAMES, FingerSpec, HandSpec
from inhand.hands.names import CATALOGUE as HAND_NAMES
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.hands.objects import ObjectSpec
from inhand.hands.touch import touch
from inhand.sim.engine import Simulator
from inhand.sim.model import build_model
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.scene import SceneSpec
from inhand.sim.state import CONTACT_TOLERANCE, State, select
from pairs import every_fourth_pair

HAND = parse_hand_name(HAND_NAMES[0])
CUBE = OBJECTS["cube_39"]
BOXES = [spec for spec in OBJECTS.values() if spec.shape == "box"][:7]


def start_pose(hand: HandSpec, turn: float = 0.0) -> Array:
    return np.array([*hand.start_position, turn])


def open_hand(hand: HandSpec) -> Array:
    """Joint angles that hold both fingers away from the object, `(n,)`."""
    angles = np.zeros(hand.n_joints)
    for finger, place in zip(hand.fingers, hand.slices, strict=True):
        angles[place.start] = -finger.bend * 1.2
    return angles


def grip(hand: HandSpec, spec: ObjectSpec, squeeze: float = 0.0) -> Array:
    """Joint angles that put the tips on the sides of the object at its start, or `squeeze` [m] inside, `(n,)`."""
    angles = []
    for finger in hand.fingers:
        side = transform(start_pose(hand), np.array([finger.bend * (spec.size[0] / 2 - squeeze), 0.0]))
        angles.append(touch(hand, finger, side, np.array([float(finger.bend), 0.0])).joints)
    return np.concatenate(angles)


def shaken(hand: HandSpec, spec: ObjectSpec, steps: int, seed: int) -> Array:
    """Targets that grip the object and move it about, `(steps, n)`."""
    amplitude = np.random.default_rng(seed).uniform(-0.15, 0.15, hand.n_joints)
    phase = 2 * np.pi * np.arange(steps)[:, None] / steps
    return np.asarray(grip(hand, spec, 0.003) + amplitude * np.sin(phase))


def run(simulator: Simulator, targets: Array, substeps: int = 6, turn: float = 0.0) -> list[State]:
    """Grip in every world, then follow targets `(S, n)` or `(S, B, n)`; return all states, the start first."""
    hand, count = simulator.hand, len(simulator.objects)
    poses = np.tile(start_pose(hand, turn), (count, 1))
    start = simulator.reset(poses, np.stack([grip(hand, spec) for spec in simulator.objects]))
    commands = [np.broadcast_to(target, (count, hand.n_joints)) for target in targets]
    return [start, *(simulator.step(command, substeps) for command in commands)]


def assert_same(states: list[State], others: list[State], worlds: slice = slice(None)) -> None:
    """Every array of both runs is the same to the last bit, `worlds` of the second against all of the first."""
    for state, other in zip(states, others, strict=True):
        for field in fields(State):
            np.testing.assert_array_equal(getattr(state, field.name), getattr(select(other, worlds), field.name))


def other_side(hand: HandSpec) -> HandSpec:
    """The hand's mirror image."""

    def mirrored(finger: FingerSpec) -> FingerSpec:
        limits = tuple((-high, -low) for low, high in finger.limits)
        return FingerSpec((-finger.base[0], finger.base[1]), finger.links, limits, -finger.bend)

    return replace(hand, left=mirrored(hand.right), right=mirrored(hand.left))


def mirrored_joints(hand: HandSpec, angles: Array) -> Array:
    left, right = hand.slices
    return np.concatenate([-angles[..., right], -angles[..., left]], axis=-1)


@every_fourth_pair
def test_mirrored_worlds_move_as_mirror_images(hand_name: str, spec: ObjectSpec) -> None:
    hand = parse_hand_name(hand_name)
    targets = shaken(hand, spec, 30, seed=20)
    states = run(MujocoSimulator(hand, [spec], threads=1), targets)
    image = replace(spec, corners=tuple((-x, y) for x, y in spec.corners))
    mirror = run(MujocoSimulator(other_side(hand), [image], threads=1), mirrored_joints(hand, targets))
    poses = np.concatenate([state.pose for state in states])
    images = np.concatenate([state.pose for state in mirror]) * (-1, 1, -1)
    # Boxes are exact; of the prisms, MuJoCo's contact points depend on the order of the mesh's corners.
    lengths, angles = (1e-9, 1e-8) if spec.shape == "box" else (5e-4, np.deg2rad(1.5))
    np.testing.assert_allclose(images[:, :2], poses[:, :2], atol=lengths)
    np.testing.assert_allclose(images[:, 2], poses[:, 2], atol=angles)
    joints = np.concatenate([state.joint_angles for state in states])
    theirs = np.concatenate([state.joint_angles for state in mirror])
    np.testing.assert_allclose(mirrored_joints(hand, joints), theirs, atol=1e-8 if spec.shape == "box" else 0.03)
    assert np.abs(poses - poses[0]).max() > 2e-4


@every_fourth_pair
def test_everything_in_a_state_is_of_one_instant(hand_name: str, spec: ObjectSpec) -> None:
    hand = parse_hand_name(hand_name)
    simulator = MujocoSimulator(hand, [spec], threads=1)
    opened, closed = open_hand(hand)[None], grip(hand, spec, 0.003)[None]
    simulator.reset(start_pose(hand, 0.1)[None], opened)
    model = build_model(hand, spec, SceneSpec())
    data = mujoco.MjData(model)
    speeds = []
    for k in range(8):
        state = simulator.step(closed if k % 4 < 2 else opened, 5)
        speeds.append(float(np.abs(state.joint_velocities).max()))
        data.qpos[:] = np.concatenate([state.joint_angles[0], state.object_pose[0]])
        mujoco.mj_forward(model, data)
        _check_distances(hand, state, model, data)
    # At this speed a tip crosses 1 mm in one physics step: a state that lags by one would be seen.
    assert max(speeds) > 2.0


def _check_distances(hand: HandSpec, state: State, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    for f, (side, place) in enumerate(zip(FINGER_NAMES, hand.slices, strict=True)):
        ends = np.zeros((place.stop - place.start, 6))
        gaps = []
        for i in range(len(ends)):
            found = []
            for piece in (g for g in range(model.ngeom) if model.geom(g).name.startswith("object")):
                points = np.zeros(6)
                gap = mujoco.mj_geomDistance(model, data, model.geom(f"{side}_{i}").id, piece, 1.0, points)
                found.append((gap, points))
            gap, ends[i] = min(found, key=lambda pair: pair[0])
            gaps.append(gap)
        np.testing.assert_allclose(state.link_gaps[0, place], gaps, atol=1e-9)
        nearest = int(np.argmin(gaps))
        assert state.contact_links[0, f] == nearest
        np.testing.assert_allclose(state.gaps[0, f], gaps[nearest], atol=1e-9)
        np.testing.assert_allclose(state.finger_points[0, f], ends[nearest, :3], atol=1e-9)
        np.testing.assert_allclose(state.object_points[0, f], ends[nearest, 3:], atol=1e-9)


def test_same_inputs_give_the_same_bytes() -> None:
    targets = shaken(HAND, CUBE, 30, seed=21)
    simulator = MujocoSimulator(HAND, [CUBE], threads=1)
    first = run(simulator, targets)
    assert_same(first, run(MujocoSimulator(HAND, [CUBE], threads=1), targets))
    assert_same(first, run(simulator, targets))  # a reset leaves nothing of the last run behind


@pytest.mark.parametrize("hand_name", [HAND_NAMES[0], HAND_NAMES[-1]])
def test_a_world_does_not_depend_on_its_batch_or_on_threads(hand_name: str) -> None:
    hand = parse_hand_name(hand_name)
    targets = np.stack([shaken(hand, spec, 20, seed) for seed, spec in enumerate(BOXES)], axis=1)
    together = run(MujocoSimulator(hand, BOXES, threads=1), targets)
    assert_same(together, run(MujocoSimulator(hand, BOXES, threads=2), targets))
    assert_same(together, run(MujocoSimulator(hand, BOXES), targets))
    for world, spec in enumerate(BOXES):
        alone = run(MujocoSimulator(hand, [spec], threads=1), targets[:, world])
        assert_same(alone, together, slice(world, world + 1))


def test_states_do_not_change_when_the_simulator_goes_on() -> None:
    simulator = MujocoSimulator(HAND, BOXES, threads=2)
    targets = shaken(HAND, CUBE, 10, seed=22)
    kept: list[tuple[State, dict[str, Array]]] = []
    simulator.reset(np.tile(start_pose(HAND), (7, 1)), np.tile(grip(HAND, CUBE), (7, 1)))
    for target in targets:
        state = simulator.step(np.tile(target, (7, 1)), 3)
        kept.append((state, {field.name: getattr(state, field.name).copy() for field in fields(State)}))
    simulator.reset(np.tile([0.0, 0.1, 0.0], (7, 1)), np.zeros((7, 4)))
    for state, copies in kept:
        for name, copy in copies.items():
            np.testing.assert_array_equal(getattr(state, name), copy)
    moved = np.abs(kept[0][0].joint_angles - kept[-1][0].joint_angles).max()
    assert moved > 1e-3


def test_writing_into_a_state_or_the_targets_changes_no_later_step() -> None:
    targets = shaken(HAND, CUBE, 10, seed=23)
    untouched = run(MujocoSimulator(HAND, [CUBE], threads=1), targets)
    simulator = MujocoSimulator(HAND, [CUBE], threads=1)
    state = simulator.reset(start_pose(HAND)[None], grip(HAND, CUBE)[None])
    for k, target in enumerate(targets):
        for field in fields(State):
            getattr(state, field.name)[:] = 7
        command = target[None].copy()
        state = simulator.step(command, 6)
        command[:] = 7
        np.testing.assert_array_equal(state.targets[0], target)
        assert_same([state], [untouched[k + 1]])


def test_a_state_is_frozen_and_has_its_shapes_and_views() -> None:
    hand = parse_hand_name("2v3_25.75_25.35.40_1.1_53")
    simulator: Simulator = MujocoSimulator(hand, BOXES)
    pose = np.tile(start_pose(hand, 0.4), (7, 1))
    state = simulator.reset(pose, np.stack([grip(hand, spec) for spec in BOXES]))
    shapes = {field.name: getattr(state, field.name).shape for field in fields(State)}
    joints = {"joint_angles", "joint_velocities", "targets", "link_gaps"}
    expected = {"time": (7,), "object_pose": (7, 7), "object_velocity": (7, 6), "contact_links": (7, 2), "gaps": (7, 2)}
    expected |= {"diverged": (7,)}
    expected |= dict.fromkeys(joints, (7, 5)) | dict.fromkeys(("finger_points", "object_points", "forces"), (7, 2, 3))
    assert shapes == expected
    assert state.n_worlds == 7
    np.testing.assert_allclose(state.pose, pose, atol=1e-12)
    np.testing.assert_array_equal(state.pose, planar(state.object_pose))
    left, right = hand.slices
    nearest = [state.link_gaps[:, left].min(axis=1), state.link_gaps[:, right].min(axis=1)]
    np.testing.assert_array_equal(state.gaps, np.stack(nearest, axis=1))
    np.testing.assert_array_equal(state.touching, state.gaps <= CONTACT_TOLERANCE)
    for field in fields(State):
        with pytest.raises(FrozenInstanceError):
            setattr(state, field.name, None)


def test_time_counts_physics_steps() -> None:
    simulator = MujocoSimulator(HAND, [CUBE] * 2, SceneSpec(timestep=0.002))
    assert simulator.timestep == 0.002
    angles = np.tile(open_hand(HAND), (2, 1))
    assert (simulator.reset(np.tile(start_pose(HAND), (2, 1)), angles).time == 0).all()
    simulator.step(angles, 5)
    np.testing.assert_allclose(simulator.step(angles, 3).time, 0.016)


def test_many_short_steps_are_one_long_step() -> None:
    simulator = MujocoSimulator(HAND, [CUBE], threads=1)
    closed = grip(HAND, CUBE, 0.003)[None]
    simulator.reset(start_pose(HAND)[None], grip(HAND, CUBE)[None])
    for _ in range(20):
        short = simulator.step(closed, 1)
    simulator.reset(start_pose(HAND)[None], grip(HAND, CUBE)[None])
    assert_same([short], [simulator.step(closed, 20)])


def test_select_takes_worlds_of_a_state() -> None:
    states = run(MujocoSimulator(HAND, BOXES), shaken(HAND, CUBE, 3, seed=24))
    state = states[-1]
    some = select(state, np.array([4, 0]))
    assert some.n_worlds == 2
    for field in fields(State):
        np.testing.assert_array_equal(getattr(some, field.name), getattr(state, field.name)[[4, 0]])
        assert not np.shares_memory(getattr(some, field.name), getattr(state, field.name))
    mask = state.object_pose[:, 0] < 1
    assert select(state, mask).n_worlds == 7
    assert select(state, slice(2, 4)).n_worlds == 2


def test_every_world_has_its_own_floor_mass_and_size() -> None:
    specs = [CUBE, replace(CUBE, mass=0.3), CUBE, replace(CUBE, friction=0.6), OBJECTS["cube_43"]]
    scenes = [SceneSpec(), SceneSpec(), SceneSpec(floor_friction=0.9), SceneSpec(), SceneSpec(gravity=3.7)]
    targets = shaken(HAND, CUBE, 30, seed=26) + 0.08  # both fingers swing to the left
    together = run(MujocoSimulator(HAND, specs, scenes, threads=2), targets)
    ends = together[-1].pose
    for world, (spec, scene) in enumerate(zip(specs, scenes, strict=True)):
        alone = run(MujocoSimulator(HAND, [spec], scene, threads=1), targets)
        assert_same(alone, together, slice(world, world + 1))
        others = np.delete(ends, world, axis=0)
        assert np.abs(others - ends[world]).max(axis=1).min() > 1e-6


def ready(worlds: int = 2) -> MujocoSimulator:
    simulator = MujocoSimulator(HAND, [CUBE] * worlds, threads=1)
    simulator.reset(np.tile(start_pose(HAND), (worlds, 1)), np.tile(open_hand(HAND), (worlds, 1)))
    return simulator


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_command_that_is_not_finite_names_world_and_joint(bad: float) -> None:
    simulator = ready(3)
    targets = np.zeros((3, 4))
    targets[1, 2] = bad
    text = f"the target of joint 2 in world 1 is {bad}; commands must be finite joint angles [rad]: look for a division"
    with pytest.raises(InputError, match=re.escape(text)):
        simulator.step(targets, 1)
    state = simulator.step(np.zeros((3, 4)), 1)  # a refused command leaves the simulator as it was
    np.testing.assert_allclose(state.time, simulator.timestep)


@pytest.mark.parametrize("shape", [(2, 3), (1, 4), (4,), (2, 4, 1), (0, 4)])
def test_commands_of_a_wrong_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match=re.escape(f"joint targets of shape {shape}; 2 worlds need (2, 4)")):
        ready().step(np.zeros(shape), 1)


@pytest.mark.parametrize(
    ("pose", "joints", "words"),
    [
        (np.zeros((2, 2)), np.zeros((2, 4)), ["object", "(2, 2)", "(2, 3)"]),
        (np.zeros((2, 3)), np.zeros((2, 5)), ["joint", "(2, 5)", "(2, 4)"]),
        (np.array([[0, 0.1, 0], [0, np.nan, 0]]), np.zeros((2, 4)), ["object", "world 1", "nan"]),
        (np.zeros((2, 3)), np.array([[0, 0, 0, np.inf], [0] * 4]), ["joint 3", "world 0", "inf"]),
    ],
    ids=["pose shape", "joint shape", "pose not finite", "joint not finite"],
)
def test_a_start_that_cannot_be_is_refused(pose: Array, joints: Array, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        ready().reset(pose, joints)
    text = str(caught.value)
    assert all(word in text for word in words), text
    assert "object" in words or "object" not in text


@pytest.mark.parametrize("substeps", [0, -1])
def test_a_step_of_no_physics_steps_is_refused(substeps: int) -> None:
    with pytest.raises(InputError, match="substeps"):
        ready().step(np.zeros((2, 4)), substeps)


def test_worlds_that_do_not_fit_together_are_refused() -> None:
    with pytest.raises(InputError, match="no objects given; a simulator needs one object for each world"):
        MujocoSimulator(HAND, [])
    with pytest.raises(InputError, match="objects of different shapes in one simulator; use one simulator for each"):
        MujocoSimulator(HAND, [CUBE, OBJECTS["cylinder_40"]])
    with pytest.raises(InputError, match="2 scenes for 3 objects; give one for all or one each"):
        MujocoSimulator(HAND, [CUBE] * 3, [SceneSpec()] * 2)


def test_worlds_of_different_physics_steps_are_refused() -> None:
    with pytest.raises(InputError, match="timestep"):
        MujocoSimulator(HAND, [CUBE] * 2, [SceneSpec(timestep=0.002), SceneSpec(timestep=0.004)])


@pytest.mark.parametrize(
    "changes",
    [
        {"timestep": 0.0},
        {"timestep": -0.004},
        {"floor_friction": -0.2},
        {"floor_friction": np.nan},
        {"gravity": np.nan},
    ],
)
def test_surroundings_that_cannot_be_are_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=next(iter(changes))):
        MujocoSimulator(HAND, [CUBE], SceneSpec(**changes))
