"""Hands and objects from TOML files, and what is refused in them."""

import re
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from inhand.errors import InputError
from inhand.hands.files import assumed, load_hand, load_object
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import ObjectSpec, parse_object_name
from inhand.hands.spatial.files import object_name

HAND = """
name = "long fingers"
palm_width_mm = 60
link_width_mm = 20
joint_gap_mm = 0
link_mass_kg = 0.05
friction = 0.6
stiffness = 4
damping = 0.2
torque_nm = 0.3
[left]
links_mm = [80, 60.5]
limits_deg = [[-90, 90], [-120, 0]]
[right]
links_mm = [50, 50, 40]
"""
BLOCK = """
name = "block"
shape = "box"
size_mm = [30, 45, 96]
mass_kg = 0.045
friction = 0.8
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "spec.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_hand_file_gives_every_number_in_si(tmp_path: Path) -> None:
    hand = load_hand(write(tmp_path, HAND))
    assert hand.name == "long fingers"
    np.testing.assert_allclose(hand.left.links, (0.08, 0.0605))
    np.testing.assert_allclose(hand.right.links, (0.05, 0.05, 0.04))
    np.testing.assert_allclose(hand.left.limits, np.deg2rad([(-90, 90), (-120, 0)]))
    np.testing.assert_allclose(hand.right.limits, np.tile([-np.pi, np.pi], (3, 1)))
    assert (hand.palm_width, hand.link_width, hand.joint_gap) == (0.06, 0.02, 0.0)
    assert (hand.link_mass, hand.friction, hand.stiffness) == (0.05, 0.6, 4.0)
    assert (hand.damping, hand.torque, hand.palm_depth) == (0.2, 0.3, 0.053)


def test_a_short_hand_file_is_the_named_hand(tmp_path: Path) -> None:
    fingers = "[left]\nlinks_mm = [72, 72]\n[right]\nlinks_mm = [72, 72]"
    path = write(tmp_path, f'name = "2v2_50.50_50.50_1.1_53"\npalm_width_mm = 53.5\n{fingers}')
    assert load_hand(path) == load_hand(str(path)) == parse_hand_name("2v2_50.50_50.50_1.1_53")


def test_an_object_file_gives_every_number_in_si(tmp_path: Path) -> None:
    expected = ObjectSpec("block", "box", (0.03, 0.045, 0.096), mass=0.045, friction=0.8)
    assert load_object(write(tmp_path, BLOCK)) == load_object(str(write(tmp_path, BLOCK))) == expected


def test_an_object_file_may_leave_mass_and_friction_out(tmp_path: Path) -> None:
    spec = load_object(write(tmp_path, 'name = "e"\nshape = "ellipse"\nsize_mm = [40, 25, 100]'))
    assert spec == ObjectSpec("e", "ellipse", (0.04, 0.025, 0.1), mass=0.03, friction=1.0)


@pytest.mark.parametrize("name", ["2v2_50.50_50.50_1.1_53", "2v3_25.75_25.35.40_1.1_53:lab-limits"])
def test_a_hand_name_is_not_taken_for_a_file(name: str) -> None:
    assert load_hand(name) == parse_hand_name(name)


@pytest.mark.parametrize("name", ["cube_39", "cylinder_50.8", "box_30x45.5"])
def test_an_object_name_is_not_taken_for_a_file(name: str) -> None:
    assert load_object(name) == parse_object_name(name)


def test_mass_and_friction_may_stand_after_an_object(tmp_path: Path) -> None:
    heavy = load_object("cube_39:friction=0.6:mass_kg=0.1")
    assert heavy == replace(load_object("cube_39"), name="cube_39:friction=0.6:mass_kg=0.1", mass=0.1, friction=0.6)
    file = load_object(f"{write(tmp_path, BLOCK)}:friction=0.5")
    assert (file.name, file.friction, file.mass) == ("block:friction=0.5", 0.5, 0.045)
    for name, text in (
        ("cube_39:weight=1", r"object 'cube_39:weight=1': unknown key 'weight'; allowed are mass_kg, friction"),
        ("cube_39:mass_kg=light", r"mass_kg = 'light'; it must be a finite number"),
        ("cube_39:friction", r"unknown object 'cube_39:friction'.* after it as wanted :mass_kg=0\.05"),
        ("cube_39:mass_kg=0", "must be positive"),
        ("cub_39:mass_kg=1", "unknown object 'cub_39'; did you mean cube_39"),
        ("", "unknown object ''"),
    ):
        with pytest.raises(InputError, match=text):
            load_object(name)


def test_a_spec_that_was_changed_is_not_read_anew_by_its_name() -> None:
    changed = replace(load_object("cube_39:friction=0.61"), mass=0.1)
    assert load_object(object_name(changed)) == changed


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"no hand file nowhere\.toml: give the path of a TOML file, or a name without"
    ):
        load_hand("nowhere.toml")
    with pytest.raises(InputError, match=r"no object file .*missing.*: give the path of a TOML file"):
        load_object(tmp_path / "missing")
    with pytest.raises(InputError, match="no object file some/cube_39: "):
        load_object("some/cube_39")


def test_syntax_that_is_not_toml_says_where(tmp_path: Path) -> None:
    path = write(tmp_path, 'name = "h"\npalm_width_mm = = 3')
    with pytest.raises(InputError, match=re.escape(f"{path} is not a TOML file: ") + r".*line 2.*; mend the file"):
        load_hand(path)
    path.write_bytes(b'name = "\xff"')
    with pytest.raises(InputError, match=r"is not a TOML file: .*utf-8.*; mend the file"):
        load_object(path)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("palm_width_mm", "palm_with_mm", ": unknown key 'palm_with_mm'; did you mean palm_width_mm"),
        ("damping = 0.2", "colour = 3", ": unknown key 'colour'; allowed are name, palm_width_mm, left, right, "),
        ("limits_deg", "limit_deg", " [left]: unknown key 'limit_deg'; did you mean limits_deg?; allowed are links_mm"),
        ('name = "long fingers"', "", ": no 'name'; it must give name, palm_width_mm, left, right"),
        ("[right]\nlinks_mm = [50, 50, 40]", "", ": no 'right'; it must give name, palm_width_mm, left, right"),
        ("links_mm = [80, 60.5]", "", " [left]: no 'links_mm'; it must give links_mm"),
        ("palm_width_mm = 60", 'palm_width_mm = "60"', ": palm_width_mm = '60'; it must be a finite number"),
        ("palm_width_mm = 60", "palm_width_mm = true", ": palm_width_mm = True; it must be a finite number"),
        ("palm_width_mm = 60", "palm_width_mm = nan", ": palm_width_mm = nan; it must be a finite number"),
        ("friction = 0.6", "friction = inf", ": friction = inf; it must be a finite number"),
        ("links_mm = [80, 60.5]", "links_mm = 80", " [left]: links_mm = 80; it must be a list of numbers"),
        ("links_mm = [80, 60.5]", "links_mm = []", " [left]: links_mm = []; it must be a list of numbers"),
        ("links_mm = [80, 60.5]", 'links_mm = [80, "a"]', " [left]: links_mm = 'a'; it must be a finite number"),
        (
            "[-120, 0]]",
            "[20, 20]]",
            " [left]: limits_deg of joint 1 is [20.0, 20.0]; it must be [low, high], low < high",
        ),
        ("[-120, 0]]", "[20]]", " [left]: limits_deg of joint 1 is [20.0]; it must be [low, high]"),
        ("[-120, 0]]", "20]", " [left]: limits_deg = 20; it must be a list of numbers"),
        (", [-120, 0]]", "]", " [left]: limits_deg must give [low, high] for each of the 2 joints"),
        ("link_mass_kg = 0.05", "link_mass_kg = 0", ": hand 'long fingers': link_mass is 0; it must be positive"),
        ("link_mass_kg = 0.05", "link_mass_kg = -1", ": hand 'long fingers': link_mass is -1; it must be positive"),
        ("friction = 0.6", "friction = -0.6", ": hand 'long fingers': friction is -0.6; it must be positive"),
        ("torque_nm = 0.3", "torque_nm = 0", ": hand 'long fingers': torque is 0; it must be positive"),
        (
            "link_width_mm = 20",
            "link_width_mm = -20",
            ": hand 'long fingers': link_width is -0.02; it must be positive",
        ),
    ],
)
def test_what_a_hand_file_may_not_say(tmp_path: Path, old: str, new: str, text: str) -> None:
    assert old in HAND
    path = write(tmp_path, HAND.replace(old, new))
    with pytest.raises(InputError, match=re.escape(f"hand file {path}{text}")):
        load_hand(path)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (
            "[80, 60.5]",
            "[80, 0]",
            "hand 'long fingers': a link of the left finger is 0 mm; it must be a positive length",
        ),
        ("[50, 50, 40]", "[50, 50, -40]", "hand 'long fingers': a link of the right finger is -40 mm"),
        ("[50, 50, 40]", "[90]", "hand 'long fingers': the right finger has 1 links; a finger has 2 or 3 links"),
        ("palm_width_mm = 60", "palm_width_mm = 0", "hand 'long fingers': the palm width is 0 mm"),
    ],
)
def test_lengths_of_a_hand_file_are_checked_as_any_hand(tmp_path: Path, old: str, new: str, text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        load_hand(write(tmp_path, HAND.replace(old, new)))


@pytest.mark.parametrize("line", ["joint_gap_mm = 90", "joint_gap_mm = 30\ntip_length_mm = 35", "tip_length_mm = 70"])
def test_a_gap_and_a_cap_longer_than_the_link_are_refused(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError, match="longer"):
        load_hand(write(tmp_path, HAND.replace("joint_gap_mm = 0", line)))


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("mass_kg", "mas_kg", "object file {}: unknown key 'mas_kg'; did you mean mass_kg?; allowed are name, shape, "),
        ('shape = "box"', "", "object file {}: no 'shape'; it must give name, shape, size_mm"),
        ("[30, 45, 96]", "[30, 45]", "object file {}: size_mm = [30.0, 45.0]; it must be [x, y, height] in mm"),
        ("[30, 45, 96]", '"30x45"', "object file {}: size_mm = '30x45'; it must be a list of numbers"),
        ("[30, 45, 96]", "[30, 45, false]", "object file {}: size_mm = False; it must be a finite number"),
        ("0.045", '"heavy"', "object file {}: mass_kg = 'heavy'; it must be a finite number"),
        ("0.8", "nan", "object file {}: friction = nan; it must be a finite number"),
        ("box", "bax", "object 'block': unknown shape 'bax'; allowed are box, cylinder, ellipse, polygon; did you"),
        ("[30, 45, 96]", "[30, 0, 96]", "object 'block': size [30, 0, 96] mm; size needs three positive lengths"),
        ("0.045", "-0.045", "object 'block': mass -0.045 kg; the mass must be positive"),
        ("0.8", "-0.8", "object 'block': friction -0.8; friction must be 0 or more"),
        ("box", "cylinder", "object 'block': a cylinder of 30 x 45 mm; give both diameters alike"),
    ],
)
def test_what_an_object_file_may_not_say(tmp_path: Path, old: str, new: str, text: str) -> None:
    assert old in BLOCK
    path = write(tmp_path, BLOCK.replace(old, new))
    with pytest.raises(InputError, match=re.escape(text.format(path))):
        load_object(path)


RING = 'name = "r"\nshape = "polygon"\nheight_mm = 60\ncorners_mm = '
COMB = [[0.4 * (k // 2) + 0.1 * (k % 2), 40.0 * (k % 2)] for k in range(160)] + [[32.0, -5.0], [0.0, -5.0]]
SQUARE = "x_mm,y_mm\n-18,-18\n18,-18\n18,18\n-18,18\n"
BAR = '<svg xmlns="http://www.w3.org/2000/svg" {}><path d="M0 0 H30 A5 5 0 0 1 30 10 H0 Z"/></svg>'
LONG = "[left]\nlinks_mm = [1e9, 72]\n[right]\nlinks_mm = [72, 72]"


def test_a_closed_ring_is_the_open_one(tmp_path: Path) -> None:
    corners = "[-18, -18], [18, -18], [18, 18], [-18, 18]"
    opened = load_object(write(tmp_path, f"{RING}[{corners}]"))
    assert load_object(write(tmp_path, f"{RING}[{corners}, [-18, -18]]")) == opened


@pytest.mark.parametrize("rows", [SQUARE, SQUARE + "-18,-18\n"])
def test_an_outline_in_a_csv_file_is_the_polygon_of_its_corners(tmp_path: Path, rows: str) -> None:
    (tmp_path / "square.CSV").write_text(rows, encoding="utf-8")
    corners = "[[-18, -18], [18, -18], [18, 18], [-18, 18]]"
    plain = load_object(write(tmp_path, RING.replace("60", "100").replace('"r"', '"square"') + corners))
    assert load_object(tmp_path / "square.CSV") == plain
    table = 'name = "square"\noutline = "square.CSV"\nheight_mm = 55\nmass_kg = 0.05\nfriction = 0.7'
    wanted = replace(plain, size=(0.036, 0.036, 0.055), mass=0.05, friction=0.7)
    assert load_object(write(tmp_path, table)) == wanted
    assert load_object(f"{tmp_path}/square.CSV:height_mm=55:mass_kg=0.05:friction=0.7") == wanted


def test_an_outline_has_the_unit_of_its_file_or_the_one_that_is_given(tmp_path: Path) -> None:
    (tmp_path / "bar.svg").write_text(BAR.format('viewBox="0 0 40 20" width="8cm"'), encoding="utf-8")
    bar = load_object(str(tmp_path / "bar.svg"))
    assert (bar.name, bar.shape) == ("bar", "polygon")
    np.testing.assert_allclose(bar.size, (0.07, 0.02, 0.1), rtol=1e-3)
    (tmp_path / "disc.svg").write_text('<svg><circle r="2cm"/></svg>', encoding="utf-8")
    assert len(load_object(tmp_path / "disc.svg").corners) == 64
    small = load_object(write(tmp_path, 'name = "b"\nshape = "polygon"\noutline = "bar.svg"\nunit = "mm"'))
    np.testing.assert_allclose(small.size, (0.035, 0.01, 0.1), rtol=1e-3)
    (tmp_path / "tri.csv").write_text("y,x\n0,0\n0,1.5\n1,0\n", encoding="utf-8")
    np.testing.assert_allclose(load_object(f"{tmp_path}/tri.csv:unit=in").size, (0.0381, 0.0254, 0.1))


@pytest.mark.parametrize(
    ("keys", "svg", "told"),
    [
        ("", "", 'outline {}/bar.svg: it says no unit; give that of its numbers, as unit = "mm" in the object'),
        (":unit=furlong", "", "unit = 'furlong'; allowed are mm, cm, m, in, pt, pc, px"),
        (":mass=0.05", "", "unknown key 'mass'; did you mean mass_kg?; allowed are name, shape, outline, unit"),
        (":unit=mm:mass_kg=5g", "", "mass_kg = '5g'; it must be a finite number"),
        (":unit=m", "", "outline is 35000 mm, too large: it may be 2 to 1,000 mm; check the unit"),
        (":shape=box", "", "shape = 'box'; with an outline it is 'polygon': leave it out"),
        (":unit=mm", BAR.format("").replace("Z", "M5 5 h1"), "jumps from (0, 10) to (5, 5), 7.07 of the file's units"),
        (":unit=mm", "<svg/>", "outline {}/bar.svg: it shows no path and no shape"),
    ],
)
def test_what_an_outline_may_not_be(tmp_path: Path, keys: str, svg: str, told: str) -> None:
    (tmp_path / "bar.svg").write_text(svg or BAR.format(""), encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(told.format(tmp_path))):
        load_object(f"{tmp_path}/bar.svg{keys}")


def test_an_outline_that_is_not_there_or_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"outline .*nothing\.dxf: there is no such file; give the path of a \.dxf"):
        load_object("nothing.dxf")
    with pytest.raises(InputError, match=r"unknown ending '\.step'; allowed are \.svg, \.csv, \.dxf"):
        load_object(write(tmp_path, 'name = "s"\noutline = "s.step"'))
    (tmp_path / "few.csv").write_text("x_mm,y_mm\n0,0\n0,1500\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"few\.csv, line 3: column y_mm holds 1500; it may be -1,000 to 1,000 mm"):
        load_object(tmp_path / "few.csv")


def test_what_is_assumed_of_hands_is_told_in_sentences(tmp_path: Path) -> None:
    plain, limited = "2v2_50.50_50.50_1.1_53", "2v2_50.50_50.50_1.1_53:lab-limits"
    partly = str(write(tmp_path, HAND))
    assert assumed([limited]) == ()
    (told,) = assumed([plain, limited, partly])
    assert told.startswith(f"No limits are given for joints of {plain}, {partly} (`limits_deg` in a hand file, `:lab-")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            RING + "[[0, 0], [0.036, 0], [0, 0.036]]",
            "larger side of its outline is 0.036 mm, too small: it may be 2 to",
        ),
        (RING + "[[0, 0], [1.4, 0], [0, 1.4]]", "1.4 mm, too small: it may be 2 to 1,000 mm; check the unit: files"),
        (RING + str(COMB), "convex pieces; it may have 32: leave out inward corners"),
        (RING + str([[k, k * k % 7] for k in range(1200)]), "an outline of 1,200 corners; it may have 1,000: leave"),
        (
            BLOCK.replace("[30,", "[1e-300,"),
            "size, x, is 1e-300 mm, too small: it may be 1 to 1,000 mm; check the unit",
        ),
        (BLOCK.replace("96]", "1001]"), "size, height, is 1001 mm, too large: it may be 1 to 1,000 mm"),
        (BLOCK.replace("0.045", "1e-12"), "mass is 1e-12 kg: masses are 0.0001 to 100 kg, 0.1 g to 100 kg; check the"),
        (BLOCK.replace("0.045", "101"), "mass is 101 kg: masses are"),
        (BLOCK.replace("0.045", "1" + "0" * 400), "it must be a finite number"),
        ("x = " + "[" * 5000, "its tables lie too deep in each other"),
    ],
)
def test_objects_of_another_unit_or_beyond_bounds_are_refused(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(InputError, match=re.escape(told)):
        load_object(write(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (f'name = "h"\npalm_width_mm = 53\n{LONG}', "a link of the left finger is 1e+09 mm, too large: it may be 1 to"),
        (HAND.replace("link_width_mm = 20", "link_width_mm = 0.02"), "link_width is 0.02 mm, too small: it may be 1"),
        (HAND.replace("link_mass_kg = 0.05", "link_mass_kg = 1e-5"), "link_mass is 1e-05 kg: masses are 0.0001 to"),
        ("x=" + "{a=" * 3000, "its tables lie too deep in each other"),
    ],
)
def test_hands_of_another_unit_or_beyond_bounds_are_refused(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(InputError, match=re.escape(told)):
        load_hand(write(tmp_path, text))


def test_a_spec_is_returned_as_it_is_and_other_things_are_refused() -> None:
    hand, thing = parse_hand_name("2v2_50.50_50.50_1.1_53"), parse_object_name("cube_39")
    assert load_hand(hand) is hand
    assert load_object(thing) is thing
    with pytest.raises(InputError, match="hand = 3: give a name, the path of a TOML file, or a spec"):
        load_hand(cast("str", 3))


def test_a_short_link_is_measured_against_the_cap_that_the_file_gives(tmp_path: Path) -> None:
    path = tmp_path / "hand.toml"
    fingers = "[left]\nlinks_mm = [40, 12]\n[right]\nlinks_mm = [40, 40]\n"
    text = 'name = "short"\npalm_width_mm = 50\ntip_length_mm = {tip}\n' + fingers
    path.write_text(text.format(tip=4))
    assert load_hand(path).tip_length == 0.004
    path.write_text(text.format(tip=8))
    with pytest.raises(InputError, match=r"hand file .*link 1 of the left finger is 12 mm long.* longer than 13 mm"):
        load_hand(path)
