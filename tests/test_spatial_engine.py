"""Laws of the engine of hands in space: gravity, grips that rest, worlds that do not touch each other, going back."""

from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np
import pytest

from inhand.errors import InputError
from inhand.geometry import Array, inverse_quaternion, turn
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.hands.spatial.gravity import gravity_of
from inhand.hands.spatial.hand import Capsule
from inhand.hands.spatial.kinematics import inverse, place, point_jacobian
from inhand.hands.spatial.names import STANDARD, parse_spatial_name
from inhand.hands.spatial.objects import parse_solid_name
from inhand.rotations import placed, quaternion_of
from inhand.sim.engines import engine_in_space, make_simulator
from inhand.sim.scene import SceneSpec
from inhand.sim.spatial_engine import SpatialSimulator
from inhand.sim.spatial_model import build_spatial_model
from inhand.sim.state import State
from inhand.sim.walls import Wall

HAND, CUBE = parse_spatial_name(STANDARD), parse_solid_name("cube_50")
CONTACTS = np.array([[0.0, 0.025, 0.0], [-0.025, -0.008, 0.0], [0.025, -0.008, 0.0]])
NORMALS = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
PALMS = ("up", "down", "sideways")


@lru_cache(maxsize=8)
def fingers_at(off: float) -> Array:
    """Return joint angles that hold the tips a little off three faces of the cube, or inside of it `(n,)`."""
    found = []
    for finger, contact, normal in zip(HAND.fingers, CONTACTS, NORMALS, strict=True):
        goal = placed(HAND.start_pose, contact + (finger.tip_radius + off) * normal)
        joints, misses = inverse(finger, goal[None])
        found.append(joints[0, misses[0].argmin()])
    return np.concatenate(found)


def worlds(gravity: tuple[str, ...] = PALMS) -> SpatialSimulator:
    """Return a world for each way of holding the palm, its object held by the world and the fingers off it."""
    scenes = [SceneSpec(pull=gravity_of(word)) for word in gravity]
    simulator = SpatialSimulator(HAND, [CUBE] * len(scenes), scenes, threads=1)
    simulator.reset(np.tile(HAND.start_pose, (len(scenes), 1)), np.tile(fingers_at(0.006), (len(scenes), 1)))
    return simulator


def gripped(simulator: SpatialSimulator, settle: int = 25) -> State:
    """Close the fingers, let the objects go, and return the state after some steps."""
    count = simulator.n_worlds
    for share in np.linspace(0.1, 1.0, 20):
        simulator.step(np.tile((1 - share) * fingers_at(0.006) + share * fingers_at(-0.004), (count, 1)), 5)
    simulator.let_go(np.ones(count, dtype=bool))
    for _ in range(settle):
        state = simulator.step(np.tile(fingers_at(-0.004), (count, 1)), 5)
    return state


@pytest.fixture(scope="module")
def held() -> tuple[SpatialSimulator, State]:
    simulator = worlds()
    return simulator, gripped(simulator)


def test_an_object_that_nothing_holds_falls_along_gravity() -> None:
    simulator = worlds(("up", "down", "0.6,-0.8,0"))
    start = simulator.measure().object_pose[:, :3]
    np.testing.assert_allclose(start, np.tile(HAND.start_position, (3, 1)), atol=1e-12)
    simulator.let_go(np.ones(3, dtype=bool))
    after = simulator.step(np.tile(fingers_at(0.006), (3, 1)), 5)
    seconds = 5 * simulator.timestep
    np.testing.assert_allclose(after.object_velocity[:, :3], simulator.gravity * seconds, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(after.object_velocity[:, 3:], 0.0, atol=1e-9)


def test_energy_of_an_object_that_turns_in_flight_stays() -> None:
    simulator = worlds(("up",))
    simulator.reset(np.array([[0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0]]), fingers_at(0.006)[None])
    simulator.let_go(np.ones(1, dtype=bool))
    spun = simulator.snapshot()
    spun.qvel[:, -3:] = [3.0, -2.0, 4.0]
    simulator.restore(np.arange(1), replace(spun, qvel=spun.qvel), np.arange(1))
    first = simulator.measure()
    for _ in range(3):
        last = simulator.step(np.tile(fingers_at(0.006), (1, 1)), 5)
    moments = CUBE.mass * CUBE.size[0] ** 2 / 6
    spins = [0.5 * moments * (state.object_velocity[0, 3:] ** 2).sum() for state in (first, last)]
    assert spins[1] == pytest.approx(spins[0], rel=1e-3)
    fallen = CUBE.mass * 9.81 * (first.object_pose[0, 2] - last.object_pose[0, 2])
    assert 0.5 * CUBE.mass * last.object_velocity[0, 2] ** 2 == pytest.approx(fallen, rel=1.1 / 15)  # of 15 steps


def test_the_world_holds_an_object_until_it_is_let_go() -> None:
    simulator = worlds(("down",))
    for _ in range(20):
        state = simulator.step(np.tile(fingers_at(0.006), (1, 1)), 5)
    assert np.abs(state.object_pose[0, :3] - HAND.start_position).max() < 1e-4


def test_forces_of_the_fingers_carry_the_weight_whichever_way_the_palm_looks(
    held: tuple[SpatialSimulator, State],
) -> None:
    simulator, state = held
    assert state.touching.all()
    np.testing.assert_allclose(state.forces.sum(axis=1), -CUBE.mass * simulator.gravity, atol=2e-3)
    assert (np.linalg.norm(state.forces, axis=-1) > 0.5).all()


def slip(state: State) -> Array:
    """Return how fast the object's surface slides over each fingertip where they touch `(B, F)` [m/s]."""
    told, found = place(HAND, state.joint_angles), []
    for i, own in enumerate(HAND.slices):
        point = state.object_points[:, i]
        jacobian = point_jacobian(told.places[:, own], told.axes[:, own], point)
        finger = (jacobian @ state.joint_velocities[:, own, None])[..., 0]
        body = state.object_velocity
        apart = body[:, :3] + np.cross(body[:, 3:], point - state.object_pose[:, :3]) - finger
        normal = state.normals[:, i]
        found.append(np.linalg.norm(apart - (apart * normal).sum(axis=-1, keepdims=True) * normal, axis=-1))
    return np.stack(found, axis=-1)


def test_contacts_at_rest_creep_less_than_a_tenth_of_a_millimetre_a_second(
    held: tuple[SpatialSimulator, State],
) -> None:
    """What the object's surface does under the tips, as feedback hides what its pose would show."""
    simulator, state = held
    before = simulator.snapshot()
    for _ in range(10):
        state = simulator.step(state.targets, 5)
        normal = (state.forces * state.normals).sum(axis=-1)
        aside = np.linalg.norm(state.forces - normal[..., None] * state.normals, axis=-1)
        assert (aside < 0.8 * HAND.friction * CUBE.friction * normal).all()  # no contact is at its limit
        assert 1e3 * slip(state).max() < 0.1
    simulator.restore(np.arange(3), before, np.arange(3))


def test_normals_point_into_the_faces_that_are_touched(held: tuple[SpatialSimulator, State]) -> None:
    state = held[1]
    own = turn(inverse_quaternion(state.object_pose[:, None, 3:]), state.normals)
    np.testing.assert_allclose(own, np.tile(-NORMALS, (3, 1, 1)), atol=1e-6)
    assert np.abs(np.linalg.norm(state.object_points - state.finger_points, axis=-1) - np.abs(state.gaps)).max() < 1e-8


def test_fingertips_do_not_sag_under_their_own_weight() -> None:
    simulator = worlds(("0.3,0.5,-0.8",))
    for _ in range(40):
        state = simulator.step(np.tile(fingers_at(0.006), (1, 1)), 5)
    assert np.abs(state.joint_angles[0] - fingers_at(0.006)).max() < 1e-6


def test_a_world_goes_the_same_way_alone_and_in_a_batch(held: tuple[SpatialSimulator, State]) -> None:
    alone = worlds(("sideways",))
    state = gripped(alone)
    for field in fields(State):
        np.testing.assert_array_equal(getattr(state, field.name)[0], getattr(held[1], field.name)[2])


def test_worlds_put_back_go_on_to_the_same_bytes_held_or_not() -> None:
    simulator = worlds(("up", "down"))
    closing = np.tile(fingers_at(-0.004), (2, 1))
    simulator.let_go(np.array([False, True]))
    for _ in range(4):
        simulator.step(closing, 5)
    kept = simulator.snapshot()
    first = [simulator.step(closing, 5) for _ in range(4)]
    simulator.let_go(np.ones(2, dtype=bool))
    simulator.step(closing, 5)
    simulator.restore(np.arange(2), kept, np.arange(2))
    again = [simulator.step(closing, 5) for _ in range(4)]
    for one, other in zip(first, again, strict=True):
        for field in fields(State):
            np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name))
    assert np.abs(first[-1].object_pose[0, 2] - HAND.start_position[2]) < 1e-3  # still held


def test_worlds_of_different_masses_and_gravities_stand_in_one_batch() -> None:
    spec, scenes = (CUBE, replace(CUBE, mass=0.1)), [SceneSpec(pull=gravity_of(word)) for word in ("up", "down")]
    simulator = SpatialSimulator(HAND, spec, scenes, threads=1)
    simulator.reset(np.tile(HAND.start_pose, (2, 1)), np.tile(fingers_at(0.006), (2, 1)))
    simulator.let_go(np.ones(2, dtype=bool))
    simulator.push(np.arange(2), np.tile([0.001, 0.0, 0.0], (2, 1)))
    state = simulator.step(np.tile(fingers_at(0.006), (2, 1)), 5)
    np.testing.assert_allclose(state.object_velocity[:, 2], [-9.81 * 0.02, 9.81 * 0.02], rtol=1e-6)
    np.testing.assert_allclose(state.object_velocity[:, 0], [0.02, 0.01], rtol=1e-6)


def test_a_world_that_breaks_down_is_told_and_the_others_do_not_notice(
    held: tuple[SpatialSimulator, State], tmp_path: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(str(tmp_path))  # MuJoCo writes its warnings to a file in the working directory
    simulator, state = held
    kept = simulator.snapshot()
    well = simulator.step(state.targets, 5)
    wild = replace(kept, qvel=np.where(np.arange(3)[:, None] == 1, 1e30, kept.qvel))
    simulator.restore(np.arange(3), wild, np.arange(3))
    ill = simulator.step(state.targets, 5)
    np.testing.assert_array_equal(ill.diverged, [False, True, False])
    np.testing.assert_array_equal(ill.object_pose[[0, 2]], well.object_pose[[0, 2]])
    assert np.isfinite(ill.object_pose).all()
    simulator.restore(np.arange(3), kept, np.arange(3))


@pytest.mark.parametrize("name", ["cylinder_50x60", "sphere_50", "ellipsoid_60x50x40", "box_40x50x60"])
def test_models_have_the_mass_and_the_moments_of_the_solid(name: str) -> None:
    """MuJoCo's own of the same shape, which it computes from the density."""
    spec = parse_solid_name(name)
    model = build_spatial_model(HAND, spec, SceneSpec())
    own = mujoco.MjSpec()
    shape = model.geom("object")
    own.worldbody.add_body(name="b").add_geom(type=int(shape.type[0]), size=shape.size, mass=spec.mass)
    body = own.compile().body("b")
    np.testing.assert_allclose(np.sort(model.body("object").inertia), np.sort(body.inertia), rtol=1e-9)
    assert model.body("object").mass[0] == pytest.approx(spec.mass)


def test_the_object_turns_about_where_the_world_puts_it() -> None:
    pose = np.concatenate([[0.004, -0.002, 0.09], quaternion_of(np.array([0.2, -0.1, 0.3]))])
    state = worlds(("up",)).reset(pose[None], fingers_at(0.02)[None])
    np.testing.assert_allclose(state.object_pose[0], pose, atol=1e-12)
    assert not state.touching.any()


def test_what_no_hand_in_space_has_is_refused() -> None:
    walls = SceneSpec(walls=(Wall((0.0, 0.2), -90.0),))
    with pytest.raises(InputError, match="walls with a hand in space"):
        SpatialSimulator(HAND, [CUBE], walls)
    with pytest.raises(InputError, match="objects of different shapes"):
        SpatialSimulator(HAND, [CUBE, parse_solid_name("sphere_50")])
    with pytest.raises(InputError, match=r"object poses of shape \(1, 3\); 1 worlds need \(1, 7\)"):
        worlds(("up",)).reset(np.zeros((1, 3)), fingers_at(0.006)[None])
    with pytest.raises(InputError, match="a position and a quaternion"):
        worlds(("up",)).reset(np.full((1, 7), np.nan), fingers_at(0.006)[None])
    with pytest.raises(InputError, match="three finite numbers"):
        SceneSpec(pull=(0.0, np.inf, 0.0))


def test_make_simulator_knows_hands_in_space() -> None:
    assert isinstance(make_simulator("mujoco", HAND, [CUBE]), SpatialSimulator)
    assert engine_in_space("planar") == "mujoco"
    with pytest.raises(InputError, match="runs in mujoco alone"):
        engine_in_space("bullet")
    with pytest.raises(InputError, match="of the plane and of space in one simulator"):
        make_simulator("mujoco", HAND, [OBJECTS["cube_39"]])
    with pytest.raises(InputError, match="of the plane and of space in one simulator"):
        make_simulator("planar", parse_hand_name("2v2_50.50_50.50_1.1_53"), [CUBE])


def test_a_capsule_without_a_length_is_a_ball_and_knuckles_that_overlap_do_not_push() -> None:
    first = HAND.fingers[0]
    knuckle = Capsule((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.08)  # wide enough to reach into the others
    base = replace(first.links[0], capsules=(knuckle,))
    wide = replace(HAND, fingers=(replace(first, links=(base, *first.links[1:])), *HAND.fingers[1:]))
    plain, made = (build_spatial_model(hand, CUBE, SceneSpec()) for hand in (HAND, wide))
    assert made.geom("finger_0_0_0").type == mujoco.mjtGeom.mjGEOM_SPHERE
    pairs = [
        {made.geom(int(each)).name for each in pair} for pair in zip(made.pair_geom1, made.pair_geom2, strict=True)
    ]
    assert {"finger_0_0_0", "object"} in pairs
    assert {"finger_0_0_0", "finger_1_1_0"} not in pairs
    assert {"finger_0_2_0", "finger_1_2_0"} in pairs
    assert made.npair > plain.npair


def test_targets_that_lag_arrive_world_by_world_and_nothing_else_differs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if every physics step were asked for alone; a world that diverges is put back, one that is still stays."""
    monkeypatch.chdir(tmp_path)  # where MuJoCo writes its log of warnings
    lags, still = np.array([0, 2, 4]), np.array([True, True, False])
    for wild in (False, True):
        one, other = worlds(), worlds()
        before = gripped(one, 2)
        gripped(other, 2)
        targets = before.targets + 0.02
        if wild:
            for each in (one, other):
                each.push(np.array([1]), np.array([[0.0, 0.0, 1e8]]))
        one.lag = lags
        found = one.step(targets, 5, still)
        for step in range(5):
            expected = other.step(np.where((lags <= step)[:, None], targets, before.targets), 1, still)
        rows = [0, 2] if wild else [0, 1, 2]
        for part in fields(State):
            a, b = (np.asarray(getattr(each, part.name))[rows] for each in (found, expected))
            assert a.tobytes() == b.tobytes(), part.name
        assert found.diverged.tolist() == expected.diverged.tolist() == [False, wild, False]
        assert found.time[1] == expected.time[1]
