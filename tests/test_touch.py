"""Where a finger can touch: the rounded cap, and the postures that rest it on an outline."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from inhand.geometry import Array, rotate, transform, wrap_angle
from inhand.hands.hand import FingerSpec, HandSpec, lab_limits
from inhand.hands.kinematics import joint_positions, link_angles, link_direction
from inhand.hands.names import CATALOGUE as HAND_NAMES
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.hands.objects import ObjectSpec, convex_pieces, outline, parse_object_name
from inhand.hands.shapes import CAP_CORNERS, link_outline
from inhand.hands.touch import cap_support, touch
from inhand.sim.mujoco_engine import MujocoSimulator
from pairs import every_fourth_pair

every_hand = pytest.mark.parametrize("hand_name", HAND_NAMES)
every_object = pytest.mark.parametrize("spec", OBJECTS.values(), ids=OBJECTS.keys())
STANDARD = parse_hand_name(HAND_NAMES[0])


def fine_cap(hand: HandSpec, corners: int = 20001) -> Array:
    """The cap of a link that points along +y, densely sampled, seen from its centre."""
    angle = np.linspace(0, np.pi, corners)
    return np.stack([hand.link_width / 2 * np.cos(angle), hand.tip_length * np.sin(angle)], axis=-1)


def start_pose(hand: HandSpec, turn: float = 0.0) -> Array:
    return np.array([*hand.start_position, turn])


def opened(hand: HandSpec) -> Array:
    """Joint angles that hold both fingers well away to their own sides."""
    angles = np.zeros(hand.n_joints)
    for finger, place in zip(hand.fingers, hand.slices, strict=True):
        angles[place.start] = -finger.bend * 1.7
    return angles


def support_at(hand: HandSpec, finger: FingerSpec, joints: Array, normals: Array) -> Array:
    """Where the cap's support point towards a face of these normals is, by forward kinematics."""
    angle = link_angles(joints)[..., -1]
    centre = joint_positions(finger, joints)[..., -1, :] - hand.tip_length * link_direction(angle)
    return np.asarray(centre + cap_support(hand, angle, -normals))


@given(st.floats(-4.0, 4.0), st.floats(-1.5, 1.5))
def test_the_cap_support_is_the_farthest_point_of_the_cap(angle: float, away: float) -> None:
    cap = rotate(angle, fine_cap(STANDARD))
    direction = link_direction(np.array(angle + away))
    support = cap_support(STANDARD, np.array(angle), direction)
    farthest = cap[(cap @ direction).argmax()]
    np.testing.assert_allclose(support @ direction, (cap @ direction).max(), atol=1e-9)
    np.testing.assert_allclose(support, farthest, atol=5e-6)


def test_the_cap_support_is_batched() -> None:
    angle, away = np.meshgrid(np.linspace(-3, 3, 4), np.linspace(-1.4, 1.4, 5))
    direction = link_direction(angle + away)
    batch = cap_support(STANDARD, angle, direction)
    assert batch.shape == (5, 4, 2)
    np.testing.assert_allclose(batch[3, 2], cap_support(STANDARD, angle[3, 2], direction[3, 2]))


def test_the_outline_of_the_tip_is_inscribed_in_the_cap() -> None:
    corners = link_outline(STANDARD, STANDARD.left, 1)
    assert len(corners) == CAP_CORNERS + 2
    cap = corners[2:] - (0, 0.072 - STANDARD.tip_length)
    np.testing.assert_allclose(((cap / (STANDARD.link_width / 2, STANDARD.tip_length)) ** 2).sum(-1), 1.0)
    np.testing.assert_allclose([corners[:, 1].min(), corners[:, 1].max()], [STANDARD.joint_gap, 0.072])


def flattening(hand: HandSpec, spec: ObjectSpec) -> float:
    """How far the polygons of cap and object can fall short of the round outlines that `touch` works with [m]."""
    ends = np.linspace(0, np.pi, CAP_CORNERS)
    middle = (ends[1:] + ends[:-1]) / 2
    axes = np.array([hand.link_width / 2, hand.tip_length])
    on_arc = np.stack([np.cos(middle), np.sin(middle)], axis=-1) * axes
    corner = np.stack([np.cos(ends), np.sin(ends)], axis=-1) * axes
    cap = float(np.linalg.norm(on_arc - (corner[1:] + corner[:-1]) / 2, axis=-1).max())
    body = 0.0 if spec.shape == "box" else max(spec.size[:2]) / 2 * (1 - np.cos(np.pi / 48))
    return cap + float(body)


@every_fourth_pair
def test_touching_postures_touch_in_the_simulator(hand_name: str, spec: ObjectSpec) -> None:
    hand = parse_hand_name(hand_name)
    pose = start_pose(hand, 0.2)
    points, normals = outline(spec, 0.006)
    for finger, place in zip(hand.fingers, hand.slices, strict=True):
        touches = touch(hand, finger, transform(pose, points), rotate(pose[2], normals))
        reached = touches.reached
        assert reached.mean() >= 0.25
        assert reached.mean() < 1 or spec.name == "triangle"  # small enough to be reached all round by three links
        joints = np.tile(opened(hand), (reached.sum(), 1))
        joints[:, place] = touches.joints[reached]
        simulator = MujocoSimulator(hand, [spec] * len(joints), threads=1)
        state = simulator.reset(np.tile(pose, (len(joints), 1)), joints)
        gaps = state.link_gaps[:, place.stop - 1]
        if len(convex_pieces(spec)) == 1:  # a link may meet another side of a concave object
            assert gaps.min() > -1e-6
        else:
            assert (gaps > -1e-6).mean() >= 0.4
        # 0.1 mm, but for the 51 mm cylinder, whose polygon and the cap's together lie 0.107 mm inside the arcs.
        assert gaps.max() < min(1.1e-4, flattening(hand, spec) + 2e-5)


@every_fourth_pair
def test_touching_postures_put_the_cap_on_the_point(hand_name: str, spec: ObjectSpec) -> None:
    hand = parse_hand_name(hand_name)
    points, normals = outline(spec, 0.003)
    points = transform(start_pose(hand), points)
    for finger in hand.fingers:
        touches = touch(hand, finger, points, normals)
        reached = touches.reached
        joints = touches.joints[reached]
        np.testing.assert_allclose(support_at(hand, finger, joints, normals[reached]), points[reached], atol=2e-5)
        limits = np.array(finger.limits)
        assert ((joints >= limits[:, 0]) & (joints <= limits[:, 1])).all()
        inward = np.arctan2(normals[reached, 0], -normals[reached, 1])
        leaning = wrap_angle(link_angles(joints)[:, -1] - inward - touches.inclination[reached])
        np.testing.assert_allclose(leaning, 0.0, atol=1e-9)
        assert np.abs(touches.inclination[reached]).max() <= np.deg2rad(88) + 1e-9
        assert np.isnan(touches.joints[~reached]).all()


@every_hand
def test_mirrored_points_are_touched_by_mirrored_fingers(hand_name: str) -> None:
    hand = parse_hand_name(hand_name)
    points, normals = outline(parse_object_name("ellipse_40x25"), 0.004)
    points = points + np.array([0.01, 0.09])
    finger = hand.left
    other = FingerSpec((-finger.base[0], finger.base[1]), finger.links, finger.limits, -finger.bend)
    ours = touch(hand, finger, points, normals)
    theirs = touch(hand, other, points * (-1, 1), normals * (-1, 1))
    np.testing.assert_array_equal(ours.reached, theirs.reached)
    np.testing.assert_allclose(ours.joints, -theirs.joints, atol=1e-9)
    np.testing.assert_allclose(ours.inclination[ours.reached], -theirs.inclination[ours.reached], atol=1e-9)


@every_hand
def test_what_a_finger_can_touch_is_found(hand_name: str) -> None:
    """Bent postures laid against a face from the other side: nearly every one must be found again."""
    hand = parse_hand_name(hand_name)
    rng = np.random.default_rng(19)
    for finger in hand.fingers:
        bends = finger.bend * rng.uniform(0.35, 1.6, (2000, len(finger.links)))
        bends[:, 0] = rng.uniform(-1.2, 1.2, 2000)
        inward = link_angles(bends)[:, -1] - rng.uniform(-1.3, 1.3, 2000)
        normals = -link_direction(inward)
        points = support_at(hand, finger, bends, normals)
        touches = touch(hand, finger, points, normals)
        assert touches.reached.mean() > 0.99
        joints = touches.joints[touches.reached]
        found = support_at(hand, finger, joints, normals[touches.reached])
        assert np.linalg.norm(found - points[touches.reached], axis=-1).max() < 2e-4


def elbow_out_exists(hand: HandSpec, finger: FingerSpec, point: Array, normal: Array) -> bool:
    """Whether any inclination lets a two-link finger touch with its elbow outwards, by a fine scan."""
    inward = np.arctan2(normal[0], -normal[1])
    angle = inward + np.deg2rad(np.linspace(-88, 88, 3521))
    direction = np.broadcast_to(-normal, (*angle.shape, 2))
    reach = finger.links[1] - hand.tip_length
    joint = point - cap_support(hand, angle, direction) - reach * link_direction(angle) - np.array(finger.base)
    excess = np.linalg.norm(joint, axis=-1) - finger.links[0]
    root = np.flatnonzero(excess[1:] * excess[:-1] <= 0)
    heading = np.arctan2(-joint[root, 0], joint[root, 1])
    return bool((wrap_angle(angle[root] - heading) * finger.bend > 0).any())


TWO_LINKS = [name for name in HAND_NAMES if name.startswith("2v2")]


@pytest.mark.parametrize("hand_name", TWO_LINKS)
@every_object
def test_the_elbow_is_outwards_where_it_can_be(hand_name: str, spec: ObjectSpec) -> None:
    hand = parse_hand_name(hand_name)
    points, normals = outline(spec, 0.012)
    points = transform(start_pose(hand), points)
    for finger in hand.fingers:
        touches = touch(hand, finger, points, normals)
        for i in np.flatnonzero(touches.reached & (touches.joints[:, 1] * finger.bend < 0)):
            assert not elbow_out_exists(hand, finger, points[i], normals[i])


def test_the_elbow_is_outwards_for_a_far_folded_finger_too() -> None:
    hand = parse_hand_name("2v2_70.30_50.50_0.9.1_53")
    point, normal = np.array([-0.0273, 0.0698]), np.array([0.0, 1.0])
    assert elbow_out_exists(hand, hand.left, point, normal)
    touches = touch(hand, hand.left, point, normal)
    assert touches.reached
    assert touches.joints[1] < 0


def test_laboratory_limits_are_kept() -> None:
    hand = lab_limits(STANDARD)
    points, normals = outline(parse_object_name("cube_39"), 0.003)
    for finger, free in zip(hand.fingers, STANDARD.fingers, strict=True):
        for shift in (0.06, 0.0936, 0.12):
            there = points + np.array([0, shift])
            limited = touch(hand, finger, there, normals)
            anywhere = touch(hand, free, there, normals)
            low, high = np.array(finger.limits).T
            joints = limited.joints[limited.reached]
            assert ((joints >= low) & (joints <= high)).all()
            assert not (limited.reached & ~anywhere.reached).any()
        assert limited.reached.any()


def test_a_point_out_of_reach_is_said_to_be() -> None:
    normal = np.array([0.0, -1.0])
    far = touch(STANDARD, STANDARD.left, np.array([[0.0, 0.3], [0.0, 0.1]]), np.stack([normal, normal]))
    np.testing.assert_array_equal(far.reached, [False, True])
    assert np.isnan(far.joints[0]).all()


def test_leading_axes_are_kept() -> None:
    points, normals = outline(parse_object_name("cube_39"), 0.01)
    points = points + STANDARD.start_position
    shifted = points + np.array([[[0.0, 0.0]], [[0.01, 0.0]], [[0.0, 0.01]]])
    batch = touch(STANDARD, STANDARD.right, shifted, np.broadcast_to(normals, shifted.shape))
    assert batch.joints.shape == (3, len(points), 2)
    assert batch.reached.shape == batch.inclination.shape == (3, len(points))
    for i in range(3):
        np.testing.assert_allclose(batch.joints[i], touch(STANDARD, STANDARD.right, shifted[i], normals).joints)
