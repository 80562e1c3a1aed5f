"""Rolling contacts: the finger stays on the object, and rolls without slipping."""

from dataclasses import replace

import numpy as np
import pytest

from inhand.geometry import Array, inverse_transform, transform, unit, wrap_angle
from inhand.hands import rolling
from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.kinematics import joint_positions, link_angles
from inhand.hands.names import CATALOGUE as HAND_NAMES
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.hands.objects import ObjectSpec, outline, parse_object_name, polygon
from inhand.hands.polygons import separation
from inhand.hands.rolling import Starts, Tracks, roll
from inhand.hands.shapes import link_outline, link_polygons, palm_outline
from inhand.hands.touch import touch
from inhand.sim.mujoco_engine import MujocoSimulator

every_hand = pytest.mark.parametrize("hand_name", HAND_NAMES)
CUBE = parse_object_name("cube_39")
SIDES = pytest.mark.parametrize("side", [0, 1], ids=["left", "right"])


def path(hand: HandSpec, way: float, turn: float = 0.0, length: float = 0.04, step: float = 0.002) -> Array:
    """Object poses from the start along an angle [rad], turning by `turn` [rad] on the way, `(S, 3)`."""
    s = np.arange(0.0, length, step)
    return np.concatenate([np.array(hand.start_position) + s[:, None] * unit(way), (turn * s / length)[:, None]], -1)


def tracks_from(
    hand: HandSpec, finger: FingerSpec, spec: ObjectSpec, grip: tuple[Array, Array], poses: Array
) -> tuple[Tracks, Array]:
    """Roll from those points `(K, 2)` of the object with those normals that the finger can touch at the start."""
    points, normals = grip
    touches = touch(hand, finger, transform(poses[0], points), normals)
    points, joints = points[touches.reached], touches.joints[touches.reached]
    many = np.tile(poses, (len(points), 1, 1))
    return roll(hand, finger, Starts(points, joints, (polygon(spec),)), many), many


@every_hand
@pytest.mark.parametrize("object_name", ["cube_39", "rectangle_46x15", "cylinder_40", "ellipse_25x40"])
def test_rolling_contacts_stay_on_the_object_in_the_simulator(hand_name: str, object_name: str) -> None:
    hand, spec = parse_hand_name(hand_name), OBJECTS[object_name]
    for finger, place, way in zip(hand.fingers, hand.slices, (0.6, -1.2), strict=True):
        tracks, poses = tracks_from(hand, finger, spec, outline(spec, 0.012), path(hand, way, turn=0.2, step=0.004))
        rows, steps = np.nonzero(tracks.held)
        assert steps.max() >= 5
        joints = np.zeros((len(rows), hand.n_joints))
        joints[:, place] = tracks.joints[rows, steps]
        simulator = MujocoSimulator(hand, [spec] * len(rows), threads=1)
        state = simulator.reset(poses[rows, steps], joints)
        assert np.abs(state.link_gaps[:, place.stop - 1]).max() < 5e-4
        assert state.link_gaps[:, place.start : place.stop - 1].min() > 0  # inner links stay off the object


@pytest.mark.parametrize("depth", [0.0008, -0.0008], ids=["pressed in", "a little off"])
def test_a_finger_that_presses_hard_rolls_like_one_that_touches(depth: float) -> None:
    """Engines let contacts sink in, the deeper the shorter the links and the stiffer the servos."""
    hand = parse_hand_name(HAND_NAMES[0])
    finger, poses = hand.left, path(hand, -np.pi / 2)[None]
    face = np.array([[-0.0195, 0.0]])
    points = transform(poses[:, 0], face)
    joints = [
        touch(hand, finger, points + shift, np.array([[-1.0, 0.0]])).joints for shift in ([0.0, 0.0], [depth, 0.0])
    ]
    touching, pressed = (roll(hand, finger, Starts(face, angles, (polygon(CUBE),)), poses) for angles in joints)
    assert touching.held.sum() > 5
    assert abs(int(pressed.held.sum()) - int(touching.held.sum())) <= 1
    assert np.abs(joints[1] - joints[0]).max() > 0.005
    np.testing.assert_allclose(pressed.points[:, :5], touching.points[:, :5], atol=2.5e-3)  # one corner of the cap
    body = transform(poses[:, :1, None], polygon(CUBE))
    assert np.abs(separation(link_polygons(hand, finger, pressed.joints[:, :1])[-1], body)).max() < 1e-4


@every_hand
@SIDES
def test_held_contacts_lie_on_both_outlines(hand_name: str, side: int) -> None:
    hand = parse_hand_name(hand_name)
    finger = hand.fingers[side]
    tracks, poses = tracks_from(hand, finger, CUBE, outline(CUBE, 0.008), path(hand, -0.8))
    assert tracks.held[:, 5].any()
    held = tracks.held
    body = transform(poses[..., None, :], polygon(CUBE))
    link = link_polygons(hand, finger, tracks.joints)[-1]
    assert np.abs(separation(link, body))[held].max() < 5e-4
    height = np.abs(tracks.points[held]).max(-1) - 0.0195
    assert np.abs(height).max() < 5e-4
    # Normals point out of the object: in its frame a small step along them leaves it.
    outwards = np.abs(tracks.points[held] + 1e-3 * tracks.normals[held]).max(-1) - 0.0195
    assert outwards.min() > 0
    limits = np.array(finger.limits)
    assert ((tracks.joints[held] >= limits[:, 0]) & (tracks.joints[held] <= limits[:, 1])).all()


@every_hand
def test_a_contact_once_lost_stays_lost(hand_name: str) -> None:
    hand = parse_hand_name(hand_name)
    for finger in hand.fingers:
        tracks, _ = tracks_from(hand, finger, CUBE, outline(CUBE, 0.008), path(hand, np.pi / 2, length=0.1))
        assert not (tracks.held[:, 1:] & ~tracks.held[:, :-1]).any()
        assert not tracks.held[:, -1].all()
        assert np.isfinite(tracks.points).all()
        assert np.isfinite(tracks.joints).all()


def arc_of_corners(hand: HandSpec, finger: FingerSpec) -> tuple[Array, Array]:
    """Corners of the last link's outline, and the length of the outline up to each."""
    corners = link_outline(hand, finger, len(finger.links) - 1)
    edges = np.linalg.norm(np.diff(corners, axis=0), axis=-1)
    return corners, np.concatenate([[0.0], np.cumsum(edges)])


@pytest.mark.parametrize("hand_name", [HAND_NAMES[0], "2v2_70.30_50.50_0.9.1_53", "3v3_25.40.35_40.35.25_1.1_63"])
@SIDES
@pytest.mark.parametrize("sideways", [False, True], ids=["towards the palm", "to its own side"])
def test_the_cap_rolls_its_own_length_along_a_face(hand_name: str, side: int, *, sideways: bool) -> None:
    hand = parse_hand_name(hand_name)
    finger = hand.fingers[side]
    face = np.array([[finger.bend * 0.0195, y] for y in (-0.006, 0.0, 0.006)])
    normals = np.tile([float(finger.bend), 0.0], (3, 1))
    way = (np.pi, 0.0)[side] if sideways else -np.pi / 2
    tracks, poses = tracks_from(hand, finger, CUBE, (face, normals), path(hand, way, length=0.05, step=0.001))
    corners, arc = arc_of_corners(hand, finger)
    compared = 0
    for k in range(len(poses)):
        lean = _lean(tracks, k)
        # Beyond this lean the flat side of the link takes over, and beyond the end of the face its corner.
        on_cap = (np.abs(lean) < np.deg2rad(84)) & (np.abs(tracks.points[k, :, 1]) < 0.0194)
        steps = tracks.held[k] & np.logical_and.accumulate(on_cap)
        steps[0] = False  # the start lies on the rounded cap, later contacts on its corners
        local = _in_link(finger, tracks.joints[k], transform(poses[k], tracks.points[k]))[steps]
        apart = np.linalg.norm(local[:, None] - corners, axis=-1)
        assert apart.min(axis=1).max() < 1e-9
        rolled = -finger.bend * (arc[apart.argmin(axis=1)] - arc[apart[0].argmin()])
        moved = tracks.points[k, steps, 1] - tracks.points[k, steps][0, 1]
        np.testing.assert_allclose(moved, rolled, atol=7e-4)
        compared += int(np.abs(moved).max() > 3e-3)
    assert compared > 0


def _lean(tracks: Tracks, k: int) -> Array:
    """Angle of the last link from the inward normal of a path that does not turn [rad]."""
    normals = tracks.normals[k]
    return wrap_angle(link_angles(tracks.joints[k])[:, -1] - np.arctan2(normals[:, 0], -normals[:, 1]))


def _in_link(finger: FingerSpec, joints: Array, points: Array) -> Array:
    """Points of the palm frame in the frame of the last link."""
    angle = link_angles(joints)[:, -1:]
    pose = np.concatenate([joint_positions(finger, joints)[:, -2], angle], axis=-1)
    return inverse_transform(pose, points)


def test_the_true_cap_arc_is_rolled_to_within_one_corner() -> None:
    """Against the half ellipse itself: the arc between the first and last point that face the object."""
    hand = parse_hand_name("2v2_70.30_50.50_0.9.1_53")
    finger = hand.left
    grip = (np.array([[-0.0195, 0.006]]), np.array([[-1.0, 0.0]]))
    tracks, _ = tracks_from(hand, finger, CUBE, grip, path(hand, -np.pi / 2, step=0.001))
    assert tracks.held.all()
    a, b = hand.link_width / 2, hand.tip_length
    lean = _lean(tracks, 0)[[0, -1]]
    # The ellipse's parameter t where (a sin t, b cos t) has its normal at that angle from the link.
    first, last = np.arctan2(a * np.sin(lean), b * np.cos(lean))
    t = np.linspace(first, last, 10001)
    speed = np.hypot(a * np.cos(t), b * np.sin(t))
    rolled = float(((speed[1:] + speed[:-1]) / 2 * np.abs(np.diff(t))).sum())
    moved = abs(tracks.points[0, -1, 1] - tracks.points[0, 0, 1])
    assert moved > 0.01
    corner = np.linalg.norm(np.diff(link_outline(hand, finger, 1)[2:], axis=0), axis=-1).max()
    assert abs(moved - rolled) < corner


@every_hand
def test_mirrored_paths_give_mirrored_tracks(hand_name: str) -> None:
    hand = parse_hand_name(hand_name)
    right = FingerSpec((-hand.left.base[0], 0.0), hand.left.links, hand.left.limits, 1)
    mirrored = replace(hand, right=right)
    points, normals = outline(CUBE, 0.01)
    flip = np.array([-1.0, 1.0])
    poses = path(hand, 0.9, turn=0.3)
    ours, _ = tracks_from(hand, hand.left, CUBE, (points, normals), poses)
    theirs, _ = tracks_from(mirrored, right, CUBE, (points * flip, normals * flip), poses * (-1, 1, -1))
    np.testing.assert_array_equal(ours.held, theirs.held)
    np.testing.assert_allclose(ours.joints[ours.held], -theirs.joints[ours.held], atol=1e-6)
    np.testing.assert_allclose(ours.points[ours.held], theirs.points[ours.held] * flip, atol=1e-6)


def test_an_object_in_the_palm_is_not_held() -> None:
    hand = parse_hand_name(HAND_NAMES[0])
    poses = path(hand, -np.pi / 2, length=0.09)
    tracks, many = tracks_from(hand, hand.left, CUBE, outline(CUBE, 0.008), poses)
    inside = separation(palm_outline(hand), transform(many[..., None, :], polygon(CUBE))) <= 0
    assert inside[:, -1].all()
    assert tracks.held.any()
    assert not (tracks.held & inside).any()


def test_objects_of_different_sizes_roll_side_by_side() -> None:
    hand = parse_hand_name(HAND_NAMES[0])
    poses = path(hand, 0.5)
    specs = [parse_object_name(name) for name in ("cube_35", "cube_39", "cube_43")]
    grips = [(np.array([[-spec.size[0] / 2, 0.0]]), np.array([[-1.0, 0.0]])) for spec in specs]
    alone = [tracks_from(hand, hand.left, spec, grip, poses)[0] for spec, grip in zip(specs, grips, strict=True)]
    points = np.concatenate([grip[0] for grip in grips])
    joints = touch(hand, hand.left, transform(poses[0], points), np.tile([-1.0, 0.0], (3, 1))).joints
    bodies = np.stack([polygon(spec) for spec in specs])
    together = roll(hand, hand.left, Starts(points, joints, (bodies,)), np.tile(poses, (3, 1, 1)))
    for k, track in enumerate(alone):
        np.testing.assert_array_equal(together.held[k], track.held[0])
        np.testing.assert_allclose(together.joints[k], track.joints[0], atol=1e-12)


def test_a_third_link_keeps_near_the_posture_it_started_in(monkeypatch: pytest.MonkeyPatch) -> None:
    hand = parse_hand_name("3v3_25.40.35_40.35.25_1.1_63")
    way, strayed = path(hand, 1.2), {}
    for gain in (0.0, rolling.POSTURE_GAIN):
        monkeypatch.setattr(rolling, "POSTURE_GAIN", gain)
        tracks, _ = tracks_from(hand, hand.left, CUBE, outline(CUBE, 0.012), way)
        whole = tracks.held.all(axis=1)
        assert whole.any()
        strayed[gain] = np.linalg.norm(tracks.joints[whole, -1] - tracks.joints[whole, 0], axis=-1).mean()
    assert strayed[rolling.POSTURE_GAIN] < strayed[0.0] - 1e-3


def test_a_track_ends_at_a_joints_limit() -> None:
    free = parse_hand_name(HAND_NAMES[0])
    limited = parse_hand_name(f"{HAND_NAMES[0]}:lab-limits")
    limits, held = np.array(limited.left.limits), []
    for hand in (free, limited):
        tracks, _ = tracks_from(limited, hand.left, CUBE, outline(CUBE, 0.012), path(hand, -1.2, length=0.08))
        joints = tracks.joints[tracks.held]
        held.append(((joints >= limits[:, 0]) & (joints <= limits[:, 1])).all(axis=-1))
    assert not held[0].all()
    assert held[1].all()
