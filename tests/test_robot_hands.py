"""Hands from URDF and MJCF files: the same hand however it is written, its kinematics, and what is refused."""

import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from inhand.asterisk_test import config, run
from inhand.asterisk_test.results import result_of_trial
from inhand.control.trial import load_trial, save_trial
from inhand.errors import InputError
from inhand.geometry import Array, rotate, transform
from inhand.hands.files import assumed, load_hand, load_robot
from inhand.hands.fit import widest_opening
from inhand.hands.hand import HandSpec
from inhand.hands.kinematics import joint_positions, link_angles
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import outline, parse_object_name
from inhand.hands.polygons import contact
from inhand.hands.robot_outlines import FLATTENING, collision_geoms, convex_outline, solid_points
from inhand.hands.shapes import link_outline, link_polygons, palm_outline
from inhand.hands.touch import outline_support, touch
from inhand.sim.bullet_model import build_world, load_pybullet
from inhand.sim.model import build_model
from inhand.sim.scene import SceneSpec

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
GRIPPER = EXAMPLES / "gripper.toml"

MJCF = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <body name="palm_link" pos="0.3 0.1 0.2" euler="0.5 0.2 -0.1">
      <geom type="box" pos="-0.02 0 0" size="0.02 0.045 0.017"/>
      <geom type="cylinder" pos="0 0.03 0" size="0.012 0.017"/>
      <geom type="cylinder" pos="0 -0.03 0" size="0.012 0.017"/>
      <geom type="box" pos="0.2 0 0" size="0.1 0.1 0.1" contype="0" conaffinity="0"/>
      {fingers}
    </body>
  </worldbody>
</mujoco>
"""
FINGER = """
      <body name="{side}_base" pos="0 {y} 0">
        <inertial pos="0.035 0 0" mass="0.042" diaginertia="4e-6 2e-5 2e-5"/>
        <joint name="{side}_proximal" axis="0 0 1" range="{first}" ref="0.25" damping="0.12"
               actuatorfrcrange="-0.4 0.4"/>
        <geom type="box" pos="0.037 0 0" size="0.031 0.009 0.015"/>
        <body name="{side}_end" pos="0.07 0 0">
          <inertial pos="0.03 0 0" mass="0.03" diaginertia="3e-6 1e-5 1e-5"/>
          <joint name="{side}_distal" axis="0 0 1" range="{second}" damping="0.12" actuatorfrcrange="-0.4 0.4"/>
          <geom type="box" pos="0.031 0 0" size="0.025 0.009 0.015"/>
          <geom type="cylinder" pos="0.056 0 0" size="0.009 0.015"/>
          <site name="{side}_tip" pos="0.065 0 0"/>
        </body>
      </body>
"""
"""A finger that lies along the palm's x axis, our +y, at the angles of 0.25 and 0 rad."""


def gripper_mjcf(hand: HandSpec) -> str:
    fingers = []
    for side, y, finger in zip(("left", "right"), (0.03, -0.03), hand.fingers, strict=True):
        (low, high), second = finger.limits
        first = f"{low + 0.25!r} {high + 0.25!r}"
        fingers.append(FINGER.format(side=side, y=y, first=first, second=f"{second[0]!r} {second[1]!r}"))
    return MJCF.format(fingers="".join(fingers))


def copied(folder: Path) -> Path:
    """Copy the example into a folder and return its TOML file."""
    for name in ("gripper.toml", "gripper.urdf"):
        shutil.copy(EXAMPLES / name, folder / name)
    return folder / "gripper.toml"


def edited(path: Path, *changes: tuple[str, str]) -> None:
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")


def leaves(value: object) -> Iterator[object]:
    """Give every number and text of nested mappings and tuples."""
    if isinstance(value, dict):
        value = tuple(value.values())
    if isinstance(value, tuple):
        for item in value:
            yield from leaves(item)
    else:
        yield value


def assert_same_hand(first: HandSpec, second: HandSpec) -> None:
    for one, other in zip(leaves(asdict(first)), leaves(asdict(second)), strict=True):
        assert one == (pytest.approx(other, abs=2e-9) if isinstance(other, float) else other)


@pytest.fixture(scope="module")
def gripper() -> HandSpec:
    return load_hand(GRIPPER)


def test_the_example_has_the_numbers_of_its_file(gripper: HandSpec) -> None:
    left, right = gripper.fingers
    assert (left.base, right.base, gripper.palm_width) == ((-0.03, 0.0), (0.03, 0.0), 0.06)
    assert left.links == right.links == (0.07, 0.065)
    assert left.masses == right.masses == (0.042, 0.03)
    assert (left.bend, right.bend) == (-1, 1)
    assert (gripper.friction, gripper.damping, gripper.torque, gripper.thickness) == (0.6, 0.12, 0.4, 0.03)
    assert (gripper.stiffness, gripper.armature) == (5.0, 1e-3)
    np.testing.assert_allclose(gripper.start_position, (0.0, 0.65 * 0.135))
    box = [(-0.009, 0.006), (0.009, 0.006), (0.009, 0.068), (-0.009, 0.068)]
    np.testing.assert_allclose(link_outline(gripper, left, 0), box, atol=1e-9)
    tip = link_outline(gripper, right, 1)
    np.testing.assert_allclose([tip.min(axis=0), tip.max(axis=0)], [(-0.009, 0.006), (0.009, 0.065)], atol=1e-9)
    palm = palm_outline(gripper)
    np.testing.assert_allclose([palm.min(axis=0), palm.max(axis=0)], [(-0.045, -0.04), (0.045, 0.012)], atol=1e-9)


def test_limits_count_from_our_zero(gripper: HandSpec) -> None:
    """Flat outwards and turning inwards at 0.1 to 2.8 rad is -(pi/2 - 0.1) to 2.8 - pi/2 for a right finger."""
    np.testing.assert_allclose(gripper.right.limits, [(0.1 - np.pi / 2, 2.8 - np.pi / 2), (-0.3, 2.4)], atol=1e-12)
    np.testing.assert_allclose(gripper.left.limits, [(np.pi / 2 - 2.8, np.pi / 2 - 0.1), (-2.4, 0.3)], atol=1e-12)


def test_our_kinematics_are_those_of_the_file() -> None:
    robot = load_robot(GRIPPER)
    hand = robot.hand
    model = mujoco.MjSpec.from_file(str(EXAMPLES / "gripper.urdf"))
    model.compiler.fusestatic = False
    compiled = model.compile()
    data = mujoco.MjData(compiled)
    names = ("left_proximal", "left_distal", "right_proximal", "right_distal")
    rng = np.random.default_rng(3)
    for _ in range(20):
        angles = np.array([rng.uniform(*compiled.joint(name).range) for name in names])
        for name, angle in zip(names, angles, strict=True):
            data.joint(name).qpos = angle
        mujoco.mj_kinematics(compiled, data)
        palm, turned = data.body("palm_link").xpos, data.body("palm_link").xmat.reshape(3, 3)
        ours = robot.hand_angles(angles)
        assert (hand.limits[:, 0] <= ours).all()
        assert (ours <= hand.limits[:, 1]).all()
        np.testing.assert_allclose(robot.file_angles(ours), angles, atol=1e-12)
        for side, finger, place in zip(("left", "right"), hand.fingers, hand.slices, strict=True):
            there = [data.body(f"{side}_{part}").xpos for part in ("base", "end", "tip")]
            local = (np.array(there) - palm) @ turned
            expected = local[:, :2] - (0.0, 0.04)
            np.testing.assert_allclose(joint_positions(finger, ours[place]), expected, atol=1e-9)
            base = data.body(f"{side}_base")
            corners = np.array([(x, y, 0) for x in (0.006, 0.068) for y in (-0.009, 0.009)])
            world = corners @ base.xmat.reshape(3, 3).T + base.xpos
            link = link_polygons(hand, finger, ours[place])[0]
            away = np.linalg.norm(((world - palm) @ turned)[:, None, :2] - (0.0, 0.04) - link, axis=-1)
            assert away.min(axis=1).max() < 1e-8


def test_an_mjcf_file_of_the_same_hand_is_the_same_hand(gripper: HandSpec, tmp_path: Path) -> None:
    path = copied(tmp_path)
    (tmp_path / "gripper.xml").write_text(gripper_mjcf(gripper), encoding="utf-8")
    edited(path, ('"gripper.urdf"', '"gripper.xml"'), ("friction", 'palm_x = "-y"\npalm_y = "x"\nfriction'))
    assert_same_hand(load_hand(path), gripper)


def test_motors_of_an_mjcf_file_limit_the_torque(gripper: HandSpec, tmp_path: Path) -> None:
    path = copied(tmp_path)
    names = [f"{side}_{joint}" for side in ("left", "right") for joint in ("proximal", "distal")]
    motors = "".join(f'<motor joint="{name}" gear="5" forcerange="-0.06 0.06"/>' for name in names)
    text = gripper_mjcf(gripper).replace('actuatorfrcrange="-0.4 0.4"', "").replace(' damping="0.12"', "")
    text = text.replace("</worldbody>", f"</worldbody><actuator>{motors}</actuator>")
    (tmp_path / "gripper.xml").write_text(text, encoding="utf-8")
    edited(path, ('"gripper.urdf"', '"gripper.xml"'), ("friction", 'palm_x = "-y"\npalm_y = "x"\nfriction'))
    hand = load_hand(path)
    assert hand.torque == pytest.approx(0.3)
    assert hand.damping == parse_hand_name("2v2_50.50_50.50_1.1_53").damping


def test_numbers_of_the_hand_file_come_before_those_of_the_robot_file(tmp_path: Path) -> None:
    path = copied(tmp_path)
    given = (
        "damping = 0.2\ntorque_nm = 0.3\nstiffness = 4\narmature_kg_m2 = 0.002\nthickness_mm = 25\nlink_mass_kg = 0.05"
    )
    edited(path, ("friction = 0.6", f"friction = 0.7\n{given}"))
    edited(tmp_path / "gripper.urdf", ('<dynamics damping="0.12" friction="0"/>', ""))
    hand = load_hand(path)
    assert (hand.friction, hand.damping, hand.torque, hand.stiffness) == (0.7, 0.2, 0.3, 4.0)
    assert (hand.armature, hand.thickness, hand.link_mass) == (0.002, 0.025, 0.05)
    assert hand.left.masses is hand.right.masses is None


def test_joints_without_limits_turn_freely(tmp_path: Path) -> None:
    path = copied(tmp_path)
    edited(tmp_path / "gripper.urdf", ('type="revolute"', 'type="continuous"'))
    np.testing.assert_allclose(load_hand(path).limits, np.tile([-np.pi, np.pi], (4, 1)))


def test_the_engine_takes_masses_and_palm_from_the_spec(gripper: HandSpec) -> None:
    model = build_model(gripper, parse_object_name("cube_39"), SceneSpec())
    masses = [float(model.body(f"{side}_{i}").mass[0]) for side in ("left", "right") for i in range(2)]
    np.testing.assert_allclose(masses, [0.042, 0.03, 0.042, 0.03])
    assert model.geom("palm").type == mujoco.mjtGeom.mjGEOM_MESH
    vertices = model.mesh("palm")
    first, count = int(vertices.vertadr[0]), int(vertices.vertnum[0])
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geom = data.geom("palm")
    world = model.mesh_vert[first : first + count] @ geom.xmat.reshape(3, 3).T + geom.xpos
    low, high = [-0.045, -0.04, 0.05 - 0.015], [0.045, 0.012, 0.05 + 0.015]
    np.testing.assert_allclose([world.min(axis=0), world.max(axis=0)], [low, high], atol=1e-6)


def test_pybullet_takes_masses_and_outlines_from_the_spec_too(gripper: HandSpec) -> None:
    pytest.importorskip("pybullet", reason='PyBullet is an extra: pip install "inhand[bullet]"')
    engine = load_pybullet()
    hand = replace(gripper, palm=((-0.045, -0.04), (0.045, -0.04), (0.03, 0.0), (-0.03, 0.0)))
    client = engine.connect(engine.DIRECT)
    try:
        world = build_world(engine, client, hand, parse_object_name("cube_39"), SceneSpec())
        masses = [engine.getDynamicsInfo(world.hand, link, physicsClientId=client)[0] for link in range(4)]
        kinds = [engine.getCollisionShapeData(world.hand, link, physicsClientId=client)[0][2] for link in (-1, 0, 1)]
    finally:
        engine.disconnect(client)
    np.testing.assert_allclose(masses, [0.042, 0.03, 0.042, 0.03])
    assert kinds == [engine.GEOM_MESH, engine.GEOM_BOX, engine.GEOM_MESH]


def squared(hand: HandSpec) -> HandSpec:
    """The gripper with square-ended fingertips, so that a face can lie flat on a face."""
    square = ((-0.009, 0.006), (0.009, 0.006), (0.009, 0.065), (-0.009, 0.065))
    fingers = [replace(finger, outlines=(square, square)) for finger in hand.fingers]
    return replace(hand, left=fingers[0], right=fingers[1])


@pytest.mark.parametrize("square", [False, True])
@pytest.mark.parametrize("thing", ["cube_39", "ellipse_40x25"])
def test_a_tip_of_any_outline_touches_where_it_should(gripper: HandSpec, thing: str, *, square: bool) -> None:
    hand = squared(gripper) if square else gripper
    spec = parse_object_name(thing)
    points, normals = outline(spec, 0.004)
    points = points + hand.start_position
    touched = 0
    for finger in hand.fingers:
        found = touch(hand, finger, points, normals)
        for k in np.flatnonzero(found.reached):
            link = link_polygons(hand, finger, found.joints[k])[-1]
            tangent = np.array([-normals[k, 1], normals[k, 0]])
            body = np.array([tangent, -tangent, -tangent - normals[k], tangent - normals[k]])
            gap, _, _ = contact(link, points[k] + 0.05 * body[::-1])
            assert abs(gap) < 2e-5
            away = (link - points[k]) @ normals[k]
            along = ((link - points[k]) @ tangent)[away < 5e-5]
            assert along.min() - 1e-4 < 0 < along.max() + 1e-4
            touched += 1
    assert touched > len(points) // 2


def test_the_support_runs_along_a_face_without_a_jump() -> None:
    square = np.array([(-0.01, 0.0), (0.01, 0.0), (0.01, 0.06), (-0.01, 0.06)])
    angle = np.linspace(-0.002, 0.002, 4001)
    support = outline_support(square, np.zeros_like(angle), np.stack([np.sin(angle), np.cos(angle)], axis=-1))
    np.testing.assert_allclose(support[[0, 2000, -1]], [(-0.01, 0.06), (0.0, 0.06), (0.01, 0.06)], atol=1e-9)
    assert np.abs(np.diff(support[:, 0])).max() < 2e-5
    turned = outline_support(square, np.array(0.5), np.array([np.sin(0.3), np.cos(0.3)]))
    corner = transform(np.array([0.0, 0.0, 0.5]), square)
    np.testing.assert_allclose(turned, corner[(corner @ [np.sin(0.3), np.cos(0.3)]).argmax()], atol=1e-12)


SOLIDS: dict[str, tuple[str, Callable[[Array], Array]]] = {
    "sphere": ("0.01", lambda u: 0.01 * u),
    "ellipsoid": ("0.01 0.02 0.005", lambda u: u * (0.01, 0.02, 0.005)),
    "capsule": ("0.01 0.02", lambda u: 0.01 * u + np.sign(u[:, 2:]) * (0, 0, 0.02)),
    "cylinder": ("0.01 0.02", lambda u: u / np.linalg.norm(u[:, :2], axis=1)[:, None] * (0.01, 0.01, 0) + lids(u)),
    "box": ("0.01 0.02 0.005", lambda u: np.sign(u) * (0.01, 0.02, 0.005)),
}


def lids(u: Array) -> Array:
    return np.sign(u[:, 2:]) * (0, 0, 0.02)


@pytest.mark.parametrize("kind", [*SOLIDS, "mesh"])
def test_the_outline_of_a_tilted_solid_reaches_as_far_as_the_solid(kind: str) -> None:
    rng = np.random.default_rng(5)
    directions = rng.normal(size=(20000, 3))
    size, surface = SOLIDS["box" if kind == "mesh" else kind]
    samples = surface(directions / np.linalg.norm(directions, axis=1)[:, None])
    corners = " ".join(f"{x:.9g}" for x in np.unique(np.round(samples, 9), axis=0).ravel()) if kind == "mesh" else ""
    shape = f'type="{kind}" size="{size}"' if kind != "mesh" else 'type="mesh" mesh="m"'
    asset = f'<asset><mesh name="m" vertex="{corners}"/></asset>' if kind == "mesh" else ""
    text = f'<geom {shape} pos="0.1 0.2 0.3" euler="20 40 60"/>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{asset}<worldbody><body>{text}</body></worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    points = solid_points(model, data, collision_geoms(model, [1]), np.eye(3)) - (0.1, 0.2, 0.3)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[0] if kind != "mesh" else euler_quaternion())
    world = samples @ turn.reshape(3, 3).T
    for way in (*rotate(np.arange(32) * 2 * np.pi / 32, (1.0, 0.0)),):
        assert (points[:, :2] @ way).max() == pytest.approx((world[:, :2] @ way).max(), abs=1e-4)
    np.testing.assert_allclose(np.ptp(points[:, 2]), np.ptp(world[:, 2]), atol=1e-4)


def euler_quaternion() -> Array:
    """The turn of the tilted solids; MuJoCo's own geom frame of a mesh is that of its inertia."""
    quaternion = np.zeros(4)
    mujoco.mju_euler2Quat(quaternion, np.deg2rad([20.0, 40.0, 60.0]), "xyz")
    return quaternion


def test_a_geom_without_an_outline_is_refused() -> None:
    field = '<asset><hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/></asset>'
    body = '<body><geom name="field" type="hfield" hfield="h"/></body>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{field}<worldbody>{body}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    with pytest.raises(InputError, match="geom 'field' is of type mjGEOM_HFIELD, which has no outline; use boxes"):
        solid_points(model, data, [0], np.eye(3))


@pytest.mark.parametrize("said", ['size="1e200"', 'size="0.1" pos="0 0 -1e180"'])
def test_a_geom_that_no_hand_can_have_is_refused(said: str) -> None:
    text = f'<mujoco><worldbody><body><geom name="tip" type="sphere" mass="1" {said}/></body></worldbody></mujoco>'
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    with pytest.raises(InputError, match=r"geom 'tip' is 1e.* m large, or as far away"):
        solid_points(model, data, [0], np.eye(3))


def ring(count: int) -> Array:
    angle = np.arange(count) * 2 * np.pi / count
    return np.stack([0.02 * np.cos(angle), 0.02 * np.sin(angle)], axis=-1)


def test_an_outline_of_many_points_is_thinned_within_its_tolerance() -> None:
    corners = np.array(convex_outline(np.concatenate([ring(2000), 0.3 * ring(7)])))
    assert len(corners) < 200
    inner = np.linalg.norm((corners + np.roll(corners, -1, axis=0)) / 2, axis=-1)
    assert inner.min() > 0.02 - 4 * FLATTENING
    np.testing.assert_array_equal(convex_outline(np.array([(0, 0), (1, 0), (0.5, 0), (1, 1), (0, 1)])), ring4())


def ring4() -> list[tuple[float, float]]:
    return [(0, 0), (1, 0), (1, 1), (0, 1)]


def test_the_example_carries_a_cube_in_all_directions(tmp_path: Path) -> None:
    settings = config.AsteriskConfig(hand=str(GRIPPER), directions="train", trials=1)
    trials = run.simulate(settings, run.prepare(settings))
    results = [result_of_trial(trial) for trial in trials]
    assert all(result.kept for result in results)
    assert min(result.metrics.max_distance_mm for result in results) > 40
    save_trial(trials[0], tmp_path / "trial.npz")
    again = load_trial(tmp_path / "trial.npz").passport
    assert again.hand == trials[0].passport.hand
    assert hash(again.hand) == hash(trials[0].passport.hand)


def test_the_example_opens_wide_and_bends_inwards(gripper: HandSpec) -> None:
    assert 0.1 < widest_opening(gripper) < 0.27
    point = np.array([[-0.02, 0.0]]) + gripper.start_position
    joints = touch(gripper, gripper.left, point, np.array([[-1.0, 0.0]])).joints
    assert joints[0, 1] < 0
    assert -np.pi / 2 < link_angles(joints)[0, 1] < 0


TOML_REFUSALS = [
    ('"gripper.urdf"', '"griper.urdf"', "no robot file {folder}/griper.urdf: robot names a URDF or MJCF file"),
    ('"gripper.urdf"', '"gripper.toml"', "unknown ending '.toml'; allowed are .urdf, .xml, .mjcf"),
    ('"palm_link"', '"palm_lnk"', "no body or site 'palm_lnk' for palm; did you mean palm_link?; the file has world,"),
    ('"left_distal"', '"left_dist"', "no joint 'left_dist' for [left] joints; did you mean left_distal"),
    ('tip = "left_tip"', 'tip = "left_tp"', "no body or site 'left_tp' for [left] tip; did you mean left_tip"),
    (
        'tip = "left_tip"',
        'tip = "left_base"',
        "the tip 'left_base' is not fixed to the link of 'left_distal', the last",
    ),
    ('"left_proximal", "left_distal"', '"left_distal"', "[left] names 1 joints; a finger has 2 or 3, from the palm"),
    (
        '"left_proximal", "left_distal"',
        '"left_distal", "left_proximal"',
        "joint 'left_proximal' does not hang from the link of 'left_distal'; name the joints of [left] from the palm",
    ),
    ('"left_distal"', '"right_distal"', "joint 'right_distal' does not hang from the link of 'left_proximal'; name"),
    ('palm = "palm_link"', 'palm = "left_base"', "the palm 'left_base' moves: hinge joint 'left_proximal' is above it"),
    ('palm = "palm_link"', 'palm = "palm_link"\npalm_x = "z"', "the axis of joint 'left_proximal' leans 90.0 deg from"),
    (
        'palm = "palm_link"',
        'palm = "palm_link"\npalm_x = "-y"',
        "palm_x = '-y' and palm_y = 'y'; name two different axes",
    ),
    (
        'palm = "palm_link"',
        'palm = "palm_link"\npalm_y = "up"',
        "palm_y = 'up'; it must be an axis of the palm's body: x",
    ),
    (
        'palm = "palm_link"',
        'palm = "palm_link"\npalm_x = "-x"',
        "the left finger starts at x = 30 mm and the right one at",
    ),
    (
        "friction",
        "link_width_mm = 20\nfriction",
        "unknown key 'link_width_mm'; allowed are name, robot, palm, left, right",
    ),
    ('palm = "palm_link"', "", "no 'palm'; it must give name, robot, palm, left, right"),
    ('tip = "left_tip"', "", "[left]: no 'tip'; it must give joints, tip"),
    (
        '["left_proximal", "left_distal"]',
        '"left_proximal"',
        "[left]: joints = 'left_proximal'; it must be a list of names",
    ),
]


@pytest.mark.parametrize(("old", "new", "text"), TOML_REFUSALS)
def test_what_a_robots_hand_file_may_not_say(tmp_path: Path, old: str, new: str, text: str) -> None:
    path = copied(tmp_path)
    edited(path, (old, new))
    with pytest.raises(InputError, match=re.escape(text.format(folder=tmp_path))):
        load_hand(path)


END = '<limit lower="-0.3" upper="2.4" effort="0.4" velocity="6"/>'
MOUNT = """<link name="mount"/>
  <joint name="mount_to_palm" type="fixed">
    <parent link="mount"/>"""
NAIL = """
  <joint name="more" type="continuous"><parent link="left_end"/><child link="nail"/></joint>
  <link name="nail"><collision><geometry><sphere radius="0.01"/></geometry></collision></link>
</robot>"""
GONE = re.compile(r"<collision>.*?</collision>", flags=re.DOTALL)
URDF_REFUSALS = [
    (
        '"mount_to_palm" type="fixed"',
        '"mount_to_palm" type="revolute"',
        "the palm 'palm_link' moves: hinge joint 'mount_t",
    ),
    (
        MOUNT,
        MOUNT.replace("fixed", "floating").replace('mount"', 'world"'),
        "the palm 'palm_link' moves: free joint 'mount_to",
    ),
    (
        '"left_distal" type="revolute"',
        '"left_distal" type="prismatic"',
        "joint 'left_distal' is of type slide; joints of",
    ),
    (
        '<axis xyz="0 0 -1"/>',
        '<axis xyz="0 0.1 -1"/>',
        "the axis of joint 'left_proximal' leans 5.7 deg from the palm's z",
    ),
    (
        "</robot>",
        NAIL,
        "joint 'more' moves a part of the left finger and is not named; name it",
    ),
    (
        END,
        f'{END}<mimic joint="left_proximal"/>',
        "is coupled to another (URDF: mimic; MJCF: equality); every joint of a",
    ),
    (
        '<origin xyz="0.065 0 0"/>',
        '<origin xyz="0 0 0.065"/>',
        "link 1 of the left finger is 0 mm long, from the axis of",
    ),
    ('<link name="left_tip"/>', "<link/>", "is not a robot that MuJoCo reads: "),
    ("</robot>", "", "is not a robot that MuJoCo reads: "),
]


@pytest.mark.parametrize(("old", "new", "text"), URDF_REFUSALS)
def test_what_a_robot_file_may_not_be(tmp_path: Path, old: str, new: str, text: str) -> None:
    path = copied(tmp_path)
    edited(tmp_path / "gripper.urdf", (old, new))
    with pytest.raises(InputError, match=re.escape(text)) as caught:
        load_hand(path)
    assert str(tmp_path / "gripper.urdf") in str(caught.value)


@pytest.mark.parametrize(("link", "text"), [("left_end", "link 1 of the left finger ("), ("palm_link", "the palm (")])
def test_parts_without_collision_geoms_are_refused(tmp_path: Path, link: str, text: str) -> None:
    path = copied(tmp_path)
    robot = tmp_path / "gripper.urdf"
    before, found, after = robot.read_text(encoding="utf-8").partition(f'<link name="{link}">')
    body, end, rest = after.partition("</link>")
    robot.write_text(before + found + GONE.sub("", body) + end + rest, encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(text) + ".* has no collision geoms, .*add <collision>"):
        load_hand(path)


def test_joints_of_different_damping_ask_for_one(tmp_path: Path) -> None:
    path = copied(tmp_path)
    text = (tmp_path / "gripper.urdf").read_text(encoding="utf-8").replace('damping="0.12"', 'damping="0.2"', 1)
    (tmp_path / "gripper.urdf").write_text(text, encoding="utf-8")
    with pytest.raises(
        InputError, match=r"joints have the damping 0\.2, 0\.12, 0\.12, 0\.12; .*give damping in the hand"
    ):
        load_hand(path)
    edited(path, ("friction", "damping = 0.15\nfriction"))
    assert load_hand(path).damping == 0.15


def test_a_joint_between_palm_and_finger_must_be_named(tmp_path: Path, gripper: HandSpec) -> None:
    path = copied(tmp_path)
    extra = '<body name="spread" pos="0 0 0"><inertial pos="0 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/>'
    text = gripper_mjcf(gripper).replace(
        '<body name="left_base"', f'{extra}<joint name="spreads"/><body name="left_base"'
    )
    text = text.replace('<body name="right_base"', '</body><body name="right_base"')
    (tmp_path / "gripper.xml").write_text(text, encoding="utf-8")
    edited(path, ('"gripper.urdf"', '"gripper.xml"'), ("friction", 'palm_x = "-y"\npalm_y = "x"\nfriction'))
    with pytest.raises(InputError, match="joint 'spreads' moves a part of the left finger and is not named"):
        load_hand(path)


def test_a_hand_that_names_no_robot_is_no_robots_hand() -> None:
    with pytest.raises(InputError, match=r"hand\.toml: no 'robot'; a robot's hand names its URDF or MJCF file"):
        load_robot(EXAMPLES / "hand.toml")


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (
            {"outlines": (((0.0, 0.0), (0.0, 0.01), (0.01, 0.0)),) * 2},
            "link 0 of the left finger is not convex and count",
        ),
        ({"outlines": ()}, "0 outlines for the 2 links of the left finger; give one for each link, or None"),
        ({"masses": (0.1, 0.0)}, "link 1 of the left finger has a mass of 0 kg; it must be positive"),
    ],
)
def test_parts_that_no_hand_has_are_refused(gripper: HandSpec, changes: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        replace(gripper, left=replace(gripper.left, **changes))
    with pytest.raises(InputError, match="the palm is not convex"):
        replace(gripper, palm=((0.0, 0.0), (1.0, 0.0)))


BOX = '<box size="0.062 0.018 0.03"/>'
LIMITS = '<limit lower="0.1" upper="2.8" effort="0.4" velocity="6"/>'
TIP = '<link name="left_tip"/>'
SHOWN = '<link name="left_tip"><visual><geometry><mesh filename="{}"/></geometry></visual></link>'
OBJ = "".join(f"v {x} {y} {z}\n" for x in (-31, 31) for y in (-9, 9) for z in (-15, 15)) + "".join(
    f"f {a} {b} {c}\n" for a, b, c in ((1, 2, 4), (5, 6, 8), (1, 3, 7), (2, 4, 6))
)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (BOX, '<mesh filename="m/link.dae"/>', "line 52: <mesh> is 'm/link.dae', a kind of mesh that MuJoCo does not"),
        (BOX, '<mesh filename="package://p/gone.stl"/>', "<mesh> 'package://p/gone.stl' is not there, looked for as "),
        (BOX, '<mesh filename="link.obj"/>', "62000 mm, too large: it may be 1 to 1,000 mm; check the unit: a mesh in"),
        (LIMITS, '<limit lower="0" upper="0"/>', "'left_proximal' has the limits 0 to 0, between which it cannot move"),
        (
            'xyz="0.07 0 0"',
            'xyz="${length} 0 0"',
            "is xacro that was not expanded (xyz = '${length} 0 0'): run `xacro g",
        ),
        ('xyz="0.07 0 0"', 'xyz="nan 0 0"', "line 58: <origin> has xyz = 'nan 0 0': give finite numbers"),
        (
            'xyz="0.07 0 0"',
            'xyz="70 0 0"',
            "link 0 of the left finger is 70000 mm, too large: it may be 1 to 1,000 mm;",
        ),
        ("</robot>", "<a>" * 200 + "</a>" * 200 + "</robot>", "more than 100 elements lie in each other"),
        ("</robot>", "<link/>" * 1000 + "</robot>", "has more than 1000 bodies and shapes"),
    ],
)
def test_robot_files_that_no_hand_comes_from_say_why(tmp_path: Path, old: str, new: str, text: str) -> None:
    path = copied(tmp_path)
    (tmp_path / "link.obj").write_text(OBJ, encoding="utf-8")
    edited(tmp_path / "gripper.urdf", (old, new))
    with pytest.raises(InputError, match=re.escape(text)):
        load_hand(path)


def first_link(hand: HandSpec) -> Array:
    assert hand.left.outlines is not None
    return np.array(hand.left.outlines[0])


@pytest.mark.parametrize("place", ["link.obj", "mine/meshes/link.obj", "ros/mine/meshes/link.obj"])
def test_a_packages_mesh_is_found(
    tmp_path: Path, gripper: HandSpec, place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = copied(tmp_path)
    (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / place).write_text(OBJ, encoding="utf-8")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ros"))
    named = "link.obj" if place == "link.obj" else "package://mine/meshes/link.obj"
    edited(tmp_path / "gripper.urdf", (BOX, f'<mesh filename="{named}" scale="0.001 0.001 0.001"/>'))
    np.testing.assert_allclose(first_link(load_hand(path)), first_link(gripper), atol=1e-8)


@pytest.mark.parametrize("shape", [SHOWN.format("gone.dae"), None])
def test_what_only_decorates_or_has_no_size_is_left_out(tmp_path: Path, gripper: HandSpec, shape: str | None) -> None:
    path = copied(tmp_path)
    empty = '<link name="left_tip"><collision><geometry><box size="0 0 0"/></geometry></collision></link>'
    edited(tmp_path / "gripper.urdf", (TIP, shape or empty))
    robot = load_robot(path)
    assert robot.hand == gripper
    what = "meshes for show only" if shape else "collision shapes of no size"
    assert robot.notes == (f"gripper.urdf: 1 {what} are left out.",)


LACKING = (
    '<geom type="mesh" mesh="shell" contype="0" conaffinity="0"/><geom type="mesh" mesh="skin" class="shown"/>'
    '<geom type="box" size="0 0 0"/><geom size="0"/>'
)
ASSETS = (
    '<default><default class="shown"><geom contype="0" conaffinity="0"/></default></default><asset>'
    '<mesh file="shell.stl"/><mesh name="skin" file="outside.dae"/></asset><worldbody>'
)


def lacking(folder: Path, gripper: HandSpec, *changes: tuple[str, str]) -> Path:
    """The example's hand as an MJCF file that lacks meshes, with some words in place of others."""
    path, robot = copied(folder), folder / "gripper.xml"
    robot.write_text(gripper_mjcf(gripper), encoding="utf-8")
    edited(robot, ("<worldbody>", ASSETS), ('<site name="left_tip"', f'{LACKING}<site name="left_tip"'), *changes)
    edited(path, ("gripper.urdf", "gripper.xml"), ("friction", 'palm_x = "-y"\npalm_y = "x"\nfriction'))
    return path


def test_an_mjcf_file_may_lack_meshes_for_show_and_have_shapes_of_no_size(tmp_path: Path, gripper: HandSpec) -> None:
    path = lacking(tmp_path, gripper)
    robot = load_robot(path)
    assert_same_hand(robot.hand, gripper)
    counts = ("2 meshes for show only are", "2 collision shapes of no size are")
    assert robot.notes == tuple(f"gripper.xml: {count} left out." for count in counts)
    assert assumed([str(path)]) == robot.notes


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"shell" contype="0" conaffinity="0"', '"shell"', "mesh 'shell' 'shell.stl' is not there, looked for as "),
        (
            ' class="shown"/>',
            "/>",
            "'skin' is 'outside.dae', a kind of mesh that MuJoCo does not read; allowed are .obj,",
        ),
        ('size="0 0 0"', 'size="0.1 0 0"', "a box of body 'left_end' has the size [0.1, 0.0, 0.0]: give positive"),
    ],
)
def test_what_an_mjcf_file_may_not_lack(tmp_path: Path, gripper: HandSpec, old: str, new: str, told: str) -> None:
    with pytest.raises(InputError, match=re.escape(told)):
        load_hand(lacking(tmp_path, gripper, (old, new)))


def test_the_case_of_the_ending_does_not_matter(tmp_path: Path, gripper: HandSpec) -> None:
    path = copied(tmp_path)
    (tmp_path / "gripper.urdf").rename(tmp_path / "gripper.URDF")
    edited(path, ("gripper.urdf", "gripper.URDF"))
    assert load_hand(path) == gripper


def test_the_scale_of_a_robot_file_scales_every_length(tmp_path: Path, gripper: HandSpec) -> None:
    path = copied(tmp_path)
    edited(path, ("friction", "scale = 0.5\nfriction"))
    small = load_hand(path)
    np.testing.assert_allclose(small.left.links, np.array(gripper.left.links) / 2)
    np.testing.assert_allclose([small.palm_width, small.thickness], [gripper.palm_width / 2, gripper.thickness / 2])
    edited(path, ("scale = 0.5", "scale = 0"))
    with pytest.raises(InputError, match="scale = 0; it must be positive"):
        load_hand(path)


def test_replicas_of_bodies_are_counted_before_they_are_made(tmp_path: Path, gripper: HandSpec) -> None:
    path = copied(tmp_path)
    many = '<replicate count="100000000" offset="1 0 0"><geom size="1"/></replicate></worldbody>'
    (tmp_path / "gripper.xml").write_text(gripper_mjcf(gripper).replace("</worldbody>", many), encoding="utf-8")
    edited(path, ("gripper.urdf", "gripper.xml"))
    with pytest.raises(InputError, match="more than 1000 bodies and shapes, with the replicas"):
        load_hand(path)
