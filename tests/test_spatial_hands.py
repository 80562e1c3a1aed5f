"""Hands, objects and gravity in space: what names and files mean, and what is refused."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import inhand
from inhand.cli.commands import HandsConfig, ObjectsConfig
from inhand.cli.lists import run_hands, run_objects
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial.files import is_spatial_hand, load_solid
from inhand.hands.spatial.gravity import GRAVITY, gravity_of
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.meshes import solid_of
from inhand.hands.spatial.names import CATALOGUE, STANDARD, parse_spatial_name
from inhand.hands.spatial.objects import CATALOGUE as SOLIDS
from inhand.hands.spatial.objects import inertia_of, parse_solid_name

TETRAHEDRON = "v 0 0 0\nv 40 0 0\nv 0 40 0\nv 0 0 40\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.mark.parametrize("name", CATALOGUE)
def test_hands_of_the_catalogue_have_their_fingers(name: str) -> None:
    hand = parse_spatial_name(name)
    assert len(hand.fingers) == int(name[0])
    assert hand.n_joints == sum(len(finger.links) for finger in hand.fingers) == len(hand.limits)
    assert hand.slices[-1].stop == hand.n_joints
    assert is_spatial_hand(name)
    assert is_spatial_hand(hand)


def test_the_standard_hand_is_that_of_the_notes() -> None:
    hand = parse_spatial_name(STANDARD)
    degrees = np.deg2rad([90, 210, 330])
    bases = np.array([finger.links[0].origin for finger in hand.fingers])
    np.testing.assert_allclose(bases, 0.04 * np.stack([np.cos(degrees), np.sin(degrees), 0 * degrees], -1), atol=1e-12)
    assert [link.origin[2] for link in hand.fingers[0].links] == [0.0, 0.0, 0.06]
    assert (hand.fingers[0].tip, hand.fingers[0].tip_radius) == ((0.0, 0.0, 0.06), 0.01)
    assert (hand.friction, hand.stiffness, hand.damping, hand.torque) == (0.9, 5.0, 0.15, 0.6)
    np.testing.assert_allclose(hand.start_position, (0, 0, 0.085))


def test_rows_of_fingers_face_each_other() -> None:
    first, second, thumb = parse_spatial_name("3f_60.60_2v1.40.80_10").fingers
    assert (first.links[0].origin, second.links[0].origin) == ((-0.02, 0.04, 0.0), (0.02, 0.04, 0.0))
    assert thumb.links[0].origin == (0.0, -0.04, 0.0)
    assert thumb.links[0].turn[3] == -first.links[0].turn[3] != 0


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("3f_60.60", "three or four parts"),
        ("1f_60.60_40_10", "is not a number of fingers from 2f to 6f"),
        ("3f_60,60_40_10", "is not lengths of links in whole mm"),
        ("3f_60.60_40.10.20_10", "has 2 angles, and '3f' asks for 3"),
        ("3f_60.60_2v2.40.80_10", "places 2 against 2 fingers, and '3f' asks for 3"),
        ("3f_60.60_round_10", "is not where fingers stand"),
        ("3f_60.60_40_ten", "is not the radius of the fingertips"),
        ("3f_6000.60_40_10", "too large"),
        ("3f_9.9.9.9.9.9_40_10", "at most 5"),
        ("3f_60.60_40.60.120.120_10", "places fingers 2 and 3 0.0 mm apart; links are 14 mm thick"),
        ("3f_60.60_2v1.13.80_10", "places fingers 1 and 2 13.0 mm apart"),
    ],
)
def test_names_that_are_no_hand_in_space_are_refused(name: str, text: str) -> None:
    with pytest.raises(InputError, match=text):
        parse_spatial_name(name)


def test_what_no_hand_has_is_refused() -> None:
    hand = parse_spatial_name(STANDARD)

    def refused(text: str, **changes: Any) -> None:
        with pytest.raises(InputError, match=text):
            replace(hand, **changes)  # every number is checked when a hand is made

    finger = hand.fingers[0]
    refused("two or more", fingers=(finger,))
    refused("two fingers of one name", fingers=(finger, finger))
    again = replace(finger, name="another")
    refused("all begin at one place", fingers=(finger, again))
    refused("stiffness is 0", stiffness=0.0)
    bent = replace(finger, links=(replace(finger.links[0], axis=(1.0, 1.0, 0.0)), *finger.links[1:]))
    refused("not of length 1", fingers=(bent, hand.fingers[1]))
    wrong = replace(finger, links=(replace(finger.links[0], limits=(1.0, 0.5)), *finger.links[1:]))
    refused("lower angle first", fingers=(wrong, hand.fingers[1]))
    refused("no links", fingers=(replace(finger, links=()), hand.fingers[1]))


@pytest.mark.parametrize("name", SOLIDS)
def test_objects_of_the_catalogue_are_solids(name: str) -> None:
    spec = parse_solid_name(name)
    assert (np.linalg.eigvalsh(inertia_of(spec)) > 0).all()


def test_names_say_the_third_dimension() -> None:
    assert parse_solid_name("cube_50").size == (0.05, 0.05, 0.05)
    assert parse_solid_name("box_40x50x60").size == (0.04, 0.05, 0.06)
    assert parse_solid_name("cylinder_50x60").size == (0.05, 0.05, 0.06)
    heavy = load_solid("sphere_50:mass_kg=0.15:friction=0.6")
    assert heavy.name == "sphere_50:mass_kg=0.15:friction=0.6"
    assert (heavy.mass, heavy.friction, heavy.size) == (0.15, 0.6, (0.05, 0.05, 0.05))


def test_programs_get_hands_and_objects_of_both_kinds() -> None:
    hand, cube = inhand.hand(STANDARD), inhand.object("cube_50:friction=0.6", STANDARD)
    assert hand == inhand.hand(hand) == parse_spatial_name(STANDARD)
    assert cube == inhand.object(cube) == load_solid("cube_50:friction=0.6")
    assert inhand.object("cube_50", hand) == inhand.object("cube_50", inhand.hand(STANDARD)) != inhand.object("cube_50")
    planar = inhand.hand("2v2_50.50_50.50_1.1_53")
    assert planar == inhand.hand(planar)
    assert inhand.object("cube_50", planar) == inhand.object("cube_50", planar.name) == inhand.object("cube_50")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("cylinder_50", "gives 1 lengths, and a cylinder in space has 2"),
        ("cube_39x39", "gives 2 lengths, and a cube in space has 1"),
        ("spere_50", "did you mean sphere_50"),
        ("cube_50:weight=1", "unknown key 'weight'"),
        ("cube_50:mass_kg=light", "must be a finite number"),
        ("cube_50:mass_kg=0", "must be positive"),
        ("cube_50000", "too large"),
    ],
)
def test_names_that_are_no_solid_are_refused(name: str, text: str) -> None:
    with pytest.raises(InputError, match=text):
        load_solid(name)


def box_corners(size: Array) -> Array:
    return np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size


def test_a_mesh_has_the_mass_points_of_its_solid() -> None:
    mesh, box = solid_of("part", box_corners(np.array([0.03, 0.04, 0.06]))), parse_solid_name("box_30x40x60")
    np.testing.assert_allclose(mesh.size, box.size)
    np.testing.assert_allclose(inertia_of(mesh), inertia_of(box), atol=1e-12)
    assert mesh.mesh is not None
    corners = np.array(mesh.mesh.corners)
    np.testing.assert_allclose(corners.mean(axis=0), 0, atol=1e-12)
    a, b, c = (corners[np.array(mesh.mesh.triangles)[:, k]] for k in range(3))
    assert (np.einsum("fi,fi->f", np.cross(b - a, c - a), a + b + c) > 0).all()  # seen from outside


def stl(text: str) -> str:
    """Return an OBJ text as an ASCII STL."""
    lines = text.splitlines()
    points = [line[2:] for line in lines if line.startswith("v ")]
    rows = [[points[int(k) - 1] for k in line.split()[1:]] for line in lines if line.startswith("f ")]
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {p}\n" for p in row) + "endloop\nendfacet\n"
        for row in rows
    )
    return f"solid part\n{facets}endsolid part\n"


def test_meshes_are_read_from_files(tmp_path: Path) -> None:
    (tmp_path / "part.obj").write_text(TETRAHEDRON, encoding="utf-8")
    (tmp_path / "part.stl").write_text(stl(TETRAHEDRON), encoding="utf-8")
    (tmp_path / "part.toml").write_text('name = "wedge"\nmesh = "part.stl"\nmass_kg = 0.07\n', encoding="utf-8")
    first = load_solid(f"{tmp_path}/part.obj:mass_kg=0.07")
    second, third = load_solid(f"{tmp_path}/part.stl:unit=cm"), load_solid(tmp_path / "part.toml")
    np.testing.assert_allclose(first.size, (0.04, 0.04, 0.04))
    np.testing.assert_allclose(second.size, (0.4, 0.4, 0.4))
    assert (first.mass, third.mass, third.name) == (0.07, 0.07, "wedge")
    np.testing.assert_allclose(inertia_of(first), inertia_of(third))


def test_open_and_hollow_meshes_are_refused_unless_their_hull_is_meant(tmp_path: Path) -> None:
    opened = TETRAHEDRON.replace("f 2 3 4\n", "")
    (tmp_path / "open.obj").write_text(opened + "f 1 2 4\nf 1 4 3\n", encoding="utf-8")
    (tmp_path / "dent.obj").write_text(  # the slanted face goes in towards the corner
        TETRAHEDRON.replace("f 2 3 4\n", "v 5 5 5\nf 2 3 5\nf 3 4 5\nf 4 2 5\n"), encoding="utf-8"
    )
    for name, text in (("open", "is open: "), ("dent", "is not convex: .*hull=true")):
        with pytest.raises(InputError, match=text):
            load_solid(f"{tmp_path}/{name}.obj")
        assert load_solid(f"{tmp_path}/{name}.obj:hull=true").shape == "mesh"
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\nf 1 3 2\nf 2 3 4\n")
    with pytest.raises(InputError, match="enclose no volume"):
        load_solid(f"{tmp_path}/flat.obj:hull=true")
    with pytest.raises(InputError, match="no mesh file"):
        load_solid(f"{tmp_path}/none.obj")
    (tmp_path / "words.stl").write_text("these are words")
    with pytest.raises(InputError, match="holds no triangles"):
        load_solid(f"{tmp_path}/words.stl")


def test_gravity_is_told_by_the_palm_or_a_vector() -> None:
    assert gravity_of("up") == (0.0, 0.0, -GRAVITY)
    assert gravity_of("palm-down") == (0.0, 0.0, GRAVITY)
    assert gravity_of("sideways") == (0.0, -GRAVITY, 0.0)
    for word in ("0, -1, -1", "0:-1:-1"):
        np.testing.assert_allclose(gravity_of(word), np.array([0, -1, -1]) * GRAVITY / np.sqrt(2))


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("0,0,0", "has no length"),
        ("dwn", "did you mean down"),
        ("1,2", "three numbers"),
        ("nan,0,1", "three numbers"),
        ("0,-1e200,1", "three numbers"),
    ],
)
def test_gravity_that_pulls_nowhere_is_refused(word: str, text: str) -> None:
    with pytest.raises(InputError, match=text):
        gravity_of(word)


def test_a_hand_file_with_a_list_of_fingers_is_one_in_space(tmp_path: Path) -> None:
    (tmp_path / "robot.toml").write_text('name = "robot"\n[[fingers]]\nname = "thumb"\n', encoding="utf-8")
    (tmp_path / "planar.toml").write_text('name = "planar"\n[left]\nlinks_mm = [50, 50]\n', encoding="utf-8")
    assert is_spatial_hand(tmp_path / "robot.toml")
    assert not is_spatial_hand(tmp_path / "planar.toml")
    assert not is_spatial_hand("2v2_50.50_50.50_1.1_53")
    assert isinstance(parse_spatial_name(STANDARD), SpatialHand)


def test_the_lists_have_what_the_catalogues_have() -> None:
    hands, objects = run_hands(HandsConfig()), run_objects(ObjectsConfig())
    assert [row[0] for row in hands.tables[1].rows] == list(CATALOGUE)
    assert [row[0] for row in objects.tables[1].rows] == list(SOLIDS)
    assert hands.tables[1].rows[0] == (STANDARD, "3", "60 + 60", "10", "85")
    entries = hands.entries()
    assert isinstance(entries, list)
    assert [entry["name"] for entry in entries][-len(CATALOGUE) :] == list(CATALOGUE)
