"""The expert in space: from one plain grip it carries the cube along every direction, whichever way the palm looks."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from inhand.control import spatial_rehearsal
from inhand.control.controller import SpatialTask
from inhand.control.episode import MANIPULATE, TWIST
from inhand.control.loop import Bench, Recording, simulate
from inhand.control.phases import LIFT, PRESS, Grasp, standard_phases
from inhand.control.spatial_catalogue import find_spatial_controller
from inhand.control.spatial_ik import EXPERT, SpatialIkConfig, SpatialIkController, beside, grip_for
from inhand.control.spatial_rehearsal import (
    CLOSE,
    GAP,
    LOST,
    PLAIN,
    TO_THE_END,
    WIDE,
    Tried,
    Worlds,
    planned_in_space,
    rehearsed,
    tried_out,
    tried_together,
)
from inhand.control.trial import NO_GRASP, REACHED
from inhand.geometry import Array, turn
from inhand.hands.spatial.grasp_search import SpatialGrasp, SpatialSearchConfig
from inhand.hands.spatial.gravity import gravity_of
from inhand.hands.spatial.kinematics import inverse
from inhand.rotations import SpatialPath, carried, placed, pose_from, quaternion_of, rotation_between
from inhand.sim.state import State, select
from inhand.tasks.spatial.paths import spatial_path_of, stacked_paths
from inhand.tasks.spatial.primitives import parse_spatial_directions
from test_spatial_engine import CONTACTS, CUBE, HAND, NORMALS, PALMS, fingers_at, gripped, worlds

WAY = 0.012
"""Way that is asked for [m]."""
ASKED = parse_spatial_directions("Out,Right,Up,Down,In-Left,Out-Right-Up,turn+x,turn-z")


def plain_grasp(starts: Array) -> Grasp:
    """Close on three side faces of cubes at poses `(B, 7)`."""
    opened, closed = (
        np.concatenate(
            [
                inverse(
                    finger,
                    placed(starts, np.tile(contact + (finger.tip_radius + off) * normal, (len(starts), 1))),
                    fingers_at(0.0)[own][None],
                )[0][:, 0]
                for finger, own, contact, normal in zip(HAND.fingers, HAND.slices, CONTACTS, NORMALS, strict=True)
            ],
            axis=-1,
        )
        for off in (0.008, -0.002)
    )
    return Grasp(opened, closed)


def task_of(palm: str, count: int = len(ASKED)) -> SpatialTask:
    paths = stacked_paths([spatial_path_of(each) for each in ASKED[:count]])
    gravity = np.tile(gravity_of(palm), (count, 1))
    return SpatialTask(HAND, (CUBE,) * count, paths, gravity=gravity, distance=np.full(count, WAY))


@pytest.fixture(scope="module", params=PALMS)
def moved(request: pytest.FixtureRequest) -> tuple[SpatialTask, Recording]:
    """Every primitive asked for, from starts with noise."""
    task, rng = task_of(request.param), np.random.default_rng(3)
    noise = 1e-3 * rng.standard_normal((len(ASKED), 3)), np.deg2rad(rng.standard_normal((len(ASKED), 3)))
    starts = pose_from(HAND.start_pose, *noise)
    return task, simulate(task, plain_grasp(starts), starts, SpatialIkController, Bench("mujoco", threads=1))[1]


def first_and_last(recording: Recording) -> tuple[State, State, Array]:
    """Return the state in which manipulation begins, and each world's last pose `(B, 7)`."""
    begin = recording.states[int(np.argmax(recording.phase == recording.phases.index(MANIPULATE))) - 1]
    worlds = np.arange(begin.n_worlds)
    last = np.stack([recording.states[recording.last[k]].object_pose[k] for k in worlds])
    return begin, recording.states[-1], last


def test_every_primitive_is_followed_as_far_as_asked(moved: tuple[SpatialTask, Recording]) -> None:
    _, recording = moved
    begin, _, last = first_and_last(recording)
    assert set(recording.outcomes) == {REACHED}
    gone = last[:, :3] - begin.object_pose[:, :3]
    turned = rotation_between(begin.object_pose[:, 3:], last[:, 3:])
    for k, primitive in enumerate(ASKED):
        ahead = np.zeros(3) if primitive.direction is None else np.array(primitive.direction)
        axis = np.zeros(3) if primitive.direction is not None else primitive.axis
        np.testing.assert_allclose(gone[k], WAY * ahead, atol=3e-4)
        np.testing.assert_allclose(turned[k], WAY / 0.025 * axis, atol=0.02)


def test_no_contact_is_lost_on_the_way(moved: tuple[SpatialTask, Recording]) -> None:
    _, recording = moved
    begin = int(np.argmax(recording.phase == recording.phases.index(LIFT)))
    assert all(state.touching.all() for state in recording.states[begin:])


def test_taking_the_weight_and_setting_off_do_not_jerk_the_object(moved: tuple[SpatialTask, Recording]) -> None:
    """The forces are there before the world lets go, and the controller that carries goes on where the other was."""
    _, recording = moved
    poses = np.stack([state.object_pose for state in recording.states])
    at = [int(np.argmax(recording.phase == recording.phases.index(name))) for name in (LIFT, MANIPULATE)]
    for row in at:
        steps = np.linalg.norm(np.diff(poses[row - 1 : row + 2, :, :3], axis=0), axis=-1)
        assert 1e3 * steps.max() < 0.12


def test_the_set_point_speeds_up_and_brakes_and_waits_for_an_object_that_stays() -> None:
    state = gripped(worlds(("up",)), settle=2)
    task, config = replace(task_of("up", 1), distance=np.array([0.03])), SpatialIkConfig()
    expert, ways = SpatialIkController(task, config), [0.0]
    expert.begin(state)
    for _ in range(80):
        moves, turns = task.path.at(expert.progress)
        expert.act(replace(state, object_pose=pose_from(state.object_pose, moves, turns)))
        ways.append(float(expert.progress[0]))
    speed = np.diff(ways) / task.control_period
    assert speed.max() <= config.speed + 1e-9
    assert np.diff(speed).max() <= config.acceleration * task.control_period + 1e-9
    assert ways[-1] == pytest.approx(0.03, abs=3e-4)
    assert expert.finished(state).all()
    for off in [0.0] * 20 + [0.003]:  # the set point stands when the object leaves its line
        moves, turns = task.path.at(expert.progress)
        expert.act(replace(state, object_pose=pose_from(state.object_pose, moves + np.array([off, 0, 0]), turns)))
    assert expert.strayed[0] < 1e-3
    assert expert.aside[0] == pytest.approx(0.003, abs=2e-4)
    expert.begin(state)
    for _ in range(80):
        expert.act(state)  # the object never moves
    assert expert.progress[0] < 2 * config.lag
    assert not expert.finished(state).any()


def test_the_grip_grows_with_the_weight_from_fifty_grams_on() -> None:
    grip = grip_for(np.array([0.1, 0.5, 1.5]), SpatialIkConfig())
    np.testing.assert_allclose(grip, [2.5, 2.5, 3.5])


def test_what_is_beside_the_way_is_told_apart_from_what_is_behind() -> None:
    error = np.array([[3.0, 4.0, 0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0, 0.0, 2.0], [3.0, 4.0, 0.0, 0.0, 0.0, 0.0]])
    velocity = np.array([[1.0, 0, 0, 0, 0, 0], [0.0, 0, 0, 0, 0, 0.1], [0.0, 0, 0, 0, 0, 0]])
    np.testing.assert_allclose(beside(error, velocity), [4.0, 1.0, 0.0])


def test_the_servos_hold_what_carries_the_weight() -> None:
    """At rest on the set point the targets lie off the joints by J' f / stiffness alone, and these forces balance."""
    state = gripped(worlds(), settle=2)
    count = state.n_worlds
    task = SpatialTask(
        HAND, (CUBE,) * count, SpatialPath.still(count), gravity=worlds().gravity, distance=np.zeros(count)
    )
    expert = SpatialIkController(task)
    expert.begin(state)
    closed = replace(state, gaps=np.zeros_like(state.gaps))
    for _ in range(5):
        targets = expert.act(closed)
    assert expert.forces is not None
    forces = expert.forces.forces
    np.testing.assert_allclose(forces.sum(axis=1), -CUBE.mass * task.gravity, atol=5e-3)
    work = (HAND.stiffness * (targets - state.joint_angles))[:, None] @ np.eye(HAND.n_joints)
    assert np.abs(work).max() < HAND.torque


def test_a_point_is_carried_as_the_object_moves_and_turns() -> None:
    rng = np.random.default_rng(0)
    motion, arm = 1e-6 * rng.standard_normal((5, 6)), rng.standard_normal((5, 3))
    moved = motion[:, :3] + turn(quaternion_of(motion[:, 3:]), arm) - arm
    np.testing.assert_allclose(carried(motion, arm), moved, atol=1e-11)


def test_fingers_that_close_on_nothing_have_no_grasp() -> None:
    starts = pose_from(HAND.start_pose, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.3]]), np.zeros((2, 3)))
    grasp = plain_grasp(np.tile(HAND.start_pose, (2, 1)))
    _, recording = simulate(task_of("up", 2), grasp, starts, None, Bench("mujoco", threads=1))
    assert recording.outcomes == (REACHED, NO_GRASP)


def test_where_every_grasp_loses_the_object_those_are_tried_that_stop_farther_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[tuple[int, tuple[float, float]]] = []

    def rehearsed(_: object, groups: list[list[Any]], *rest: Any, **__: Any) -> list[list[Tried]]:
        margin = rest[-1][1].margin
        asked.append((len(groups), margin))
        kept = {True: SpatialIkConfig().margin, False: WIDE[1]}  # how far before its end each grasp has to stop
        return [[Tried(grasp, 0.05, 0.04 if margin >= kept[grasp.way > 0.05] else -0.95)] for (grasp,) in groups]

    monkeypatch.setattr(spatial_rehearsal, "rehearsed", rehearsed)
    worlds_of, paths = Worlds(np.zeros((3, 3)), np.zeros((3, 7))), [spatial_path_of(ASKED[0])] * 3
    groups = [[planned_for(way)] for way in (0.06, 0.05, 0.06)]
    found = tried_out((HAND, CUBE), groups, paths, worlds_of, (Bench("mujoco"), PLAIN))
    assert asked == [(3, SpatialIkConfig().margin), (1, WIDE[0]), (1, WIDE[1])]
    assert all(each.worth > 0 for each in found)


def test_where_every_grasp_loses_the_object_wherever_it_stops_others_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    searched: list[tuple[int, int]] = []

    def rehearsed(_: object, groups: list[list[Any]], *__: Any, **___: Any) -> list[list[Tried]]:
        return [[Tried(grasp, 0.05, grasp.way - 0.04) for grasp in group] for group in groups]

    def search(*asked: Any, config: SpatialSearchConfig) -> list[list[SpatialGrasp]]:
        searched.append((len(asked[2]), config.keep))
        return [[planned_for(0.01), planned_for(0.07)] for _ in asked[2]]

    monkeypatch.setattr(spatial_rehearsal, "rehearsed", rehearsed)
    monkeypatch.setattr(spatial_rehearsal, "search_grasps", search)
    monkeypatch.setattr(spatial_rehearsal, "LOST", 0.0)
    worlds_of, paths = Worlds(np.zeros((3, 3)), np.zeros((3, 7))), [spatial_path_of(ASKED[0])] * 3
    groups = [[planned_for(way)] for way in (0.05, 0.03, 0.06)]
    found = tried_out((HAND, CUBE), groups, paths, worlds_of, (Bench("mujoco"), PLAIN))
    assert searched == [(1, spatial_rehearsal.OTHERS)]
    assert [each.grasp.way for each in found] == [0.05, 0.07, 0.06]


def test_where_the_prediction_falls_far_short_of_the_plan_the_plan_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[int, bool]] = []

    def rehearsed(_: object, groups: list[list[Any]], *__: Any, planned: bool = False, **___: Any) -> list[list[Tried]]:
        asked.append((len(groups), planned))
        short = [0.05 if planned or k else 0.02 for k in range(len(groups))]
        return [[Tried(group[0], way, way)] for group, way in zip(groups, short, strict=True)]

    monkeypatch.setattr(spatial_rehearsal, "rehearsed", rehearsed)
    worlds_of, paths = Worlds(np.zeros((2, 3)), np.zeros((2, 7))), [spatial_path_of(ASKED[0])] * 2
    found = tried_out((HAND, CUBE), [[planned_for(0.06)]] * 2, paths, worlds_of, (Bench("mujoco"), PLAIN))
    assert asked == [(2, False), (1, True)]
    assert [each.way for each in found] == [0.05, 0.05]


def test_a_grasp_goes_as_far_as_it_was_planned_to_where_that_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    starts = np.tile(HAND.start_pose, (1, 1))
    grasp = replace(planned_for(0.008), joints=plain_grasp(starts).closed[0])
    world, how = Worlds(np.array([gravity_of("up")]), starts), (Bench("mujoco", threads=1), SpatialIkConfig())
    asked = (HAND, CUBE), [[grasp]], [spatial_path_of(ASKED[0])], world, how
    ((tried,),) = spatial_rehearsal.rehearsed(*asked, planned=True)
    assert tried.way == pytest.approx(0.006)
    assert 0.004 < tried.worth < 0.006
    ((firm,),) = spatial_rehearsal.rehearsed(*asked, planned=True, strict=True)
    assert firm.worth == pytest.approx(tried.worth, abs=2e-3)  # what is beside the path costs otherwise
    monkeypatch.setattr(spatial_rehearsal, "always_held", lambda _: np.zeros(1, dtype=bool))
    ((loose,),) = spatial_rehearsal.rehearsed(*asked, planned=True, strict=True)
    assert loose.worth == pytest.approx(firm.worth - GAP)
    assert loose.worth < LOST


def test_a_finger_that_is_off_for_a_while_is_seen(moved: tuple[SpatialTask, Recording]) -> None:
    _, recording = moved
    assert spatial_rehearsal.always_held(recording).all()
    states, row = list(recording.states), int(recording.last.min()) - 2
    gaps = states[row].gaps.copy()
    gaps[1, 2] = 0.01
    states[row] = replace(states[row], gaps=gaps)
    assert np.flatnonzero(~spatial_rehearsal.always_held(replace(recording, states=tuple(states)))).tolist() == [1]


def planned_for(way: float) -> SpatialGrasp:
    """Return the plain grasp, as if it had been planned to go some way [m]."""
    return SpatialGrasp(CONTACTS, NORMALS, fingers_at(0.0), way, way)


def test_the_one_grasp_for_all_worlds_loses_the_object_in_fewest(monkeypatch: pytest.MonkeyPatch) -> None:
    far, safe, short = map(planned_for, (0.09, 0.06, 0.03))
    worth = {far.way: (0.08, -0.9), safe.way: (0.06, 0.05), short.way: (0.03, 0.03)}
    farther = {SpatialIkConfig().margin: 0.0, TO_THE_END[-1]: -0.8}
    farther |= dict.fromkeys(TO_THE_END[:-2], -0.01) | {TO_THE_END[-2]: 0.002}

    def rehearsed(_: object, groups: list[list[SpatialGrasp]], *rest: Any, **__: Any) -> list[list[Tried]]:
        more = farther[rest[-1][1].margin]
        return [
            [Tried(grasp, grasp.way, worth[grasp.way][k % 2] + more) for grasp in group]
            for k, group in enumerate(groups)
        ]

    monkeypatch.setattr(spatial_rehearsal, "rehearsed", rehearsed)
    worlds_of, paths = Worlds(np.zeros((4, 3)), np.zeros((4, 7))), [spatial_path_of(ASKED[0])] * 4
    found = tried_together((HAND, CUBE), [far, safe, short], paths, worlds_of, (Bench("mujoco"), PLAIN))
    assert [each.grasp for each in found] == [safe] * 4
    assert [each.worth for each in found] == pytest.approx([0.062, 0.052, 0.062, 0.052])


def test_grasps_that_come_closer_are_tried_where_they_go_farther(monkeypatch: pytest.MonkeyPatch) -> None:
    def searched(_: object, __: object, paths: list[Any], *___: object, **how: Any) -> list[list[SpatialGrasp]]:
        ways = (0.06, 0.052) if how["config"].margins == CLOSE else (0.05, 0.045)
        return [[planned_for(way) for way in ways] for _ in paths]

    monkeypatch.setattr(spatial_rehearsal, "search_grasps", searched)
    tried: list[list[float]] = []

    def rehearsed(_: object, groups: list[list[SpatialGrasp]], *__: Any, **___: Any) -> list[list[Tried]]:
        tried.extend([grasp.way for grasp in group] for group in groups)
        return [[Tried(grasp, grasp.way, grasp.way) for grasp in group] for group in groups]

    monkeypatch.setattr(spatial_rehearsal, "rehearsed", rehearsed)
    pull, start = np.array([gravity_of("up")]), HAND.start_pose[None]
    grasp = planned_in_space(HAND, CUBE, [spatial_path_of(ASKED[0])], pull, start, bench=Bench("mujoco"))
    assert tried == [[0.05, 0.045, 0.06]]
    assert grasp.way == pytest.approx([0.06])


def test_a_grasp_that_reaches_nothing_is_worth_less_than_any_that_holds() -> None:
    grasp = SpatialGrasp(CONTACTS + 0.2, NORMALS, fingers_at(0.0), 0.05, 0.05)
    world = Worlds(np.array([gravity_of("up")]), HAND.start_pose[None])
    ((tried,),) = rehearsed(
        (HAND, CUBE), [[grasp]], [spatial_path_of(ASKED[0])], world, (Bench("mujoco", threads=1), PLAIN)
    )
    assert tried.worth < LOST


def test_phases_press_before_they_lift_and_turn_before_they_carry() -> None:
    grasp = plain_grasp(HAND.start_pose[None])
    names = [phase.name for phase in standard_phases(grasp, SpatialIkController, held=True)]
    assert names == ["place", "grasp", PRESS, LIFT, MANIPULATE]
    twists = SpatialPath(np.zeros((1, 2, 3)), np.array([[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]]))
    phases = standard_phases(grasp, SpatialIkController, twists, held=True)
    assert [phase.name for phase in phases][-2:] == [TWIST, MANIPULATE]
    assert [phase.lets_go for phase in phases] == [False, False, False, True, False, False]
    assert len(standard_phases(grasp, None, held=True)) == 2


def test_a_part_of_the_worlds_is_a_state_of_its_own(moved: tuple[SpatialTask, Recording]) -> None:
    state = select(moved[1].states[-1], np.array([2, 0]))
    np.testing.assert_array_equal(state.object_pose, moved[1].states[-1].object_pose[[2, 0]])


def test_ik_has_a_lighter_grip_and_stiffer_feedback_than_what_policies_take_over() -> None:
    task = task_of("up", 1)
    ik, learned = find_spatial_controller("ik"), find_spatial_controller("rl-privileged")
    for made, law in ((ik.manipulate(task), EXPERT), (ik.holds(task), EXPERT), (learned.holds(task), PLAIN)):
        assert isinstance(made, SpatialIkController)
        assert made.config == law
    assert EXPERT.grip < PLAIN.grip
    assert EXPERT.proportional > 2 * PLAIN.proportional
    assert ik.whole is not None
    whole = ik.whole.manipulate(task)
    assert isinstance(whole, SpatialIkController)
    assert whole.config == PLAIN
    for entry, law in ((ik, EXPERT), (learned, PLAIN)):
        assert isinstance(entry.grasp, partial)
        assert entry.grasp.keywords.get("config", PLAIN) == law
