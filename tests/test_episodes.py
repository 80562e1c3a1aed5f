"""Phases and the one loop: what ends an episode, when, and what it leaves."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from inhand.control.catalogue import planned_grasp
from inhand.control.controller import Controller, Task
from inhand.control.episode import MANIPULATE
from inhand.control.ik import IkController
from inhand.control.joint import JointPid, PidConfig
from inhand.control.loop import LOST_AFTER, Recording, control_step, dropped, lost_steps, run_episodes
from inhand.control.phases import SPREAD, Grasp, Phase, placed_joints, standard_phases
from inhand.control.recording import cut_trials
from inhand.control.trial import DIVERGED, LOST_CONTACT, NO_GRASP, REACHED, TIME_OUT, Trial
from inhand.geometry import Array, Path, spatial
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.sim.engine import Simulator
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.snapshot import Snapshot
from inhand.sim.state import State
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import TRAIN
from made import passport

HAND = parse_hand_name("2v2_50.50_50.50_1.1_53")
CUBE = OBJECTS["cube_39"]


def state_with(touching: NDArray[np.bool_], time: float = 0.0, diverged: NDArray[np.bool_] | None = None) -> State:
    """Return a state of which only the contacts `(B, 2)`, the time and what diverged `(B,)` mean anything."""
    n = len(touching)
    points = np.tile([[-0.0195, 0.0936, 0.05], [0.0195, 0.0936, 0.05]], (n, 1, 1))
    return State(
        time=np.full(n, time),
        object_pose=spatial(np.tile([0, 0.0936, 0], (n, 1)), CUBE.height / 2),
        object_velocity=np.zeros((n, 6)),
        joint_angles=np.zeros((n, 4)),
        joint_velocities=np.zeros((n, 4)),
        targets=np.zeros((n, 4)),
        link_gaps=np.zeros((n, 4)),
        contact_links=np.ones((n, 2), dtype=np.int64),
        finger_points=points,
        object_points=points,
        gaps=np.where(touching, 0.0, 0.001),
        forces=np.zeros_like(points),
        diverged=np.zeros(n, dtype=bool) if diverged is None else diverged,
    )


class Scripted(Simulator):
    """A simulator whose contacts `(T, B, 2)` after each step were written down beforehand; the last row stays."""

    engine = "mujoco"

    def __init__(self, contacts: NDArray[np.bool_], diverging: dict[int, int] | None = None) -> None:
        """Diverge in worlds at the steps given."""
        super().__init__(HAND, [CUBE] * contacts.shape[1])
        self.contacts, self.diverging, self.steps, self.time = contacts, diverging or {}, 0, 0.0
        self.moved: list[list[bool]] = []

    def _measure(self, active: NDArray[np.bool_]) -> State:
        """Give the row of the last step; before the first all are in contact."""
        del active
        if not self.steps:
            return state_with(np.ones(self.contacts.shape[1:], dtype=bool))
        row = self.contacts[min(self.steps, len(self.contacts)) - 1]
        diverged = np.array([self.steps >= self.diverging.get(world, np.inf) for world in range(len(row))])
        return state_with(row, self.time, diverged)

    def snapshot(self) -> Snapshot:
        """Keep nothing."""
        raise NotImplementedError

    def _place(self, object_pose: Array, joint_angles: Array) -> None:
        del object_pose, joint_angles
        self.steps = 0

    def _advance(self, targets: Array, substeps: int, active: NDArray[np.bool_]) -> None:
        del targets
        self.moved.append(active.tolist())
        self.steps += 1
        self.time = self.steps * substeps * self.timestep

    def _put(self, worlds: NDArray[np.int64], snapshot: Snapshot, rows: NDArray[np.int64]) -> None:
        raise NotImplementedError

    def _become(self, worlds: NDArray[np.int64]) -> None:
        del worlds

    def _knock(self, worlds: NDArray[np.int64], impulse: Array) -> None:
        raise NotImplementedError


@dataclass
class Counting:
    """A controller that commands nothing and finishes each world after some decisions."""

    after: Sequence[int]
    """Decisions after which each world has finished."""
    begun: list[float] = field(default_factory=list)
    acted: int = 0

    def begin(self, state: State) -> None:
        """Note when the phase started."""
        self.begun.append(float(state.time[0]))

    def act(self, state: State) -> Array:
        """Count."""
        self.acted += 1
        return np.zeros_like(state.joint_angles)

    def finished(self, state: State) -> NDArray[np.bool_]:
        """Return which worlds had their number of decisions."""
        del state
        return self.acted >= np.array(self.after)


def task_for(simulator: Scripted | MujocoSimulator, substeps: int = 5) -> Task:
    """Return the task of carrying every world's object straight out."""
    path, n = straight_path(TRAIN[0]), len(simulator.objects)
    return Task(simulator.hand, simulator.objects, Path(np.tile(path.poses, (n, 1, 1))), 0.004, substeps)


def run_script(
    contacts: NDArray[np.bool_],
    phases: Sequence[Phase],
    substeps: int = 5,
    diverging: dict[int, int] | None = None,
) -> Recording:
    simulator = Scripted(contacts, diverging or {})
    count = contacts.shape[1]
    start = simulator.reset(np.zeros((count, 3)), np.zeros((count, 4)))
    return run_episodes(simulator, task_for(simulator, substeps), phases, start)


def carrying(*after: int, longest: float = 1.0) -> Phase:
    """Return a manipulation phase that finishes its worlds after some decisions each."""
    return Phase(MANIPULATE, lambda task: Counting(after[: task.n_worlds]), longest, keep_contact=True)


def one_world(*right: int) -> NDArray[np.bool_]:
    """Return the contacts of one world whose left finger always touches, and whose right one as told."""
    return np.stack([np.ones(len(right), bool), np.array(right, bool)], axis=-1)[:, None]


def test_lost_steps_count_up_and_start_again() -> None:
    lost = np.zeros(3, dtype=np.int64)
    both, neither, one = (True, True), (False, False), (False, True)
    for row in ((both, neither, one), (both, both, one), (one, neither, one)):
        lost = lost_steps(lost, state_with(np.array(row)), 5)
    np.testing.assert_array_equal(lost, [5, 5, 15])


@pytest.mark.parametrize(("substeps", "rows"), [(5, 5), (4, 6), (20, 2), (21, 1)])
def test_a_contact_lost_for_more_than_twenty_steps_ends_the_episode_and_not_before(substeps: int, rows: int) -> None:
    recording = run_script(one_world(1, 1, 0), [carrying(40, longest=50 * substeps * 0.004)], substeps)
    assert recording.outcomes == (LOST_CONTACT,)
    np.testing.assert_array_equal(recording.last, [2 + rows])
    assert (rows - 1) * substeps <= LOST_AFTER < rows * substeps


def test_a_contact_lost_for_twenty_steps_and_found_again_goes_on() -> None:
    recording = run_script(one_world(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1), [carrying(12)])
    assert recording.outcomes == (REACHED,)
    np.testing.assert_array_equal(recording.last, [12])


def test_finishing_in_contact_ends_the_episode() -> None:
    recording = run_script(one_world(1), [carrying(7)])
    assert recording.outcomes == (REACHED,)
    np.testing.assert_array_equal(recording.last, [7])
    assert len(recording.states) == 8


def test_a_world_that_finishes_while_a_finger_is_off_may_find_it_again() -> None:
    recording = run_script(one_world(1, 1, 0, 0, 1), [carrying(3)])
    assert recording.outcomes == (REACHED,)
    np.testing.assert_array_equal(recording.last, [5])


def test_a_world_that_finishes_while_a_finger_is_off_may_have_lost_it() -> None:
    recording = run_script(one_world(1, 1, 0), [carrying(3)])
    assert recording.outcomes == (LOST_CONTACT,)
    np.testing.assert_array_equal(recording.last, [7])


def test_time_runs_out() -> None:
    recording = run_script(one_world(1), [carrying(1000, longest=0.2)])
    assert recording.outcomes == (TIME_OUT,)
    np.testing.assert_array_equal(recording.last, [10])


def test_a_grasp_that_does_not_hold_is_out_and_others_go_on() -> None:
    contacts = np.ones((30, 3, 2), dtype=bool)
    contacts[:3, :, :] = False
    contacts[:, 1, 0] = False
    phases = [Phase("grasp", lambda _: Counting((4, 4, 4)), 1.0, must_hold=True), carrying(6, 6, 9)]
    recording = run_script(contacts, phases)
    assert recording.outcomes == (REACHED, NO_GRASP, REACHED)
    np.testing.assert_array_equal(recording.last, [10, 4, 13])
    np.testing.assert_array_equal(recording.phase, [0] * 5 + [1] * 9)


def test_no_grasp_anywhere_ends_the_batch() -> None:
    phases = [Phase("grasp", lambda _: Counting((4, 4)), 1.0, must_hold=True), carrying(6, 6)]
    recording = run_script(np.zeros((1, 2, 2), dtype=bool), phases)
    assert recording.outcomes == (NO_GRASP, NO_GRASP)
    assert len(recording.states) == 5


@pytest.mark.parametrize("step", [1, 3, 4])
def test_a_world_that_diverges_is_out_at_once_in_any_phase_and_others_go_on(step: int) -> None:
    """Its last row is the one before: nothing was measured in the row in which it was found."""
    phases = [Phase("grasp", lambda _: Counting((3, 3)), 1.0, must_hold=True), carrying(4, 4)]
    recording = run_script(np.ones((1, 2, 2), dtype=bool), phases, diverging={0: step})
    assert recording.outcomes == (DIVERGED, REACHED)
    np.testing.assert_array_equal(recording.last, [step - 1, 7])


def test_diverging_changes_no_verdict_that_was_given_before() -> None:
    contacts = np.ones((20, 2, 2), dtype=bool)
    contacts[2:, 1] = False
    recording = run_script(contacts, [carrying(4, 30)], diverging={0: 6, 1: 8})
    assert recording.outcomes == (REACHED, LOST_CONTACT)
    np.testing.assert_array_equal(recording.last, [4, 7])


def test_a_batch_in_which_every_world_diverged_is_over() -> None:
    recording = run_script(np.ones((1, 2, 2), dtype=bool), [carrying(9, 9)], diverging={0: 2, 1: 3})
    assert recording.outcomes == (DIVERGED, DIVERGED)
    assert len(recording.states) == 4


def test_contact_may_be_missing_where_a_phase_does_not_ask_for_it() -> None:
    phases = [Phase("place", lambda _: Counting((30,)), 1.0), carrying(2)]
    recording = run_script(one_world(*[0] * 30, 1), phases)
    assert recording.outcomes == (REACHED,)


def test_a_phase_begins_once_with_the_state_that_the_one_before_left() -> None:
    controllers = [Counting((3,)), Counting((2,))]
    phases = [
        Phase("first", lambda _: controllers[0], 1.0),
        Phase(MANIPULATE, lambda _: controllers[1], 1.0, keep_contact=True),
    ]
    run_script(one_world(1), phases)
    assert [each.begun for each in controllers] == [[0.0], [pytest.approx(0.06)]]
    assert [each.acted for each in controllers] == [3, 2]


def test_a_grip_alone_closes_in_all_worlds_until_the_slowest_has() -> None:
    contacts = np.ones((9, 3, 2), dtype=bool)
    contacts[:, 1, 0] = False
    recording = run_script(contacts, [Phase("grasp", lambda _: Counting((2, 2, 4)), 1.0, must_hold=True)])
    assert recording.outcomes == (REACHED, NO_GRASP, REACHED)
    np.testing.assert_array_equal(recording.last, [4, 4, 4])


def test_a_second_manipulation_follows_the_first() -> None:
    """There and back: finishing a phase that is not the last is no reason to end the episode."""
    phases = [carrying(3), Phase("back", lambda _: Counting((4,)), 1.0, keep_contact=True)]
    recording = run_script(one_world(1), phases)
    np.testing.assert_array_equal(recording.phase, [0] * 4 + [1] * 4)
    assert recording.outcomes == (REACHED,)


def test_progress_is_told_after_every_step() -> None:
    contacts = np.ones((9, 2, 2), dtype=bool)
    contacts[:, 1, 1] = False
    simulator, told = Scripted(contacts), list[tuple[str, int, int]]()
    start = simulator.reset(np.zeros((2, 3)), np.zeros((2, 4)))
    run_episodes(simulator, task_for(simulator), [carrying(7, 7)], start, lambda *news: told.append(news))
    running = [2, 2, 2, 2, 1, 1, 0]
    assert told == [(MANIPULATE, count, step) for step, count in enumerate(running, start=1)]


def test_a_world_whose_episode_has_ended_is_stepped_no_more() -> None:
    contacts = np.ones((9, 4, 2), dtype=bool)
    contacts[:, 1, 1] = False
    simulator = Scripted(contacts, {3: 2})
    start = simulator.reset(np.zeros((4, 3)), np.zeros((4, 4)))
    run_episodes(simulator, task_for(simulator), [carrying(3, 9, 7, 9)], start)
    ended = [moved.index(False) for moved in np.array([*simulator.moved, [False] * 4]).T.tolist()]
    assert ended == [3, 5, 7, 2]


def test_episodes_of_some_worlds_leave_the_others_alone() -> None:
    simulator = Scripted(np.ones((1, 3, 2), dtype=bool))
    start = simulator.reset(np.zeros((3, 3)), np.zeros((3, 4)))
    worlds = np.array([False, True, True])
    recording = run_episodes(simulator, task_for(simulator), [carrying(9, 2, 4)], start, worlds=worlds)
    assert simulator.moved == [[False, True, True]] * 2 + [[False, False, True]] * 2
    assert recording.last.tolist() == [0, 2, 4]
    assert recording.outcomes[1:] == (REACHED, REACHED)


def test_each_trial_is_cut_at_its_own_last_row() -> None:
    contacts = np.ones((30, 2, 2), dtype=bool)
    contacts[4:, 0, 1] = False
    phases = [Phase("grasp", lambda _: Counting((2, 2)), 1.0, must_hold=True), carrying(20, 20)]
    recording = run_script(contacts, phases)
    short, long = cut_trials(Trial, recording, [passport(trial=1), passport(trial=2)], np.zeros((2, 3, 3)))
    assert (short.outcome, long.outcome) == (LOST_CONTACT, REACHED)
    assert (len(short.time), len(long.time)) == (10, 23)
    assert (short.passport.trial, long.passport.trial) == (1, 2)
    for trial in (short, long):
        assert {len(getattr(trial, name)) for name in ("phase", "object_pose", "gaps", "targets", "joint_angles")} == {
            len(trial.time)
        }
    np.testing.assert_array_equal(short.touching.all(axis=1), [True] * 5 + [False] * 5)
    assert short.manipulation == slice(3, 10)


# The same in the physics.


def grasped(count: int) -> tuple[MujocoSimulator, Task, Grasp, State]:
    """Return worlds with open fingers around the standard cube, and the grasp that was searched for it."""
    simulator = MujocoSimulator(HAND, [CUBE] * count)
    task = task_for(simulator)
    origin = np.tile(HAND.start_pose, (count, 1))
    grasp = planned_grasp(HAND, CUBE, origin[:, None] + task.path.poses)
    return simulator, task, grasp, simulator.reset(origin, grasp.opened)


@dataclass
class LetGo:
    """Hold the joints for a while, then swing the right finger of one world outwards."""

    world: int
    """Where."""
    decision: int
    """When."""
    acted: int = 0
    held: Array = field(default_factory=lambda: np.zeros(0))

    def begin(self, state: State) -> None:
        """Start from the servo targets that grip now."""
        self.held = state.targets

    def act(self, state: State) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        del state
        self.acted += 1
        targets = self.held.copy()
        if self.acted > self.decision:
            targets[self.world, 2] -= 0.5
        return targets

    def finished(self, state: State) -> NDArray[np.bool_]:
        """Return that all worlds have held long enough after 25 decisions."""
        return np.full(state.n_worlds, self.acted >= 25)


def test_a_finger_pulled_away_ends_only_its_own_world() -> None:
    simulator, task, grasp, start = grasped(2)
    phases = standard_phases(grasp, lambda _: LetGo(world=1, decision=4))
    recording = run_episodes(simulator, task, phases, start)
    held, dropped = cut_trials(Trial, recording, [passport(trial=1), passport(trial=2)], task.path.poses)
    assert (held.outcome, dropped.outcome) == (REACHED, LOST_CONTACT)
    touching = dropped.manipulated_path()[2]
    assert touching[:4].all()
    assert touching[:, 0].any()
    lost = np.asarray(~touching.all(axis=1))
    assert lost[-5:].all()
    assert not lost[-6]
    assert held.manipulated_path()[2].all()
    assert len(held.time) > len(dropped.time)


def test_open_fingers_grasp_nothing() -> None:
    simulator, task, grasp, start = grasped(1)
    recording = run_episodes(simulator, task, standard_phases(replace(grasp, closed=grasp.opened), IkController), start)
    assert recording.outcomes == (NO_GRASP,)
    assert recording.phase[-1] == 1


def test_one_control_step_simulates_measures_and_counts_lost_contact() -> None:
    simulator, task, grasp, start = grasped(1)
    controller = JointPid(task, grasp.closed)
    controller.begin(start)
    targets, lost = controller.act(start), np.array([7])
    assert not start.touching.all()
    state, counted = control_step(simulator, targets, lost, 5)
    assert state.time[0] == pytest.approx(0.02)
    assert start.time[0] == 0.0
    np.testing.assert_array_equal(state.targets, targets)
    np.testing.assert_array_equal(counted, [12])
    np.testing.assert_array_equal(lost, [7])


def test_an_object_is_dropped_after_twenty_steps_without_contact_or_when_its_world_diverged() -> None:
    state = state_with(np.ones((4, 2), dtype=bool), diverged=np.array([False, False, True, True]))
    lost = np.array([LOST_AFTER, LOST_AFTER + 1, 0, LOST_AFTER + 1])
    np.testing.assert_array_equal(dropped(state, lost), [False, True, True, True])


@dataclass
class Wait:
    """A user's own controller: keeps the servo targets of its start for a time."""

    task: Task
    """Gives the time between two decisions."""
    seconds: float
    """How long [s]."""
    waited: float = 0.0
    targets: Array = field(default_factory=lambda: np.zeros(0))

    def begin(self, state: State) -> None:
        """Keep what is commanded now."""
        self.targets = state.targets

    def act(self, state: State) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        del state
        self.waited += self.task.control_period
        return self.targets

    def finished(self, state: State) -> NDArray[np.bool_]:
        """Return all worlds once the time is over `(B,)`."""
        return np.full(state.n_worlds, self.waited > self.seconds - 1e-9)


def test_a_user_adds_a_phase_and_switches_a_controller() -> None:
    simulator, task, grasp, start = grasped(1)

    def closing_slowly(task: Task) -> Controller:
        return JointPid(task, grasp.closed, PidConfig(speed=0.4))

    place, close, carry = standard_phases(grasp, IkController)
    phases = (
        place,
        replace(close, controller=closing_slowly),
        Phase("wait", lambda task: Wait(task, seconds=0.1), longest=1.0, must_hold=True),
        carry,
    )
    usual = run_episodes(simulator, task, (place, close, carry), start)
    again = simulator.reset(HAND.start_pose[None], grasp.opened)
    changed = run_episodes(simulator, task, phases, again)
    assert changed.outcomes == usual.outcomes == (REACHED,)
    assert (changed.phase == 2).sum() == 5
    assert (changed.phase == 1).sum() > 1.5 * (usual.phase == 1).sum()
    trial: Trial = cut_trials(Trial, changed, [passport()], task.path.poses)[0]
    assert trial.phases == ("place", "grasp", "wait", MANIPULATE)
    assert trial.manipulated_path()[0][-1, 1] > 40


def test_the_proximal_joints_start_farther_outside() -> None:
    grasp = Grasp(np.array([[0.9, -0.4, -0.8, 0.3]]), np.zeros((1, 4)))
    np.testing.assert_allclose(placed_joints(HAND, grasp), [[0.9 + SPREAD, -0.4, -0.8 - SPREAD, 0.3]])
