"""The environments keep Gymnasium's contract, alone and as a batch."""

import asyncio
import importlib.util
import math
import re
import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias, cast

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from numpy.typing import NDArray

import inhand
from inhand.control.loop import LOST_AFTER
from inhand.environment_ids import IDS, register
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array, unit
from inhand.hands.hand import HandSpec
from inhand.learning.batch import GOAL_ROOM
from inhand.learning.environment_config import EnvironmentConfig, GoalConfig, angles_of
from inhand.learning.environments import (
    AsteriskEnv,
    AsteriskGoalEnv,
    AsteriskGoalVectorEnv,
    AsteriskVectorEnv,
)
from inhand.learning.make import make
from inhand.plots.live import ABOVE
from inhand.sim.scene import SUBSTEPS
from inhand.tasks.goals import goal_reached, goal_reward

PLANAR = [name for name in IDS if "Spatial" not in name]
"""Ids whose hands are in the plane; those in space have tests of their own."""
QUICK: dict[str, Any] = {"directions": [0, 90], "starts": 8, "threads": 1}
"""Keywords of small environments, which share one pool."""
Nested: TypeAlias = Any
"""Dicts, tuples and arrays within each other."""
STILL = np.zeros(4, dtype=np.float32)
LET_GO = np.array([1.0, 0.0, -1.0, 0.0], dtype=np.float32)
"""Action of kind `steps` that opens the fingers, where `STILL` holds the object."""


def plain(**keywords: object) -> AsteriskEnv:
    return AsteriskEnv(**QUICK | keywords)


def to_goals(**keywords: object) -> AsteriskGoalEnv:
    return AsteriskGoalEnv(**QUICK | keywords)


def batch(count: int, **keywords: object) -> AsteriskVectorEnv:
    return AsteriskVectorEnv(count, **QUICK | keywords)


def goal_batch(count: int, **keywords: object) -> AsteriskGoalVectorEnv:
    return AsteriskGoalVectorEnv(count, **QUICK | keywords)


def same(one: Nested, other: Nested) -> None:
    """Both are the same to the last bit, dicts and arrays of objects part by part."""
    assert type(one) is type(other)
    if isinstance(one, Mapping):
        assert list(one) == list(other)
        for name in one:
            same(one[name], other[name])
    elif isinstance(one, tuple | list) or (isinstance(one, np.ndarray) and one.dtype == object):
        assert len(one) == len(other)
        for mine, theirs in zip(one, other, strict=True):
            same(mine, theirs)
    else:
        np.testing.assert_array_equal(one, other)
        assert getattr(one, "dtype", None) == getattr(other, "dtype", None)


def shape_of(value: Nested) -> Nested:
    """Return the build of nested infos: names, types, lengths of arrays."""
    if isinstance(value, Mapping):
        return {name: shape_of(value[name]) for name in sorted(value)}
    return (value.shape, value.dtype) if isinstance(value, np.ndarray) else type(value)


# Gymnasium's own checks.


@pytest.mark.parametrize("name", PLANAR)
@pytest.mark.parametrize("keywords", [{}, {"observation": "grip", "actions": "steps", "stop": True}])
def test_gymnasium_finds_nothing_wrong(name: str, keywords: dict[str, Any]) -> None:
    env = gymnasium.make(name, **QUICK | keywords)
    check_env(env.unwrapped)
    env.close()


async def ran(code: str) -> tuple[int | None, str]:
    """Run code in a Python of its own; return its exit code and what it said on stderr."""
    words = sys.executable, "-W", "error", "-c", code
    process = await asyncio.create_subprocess_exec(*words, stderr=asyncio.subprocess.PIPE)
    _, said = await process.communicate()
    return process.returncode, said.decode()


def test_a_process_that_imports_nothing_of_ours_makes_them_by_module_and_id() -> None:
    """No library for pictures is loaded before one is asked for."""
    keywords = "directions='Out', grasp='rough', starts=2, threads=1"
    code = (
        f"import sys, gymnasium\nfor name in {PLANAR}:\n"
        "    id = f'inhand.learning.environments:{name}'\n"
        f"    env = gymnasium.make(id, render_mode='rgb_array', {keywords}); env.reset(seed=0)\n"
        f"    gymnasium.make_vec(id, 2, {keywords}).reset(seed=0)\n"
        "assert 'matplotlib' not in sys.modules; env.render(); assert 'matplotlib' in sys.modules"
    )
    assert asyncio.run(ran(code)) == (0, "")


HEAVY = [
    "numpy",
    "pandas",
    "scipy",
    "matplotlib",
    "mujoco",
    "numba",
    "jax",
    "gymnasium",
    "tyro",
    "rich",
    "msgspec",
    "importlib.metadata",
]


@pytest.mark.parametrize("order", ["import inhand, gymnasium", "import gymnasium, inhand"])
def test_importing_the_package_is_enough_for_gymnasium_and_imports_nothing_heavy(order: str) -> None:
    first = f"import inhand, sys; assert not [name for name in {HEAVY} if name in sys.modules]\n"
    code = (first if order.startswith("import inhand") else "") + (
        f"{order}\nassert set({list(IDS)}) <= set(gymnasium.registry)\n"
    )
    assert asyncio.run(ran(code)) == (0, "")


def test_registering_twice_says_nothing() -> None:
    before = dict(gymnasium.registry)
    register(gymnasium.envs.registration)
    assert before == gymnasium.registry


def test_defaults_are_the_theses() -> None:
    env = AsteriskEnv(**QUICK)
    assert env.observation_space == gymnasium.spaces.Box(-1.0, 1.0, (23,), np.float32)
    assert env.action_space == gymnasium.spaces.Box(-1.0, 1.0, (4,), np.float32)
    config = EnvironmentConfig()
    assert (config.observation, config.actions, config.reward, config.horizon) == ("thesis", "angles", "thesis", 250)
    assert (config.noise_mm, config.noise_deg, len(config.angles)) == (1.0, 1.0, 8)
    assert env.metadata["render_modes"] == ["rgb_array"]
    assert env.render_mode is None
    assert env.render() is None


# One environment.


def test_an_episode_tells_where_the_object_went_and_what_it_earned() -> None:
    env = plain(actions="steps")
    seen, info = env.reset(seed=3)
    assert info["direction"] in (0.0, 90.0)
    assert seen in env.observation_space
    for _ in range(3):
        seen, reward, terminated, truncated, info = env.step(np.full(4, 0.3))
        assert seen in env.observation_space
        assert (type(reward), type(terminated), type(truncated)) == (float, bool, bool)
        assert list(info) == ["direction", "along", "left", "turned", "lost", "terms"]
        assert list(info["terms"]) == ["contact", "direction"]
        assert info["terms"]["direction"] == pytest.approx(100 * (info["along"] - 0.5 * abs(info["left"])))
        assert reward == pytest.approx(sum(info["terms"].values()))
        assert not any((terminated, truncated, info["lost"]))


def test_an_episode_is_cut_off_at_its_horizon_and_must_be_begun_again() -> None:
    env = plain(horizon=3, actions="steps")
    with pytest.raises(ResetNeeded, match=re.escape("call reset() first")):
        env.step(STILL)
    env.reset(seed=0)
    ends = [env.step(STILL)[2:4] for _ in range(3)]
    assert ends == [(False, False), (False, False), (False, True)]
    with pytest.raises(ResetNeeded, match="again after each episode's end"):
        env.step(STILL)
    env.reset()
    assert env.step(STILL)[2:4] == (False, False)


def test_a_lost_object_ends_an_episode_after_twenty_steps() -> None:
    env = plain(actions="steps")
    env.reset(seed=1)
    number, terminated = 0, False
    while not terminated:
        seen, _, terminated, truncated, info = env.step(LET_GO)
        number += 1
    assert info["lost"]
    assert not truncated
    assert number * SUBSTEPS > LOST_AFTER
    assert seen in env.observation_space
    again, _ = env.reset()
    assert (again != seen).any()


@pytest.mark.parametrize("make", [plain, to_goals])
def test_the_same_seed_gives_the_same_bytes(make: Callable[..., AsteriskEnv]) -> None:
    one, two = make(horizon=6), make(horizon=6)
    actions = np.random.default_rng(0).uniform(-0.2, 0.2, (6, 4))
    same(one.reset(seed=5), two.reset(seed=5))
    for _ in range(2):
        for action in actions:
            same(one.step(action), two.step(action))
        same(one.reset(), two.reset())
    first, other = one.reset(seed=5)[0], two.reset(seed=6)[0]
    assert any((np.asarray(a) != np.asarray(b)).any() for a, b in zip(parts(first), parts(other), strict=True))


def parts(seen: Nested) -> list[NDArray[np.float32]]:
    return list(seen.values()) if isinstance(seen, dict) else [seen]


@pytest.mark.parametrize("make", [plain, to_goals])
def test_options_pick_a_direction(make: Callable[..., AsteriskEnv]) -> None:
    env = make()
    for asked, angle in ((90, 90.0), ("Out", 90.0), (0.0, 0.0), ("ea", 0.0), (-270, 90.0)):
        directions = {env.reset(options={"direction": asked})[1]["direction"] for _ in range(4)}
        assert directions == {angle}
    assert {env.reset(seed=seed)[1]["direction"] for seed in range(12)} == {0.0, 90.0}
    with pytest.raises(InputError, match=r"direction 45 of reset is none of this environment's, 0, 90 deg: use one"):
        env.reset(options={"direction": 45})
    with pytest.raises(InputError, match="unknown direction 'Outt'"):
        env.reset(options={"direction": "Outt"})
    with pytest.raises(InputError, match=r"direction 'all' of reset is none"):
        env.reset(options={"direction": "all"})
    with pytest.raises(InputError, match=r"unknown option 'directio' of reset; did you mean direction\?"):
        env.reset(options={"directio": 90})


@pytest.mark.parametrize(
    ("given", "angles"),
    [
        ("Out,30", (90.0, 30.0)),
        ([0, 22.5, "In"], (0.0, 22.5, -90.0)),
        (["Right", 0.0], (0.0,)),
        ("train", (90.0, 45.0, 0.0, -45.0, -90.0, -135.0, 180.0, 135.0)),
    ],
)
def test_directions_are_words_or_degrees(given: str | list[str | float], angles: tuple[float, ...]) -> None:
    assert angles_of(given) == angles


@pytest.mark.parametrize(
    ("keywords", "text"),
    [
        ({"hand": "2v2"}, "2v2"),
        (
            {"objet": "cube_39"},
            r"unknown keyword 'objet'; did you mean object or observation\?; allowed are hand, object, ",
        ),
        ({"directions": "cw"}, "primitive cw only rotates and has no direction"),
        ({"directions": "Oot"}, "unknown direction 'Oot'"),
        ({"actions": "step"}, r"actions is 'step'; it must be angles or steps or fine; did you mean steps"),
        ({"grasp": "roug"}, r"grasp is 'roug'; it must be planned or rough; did you mean rough"),
        ({"engine": "bulet"}, r"engine is 'bulet'; it must be planar or mujoco or bullet; did you mean bullet"),
        ({"object": "cube_200"}, "object 'cube_200' is 200.0 mm wide; hand .* opens to"),
        ({"observation": "thesi"}, "unknown observation 'thesi'"),
        ({"reward": "sparse"}, "unknown reward 'sparse'"),
        ({"horizon": 0}, "horizon is 0; it must be 1 or more"),
        ({"noise_mm": -1.0}, r"noise_mm is -1.0; it must be 0 or more"),
        ({"threads": -1}, r"threads is -1; it must be 0 or more"),
        ({"directions": []}, "no direction given"),
        ({"directions": [float("nan")]}, "direction nan is not a finite angle"),
        ({"starts": 1}, "starts=1 for 2 directions: give at least one for each"),
        ({"starts": 10**12}, r"starts=1000000000000 would take about 1.3e\+08 GB of memory, 130 kB each, and this"),
        ({"render_mode": "human"}, "render_mode='human': use 'rgb_array', or None for no pictures"),
        ({"render_mode": 3}, "render_mode=3: use"),
    ],
)
def test_keywords_that_cannot_be_are_refused(keywords: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        plain(**keywords)
    with pytest.raises(InputError, match=text):
        batch(2, **keywords)


@pytest.mark.parametrize(
    ("count", "text"),
    [
        ("a", "num_envs is 'a'; it must be a whole number"),
        (None, "num_envs is None; it must be a whole number"),
        (2.5, "num_envs is 2.5; it must be a whole number"),
        (True, "num_envs is True; it must be a whole number"),
        (0, "num_envs is 0; it must be 1 or more"),
        (10**9, r"num_envs=1000000000 would take about 2.1e\+03 GB of memory, 2.1 kB each, and this machine has"),
    ],
)
def test_numbers_of_environments_that_cannot_be_are_refused(count: Nested, text: str) -> None:
    with pytest.raises(InputError, match=text):
        batch(count)
    with pytest.raises(InputError, match=text):
        gymnasium.make_vec("inhand/Asterisk-v0", num_envs=count, **QUICK)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ("a", "actions 'a': give numbers"),
        (None, "actions None: give numbers"),
        ([["a"] * 4], r"actions \[\['a', 'a', 'a', 'a'\]\]: give numbers \(1, 4\) within \[-1, 1\]"),
        ([["1"] * 4], "actions .*: give numbers"),
        ([[1j] * 4], "actions .*: give numbers"),
        ([[1], [1, 2]], "actions .*: give numbers"),
        ({}, "actions {}: give numbers"),
        (np.zeros(4), r"actions of shape \(4,\); 1 worlds need \(1, 4\), a number within \[-1, 1\] for each joint"),
        (np.zeros((2, 4)), r"actions of shape \(2, 4\); 1 worlds need"),
        (np.full((1, 4), np.nan), "the action of joint 0 in world 0 is nan; give one in"),
        (np.full((1, 4), np.inf), "the action of joint 0 in world 0 is inf"),
    ],
)
def test_actions_that_cannot_be_are_refused(given: Nested, text: str) -> None:
    envs = batch(1)
    envs.reset(seed=0)
    with pytest.raises(InputError, match=text):
        envs.step(given)


def test_an_action_that_cannot_be_is_refused_and_the_episode_goes_on() -> None:
    env = plain()
    env.reset(seed=0)
    for given, text in (
        (np.zeros(3), r"actions of shape \(1, 3\); 1 worlds need \(1, 4\)"),
        ("a", r"actions \['a'\]: give numbers \(1, 4\)"),
        (np.full(4, np.nan), "the action of joint 0 in world 0 is nan"),
    ):
        with pytest.raises(InputError, match=text):
            env.step(given)
    assert np.isfinite(env.step(np.zeros(4, dtype=int))[1])


@pytest.mark.parametrize("make", [plain, partial(batch, 1)])
@pytest.mark.parametrize(
    ("keywords", "text"),
    [
        ({"seed": "a"}, "seed is 'a'; it must be a whole number"),
        ({"seed": [1, 2]}, r"seed is \[1, 2\]; it must be a whole number"),
        ({"seed": 1.5}, "seed is 1.5; it must be a whole number"),
        ({"seed": -1}, "seed is -1; it must be 0 or more, or None for one that is drawn"),
        ({"options": 3}, "options is 3; it must be a table"),
        ({"options": ["direction"]}, r"options is \['direction'\]; it must be a table"),
        ({"options": {1: 2}}, "options"),
        ({"options": {"direction": None}}, "unknown direction 'None'"),
        ({"options": {"direction": math.nan}}, "direction nan is not a finite angle"),
        ({"options": {"direction": [0, 90]}}, "2 directions for 1 worlds"),
    ],
)
def test_resets_that_cannot_be_are_refused(make: Callable[..., Nested], keywords: dict[str, Any], text: str) -> None:
    env = make()
    env.reset(seed=0)
    with pytest.raises(InputError, match=text):
        env.reset(**keywords)


def test_names_that_are_no_environments_are_refused_and_specs_are_taken() -> None:
    for name, text in (
        (3, "name is 3"),
        (None, "name is None"),
        ("easi", r"unknown environment 'easi'; did you mean easy"),
    ):
        with pytest.raises(InputError, match=text):
            make(cast("str", name))
    for given, text in (
        ({"hand": 3}, r"hand is int 3: give a name, the path of a file, or a spec \(HandSpec or SpatialHand\)"),
        ({"object": ["cube_39"]}, r"object is list \['cube_39'\]: .* \(ObjectSpec or SolidSpec\)"),
        ({"hand": inhand.object("cube_39")}, "hand is ObjectSpec"),
    ):
        with pytest.raises(InputError, match=text):
            make(**given)
    env = make(hand=inhand.hand("2v2_50.50_50.50_1.1_53"), object=inhand.object("cube_39"), **QUICK)
    assert env.observation_space.shape == (23,)


# Pictures.


def test_pictures_show_the_object_where_it_is_and_the_last_of_an_episode() -> None:
    env = plain(render_mode="rgb_array", horizon=12, actions="steps")
    env.reset(seed=0, options={"direction": 0})
    first = picture(env)
    assert (str(first.dtype), first.shape) == ("uint8", (400, 400, 3))
    np.testing.assert_array_equal(first, picture(env))
    truncated = False
    while not truncated:
        *_, truncated, info = env.step([-0.2, -0.2, -0.2, -0.2])
    assert info["along"] > 0.003
    moved = cube(picture(env)) - cube(first)
    np.testing.assert_allclose(moved, [1e3 * info["along"], 1e3 * info["left"]], atol=1.0)


def picture(env: AsteriskEnv) -> NDArray[np.uint8]:
    found = env.render()
    assert found is not None
    return found


def cube(shown: NDArray[np.uint8]) -> Array:
    """Return the middle of the cube in a picture: x to the right, y up [mm]."""
    row, column = np.argwhere(np.all(shown == [245, 194, 107], axis=-1)).mean(axis=0)
    hand: HandSpec = inhand.hand("2v2_50.50_50.50_1.1_53")
    return 1e3 * (hand.palm_depth + ABOVE * hand.finger_length) / len(shown) * np.array([column, -row])


@pytest.mark.parametrize("name", PLANAR)
def test_batches_give_a_picture_of_each(name: str) -> None:
    envs = gymnasium.make_vec(name, num_envs=2, render_mode="rgb_array", **QUICK)
    envs.reset(seed=0, options={"direction": [0, 90]})
    one, two = envs.render() or ()
    assert np.shape(one) == np.shape(two) == (400, 400, 3)
    assert np.any(np.asarray(one) != np.asarray(two))


def test_pictures_of_mujoco_are_an_extra() -> None:
    env = plain(render_mode="rgb_array", pictures="mujoco")
    env.reset(seed=0)
    if importlib.util.find_spec("glfw") is None:
        with pytest.raises(InputError, match=r'pictures="mujoco" \(.*\) needs the extra `viewer`: pip install'):
            env.render()
        return
    try:
        shown = picture(env)
    except InputError as error:
        pytest.skip(f"there is no GL here: {error}")
    assert (str(shown.dtype), shown.shape) == ("uint8", (400, 400, 3))
    orange = (shown[..., 0] > 1.5 * shown[..., 2]).mean()
    assert 0.01 < orange < 0.1


def test_gymnasium_records_a_film(tmp_path: Path) -> None:
    pytest.importorskip("moviepy", reason="the extra `video` is not installed")
    env = gymnasium.make("inhand/Asterisk-v0", render_mode="rgb_array", horizon=5, actions="steps", **QUICK)
    films: Nested = gymnasium.wrappers.RecordVideo(env, str(tmp_path / "films"))
    films.reset(seed=0)
    for _ in range(5):
        films.step(STILL)
    films.close()
    assert [path.suffix for path in (tmp_path / "films").iterdir()] == [".mp4"]


def test_the_way_to_go_is_told_where_it_was_asked_for() -> None:
    observation, reward = "grip", "progress"
    told, not_told = (plain(observation=observation, reward=reward, stop=stop) for stop in (True, False))
    near, far = (env.reset(seed=0, options={"direction": "Out"})[0] for env in (told, not_told))
    assert near[2] < far[2] == 1.0
    np.testing.assert_array_equal(np.delete(near, [2, 3]), np.delete(far, [2, 3]))
    assert list(told.step(STILL)[4]["terms"]) == ["progress", "waiting", "astray", "jerk", "drop"]


def test_in_the_easy_setting_chance_holds_the_object_and_holding_costs_nothing() -> None:
    held = {}
    for name in ("inhand/Asterisk-v0", "inhand/AsteriskEasy-v0"):
        envs = gymnasium.make_vec(name, num_envs=16, **QUICK)
        envs.reset(seed=0)
        envs.action_space.seed(0)
        ends = [envs.step(envs.action_space.sample())[2] for _ in range(25)]
        held[name] = 1.0 - np.any(ends, axis=0).mean()
    assert held["inhand/Asterisk-v0"] == 0.0
    assert held["inhand/AsteriskEasy-v0"] > 0.8
    env = make("easy", **QUICK)
    env.reset(seed=0)
    _, reward, _, _, info = env.step(STILL)
    assert list(info["terms"]) == ["progress", "drop"]
    assert abs(float(reward)) < 0.01


# Many environments.


@pytest.mark.parametrize("name", PLANAR)
def test_gymnasium_makes_batches(name: str) -> None:
    envs = gymnasium.make_vec(name, num_envs=3, **QUICK)
    assert isinstance(envs, AsteriskGoalVectorEnv if "Goal" in name else AsteriskVectorEnv)
    assert envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    single = gymnasium.make(name, **QUICK)
    assert envs.single_observation_space == single.observation_space
    assert envs.single_action_space == single.action_space
    seen, _ = envs.reset(seed=1)
    assert seen in envs.observation_space
    envs.action_space.seed(0)
    for _ in range(3):
        seen, reward, terminated, truncated, _ = envs.step(envs.action_space.sample())
        assert seen in envs.observation_space
        assert reward.shape == terminated.shape == truncated.shape == (3,)
        assert terminated.dtype == truncated.dtype == np.bool_
    envs.close()


@pytest.mark.parametrize(("many", "one"), [(batch, plain), (goal_batch, to_goals)])
def test_a_batch_tells_what_gymnasiums_own_tells(
    many: Callable[..., AsteriskVectorEnv], one: Callable[..., AsteriskEnv]
) -> None:
    """Names, types and masks of infos, in a step in which nothing ends and in one in which all episodes do."""
    ours = many(2, horizon=2, actions="steps")
    theirs: Any = SyncVectorEnv([lambda: one(horizon=2, actions="steps")] * 2, autoreset_mode=AutoresetMode.SAME_STEP)
    assert shape_of(ours.reset(seed=0)[1]) == shape_of(theirs.reset(seed=0)[1])
    actions = np.zeros((2, 4), dtype=np.float32)
    ours_then, theirs_then = ours.step(actions), theirs.step(actions)
    for mine, other in zip(ours_then, theirs_then, strict=True):
        assert shape_of(mine) == shape_of(other)
    ours_end, theirs_end = ours.step(actions), theirs.step(actions)
    for mine, other in zip(ours_end[:4], theirs_end[:4], strict=True):
        assert shape_of(mine) == shape_of(other)
    names = "final_obs", "_final_obs", "final_info", "_final_info", "direction", "_direction"
    for name in names:
        assert shape_of(ours_end[4][name]) == shape_of(theirs_end[4][name])
    same(shape_of(ours_end[4]["final_obs"][1]), shape_of(theirs_end[4]["final_obs"][1]))
    assert not ours_end[4]["_along"].any()
    assert "along" not in theirs_end[4]


@pytest.mark.parametrize(("many", "one"), [(batch, plain), (goal_batch, to_goals)])
def test_a_batch_does_what_single_environments_do(
    many: Callable[..., AsteriskVectorEnv], one: Callable[..., AsteriskEnv]
) -> None:
    """One world of a batch is one environment, up to the end of its episode and what is told of it."""
    envs, env = many(1, horizon=4), one(horizon=4)
    action = np.full(4, 0.1, dtype=np.float32)
    seen, _ = envs.reset(seed=9)
    same([part[0] for part in parts(seen)], parts(env.reset(seed=9)[0]))
    for number in range(4):
        seen, reward, terminated, truncated, info = envs.step(action[None])
        alone, value, *ends, told = env.step(action)
        assert (reward[0], terminated[0], truncated[0]) == (value, *ends)
        if number < 3:
            same([part[0] for part in parts(seen)], parts(alone))
            assert info["along"][0] == told["along"]
        else:
            same(info["final_obs"][0], alone)
            assert info["final_info"]["along"][0] == told["along"]
            assert any((part[0] != other).any() for part, other in zip(parts(seen), parts(alone), strict=True))


@pytest.mark.parametrize("many", [batch, goal_batch])
def test_one_environment_of_a_batch_ends_alone(many: Callable[..., AsteriskVectorEnv]) -> None:
    envs = many(3, horizon=1000, actions="steps")
    envs.reset(seed=2)
    for _ in range(100):
        seen, _, terminated, truncated, info = envs.step(np.stack([STILL, LET_GO, STILL]))
        assert seen in envs.observation_space
        if terminated.any():
            break
        assert "final_obs" not in info
        assert info["_along"].all()
    np.testing.assert_array_equal(terminated, [False, True, False])
    assert not truncated.any()
    np.testing.assert_array_equal(info["_along"], ~terminated)
    np.testing.assert_array_equal(info["_final_info"], terminated)
    np.testing.assert_array_equal(info["final_info"]["lost"], terminated)
    assert info["final_obs"][0] is None
    assert info["final_obs"][1] in envs.single_observation_space
    np.testing.assert_array_equal(info["_direction"], [True] * 3)


@pytest.mark.parametrize("many", [batch, goal_batch])
def test_the_same_seed_gives_batches_the_same_bytes(many: Callable[..., AsteriskVectorEnv]) -> None:
    one, two = many(3, horizon=5), many(3, horizon=5, threads=2)
    rng = np.random.default_rng(0)
    same(one.reset(seed=5), two.reset(seed=5))
    for _ in range(12):
        actions = rng.uniform(-1, 1, (3, 4))
        same(one.step(actions), two.step(actions))


def test_what_a_batch_handed_out_stays_as_it_was() -> None:
    envs = goal_batch(2, horizon=3)
    handed, copies = [], []
    for number in range(8):
        seen = envs.step(np.zeros((2, 4)))[0] if number else envs.reset(seed=0)[0]
        handed.append(parts(seen))
        copies.append([part.copy() for part in parts(seen)])
    same(handed, copies)


def test_options_pick_the_directions_of_a_batch() -> None:
    envs = batch(3)
    np.testing.assert_array_equal(envs.reset(options={"direction": "Out"})[1]["direction"], [90.0] * 3)
    np.testing.assert_array_equal(envs.reset(options={"direction": [0, 90, "c"]})[1]["direction"], [0.0, 90.0, 0.0])
    with pytest.raises(InputError, match="2 directions for 3 worlds: give one for all or one for each"):
        envs.reset(options={"direction": [0, 90]})


# Goals.


def test_goals_lie_on_the_primitive_within_what_the_grip_can_go() -> None:
    env = to_goals()
    assert env.reset(seed=0)[0]["desired_goal"].shape == (3,)
    ways = []
    for seed in range(40):
        seen, info = env.reset(seed=seed)
        way = seen["desired_goal"].astype(float) - seen["achieved_goal"]
        length = np.hypot(*way[:2])
        np.testing.assert_allclose(way[:2], length * unit(np.deg2rad(info["direction"])), atol=1e-6)
        assert way[2] == 0.0
        assert np.abs(seen["achieved_goal"][:2]).max() < 0.01  # noise and closing, seen from the hand's start position
        ways.append(length)
    assert 0.01 - 1e-6 <= min(ways) < 0.03
    assert 0.05 < max(ways) < 0.12


@pytest.mark.parametrize("reward", ["sparse", "dense"])
def test_the_reward_is_what_compute_reward_makes_of_the_observation(reward: str) -> None:
    env = to_goals(reward=reward, actions="steps")
    env.reset(seed=4)
    envs = goal_batch(3, reward=reward, horizon=3)
    envs.reset(seed=4)
    rng = np.random.default_rng(0)
    for _ in range(8):
        seen, value, terminated, truncated, info = env.step(rng.uniform(-0.5, 0.5, 4))
        assert not any((terminated, truncated))
        assert value == env.compute_reward(seen["achieved_goal"], seen["desired_goal"], info)
        assert info["is_success"] == (np.linalg.norm((seen["achieved_goal"] - seen["desired_goal"])[:2]) < 0.002)
        batch_seen, values, *ends, infos = envs.step(rng.uniform(-0.2, 0.2, (3, 4)))
        if ends[1].any():
            last = infos["final_obs"]
            batch_seen = {name: np.stack([each[name] for each in last]) for name in last[0]}
        goals = batch_seen["achieved_goal"], batch_seen["desired_goal"]
        np.testing.assert_array_equal(values, envs.compute_reward(*goals, infos))


def test_goal_rewards_are_their_sums() -> None:
    desired = np.array([0.03, 0.0, 3.1])
    achieved = np.array(
        [
            [0.03, 0.0, 3.1],
            [0.0319, 0.0, 3.1],
            [0.0321, 0.0, 3.1],
            [0.03, 0.0, 3.1 + np.deg2rad(4.9) - 2 * np.pi],
            [0.03, 0.0, 3.1 + np.deg2rad(5.1)],
            [0.03, 0.02, 3.0],
        ]
    )
    within = (0.002, np.deg2rad(5.0))
    np.testing.assert_array_equal(goal_reward(achieved, desired, within, "sparse"), [0, 0, -1, 0, -1, -1])
    np.testing.assert_array_equal(goal_reached(achieved, desired, within), [True, True, False, True, False, False])
    arc = 100 * TURN_ARM
    expected = [0, -0.19, -0.21, -arc * np.deg2rad(4.9), -arc * np.deg2rad(5.1), -2 - arc * 0.1]
    np.testing.assert_allclose(goal_reward(achieved, desired, within, "dense"), expected, atol=1e-12)
    assert goal_reward(achieved[0], desired, within, "sparse").shape == ()
    assert goal_reward(achieved[None], desired, within, "dense").shape == (1, 6)


def test_a_goal_is_reached_within_its_tolerance() -> None:
    tight, wide = to_goals(actions="steps"), to_goals(actions="steps", tolerance_mm=500.0, tolerance_deg=180.0)
    for env, reached in ((tight, False), (wide, True)):
        env.reset(seed=0)
        _, reward, _, _, info = env.step(STILL)
        assert (reward, info["is_success"]) == (float(reached) - 1.0, reached)


@pytest.mark.parametrize("lost", ["terminated", "truncated"])
def test_a_lost_object_ends_an_episode_as_it_was_asked_to(lost: str) -> None:
    env = to_goals(lost=lost, actions="steps")
    env.reset(seed=0)
    for _ in range(100):
        seen, _, terminated, truncated, info = env.step(LET_GO)
        if terminated or truncated:
            break
    assert info["lost"]
    assert (terminated, truncated) == (lost == "terminated", lost == "truncated")
    assert np.abs(seen["achieved_goal"]).max() <= GOAL_ROOM.max()


@pytest.mark.parametrize(
    ("keywords", "text"),
    [
        ({"reward": "thesis"}, "reward is 'thesis'.*; it must be sparse or dense"),
        ({"lost": "ended"}, "lost is 'ended'.*; it must be terminated or truncated"),
        ({"tolerance_mm": 0.0}, r"tolerance_mm is 0.0; it must be above 0"),
        ({"tolerance_deg": -1.0}, r"tolerance_deg is -1.0"),
        ({"nearest_mm": float("inf")}, "nearest_mm is inf; it must be a finite number"),
        ({"nearest": 10.0}, r"unknown keyword 'nearest'; did you mean nearest_mm\?"),
    ],
)
def test_keywords_of_goals_that_cannot_be_are_refused(keywords: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        to_goals(**keywords)


@pytest.mark.parametrize("given", ["a", None, 3.0, [0.0, 0.0], ["a", "b", "c"]])
def test_goals_that_are_no_poses_are_refused(given: Nested) -> None:
    with pytest.raises(InputError, match=r"desired_goal is .*; it must be poses \(..., 3\)"):
        to_goals().compute_reward(np.zeros(3), given, {})


def test_tolerances_are_told_in_millimetres_and_degrees() -> None:
    assert GoalConfig().tolerance == pytest.approx((0.002, np.deg2rad(5.0)))


def test_the_planar_engine_gives_an_environment_that_goes_where_mujocos_goes() -> None:
    scenes = [
        inhand.make("easy", num_envs=2, engine=engine, directions=(0.0,), starts=2) for engine in ("mujoco", "planar")
    ]
    seen = [scene.reset(seed=3)[0] for scene in scenes]
    for _ in range(10):
        seen = [scene.step(np.full(scene.action_space.shape, 0.2, dtype=np.float32))[0] for scene in scenes]
    np.testing.assert_allclose(seen[1], seen[0], atol=2e-2)
