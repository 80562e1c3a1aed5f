"""The search for contact points: force closure, what a plan promises, and objects no grasp can hold."""

from dataclasses import fields, replace
from itertools import chain, combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from inhand import caches
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.control import rehearsal
from inhand.control.catalogue import planned_grasp
from inhand.errors import InputError
from inhand.geometry import Array, cross, inverse_transform, unit
from inhand.hands import grasp_search
from inhand.hands.force_closure import force_closure
from inhand.hands.grasp_search import (
    GraspPlan,
    SearchConfig,
    _common_reach,
    _grip_lines,
    _search,
    clear_for,
    moved_along,
    plan_grasps,
)
from inhand.hands.hand import HandSpec
from inhand.hands.kinematics import joint_positions
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.hands.objects import ObjectSpec, polygon
from inhand.hands.polygons import contact, separation
from inhand.hands.rolling import Tracks
from inhand.hands.shapes import link_polygons
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import primitive_at

STANDARD = "2v2_50.50_50.50_1.1_53"
PAIRS = [
    (STANDARD, "cube_39"),
    ("2v2_65.35_65.35_1.1_53:lab-limits", "cylinder_40"),
    ("2v3_25.75_25.35.40_1.1_53", "ellipse_40x25"),
]
STEP = 0.003
"""Spacing of the planned poses [m]."""


def poses_along(hand: HandSpec, *angles_deg: float, length: float = 0.15) -> Array:
    """Return object poses `(P, S, 3)` in the palm frame along straight lines."""
    origin = hand.start_pose
    return np.stack([origin + straight_path(primitive_at(a), length, STEP).poses for a in angles_deg])


def plans_for(hand: str, thing: str, *angles_deg: float) -> tuple[HandSpec, ObjectSpec, list[GraspPlan]]:
    spec = parse_hand_name(hand)
    found = plan_grasps(spec, OBJECTS[thing], poses_along(spec, *angles_deg))
    return spec, OBJECTS[thing], [group[0] for group in found]


def contacts(points: list[tuple[float, float]], normals: list[tuple[float, float]]) -> Tracks:
    """Return contacts that have not rolled yet."""
    shape = (len(points), 1, 2)
    kept = np.ones(shape[:2], dtype=bool)
    return Tracks(np.reshape(points, shape), np.reshape(normals, shape), np.zeros((len(points), 1, 2)), kept)


def test_a_grip_line_misses_the_middle_by_as_much_on_either_side() -> None:
    left = contacts([(-0.02, y) for y in (-0.01, 0.0, 0.01)], [(-1, 0)] * 3)
    right = contacts([(0.02, y) for y in (-0.01, 0.0, 0.01)], [(1, 0)] * 3)
    tilt, offset = _grip_lines(left, right)
    assert np.diag(offset) == pytest.approx([0.01, 0.0, 0.01])
    assert offset == pytest.approx(offset[::-1, ::-1])
    assert tilt == pytest.approx(tilt[::-1, ::-1])
    assert np.diag(tilt) == pytest.approx([0.0, 0.0, 0.0])
    assert tilt[0, 2] == pytest.approx(1 - np.cos(np.arctan2(0.02, 0.04)))


def inside_cone(friction: float, normal: Array, force: Array) -> bool:
    """Return whether a force presses against a surface and its tangential part is within friction (Coulomb)."""
    pressing = -float(force @ normal)
    sideways = abs(float(force @ np.array([-normal[1], normal[0]])))
    return pressing > 0 and sideways <= friction * pressing


def test_force_closure_is_its_definition() -> None:
    rng = np.random.default_rng(1)
    count = 4000
    points, angles = rng.normal(size=(2, count, 2)), rng.uniform(-np.pi, np.pi, (2, count))
    angles[0, ::2] = np.pi + rng.normal(0, 0.4, count // 2)
    angles[1, ::2] = rng.normal(0, 0.4, count // 2)
    points[:, ::2] = rng.normal(0, 0.2, (2, count // 2, 2)) + np.array([[[-1, 0]], [[1, 0]]])
    normals = unit(angles)
    found = force_closure(0.5, (points[0], normals[0]), (points[1], normals[1]))
    line = points[1] - points[0]
    expected = [
        inside_cone(0.5, normals[0, k], line[k]) and inside_cone(0.5, normals[1, k], -line[k]) for k in range(count)
    ]
    np.testing.assert_array_equal(found, expected)
    assert 0.1 < np.mean(found) < 0.9


def test_more_friction_never_loses_a_grip_and_axes_broadcast() -> None:
    rng = np.random.default_rng(2)
    left = (rng.normal(size=(7, 1, 2)) - np.array([3, 0]), unit(np.pi + rng.normal(0, 0.5, (7, 1))))
    right = (rng.normal(size=(1, 5, 2)) + np.array([3, 0]), unit(rng.normal(0, 0.5, (1, 5))))
    held = np.stack([force_closure(friction, left, right) for friction in (0.0, 0.2, 0.4, 0.8, 1e3)])
    assert held.shape == (5, 7, 5)
    assert (np.diff(held.astype(int), axis=0) >= 0).all()
    assert held[-1].all()
    assert not held[0].any()
    each = force_closure(np.array([0.0, 1e3])[:, None], (left[0][:1], left[1][:1]), (right[0], right[1]))
    np.testing.assert_array_equal(each[1], held[-1, 0])


def test_two_fingers_on_one_side_hold_nothing() -> None:
    normal = np.array([0.0, 1.0])
    points = np.array([(-0.01, 0.02), (0.01, 0.02)])
    assert not force_closure(10.0, (points[0], normal), (points[1], normal))


@pytest.mark.parametrize(("hand", "thing"), PAIRS)
def test_plans_stand_off_then_press_within_limits_and_clear_of_each_other(hand: str, thing: str) -> None:
    config = SearchConfig()
    spec, body, plans = plans_for(hand, thing, 90.0, 0.0, -120.0)
    outline = polygon(body) + np.array(spec.start_position)
    grasp = planned_grasp(spec, body, np.repeat(poses_along(spec, 90.0, 0.0, -120.0), 3, axis=1))
    for plan, opened, closed in zip(plans, grasp.opened, grasp.closed, strict=True):
        assert plan.reach >= 2
        for joints in (opened, closed):
            assert ((joints >= spec.limits[:, 0]) & (joints <= spec.limits[:, 1])).all()
        left, right = (closed[None, None, place] for place in spec.slices)
        assert clear_for(spec, left, right, np.array([1])) == [1]
        for i, (finger, place) in enumerate(zip(spec.fingers, spec.slices, strict=True)):
            away = separation(link_polygons(spec, finger, opened[place])[-1], outline)
            gap, point, _ = contact(link_polygons(spec, finger, closed[place])[-1], outline)
            assert away > config.opening / 2, i
            assert -1.5 * config.squeeze < gap < 0, i
            start = inverse_transform(spec.start_pose, point)
            assert np.linalg.norm(start - plan.contacts[i]) < 0.004, i
        assert plan.contacts[0, 0] < plan.contacts[1, 0]


def test_a_plan_covers_the_whole_of_a_short_path() -> None:
    spec = parse_hand_name(STANDARD)
    ((short, *_),) = plan_grasps(spec, OBJECTS["cube_39"], poses_along(spec, 90.0, length=0.03))
    assert short.reach == 11


def test_a_plan_for_one_path_does_not_depend_on_the_others() -> None:
    _, _, together = plans_for(STANDARD, "cube_39", 90.0, 0.0)
    _, _, alone = plans_for(STANDARD, "cube_39", 0.0)
    assert together[1].reach == alone[0].reach
    np.testing.assert_allclose(together[1].joints, alone[0].joints, atol=1e-9)


@pytest.mark.parametrize("angle_deg", [-90.0, -112.5])
def test_grips_whose_fingers_meet_do_not_hide_one_whose_fingers_do_not(angle_deg: float) -> None:
    """The farthest grips on paper cross the fingers here; many must be passed over before one is clear."""
    _, _, (plan,) = plans_for("2v2_65.35_65.35_1.1_53", "cylinder_40", angle_deg)
    assert 1e3 * STEP * (plan.reach - 1) > 36


def test_the_simulation_reaches_what_was_planned() -> None:
    config = AsteriskConfig(directions="Out,Right,In-Left,22.5", trials=1, noise_mm=0, noise_deg=0)
    setup = prepare(config)
    angles = [each.primitive.angle_deg or 0.0 for each in setup.assignments]
    plans = plan_grasps(setup.hand, setup.object, poses_along(setup.hand, *angles))
    for (plan, *_), trial in zip(plans, simulate(config, setup), strict=True):
        planned = 1e3 * STEP * (plan.reach - 1)
        assert result_of_trial(trial).metrics.max_distance_mm == pytest.approx(planned, abs=8), trial.passport.primitive


@pytest.mark.parametrize("thing", ["cylinder_40", "ellipse_40x25", "cube_39"])
def test_an_object_without_friction_cannot_be_held(thing: str) -> None:
    spec, slippery = parse_hand_name(STANDARD), replace(OBJECTS[thing], friction=0.0)
    with pytest.raises(
        InputError,
        match=rf"no start grasp holds object '{thing}' with hand '{STANDARD}': no two reachable points have their line"
        r" inside both friction cones; use another object, hand or start",
    ):
        plan_grasps(spec, slippery, poses_along(spec, 90.0))


def test_fingers_that_would_cross_are_no_grasp() -> None:
    """On so narrow a palm the first links lie on each other in every grip."""
    spec = replace(parse_hand_name("2v2_50.50_50.50_1.1_3"), joint_gap=0.0, link_width=0.06)
    with pytest.raises(InputError, match=r"no start grasp holds .*: the fingers would meet in every grip"):
        plan_grasps(spec, OBJECTS["cube_39"], poses_along(spec, 0.0))


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_finger_that_cannot_reach_is_named(side: str) -> None:
    spec = parse_hand_name(STANDARD)
    finger = getattr(spec, side)
    stiff = replace(finger, limits=((-0.01, 0.01), (-0.01, 0.01)))
    with pytest.raises(InputError, match=rf"the {side} finger reaches no point of it within its joint limits"):
        plan_grasps(replace(spec, **{side: stiff}), OBJECTS["cube_39"], poses_along(spec, 90.0))


def middle_of(plan: GraspPlan) -> float:
    """Return how far the grip line is from the object's middle [m]."""
    line = plan.contacts[1] - plan.contacts[0]
    return abs(float(cross(line, plan.contacts[0]))) / float(np.linalg.norm(line))


def test_what_is_off_the_middle_and_what_has_no_company_costs_progress() -> None:
    spec, cube = parse_hand_name(STANDARD), OBJECTS["cube_39"]
    poses = poses_along(spec, -45.0)
    free, centred, alone, company = (
        plan_grasps(spec, cube, poses, SearchConfig(tilt_cost=tilt, centre_cost=centre, company=weight))[0][0]
        for tilt, centre, weight in ((0.012, 0.0, 0.0), (0.012, 20.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 20.0))
    )
    assert middle_of(centred) < middle_of(free) - 1e-3
    assert np.abs(company.contacts - alone.contacts).max() > 1e-3


def test_a_point_is_moved_along_as_far_as_the_joints_limits_let_it() -> None:
    finger = parse_hand_name("2v2_50.50_50.50_1.1_53:lab-limits").right
    joints = np.array([[1.5, 0.1]])
    tip = joint_positions(finger, joints)[:, -1]
    moved = moved_along(finger, joints, tip, np.array([[0.0, -0.05]]))
    assert moved[0, 0] == pytest.approx(finger.limits[0][1])
    assert (np.array(finger.limits)[:, 0] <= moved).all()


def test_a_finger_that_cannot_roll_to_where_the_object_stands_closes_where_it_was_planned() -> None:
    spec, cube = parse_hand_name(STANDARD), OBJECTS["cube_39"]
    poses = poses_along(spec, 90.0)
    plans = [plan_grasps(spec, cube, poses)[0][0]] * 2
    home = poses[[0, 0], 0]
    away = home + np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])
    grasp = rehearsal.closing_joints(spec, cube, plans, home, away)
    for joints in (grasp.opened, grasp.closed):
        np.testing.assert_allclose(joints[1], joints[0], atol=1e-5)


def test_grasps_that_are_kept_differ() -> None:
    spec, config = parse_hand_name(STANDARD), SearchConfig()
    (plans,) = plan_grasps(spec, OBJECTS["cube_39"], poses_along(spec, 90.0, length=0.06))
    assert len(plans) == config.count
    for one, other in combinations(plans, 2):
        assert np.linalg.norm(one.contacts - other.contacts, axis=-1).max() >= config.apart


@given(st.integers(0, 10_000))
def test_pairs_hold_for_as_many_poses_as_both_fingers_and_both_cones_do(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count, steps, friction = (4, 3), 5, np.array([0.4, 0.8])
    sides = [
        Tracks(
            rng.normal((x, 0.0), 0.2, (each, steps, 2)),
            unit(rng.normal(heading, 0.4, (each, steps))),
            np.zeros((each, steps, 2)),
            np.logical_and.accumulate(rng.uniform(size=(each, steps)) < 0.9, axis=1),
        )
        for each, x, heading in zip(count, (-1.0, 1.0), (np.pi, 0.0), strict=True)
    ]
    left, right = sides
    closed = force_closure(
        friction[[0, 1, 1, 1, 1]], (left.points[:, None], left.normals[:, None]), (right.points, right.normals)
    )
    holds = closed & left.held[:, None] & right.held
    np.testing.assert_array_equal(_common_reach(left, right, friction), np.cumprod(holds, axis=-1).sum(axis=-1))


@pytest.mark.parametrize("hand", [STANDARD, "3v3_25.40.35_40.35.25_1.1_63"])
def test_poses_are_clear_until_two_links_overlap(hand: str) -> None:
    spec, rng = parse_hand_name(hand), np.random.default_rng(0)
    joints = rng.uniform(-1.2, 1.2, (200, 3, spec.n_joints))
    left, right = (joints[..., place] for place in spec.slices)
    links = [link_polygons(spec, finger, side) for finger, side in zip(spec.fingers, (left, right), strict=True)]
    gaps = np.min([separation(one, other) for one in links[0] for other in links[1]], axis=0)
    expected = np.cumprod(gaps > 0, axis=-1).sum(axis=-1)
    assert set(expected.tolist()) == {0, 1, 2, 3}
    np.testing.assert_array_equal(clear_for(spec, left, right, np.full(200, 3)), expected)
    np.testing.assert_array_equal(clear_for(spec, left, right, np.full(200, 1)), np.minimum(expected, 1))


def test_a_plan_is_searched_once_and_anew_where_anything_it_depends_on_differs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, cube, searched = parse_hand_name(STANDARD), OBJECTS["cube_39"], list[int]()

    def counting(hand: HandSpec, object_: ObjectSpec, poses: Array, config: SearchConfig) -> list[list[GraspPlan]]:
        searched.append(len(poses))
        return plain(hand, object_, poses, config)

    plain = _search
    monkeypatch.setattr(grasp_search, "_search", counting)
    monkeypatch.setenv(caches.PLACE, str(tmp_path))
    poses = poses_along(spec, 90.0, -45.0, length=0.02)
    first, again, other = (plan_grasps(spec, cube, each) for each in (poses, poses, poses[::-1]))
    assert searched == [2]
    for groups in (again, other[::-1]):
        for one, two in zip(chain(*first), chain(*groups), strict=True):
            for field in fields(GraspPlan):
                np.testing.assert_array_equal(getattr(one, field.name), getattr(two, field.name))
    plan_grasps(spec, cube, poses_along(spec, 0.0, 90.0, length=0.02))
    assert searched == [2, 1]
    plan_grasps(replace(spec, friction=0.9 * spec.friction), cube, poses)
    plan_grasps(spec, replace(cube, friction=0.9 * cube.friction), poses)
    plan_grasps(spec, cube, poses, SearchConfig(count=2))
    assert searched == [2, 1, 2, 2, 2]
    damaged = next((tmp_path / "results").iterdir())
    for file in (tmp_path / "results").iterdir():
        file.write_bytes(damaged.read_bytes()[:-1])
    plan_grasps(spec, cube, poses)
    monkeypatch.setattr(caches, "sources", lambda _: "changed")
    plan_grasps(spec, cube, poses)
    assert searched == [2, 1, 2, 2, 2, 2, 2]
