"""Reach in space against brute force, its laws, and `inhand reach` with a hand in space."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

import inhand
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.farthest import SpatialReachConfig, farthest_in_space
from inhand.hands.spatial.fit import check_solid_fit
from inhand.hands.spatial.forces import GripRules
from inhand.hands.spatial.grasp_search import Explored, SpatialSearchConfig, explore, rules_for
from inhand.hands.spatial.gravity import gravity_of
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.meshes import solid_of
from inhand.hands.spatial.names import STANDARD, parse_spatial_name
from inhand.hands.spatial.objects import SolidSpec, parse_solid_name
from inhand.hands.spatial.rolling import NONE
from inhand.hands.spatial.start_tuples import held_together
from inhand.repeats import read_repeat
from inhand.rotations import placed, seen_from
from inhand.tasks.spatial.paths import spatial_path_of
from inhand.tasks.spatial.primitives import parse_spatial_directions
from page_reader import Read

HAND, CUBE = parse_spatial_name(STANDARD), parse_solid_name("cube_50")
UP = np.array([gravity_of("up")])
COARSE = SpatialReachConfig(spacing=0.02, step=0.006, turn=np.deg2rad(9.0))


def way_to(hand: SpatialHand, spec: SolidSpec, words: str, config: SpatialReachConfig = COARSE) -> list[float]:
    paths = [spatial_path_of(each) for each in parse_spatial_directions(words)]
    ends = farthest_in_space((hand, spec), paths, UP, config)
    return [0.0 if end is None else end.way for end in ends]


def explored(word: str, friction: float) -> tuple[list[Explored], Array]:
    """Return all tuples of contacts followed along a path, fixed on the object, and their contacts."""
    spec = replace(CUBE, friction=friction)
    config = SpatialSearchConfig(0.025, 0.004, np.deg2rad(6.0), margins=NONE, share=1.0, cost=0.0, most=10**6, every=1)
    rules = rules_for((HAND, spec), GripRules(rounds=300), 1.0)
    together = held_together((HAND, spec), HAND.start_pose, config.spacing, NONE, rules)
    path = spatial_path_of(parse_spatial_directions(word)[0])
    asked = (HAND.start_pose, path, UP)
    return list(explore((HAND, spec), asked, together, (config, rules, True), lambda _: False)), np.array([friction])


def balances(points: Array, inward: Array, weight: Array, friction: float) -> bool:
    """Return whether forces inside cones of 24 sides give a force and no moment, by linear programming."""
    columns = []
    for point, normal in zip(points, inward, strict=True):
        side = np.cross(normal, [1.0, 0, 0] if abs(normal[0]) < 0.7 else [0, 1.0, 0])
        side /= np.linalg.norm(side)
        for angle in np.arange(24) * np.pi / 12:
            force = normal + friction * (np.cos(angle) * side + np.sin(angle) * np.cross(normal, side))
            columns.append(np.append(force, np.cross(point, force) / 0.03))
    least = [np.repeat(np.arange(len(points)) == k, 24) * -1.0 for k in range(len(points))]
    wanted = np.append(weight, np.zeros(3))
    found = linprog(np.ones(len(columns)), np.array(least), np.full(len(least), -0.5), np.array(columns).T, wanted)
    return bool(found.status == 0)


def apart(hand: SpatialHand, joints: Array) -> bool:
    """Return whether fingers do not meet, by spheres along their links."""
    bodies = kinematics.bodies_of(hand, joints[None], 3)[0]
    shares = np.linspace(0, 1, 60)[:, None, None, None]
    points = (1 - shares) * bodies[None, :, :, :3] + shares * bodies[None, :, :, 3:6]
    for i in range(len(bodies)):
        for j in range(i):
            gap = np.linalg.norm(points[:, None, i, :, None] - points[None, :, j, None, :], axis=-1)
            if (gap - bodies[i, :, 6][:, None] - bodies[j, :, 6][None] < -1e-4).any():
                return False
    return True


def held_by_brute_force(contacts: tuple[Array, Array], joints: Array, poses: Array, friction: float) -> int:
    """Return how many poses fixed contacts hold: inverse kinematics near the last joints, spheres, linear programs."""
    points, normals = contacts
    for count, pose in enumerate(poses):
        goals = placed(pose, points + HAND.fingers[0].tip_radius * normals)
        new = joints.copy()
        for f, own in enumerate(HAND.slices):
            found, missed = kinematics.inverse(HAND.fingers[f], goals[f][None], joints[own][None])
            new[own] = found[0, 0]
            if missed[0, 0] > 4e-4 or np.abs(new[own] - joints[own]).max() > 0.6:
                return count
        joints = new
        told = kinematics.measure(HAND, CUBE, joints[None], pose[None])
        inner = np.delete(told.link_gaps[0], [2, 5, 8])  # the last links' own bodies are looked at as spheres
        bodies = kinematics.bodies_of(HAND, joints[None], 3)[0]
        shares = np.linspace(0, 1, 60)[:, None, None]
        points_on = (1 - shares) * bodies[None, :, 1, :3] + shares * bodies[None, :, 1, 3:6]
        over = np.abs(seen_from(pose, points_on)) - np.array(CUBE.half)
        outside = np.linalg.norm(np.maximum(over, 0), axis=-1) + np.minimum(over.max(axis=-1), 0)
        weight = seen_from(np.append(np.zeros(3), pose[3:]), -CUBE.mass * UP[0])
        if inner.min() < -1e-4 or outside.min() < bodies[0, 1, 6] - 1e-4 or not apart(HAND, joints):
            return count
        if pose[2] < HAND.palm.top or not balances(points, -normals, weight, friction):
            return count
    return len(poses)


@pytest.mark.parametrize(("word", "friction"), [("Up", 0.9), ("In-Right-Down", 0.6), ("turn+z", 0.9)])
def test_tuples_hold_as_long_as_brute_force_says(word: str, friction: float) -> None:
    blocks, _ = explored(word, friction)
    rng, wrong = np.random.default_rng(0), 0
    for _ in range(4):
        block = blocks[rng.integers(len(blocks))]
        t = rng.integers(len(block.numbers))
        own = list(zip(block.tracks, block.numbers[t], strict=True))
        contacts = (
            np.stack([track.points[k, 0] for track, k in own]),
            np.stack([track.normals[k, 0] for track, k in own]),
        )
        joints = np.concatenate([track.joints[k, 0] for track, k in own])
        found = held_by_brute_force(contacts, joints, block.poses, HAND.friction * friction)
        assert abs(found - block.reached[t]) <= 1
        wrong += found != block.reached[t]
    assert wrong <= 1  # those at the very edge of a limit


def test_no_tuple_goes_farther_than_the_limit() -> None:
    blocks, friction = explored("Up", 1.0)
    best = max(float(block.values.max()) for block in blocks)
    spec = replace(CUBE, friction=float(friction[0]))
    config = SpatialReachConfig(0.025, 0.004, np.deg2rad(6.0))
    (limit,) = way_to(HAND, spec, "Up", config)
    assert limit >= best - 1e-9
    assert limit > 0.03


def test_directions_that_mirror_each_other_have_one_limit() -> None:
    left, right, ccw, cw = way_to(HAND, CUBE, "Out-Left-Up,Out-Right-Up,turn+z,turn-z")
    assert left == pytest.approx(right, abs=1e-9)
    assert ccw == pytest.approx(cw, abs=1e-9)
    assert min(left, ccw) > 0.02


def test_a_hand_of_four_alike_goes_as_far_in_four_directions() -> None:
    ways = way_to(parse_spatial_name("4f_60.60_40_10"), CUBE, "Out,Left,In,Right")
    np.testing.assert_allclose(ways, ways[0], atol=COARSE.step + 1e-9)
    assert min(ways) > 0.02


def test_more_friction_and_more_joint_range_reach_no_less() -> None:
    words = "Up,Right,turn+z"
    ways = np.array([way_to(HAND, replace(CUBE, friction=friction), words) for friction in (0.25, 0.5, 1.0)])
    assert (np.diff(ways, axis=0) >= -1e-9).all()
    assert (ways[0] < ways[2]).any()
    fingers = tuple(
        replace(
            finger,
            links=tuple(replace(link, limits=(0.5 * link.limits[0], 0.6 * link.limits[1])) for link in finger.links),
        )
        for finger in HAND.fingers
    )
    narrow = np.array(way_to(replace(HAND, fingers=fingers), CUBE, words))
    assert (narrow <= ways[2] + COARSE.step).all()
    assert (narrow < ways[2] - COARSE.step).any()


def test_reach_is_written_and_loaded(tmp_path: Path) -> None:
    found = inhand.reach(
        replace(HAND, name="mine"),
        replace(CUBE, name="my_cube"),
        directions="Up,turn+z,Out@+x@15",
        resolution_mm=6,
        gravity="sideways",
    )
    folder = found.save(tmp_path / "reach")
    rows = {row["direction"]: row for row in json.loads((folder / "reach.json").read_text())["limits"]}
    assert rows["Up"]["limit_mm"] > 30
    assert rows["Up"]["limit_mm"] == pytest.approx(rows["Up"]["end_pose"][2] * 1e3 - 85)
    assert rows["turn+z"]["limit_mm"] is None
    assert rows["turn+z"]["limit_deg"] > 60
    assert rows["Out@+x@15"]["limit_mm"] == pytest.approx(rows["Out@+x@15"]["way_mm"] - 25 * np.deg2rad(15), abs=0.1)
    assert len(rows["Up"]["end_joints_deg"]) == 9
    assert np.shape(rows["Up"]["end_contacts_mm"]) == (3, 3)
    assert (folder / "reach.png").stat().st_size > 10_000
    assert read_repeat(folder / "run.toml")["gravity"] == "sideways"
    assert (folder / "limits.csv").read_text().count("\n") == 4
    views = Read((folder / "report.html").read_text()).views()
    assert [dot["name"] for dot in views["maps"]["discs"][0]["dots"]] == ["Up", "Out@+x@15"]
    found.draw(tmp_path)
    assert (tmp_path / "figures" / "reach.png").is_file()
    again = inhand.load(folder)
    assert again.table().equals(found.table()) or np.allclose(
        again.table()["limit_mm"].dropna(), found.table()["limit_mm"].dropna()
    )


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"gravity": "0,0,0"}, "has no length"),
        ({"directions": "0:0:0"}, "has no length"),
        ({"object": "cube_200"}, "reaches into the palm, which leaves .* the largest box of this form that fits is"),
        ({"object": "cylinder_300x20"}, "does not fit into hand"),
        ({"friction": 0.0, "directions": "Up", "resolution_mm": 6}, "no start grasp holds object 'cube_50' of 50 g"),
        ({"rotation_deg": 5.0}, "a bound on rotation is of the plane"),
        ({"resolution_mm": 0.1}, "give 0.5 or more"),
        ({"object": "cylinder_40"}, "a cylinder in space has 2"),
    ],
)
def test_what_cannot_be_computed_is_refused(settings: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        inhand.reach(STANDARD, **({"object": "cube_50"} | settings))  # every keyword is one of `reach`


def test_a_run_refuses_what_does_not_fit() -> None:
    with pytest.raises(InputError, match="object 'cube_200' does not fit into hand"):
        inhand.asterisk(STANDARD, "cube_200")


def test_gravity_is_of_hands_in_space() -> None:
    with pytest.raises(InputError, match="a hand in the plane, whose object stands on a floor"):
        inhand.reach(gravity="up")


def test_the_largest_object_fits() -> None:
    huge = solid_of("block", np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.12)
    for spec in (parse_solid_name("sphere_200"), huge):
        with pytest.raises(InputError, match=r"the largest .* that fits is \d+ x") as error:
            check_solid_fit(HAND, spec)
        side = float(str(error.value).rpartition("is ")[2].split(" x")[0])
        assert 60 < side < 180
    check_solid_fit(HAND, parse_solid_name("sphere_60"))
