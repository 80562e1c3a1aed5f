"""Objects: outlines, names, what is refused, and how they stand and slide in the simulator."""

import re
from dataclasses import FrozenInstanceError, fields, replace
from typing import Any

import numpy as np
import pytest

from inhand.errors import InputError
from inhand.geometry import Array, cross
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE, ObjectSpec, convex_pieces, outline, parse_object_name, polygon
from inhand.hands.touch import touch
from inhand.sim.mujoco_engine import MujocoSimulator
from inhand.sim.scene import SceneSpec
from inhand.sim.state import State
from test_outlines import area, inside

SPECS = list(CATALOGUE.values())
by_name = pytest.mark.parametrize("spec", SPECS, ids=lambda spec: spec.name)


def from_edges(points: Array, corners: Array) -> Array:
    """Distance of points `(N, 2)` to the nearest edge of a polygon `(K, 2)`."""
    ways = np.roll(corners, -1, axis=0) - corners
    share = ((points[:, None] - corners) * ways).sum(-1) / (ways * ways).sum(-1)
    nearest = corners + np.clip(share, 0, 1)[..., None] * ways
    return np.asarray(np.linalg.norm(points[:, None] - nearest, axis=-1).min(axis=1))


@by_name
def test_catalogue_objects_have_the_laboratory_numbers(spec: ObjectSpec) -> None:
    assert spec.height == spec.size[2]
    assert 0.096 <= spec.height <= 0.105
    assert 0.015 <= spec.mass <= 0.045
    assert spec.friction == 1.0
    assert CATALOGUE[spec.name] is parse_object_name(spec.name) is spec


@by_name
def test_outline_points_lie_on_the_outline_with_unit_normals_outwards(spec: ObjectSpec) -> None:
    points, normals = outline(spec)
    half = np.array(spec.size[:2]) / 2
    if spec.shape == "polygon":
        assert from_edges(points, polygon(spec)).max() < 1e-12
    else:
        scaled = points / half
        on_outline = np.abs(scaled).max(-1) if spec.shape == "box" else np.linalg.norm(scaled, axis=-1)
        np.testing.assert_allclose(on_outline, 1.0, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1.0)
    if len(convex_pieces(spec)) == 1:
        # On a convex outline every other point lies behind the tangent.
        assert ((points[:, None] - points) * normals[:, None]).sum(-1).min() > -1e-12
    fine = polygon(spec, 4096)
    assert inside(points - 1e-5 * normals, fine).all()
    assert not inside(points + 1e-5 * normals, fine).any()
    assert area(points) > 0


@by_name
@pytest.mark.parametrize("step", [0.0005, 0.004])
def test_outline_points_are_no_farther_apart_than_asked(spec: ObjectSpec, step: float) -> None:
    points, _ = outline(spec, step)
    assert np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=-1).max() <= step * (1 + 1e-9)
    assert len(outline(spec, step / 2)[0]) >= 1.5 * len(points)


MIRRORS = {"teardrop": ((1, -1),)} | dict.fromkeys(("triangle", "pentagon", "trapezoid"), ((-1, 1),))


@by_name
def test_outlines_are_their_own_mirror_images(spec: ObjectSpec) -> None:
    points, normals = outline(spec)
    for mirror in MIRRORS.get(spec.name, ((-1, 1), (1, -1))):
        apart = np.linalg.norm(points[:, None] * mirror - points, axis=-1)
        assert apart.min(axis=1).max() < 1e-12
        np.testing.assert_allclose((normals * mirror), normals[apart.argmin(axis=1)], atol=1e-9)


@pytest.mark.parametrize("name", MIRRORS)
def test_objects_that_point_somewhere_are_not_symmetric_the_other_way(name: str) -> None:
    points, _ = outline(CATALOGUE[name])
    (mirror,) = MIRRORS[name]
    apart = np.linalg.norm(points[:, None] * [-mirror[0], -mirror[1]] - points, axis=-1)
    assert apart.min(axis=1).max() > 2e-3


@pytest.mark.parametrize("spec", [s for s in SPECS if s.shape == "polygon"], ids=lambda spec: spec.name)
@pytest.mark.parametrize("step", [0.0005, 0.002, 0.1])
def test_a_polygon_gives_points_on_every_face_and_none_on_its_corners(spec: ObjectSpec, step: float) -> None:
    corners = polygon(spec)
    points, normals = outline(spec, step)
    assert np.linalg.norm(points[:, None] - corners, axis=-1).min() > 1e-4
    ways = np.roll(corners, -1, axis=0) - corners
    on_face = (np.abs(cross(points[:, None] - corners, ways)) < 1e-12) & (np.abs(normals @ ways.T) < 1e-12)
    counts = on_face.sum(axis=0)
    assert (counts == np.maximum(1, np.ceil(np.linalg.norm(ways, axis=-1) / step))).all()


def test_a_box_gives_no_point_on_its_corners() -> None:
    points, normals = outline(parse_object_name("box_30x45"))
    assert not ((np.abs(points[:, 0]) > 0.0149999) & (np.abs(points[:, 1]) > 0.0224999)).any()
    assert sorted(set(map(tuple, normals.tolist()))) == [(-1.0, 0.0), (0.0, -1.0), (0.0, 1.0), (1.0, 0.0)]


@by_name
def test_the_polygon_is_inscribed_and_counter_clockwise(spec: ObjectSpec) -> None:
    corners = polygon(spec)
    half = np.array(spec.size[:2]) / 2
    share = {"box": 1.0, "polygon": SHARES.get(spec.name, np.nan)}.get(spec.shape, np.pi / 4)
    full = 4 * half.prod() * share
    assert 0.997 * full < area(corners) <= full * (1 + 1e-12)
    turns = cross(np.roll(corners, -1, 0) - corners, np.roll(corners, -2, 0) - np.roll(corners, -1, 0))
    assert (turns < 0).sum() == {"hourglass": 2, "concave_square": 4}.get(spec.name, 0)
    assert (np.abs(corners) <= half * (1 + 1e-12)).all()
    if spec.shape in ("box", "polygon"):
        np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [-half, half], atol=1e-12)


def teardrop_share() -> float:
    """Area against the bounding box of a disc with a tip: two right triangles and the rest of the disc."""
    radius, tip = 19.25, 25.75
    opening = np.arccos(radius / tip)
    return float((radius * np.sqrt(tip**2 - radius**2) + radius**2 * (np.pi - opening)) / (45 * 38.5))


SHARES = {
    "triangle": 1 / 2,
    "teardrop": teardrop_share(),
    # A regular pentagon of radius 1 has the area 5 sin(72 deg) / 2 and is 2 sin(72 deg) by 1 + cos(36 deg).
    "pentagon": 5 / 4 / (1 + np.cos(np.pi / 5)),
    "trapezoid": (1 + 0.5) / 2,
    "hourglass": (1 + 0.7) / 2,
    "concave_square": 1 - 4 * 0.1 / 2,
}


def test_the_pentagon_is_regular_and_the_rectangles_have_one_area() -> None:
    corners = polygon(CATALOGUE["pentagon"])
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=-1)
    np.testing.assert_allclose(sides, sides.mean(), rtol=2e-3)
    sizes = np.array([spec.size[:2] for name, spec in CATALOGUE.items() if name.startswith("rectangle")])
    np.testing.assert_allclose(sizes[:, 0] / sizes[:, 1], [1.5, 2.0, 2.5, 3.0], rtol=5e-3)
    np.testing.assert_allclose(sizes.prod(axis=1), sizes[0].prod(), rtol=3e-3)


@by_name
def test_a_teardrop_of_any_side_and_every_object_keep_their_sizes(spec: ObjectSpec) -> None:
    wider = replace(spec, size=(0.05, 0.05, 0.08))
    np.testing.assert_allclose(np.ptp(polygon(wider), axis=0), 0.05, rtol=5e-3)
    assert len(wider.corners) == len(spec.corners)
    assert replace(spec, mass=0.02).corners == spec.corners


@pytest.mark.parametrize(
    ("name", "shape", "size"),
    [
        ("box_30x45", "box", (30, 45, 100)),
        ("rectangle_20.5x40", "box", (20.5, 40, 100)),
        ("cube_37", "box", (37, 37, 100)),
        ("square_12", "box", (12, 12, 100)),
        ("cylinder_50.8", "cylinder", (50.8, 50.8, 100)),
        ("ellipse_45x20", "ellipse", (45, 20, 100)),
        ("triangle_30x40", "polygon", (30, 40, 100)),
        ("teardrop_50x30", "polygon", (50, 30, 100)),
        ("teardrop_30x50", "polygon", (30, 50, 100)),
        ("pentagon_40", "polygon", (40, 40, 100)),
        ("trapezoid_40.5x25", "polygon", (40.5, 25, 100)),
        ("hourglass_30x45", "polygon", (30, 45, 100)),
        ("concave_square_35", "polygon", (35, 35, 100)),
    ],
)
def test_any_size_has_a_name(name: str, shape: str, size: tuple[float, float, float]) -> None:
    spec = parse_object_name(name)
    assert (spec.name, spec.shape) == (name, shape)
    np.testing.assert_allclose(spec.size, np.array(size) / 1e3)
    assert np.abs(np.ptp(polygon(spec), axis=0) / spec.size[:2] - 1).max() < 5e-3


@pytest.mark.parametrize("name", ["cube39", "banana", "", "box_", "cube_3e1", "cube_-39", "box_30x45x60", "cube_39 "])
def test_an_unknown_object_says_what_is_allowed(name: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_object_name(name)
    text = str(caught.value)
    assert text.startswith(f"unknown object {name!r}")
    assert "shape_SIZE or shape_XxY in mm (box_30x45, cylinder_40, ellipse_40x25), or a TOML file" in text
    assert "`inhand objects`" in text


def test_an_unknown_object_offers_near_matches() -> None:
    with pytest.raises(InputError, match=r"unknown object 'cubes_39'; did you mean cube_39 or "):
        parse_object_name("cubes_39")
    with pytest.raises(InputError, match=r"unknown object 'triangel_30x40'; did you mean triangle_30x40 or "):
        parse_object_name("triangel_30x40")
    with pytest.raises(InputError, match=r"unknown object 'hour_glass'; did you mean hourglass"):
        parse_object_name("hour_glass")
    with pytest.raises(InputError) as caught:
        parse_object_name("banana")
    assert "did you mean" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (
            {"shape": "bax"},
            "object 'thing': unknown shape 'bax'; allowed are box, cylinder, ellipse, polygon; did you mean box?",
        ),
        ({"corners": ((0, 0), (1, 0), (0, 1))}, "object 'thing': corners of a box; only shape 'polygon' has corners"),
        ({"shape": "polygon"}, "object 'thing': an outline of 0 corners []; it needs three or more corners (x, y)"),
        ({"size": (0.0, 0.04, 0.1)}, "size [0, 40, 100] mm; size needs three positive lengths, x, y and height"),
        ({"size": (0.04, -0.04, 0.1)}, "size [40, -40, 100] mm; size needs three positive lengths"),
        ({"size": (0.04, 0.04, np.nan)}, "size [40, 40, nan] mm; size needs three positive lengths"),
        ({"size": (0.04, 0.04, np.inf)}, "size [40, 40, inf] mm; size needs three positive lengths"),
        ({"size": (0.04, 0.04)}, "size [40, 40] mm; size needs three positive lengths"),
        ({"mass": 0.0}, "object 'thing': mass 0 kg; the mass must be positive"),
        ({"mass": -0.03}, "mass -0.03 kg; the mass must be positive"),
        ({"mass": np.nan}, "mass nan kg; the mass must be positive"),
        ({"friction": -0.1}, "object 'thing': friction -0.1; friction must be 0 or more"),
        ({"friction": np.inf}, "friction inf; friction must be 0 or more"),
        ({"shape": "cylinder", "size": (0.04, 0.03, 0.1)}, "a cylinder of 40 x 30 mm; give both diameters alike"),
    ],
)
def test_numbers_that_no_object_has_are_refused(changes: dict[str, Any], text: str) -> None:
    spec = ObjectSpec("thing", "box", (0.04, 0.04, 0.1))
    with pytest.raises(InputError, match=re.escape(text)):
        replace(spec, **changes)


def test_names_of_no_size_are_refused() -> None:
    with pytest.raises(InputError, match=re.escape("object 'cube_0': size [0, 0, 100] mm")):
        parse_object_name("cube_0")
    with pytest.raises(InputError, match="shape = 'ellipse'"):
        parse_object_name("cylinder_40x30")
    with pytest.raises(InputError, match=re.escape("object 'triangle_30x0': size [30, 0, 100] mm")):
        parse_object_name("triangle_30x0")
    with pytest.raises(InputError, match=re.escape("a teardrop of 40 x 40 mm has no tip; the shorter size is its")):
        parse_object_name("teardrop_40")


def test_an_object_is_frozen_and_may_be_frictionless() -> None:
    spec = ObjectSpec("ice", "box", (0.04, 0.04, 0.1), friction=0.0)
    for field in fields(spec):
        with pytest.raises(FrozenInstanceError):
            setattr(spec, field.name, None)


HAND = parse_hand_name("2v2_50.50_50.50_1.1_53")
OPENED = np.array([[1.2, 0.0, -1.2, 0.0]])  # both fingers away from the object


def tilt(state: State) -> Array:
    """Angle of the object's axis from the vertical [rad] `(B,)`."""
    x, y = state.object_pose[:, 4], state.object_pose[:, 5]
    return np.asarray(2 * np.arcsin(np.hypot(x, y)))


@by_name
def test_an_object_stands_where_it_is_put(spec: ObjectSpec) -> None:
    simulator = MujocoSimulator(HAND, [spec], threads=1)
    pose = np.array([[*HAND.start_position, 0.3]])
    start = simulator.reset(pose, OPENED)
    np.testing.assert_allclose(start.object_pose[:, 2], spec.height / 2)
    np.testing.assert_allclose(start.pose, pose)
    state = simulator.step(OPENED, round(1.0 / simulator.timestep))
    assert abs(state.object_pose[0, 2] - spec.height / 2) < 5e-4
    assert np.rad2deg(tilt(state)[0]) < 0.1
    np.testing.assert_allclose(state.pose, pose, atol=1e-4)  # a cylinder rocks on its rim until it settles
    assert np.abs(state.object_velocity[:, :3]).max() < 1e-3
    # MuJoCo stands a mesh on four corners at most: a pentagon rocks on them by a hundredth of a degree.
    assert np.abs(state.object_velocity[:, 3:]).max() < (3e-2 if spec.shape == "polygon" else 1e-2)


@pytest.mark.parametrize("size", [(0.002, 0.002, 0.1), (0.2, 0.1, 0.01), (0.04, 0.04, 0.5)])
@pytest.mark.parametrize("mass", [1e-3, 5.0])
def test_boxes_of_any_size_and_mass_stand(size: tuple[float, float, float], mass: float) -> None:
    spec = ObjectSpec("block", "box", size, mass)
    simulator = MujocoSimulator(HAND, [spec], threads=1)
    simulator.reset(np.array([[0.0, 0.3, 0.0]]), OPENED)
    state = simulator.step(OPENED, 250)
    assert abs(state.object_pose[0, 2] - spec.height / 2) < 5e-4
    assert np.rad2deg(tilt(state)[0]) < 0.1


def glide(floor: float, spec: ObjectSpec) -> tuple[Array, Array, Array]:
    """Knock a cube outwards with both fingers; return times `(S,)` [s], y `(S,)` [m] and gaps `(S,)` [m]."""
    face = np.array(HAND.start_position) + np.array([[-0.012, -spec.size[1] / 2], [0.012, -spec.size[1] / 2]])
    behind = [touch(HAND, finger, face[i], np.array([0.0, -1.0])).joints for i, finger in enumerate(HAND.fingers)]
    rest = np.concatenate(behind)[None]
    simulator = MujocoSimulator(HAND, [spec], SceneSpec(floor_friction=floor), threads=1)
    simulator.reset(HAND.start_pose[None], rest)
    knock = np.array([[-0.2, 0.0, 0.2, 0.0]])
    states = [simulator.step(knock if k < 12 else rest, 1) for k in range(150)]
    rows = [(state.time[0], state.pose[0, 1], state.gaps[0].min()) for state in states]
    times, along, gaps = np.array(rows).T
    return times, along, gaps


@pytest.mark.parametrize("floor", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("mass", [0.015, 0.045])
def test_a_sliding_object_slows_as_coulomb_says(floor: float, mass: float) -> None:
    times, along, gaps = glide(floor, replace(CATALOGUE["cube_39"], mass=mass))
    speed = np.diff(along) / np.diff(times)
    free = (gaps[1:] > 2e-3) & (speed > 0.03)
    assert free.sum() > 8
    slowing = -np.polyfit(times[1:][free], speed[free], 1)[0]
    np.testing.assert_allclose(slowing, floor * 9.81, rtol=0.03)
