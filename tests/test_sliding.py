"""Grips whose contacts slide: farther where the cones end a grip, straight, and only where paths hold the rotation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import Result, result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.control import loop
from inhand.control.controller import Task
from inhand.control.ik import IkController
from inhand.control.rehearsal import closing_joints
from inhand.control.sliding import GAIN, _rank, sliding_grasps
from inhand.geometry import Path
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.hands.grasp_search import plan_grasps
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import TURNS, parse_directions
from inhand.tasks.reach import limits

HAND, TRAPEZOID = load_hand("2v2_50.50_50.50_1.1_53"), load_object("trapezoid")


def reached(controller: str) -> Result:
    config = AsteriskConfig(controller=controller, object="trapezoid", directions="Right", trials=1)
    (trial,) = simulate(config, prepare(config), threads=1)
    return result_of_trial(trial)


def test_contacts_that_slide_carry_slanted_sides_farther_and_straight() -> None:
    plain, slid = reached("ik"), reached("ik-sliding")
    assert (plain.kept, slid.kept) == (True, True)
    assert (plain.fraction or 1.0) < 0.55
    assert (slid.fraction or 0.0) > 0.75
    assert slid.metrics.lateral_max_mm < 2.5
    assert slid.metrics.rotation_max_deg < 6.0


def test_paths_that_turn_and_grips_that_go_as_far_stay_as_they_are() -> None:
    held = Held(HAND, TRAPEZOID)
    turn, right = (straight_path(each).poses for each in (TURNS[0], parse_directions("Right")[0]))
    for path, ways in ((turn, np.zeros(1)), (right, np.full(1, limits(*held, parse_directions("Right"))[0].distance))):
        poses = held.start + path[None]
        plans = [plan_grasps(*held, poses[:, ::3])[0][0]]
        best, told = sliding_grasps(held, poses, (plans, ways - GAIN), "planar")
        assert best == plans
        assert np.isnan(told).all()


def test_the_expert_takes_a_way_that_it_is_told_and_finds_out_the_others() -> None:
    held, path = Held(HAND, TRAPEZOID), straight_path(parse_directions("Right")[0]).poses
    poses = np.repeat(held.start + path[None], 2, axis=0)
    plans = [plan_grasps(*held, poses[:1, ::3])[0][0]] * 2
    task = Task(*held[:1], (TRAPEZOID,) * 2, Path(poses - poses[:, :1]))
    grasp = closing_joints(*held, plans, poses[:, 0], poses[:, 0])
    gripped = loop.simulate(task, grasp, poses[:, 0], None, loop.Bench("planar", threads=1))[1].states[-1]
    free, told = IkController(task), IkController(replace(task, distance=np.array([0.03, np.nan])))
    for each in (free, told):
        each.begin(gripped)
    assert told.limit.tolist() == [0.03, free.limit[1]]
    assert free.limit[0] > 0.035


def test_ranks_count_within_each_owner_and_break_ties_by_order() -> None:
    ends, owner = np.array([0.2, 0.3, 0.3, 0.1, 0.5]), np.array([0, 0, 0, 1, 1])
    assert _rank(ends, owner).tolist() == [2, 0, 1, 1, 0]
