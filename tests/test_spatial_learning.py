"""Learning with a hand in space: what is asked and seen, a teacher, worlds under their own gravities, environments."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="environments need the extra `rl`: pip install 'inhand[rl]'")

import gymnasium
from gymnasium.utils.env_checker import check_env

import inhand
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array
from inhand.hands.spatial.grasp_search import SpatialGrasp
from inhand.hands.spatial.gravity import GRAVITY, PALMS
from inhand.hands.spatial.kinematics import damped_least_squares, place, point_jacobian
from inhand.hands.spatial.pair import SpatialPair
from inhand.learning import space_pools, spatial_environment
from inhand.learning.config import Training
from inhand.learning.environments import SpatialAsteriskEnv, SpatialAsteriskVectorEnv
from inhand.learning.experts import expert_of
from inhand.learning.presets import privileged_spatial
from inhand.learning.recipe import SpatialRecording
from inhand.learning.run_cards import check
from inhand.learning.space import space_of
from inhand.learning.space_pools import (
    NEVER,
    NEVER_DEG,
    UNSEEN,
    Planned,
    gravities,
    gripped,
    names_of,
    pool_of,
)
from inhand.learning.starts import Noise, Starts, joined
from inhand.learning.worlds import Interface, ManipulationWorlds
from inhand.rotations import carried, matrix_of, pose_from
from inhand.sim.spatial_engine import SpatialSimulator
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import Scene, by_rank, observe
from inhand.tasks.spatial.aims import SpatialAim
from inhand.tasks.spatial.primitives import parse_spatial_directions
from inhand.tasks.spatial.rows import COLUMNS, DAMPING, gravity_in, grip_forces
from test_spatial_engine import CONTACTS, CUBE, HAND, NORMALS, fingers_at

HELD = SpatialPair(HAND, CUBE)
PLAIN = SpatialGrasp(CONTACTS, NORMALS, fingers_at(0.0), 0.05, 0.05)
"""A grip on three side faces."""
ASKED = parse_spatial_directions("Out,Up,In-Left,turn+x")
PULLS = GRAVITY * np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.6, 0.0, 0.8]])
SEEN = Interface("space", "steps", "progress", horizon=80)
WAY = 0.01
"""Way that is asked for [m]."""


@pytest.fixture(scope="module")
def starts() -> Starts:
    """One start of each primitive, each under a gravity of its own."""
    found = gripped(HELD, [PLAIN] * len(ASKED), space_of(ASKED, PULLS), np.random.default_rng(3), Noise())
    assert len(found) == len(ASKED)
    return replace(found, distance=np.full(len(found), WAY))


def in_space(config: Training) -> SpatialRecording:
    """Return what a training with a hand in space records."""
    found = config.shows
    assert isinstance(found, SpatialRecording)
    return found


def worlds_of(starts: Starts) -> ManipulationWorlds:
    return ManipulationWorlds(HELD, starts, len(starts), SEEN, np.random.default_rng(0), threads=1)


# What is asked.


def aim_of(along: Array, about: Array) -> SpatialAim:
    start = pose_from(HAND.start_pose[None], np.zeros(3), np.array([0.1, -0.2, 0.3]))
    return SpatialAim(along[None], about[None], start, np.array([0.05]))


def test_a_shift_tells_the_way_along_beside_and_turned() -> None:
    along = np.array([0.0, 0.6, 0.8])
    aim = aim_of(along, np.zeros(3))
    pose = pose_from(aim.start, 0.02 * along + 0.003 * np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.05]))
    np.testing.assert_allclose(aim.shift(pose), [[0.02, 0.003, 0.05]], atol=1e-12)
    np.testing.assert_allclose(aim.left(pose), [0.03], atol=1e-12)
    np.testing.assert_allclose(aim.off_by(pose), [[0.003, 0.0, 0.0, 0.0, 0.0, 0.05]], atol=1e-12)


@pytest.mark.parametrize("degrees", [-20.0, 90.0, 200.0, 270.0])
def test_a_turn_is_counted_past_half_a_turn(degrees: float) -> None:
    axis, angle = np.array([0.6, 0.0, 0.8]), np.deg2rad(degrees)
    aim = aim_of(np.zeros(3), axis)
    turned = pose_from(aim.start, np.array([0.0, 0.002, 0.0]), angle * axis)
    aside = pose_from(turned, np.zeros(3), np.array([0.0, 0.04, 0.0]))
    np.testing.assert_allclose(aim.shift(turned), [[TURN_ARM * angle, 0.002, 0.0]], atol=1e-12)
    come, _, off = aim.shift(aside)[0]
    assert abs(come - TURN_ARM * angle) < 1e-3
    assert 0.03 < off <= 0.041


def test_speed_and_motion_are_those_of_the_way(starts: Starts) -> None:
    worlds = worlds_of(starts)
    worlds.reset(np.arange(len(starts)))
    moving = replace(worlds.state, object_velocity=0.03 * worlds.aim.motion)
    np.testing.assert_allclose(worlds.aim.speed(moving), np.full(len(starts), 0.03), atol=1e-12)


# What is seen.


def test_steps_of_a_row_carry_the_contacts_on(starts: Starts) -> None:
    worlds = worlds_of(starts)
    state, aim, seen = worlds.state, worlds.aim, worlds.reset(np.arange(len(starts)))
    assert seen.shape == (len(starts), find_layout("space").size(HAND)) == (len(starts), 171)
    names = [name for name, _ in COLUMNS]
    k, n = names.index("step for 1 mm on [rad]"), HAND.n_joints
    rows = seen[:, k * n : (k + 1) * n] * COLUMNS[k][1]
    state, told = worlds.state, place(HAND, worlds.state.joint_angles)
    for i, own in enumerate(HAND.slices):
        jacobian = point_jacobian(told.places[:, own], told.axes[:, own], state.object_points[:, i])
        moved = (jacobian * rows[:, None, own]).sum(axis=-1)
        wanted = carried(1e-3 * worlds.aim.motion, state.object_points[:, i] - state.object_pose[:, :3])
        assert np.abs(moved - wanted).max() < 1e-4
        np.testing.assert_allclose(rows[:, own], damped_least_squares(jacobian, wanted, DAMPING), atol=1e-9)
    assert aim.along.shape == (len(starts), 3)


def test_forces_of_the_rows_carry_the_weight(starts: Starts) -> None:
    scene = Scene(HAND, (CUBE,) * len(starts), gravity=starts.asked_in_space.gravity)
    forces = grip_forces(starts.state, scene)
    np.testing.assert_allclose(forces.sum(axis=1), -CUBE.mass * starts.asked_in_space.gravity, atol=2e-3)
    inward = (forces * starts.state.normals).sum(axis=-1)
    assert (inward > 0.4).all()


def test_table_3_1_of_the_thesis_is_told_in_space(starts: Starts) -> None:
    """Its numbers are those of the state over their ranges, joints by their rank as in the plane."""
    layout, state, aim = find_layout("space-thesis"), starts.state, worlds_of(starts).asked
    seen = observe(layout, state, aim, Scene(HAND, (CUBE,) * len(starts)))  # gravity is none of them
    assert seen.shape == (len(starts), layout.size(HAND)) == (len(starts), 63)
    groups = np.split(seen, np.cumsum([part.size(HAND) for part in layout.parts])[:-1], axis=1)
    along, about, place_, axes, size, gaps, ends, angles = groups
    np.testing.assert_allclose(np.hstack([along, about]), np.hstack([aim.along, aim.about]))
    reach, ranks = 1.5 * HAND.finger_length, by_rank(HAND)
    np.testing.assert_allclose(place_ * (reach, reach, reach / 2) + (0, 0, reach / 2), state.object_pose[:, :3])
    np.testing.assert_allclose(axes.reshape(-1, 3, 2), matrix_of(state.object_pose[:, 3:])[..., :2])
    np.testing.assert_allclose(0.06 * (size + 1), np.tile(CUBE.size, (len(starts), 1)))
    assert (gaps[:, :3] == 1).all()  # an abduction has no body
    np.testing.assert_allclose(reach / 2 * (gaps + 1)[:, 3:], np.maximum(state.link_gaps[:, ranks[3:]], 0), atol=1e-9)
    low, high = HAND.limits[ranks].T
    np.testing.assert_allclose(low + (angles + 1) / 2 * (high - low), state.joint_angles[:, ranks])
    where, tips = reach * ends.reshape(len(starts), 3, 3, 3), place(HAND, state.joint_angles).tips
    np.testing.assert_allclose(where[:, -1], tips, atol=1e-12)
    lengths = np.linalg.norm(np.diff(where, axis=1), axis=-1)
    np.testing.assert_allclose(lengths, 0.06, atol=1e-12)  # both links of every finger


def test_a_scene_of_the_plane_has_no_gravity_of_its_own(starts: Starts) -> None:
    with pytest.raises(ValueError, match="does not tell gravity"):
        observe(find_layout("space"), starts.state, worlds_of(starts).aim, Scene(HAND, (CUBE,) * len(starts)))


# Worlds and the teacher.


def test_the_teacher_carries_every_object_as_far_as_it_is_asked(starts: Starts) -> None:
    """It turns more slowly than it moves, and presses harder than the expert."""
    worlds, ways = worlds_of(starts), []
    worlds.reset(np.arange(len(starts)))
    teach = expert_of("teacher", HELD, starts, worlds)
    assert np.array_equal(teach(), teach())  # it remembers nothing
    for _ in range(SEEN.horizon - 1):
        step = worlds.step(worlds.actions_of(teach()))
        assert not step.terminated.any()
        ways.append(step.shift[:, 0])
    first, turning = (np.array(ways) > 0.7 * WAY).argmax(axis=0), worlds.asked.turning
    assert first[turning].min() > first[~turning].max() + 1
    assert (worlds.state.forces * worlds.state.normals).sum(axis=-1).mean() > 3.3
    along, across, turned = step.shift.T
    np.testing.assert_allclose(along, WAY, atol=6e-4)
    assert across.max() < 6e-4
    assert np.rad2deg(turned.max()) < 1.5


def test_each_world_has_the_gravity_of_its_start(starts: Starts) -> None:
    """Also after worlds have changed places; a world goes as it does alone, and on from what it kept, byte for byte."""
    rows = np.array([2, 0, 3, 1])
    worlds, alone = worlds_of(starts), worlds_of(starts.rows(np.array([3])))
    seen = worlds.reset(rows)
    assert np.array_equal(gravity_in(worlds.scene), PULLS[rows])
    assert isinstance(worlds.simulator, SpatialSimulator)
    assert np.array_equal(worlds.simulator.gravity, PULLS[rows])
    assert np.array_equal(alone.reset(np.array([0]))[0], seen[2])
    actions = 0.1 * np.random.default_rng(1).uniform(-1, 1, (4, len(rows), HAND.n_joints))
    for number, action in enumerate(actions):
        if number == 2:
            kept = worlds.state_dict()
        found, own = worlds.step(action), alone.step(action[2:3])
    assert np.array_equal(own.successor[0], found.successor[2])
    other = worlds_of(starts)
    other.load_state_dict(kept)
    for action in actions[2:]:
        again = other.step(action)
    assert np.array_equal(again.successor, found.successor)
    assert np.array_equal(again.reward, found.reward)


def test_pools_are_joined_and_taken_with_what_is_asked(starts: Starts) -> None:
    both = joined([starts.rows(np.array([1])), starts])
    assert names_of(both.asked_in_space) == ["Up", "Out", "Up", "In-Left", "turn+x"]
    assert np.array_equal(both.take(np.array([2]), np.zeros(1)).asked_in_space.gravity, PULLS[1:2])
    with pytest.raises(ValueError, match="asked nothing in space"):
        _ = replace(starts, space=None).asked_in_space


def test_what_is_never_shown_is_never_drawn() -> None:
    rng = np.random.default_rng(0)
    pulls = gravities(rng, 4000, 0.25) / GRAVITY
    np.testing.assert_allclose(np.linalg.norm(pulls, axis=-1), 1.0)
    for share in (0.25, 0.6):
        palms = np.isin(np.abs(gravities(rng, 4000, share) / GRAVITY), (0.0, 1.0)).all(axis=-1)
        assert palms.mean() == pytest.approx(share, abs=0.03)
    nearest = np.rad2deg(np.arccos((pulls @ (np.array(NEVER) / np.sqrt(3)).T).max(axis=-1)))
    assert NEVER_DEG < nearest.min() < NEVER_DEG + 2
    assert all((np.abs(pulls - palm).max(axis=-1) == 0).any() for palm in PALMS.values())
    config, unseen = privileged_spatial(), space_pools.unseen_directions()
    assert len(unseen) == 72
    asked = space_of(parse_spatial_directions("Out,turn+z") * 500, np.zeros((1000, 3)))
    spread = space_pools.spread(asked, in_space(config), rng)
    away = np.rad2deg(np.arccos(np.clip((spread.along[::2] @ unseen.T).max(axis=-1), -1, 1)))
    assert away.min() >= config.held_out
    assert (np.abs(spread.along[::2] - asked.along[::2]).max(axis=-1) > 0.01).mean() > 0.3
    assert not spread.along[1::2].any()
    assert names_of(space_of([UNSEEN[0], *parse_spatial_directions("Out")], np.zeros((2, 3)))) == ["never shown", "Out"]


def test_starts_are_told_to_go_as_far_as_their_grip_is_predicted_to_carry() -> None:
    plans = Planned(ASKED, ((PLAIN,),) * len(ASKED), PULLS)
    config = replace(privileged_spatial(), recipe=replace(privileged_spatial().recipe, whole=1.0))
    pool = pool_of(in_space(config), plans, 6, np.random.default_rng(0))
    np.testing.assert_array_equal(pool.distance, space_pools.reach_in_space(HELD, pool))
    assert (pool.distance > 0.004).all()
    assert pool.engine == "mujoco"


# Environments.


@pytest.fixture
def pooled(starts: Starts, monkeypatch: pytest.MonkeyPatch) -> None:
    """Environments begin from plain grips, which take no search."""
    monkeypatch.setattr(spatial_environment, "_pool", lambda *_, **__: starts)


QUICK: dict[str, Any] = {"directions": "Out,Up,In-Left,turn+x", "starts": 4, "threads": 1, "horizon": 20}


@pytest.mark.usefixtures("pooled")
def test_gymnasium_finds_nothing_wrong_in_space() -> None:
    env = gymnasium.make("inhand/SpatialAsterisk-v0", **QUICK)
    check_env(env.unwrapped)
    _, info = env.reset(seed=0, options={"direction": "Up"})
    np.testing.assert_array_equal(info["direction"], [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(info["gravity"], PULLS[1])
    _, _, terminated, _, info = env.step(np.zeros(HAND.n_joints, dtype=np.float32))
    assert not terminated
    assert {"along", "across", "turned", "axis", "lost", "terms"} < set(info)
    with pytest.raises(InputError, match="direction 'Down' of reset is none of this environment's, Out, Up, In-Left"):
        env.reset(options={"direction": "Down"})


@pytest.mark.usefixtures("pooled")
def test_batches_in_space_restart_within_the_step() -> None:
    envs = SpatialAsteriskVectorEnv(3, **QUICK)
    assert isinstance(inhand.make("spatial", num_envs=3, **QUICK), SpatialAsteriskVectorEnv)
    seen, info = envs.reset(seed=1)
    assert seen in envs.observation_space
    assert info["gravity"].shape == (3, 3)
    for _ in range(QUICK["horizon"]):
        _, _, _, truncated, info = envs.step(np.zeros((3, HAND.n_joints), dtype=np.float32))
    assert truncated.all()
    assert info["final_info"]["along"].shape == (3,)


@pytest.mark.parametrize(
    ("keywords", "text"),
    [
        ({"directions": "Up@+x@15"}, r"directions Up@\+x@15 hold a rotation"),
        ({"observation": "grip"}, "observation 'grip' is of the plane: use 'space' or"),
        ({"gravity": "0,0,0"}, "has no length"),
        ({"starts": 1, "directions": "axes"}, "starts=1 for 6 directions"),
        ({"noise_mm": -1.0}, "noise_mm is -1.0; it must be 0 or more"),
    ],
)
@pytest.mark.usefixtures("pooled")
def test_environments_in_space_refuse_what_cannot_be(keywords: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        inhand.make("spatial", **QUICK | keywords)


@pytest.mark.usefixtures("pooled")
def test_no_pictures_of_hands_in_space_are_promised() -> None:
    with pytest.raises(InputError, match="render_mode='rgb_array': use None for no pictures"):
        SpatialAsteriskEnv(render_mode="rgb_array", **QUICK)


# What cannot be trained.


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"task": "square:20"}, "task square:20 with 3f_60.60_40_10"),
        ({"interface": replace(privileged_spatial().interface, observation="grip")}, "layout grip with 3f_60.60_40_10"),
        ({"hand": "2v2_50.50_50.50_1.1_53", "object": "cube_39"}, "layout 'space' is of hands in space, and 2v2"),
        (
            {"recipe": replace(privileged_spatial().recipe, expert="ik")},
            "expert ik with .* shows episodes of teacher",
        ),
        ({"object": "cube_50:mass_kg=5"}, "weighs 5000 g"),
        ({"engine": "bullet"}, "engine 'bullet' with a hand in space"),
    ],
)
def test_trainings_in_space_that_cannot_be_are_refused(change: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        check(replace(privileged_spatial(), **change))
