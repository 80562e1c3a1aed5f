"""PyBullet behind the same interface: same numbers where physics is plain, the same grip, and the expert survives."""

import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from inhand.control.catalogue import find_controller, rough_grasp
from inhand.control.controller import Task
from inhand.control.loop import Recording, run_episodes
from inhand.control.phases import standard_phases
from inhand.errors import InputError
from inhand.geometry import Path, turn
from inhand.hands.grasp_search import moved_along
from inhand.hands.hand import FINGER_NAMES, HandSpec, lab_limits
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import parse_object_name
from inhand.sim.bullet_engine import BulletSimulator
from inhand.sim.bullet_model import build_world, load_pybullet, touching_pairs
from inhand.sim.bullet_servo import FINER, added_inertia, servos_of
from inhand.sim.engine import Simulator
from inhand.sim.model import build_model
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.scene import FAR, SceneSpec
from inhand.sim.state import State
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import parse_directions

pytest.importorskip("pybullet", reason='PyBullet is an extra: pip install "inhand[bullet]"')

HAND = parse_hand_name("2v2_50.50_50.50_1.1_53")
THREE_LINKS = parse_hand_name("3v3_25.40.35_40.35.25_1.1_63")
CUBE = parse_object_name("cube_39")
ORIGIN = HAND.start_pose
OPEN = np.array([0.9, -0.4, -0.8, 0.3])


def squeezed(simulator: Simulator, seconds: float) -> list[State]:
    """Close on the middle of the object's sides in 0.4 s, hold those targets, and return the states while held."""
    grasp = rough_grasp(HAND, CUBE, ORIGIN[None, None])
    simulator.reset(ORIGIN[None], grasp.opened)
    for share in np.linspace(0.05, 1.0, 20):
        simulator.step(grasp.opened + share * (grasp.closed - grasp.opened), 5)
    return [simulator.step(grasp.closed, 5) for _ in range(round(seconds / 0.02))]


def expert_right(simulator: Simulator) -> Recording:
    """Run the expert's episode towards the right in one world."""
    entry, path = find_controller("ik-cautious"), straight_path(parse_directions("Right")[0])
    grasp = entry.grasp(HAND, CUBE, (ORIGIN + path.poses)[None])
    task = Task(HAND, simulator.objects, Path(path.poses[None]), simulator.timestep)
    start = simulator.reset(ORIGIN[None], grasp.opened)
    return run_episodes(simulator, task, standard_phases(grasp, entry.manipulate), start)


@pytest.mark.parametrize("hand", [HAND, THREE_LINKS], ids=lambda hand: hand.name)
@pytest.mark.parametrize("name", ["cube_39", "cylinder_40", "ellipse_25x40"])
def test_both_engines_measure_the_same_at_rest(hand: HandSpec, name: str) -> None:
    spec = parse_object_name(name)
    poses = np.array([[*hand.start_position, 0.0], [0.004, hand.start_position[1] - 0.005, 0.1]])
    joints = rough_grasp(hand, spec, poses[:1, None]).opened.repeat(2, axis=0)
    ours, witness = (engine(hand, [spec, spec]).reset(poses, joints) for engine in (MujocoSimulator, BulletSimulator))
    for field in fields(State):
        expected, found = getattr(ours, field.name), getattr(witness, field.name)
        assert (found.shape, found.dtype) == (expected.shape, expected.dtype), field.name
        tolerance = 5e-4 if field.name == "link_gaps" else 3e-4  # PyBullet rounds corners by 1 mm
        if name == "cylinder_40" and field.name.endswith("_points"):
            tolerance = 1.4e-3  # the witness's cylinder has sides, half of 2.6 mm to either side of the nearest point
        if field.name.endswith("_points"):
            expected, found = expected[..., :2], found[..., :2]  # upright faces are as near at any height
        np.testing.assert_allclose(found, expected, atol=tolerance, err_msg=field.name)


def test_a_step_advances_time_and_keeps_the_targets() -> None:
    simulator = BulletSimulator(HAND, [CUBE])
    before = simulator.reset(ORIGIN[None], OPEN[None])
    targets = OPEN[None] + 0.1
    after = simulator.step(targets, 5)
    assert (before.time[0], after.time[0]) == (0.0, pytest.approx(0.02))
    np.testing.assert_array_equal(after.targets, OPEN[None] + 0.1)
    assert not np.shares_memory(after.targets, targets)
    assert (after.joint_velocities > 0.1).all()
    np.testing.assert_array_equal(before.joint_angles, OPEN[None])


def test_servos_reach_their_targets_and_stop_at_the_joint_limits() -> None:
    hand = lab_limits(HAND)
    simulator = BulletSimulator(hand, [CUBE])
    state = simulator.reset(ORIGIN[None], OPEN[None])
    for _ in range(50):
        state = simulator.step(np.array([[1.2, 0.5, -1.2, -0.5]]), 5)  # outwards beyond straight distal joints
    np.testing.assert_allclose(state.joint_angles[0], [1.2, 0.0, -1.2, 0.0], atol=2e-3)


@pytest.mark.parametrize("hand", [HAND, THREE_LINKS], ids=lambda hand: hand.name)
def test_joints_answer_as_in_mujoco(hand: HandSpec) -> None:
    """Also with other gains. MuJoCo moves joints by the speed at a step's end, so its longer steps run ahead."""
    ahead = (1 - 1 / FINER) / 2
    n, away = hand.n_joints, np.array([[0.0, 0.5, 0.0]])
    hands = [
        hand,
        replace(hand, armature=1e-4, damping=0.05),
        replace(hand, stiffness=1.0, damping=0.4),
        replace(hand, torque=0.05),
    ]
    far = away.repeat(len(hands), axis=0)
    for step in (0.05 * np.eye(n)[0], 0.05 * np.eye(n)[1], np.where(np.arange(n) % 2, -0.3, 0.3)):
        ours, witness = (engine(hands, [CUBE] * len(hands)) for engine in (MujocoSimulator, BulletSimulator))
        start = np.full((len(hands), n), 0.2)
        gone = []
        for simulator in (ours, witness):
            simulator.reset(far, start)
            states = [simulator.step(start + step, 1) for _ in range(30)]
            gone.append(np.array([state.joint_angles - start for state in states]) / np.abs(step).max())
        later = (1 - ahead) * gone[1][:-1] + ahead * gone[1][1:]
        assert np.abs(gone[0][:-1] - later).max() < 0.03
        assert np.abs(gone[0][-1]).max() > 0.1


def test_a_hand_that_gives_no_way_is_pushed_by_what_its_servos_say() -> None:
    """Half the stiffness or the torque presses half as hard, and the damping then does nothing; as in MuJoCo."""
    hands = [HAND, replace(HAND, stiffness=2.5), replace(HAND, damping=0.5), replace(HAND, torque=0.025)]
    grasp, forces = rough_grasp(HAND, CUBE, ORIGIN[None, None]), []
    for engine in (MujocoSimulator, BulletSimulator):
        simulator = engine(hands, [CUBE] * len(hands))
        simulator.reset(np.tile(ORIGIN, (4, 1)), grasp.opened.repeat(4, axis=0))
        closed = grasp.closed + 0.4 * (grasp.closed - grasp.opened)
        for _ in range(40):
            state = simulator.step(closed.repeat(4, axis=0), 5)
        forces.append(np.abs(state.forces[:, :, 0]).mean(axis=1))
    np.testing.assert_allclose(forces[1], forces[0], rtol=0.06)
    np.testing.assert_allclose(forces[1][1:3] / forces[1][0], [0.5, 1.0], rtol=0.06)
    assert forces[1][3] < 0.5 * forces[1][0]
    np.testing.assert_allclose(state.penetration[0], 2.5e-4, atol=1e-4)


def test_fingertips_that_slide_rub_with_the_product_of_both_frictions() -> None:
    simulator = BulletSimulator(HAND, [replace(CUBE, mass=10.0, friction=0.6)], SceneSpec(floor_friction=1.0))
    grasp = rough_grasp(HAND, CUBE, ORIGIN[None, None])
    simulator.reset(ORIGIN[None], grasp.opened)
    joints = (grasp.closed + 0.4 * (grasp.closed - grasp.opened))[0]
    state = simulator.step(joints[None], 100)
    for _ in range(15):
        for place, finger, point in zip(HAND.slices, HAND.fingers, state.finger_points[0, :, :2], strict=True):
            joints[place] = moved_along(finger, joints[place], point, np.array([0.0, 5e-4]))
        state = simulator.step(joints[None], 5)
    np.testing.assert_allclose(state.forces[0, :, 1] / np.abs(state.forces[0, :, 0]), 0.3, rtol=0.05)


def test_links_and_servos_share_what_rotors_and_damping_add() -> None:
    servos, step = servos_of([THREE_LINKS], 0.004), 0.004
    whole = added_inertia(THREE_LINKS, step)
    assert whole == pytest.approx(1e-3 + 0.15 * (step + step / FINER) / 2)
    engine = load_pybullet()
    client = engine.connect(engine.DIRECT)
    masses = []
    for hand in (THREE_LINKS, replace(THREE_LINKS, armature=0.0, damping=0.0)):
        world = build_world(engine, client, hand, CUBE, SceneSpec())
        masses.append(np.array(engine.calculateMassMatrix(world.hand, [0.3] * 6, physicsClientId=client)))
    engine.disconnect(client)
    np.testing.assert_allclose(masses[0] + servos.missing[0], masses[1] + whole * np.eye(6), atol=1e-12)


def test_the_object_rests_on_the_plane() -> None:
    simulator = BulletSimulator(HAND, [CUBE])
    simulator.reset(ORIGIN[None], OPEN[None])
    state = simulator.step(OPEN[None], 125)
    np.testing.assert_allclose(state.object_pose[0, :3], [*HAND.start_position, CUBE.height / 2], atol=5e-4)
    np.testing.assert_allclose(state.object_pose[0, 3:], [1, 0, 0, 0], atol=2e-3)
    assert np.abs(state.object_velocity).max() < 5e-3


def test_the_gripped_cube_is_held_alike_in_both_engines() -> None:
    ours, witness = (squeezed(engine(HAND, [CUBE]), 0.5) for engine in (MujocoSimulator, BulletSimulator))
    assert all(state.touching.all() for state in ours + witness)
    np.testing.assert_allclose(witness[-1].pose[0, :2], ours[-1].pose[0, :2], atol=2e-3)
    assert abs(witness[-1].pose[0, 2] - ours[-1].pose[0, 2]) < np.deg2rad(2)
    np.testing.assert_array_equal(witness[-1].contact_links, [[1, 1]])


def test_masses_and_frictions_are_those_of_the_specs_after_every_build() -> None:
    engine = load_pybullet()
    client = engine.connect(engine.DIRECT)
    build_world(engine, client, HAND, CUBE, SceneSpec())
    spec = replace(CUBE, mass=0.042, friction=0.8)
    world = build_world(engine, client, HAND, spec, SceneSpec(floor_friction=0.15))
    parts = [(world.floor, -1), (world.object, -1), *((world.hand, link) for link in range(-1, 4))]
    found = [engine.getDynamicsInfo(*part, physicsClientId=client)[:2] for part in parts]
    bodies = engine.getNumBodies(physicsClientId=client)
    engine.disconnect(client)
    assert found == [(0.0, 0.15), (0.042, 0.8), (0.0, 0.5), *[(0.036, 0.5)] * 4]
    assert bodies == 3


def test_nothing_but_friction_slows_a_sliding_object() -> None:
    engine = load_pybullet()
    client = engine.connect(engine.DIRECT)
    speeds = []
    for friction in (0.0, 0.1):
        world = build_world(engine, client, HAND, CUBE, SceneSpec(floor_friction=friction))
        away = [0.0, 0.5, CUBE.height / 2]
        engine.resetBasePositionAndOrientation(world.object, away, [0, 0, 0, 1], physicsClientId=client)
        engine.resetBaseVelocity(world.object, [0.0, 0.5, 0.0], physicsClientId=client)
        for _ in range(50 * FINER):
            engine.stepSimulation(client)
        speeds.append(engine.getBaseVelocity(world.object, physicsClientId=client)[0][1])
    engine.disconnect(client)
    assert speeds[0] == pytest.approx(0.5, abs=1e-3)
    assert speeds[1] == pytest.approx(0.5 - 0.1 * 9.81 * 0.2, abs=0.02)  # v - mu g t


def test_the_expert_carries_the_object_without_letting_go() -> None:
    recording = expert_right(BulletSimulator(HAND, [CUBE]))
    manipulated = [state for state, phase in zip(recording.states, recording.phase, strict=True) if phase == 2]
    moved = manipulated[-1].pose[0] - manipulated[0].pose[0]
    assert recording.outcomes == ("reached",)
    assert moved[0] > 0.08
    assert abs(moved[1]) < 0.01
    assert np.mean([state.touching.all() for state in manipulated]) > 0.95


def test_the_same_start_gives_the_same_bytes_also_after_another_episode() -> None:
    simulator = BulletSimulator(HAND, [CUBE, CUBE])
    first: list[State] = []
    second: list[State] = []
    grasp = rough_grasp(HAND, CUBE, np.tile(ORIGIN, (2, 1, 1)))
    for run in (first, second):
        run.append(simulator.reset(np.tile(ORIGIN, (2, 1)), grasp.opened))
        run.extend(simulator.step(grasp.closed, 5) for _ in range(20))
    for one, other in zip(first, second, strict=True):
        for field in fields(State):
            assert getattr(one, field.name).tobytes() == getattr(other, field.name).tobytes(), field.name


def test_worlds_do_not_disturb_each_other() -> None:
    heavy = replace(CUBE, mass=0.045)
    together = squeezed_pair(BulletSimulator(HAND, [CUBE, heavy]))
    alone = squeezed_pair(BulletSimulator(HAND, [heavy]))
    np.testing.assert_array_equal(together.object_pose[1], alone.object_pose[0])
    np.testing.assert_array_equal(together.joint_angles[1], alone.joint_angles[0])


def squeezed_pair(simulator: Simulator) -> State:
    """Squeeze the object of every world for 0.2 s."""
    count = len(simulator.objects)
    grasp = rough_grasp(HAND, CUBE, np.tile(ORIGIN, (count, 1, 1)))
    simulator.reset(np.tile(ORIGIN, (count, 1)), grasp.opened)
    return simulator.step(grasp.closed, 50)


@pytest.mark.parametrize("hand", [HAND, THREE_LINKS], ids=lambda hand: hand.name)
def test_the_same_pairs_can_touch_as_in_mujoco(hand: HandSpec) -> None:
    engine = load_pybullet()
    client = engine.connect(engine.DIRECT)
    world = build_world(engine, client, hand, CUBE, SceneSpec())
    engine.disconnect(client)
    names = {(world.hand, -1): "palm", (world.object, -1): "object", (world.floor, -1): "floor"}
    for i, (finger, link) in enumerate((f, k) for f in (0, 1) for k in range(len(hand.fingers[f].links))):
        names[world.hand, i] = f"{FINGER_NAMES[finger]}_{link}"
    model = build_model(hand, CUBE, SceneSpec())
    parts = [  # palm and floor both belong to MuJoCo's world body, 0
        model.body(body).name if body else model.geom(geom).name for geom, body in enumerate(model.geom_bodyid)
    ]
    expected = {frozenset((parts[i], parts[j])) for i, j in zip(model.pair_geom1, model.pair_geom2, strict=True)}
    assert {frozenset((names[one], names[other])) for one, other in touching_pairs(world, hand)} == expected


def test_a_far_object_reads_as_far() -> None:
    state = BulletSimulator(HAND, [CUBE]).reset(np.array([[0.0, 3.0, 0.0]]), OPEN[None])
    np.testing.assert_array_equal(state.link_gaps, np.full((1, 4), FAR))
    assert not state.touching.any()


def test_connections_close_with_the_simulator() -> None:
    engine = load_pybullet()
    before = {client for client in range(64) if engine.isConnected(client)}
    simulator = BulletSimulator(HAND, [CUBE, CUBE])
    opened = {client for client in range(64) if engine.isConnected(client)} - before
    del simulator
    assert len(opened) == 2
    assert not any(engine.isConnected(client) for client in opened)


def test_bad_input_is_refused() -> None:
    simulator = BulletSimulator(HAND, [CUBE])
    with pytest.raises(InputError, match=r"step\(\) before reset\(\): place objects and joints with reset\(\) first"):
        simulator.step(OPEN[None], 5)
    simulator.reset(ORIGIN[None], OPEN[None])
    with pytest.raises(InputError, match=r"the target of joint 1 in world 0 is nan; commands must be finite"):
        simulator.step(np.array([[0.0, np.nan, 0.0, 0.0]]), 5)
    with pytest.raises(InputError, match=r"joint targets of shape \(1, 3\); 1 worlds need \(1, 4\)"):
        simulator.step(OPEN[None, :3], 5)
    with pytest.raises(InputError, match=r"no objects given; a simulator needs one object for each world"):
        BulletSimulator(HAND, [])
    with pytest.raises(InputError, match=r"2 scenes for 1 objects; give one for all or one each"):
        BulletSimulator(HAND, [CUBE], [SceneSpec(), SceneSpec()])


def test_a_missing_engine_names_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pybullet", None)
    with pytest.raises(
        InputError, match=r"the engine PyBullet needs the extra `bullet`: pip install 'inhand\[bullet\]'"
    ):
        BulletSimulator(HAND, [CUBE])


@pytest.mark.parametrize("thing", ["cube_39", "triangle"])
def test_a_snapshot_keeps_a_tilted_objects_spin_in_its_own_frame(thing: str) -> None:
    """Also of one whose mass is centred off its origin."""
    simulator = BulletSimulator(HAND, [parse_object_name(thing)])
    state = simulator.reset(ORIGIN[None], OPEN[None])
    quaternion, spin = np.array([0.8, 0.36, -0.48, 0.0]), np.array([0.3, -0.5, 0.7])
    kept = simulator.snapshot()
    kept.qpos[0, -4:], kept.qvel[0, -3:] = quaternion, spin
    simulator.restore(np.array([0]), kept, np.array([0]))
    np.testing.assert_allclose(simulator.snapshot().qvel, kept.qvel, atol=1e-12)
    seen = simulator.measure().object_velocity[0, 3:]
    np.testing.assert_allclose(seen, turn(quaternion, spin), atol=1e-12)
    assert np.abs(seen - spin).max() > 0.1
    np.testing.assert_array_equal(state.object_velocity, 0.0)
