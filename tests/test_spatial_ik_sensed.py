"""The expert in space on what a hand can know: its estimator against the truth, where it looks, its plan, a run."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.spatial.run import prepare_in_space, simulate_asterisk_in_space
from inhand.caches import PLACE
from inhand.control import loop, spatial_sensed_plan
from inhand.control.controller import SpatialTask
from inhand.control.grades import Grade, told_way
from inhand.control.looking import Looking
from inhand.control.loop import Recording
from inhand.control.phases import Grasp, graded_grasp
from inhand.control.seen import SENSED, Seen, exact
from inhand.control.spatial_catalogue import find_spatial_controller
from inhand.control.spatial_estimator import SpatialEstimator
from inhand.control.spatial_ik import SpatialIkController
from inhand.control.spatial_ik_sensed import SENSED_SPATIAL_IK, SOFT, SpatialIkSensedController
from inhand.control.spatial_rehearsal import closed_at
from inhand.control.spatial_sensed_plan import CARRIER, following, sensed_in_space
from inhand.control.trial import GRIP_END, LOST, REACHED
from inhand.geometry import TURN_ARM, Array
from inhand.hands.spatial.grasp_search import SpatialGrasp, search_grasps
from inhand.hands.spatial.gravity import gravity_of
from inhand.hands.spatial.names import STANDARD
from inhand.rotations import SpatialPath, pose_from, rotation_between
from inhand.sim.disturbance import BENCH, FIELD, HARD, Disturbance
from inhand.sim.drawn import Disturbed
from inhand.sim.engine import Simulator
from inhand.tasks.spatial.paths import spatial_path_of, stacked_paths, whole_spatial_path
from inhand.tasks.spatial.primitives import parse_spatial_directions
from test_disturbances import PERIOD
from test_spatial_asterisk import limited
from test_spatial_disturbances import QUICK
from test_spatial_engine import CUBE, HAND, fingers_at

BOTH = pose_from(np.tile(HAND.start_pose, (2, 1)), np.array([[0.001, 0.0, 0.0], [0.0, 0.002, 0.0]]), np.zeros((2, 3)))
DOWN = np.array([gravity_of("down")])
PATHS = [spatial_path_of(each) for each in parse_spatial_directions("Right,turn+z")]


@pytest.fixture(scope="module")
def grasps() -> list[SpatialGrasp]:
    """The grasps of a move and a turn, from a search that is quick."""
    whole = [whole_spatial_path(path) for path in PATHS]
    return [each[0] for each in search_grasps((HAND, CUBE), HAND.start_pose, whole, DOWN, config=QUICK)]


@pytest.fixture(scope="module")
def carried(grasps: list[SpatialGrasp]) -> tuple[Recording, int]:
    """Return how `ik` carried the object 30 mm and turned it 70 deg, and the row in which it began."""
    starts, path = np.tile(HAND.start_pose, (2, 1)), stacked_paths(PATHS)
    task = SpatialTask(HAND, (CUBE,) * 2, path, gravity=np.tile(DOWN, (2, 1)), distance=np.full(2, 0.03))
    _, found = loop.simulate(task, closed_at(HAND, grasps, starts), starts, SpatialIkController, loop.Bench("mujoco"))
    return found, int(np.flatnonzero(found.phase == found.phase.max())[0])


def estimates(found: Recording, first: int, frames: dict[int, tuple[int, Array]]) -> Array:
    """Return how far an estimator is off after each decision `(T, B, 6)`; frames come in as (row when taken, error)."""
    estimator, taken, error, off = SpatialEstimator(HAND, CUBE), first, np.zeros(6), []
    for row in range(first, len(found.states)):
        state = found.states[row]
        taken, error = frames.get(row, (taken, error))
        seen = exact(state)
        frame = pose_from(found.states[taken].object_pose, error[:3], error[3:])
        seen = replace(seen, frame_pose=frame, frame_time=found.states[taken].time)
        (estimator.begin if row == first else estimator.take)(seen)
        pose, believed = state.object_pose, estimator.state(seen)
        np.testing.assert_array_equal(believed.touching, np.ones((2, 3), dtype=bool))
        turned = rotation_between(pose[:, 3:], believed.object_pose[:, 3:])
        off.append(np.concatenate([believed.object_pose[:, :3] - pose[:, :3], turned], axis=-1))
    return np.array(off)


def test_encoders_alone_tell_where_the_object_has_gone_and_turned(carried: tuple[Recording, int]) -> None:
    found, first = carried
    begin, end = found.states[first].object_pose, found.states[-1].object_pose
    assert np.linalg.norm(end[0, :3] - begin[0, :3]) > 0.025
    assert np.linalg.norm(rotation_between(begin[1, 3:], end[1, 3:])) > 1.0
    off = estimates(found, first, {})
    assert np.linalg.norm(off[..., :3], axis=-1).max() < 1.5e-3
    assert np.linalg.norm(off[..., 3:], axis=-1).max() < np.deg2rad(5.0)


def test_late_frames_are_set_against_when_they_were_taken(carried: tuple[Recording, int]) -> None:
    found, first = carried
    rows = range(first + 4, len(found.states))
    off = estimates(found, first, {row: (row - 3, np.zeros(6)) for row in rows})
    assert np.linalg.norm(off[..., :3], axis=-1).max() < 8e-4  # 60 ms at 30 mm/s are 1.8 mm,
    assert np.linalg.norm(off[..., 3:], axis=-1).max() < np.deg2rad(2.0)  # and of the turn 4 deg


def test_a_wrong_first_look_is_mended_by_the_frames_after_it(carried: tuple[Recording, int]) -> None:
    found, first = carried
    wrong = np.array([0.0, 0.002, 0.0, 0.05, 0.0, 0.0])
    later = {row: (row, np.zeros(6)) for row in range(first + 1, len(found.states))}
    off = np.abs(estimates(found, first, {first: (first, wrong)} | later))
    assert off[0, :, 1].max() > 1e-3
    assert off[0, :, 3].max() > 0.02
    assert off[-1, :, :3].max() < 5e-4
    assert off[-1, :, 3:].max() < np.deg2rad(1.0)


def test_the_law_takes_over_what_was_believed() -> None:
    still = SpatialTask(HAND, (CUBE,), SpatialPath.still(1), gravity=DOWN, distance=np.zeros(1))
    joints, time = fingers_at(-0.001)[None], np.zeros(1)
    seen = Seen(time, joints, np.zeros_like(joints), joints, HAND.start_pose[None], time)
    first, second = (SpatialIkSensedController(still) for _ in range(2))
    moving = replace(still, path=stacked_paths(PATHS[:1]))
    assert (first.law.config, SpatialIkSensedController(moving).law.config) == (SOFT, SENSED_SPATIAL_IK)
    first.begin(seen)
    first.act(seen)
    second.take_over(first)
    away = pose_from(HAND.start_pose[None], np.array([0.01, 0.0, 0.0]), np.zeros(3))
    second.begin(replace(seen, time=time + PERIOD, frame_pose=away))  # an old frame changes nothing
    assert np.abs(second.estimator.pose[0, :3] - HAND.start_position).max() < 1e-3
    assert second.law.forces is first.law.forces
    assert find_spatial_controller("ik-sensed").reads == second.reads == SENSED


def test_fingers_follow_where_the_object_is_seen(grasps: list[SpatialGrasp]) -> None:
    grasp = following(HAND, grasps)
    assert grasp.planned is not None
    assert grasp.follows is not None
    task = SpatialTask(HAND, (CUBE,) * 2, SpatialPath.still(2), gravity=np.tile(DOWN, (2, 1)))
    looking, joints = Looking(task, grasp.opened, grasp.planned), grasp.opened
    off = np.array([[0.002, -0.001, 0.001, 0.0, 0.03, 0.0], [0.0, 0.001, 0.002, 0.03, 0.0, -0.02]])
    times = PERIOD * np.arange(6)[:, None] * np.ones(2)
    noise = np.random.default_rng(0).normal(0.0, 1e-4, (6, 2, 6))
    noise -= noise.mean(axis=0)
    for number, time in enumerate(times):
        frame = pose_from(grasp.planned, *np.split(off + noise[number], 2, axis=-1))
        seen = Seen(time, joints, np.zeros_like(joints), joints, frame, time)
        (looking.begin if number == 0 else looking.act)(seen)
        if number == 0:
            looking.act(seen)
        assert looking.finished(seen).tolist() == [number > 1] * 2  # until frames tell a scatter
    np.testing.assert_allclose(looking.off, off, atol=2e-6)
    variances = noise.var(axis=0, ddof=1) / np.repeat([0.001, np.deg2rad(1.0)], 3) ** 2
    np.testing.assert_allclose(looking.scatter, np.sqrt(variances.mean(axis=-1)), rtol=1e-3)
    moved = grasp.closed + (grasp.follows @ looking.off[..., None])[..., 0]
    there = closed_at(HAND, grasps, pose_from(grasp.planned, 0.7 * off[:, :3], 0.7 * off[:, 3:]), 0.006).closed
    np.testing.assert_allclose(moved, there, atol=4e-3)
    assert np.abs(moved - grasp.closed).max() > 0.02


def test_a_grasp_is_chosen_in_worlds_of_field_and_told_a_way_for_each_grade_of_a_camera(
    grasps: list[SpatialGrasp], monkeypatch: pytest.MonkeyPatch
) -> None:
    worse = replace(grasps[0], way=0.004)
    tried, found = list[tuple[int, int, Disturbance]](), list[Array]()

    def watched(*given: Any, disturbed: Sequence[Disturbed], **told: Any) -> tuple[Simulator, Recording]:
        (spec,) = {world.spec for world in disturbed}
        tried.append((len(disturbed), len({world.drawn.mass for world in disturbed}), spec))
        return loop.simulate(*given, disturbed=disturbed, **told)

    def told(ways: Array, grade: Grade) -> tuple[float, float]:
        found.append(ways)
        way, worth = told_way(ways, grade=grade)
        return way + (0.01 * (-1) ** len(found) if grade == CARRIER.grades[0] else 0.0), worth

    groups = {"Right": [worse, grasps[0]], "turn+z": [grasps[1]]}
    monkeypatch.setattr(spatial_sensed_plan, "searched", lambda *_: groups)
    monkeypatch.setattr(spatial_sensed_plan, "simulate", watched)
    monkeypatch.setattr(spatial_sensed_plan, "told_way", told)
    monkeypatch.setattr(spatial_sensed_plan, "ASIDE", 0.0)
    monkeypatch.setattr(spatial_sensed_plan, "SHORT", 0.0)
    monkeypatch.setenv(PLACE, "off")
    brief, where = replace(CARRIER, rounds=((2, 3), (1, 1))), (PATHS[:1] * 2 + PATHS[1:], np.tile(DOWN, (3, 1)), BOTH)
    plan = vars(sensed_in_space(HAND, CUBE, *where, bench=loop.Bench("mujoco"), carrier=brief))
    best, _, rough = (grade.worlds for grade in CARRIER.grades)
    assert tried == [(9, 3, FIELD), (2, 1, FIELD), (4, 2, best), (2, 1, rough)]
    assert (best.camera, best.differs.friction, best.pushes) == (BENCH.camera, FIELD.differs.friction, FIELD.pushes)
    assert rough.camera == HARD.camera
    assert 0.01 < plan["way"][0] < grasps[0].way
    ways = np.array([each.way for each in plan["graded"]])
    assert ways[0, 0] == ways[1, 0] == plan["way"][0] > ways[2, 0]  # the best is told as much as the usual at least
    assert ways[0, 2] > ways[1, 2]
    assert plan["way"][0] == plan["way"][1]  # trials of a direction have one plan, wherever objects start
    np.testing.assert_array_equal(plan["planned"], np.tile(HAND.start_pose, (3, 1)))
    turn, move = (ways.max(axis=0) for ways in found[-4:-2])  # of `field`: a turn alone may be aside by so much
    assert move[1] > 0.01 > turn[1]
    assert turn[0] > 0.01


@pytest.mark.parametrize("best_first", [True, False])
def test_where_the_best_comes_short_another_kind_is_tried_and_taken_if_it_is_worth_more(
    grasps: list[SpatialGrasp], monkeypatch: pytest.MonkeyPatch, *, best_first: bool
) -> None:
    both = [replace(grasps[0], way=0.03), replace(grasps[0], way=0.004)]
    first, other = both if best_first else both[::-1]
    monkeypatch.setattr(spatial_sensed_plan, "searched", lambda *_: {"Right": [first]})
    monkeypatch.setattr(spatial_sensed_plan, "search_grasps", lambda *_, **__: [[other]])
    monkeypatch.setattr(spatial_sensed_plan, "SHORT", 10.0)
    monkeypatch.setenv(PLACE, "off")
    brief, where = replace(CARRIER, rounds=((1, 3),)), (PATHS[:1], DOWN, BOTH[:1])
    plan = vars(sensed_in_space(HAND, CUBE, *where, bench=loop.Bench("mujoco"), carrier=brief))
    assert 0.02 < plan["way"][0] < 0.03


def test_a_run_at_field_keeps_its_objects(grasps: list[SpatialGrasp], monkeypatch: pytest.MonkeyPatch) -> None:
    plan = following(HAND, [each for each in grasps for _ in range(2)])
    plan = graded_grasp([replace(plan, way=share * np.repeat([0.03, 0.02], 2)) for share in (0.1, 1.0, 0.1)])

    def grasp(*_: object, **__: object) -> Grasp:
        return plan

    monkeypatch.setattr("inhand.asterisk_test.spatial.run.limits_in_space", limited)
    config = AsteriskConfig(
        hand=STANDARD, object="cube_50", controller="ik-sensed", directions="Right,turn+z", trials=2
    )
    config = replace(config, gravity="down", disturb="field")
    setup, planner = prepare_in_space(config), grasp
    assert setup.controller.grasp is sensed_in_space
    anything: Any = planner
    trials = simulate_asterisk_in_space(config, replace(setup, controller=replace(setup.controller, grasp=anything)))
    assert [trial.outcome in {REACHED, GRIP_END} for trial in trials] == [True] * 4
    assert [trial.manipulated()[0][-1, 0] > 20 for trial in trials] == [True, True, False, False]
    assert not {trial.outcome for trial in trials} & set(LOST)
    moved = [trial.manipulated() for trial in trials]
    for path, _, _ in moved[:2]:
        np.testing.assert_allclose(path[-1], [30.0, 0.0, 0.0], atol=3.0)
    for (_, turned, _), trial in zip(moved[2:], trials[2:], strict=True):
        angle = np.rad2deg(2 * np.arctan2(turned[-1, 3], turned[-1, 0]))
        assert angle == pytest.approx(np.rad2deg(0.02 / TURN_ARM), abs=5.0)
        assert trial.passport.reads == SENSED
