"""Fingers in space against MuJoCo, and surfaces against what they are made of."""

import mujoco
import numpy as np
import pytest

from inhand.geometry import Array
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.meshes import solid_of
from inhand.hands.spatial.names import CATALOGUE, STANDARD, parse_spatial_name
from inhand.hands.spatial.objects import SolidSpec, parse_solid_name
from inhand.rotations import placed, quaternion_of, seen_from

HAND = parse_spatial_name(STANDARD)
WEDGE = solid_of("wedge", np.array([(0, 0, 0), (40, 0, 0), (0, 50, 0), (0, 0, 30), (30, 0, 20), (0, 40, 25.0)]) / 1e3)
ELLIPSOID = parse_solid_name("ellipsoid_60x50x40")


def drawn_joints(hand: SpatialHand, count: int) -> Array:
    low, high = hand.limits.T
    return np.asarray(low + np.random.default_rng(0).random((count, hand.n_joints)) * (high - low))


def drawn_poses(hand: SpatialHand, count: int) -> Array:
    rng = np.random.default_rng(1)
    place = np.array(hand.start_position) + 0.01 * rng.standard_normal((count, 3))
    return np.concatenate([place, quaternion_of(rng.standard_normal((count, 3)))], axis=-1)


def model_of(hand: SpatialHand) -> tuple[mujoco.MjModel, list[int]]:
    """Return a hand in MuJoCo, its bodies as the spec says, and the bodies of the fingertips."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    tips = []
    for finger in hand.fingers:
        body = spec.worldbody
        for link in finger.links:
            body = body.add_body(pos=link.origin, quat=link.turn)
            body.mass, body.inertia, body.explicitinertial = link.mass, link.inertia[:3], True
            body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=link.axis)
        tips.append(body.add_body(name=finger.name, pos=finger.tip))
    model = spec.compile()
    return model, [model.body(finger.name).id for finger in hand.fingers]


@pytest.mark.parametrize("name", [STANDARD, "3f_60.60_2v1.40.80_10", "4f_45.45.30_40_10"])
def test_tips_and_jacobians_are_those_of_mujoco(name: str) -> None:
    hand = parse_spatial_name(name)
    joints = drawn_joints(hand, 5)
    told = kinematics.place(hand, joints)
    model, tips = model_of(hand)
    data = mujoco.MjData(model)
    for world, angles in enumerate(joints):
        data.qpos[:] = angles
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        for f, (body, own) in enumerate(zip(tips, hand.slices, strict=True)):
            np.testing.assert_allclose(told.tips[world, f], data.xpos[body], atol=1e-12)
            jacobian = np.zeros((3, model.nv))
            mujoco.mj_jac(model, data, jacobian, None, data.xpos[body], body)
            found = kinematics.point_jacobian(told.places[world, own], told.axes[world, own], told.tips[world, f])
            np.testing.assert_allclose(found, jacobian[:, own], atol=1e-12)


def test_joint_steps_move_the_tip_by_the_least_squares() -> None:
    joints = drawn_joints(HAND, 20)
    told = kinematics.place(HAND, joints)
    jacobian = kinematics.point_jacobian(told.places[:, :3], told.axes[:, :3], told.tips[:, 0])
    step = 1e-3 * np.random.default_rng(3).standard_normal((20, 3))
    found = kinematics.damped_least_squares(jacobian, step, 0.01)
    for k in range(20):
        stacked = np.concatenate([jacobian[k], 0.01 * np.eye(3)])
        expected = np.linalg.lstsq(stacked, np.append(step[k], np.zeros(3)), rcond=None)[0]
        np.testing.assert_allclose(found[k], expected, atol=1e-9)
    posture = np.full((20, 3), 0.1)
    moved = np.einsum("kij,kj->ki", jacobian, kinematics.damped_least_squares(jacobian, step, 1e-6, posture))
    np.testing.assert_allclose(moved, step, atol=1e-6)


@pytest.mark.parametrize("name", CATALOGUE)
def test_inverse_kinematics_reaches_what_the_fingers_reach(name: str) -> None:
    hand = parse_spatial_name(name)
    tips = kinematics.place(hand, drawn_joints(hand, 30)).tips[:, 0]
    joints, misses = kinematics.inverse(hand.fingers[0], tips)
    assert (misses.min(axis=1) < kinematics.MISS).mean() > 0.95
    best = np.take_along_axis(joints, misses.argmin(axis=1)[:, None, None], axis=1)[:, 0]
    low, high = hand.fingers[0].limits.T
    assert ((best >= low) & (best <= high)).all()
    _, beyond = kinematics.inverse(hand.fingers[0], np.array([[0.3, 0.0, 0.1]]))
    assert beyond.min() > 0.1


def surface_points(spec: SolidSpec) -> Array:
    """Return many points of a surface `(K, 3)`."""
    rng = np.random.default_rng(5)
    half = np.array(spec.half)
    if spec.mesh is not None:
        a, b, c = (np.array(spec.mesh.corners)[np.array(spec.mesh.triangles)[:, k]] for k in range(3))
        weights = rng.dirichlet(np.ones(3), (1500, len(a)))
        return np.asarray((weights[..., :1] * a + weights[..., 1:2] * b + weights[..., 2:] * c).reshape(-1, 3))
    drawn = rng.standard_normal((12000, 3))
    if spec.shape == "box":
        return np.asarray(half * drawn / np.abs(drawn).max(axis=-1, keepdims=True))
    if spec.shape == "cylinder":
        drawn /= np.maximum(np.hypot(drawn[:, 0], drawn[:, 1]), np.abs(drawn[:, 2]))[:, None]
        return np.asarray(half * drawn)
    return np.asarray(half * drawn / np.linalg.norm(drawn, axis=-1, keepdims=True))


SOLIDS = [parse_solid_name(name) for name in ("cube_50", "sphere_50", "cylinder_50x60")] + [ELLIPSOID, WEDGE]


@pytest.mark.parametrize("spec", SOLIDS, ids=lambda spec: spec.name)
def test_contacts_are_the_nearest_points_and_normals_of_the_surface(spec: SolidSpec) -> None:
    hand, joints = HAND, drawn_joints(HAND, 20)
    poses = drawn_poses(hand, 20)
    told = kinematics.measure(hand, spec, joints, poses)
    radius = hand.fingers[0].tip_radius
    cloud = surface_points(spec)
    for world in range(20):
        points = placed(poses[world], cloud)
        for f in range(3):
            tip, point, normal = told.tips[world, f], told.points[world, f], told.normals[world, f]
            distance = told.gaps[world, f] + radius
            np.testing.assert_allclose(np.linalg.norm(normal), 1)
            np.testing.assert_allclose(point + distance * normal, tip, atol=1e-9)
            nearest = np.linalg.norm(points - tip, axis=-1).min()
            assert abs(nearest - abs(distance)) < 0.002
            # the plane through the contact has the whole solid on its inner side, where the tip is outside
            assert distance < 0 or ((points - point) @ normal).max() < 1e-9


def test_links_are_as_far_as_their_nearest_sphere() -> None:
    joints, poses = drawn_joints(HAND, 40), drawn_poses(HAND, 40)
    spec = parse_solid_name("cube_50")
    told = kinematics.measure(HAND, spec, joints, poses)
    assert (told.link_gaps[:, ::3] == 1.0).all()  # an abduction's hinge has no body
    shares = np.linspace(0, 1, 61)[:, None]
    for f in range(3):
        along = (1 - shares) * told.places[:, None, 3 * f + 1] + shares * told.places[:, None, 3 * f + 2]
        gaps = np.array([spheres_gap(spec, poses[w], along[w]) for w in range(40)])
        np.testing.assert_allclose(told.link_gaps[:, 3 * f + 1], gaps - 0.007, atol=2e-4)
        assert (told.link_gaps[:, 3 * f + 2] <= told.gaps[:, f] + 1e-12).all()


def spheres_gap(spec: SolidSpec, pose: Array, points: Array) -> float:
    """Return the signed distance of the nearest of some points to a box."""
    over = np.abs(seen_from(pose, points)) - np.array(spec.half)
    outside = np.linalg.norm(np.maximum(over, 0), axis=-1)
    return float(np.where(outside > 0, outside, over.max(axis=-1)).min())


def test_a_mesh_of_a_box_touches_like_the_box() -> None:
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.025
    mesh, box = solid_of("m", corners), parse_solid_name("cube_50")
    joints, poses = drawn_joints(HAND, 200), drawn_poses(HAND, 200)
    one, other = kinematics.measure(HAND, mesh, joints, poses), kinematics.measure(HAND, box, joints, poses)
    np.testing.assert_allclose(one.gaps, other.gaps, atol=1e-9)
    np.testing.assert_allclose(one.link_gaps, other.link_gaps, atol=1e-6)
