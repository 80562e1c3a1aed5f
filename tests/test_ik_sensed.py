"""The expert on what a hand can know: its estimator against the truth, its plan, and what it keeps where `ik` fails."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import inhand
from inhand import caches
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.run import prepare, simulate
from inhand.control import loop, sensed_plan
from inhand.control.catalogue import find_controller
from inhand.control.controller import Task
from inhand.control.estimator import Estimator
from inhand.control.grades import MARGIN, USUAL, told_way
from inhand.control.ik_sensed import IkSensedController
from inhand.control.looking import Looking
from inhand.control.loop import Recording
from inhand.control.phases import GradedGrasp, Grasp
from inhand.control.seen import Seen
from inhand.control.sensed_plan import Candidate, Carrier, sensed_grasp
from inhand.control.trial import Trial
from inhand.control.watched import ASTRAY, OFTEN, ways_along
from inhand.geometry import TURN_ARM, Array, Path, planar, wrap_angle
from inhand.hands.files import load_object
from inhand.hands.fit import Held
from inhand.hands.grasp_search import GraspPlan
from inhand.sim import memory
from inhand.sim.disturbance import FIELD, Disturbance
from inhand.sim.engine import Simulator
from inhand.sim.engines import make_simulator
from inhand.tasks.paths import stacked, straight_path
from inhand.tasks.primitives import primitive_at
from test_simulator import HAND

CUBE = load_object("cube_39")
PERIOD = 0.02


@pytest.fixture(scope="module")
def carried() -> tuple[Task, Trial, int]:
    """Return a trial of `ik` 100 mm to the right with its task, and the row in which it is begun."""
    config = AsteriskConfig(directions="Right", trials=1, noise_mm=0.0, noise_deg=0.0)
    (trial,) = simulate(config, prepare(config))
    path = Path(straight_path(primitive_at(0.0)).poses[None])
    return Task(HAND, (CUBE,), path), trial, int(np.flatnonzero(trial.phase == trial.phase.max())[0])


def estimates(task: Task, trial: Trial, first: int, frames: dict[int, tuple[int, Array]]) -> Array:
    """Return how far an estimator is off after each decision `(T, 3)`; frames come in as (row when taken, error)."""
    estimator, poses = Estimator(task.hand, CUBE), planar(trial.object_pose)
    taken, error = first, np.zeros(3)
    off = []
    for row in range(first, len(poses)):
        taken, error = frames.get(row, (taken, error))
        seen = Seen(
            trial.time[None, row],
            trial.joint_angles[None, row],
            np.zeros((1, HAND.n_joints)),
            trial.targets[None, row],
            (poses[taken] + error)[None],
            trial.time[None, taken],
        )
        (estimator.begin if row == first else estimator.take)(seen)
        away = estimator.state(seen).pose[0] - poses[row]
        off.append([*away[:2], wrap_angle(away[2])])
    return np.array(off)


def test_encoders_alone_tell_where_the_object_has_gone(carried: tuple[Task, Trial, int]) -> None:
    task, trial, first = carried
    off = estimates(task, trial, first, {})
    assert np.linalg.norm(planar(trial.object_pose)[-1] - planar(trial.object_pose)[first]) > 0.1
    assert np.abs(off[:, :2]).max() < 5e-4
    assert np.abs(off[:, 2]).max() < np.deg2rad(1.5)


def test_late_frames_are_set_against_when_they_were_taken(carried: tuple[Task, Trial, int]) -> None:
    task, trial, first = carried
    rows = range(first + 4, len(trial.time))
    off = estimates(task, trial, first, {row: (row - 3, np.zeros(3)) for row in rows})
    assert np.abs(off[:, :2]).max() < 5e-4  # 60 ms at 40 mm/s are 2.4 mm


def test_frames_of_now_are_set_against_now(carried: tuple[Task, Trial, int]) -> None:
    task, trial, first = carried
    rows = range(first + 1, len(trial.time))
    off = estimates(task, trial, first, {row: (row, np.zeros(3)) for row in rows})
    assert np.abs(off[20:, 0]).max() < 1.5e-4  # 0.3 mm where a frame is set against the decision before


def test_a_wrong_first_look_is_mended_by_the_frames_after_it(carried: tuple[Task, Trial, int]) -> None:
    task, trial, first = carried
    wrong = np.array([0.0, 0.002, 0.0])
    frames = {first: (first, wrong)} | {row: (row, np.zeros(3)) for row in range(first + 1, len(trial.time))}
    off = np.linalg.norm(estimates(task, trial, first, frames)[:, :2], axis=-1)
    assert off[0] > 1.5e-3
    assert off[-1] < 0.5e-3


def test_what_an_estimator_begins_with_is_taken_in_once(carried: tuple[Task, Trial, int]) -> None:
    task, trial, first = carried
    angles, pose = trial.joint_angles[None, first], planar(trial.object_pose)[None, first]
    time, still = np.zeros(1), np.zeros((1, HAND.n_joints))
    seen = Seen(time, angles, still, angles, pose, time)
    estimator, moved = Estimator(task.hand, CUBE), angles + 0.01
    estimator.begin(seen)
    believed = estimator.pose
    for known in (seen, replace(seen, joint_angles=moved, targets=moved)):
        estimator.take(known)
        np.testing.assert_array_equal(estimator.pose, believed)
    estimator.take(replace(seen, time=time + PERIOD, joint_angles=moved, targets=moved))
    assert np.abs(estimator.pose - believed).max() > 1e-4


def test_a_frame_counts_once_and_what_came_before_it_is_mended_with_it(carried: tuple[Task, Trial, int]) -> None:
    task, trial, first = carried
    aside, begin = np.array([0.0, 0.002, 0.0]), first + 10
    once = estimates(task, trial, first, {begin: (begin - 3, aside)})[10:, 1]
    assert once[0] > 2e-4
    assert np.abs(once[1:10] - once[0]).max() < 0.2 * once[0]
    frames = {row: (row - 3, aside) for row in range(begin, len(trial.time))}
    always = estimates(task, trial, first, frames)[10:, 1]
    assert always[12:].min() > 0.8 * aside[1]
    assert always.max() < 1.15 * aside[1]  # what a frame has mended the next, of before it came in, mends no more


def test_how_fast_an_object_is_believed_to_move_is_told_of_four_decisions(carried: tuple[Task, Trial, int]) -> None:
    task, trial, first = carried
    estimator, believed = Estimator(task.hand, CUBE), []
    for row in range(first, first + 40):
        angles, time = trial.joint_angles[None, row], trial.time[None, row]
        pose = planar(trial.object_pose)[None, first]
        seen = Seen(time, angles, np.zeros_like(angles), trial.targets[None, row], pose, trial.time[None, first])
        (estimator.begin if row == first else estimator.take)(seen)
        believed.append(estimator.pose)
    moved = (believed[-1] - believed[-5]) / (4 * PERIOD)
    np.testing.assert_allclose(estimator.velocity, moved, rtol=1e-9)
    assert moved[0, 0] > 0.02


def straight(*ways: float) -> Array:
    """Return ways that were gone straight until they ended."""
    return np.repeat(np.array(ways)[:, None], 2, axis=1)


def test_how_far_is_told_weighs_way_against_losses() -> None:
    even = [0.1] * 20
    assert told_way(straight(*even)) == pytest.approx((0.1 - MARGIN, 0.1 * (1 - USUAL.price * 0.5 / 21)))
    # One of twenty is lost early: to stop there would cost more than the object.
    assert told_way(straight(0.01, *even))[0] == pytest.approx(0.1 - MARGIN)
    # Five are lost a little before the others: not worth it.
    assert told_way(straight(*[0.09] * 5, *[0.1] * 15))[0] == pytest.approx(0.09 - MARGIN)
    assert told_way(straight(*[-1.0] * 10))[0] == 0.0


def test_what_goes_crooked_costs_less_than_what_is_lost() -> None:
    ways = straight(*[0.1] * 20)
    ways[:5, 1] = 0.09
    assert told_way(ways)[0] == pytest.approx(0.09 - MARGIN)
    ways[:5, 1] = 0.06
    assert told_way(ways) == pytest.approx((0.1 - MARGIN, 0.1 * (1 - (USUAL.price * 0.5 + USUAL.crooked * 5) / 21)))


@pytest.mark.usefixtures("quick")
def test_how_far_an_object_goes_straight_is_told_beside_how_far_it_goes() -> None:
    held = Held(HAND, CUBE)
    poses = HAND.start_pose + straight_path(primitive_at(90.0), 0.03).poses[None]
    first, reach = sensed_plan.candidates(held, poses)
    found = []
    for most in (ASTRAY, 1e-6):
        by = Carrier(grades=(replace(USUAL, straight=most),))
        (tried,) = vars(sensed_plan)["_tried"](held, (poses, reach), first[:1], by, range(2))
        found.append(np.array(tried.ways[0]))
    assert found[0].shape == (2, 2)
    assert found[0].min() > 0.025
    np.testing.assert_array_equal(found[0][:, 0], found[0][:, 1])
    np.testing.assert_array_equal(found[1][:, 0], found[0][:, 0])
    assert found[1][:, 1].max() < 0.01


def test_what_was_astray_is_not_caught_again_and_nothing_counts_in_the_air() -> None:
    ways, path = np.arange(60) * 1e-3, Path(np.arange(101)[:, None] * np.array([1e-3, 0.0, 0.0]) + np.zeros((3, 1, 1)))
    poses = np.zeros((60, 3, 3))
    poses[:, :, 0], poses[20:32, 1, 1] = ways[:, None], 0.02
    touching = np.ones((60, 3, 2), dtype=bool)
    touching[40:, 2, 0] = False
    states = [SimpleNamespace(pose=pose, touching=both) for pose, both in zip(poses, touching, strict=True)]
    found: Any = SimpleNamespace(phase=np.ones(60, dtype=int), last=np.full(3, 59), states=states)
    told = ways_along(found, path, [np.full(3, way) for way in ways], ASTRAY)
    judged = OFTEN * 1e-3
    assert (np.abs(told[:, 0] - (0.059, 0.02, 0.04)) <= judged).all()


def test_a_path_is_gone_whole_where_most_worlds_come_to_its_end() -> None:
    even = [0.1] * 18
    assert told_way(straight(*[0.09] * 2, *even), 0.1)[0] == 0.1
    assert told_way(straight(*[0.09] * 2, *even))[0] == pytest.approx(0.09 - MARGIN)
    assert told_way(straight(*[0.09] * 6, *even), 0.1)[0] == pytest.approx(0.09 - MARGIN)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plan in few worlds."""
    monkeypatch.setattr(sensed_plan, "ROUNDS", ((2, 2),))
    monkeypatch.setattr(sensed_plan, "CANDIDATES", 1)
    monkeypatch.setattr(sensed_plan, "STAYS", 2)


def test_a_plan_tries_the_best_again_in_further_worlds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sensed_plan, "ROUNDS", ((3, 2), (1, 4)))
    poses, rounds = HAND.start_pose + straight_path(primitive_at(90.0), 0.05).poses[None], []

    def tried(*given: Any) -> list[Candidate]:
        rounds.append((given[2], given[4]))
        far = {each.plan.contacts.tobytes(): 0.01 * (k + 1) for k, each in enumerate(rounds[0][0])}
        return [replace(each, ways=(((far[each.plan.contacts.tobytes()],) * 2,) * 4,) * 2) for each in given[2]]

    monkeypatch.setattr(sensed_plan, "_tried", tried)
    monkeypatch.setenv(caches.PLACE, "off")
    found = sensed_grasp(HAND, CUBE, poses)
    (first, few), (second, more) = rounds
    assert len({each.plan.contacts.tobytes() for each in first}) == 3
    assert (few, more) == (range(2), range(2, 6))
    assert [each.plan for each in second] == [first[2].plan]
    assert found.way == pytest.approx([0.03 - MARGIN])


def test_grasps_that_end_alike_are_told_apart_in_rougher_worlds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sensed_plan, "ROUNDS", ((3, 4),))
    poses, seen = HAND.start_pose + straight_path(primitive_at(90.0), 0.05).poses[None], list[GraspPlan]()

    def tried(*given: Any) -> list[Candidate]:
        seen.extend(each.plan for each in given[2])
        usual = ((0.04, 0.04),) * 4
        return [
            replace(each, ways=(((rough, rough),) * 4, usual))
            for each, rough in zip(given[2], (0.01, 0.03, 0.02), strict=True)
        ]

    monkeypatch.setattr(sensed_plan, "_tried", tried)
    monkeypatch.setenv(caches.PLACE, "off")
    found = sensed_grasp(HAND, CUBE, poses)
    best = vars(sensed_plan)["_closing"](Held(HAND, CUBE), [Candidate(0, seen[1], 0.0)], poses)
    np.testing.assert_array_equal(found.closed, best["closed"])
    assert found.way == pytest.approx([0.04 - MARGIN])  # of the usual worlds,
    assert not isinstance(found, GradedGrasp)  # whatever a camera sees


@pytest.mark.usefixtures("quick")
def test_a_plan_looks_at_no_start_and_is_kept_whatever_is_planned_beside_it(monkeypatch: pytest.MonkeyPatch) -> None:
    poses = HAND.start_pose + straight_path(primitive_at(90.0), 0.05).poses[None]
    beside = HAND.start_pose + straight_path(primitive_at(0.0), 0.02).poses[None]
    away = poses[:, 0] + [0.002, -0.001, 0.03]
    both = stacked([poses[0], poses[0], beside[0]])
    first = sensed_grasp(HAND, CUBE, both, np.concatenate([poses[:, 0], away, poses[:, 0]]))
    np.testing.assert_array_equal(first.closed[0], first.closed[1])
    assert first.way is not None
    assert first.way.tolist() == [0.05, 0.05, 0.02]  # a path that can be gone to its end is
    monkeypatch.setattr(sensed_plan, "_planned", lambda *_: pytest.fail("computed once more"))
    for path, row in ((poses, 0), (beside, 2)):
        np.testing.assert_array_equal(sensed_grasp(HAND, CUBE, path).opened[0], first.opened[row])


@pytest.mark.usefixtures("quick")
def test_a_plan_that_is_tried_in_parts_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    poses, plans = HAND.start_pose + straight_path(primitive_at(90.0), 0.02).poses[None], []
    monkeypatch.setenv(caches.PLACE, "off")
    for most in (memory.REHEARSALS, 1.0):
        monkeypatch.setattr(memory, "REHEARSALS", most)
        plans.append(sensed_grasp(HAND, CUBE, poses))
    np.testing.assert_array_equal(plans[0].closed, plans[1].closed)
    np.testing.assert_array_equal(plans[0].way, plans[1].way)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("controller", ["ik", "ik-cautious", "ik-sensed", "rl-privileged"])
def test_grasps_are_rehearsed_in_the_engine_that_runs(controller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    used = set[str]()

    def noted(engine: str, *rest: Any) -> Simulator:
        used.add(engine)
        return make_simulator(engine, *rest)

    monkeypatch.setattr(loop, "make_simulator", noted)
    poses = HAND.start_pose + straight_path(primitive_at(90.0), 0.02).poses[None]
    find_controller(controller).grasp(HAND, CUBE, poses, engine="mujoco")
    assert used == {"mujoco"}


@pytest.mark.usefixtures("quick")
def test_a_world_that_was_not_gripped_holds_up_no_other() -> None:
    poses = np.repeat(HAND.start_pose + straight_path(primitive_at(90.0), 0.05).poses[None], 2, axis=0)
    starts = poses[:, 0] + [[0.0, 0.0, 0.0], [0.0, 0.06, 0.0]]
    task = Task(HAND, (CUBE, CUBE), Path(poses - poses[:, :1]), distance=np.full(2, 0.03))
    _, found = loop.simulate(task, sensed_grasp(HAND, CUBE, poses), starts, IkSensedController, loop.Bench())
    assert found.outcomes == ("reached", "no grasp")
    assert found.states[-1].pose[0, 1] - starts[0, 1] > 0.028


@pytest.mark.usefixtures("quick")
def test_fingers_close_where_the_object_is_seen() -> None:
    poses = HAND.start_pose + straight_path(primitive_at(90.0), 0.05).poses[None]
    grasp = sensed_grasp(HAND, CUBE, poses)
    starts = poses[:, 0] + [0.004, 0.0, 0.0]
    task = Task(HAND, (CUBE,), Path(poses - poses[:, :1]))
    moved = []
    for each in (grasp, replace(grasp, follows=None)):
        _, found = loop.simulate(task, each, starts, None, loop.Bench())
        moved.append(float(starts[0, 0] - found.states[-1].pose[0, 0]))
    # What is pressed on off the plan is drawn towards it.
    assert moved[1] > 0.003
    assert abs(moved[0]) < 0.5 * moved[1]


def test_a_mean_of_frames_counts_each_once() -> None:
    task = Task(HAND, (CUBE,), Path(np.zeros((1, 2, 3))))
    planned, joints = HAND.start_pose[None], np.zeros((1, HAND.n_joints))
    looking = Looking(task, joints, planned)
    for row, (off, taken) in enumerate([(0.003, 0.0), (0.001, 0.04), (0.001, 0.04), (0.001, 0.04)]):
        frame = np.add(planned, (off, 0.0, 2 * np.pi))
        seen = Seen(np.full(1, PERIOD * row), joints, joints, joints, frame, np.full(1, taken))
        if row == 0:
            looking.begin(seen)
        looking.act(seen)
    np.testing.assert_allclose(looking.off, [[0.002, 0.0, 0.0]], atol=1e-12)


def test_commands_stay_as_they_are_at_the_end_of_the_way() -> None:
    run = inhand.asterisk(controller="ik-sensed", directions="Left", trials=1, disturb="field")
    targets = run.trials[0].targets
    assert np.abs(np.diff(targets[-30:-16], axis=0)).min() > 0.0
    # Commands are on their way for at most a decision.
    assert np.ptp(targets[-13:], axis=0).max() == 0.0


@pytest.mark.usefixtures("quick")
def test_a_path_that_comes_back_is_planned_to_its_end() -> None:
    out = straight_path(primitive_at(90.0), 0.02).poses
    poses = HAND.start_pose + np.concatenate([out, out[::-1]])[None]
    way = sensed_grasp(HAND, CUBE, poses).way
    assert way is not None
    assert way[0] == pytest.approx(0.04)


@pytest.mark.usefixtures("quick")
def test_a_policys_way_is_one_at_whose_end_the_object_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    poses, by = HAND.start_pose + straight_path(primitive_at(90.0), 0.02).poses[None], Carrier(shares=(1.0, 0.75))
    carried, shares, stays = vars(sensed_plan)["_carried"], list[float](), None

    def lost(*given: Any) -> tuple[Recording, list[Array]]:
        found, aimed = carried(*given)
        shares.extend([float(given[1][1][0])] * (len(given[4][1]) == 5))
        far = stays is not None and given[1][1][0] > 0.8 * stays[0]
        return (replace(found, outcomes=("lost contact",) * 5) if len(given[4][1]) == 5 and far else found), aimed

    monkeypatch.setattr(sensed_plan, "_carried", lost)
    stays = sensed_grasp(HAND, CUBE, poses, carrier=replace(by, digest="stays", stays=5)).way
    assert stays is not None
    assert shares == [stays[0]] * len(by.grades)  # no part of a way on which nothing was lost is looked at
    shares.clear()
    slips = sensed_grasp(HAND, CUBE, poses, carrier=replace(by, digest="slips", stays=5)).way
    assert slips is not None
    np.testing.assert_allclose(slips, 0.75 * stays)
    np.testing.assert_allclose(shares, [stays[0], 0.75 * stays[0]] * len(by.grades))


def test_where_objects_stay_counts_with_the_weight_of_its_grade() -> None:
    held, poses = Held(HAND, CUBE), HAND.start_pose + straight_path(primitive_at(90.0), 0.03).poses[None]
    first, by = sensed_plan.candidates(held, poses)[0][:1], Carrier(shares=(1.0,))
    light, heavy = (
        vars(sensed_plan)["_stayed"](
            held, (poses, np.full(1, 0.01)), first, by, (replace(USUAL, weight=weight), range(2))
        )
        for weight in (1.0, 3.0)
    )
    np.testing.assert_array_equal(light[0], heavy[0])
    np.testing.assert_allclose(3.0 * light[1], heavy[1])
    assert light[1] > 0.0


@pytest.mark.usefixtures("quick")
def test_of_the_last_candidates_the_one_is_taken_that_is_worth_most_where_it_stays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sensed_plan, "ROUNDS", ((3, 1),))
    poses, last = HAND.start_pose + straight_path(primitive_at(90.0), 0.05).poses[None], list[Candidate]()

    def stayed(_held: object, paths: tuple[Array, Array], candidates: list[Candidate], *_rest: object) -> object:
        last[:] = candidates
        return paths[1], np.arange(len(candidates))

    monkeypatch.setattr(sensed_plan, "_stayed", stayed)
    grasp = sensed_grasp(HAND, CUBE, poses, carrier=Carrier(digest="last", shares=(1.0,), last=3))
    closed = [vars(sensed_plan)["_closing"](Held(HAND, CUBE), [each], poses)["closed"][0] for each in last]
    assert not np.array_equal(closed[0], closed[-1])
    np.testing.assert_array_equal(grasp.closed[0], closed[-1])


def test_it_goes_its_way_with_a_cameras_noise_and_delay_where_the_expert_does_not() -> None:
    seen = Disturbance("seen", encoders=FIELD.encoders, camera=FIELD.camera, commands=FIELD.commands)
    ways = {}
    for name in ("ik", "ik-sensed"):
        for disturb in ("none", seen):
            run = inhand.asterisk(controller=name, directions="Left", trials=3, disturb=disturb)
            table = run.table()
            ways[name, disturb == "none"] = np.where(table.outcome == "lost contact", 0.0, table.distance_mm)
            assert set(table.reads) == {"sensed" if name == "ik-sensed" else "privileged"}
    assert ways["ik", False].mean() < 0.5 * ways["ik", True].mean()
    # It is told a shorter way where frames scatter.
    assert (ways["ik-sensed", False] > 0.85 * ways["ik-sensed", True]).all()
    assert ways["ik-sensed", True].mean() > 0.7 * ways["ik", True].mean()


def test_a_twist_before_the_path_has_its_part_of_the_way_that_was_planned() -> None:
    config = AsteriskConfig(controller="ik-sensed", directions="Out", twist=10.0, trials=1)
    setup, distances = prepare(config), list[Array | None]()
    poses = HAND.start_pose + np.stack([straight_path(primitive_at(90.0)).poses] * len(setup.assignments))
    line = setup.controller.grasp(HAND, CUBE, poses)  # whose plan ships
    grip = Grasp(line.opened, line.closed, line.way)

    def manipulate(task: Task) -> IkSensedController:
        distances.append(task.distance)
        return IkSensedController(task)

    entry = replace(setup.controller, grasp=lambda *_, **__: grip, manipulate=manipulate)
    trials = simulate(config, replace(setup, controller=entry))
    assert {trial.outcome for trial in trials} <= {"end of grip", "reached"}
    distance = distances[-1]
    assert distance is not None
    assert grip.way is not None
    np.testing.assert_allclose(distance, grip.way - np.deg2rad(10.0) * TURN_ARM)
