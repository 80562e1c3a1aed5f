"""Hands: the laboratory's names, the catalogue, what is refused, and what a hand does in the simulator."""

import re
from dataclasses import FrozenInstanceError, fields, replace
from typing import Any

import mujoco
import numpy as np
import pytest

from inhand.errors import InputError, near_matches, needs_extra
from inhand.geometry import Array
from inhand.hands.hand import FINGER_NAMES, HandSpec, build_hand, lab_limits
from inhand.hands.names import CATALOGUE, FINGER_LENGTH, parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.hands.objects import ObjectSpec
from inhand.hands.touch import touch
from inhand.sim.model import build_model
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.scene import SceneSpec
from pairs import every_fourth_pair

STANDARD = "2v2_50.50_50.50_1.1_53"
STANDARD_HAND = parse_hand_name(STANDARD)
START = np.array(STANDARD_HAND.start_position)
CUBE = OBJECTS["cube_39"]


@pytest.mark.parametrize(
    ("name", "left", "right", "width"),
    [
        (STANDARD, (72, 72), (72, 72), 53.5),
        ("2v2_65.35_65.35_1.1_53", (93.6, 50.4), (93.6, 50.4), 53.5),
        ("2v2_70.30_50.50_0.9.1_53", (90.72, 38.88), (72, 72), 53.5),
        ("2v2_50.50_70.30_1.0.9_53", (72, 72), (90.72, 38.88), 53.5),
        ("2v2_35.65_50.50_1.1_63", (50.4, 93.6), (72, 72), 63),
        ("2v3_25.75_25.35.40_1.1_53", (36, 108), (36, 50.4, 57.6), 53.5),
        ("3v2_25.35.40_25.75_1.1_72.5", (36, 50.4, 57.6), (36, 108), 72.5),
        ("3v3_25.40.35_40.35.25_1.1_63", (36, 57.6, 50.4), (57.6, 50.4, 36), 63),
        ("2v2_50.50_50.50_0.85.0.7_53", (61.2, 61.2), (50.4, 50.4), 53.5),
    ],
)
def test_a_name_says_links_and_palm(name: str, left: tuple[float, ...], right: tuple[float, ...], width: float) -> None:
    hand = parse_hand_name(name)
    assert hand.name == name
    np.testing.assert_allclose(hand.left.links, np.array(left) / 1e3)
    np.testing.assert_allclose(hand.right.links, np.array(right) / 1e3)
    np.testing.assert_allclose(hand.palm_width, width / 1e3)
    np.testing.assert_allclose([hand.left.base, hand.right.base], [(-width / 2e3, 0), (width / 2e3, 0)])


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_catalogue_hand_is_sound(name: str) -> None:
    hand = parse_hand_name(name)
    assert hand.n_joints == len(hand.left.links) + len(hand.right.links) == len(hand.limits)
    places = np.concatenate([np.arange(hand.n_joints)[place] for place in hand.slices])
    np.testing.assert_array_equal(places, np.arange(hand.n_joints))
    np.testing.assert_allclose(hand.limits, np.tile([-np.pi, np.pi], (hand.n_joints, 1)))
    assert (hand.left.bend, hand.right.bend) == (-1, 1)
    assert max(hand.left.length, hand.right.length) == pytest.approx(FINGER_LENGTH)
    np.testing.assert_allclose(hand.start_position, (0, 0.65 * hand.finger_length))


def test_the_standard_hand_has_the_laboratory_numbers() -> None:
    hand = parse_hand_name(STANDARD)
    np.testing.assert_allclose(hand.start_position, (0, 0.0936))
    assert (hand.palm_depth, hand.link_width, hand.thickness) == (0.053, 0.022, 0.032)
    assert (hand.joint_gap, hand.tip_length, hand.link_mass) == (0.005, 0.0075, 0.036)
    assert hand.friction == 0.5
    assert 0.3 <= hand.torque <= 0.4


def test_a_hand_is_frozen() -> None:
    hand = parse_hand_name(STANDARD)
    for field in fields(hand):
        with pytest.raises(FrozenInstanceError):
            setattr(hand, field.name, None)
    assert hash(hand) == hash(parse_hand_name(STANDARD))


def test_laboratory_limits_mirror_the_fingers() -> None:
    hand = parse_hand_name("2v3_25.75_25.35.40_1.1_53:lab-limits")
    assert hand.name == "2v3_25.75_25.35.40_1.1_53:lab-limits"
    assert hand.left.limits == ((-1.57, 1.57), (-2.09, 0.0))
    assert hand.right.limits == ((-1.57, 1.57), (0.0, 2.09), (0.0, 2.09))
    plain = parse_hand_name("2v3_25.75_25.35.40_1.1_53")
    assert replace(lab_limits(plain), name=hand.name) == hand


@pytest.mark.parametrize(
    ("name", "part", "why"),
    [
        ("3v4_50.50_50.50_1.1_53", "3v4", "is not a number of links of each finger, 2v2, 2v3, 3v2 or 3v3"),
        ("2x2_50.50_50.50_1.1_53", "2x2", "is not a number of links of each finger"),
        ("2v2_50-50_50.50_1.1_53", "50-50", "is not a split in per cent joined by dots, such as 50.50"),
        ("2v2_50.50_.50_1.1_53", ".50", "is not a split in per cent"),
        ("2v2_50.50_50.25.25_1.1_53", "50.25.25", "has 3 segments, and '2v2' asks for 2"),
        ("3v2_50.50_50.50_1.1_53", "50.50", "has 2 segments, and '3v2' asks for 3"),
        ("2v2_50.60_50.50_1.1_53", "50.60", "must have positive segments that sum to 100, not 110"),
        ("2v2_50.50_100.0_1.1_53", "100.0", "must have positive segments that sum to 100"),
        ("2v2_50.50_50.50_1.2_53", "1.2", "is not a ratio of finger lengths such as 1.1, 0.9.1 or 1.0.9"),
        ("2v2_50.50_50.50_1_53", "1", "is not a ratio of finger lengths"),
        ("2v2_50.50_50.50_1.1_wide", "wide", "is not a palm width in mm, such as 53"),
        ("2v2_50.50_50.50_1.1_0", "0", "is not a palm width in mm"),
        ("2v2_50.50_50.50_1.1_-53", "-53", "is not a palm width in mm"),
        ("2v2_50.50_50.50_1.1_53:lab", "53:lab", "is not a palm width in mm"),
    ],
)
def test_a_malformed_part_is_named(name: str, part: str, why: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_hand_name(name)
    assert str(caught.value).startswith(f"malformed hand name {name!r}: {part!r} {why}")
    assert "the form is AvB_split_split_ratio_width, for example 2v2_50.50_50.50_1.1_53" in str(caught.value)


@pytest.mark.parametrize(("name", "parts"), [("2v2_50.50_50.50_1.1", 4), ("gripper", 1), ("", 1), (STANDARD + "_1", 6)])
def test_an_unknown_hand_says_what_a_name_is(name: str, parts: int) -> None:
    with pytest.raises(InputError) as caught:
        parse_hand_name(name)
    text = str(caught.value)
    assert text.startswith(f"unknown hand {name!r}: a hand name has five parts joined by underscores")
    assert f"this one has {parts}" in text
    assert "`inhand hands` lists examples" in text
    assert "TOML file" in text


def test_an_unknown_hand_offers_near_matches() -> None:
    with pytest.raises(InputError, match=r"did you mean .*2v2_50\.50_50\.50_1\.1_53"):
        parse_hand_name("2v2_50.50_50.50_1.1-53")
    with pytest.raises(InputError) as caught:
        parse_hand_name("gripper")
    assert "did you mean" not in str(caught.value)


def test_near_matches_ignore_case_and_join_with_or() -> None:
    assert near_matches("CUBE_39", ["cube_39", "ball"]) == "; did you mean cube_39?"
    assert near_matches("cube_39", ["CUBE_3", "Cube_39", "ball"]) == "; did you mean Cube_39 or CUBE_3?"
    assert near_matches("zzz", ["cube_39"]) == ""


def test_a_missing_extra_is_named_with_the_command_that_installs_it() -> None:
    error = needs_extra("rl", "the command `inhand train`")
    assert isinstance(error, InputError)
    assert str(error) == "the command `inhand train` needs the extra `rl`: pip install 'inhand[rl]'"


@pytest.mark.parametrize(
    ("left", "right", "width", "text"),
    [
        ((0.07,), (0.07, 0.07), 0.05, "hand 'h': the left finger has 1 links; a finger has 2 or 3 links"),
        ((0.07, 0.07), (0.04,) * 4, 0.05, "hand 'h': the right finger has 4 links; a finger has 2 or 3 links"),
        ((0.07, -0.07), (0.07, 0.07), 0.05, "a link of the left finger is -70 mm; it must be a positive length"),
        ((0.07, 0.07), (0.07, 0.0), 0.05, "a link of the right finger is 0 mm; it must be a positive length"),
        ((0.07, 0.07), (np.nan, 0.07), 0.05, "a link of the right finger is nan mm; it must be a positive length"),
        ((np.inf, 0.07), (0.07, 0.07), 0.05, "a link of the left finger is inf mm; it must be a positive length"),
        ((0.07, 0.012), (0.07, 0.07), 0.05, "link 1 of the left finger is 12 mm long; it must be longer than 12.5 mm"),
        ((0.07, 0.07), (0.07, 0.07), 0.0, "the palm width is 0 mm; it must be a positive length"),
        ((0.07, 0.07), (0.07, 0.07), -0.05, "the palm width is -50 mm; it must be a positive length"),
    ],
)
def test_lengths_that_no_hand_has_are_refused(
    left: tuple[float, ...], right: tuple[float, ...], width: float, text: str
) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        build_hand("h", left, right, width)


def test_a_link_shorter_than_its_dead_length_is_refused_by_name_too() -> None:
    with pytest.raises(InputError, match=r"link 0 of the left finger is 4\.32 mm long"):
        parse_hand_name("2v2_3.97_50.50_1.1_53")


def mirrored_links(hand: HandSpec) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return hand.right.links, hand.left.links


@pytest.mark.parametrize(
    ("name", "mirror"),
    [
        ("2v3_25.75_25.35.40_1.1_53", "3v2_25.35.40_25.75_1.1_53"),
        ("2v2_70.30_50.50_0.9.1_53", "2v2_50.50_70.30_1.0.9_53"),
    ],
)
def test_mirrored_names_are_mirrored_hands(name: str, mirror: str) -> None:
    hand, other = parse_hand_name(name), parse_hand_name(mirror)
    np.testing.assert_allclose(
        np.concatenate(mirrored_links(hand)), np.concatenate([other.left.links, other.right.links])
    )
    for lab in (hand, other):
        limits = lab_limits(lab)
        assert [low for low, _ in limits.left.limits[1:]] == [-2.09] * (len(lab.left.links) - 1)
        assert [high for _, high in limits.right.limits[1:]] == [2.09] * (len(lab.right.links) - 1)


def pressed(shift: float = 0.0) -> Array:
    """Joint angles of the standard hand whose tips press 2 mm into the sides of the cube at its start, `(4,)`."""
    joints = []
    for finger in STANDARD_HAND.fingers:
        side = np.array([finger.bend * (CUBE.size[0] / 2 - 0.002), shift])
        joints.append(touch(STANDARD_HAND, finger, START + side, np.array([float(finger.bend), 0.0])).joints)
    return np.concatenate(joints)


def held_cube(
    hand: HandSpec, targets: Array, substeps: int, cube: ObjectSpec = CUBE, floor_friction: float = 0.2
) -> Array:
    """Poses of the cube `(S, 3)`, the start first, while the standard grip follows targets `(S, 4)`."""
    simulator = MujocoSimulator(hand, [cube], SceneSpec(floor_friction=floor_friction), threads=1)
    start = simulator.reset(hand.start_pose[None], pressed()[None])
    return np.concatenate([start.pose, *(simulator.step(target[None], substeps).pose for target in targets)])


def test_finger_friction_carries_the_object() -> None:
    """Fingers that hold the sides and move outwards take the object along."""
    outwards = np.stack([pressed(shift) for shift in np.linspace(0, 0.006, 15)])
    poses = held_cube(STANDARD_HAND, outwards, 5)
    assert poses[-1, 1] - poses[0, 1] > 0.004


def test_friction_is_a_product_of_both_bodies() -> None:
    outwards = np.stack([pressed(shift) for shift in np.linspace(0, 0.006, 15)])
    plain = held_cube(STANDARD_HAND, outwards, 5)
    rough, smooth = replace(CUBE, friction=2.0), replace(STANDARD_HAND, friction=STANDARD_HAND.friction / 2)
    np.testing.assert_array_equal(held_cube(smooth, outwards, 5, rough, floor_friction=0.1), plain)
    assert np.abs(held_cube(STANDARD_HAND, outwards, 5, rough) - plain).max() > 1e-6


def test_fingertips_push_along_the_normal_of_a_flat_face() -> None:
    """Without friction two tips on opposite faces can move a cube along neither face."""
    poses = held_cube(replace(STANDARD_HAND, friction=0.0), pressed()[None], 75)
    np.testing.assert_allclose(poses[-1], poses[0], atol=1e-3)


def test_joints_go_to_their_targets_and_stop_at_their_limits() -> None:
    limited = replace(STANDARD_HAND, right=replace(STANDARD_HAND.right, limits=((-1.57, 0.3), (-0.2, 2.09))))
    simulator = MujocoSimulator(limited, [CUBE], threads=1)
    simulator.reset(np.array([[0.0, 0.3, 0.0]]), np.zeros((1, 4)))
    state = simulator.step(np.array([[0.5, -0.4, 0.9, -0.8]]), 500)
    np.testing.assert_allclose(state.joint_angles, [[0.5, -0.4, 0.3, -0.2]], atol=0.02)
    np.testing.assert_allclose(state.joint_velocities, 0.0, atol=1e-3)
    np.testing.assert_array_equal(state.targets, [[0.5, -0.4, 0.9, -0.8]])


@every_fourth_pair
def test_the_model_has_the_masses_sizes_and_frictions_of_its_specs(hand_name: str, spec: ObjectSpec) -> None:
    hand = replace(parse_hand_name(hand_name), friction=0.4, link_mass=0.05)
    spec = replace(spec, mass=0.021, friction=0.7)
    model = build_model(hand, spec, SceneSpec(floor_friction=0.3, gravity=9.0))
    assert model.nu == hand.n_joints
    assert model.nq == hand.n_joints + 7
    np.testing.assert_allclose(model.opt.gravity, (0, 0, -9.0))
    np.testing.assert_allclose(model.body("object").mass, 0.021)
    for side, finger in zip(FINGER_NAMES, hand.fingers, strict=True):
        for i in range(len(finger.links)):
            np.testing.assert_allclose(model.body(f"{side}_{i}").mass, 0.05)
    np.testing.assert_allclose(_friction(model, f"left_{len(hand.left.links) - 1}_low", "object"), 0.4 * 0.7)
    np.testing.assert_allclose(_friction(model, "palm", "object"), 0.4 * 0.7)
    np.testing.assert_allclose(_friction(model, "floor", "object"), 0.3 * 0.7)
    np.testing.assert_allclose(_friction(model, "left_1", "right_1"), 0.4**2)
    if spec.shape != "polygon":  # tests/test_concave.py has those
        # A standing prism: (x^2 + y^2) m / 12 about z for a box, a quarter of the squared half axes for an ellipse.
        a, b, _ = (extent / 2 for extent in spec.size)
        about_z = 0.021 * (a * a + b * b) / (3 if spec.shape == "box" else 4)
        inertia = model.body("object").inertia
        assert np.abs(inertia / about_z - 1).min() < 0.01


def _friction(model: mujoco.MjModel, first: str, second: str) -> float:
    names = {model.geom(first).id, model.geom(second).id}
    for pair in range(model.npair):
        if {int(model.pair_geom1[pair]), int(model.pair_geom2[pair])} == names:
            return float(model.pair_friction[pair, 0])
    raise AssertionError(f"no contact pair of {first} and {second}")


@pytest.mark.parametrize("changes", [{"link_mass": -0.036}, {"link_mass": 0.0}, {"link_width": -0.02}])
def test_a_hand_of_numbers_that_cannot_be_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=next(iter(changes))):
        MujocoSimulator(replace(STANDARD_HAND, **changes), [CUBE])
