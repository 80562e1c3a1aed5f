"""Contact search in space: what it finds holds, keeps its margins and obeys the hand's symmetry."""

from dataclasses import replace

import numpy as np
import pytest

from inhand.geometry import Array
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.following import FollowRules, follow_grips
from inhand.hands.spatial.forces import BALANCED, GripRules, hold, weight_held
from inhand.hands.spatial.grasp_search import SpatialGrasp, SpatialSearchConfig, follow_tuples, search_grasps
from inhand.hands.spatial.gravity import PALMS, gravity_of
from inhand.hands.spatial.names import STANDARD, parse_spatial_name
from inhand.hands.spatial.objects import SolidSpec, parse_solid_name
from inhand.hands.spatial.rolling import Margins, off_the_palm
from inhand.hands.spatial.shared_grasps import search_shared, worth_together
from inhand.hands.spatial.start_contacts import contacts_at, gaps_of
from inhand.hands.spatial.start_tuples import followed, held_together
from inhand.rotations import placed, seen_from
from inhand.tasks.spatial.paths import spatial_path_of, stacked_paths
from inhand.tasks.spatial.primitives import parse_spatial_directions

HAND, CUBE = parse_spatial_name(STANDARD), parse_solid_name("cube_50")
COARSE = SpatialSearchConfig(spacing=0.012, step=0.004, turn=np.deg2rad(6.0))
GRAVITIES = np.array([gravity_of(palm) for palm in PALMS])
WORDS = "Left,Right,Up,turn+z,turn-z"


@pytest.fixture(scope="module")
def found() -> list[list[SpatialGrasp]]:
    paths = [spatial_path_of(each) for each in parse_spatial_directions(WORDS)]
    return search_grasps((HAND, CUBE), HAND.start_pose, paths, GRAVITIES, config=COARSE)


def test_grasps_are_ranked_and_apart(found: list[list[SpatialGrasp]]) -> None:
    for grasps in found:
        assert len(grasps) == COARSE.keep
        values = [grasp.value for grasp in grasps]
        assert values == sorted(values, reverse=True)
        assert all(grasp.way > 0.03 for grasp in grasps)
        for k, grasp in enumerate(grasps):
            assert all(np.abs(grasp.points - other.points).max() > COARSE.apart for other in grasps[:k])


def test_grasps_touch_where_they_say_and_hold_the_weight(found: list[list[SpatialGrasp]]) -> None:
    friction = COARSE.share * HAND.friction * CUBE.friction
    for grasps in found:
        joints = np.array([grasp.joints for grasp in grasps])
        pose = np.tile(HAND.start_pose, (len(grasps), 1))
        told = kinematics.measure(HAND, CUBE, joints, pose)
        np.testing.assert_allclose(told.gaps, 0, atol=4e-4)
        np.testing.assert_allclose(placed(pose[:, None], np.array([g.points for g in grasps])), told.points, atol=5e-4)
        np.testing.assert_allclose(np.array([grasp.normals for grasp in grasps]), told.normals, atol=1e-9)
        low, high = HAND.limits.T
        assert ((joints > low + COARSE.margins.joints) & (joints < high - COARSE.margins.joints)).all()
        assert (np.delete(told.link_gaps, [2, 5, 8], axis=1) > COARSE.margins.links - 1e-6).all()
        for gravity in GRAVITIES:
            wanted = weight_held(CUBE.mass, gravity)[None]
            rules = GripRules(friction=friction, rounds=500)
            grip = hold((told.points, -told.normals), wanted, pose[:, :3], rules=rules)
            assert (grip.misses < BALANCED).all()


def test_the_hand_s_mirror_image_goes_as_far(found: list[list[SpatialGrasp]]) -> None:
    left, right, _, ccw, cw = ([grasp.way for grasp in grasps] for grasps in found)
    np.testing.assert_allclose(left[0], right[0], atol=1e-9)
    np.testing.assert_allclose(ccw[0], cw[0], atol=1e-9)


def test_what_is_planned_is_what_is_predicted(found: list[list[SpatialGrasp]]) -> None:
    """The prediction from the measured grip, with a plan's own rules, ends where the plan does."""
    paths = [spatial_path_of(each, step=COARSE.step) for each in parse_spatial_directions(WORDS)][:3]
    best = [grasps[0] for grasps in found[:3]]
    now = np.array([grasp.joints for grasp in best]), np.tile(HAND.start_pose, (3, 1))
    rules = FollowRules(COARSE.margins, COARSE.share, stride=1, every=COARSE.every)
    ends = [
        follow_grips((HAND, CUBE), now, (stacked_paths(paths), now[1], np.tile(gravity, (3, 1))), rules)
        for gravity in GRAVITIES
    ]
    np.testing.assert_allclose(np.min(ends, axis=0), [grasp.way for grasp in best], atol=2 * COARSE.step)
    looser = follow_grips((HAND, CUBE), now, (stacked_paths(paths), now[1], np.tile(GRAVITIES[0], (3, 1))))
    assert (looser >= ends[0] - 2 * COARSE.step).all()


def test_more_friction_carries_no_less_far(found: list[list[SpatialGrasp]]) -> None:
    path = spatial_path_of(parse_spatial_directions("Up")[0])
    ways = []
    for friction in (0.2, 0.35):
        config = replace(COARSE, cost=0.0)
        grasps = search_grasps(
            (HAND, replace(CUBE, friction=friction)), HAND.start_pose, [path], GRAVITIES, config=config
        )[0]
        ways.append(max((grasp.way for grasp in grasps), default=0.0))
    assert ways[0] <= ways[1] <= max(grasp.way for grasp in found[2]) + 1e-9


@pytest.mark.parametrize("name", ["sphere_50", "cylinder_50x60", "ellipsoid_60x50x40"])
def test_contacts_lie_on_the_surface_all_round(name: str) -> None:
    spec = parse_solid_name(name)
    margins = Margins()
    for f, starts in enumerate(contacts_at((HAND, spec), HAND.start_pose, 0.012, margins)):
        assert len(starts.points) > 5
        joints = np.zeros((len(starts.joints), HAND.n_joints))
        joints[:, HAND.slices[f]] = starts.joints
        told = kinematics.measure(HAND, spec, joints, np.tile(HAND.start_pose, (len(joints), 1)))
        np.testing.assert_allclose(told.gaps[:, f], 0, atol=5e-4)
        seen = seen_from(HAND.start_pose, told.points[:, f])
        np.testing.assert_allclose(seen, starts.points, atol=1e-3)


def test_fingers_need_no_more_room_than_the_straight_hand_has() -> None:
    close = parse_spatial_name("3f_60.60_9_7")
    most = 3
    gaps = gaps_of(close, 0.0025, most)
    assert (gaps[0, 1] <= 0.0025).all()
    assert gaps[0, 1].min() < 0.0025
    wide = gaps_of(HAND, 0.0025, most)
    np.testing.assert_allclose(wide[0, 1], 0.0025)


def lowest(spec: SolidSpec, rows: Array) -> Array:
    """Return the height of the lowest of many points of a solid at each pose."""
    drawn = np.random.default_rng(0).standard_normal((4000, 3))
    if spec.shape == "cylinder":
        drawn /= np.maximum(np.hypot(drawn[:, 0], drawn[:, 1]), np.abs(drawn[:, 2]))[:, None]
    else:
        drawn /= (
            np.abs(drawn).max(axis=-1, keepdims=True)
            if spec.shape == "box"
            else np.linalg.norm(drawn, axis=-1, keepdims=True)
        )
    return np.asarray(rows[..., 2] + (rows[..., None, 9:] * (drawn * spec.half)).sum(axis=-1).min(axis=-1))


@pytest.mark.parametrize("name", ["cube_50", "sphere_50", "cylinder_50x60", "ellipsoid_60x50x40"])
def test_objects_end_where_they_meet_the_palm(name: str) -> None:
    spec = parse_solid_name(name)
    paths = [spatial_path_of(each, step=0.01) for each in parse_spatial_directions("Down,turn@1:2:0")]
    for path in paths:
        rows = kinematics.rows_of(path.poses(np.array([*HAND.start_position[:2], 0.04, 1.0, 0.0, 0.0, 0.0])))
        above = np.logical_and.accumulate(lowest(spec, rows) > HAND.palm.top)
        assert abs(int(off_the_palm(HAND, spec, rows, 0.0).sum()) - int(above.sum())) <= (path.turns.any() * 4)


def test_one_grasp_for_many_paths_is_worth_most_along_all_of_them(found: list[list[SpatialGrasp]]) -> None:
    paths = [spatial_path_of(each) for each in parse_spatial_directions(WORDS)]
    ways = np.array([[0.05, 0.09, 0.04], [0.06, 0.06, 0.05], [0.0, 0.2, 0.0]])
    some = [paths[0], paths[1], paths[3]]  # two moves and a turn
    assert worth_together(ways, some) == pytest.approx([0.7 + 0.8, 0.6 + 1.0, 1.0])
    assert worth_together(ways[:, 2:], some[2:]) == pytest.approx([0.8, 1.0, 0.0])
    best, *others = search_shared((HAND, CUBE), HAND.start_pose, paths, GRAVITIES, COARSE)
    assert all(best.value >= each.value for each in others)
    assert 0.015 < best.way <= min(grasps[0].way for grasps in found) + 1e-9


def test_many_fingers_of_many_joints_have_many_contacts_with_a_posture_each() -> None:
    hand = parse_spatial_name("4f_45.45.30_40_10")
    together = held_together((hand, CUBE), hand.start_pose, 0.012, Margins(), GripRules(friction=0.63))
    for starts in together.starts:
        assert len(np.unique(starts.points, axis=0)) == len(starts.points) > 30


def test_tuples_are_asked_in_order_and_none_that_holds_is_given_up() -> None:
    rules = GripRules(friction=0.63)
    together = held_together((HAND, CUBE), HAND.start_pose, 0.016, Margins(), rules)
    rng, way = np.random.default_rng(0), np.linspace(0.0, 0.08, 41)
    lengths = [rng.integers(0, 42, size=count) for count in together.counts]
    ranked = together.ranked(lengths, way, 0.01)
    first = next(each for each in ranked if len(each.rows))
    rows, asked = together.rows(), (together.known != 0).sum()
    assert 0 < asked < len(rows) / 2  # what cannot be first is not looked at
    numbers = together.numbers(rows)
    own = list(zip(together.starts, numbers.T, strict=True))
    points = np.stack([starts.points[k] for starts, k in own], axis=1)
    inward = -np.stack([starts.normals[k] for starts, k in own], axis=1)
    whole = hold((points, inward), np.zeros((1, 6)), np.zeros((1, 3)), rules=rules)  # which never gives up
    poses, holds = followed(lengths, numbers), whole.misses < BALANCED
    assert together.holding(rows).tolist() == rows[holds].tolist()
    good = holds & (poses > 0)
    bound = way[poses[good] - 1] - 0.01 * together.used[rows[good]]
    order = np.argsort(-bound, kind="stable")
    found = [first, *ranked]
    assert np.concatenate([each.rows for each in found]).tolist() == rows[good][order].tolist()
    assert np.concatenate([each.lengths for each in found]).tolist() == poses[good][order].tolist()
    for wanted in np.vstack([2 * np.eye(3), -2 * np.eye(3)]):
        whole = hold((points, inward), np.append(wanted, np.zeros(3))[None], np.zeros((1, 3)), rules=rules)
        forces = wanted[None, None, None], rules
        reached, _ = follow_tuples(together.how[0], numbers, np.ones(len(rows), dtype=np.int64), forces, 1)
        assert reached.tolist() == (whole.misses < BALANCED).tolist()
