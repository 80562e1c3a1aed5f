"""What a learned controller on real senses remembers, what it is asked, and the teacher that it learns from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from inhand.control.catalogue import find_controller, learned
from inhand.control.contract import contract_of
from inhand.control.controller import Task
from inhand.control.estimator import WAIT
from inhand.control.memory import Memory
from inhand.control.policy import Policy, parts_of
from inhand.control.seen import Seen, exact
from inhand.control.sensed_policy import PolicyPrimitive, SensedPolicyController
from inhand.control.underway import ARRIVED, STILL_TIME
from inhand.control.user_policy import user_policy
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array, Path
from inhand.hands.fit import Held
from inhand.hands.sides import rough_plan
from inhand.learning.experts import expert_of, taught_reach
from inhand.learning.presets import preset
from inhand.learning.run_cards import check
from inhand.learning.starts import Starts, gripped
from inhand.learning.worlds import Interface, ManipulationWorlds
from inhand.sim.disturbance import FIELD
from inhand.tasks.decisions import actions_of
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import Aim
from inhand.tasks.past import LAGS
from inhand.tasks.paths import stacked, straight_path
from inhand.tasks.primitives import primitive_at
from test_simulator import CUBE, HAND

HELD, PERIOD = Held(HAND, CUBE), 0.02


@pytest.fixture(scope="module")
def starts() -> Starts:
    """Return an object held in four worlds of `field`, two of them to go right, and two up."""
    plans = dict.fromkeys((0.0, 90.0), rough_plan(*HELD))
    angles = np.array([0.0, 0.0, 90.0, 90.0])
    found = gripped(*HELD, (plans, angles), np.random.default_rng(0), disturb=FIELD)
    return replace(found, distance=np.full(4, 0.02))


def seen_at(starts: Starts, decision: int, frame: Array | None = None) -> Seen:
    """Return what is sensed some decisions after the starts where all stands still; a `frame` is a new one."""
    seen = exact(starts.state)
    time = seen.time + PERIOD * decision
    return replace(seen, time=time, **({} if frame is None else {"frame_pose": frame, "frame_time": time}))


def test_readings_are_remembered_by_their_lag(starts: Starts) -> None:
    memory = Memory(HELD, seen_at(starts, 0))
    for decision in range(1, 12):
        seen = seen_at(starts, decision)
        memory.take(replace(seen, joint_angles=seen.joint_angles + 0.001 * decision))
    past, joints = memory.past, starts.state.joint_angles
    for lag, found in zip(LAGS, past.joints, strict=True):
        np.testing.assert_allclose(found, joints + 0.001 * (11 - lag), atol=1e-12)
    np.testing.assert_array_equal(past.first, joints)
    np.testing.assert_allclose(past.ages[0], 11 * PERIOD)


def test_the_start_is_the_mean_of_the_frames_of_the_wait_alone(starts: Starts) -> None:
    memory, pose = Memory(HELD, seen_at(starts, 0)), starts.state.pose
    asked = Aim(np.zeros(4), pose, np.full(4, 0.03))
    last = round(WAIT / PERIOD)
    for decision in range(1, last + 1):
        assert memory.past.waiting.all()
        np.testing.assert_array_equal(memory.past.aimed(asked).distance, np.zeros(4))
        memory.take(seen_at(starts, decision, pose + 0.001 * decision))
    wanted = pose + 0.001 * np.arange(last + 1).mean()
    np.testing.assert_allclose(memory.past.aimed(asked).start, wanted, atol=1e-9)
    for decision in range(last + 1, last + 4):
        memory.take(seen_at(starts, decision, pose + 0.1))
    past = memory.past
    assert not past.waiting.any()
    np.testing.assert_allclose(past.start, wanted, atol=1e-9)
    np.testing.assert_array_equal(past.aimed(asked).distance, asked.distance)
    # What is believed counts from when the wait ended.
    assert (np.abs(past.shift(asked)[:, 0]) > 0.005).all()


def test_one_world_begins_anew_and_the_others_go_on(starts: Starts) -> None:
    both, alone = (Memory(HELD, seen_at(starts, 0)) for _ in range(2))
    moved = starts.state.pose + 0.002
    for decision in range(1, 30):
        seen = seen_at(starts, decision, moved)
        for memory in (both, alone):
            memory.take(seen)
        if decision == 20:
            both.begin(np.array([2]), seen)
    others = np.array([0, 1, 3])
    for name, values in vars(both.past).items():
        worlds = 1 if values.shape[0] == len(LAGS) and values.ndim > 1 else 0
        one, two = (np.take(getattr(each.past, name), others, axis=worlds) for each in (both, alone))
        np.testing.assert_array_equal(one, two, err_msg=name)
    assert both.past.waiting.tolist() == [False, False, True, False]
    np.testing.assert_allclose(both.past.start[2], moved[2])


def test_what_goes_on_is_remembered_and_counts_from_where_the_object_is_believed(starts: Starts) -> None:
    memory, pose = Memory(HELD, seen_at(starts, 0)), starts.state.pose
    for decision in range(1, 20):
        memory.take(seen_at(starts, decision, pose + np.array([0.003, -0.002, 0.01])))
    before = memory.past
    memory.go_on(np.array([1]), np.array([0.2]))
    after, asked = memory.past, Aim(np.zeros(4), pose, np.full(4, 0.03))
    shift = after.shift(after.aimed(asked))
    np.testing.assert_allclose(shift[1, :2], 0.0, atol=1e-12)  # it begins where it is ...
    np.testing.assert_allclose(shift[1, 2], before.pose[1, 2] - before.believed[1, 2] - 0.2)  # ... to be held turned
    np.testing.assert_array_equal(after.start[1], after.believed[1])
    np.testing.assert_array_equal(after.first[1], after.joint_angles[1])
    assert not after.waiting.any()
    for name, values in vars(after).items():
        axis = 1 if values.shape[0] == len(LAGS) and values.ndim > 1 else 0
        one, two = (np.take(each, [0, 2, 3], axis=axis) for each in (values, getattr(before, name)))
        np.testing.assert_array_equal(one, two, err_msg=name)


def test_what_is_remembered_of_some_worlds_is_that_of_these(starts: Starts) -> None:
    memory = Memory(HELD, seen_at(starts, 0))
    memory.take(seen_at(starts, 1, starts.state.pose + 0.001 * np.arange(4)[:, None]))
    some = memory.past.select(np.array([3, 1]))
    assert some.n_worlds == 2
    for name, values in vars(memory.past).items():
        axis = 1 if values.shape[0] == len(LAGS) and values.ndim > 1 else 0
        np.testing.assert_array_equal(getattr(some, name), np.take(values, [3, 1], axis=axis), err_msg=name)


def test_paths_that_bend_are_nothing_for_a_policy_and_turns_on_the_spot_are() -> None:
    way = np.linspace(0.0, 0.1, 5)
    straight = np.stack([0 * way, way, 0 * way], axis=-1)
    turn = np.stack([0 * way, 0 * way, -way], axis=-1)
    both = np.concatenate([turn, straight - (0.0, 0.0, 0.1)])
    angle, turned = parts_of(stacked([straight, turn, both]))
    np.testing.assert_allclose(angle, [np.pi / 2, 0.0, np.pi / 2])
    np.testing.assert_allclose(turned, [0.0, -0.1, -0.1])
    for bent in (straight + turn, np.concatenate([straight, turn + straight[-1]])):
        with pytest.raises(InputError, match="straight primitives"):
            parts_of(bent[None])


def test_a_turn_is_a_way_on_an_arc_and_what_it_moves_is_off() -> None:
    aim = Aim(np.zeros(2), np.zeros((2, 3)), 0.01, turn=np.array([-1.0, 0.0]))
    shift = aim.shift(np.array([[0.003, 0.004, -0.1], [0.003, 0.004, -0.1]]))
    np.testing.assert_allclose(aim.come(shift), [0.1 * TURN_ARM, 0.003])
    np.testing.assert_allclose(aim.off(shift), [[0.005, 0.004], [0.0, 0.1]])
    np.testing.assert_array_equal(aim.heading, [[0.0, 0.0], [1.0, 0.0]])


def listening(told: list[Array]) -> Policy:
    """Return a policy that holds, and tells a list the direction, the side of a turn and the way that it is asked."""

    class Listens(Policy):
        def __call__(self, observation: Array) -> Array:
            told.append(observation[:, :4] * (1.0, 1.0, 1.0, 0.1))
            return np.zeros((len(observation), HAND.n_joints))

    weights = np.zeros((find_layout("senses").size(HAND), HAND.n_joints))
    return Listens((weights,), (np.zeros(HAND.n_joints),), "senses", "steps", "sensed", {}, None)


def test_a_policy_on_senses_holds_while_it_waits_then_is_told_its_way_and_ends(starts: Starts) -> None:
    told = list[Array]()
    path = Path(np.tile(np.linspace(0.0, 0.05, 3)[:, None] * [1.0, 0.0, 0.0], (4, 1, 1)))
    entry = learned("senses", listening(told))
    assert entry.reads == "sensed"
    controller = entry.manipulate(Task(HAND, (CUBE,) * 4, path, distance=np.full(4, 0.03)))
    assert isinstance(controller, SensedPolicyController)
    controller.begin(seen_at(starts, 0))
    done = []
    for decision in range(40):
        np.testing.assert_array_equal(controller.act(seen_at(starts, decision)), starts.state.targets)
        done.append(bool(controller.finished(seen_at(starts, decision)).all()))
    waits = round(WAIT / PERIOD)
    np.testing.assert_allclose(
        np.array(told)[..., 3], np.repeat([0.0, 0.03 + ARRIVED], [waits, 40 - waits])[:, None] * np.ones(4)
    )
    assert done.index(True) == pytest.approx(waits + 0.4 / PERIOD, abs=2)


def test_a_twist_comes_before_the_way_and_nothing_is_waited_for_between(starts: Starts) -> None:
    told = list[Array]()
    turns = np.array([0.02, -0.5, 0.0, 0.5])  # one is nothing, two are never reached by who holds
    ways = np.linspace(0.0, 1.0, 3)[:, None]
    path = stacked([np.concatenate([ways * [0.0, 0.0, a], [0.0, 0.0, a] + ways * [0.0, 0.04, 0.0]]) for a in turns])
    task = Task(HAND, (CUBE,) * 4, Path(path), distance=np.array([0.03, 0.03, 0.03, 0.0005]))
    controller = learned("senses", listening(told)).manipulate(task)
    assert isinstance(controller, SensedPolicyController)
    controller.begin(seen_at(starts, 0))
    for decision in range(30):
        controller.act(seen_at(starts, decision))
    waits, asked, way = round(WAIT / PERIOD), np.array(told), 0.03 + ARRIVED
    np.testing.assert_allclose(asked[:waits, :, 3], 0.0)
    np.testing.assert_allclose(asked[:waits, :, 2], np.tile(np.sign(turns), (waits, 1)))
    np.testing.assert_allclose(asked[waits - 1, :, 3], 0.0)
    ends = [way - 0.02 * TURN_ARM, 0.5 * TURN_ARM, way, 0.0005 + ARRIVED]
    np.testing.assert_allclose(asked[-1, :, 3], ends, atol=1e-12)
    np.testing.assert_allclose(asked[-1, :, 2], [0.0, -1.0, 0.0, 1.0])
    np.testing.assert_allclose(asked[-1, [0, 2], :2], [[0.0, 1.0], [0.0, 1.0]], atol=1e-12)
    np.testing.assert_allclose(controller.progress, [0.02 * TURN_ARM, 0.0, 0.0, 0.0], atol=2e-4)


def test_a_primitive_of_a_sequence_counts_from_where_it_is_planned_to_start(starts: Starts) -> None:
    told, memory = list[Array](), Memory(HELD, seen_at(starts, 0))
    path = Path(np.tile(np.linspace(0.0, 0.02, 3)[:, None] * [1.0, 0.0, 0.0], (2, 1, 1)))
    worlds, start = np.array([1, 3]), starts.state.pose[[1, 3]] - (0.004, 0.0, 0.1)
    primitive = PolicyPrimitive(Task(HAND, (CUBE,) * 2, path, start=start), listening(told))
    for decision in range(1, 20):
        memory.take(seen_at(starts, decision))
        past = memory.past.select(worlds)
        if decision == 1:
            primitive.begin(past)
        primitive.act(past)
        assert not primitive.finished(past).any()
    waits = round(WAIT / PERIOD)
    assert (np.array(told)[: waits - 1, :, 3] == 0).all()
    np.testing.assert_allclose(np.array(told)[waits:, :, 3], 0.02 + ARRIVED)  # it stops a little before
    seen = primitive.seen_by(past)
    np.testing.assert_allclose(seen[0].shift(seen[1]), past.pose - start, atol=1e-12)


def test_primitive_follows_primitive_and_the_teacher_goes_them_all(starts: Starts) -> None:
    here = starts.state.pose
    back, nothing = np.column_stack([here[:, :2] + 0.004, np.zeros(4)]), np.full((4, 3), np.nan)
    turn = np.tile([0.0, 0.0, 0.15], (4, 1))
    legs = np.stack([turn, back, nothing], axis=1)
    legs[3, 0] = np.nan
    interface = Interface("senses", "steps", "progress", horizon=200, truth="truth")
    asked = replace(starts, distance=np.full(4, 0.008), legs=legs)
    worlds = ManipulationWorlds(HELD, asked, 4, interface, np.random.default_rng(1))
    worlds.reset(np.arange(4))
    teach, seen, lost = expert_of("teacher", HELD, asked, worlds), list[Array](), np.zeros(4, dtype=bool)
    for _ in range(150):
        step = worlds.step(actions_of(teach(), "steps", HAND, worlds.seen))
        seen.append(np.column_stack([worlds.aim.turn, worlds.asked.distance, step.observation[:, 3]]))
        lost |= step.terminated
    told = np.array(seen)
    assert not lost.any()
    sides = [(np.diff(told[:, world, 0]) != 0).sum() for world in range(4)]
    assert sides == [2, 2, 2, 0]
    assert (told[15:, :, 1] > 0).all()  # nothing is waited for again
    np.testing.assert_allclose(told[:, :, 1] / 0.1, told[:, :, 2], atol=1e-6)  # and the actor is asked the same
    turned = worlds.state.pose[:, 2] - here[:, 2]
    np.testing.assert_allclose(turned, [0.15, 0.15, 0.15, 0.0], atol=0.05)
    np.testing.assert_allclose(worlds.state.pose[:3, :2], back[:3, :2], atol=2.5e-3)
    np.testing.assert_allclose(step.shift[3, 0], 0.008, atol=2.5e-3)


def test_the_teacher_knows_zeros_and_carries_the_object_where_it_is_asked(starts: Starts) -> None:
    interface = Interface("senses", "steps", "progress", horizon=200, truth="truth")
    worlds = ManipulationWorlds(HELD, starts, 4, interface, np.random.default_rng(1))
    worlds.reset(np.arange(4))
    teach = expert_of("teacher", HELD, starts, worlds)
    shift, lost = np.zeros((4, 3)), np.zeros(4, dtype=bool)
    for _ in range(110):
        step = worlds.step(actions_of(teach(), "steps", HAND, worlds.seen))
        shift, lost = step.shift, lost | step.terminated
    assert not lost.any()
    np.testing.assert_allclose(shift[:, 0], 0.02, atol=2.5e-3)
    assert np.abs(shift[:, 1]).max() < 2e-3
    assert step.observation.shape == (4, 99 + 40)


def test_the_shipped_policy_on_senses_carries_as_far_as_it_is_told_and_says_what_it_reads(starts: Starts) -> None:
    entry = find_controller("rl")
    policy = entry.policy
    assert policy is not None
    assert (entry.reads, policy.grasp, policy.trained["preset"]) == ("sensed", "sensed", "default")
    assert policy.contract == contract_of(HAND, FIELD)
    interface = Interface(policy.observation, policy.actions, "progress", horizon=200)
    worlds = ManipulationWorlds(HELD, starts, 4, interface, np.random.default_rng(1))
    seen, lost = worlds.reset(np.arange(4)), np.zeros(4, dtype=bool)
    for _ in range(90):
        step = worlds.step(policy(seen))
        seen, lost = step.observation, lost | step.terminated
    assert not lost.any()
    np.testing.assert_allclose(step.shift[:, 0], 0.02, atol=3e-3)


def test_what_has_no_memory_is_not_given_the_layout_of_senses() -> None:
    with pytest.raises(InputError, match="has a memory: make a controller"):
        user_policy(np.tanh, "senses")
    with pytest.raises(InputError, match="knows primitives: leave task out, or take layout senses"):
        check(replace(preset("family"), pairs=0, task="key"))
    with pytest.raises(InputError, match="'rl-sensed' is called rl now, and what was rl is called rl-privileged"):
        find_controller("rl-sensed")
    with pytest.raises(InputError, match="what was sensed is default now, and what was default is privileged"):
        preset("sensed")
    with pytest.raises(InputError, match="'ik' shows straight primitives: leave turns and legs at 0"):
        check(replace(preset("privileged"), recipe=replace(preset("privileged").recipe, turns=0.1)))


def test_how_far_a_world_carries_is_less_on_smoother_fingers(starts: Starts) -> None:
    rows = np.array([0, 0])
    twice = starts.take(rows, starts.angle_deg[rows])
    assert twice.disturbed is not None
    spec = replace(FIELD, pushes=type(FIELD.pushes)())
    worlds = [
        replace(each, spec=spec, drawn=replace(each.drawn, friction=f))
        for each, f in zip(twice.disturbed, (0.1, 1.5), strict=True)
    ]
    found = taught_reach(HELD, replace(twice, disturbed=tuple(worlds)), np.random.default_rng(2), "teacher")
    assert 0.0 <= found[0] < found[1] - 0.005


def along(way: float) -> SensedPolicyController:
    """Return the policy that ships, to go a way to the right in two worlds and up in two."""
    policy = find_controller("rl").policy
    assert policy is not None
    paths = [straight_path(primitive_at(angle)).poses for angle in (0.0, 0.0, 90.0, 90.0)]
    return SensedPolicyController(Task(HAND, (CUBE,) * 4, Path(stacked(paths)), distance=np.full(4, way)), policy)


def test_who_has_arrived_keeps_its_commands_wherever_the_object_is_seen_then(starts: Starts) -> None:
    controller, pose, kept = along(0.004), starts.state.pose, []
    out = slice(2, 4)  # fingers hold it less firmly there than on the line between them, and it is believed to go
    controller.begin(seen_at(starts, 0))
    for decision in range(80):
        seen = seen_at(starts, decision, pose + np.array([0.0, 0.01 * (20 < decision < 50), 0.0]))
        kept.append((controller.act(seen) == seen.targets)[out].all())
    assert not any(kept[:21])
    assert all(kept[48:])
    assert controller.progress[out].max() < 0.004 - 2e-4


def test_what_is_to_go_nowhere_is_held_wherever_it_is_seen(starts: Starts) -> None:
    controller = along(0.0)
    controller.begin(seen_at(starts, 0))
    for decision in range(40):
        seen = seen_at(starts, decision, starts.state.pose - np.array([0.002, 0.002, 0.0]))
        np.testing.assert_array_equal(controller.act(seen), seen.targets)


def test_who_comes_no_farther_is_done_after_a_while(starts: Starts) -> None:
    controller = along(0.05)
    controller.begin(seen_at(starts, 0))
    done = []
    for decision in range(60):
        seen = seen_at(starts, decision)
        controller.act(seen)
        done.append(controller.finished(seen))
    first = PERIOD * np.argmax(done, axis=0)
    np.testing.assert_allclose(first, WAIT + STILL_TIME, atol=0.05)
    assert done[-1].all()
