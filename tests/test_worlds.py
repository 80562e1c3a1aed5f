"""Starts, worlds that restart on their own, and demonstrations recorded in them."""

from dataclasses import fields, replace
from functools import cache
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.run import prepare, simulate
from inhand.control.loop import LOST_AFTER
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.fit import Held
from inhand.learning import demonstrations as made_of
from inhand.learning.collect import Collector
from inhand.learning.demonstrations import EARLIEST, demonstrations, plans_of, recorded
from inhand.learning.environment_config import EnvironmentConfig
from inhand.learning.episodes import Episodes
from inhand.learning.recipe import Recipe, Recording
from inhand.learning.replay_buffer import Columns
from inhand.learning.starts import (
    Noise,
    Starts,
    grid_of,
    gripped,
    joined,
    plans_for,
    reach_of,
    taken,
)
from inhand.learning.step import Step
from inhand.learning.worlds import Interface, ManipulationWorlds
from inhand.sim import state as measuring
from inhand.sim.scene import SUBSTEPS
from inhand.sim.snapshot import Snapshot
from inhand.sim.state import State, select
from inhand.tasks.decisions import Actions, actions_of
from test_simulator import CUBE, HAND, open_hand

HELD = Held(HAND, CUBE)
ANGLES = np.tile([0.0, 90.0], 4)
STEPS = Interface(actions="steps")
Compared = Starts | State | Snapshot | Step | Episodes


@cache
def pool(seed: int = 0) -> Starts:
    """Return eight starts in two directions, held as their directions ask for."""
    return gripped(*HELD, (plans_for(*HELD, (0.0, 90.0)), ANGLES), np.random.default_rng(seed), threads=1)


def worlds(count: int = 4, interface: Interface = STEPS, seed: int = 3, threads: int = 1) -> ManipulationWorlds:
    return ManipulationWorlds(HELD, pool(), count, interface, np.random.default_rng(seed), threads=threads)


def same(one: Compared, other: Compared) -> None:
    """Every array of two dataclasses is the same to the last bit."""
    assert type(one) is type(other)
    for field in fields(one):
        ours, theirs = getattr(one, field.name), getattr(other, field.name)
        if isinstance(ours, Starts | State | Snapshot):
            same(ours, theirs)
        elif isinstance(ours, dict):
            for name in ours:
                np.testing.assert_array_equal(ours[name], theirs[name])
        else:
            np.testing.assert_array_equal(ours, theirs)


def let_go(batch: ManipulationWorlds, worlds_of: NDArray[np.int64]) -> Array:
    """Return actions that hold the object, but open the fingers of some worlds."""
    targets = batch.state.targets.copy()
    targets[worlds_of] = open_hand(HAND)
    return actions_of(targets, batch.interface.actions, HAND, batch.state)


# Starts.


def test_starts_are_held_by_both_fingers_and_keep_their_order() -> None:
    starts = pool()
    assert len(starts) == 8
    assert starts.state.touching.all()
    np.testing.assert_array_equal(starts.angle_deg, ANGLES)
    np.testing.assert_array_equal(starts.distance, np.full(8, np.inf))
    assert np.ptp(starts.state.time) == 0
    spread = starts.state.pose[:, :2] - HAND.start_position
    assert 1e-4 < spread.std() < 5e-3
    np.testing.assert_array_equal(starts.snapshot.time, starts.state.time)
    same(starts, gripped(*HELD, (plans_for(*HELD, (0.0, 90.0)), ANGLES), np.random.default_rng(0), threads=2))


def test_an_episode_of_learning_starts_in_the_grip_of_a_trial() -> None:
    """The same place and grasp, to the last bit; held for longer, the fingers would press 1.7 times as hard."""
    config = AsteriskConfig(controller="rl-privileged", directions="Right,Out", trials=1, noise_mm=0.0, noise_deg=0.0)
    starts = gripped(
        *HELD, (plans_for(*HELD, (0.0, 90.0)), np.array([0.0, 90.0])), np.random.default_rng(0), Noise(0.0, 0.0)
    )
    for world, trial in enumerate(simulate(config, prepare(config))):
        held = trial.manipulation.start - 1
        for name in ("time", "object_pose", "joint_angles", "targets", "gaps"):
            np.testing.assert_array_equal(getattr(starts.state, name)[world], getattr(trial, name)[held])


def test_starts_whose_grasp_fails_are_drawn_again_in_their_places() -> None:
    angles = np.repeat([0.0, 90.0], 12)
    plans = plans_for(*HELD, (0.0, 90.0), "rough")
    wide = gripped(*HELD, (plans, angles), np.random.default_rng(1), Noise(position=0.008, rotation=0.2), threads=1)
    np.testing.assert_array_equal(wide.angle_deg, angles)
    assert wide.state.touching.all()


def test_a_grasp_that_never_holds_is_told() -> None:
    plans = plans_for(*HELD, (90.0,), "rough")
    with pytest.raises(InputError, match=r"the grasp of 'cube_39' with .* for direction 90 deg failed ten times in a"):
        gripped(*HELD, (plans, np.array([90.0])), np.random.default_rng(0), Noise(position=5.0), threads=1)


def test_a_direction_between_two_grids_takes_the_nearest_plan() -> None:
    assert grid_of(np.array([-90.0, 3.7, 3.8, 356.0, 359.9])) == (0.0, 7.5, 270.0, 352.5)
    plans = plans_for(*HELD, (0.0, 90.0))
    near = gripped(*HELD, (plans, np.array([-40.0, 315.0, 50.0])), np.random.default_rng(0), Noise(0.0, 0.0), threads=1)
    for world, angle in enumerate((0.0, 0.0, 90.0)):
        own = gripped(*HELD, (plans, np.array([angle])), np.random.default_rng(0), Noise(0.0, 0.0), threads=1)
        np.testing.assert_array_equal(near.state.joint_angles[world], own.state.joint_angles[0])


def test_starts_are_taken_and_joined() -> None:
    starts = replace(pool(), distance=np.full(8, 0.05))
    some = starts.take(np.array([5, 2, 5]), np.array([10.0, 20.0, 30.0]))
    np.testing.assert_array_equal(some.angle_deg, [10.0, 20.0, 30.0])
    np.testing.assert_array_equal(some.distance, np.full(3, np.inf))
    same(some.state, select(starts.state, np.array([5, 2, 5])))
    same(some.snapshot, starts.snapshot.take(np.array([5, 2, 5])))
    both = joined([some, starts])
    assert len(both) == 11
    same(select(both.state, np.arange(3, 11)), starts.state)
    np.testing.assert_array_equal(both.distance, [np.inf] * 3 + [0.05] * 8)


def test_the_reach_of_a_grip_ends_before_the_hand_does() -> None:
    reach = reach_of(HELD, pool())
    assert reach.shape == (8,)
    assert (reach > 0.02).all()
    assert (reach < 0.15).all()


# Worlds.


def test_what_an_agent_collects_is_not_shown_by_an_expert() -> None:
    worlds = ManipulationWorlds(HELD, pool(), 3, replace(STEPS, horizon=4), np.random.default_rng(0), threads=1)
    columns = Columns(worlds.layout.size(HAND), HAND.n_joints)
    rows, ends = Collector(worlds, columns, (0.9, 2)).collect(
        lambda seen: np.zeros((len(seen), HAND.n_joints)), 8, 0.1, np.random.default_rng(0)
    )
    found = np.concatenate(rows)
    assert sum(end.decisions for end in ends) == len(found) >= 12
    assert np.ptp(found[:, columns.parts()["action"]]) > 0
    assert not found[:, columns.parts()["is_demo"]].any()


def test_a_decision_leads_on_from_the_rows_it_was_reset_to() -> None:
    batch, starts = worlds(), pool()
    rows = np.array([1, 0, 5, 5])
    seen = batch.reset(rows)
    same(batch.state, select(starts.state, rows))
    np.testing.assert_array_equal(batch.aim.angle, np.deg2rad(starts.angle_deg[rows]))
    np.testing.assert_array_equal(batch.aim.start, starts.state.pose[rows])
    step = batch.step(np.zeros((4, 4)))
    assert step.observation.shape == seen.shape == (4, 23)
    np.testing.assert_array_equal(step.observation, step.successor)
    np.testing.assert_array_equal(step.after.pose, batch.state.pose)
    np.testing.assert_array_equal(step.shift, batch.aim.shift(batch.state.pose))
    np.testing.assert_array_equal(step.observation[2], step.observation[3])
    assert np.abs(step.shift[:, :2]).max() < 1e-3
    assert not (step.terminated | step.truncated).any()
    np.testing.assert_allclose(step.reward, sum(step.terms.values()))
    assert tuple(step.terms) == ("contact", "direction")


def test_worlds_restart_at_the_horizon_in_the_same_step() -> None:
    batch = worlds(interface=replace(STEPS, horizon=3))
    starts = pool()
    for number in range(1, 8):
        step = batch.step(np.zeros((4, 4)))
        assert step.truncated.all() == (number % 3 == 0)
        assert step.truncated.any() == (number % 3 == 0)
        assert not step.terminated.any()
        if number % 3:
            np.testing.assert_array_equal(step.observation, step.successor)
        else:
            assert (step.observation != step.successor).any(axis=1).all()
            assert np.isin(batch.state.pose[:, 0], starts.state.pose[:, 0]).all()
            np.testing.assert_array_equal(batch.aim.start, batch.state.pose)
            assert (step.after.pose != batch.state.pose).any(axis=1).all()


def drop(batch: ManipulationWorlds, which: NDArray[np.int64], most: int = 200) -> tuple[int, Step]:
    """Open the fingers of some worlds until one is told; return the number of decisions and the last step."""
    for number in range(1, most + 1):
        step = batch.step(let_go(batch, which))
        if (step.terminated | step.truncated).any():
            return number, step
    raise AssertionError("no episode ended")


def test_a_dropped_object_ends_its_own_episode_only() -> None:
    batch, other = worlds(), worlds()
    rows = np.arange(4)
    for each in (batch, other):
        each.reset(rows)
    number, step = drop(batch, np.array([2]))
    np.testing.assert_array_equal(step.terminated, [False, False, True, False])
    assert not step.truncated.any()
    assert number * SUBSTEPS > LOST_AFTER
    rest = np.array([0, 1, 3])
    for _ in range(number):
        theirs = other.step(let_go(other, rows[:0]))
    for name in ("observation", "successor", "reward"):
        np.testing.assert_array_equal(getattr(step, name)[rest], getattr(theirs, name)[rest])
    same(select(step.after, rest), select(theirs.after, rest))
    same(select(batch.state, rest), select(other.state, rest))
    assert batch.state.touching[2].all()
    again = [batch.step(let_go(batch, rows[:0])) for _ in range(10)]
    assert not any(each.terminated.any() for each in again)


def test_an_episode_that_is_lost_at_its_horizon_is_terminated_and_not_truncated() -> None:
    batch = worlds(interface=replace(STEPS, horizon=1000))
    batch.reset(np.arange(4))
    number, _ = drop(batch, np.array([2]))
    batch = worlds(interface=replace(STEPS, horizon=number))
    batch.reset(np.arange(4))
    _, step = drop(batch, np.array([2]))
    np.testing.assert_array_equal(step.terminated, [False, False, True, False])
    np.testing.assert_array_equal(step.truncated, [True, True, False, True])


def test_the_last_action_of_an_episode_is_not_the_first_ones_past() -> None:
    batch = worlds(interface=Interface(actions="steps", reward="progress", horizon=2))
    steps = [batch.step(np.full((4, 4), 0.3)) for _ in range(3)]
    jerk = [step.terms["jerk"] for step in steps]
    np.testing.assert_allclose(jerk, [np.full(4, -0.002 * 0.09), np.zeros(4), np.full(4, -0.002 * 0.09)])


def shaking(batch: ManipulationWorlds, number: int) -> Array:
    """Return actions that shake the object enough to lose it now and then."""
    return np.asarray(3.0 * np.sin(0.5 * number + np.arange(batch.count * 4).reshape(batch.count, 4)))


KINDS: tuple[Actions, ...] = ("angles", "steps")


@pytest.mark.parametrize("actions", KINDS)
def test_worlds_go_on_from_what_was_kept_byte_for_byte(actions: Actions) -> None:
    interface = Interface(actions=actions, reward="progress", horizon=15)
    batch = worlds(interface=interface)
    for number in range(20):
        batch.step(shaking(batch, number))
    kept = batch.state_dict()
    state = batch.state
    onward = [batch.step(shaking(batch, number)) for number in range(20, 60)]
    assert any(step.terminated.any() for step in onward) or actions == "steps"
    assert any(step.truncated.any() for step in onward) or actions == "angles"
    for other in (worlds(interface=interface, seed=77, threads=2), batch):
        other.load_state_dict(kept)
        same(other.state, state)
        for number, step in enumerate(onward, start=20):
            same(other.step(shaking(other, number)), step)


@pytest.mark.parametrize("threads", [1, 2])
def test_the_same_seed_gives_the_same_bytes(threads: int) -> None:
    interface = replace(STEPS, horizon=9)
    one, two = worlds(interface=interface), worlds(interface=interface, threads=threads)
    differs = worlds(interface=interface, seed=4)
    for number in range(25):
        same(one.step(shaking(one, number)), two.step(shaking(two, number)))
        differs.step(shaking(differs, number))
    assert (one.state.pose != differs.state.pose).any()


def test_what_was_handed_out_stays_as_it_was() -> None:
    batch = worlds(interface=replace(STEPS, horizon=4))
    first = batch.reset()
    steps = [batch.step(np.zeros((4, 4))) for _ in range(3)]
    copies = [first.copy(), *(step.observation.copy() for step in steps)]
    for _ in range(6):
        batch.step(np.full((4, 4), 0.3))
    for seen, copy in zip([first, *(step.observation for step in steps)], copies, strict=True):
        np.testing.assert_array_equal(seen, copy)


def test_actions_beyond_one_are_cut_and_others_refused() -> None:
    one, two = worlds(), worlds()
    same(one.step(np.full((4, 4), 0.99)), two.step(np.full((4, 4), 0.99)))
    same(one.step(np.full((4, 4), 1.0)), two.step(np.full((4, 4), 5.0)))
    wrong = np.zeros((4, 4))
    wrong[1, 2] = np.nan
    with pytest.raises(InputError, match=r"joint 2 in world 1 is nan"):
        one.step(wrong)
    with pytest.raises(InputError, match=r"actions of shape \(4,\); 4 worlds need \(4, 4\)"):
        one.step(np.zeros(4))
    same(one.step(np.zeros((4, 4))), two.step(np.zeros((4, 4))))


@pytest.mark.parametrize(
    ("interface", "count", "text"),
    [
        (Interface(observation="gripp"), 1, r"unknown observation 'gripp'; did you mean grip"),
        (Interface(reward="fast"), 1, "unknown reward 'fast'"),
        (Interface(horizon=0), 1, "1 worlds, horizon 0: both must be at least 1"),
        (Interface(), 0, "0 worlds, horizon 250: both must be at least 1"),
    ],
)
def test_worlds_that_cannot_be_are_refused(interface: Interface, count: int, text: str) -> None:
    with pytest.raises(InputError, match=text):
        worlds(count, interface)


# Demonstrations.


def shown(recipe: Recipe, interface: Interface = STEPS, seed: int = 0) -> list[Episodes]:
    """Return the demonstrations of a recipe, directions drawn of two."""
    recording = Recording(*HELD, (0.0, 90.0), recipe, interface, Noise(), seed)
    return list(demonstrations(recording, plans_of(recording), np.random.default_rng(seed)))


def test_a_demonstration_carries_the_object_and_is_reproducible() -> None:
    interface = Interface(observation="grip", actions="steps", reward="progress", horizon=120)
    (episodes,), (again,) = (shown(Recipe(episodes=6), interface, seed=1) for _ in range(2))
    assert episodes.observations.shape == (121, 6, 31)
    assert episodes.actions.shape == episodes.wanted.shape == (120, 6, 4)
    assert episodes.rewards.shape == episodes.valid.shape == (120, 6)
    assert (episodes.distance[~episodes.terminated] > 0.03).all()
    assert (~episodes.terminated).sum() >= 5
    assert np.abs(episodes.actions).max() <= 1.0
    assert (episodes.actions != episodes.wanted).any()
    np.testing.assert_allclose(episodes.starts.distance, reach_of(HELD, episodes.starts))
    same(episodes, again)


def test_what_comes_after_a_drop_is_not_valid() -> None:
    interface = replace(STEPS, observation="grip", reward="progress", horizon=80)
    episodes = shown(Recipe(episodes=10, push=0.15), interface, seed=3)[0]
    valid, terminated = episodes.valid, episodes.terminated
    assert 0 < terminated.sum() < 10
    assert not (~valid[:-1] & valid[1:]).any()
    lengths = valid.sum(axis=0)
    assert (lengths[~terminated] == 80).all()
    assert (lengths >= 1).all()
    for world in np.flatnonzero(terminated):
        rewards = episodes.rewards[valid[:, world], world]
        assert rewards[-1] < -9.0  # the drop
        assert (rewards[:-1] > -9.0).all()
        along = 0.1 * episodes.observations[lengths[world], world, 4]
        assert episodes.distance[world] == pytest.approx(along)  # not of the episode that began after it


def test_an_unpushed_expert_does_what_it_wants() -> None:
    starts = replace(pool(), distance=np.full(8, 0.01))
    recording = Recording(*HELD, (), Recipe(push=0.0), replace(STEPS, horizon=60), Noise(), seed=0)
    episodes = recorded(recording, starts, np.random.default_rng(0))
    np.testing.assert_array_equal(episodes.actions, episodes.wanted)
    np.testing.assert_allclose(episodes.distance, 0.01, atol=1e-3)
    assert not episodes.terminated.any()
    assert episodes.valid.all()


def test_a_part_of_the_episodes_starts_midway(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(made_of, "BATCH", 8)
    told: list[tuple[str, int, int]] = []
    recipe, interface = Recipe(episodes=20, midway=0.5, whole=0.0), replace(STEPS, horizon=60)
    recording = Recording(*HELD, (90.0,), recipe, interface, Noise(), seed=0)
    given = plans_of(recording, (0.0,)), np.random.default_rng(0)
    batches = list(demonstrations(recording, *given, lambda *what: told.append(what)))
    lost = sum(int(batch.terminated.sum()) for batch in batches)
    assert [done for _, done, _ in told] == [0, 8, 16, 20]
    assert told[-1] == (f"recording demonstrations{f', {lost} lost' if lost else ''}", 20, 20)
    assert [len(batch.starts) for batch in batches] == [8, 8, 4]
    times = [batch.starts.state.time for batch in batches]
    assert np.ptp(times[0]) == 0
    for each in times[1:]:
        late = each > each.min() + EARLIEST * SUBSTEPS * 0.004 - 1e-9
        assert late.sum() == len(each) // 2
        assert np.ptp(each[~late]) == 0
    for batch in batches:
        assert batch.starts.state.touching.all()
        assert (batch.starts.distance <= reach_of(HELD, batch.starts)).all()
        assert batch.starts.distance.std() > 0


def test_too_short_a_horizon_leaves_nothing_midway() -> None:
    recording = Recording(*HELD, (), Recipe(), replace(STEPS, horizon=5), Noise(), seed=0)
    episodes = recorded(recording, pool(), np.random.default_rng(0))
    midway = episodes.midway
    assert episodes.valid.all()
    assert len(midway) == 0


def test_states_of_a_running_batch_become_starts() -> None:
    batch = worlds()
    for number in range(6):
        batch.step(let_go(batch, np.array([0])) if number < 2 else np.zeros((4, 4)))
    found = taken(batch.simulator, batch.state, np.array([3, 1]), np.array([45.0, 0.0]))
    other = ManipulationWorlds(HELD, found, 2, STEPS, np.random.default_rng(0), threads=1)
    other.reset(np.arange(2))
    same(other.state, select(batch.state, np.array([3, 1])))
    ours, theirs = batch.step(np.full((4, 4), 0.2)), other.step(np.full((2, 4), 0.2))
    np.testing.assert_array_equal(ours.after.pose[[3, 1]], theirs.after.pose)


def test_starts_demonstrations_and_environments_run_in_the_engine_asked_for() -> None:
    pytest.importorskip("pybullet", reason="the witness needs the extra `bullet`")
    recipe, interface = Recipe(episodes=2, grasp="rough", midway=1.0), replace(STEPS, horizon=30)
    recording = Recording(*HELD, (0.0,), recipe, interface, Noise(0.0, 0.0), seed=0, engine="bullet")
    plans, rng = plans_of(recording), np.random.default_rng(0)
    (batch,) = demonstrations(recording, plans, rng)
    assert batch.starts.engine == "bullet"
    assert batch.starts.state.touching.all()
    again = ManipulationWorlds(HELD, joined([batch.starts, batch.starts]), 3, STEPS)
    assert again.simulator.engine == "bullet"
    assert ManipulationWorlds(HELD, pool(), 1, STEPS).simulator.engine == "planar"
    ours = gripped(*HELD, (plans, np.zeros(1)), rng, Noise(0.0, 0.0)).state.joint_angles
    assert np.abs(ours - batch.starts.state.joint_angles[:1]).max() > 1e-4
    config = EnvironmentConfig(directions=(0.0,), starts=1, grasp="rough", engine="bullet")
    assert config.pool().engine == "bullet"
    with pytest.raises(InputError, match=r"engine is 'bulet'; it must be planar or mujoco or bullet"):
        EnvironmentConfig(engine=cast("Any", "bulet"))


def test_only_states_in_which_the_object_is_held_start_other_episodes(monkeypatch: pytest.MonkeyPatch) -> None:
    starts = pool()
    recording = Recording(*HELD, (), Recipe(), replace(STEPS, horizon=1), Noise(), seed=0)
    monkeypatch.setattr(made_of, "EARLIEST", 0)
    for tolerance, count in ((measuring.CONTACT_TOLERANCE, len(starts)), (-1.0, 0)):  # nothing touches then
        monkeypatch.setattr(measuring, "CONTACT_TOLERANCE", tolerance)
        assert len(recorded(recording, starts, np.random.default_rng(0)).midway) == count
