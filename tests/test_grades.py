"""Ways by how well a hand sees, and plans that come with the package."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path as Folder

import numpy as np
import pytest

from inhand import caches
from inhand.control import loop, sensed_plan, shipped_plans
from inhand.control.catalogue import find_controller, rough_grasp
from inhand.control.controller import Task
from inhand.control.feeling import carrier_of
from inhand.control.grades import GRADES, TRUSTING, USUAL, grade_of, told_way
from inhand.control.joint import JointPid
from inhand.control.looking import Choosing, Looking
from inhand.control.phases import GradedGrasp, graded_grasp, placed_joints
from inhand.control.seen import Seen
from inhand.control.sensed_plan import Carrier, graded, plan_keys, sensed_grasp
from inhand.geometry import Array, Path
from inhand.hands.files import load_object
from inhand.hands.fit import Held
from inhand.sim.disturbance import BENCH, FIELD, HARD, Camera, Disturbance
from inhand.sim.drawn import draw
from inhand.tasks.paths import path_of, stacked, whole_path
from inhand.tasks.primitives import GROUPS, TURNS
from test_simulator import HAND

CUBE = load_object("cube_39")


def test_a_scatter_is_that_of_the_frames_in_a_fiducials_noise() -> None:
    task, joints = Task(HAND, (CUBE,), Path(np.zeros((1, 2, 3)))), np.zeros((1, HAND.n_joints))
    looking, frames = Looking(task, joints, HAND.start_pose[None]), [(0.001, 0.02), (-0.001, 0.0), (0.0, 0.01)]
    for row, (x, angle) in enumerate(frames):
        frame = HAND.start_pose[None] + (0.01 + x, 0.0, angle)
        seen = Seen(np.full(1, 0.02 * row), joints, joints, joints, frame, np.full(1, 0.02 * row))
        if row == 0:
            looking.begin(seen)
        looking.act(seen)
        assert np.isinf(looking.scatter[0]) == (row < 2)
    variances = np.var(frames, axis=0, ddof=1) / (0.001**2, np.deg2rad(1.0) ** 2)
    np.testing.assert_allclose(looking.scatter, [np.sqrt(variances.sum() / 3)], rtol=1e-6)


def test_the_way_that_is_gone_is_the_grades_of_what_is_seen() -> None:
    asked, still = list[Array](), np.tile(HAND.start_pose, (2, 2, 1))
    follows = {"planned": still[:, 0], "follows": np.zeros((2, HAND.n_joints, 3))}
    usual = replace(rough_grasp(HAND, CUBE, still), way=np.full(2, 0.05), **follows)
    grasp = graded_grasp([replace(usual, way=np.full(2, way)) for way in (0.06, 0.05, 0.03)])
    # A part of what was planned is gone before.
    task = Task(HAND, (CUBE,) * 2, Path(np.zeros((2, 2, 3))), distance=np.full(2, 0.04))

    def carry(task: Task) -> JointPid:
        assert task.distance is not None
        asked.append(task.distance)
        return JointPid(task, grasp.closed)

    for level in (None, BENCH, FIELD, HARD):
        seen = None if level is None else Disturbance(camera=level.camera)
        worlds = None if seen is None else [draw(seen, (3, number), HAND.n_joints) for number in range(2)]
        loop.simulate(task, grasp, still[:, 0], carry, loop.Bench(), longest=0.04, disturbed=worlds)
    # Of two grades, as of hands and objects that differ, the last is that of whoever does not see well.
    two = replace(grasp, graded=grasp.graded[:2])
    loop.simulate(task, two, still[:, 0], carry, loop.Bench(), longest=0.04, disturbed=worlds)
    np.testing.assert_allclose(asked, np.repeat([[0.05], [0.05], [0.04], [0.02], [0.04]], 2, axis=1))
    assert grade_of(np.array([0.0, np.inf])).tolist() == [0, len(GRADES) - 1]


def test_no_more_is_dared_than_usual_where_frames_are_late_or_objects_far_off() -> None:
    told, still = list[Array](), np.tile(HAND.start_pose, (1, 2, 1))
    usual = replace(
        rough_grasp(HAND, CUBE, still),
        planned=still[:, 0],
        follows=np.zeros((1, HAND.n_joints, 3)),
        way=np.full(1, 0.05),
    )
    grasp = graded_grasp([replace(usual, way=np.full(1, 0.06 - 0.01 * k), risk=np.full(1, 0.1 * k)) for k in range(3)])
    task = Task(HAND, (CUBE,), Path(np.zeros((1, 2, 3))), distance=np.full(1, 0.05))

    def carry(task: Task) -> JointPid:
        assert task.distance is not None
        assert task.risk is not None
        told.append(np.append(task.distance, task.risk))
        return JointPid(task, grasp.closed)

    for camera in (
        Camera(delay_ms=(40.0, 40.0)),
        Camera(delay_ms=(60.0, 60.0)),
        replace(HARD.camera, delay_ms=(60.0, 60.0)),
    ):
        late = draw(Disturbance(camera=camera), (3, 0), HAND.n_joints)
        loop.simulate(task, grasp, still[:, 0], carry, loop.Bench(), longest=0.04, disturbed=[late])
    for off_mm in (4.0, 6.0):  # beside its plan and seen exactly
        loop.simulate(task, grasp, still[:, 0] + (off_mm / 1e3, 0.0, 0.0), carry, loop.Bench(), longest=0.04)
    np.testing.assert_allclose(told, [[0.06, 0.0], [0.06, 0.1], [0.04, 0.2], [0.06, 0.0], [0.05, 0.1]])


@pytest.mark.parametrize(("turned", "soon"), [(0.1, 80), (3.0, 165)])
def test_fingers_are_placed_for_the_grasp_of_what_is_seen_however_far_it_is(turned: float, soon: int) -> None:
    still = np.tile(HAND.start_pose, (1, 2, 1))
    follows = {"planned": still[:, 0], "follows": np.zeros((1, HAND.n_joints, 3))}
    usual = replace(rough_grasp(HAND, CUBE, still), **follows)
    elbows = np.array([0.0, turned, 0.0, -turned])
    well = replace(usual, opened=usual.opened + elbows, closed=usual.closed + elbows + 0.1)
    grasp, task = graded_grasp([well, usual]), Task(HAND, (CUBE,), Path(np.zeros((1, 2, 3))))
    seen = draw(Disturbance(camera=FIELD.camera), (3, 1), HAND.n_joints)
    for worlds, its in ((None, well), ([seen], usual)):
        _, found = loop.simulate(task, grasp, still[:, 0], None, loop.Bench(), disturbed=worlds)
        joints, placed = [state.joint_angles for state in found.states], np.flatnonzero(found.phase == 0)[-1]
        # They wait until it is known, then stay off the object.
        np.testing.assert_allclose(joints[:15], np.tile(placed_joints(HAND, usual), (15, 1, 1)), atol=2e-3)
        np.testing.assert_allclose(joints[placed], its.opened, atol=5e-3)
        assert max(np.abs(state.pose - still[:, 0]).max() for state in found.states[: placed + 1]) < 1e-6
        np.testing.assert_allclose(found.states[-1].targets, its.closed, atol=0.03)
        assert (worlds is None) == (placed < soon)


def test_fingers_that_go_to_another_grasp_pass_its_first_stop() -> None:
    task, origin = Task(HAND, (CUBE,), Path(np.zeros((1, 2, 3)))), np.zeros((1, HAND.n_joints))
    stops = np.array([[[0.05, 0.1, 0.2]], [[0.0, 0.3, 0.4]]])[:, 0, :, None, None] + origin
    choosing, goals, joints = Choosing(task, stops, HAND.start_pose[None]), list[float](), origin
    for row in range(60):
        off = 1e-5 * (-1) ** row if row < 40 else 0.02 * (-1) ** row  # seen well at first, then no more
        time, frame = np.full(1, 0.02 * row), HAND.start_pose[None] + (off, 0.0, 0.0)
        seen = Seen(time, joints, origin, joints, frame, time)
        if row == 0:
            choosing.begin(seen)
        joints = choosing.act(seen)
        goals.append(float(joints[0, 0]))
    assert goals[39] == pytest.approx(0.2, abs=1e-3)
    assert min(goals[40:]) == pytest.approx(0.0, abs=1e-3)  # of the other grasp, not its third
    assert goals[-1] > 0.2


def test_a_grasp_is_planned_for_each_grade_where_they_are_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, poses = list[Carrier](), HAND.start_pose[None, None] + np.zeros((1, 2, 3))

    def planned(_held: object, _poses: object, by: Carrier) -> dict[str, Array]:
        asked.append(by)
        rows = np.full((1, HAND.n_joints), float(len(asked)))
        place = {"planned": poses[:, 0], "follows": np.zeros((1, HAND.n_joints, 3))}
        return {"opened": rows, "closed": rows, "way": rows[:, 0], "ways": rows[:, :1], **place}

    monkeypatch.setattr(sensed_plan, "_planned", planned)
    monkeypatch.setenv(caches.PLACE, "off")
    grasp = sensed_grasp(HAND, CUBE, poses, carrier=Carrier(grades=TRUSTING, apart=True))
    assert [each.grades for each in asked] == [(grade,) for grade in TRUSTING]
    assert isinstance(grasp, GradedGrasp)
    assert [each.opened[0, 0] for each in grasp.graded] == [1.0, 2.0]
    assert grasp.opened[0, 0] == 2.0  # that of the usual grade, with which episodes begin


def test_what_no_camera_shows_differs_as_in_the_field_however_well_it_sees() -> None:
    best = GRADES[0].worlds
    assert best.differs.friction == FIELD.differs.friction
    assert best.pushes == FIELD.pushes
    assert best.camera == BENCH.camera
    assert USUAL.worlds.differs.start_mm > FIELD.differs.start_mm
    trusted, usual = (each.worlds for each in TRUSTING)
    assert (trusted.differs.friction, trusted.pushes) == (BENCH.differs.friction, BENCH.pushes)
    assert usual.differs.friction[1] < 1 < FIELD.differs.friction[1]
    policies = [find_controller(name).policy for name in ("rl", "rl-family")]
    carriers = [carrier_of(policy) for policy in policies if policy]
    assert [(each.grades, each.apart) for each in carriers] == [(GRADES, False), (TRUSTING, True)]


def test_a_way_is_shorter_where_a_loss_costs_more() -> None:
    ways = np.repeat(np.array([0.08, *[0.1] * 20])[:, None], 2, axis=1)
    ways[1:4] = 0.095
    assert told_way(ways, grade=replace(USUAL, price=0.1))[0] > 0.098
    assert told_way(ways, grade=replace(USUAL, price=20.0))[0] < 0.08


def test_a_grip_that_holds_is_worth_more_than_one_that_loses_before_it_goes() -> None:
    held, lost = np.zeros((20, 2)), np.repeat(np.array([-1.0, -1.0, *[0.0] * 18])[:, None], 2, axis=1)
    careful = TRUSTING[-1]
    assert told_way(held, grade=careful)[1] > told_way(lost, grade=careful)[1] + 0.01
    assert told_way(held, grade=USUAL)[1] == told_way(lost, grade=USUAL)[1]
    # A short way on which one is lost is not gone, a long one is.
    for far, gone in ((0.02, False), (0.2, True)):
        ways = np.repeat(np.array([0.5 * far, *[far] * 27])[:, None], 2, axis=1)
        assert (told_way(ways, grade=careful)[0] > 0.9 * far) == gone
        assert told_way(ways, grade=replace(careful, least=0.0))[0] > 0.9 * far


@pytest.mark.parametrize("name", ["rl", "ik-sensed"])
def test_the_standard_pair_is_planned_in_every_direction(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = find_controller(name)
    by = graded(Carrier()) if entry.policy is None else carrier_of(entry.policy)
    for group in (GROUPS["all"], TURNS):
        poses = HAND.start_pose + stacked([whole_path(path_of(each)) for each in group])
        known = shipped_plans.shipped()
        missing = [
            str(each)
            for each, key in zip(group, plan_keys(Held(HAND, CUBE), poses, by), strict=True)
            if key not in known
        ]
        assert not missing, "run `python studies/plans.py`: the policy or a number of planning has changed"
        monkeypatch.setattr(sensed_plan, "_planned", lambda *_: pytest.fail("planned"))
        grasp = entry.grasp(HAND, CUBE, poses)
        assert grasp.way is not None
        assert grasp.way.min() > 0.01
    assert not set(plan_keys(Held(HAND, CUBE), poses, replace(by, stays=1))) & set(known)


def test_plans_are_found_by_paths_whatever_their_last_bits_and_pauses(tmp_path: Folder) -> None:
    path = np.array([[0.0, 0.0, 0.0], [0.001, 0.0, 0.0], [0.002, 0.0, 0.0]])
    keys = shipped_plans.path_keys("told", path[None])
    longer = np.concatenate([path, path[-1:], path[-1:]]) + 1e-13
    assert shipped_plans.path_keys("told", longer[None]) == keys
    assert shipped_plans.path_keys("other", path[None]) != keys
    assert shipped_plans.path_keys("told", path[None, :2]) != keys
    shipped_plans.ship(tmp_path / "plans" / "own.npz", keys, {"way": np.array([0.5])})
    with np.load(tmp_path / "plans" / "own.npz", allow_pickle=False) as data:
        assert data["keys"].tolist() == keys
        assert data["way"].tolist() == [0.5]
