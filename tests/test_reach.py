"""Reach: laws of the limits, and of the cells and pairs that they are made of."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brute_contacts import nearest_contact
from inhand.errors import InputError
from inhand.geometry import Array, transform, wrap_angle
from inhand.hands.force_closure import force_closure
from inhand.hands.hand import HandSpec, lab_limits
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import ObjectSpec, convex_pieces, parse_object_name, polygon
from inhand.hands.polygons import edge_normals, separation
from inhand.hands.reach import limits as reach_limits
from inhand.hands.reach.bundles import cells, knots
from inhand.hands.reach.fingers import touching_postures
from inhand.hands.reach.limits import Farthest, Place, ReachConfig, body_of, farthest, scene_of, why_none
from inhand.hands.reach.pairs import grips_of, neighbours, room_for_pairs
from inhand.hands.reach.parts import Chain, Grips, Postures, Sides, Step, chain_of
from inhand.hands.reach.rooms import Rooms
from inhand.hands.shapes import link_outline, link_polygons, palm_outline
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import parse_directions
from inhand.tasks.reach import limits

HAND = "2v2_50.50_50.50_1.1_53"
UNEVEN = "2v2_70.30_50.50_0.9.1_53"
THREE = "3v3_25.40.35_40.35.25_1.1_63"
MIXED = "2v3_25.75_25.35.40_1.1_53"
TOUCHING = 5e-5
"""Gap or overlap that the interpolation between places leaves [m]."""


def path_along(hand: HandSpec, direction: str) -> Array:
    (primitive,) = parse_directions(direction)
    return hand.start_pose + straight_path(primitive, 0.25).poses


def reach(hand: HandSpec, name: str, direction: str, config: ReachConfig | None = None) -> Farthest:
    found = farthest(hand, parse_object_name(name), path_along(hand, direction), config)
    assert found is not None
    return found


@cache
def way(hand_name: str, name: str, direction: str, config: ReachConfig | None = None) -> float:
    return reach(parse_hand_name(hand_name), name, direction, config).way


def mirrored_name(name: str) -> str:
    kind, left, right, ratio, width = name.split("_")
    ratios = {"1.1": "1.1", "0.9.1": "1.0.9"}
    return "_".join([f"{kind[-1]}v{kind[0]}", right, left, ratios[ratio], width])


@pytest.mark.parametrize("pair", [("Out-Right", "Out-Left"), ("Right'", "In'-Left'"), ("In-Right", "In-Left")])
def test_a_symmetric_hand_reaches_as_far_to_the_left_as_to_the_right(pair: tuple[str, str]) -> None:
    assert way(HAND, "cube_39", pair[0]) == pytest.approx(way(HAND, "cube_39", pair[1]), abs=5e-4)


@pytest.mark.parametrize("pair", [("Out", "Out"), ("Right", "Left"), ("Out'-Left'", "Out'"), ("In-Left", "In-Right")])
def test_a_mirrored_hand_reaches_mirrored(pair: tuple[str, str]) -> None:
    assert way(UNEVEN, "cube_39", pair[0]) == pytest.approx(way(mirrored_name(UNEVEN), "cube_39", pair[1]), abs=5e-4)


def test_a_symmetric_hand_turns_as_far_one_way_as_the_other() -> None:
    turned = [reach(parse_hand_name(HAND), "cube_39", word).pose[2] for word in ("cw", "ccw")]
    assert turned[0] < -0.5 < 0.5 < turned[1]
    assert turned[0] == pytest.approx(-turned[1], abs=0.05)


@pytest.mark.parametrize("direction", ["Out", "Right'", "In-Left", "ccw"])
def test_more_friction_never_reaches_less_far(direction: str) -> None:
    ways = [way(HAND, "cube_39", direction, ReachConfig(0.004, friction=mu)) for mu in (0.3, 0.45, 0.6, 0.9)]
    assert (np.diff(ways) >= -1e-3).all()
    assert ways[-1] > ways[0] + 1e-3


@pytest.mark.parametrize("direction", ["Right", "Left", "In'-Right'"])
def test_tighter_joint_limits_never_reach_farther(direction: str) -> None:
    limited = lab_limits(parse_hand_name(HAND))
    tight = replace(limited, left=replace(limited.left, limits=((-0.5, 0.5), (-1.0, 0.0))))
    config = ReachConfig(0.004)
    ways = [reach(hand, "cube_39", direction, config).way for hand in (tight, limited, parse_hand_name(HAND))]
    assert ways[0] <= ways[1] + 1e-3
    assert ways[1] <= ways[2] + 1e-3
    assert ways[0] < ways[2] - 1e-3


@pytest.mark.parametrize("direction", ["Out", "Right", "In-Right", "Left'"])
def test_finer_resolution_converges(direction: str) -> None:
    ways = [way(HAND, "cube_39", direction, ReachConfig(mm / 1e3)) for mm in (4, 2, 1)]
    assert abs(ways[1] - ways[2]) <= 1e-3
    assert abs(ways[0] - ways[2]) <= 2e-3


@pytest.mark.parametrize("direction", ["Out", "Right"])
def test_freedom_to_rotate_never_reaches_less_far(direction: str) -> None:
    ways = [way(HAND, "cube_39", direction, ReachConfig(0.004, rotation=np.deg2rad(bound))) for bound in (0, 10)]
    assert ways[1] >= ways[0] - 1e-3
    free = reach(parse_hand_name(HAND), "cube_39", direction, ReachConfig(0.004, rotation=np.deg2rad(10)))
    assert abs(free.pose[2]) <= np.deg2rad(10) + 1e-9


def normals_at(spec: ObjectSpec, point: Array) -> Array:
    """Return the angles of the outward normals of the faces that a point is on [rad], that of lower angle first."""
    corners = polygon(spec)
    normals = edge_normals(corners)
    after = np.roll(corners, -1, axis=0)
    along = after - corners
    share = np.clip(((point - corners) * along).sum(-1) / (along**2).sum(-1), 0, 1)
    distance = np.linalg.norm(corners + share[:, None] * along - point, axis=-1)
    assert distance.min() < TOUCHING
    return np.asarray(normals[distance < distance.min() + 1e-6])


@pytest.mark.parametrize(
    ("hand_name", "name", "direction"),
    [
        (HAND, "cube_39", "Out"),
        (HAND, "cube_39", "In-Right"),
        (HAND, "cylinder_40", "Left'"),
        (HAND, "hourglass", "Right"),
        (HAND, "hourglass", "Out-Left"),
        (UNEVEN, "cube_39", "In"),
        (THREE, "cube_39", "Right"),
        (MIXED, "triangle", "Out"),
        (HAND + ":lab-limits", "cube_39", "Left"),
    ],
)
def test_the_last_grip_is_one(hand_name: str, name: str, direction: str) -> None:
    hand, spec = parse_hand_name(hand_name), parse_object_name(name)
    found = reach(hand, name, direction, ReachConfig(0.004))
    assert found.way > 0.02
    pieces = [transform(found.pose, piece) for piece in convex_pieces(spec)]
    palm = palm_outline(hand)
    low, high = hand.limits.T
    assert ((found.joints >= low) & (found.joints <= high)).all()
    links = [
        link_polygons(hand, finger, found.joints[place])
        for finger, place in zip(hand.fingers, hand.slices, strict=True)
    ]
    for point, side in zip(transform(found.pose, found.contacts), links, strict=True):
        gaps = [nearest_contact(link, pieces)[0] for link in side]
        assert min(gaps) > -TOUCHING
        dot = point + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * 1e-6
        assert min(abs(separation(link, dot)) for link in side) < TOUCHING
        assert all(separation(link, palm) > -TOUCHING for link in side[1:])
    assert all(separation(ours, theirs) > -TOUCHING for ours in links[0] for theirs in links[1])
    assert all(separation(piece, palm) > -TOUCHING for piece in pieces)
    assert _holds(spec, hand.friction * spec.friction, found.contacts)


def _holds(spec: ObjectSpec, friction: float, contacts: Array) -> bool:
    """Return whether contacts `(2, 2)` hold with some normals between those of the faces that they are on."""
    sides = []
    for point in contacts:
        normals = normals_at(spec, point)
        share = np.linspace(0, 1, 200)[:, None]
        fan = share * normals[0] + (1 - share) * normals[-1]
        sides.append(fan / np.linalg.norm(fan, axis=-1, keepdims=True))
    held = force_closure(friction * 1.02, (contacts[0], sides[0][:, None]), (contacts[1], sides[1]))
    return bool(held.any())


def test_a_three_link_hand_reaches_in_every_direction() -> None:
    config = ReachConfig(0.004)
    assert all(way(THREE, "cube_39", word, config) > 0.03 for word in ("Out", "In-Left", "Right"))


def test_nothing_holds_where_friction_is_too_small() -> None:
    hand, triangle = parse_hand_name(HAND), parse_object_name("triangle")
    config = ReachConfig(friction=0.01)
    path = path_along(hand, "Out")
    assert farthest(hand, triangle, path, config) is None
    assert (
        why_none(hand, triangle, path[:1], config)
        == "no two reachable points have their line inside both friction cones"
    )
    assert farthest(hand, triangle, path, ReachConfig(friction=0.0)) is None


def test_nothing_holds_out_of_reach_or_inside_the_palm() -> None:
    hand, cube = parse_hand_name(HAND), parse_object_name("cube_39")
    far = path_along(hand, "Out") + np.array([0.0, 0.3, 0.0])
    assert farthest(hand, cube, far) is None
    assert why_none(hand, cube, far[:1]) == "the left finger reaches no point of it within its joint limits"
    inside = path_along(hand, "Out") - np.array([0.0, hand.start_position[1], 0.0])
    assert farthest(hand, cube, inside) is None


def test_a_short_path_is_reached_to_its_end() -> None:
    hand = parse_hand_name(HAND)
    path = path_along(hand, "Out")[:22]
    found = farthest(hand, parse_object_name("cube_39"), path)
    assert found is not None
    assert found.way == pytest.approx(0.021)
    assert found.pose == pytest.approx(path[-1])


@pytest.mark.parametrize(
    ("config", "text"),
    [
        ({"resolution": 0.05}, "resolution 50 mm: give 0.5 to 10 mm"),
        ({"resolution": 0.0004}, "resolution 0.4 mm: give 0.5 to 10 mm; all directions at the finest take about 8 s"),
        ({"resolution": np.nan}, "resolution nan mm: give 0.5 to 10 mm"),
        ({"friction": -0.1}, "friction -0.1: a coefficient of friction is 0 or more"),
        ({"rotation": 2.0}, "rotation bound 114.592 deg: give 0 to 90 deg"),
    ],
)
def test_impossible_settings_are_refused(config: dict[str, float], text: str) -> None:
    with pytest.raises(InputError, match=text):
        ReachConfig(**config)


outlines = st.sampled_from(
    ["cube_39", "rectangle_46x15", "cylinder_40", "triangle", "teardrop", "pentagon", "trapezoid"]
)
spacings = st.floats(0.0005, 0.02)
fans = st.floats(0.02, 1.0)


@settings(max_examples=40, deadline=None)
@given(outlines | st.sampled_from(["hourglass", "concave_square"]), spacings, fans)
def test_cells_cover_the_outline_evenly(name: str, spacing: float, fan: float) -> None:
    corners = polygon(parse_object_name(name))
    found = cells(corners, spacing, fan)
    after = np.roll(corners, -1, axis=0)
    for start, end in zip(corners, after, strict=True):
        length = np.linalg.norm(end - start)
        along = (found.points - start) @ (end - start) / length
        across = np.linalg.norm(found.points - start - along[:, None] * (end - start) / length, axis=-1)
        on = np.sort(along[(across < 1e-9) & (along > 1e-9) & (along < length - 1e-9)])
        bounds = np.concatenate([[0], (on[1:] + on[:-1]) / 2, [length]])
        assert np.diff(bounds) == pytest.approx(length / len(on))
        assert length / len(on) <= spacing + 1e-9
    turns = wrap_angle(np.diff(found.angles, append=found.angles[:1]))
    convex = len(convex_pieces(parse_object_name(name))) == 1
    assert turns.sum() == pytest.approx(2 * np.pi)
    assert not convex or ((turns >= -1e-9).all() and (turns <= fan + 1e-9).all())


@settings(max_examples=40, deadline=None)
@given(outlines, spacings, fans)
def test_knots_bracket_every_cell(name: str, spacing: float, fan: float) -> None:
    corners = polygon(parse_object_name(name))
    found, inner = knots(corners, spacing, fan), cells(corners, spacing, fan)
    assert found.points[-1] == pytest.approx(found.points[0])
    assert found.angles[-1] == pytest.approx(found.angles[0] + 2 * np.pi)
    steps, turns = np.linalg.norm(np.diff(found.points, axis=0), axis=-1), np.diff(found.angles)
    assert (turns >= -1e-9).all()
    assert (steps <= spacing + 1e-9).all()
    assert (turns <= fan + 1e-9).all()
    # Between neighbours either the point or the normal stays, and every cell lies between two neighbours.
    assert ((steps < 1e-9) | (turns < 1e-9)).all()
    for point, angle in zip(inner.points, inner.angles, strict=True):
        detour = np.linalg.norm(found.points[:-1] - point, axis=-1) + np.linalg.norm(found.points[1:] - point, axis=-1)
        start = wrap_angle(angle - found.angles[:-1] + 1e-9)
        between = (detour <= steps + 1e-9) & (start >= 0) & (start <= turns + 2e-9)
        assert between.any()


@pytest.mark.parametrize("name", ["cube_39", "cylinder_40", "hourglass"])
@pytest.mark.parametrize("hand_name", [HAND, MIXED])
def test_touching_postures_touch(hand_name: str, name: str) -> None:
    hand, spec = parse_hand_name(hand_name), parse_object_name(name)
    body = body_of(spec, 0.002, np.deg2rad(7.5))
    pose = np.array([0.01, hand.start_position[1] - 0.01, 0.2])
    for finger in hand.fingers:
        found = touching_postures(hand, finger, body, pose[None])
        assert len(np.unique(found.cell)) > 20
        links = link_polygons(hand, finger, found.joints)
        pieces = [transform(pose, piece) for piece in body.pieces]
        gaps = np.stack([nearest_contact(link, pieces)[0] for link in links])
        assert (gaps.min(axis=0) > -TOUCHING).all()
        points = transform(pose, found.points)
        dots = points[:, None] + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * 1e-6
        assert (np.abs(np.stack([separation(link, dots) for link in links])).min(axis=0) < TOUCHING).all()


def postures(points: Array, normals: Array, fixed: Array) -> Postures:
    count = len(points)
    return Postures(np.zeros(count, dtype=np.int64), np.arange(count), np.nan_to_num(fixed), fixed, points, normals)


def straight_fingers() -> tuple[Chain, Chain]:
    """Return two fingers that do not meet where all joints are at zero."""
    hand = parse_hand_name(HAND)
    return chain_of(hand, hand.left), chain_of(hand, hand.right)


def grips_among(sides: Sides, cone: float, n_cells: int, before: Grips | None = None) -> Grips | None:
    """Return the grips of straight fingers' postures that slides connect, with those before where they are, or all."""
    room = room_for_pairs(sides, 64, n_cells)
    return grips_of(room, sides, straight_fingers(), Step(cone, 0, n_cells, n_cells), before)


def test_grips_of_fingers_that_keep_apart_are_those_of_force_closure() -> None:
    rng = np.random.default_rng(0)
    sides = []
    for count in (30, 40):
        normals = rng.normal(size=(count, 2))
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        sides.append(postures(0.03 * rng.normal(size=(count, 2)), normals, np.zeros((count, 2))))
    left, right = sides
    for friction in (0.3, 1.0):
        expected = force_closure(friction, (left.points[:, None], left.normals[:, None]), (right.points, right.normals))
        found = grips_among((left, right), np.cos(np.arctan(friction)), 40)
        assert found is not None
        assert (found.sides[0].cell == np.flatnonzero(expected.any(axis=1))).all()
        assert (found.held == expected[expected.any(axis=1)][:, expected.any(axis=0)]).all()


def test_pairs_of_fingers_that_meet_are_no_grips() -> None:
    hand = parse_hand_name(HAND)
    bent = np.linspace(0.0, 0.5, 16)
    facing = np.tile([-1.0, 0.0], (16, 1))
    left, right = (
        postures(sign * 0.02 * facing, sign * facing, np.stack([0 * bent, sign * bent], axis=-1)) for sign in (1, -1)
    )
    left, right = (side._replace(joints=-side.joints) for side in (left, right))
    found = grips_among((left, right), 0.5, 16)
    assert found is not None
    held = np.zeros((16, 16), dtype=bool)
    held[np.ix_(*(side.cell for side in found.sides))] = found.held
    links = [link_polygons(hand, finger, side.joints) for finger, side in zip(hand.fingers, (left, right), strict=True)]
    gaps = np.stack([separation(ours[:, None], theirs) for ours in links[0] for theirs in links[1]]).min(axis=0)
    assert (held == (gaps > -2e-5)).all()
    assert 0.2 < (gaps > 0).mean() < 0.8


def test_neighbours_are_next_cells_with_joints_nearly_alike() -> None:
    fixed = np.array([[0.0, 0.0], [0.1, 0.1], [0.2, 0.9], [0.1, 0.1], [0.1, 0.1]])
    each = postures(np.zeros((5, 2)), np.zeros((5, 2)), fixed)
    found = neighbours(each, each, n_cells=5)
    assert found.astype(int).tolist() == [
        [1, 1, 0, 0, 1],
        [1, 1, 0, 0, 0],
        [0, 0, 1, 0, 0],
        [0, 0, 0, 1, 1],
        [1, 0, 0, 1, 1],
    ]


def test_contacts_of_the_first_link_leap() -> None:
    fixed = np.array([[0.0, np.nan], [0.1, 0.1], [0.2, 0.9], [0.1, np.nan], [0.9, np.nan], [0.0, 0.0]])
    each = postures(np.zeros((6, 2)), np.zeros((6, 2)), fixed)
    found = neighbours(each, each, n_cells=6)
    assert found[0].tolist() == [True, True, False, True, False, True]


def test_slides_connect_grips_beside_each_other() -> None:
    facing = np.tile([-1.0, 0.0], (4, 1))
    fixed = np.array([0.0, 0.2, 0.6, 0.7])[:, None].repeat(2, axis=1)  # from the second to the third is a leap
    left, right = postures(0.02 * facing, facing, fixed), postures(-0.02 * facing, -facing, np.zeros((4, 2)))
    right.normals[2] *= -1  # no grip, and none beyond
    before = Grips((left.only(slice(1)), right.only(slice(1))), np.ones((1, 1), dtype=bool))
    found = grips_among((left, right), 0.9, 9, before)
    assert found is not None
    assert [side.cell.tolist() for side in found.sides] == [[0, 1], [0, 1]]
    assert found.held.all()


def test_a_link_outline_keeps_its_shape_in_places() -> None:
    hand = parse_hand_name(HAND)
    shape = link_outline(hand, hand.left, 1)
    found = knots(shape, 0.004, np.deg2rad(6.0))
    assert np.isin(shape.round(9), found.points.round(9)).all()


def test_a_contact_of_the_first_link_counts_for_its_cell_and_both_beside_it() -> None:
    hand, body = parse_hand_name(HAND), body_of(parse_object_name("cube_39"), 0.002, np.deg2rad(7.5))
    pose = np.array([[-0.02, 0.05, 0.3]])
    found = touching_postures(hand, hand.left, body, pose)
    first = found.only(np.flatnonzero(np.isnan(found.fixed[:, 1])))
    assert len(first.cell) >= 3
    for joint in np.unique(first.fixed[:, 0]):
        cells = np.unique(first.cell[first.fixed[:, 0] == joint])
        assert len(cells) == 3
        assert sorted(np.diff(cells)) in ([1, 1], [1, len(body.cells) - 2])


@pytest.mark.parametrize("direction", ["Out-Right", "In-Right"])
def test_freedom_to_rotate_is_worth_as_much_on_either_side(direction: str) -> None:
    config = ReachConfig(resolution=0.005, rotation=0.3)
    assert way(HAND, "rectangle_46x15", direction, config) == pytest.approx(
        way(HAND, "rectangle_46x15", direction.replace("Right", "Left"), config), abs=2e-3
    )


def test_grips_are_looked_for_near_those_before_and_none_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    hand = parse_hand_name(HAND)
    scene = scene_of(hand, parse_object_name("triangle"), ReachConfig())
    everywhere = np.ones(len(scene.body.cells), dtype=bool)
    place = Place(scene, Rooms(scene.touchers, len(everywhere)), hand.start_pose[None], everywhere[:1])
    every = place.grips(0, None)
    assert every is not None
    one, other = (int(rows[0]) for rows in np.nonzero(every.held))
    first = Grips(
        (every.sides[0].only(slice(one, one + 1)), every.sides[1].only(slice(other, other + 1))), everywhere[None, :1]
    )
    found = []
    for ahead in (0, 1000):  # cell by cell, and all at once
        monkeypatch.setattr(reach_limits, "AHEAD", ahead)
        found.append(place.grips(0, first))
    near, far = found
    assert near is not None
    assert far is not None
    assert near.held.sum() > 100
    assert (near.held == far.held).all()
    assert all((ours.joints == theirs.joints).all() for ours, theirs in zip(near.sides, far.sides, strict=True))


def test_a_limit_is_known_again_by_what_it_depends_on_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("INHAND_CACHE", str(tmp_path))
    hand, cube, out, computed = parse_hand_name(HAND), parse_object_name("cube_39"), parse_directions("Out"), []
    known = limits(hand, cube, out)
    monkeypatch.setattr("inhand.tasks.reach.farthest", lambda *given: computed.append(given))
    heavier = replace(hand, name="another", link_mass=0.1, torque=1.0), replace(cube, name="the same", mass=0.1)
    smoother = replace(hand, friction=hand.friction / 2), replace(cube, friction=2 * cube.friction)
    for held in (heavier, smoother):
        assert limits(*held, out)[0].distance == known[0].distance
    assert limits(replace(hand, friction=0.1), cube, out, ReachConfig(friction=0.5))[0].distance == known[0].distance
    assert not computed
    for other in (replace(hand, link_width=0.021), replace(hand, friction=0.4), replace(hand, tip_length=0.007)):
        with pytest.raises(InputError, match="no start grasp"):  # nothing is computed here, so that no grip is found
            limits(other, cube, out)
    assert len(computed) == 3
