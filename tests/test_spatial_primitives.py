"""Primitives in space: their names and vectors, and that the planar ones are the special case."""

import numpy as np
import pytest

from inhand.errors import InputError
from inhand.geometry import TURN_ARM
from inhand.rotations import matrix_of, quaternion_of
from inhand.tasks import paths, primitives
from inhand.tasks.spatial.paths import spatial_path_of, stacked_paths, whole_spatial_path
from inhand.tasks.spatial.primitives import (
    DIRECTIONS,
    GROUPS,
    MAP,
    TURN,
    TURNS,
    about,
    along,
    holding,
    lifted,
    parse_spatial_directions,
)


def test_there_are_26_directions_and_98_for_maps() -> None:
    assert [len(GROUPS[group]) for group in ("axes", "edges", "corners", "all", "turns", "map")] == [
        6,
        12,
        8,
        26,
        6,
        98,
    ]
    for group in (DIRECTIONS, MAP):
        vectors = np.array([each.direction for each in group])
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=-1), 1)
        apart = vectors @ vectors.T - 2 * np.eye(len(vectors))
        assert apart.max() < np.cos(np.deg2rad(12))
        np.testing.assert_allclose(vectors.sum(axis=0), 0, atol=1e-12)
    assert set(DIRECTIONS) <= set(MAP)


def test_names_say_where_they_go() -> None:
    known = {each.name: each.direction for each in DIRECTIONS}
    assert list(known)[:6] == ["Out", "In", "Right", "Left", "Up", "Down"]
    assert known["Out"] == (0, 1, 0)
    assert known["Left"] == (-1, 0, 0)
    np.testing.assert_allclose(known["Out-Right-Up"] or (), np.ones(3) / np.sqrt(3))
    np.testing.assert_allclose(known["In-Down"] or (), np.array([0, -1, -1]) / np.sqrt(2))


@pytest.mark.parametrize("planar", [*primitives.GROUPS["all"], *primitives.TURNS], ids=lambda each: each.name)
def test_planar_primitives_are_the_special_case(planar: primitives.Primitive) -> None:
    spatial = lifted(planar)
    (found,) = parse_spatial_directions(planar.name)
    assert found == spatial
    path, flat = spatial_path_of(spatial, length=0.05), paths.straight_path(planar, length=0.05)
    both = min(len(path.moves), len(flat.poses))  # in space turns aim farther
    np.testing.assert_allclose(path.moves[:both, :2], flat.poses[:both, :2], atol=1e-15)
    np.testing.assert_allclose(path.turns[:both, 2], flat.poses[:both, 2], atol=1e-12)
    assert not path.moves[:, 2].any()
    assert not path.turns[:, :2].any()


def test_named_planar_directions_are_those_of_space() -> None:
    named = {each.name: each for each in DIRECTIONS}
    for planar in primitives.TRAIN:
        assert lifted(planar) == named[planar.name]


def test_words_mean_directions_vectors_turns_and_holds() -> None:
    up_out, vector, turn, held, ccw = parse_spatial_directions("up-out, 1:2:0 turn@0:3:0,Up@-x@15;ccw")
    assert up_out.name == "Out-Up"
    np.testing.assert_allclose(vector.direction or (), np.array([1, 2, 0]) / np.sqrt(5))
    assert turn == TURNS[1] == about(np.array([0, 1, 0]))
    np.testing.assert_allclose(held.rotation, [-np.deg2rad(15), 0, 0])
    assert (held.name, held.direction) == ("Up@-x@15", (0, 0, 1))
    assert held == holding(along(np.array([0, 0, 2.0])), np.array([-1, 0, 0]), 15)
    np.testing.assert_allclose(ccw.rotation, [0, 0, TURN])
    assert [each.name for each in parse_spatial_directions("Up", 15)] == ["Up p15", "Up m15"]
    planar = [lifted(each) for each in primitives.parse_directions("In", 15)]
    assert [each.rotation for each in parse_spatial_directions("In", 15)] == [each.rotation for each in planar]
    assert len(parse_spatial_directions("all,train,turns")) == 32


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("0:0:0", "has no length, so it points nowhere"),
        ("turn@0:0:0", "axis 0:0:0 has no length"),
        ("Up@0:0:0@15", "axis 0:0:0 has no length"),
        ("Upp", "did you mean Up"),
        ("1:2:x", "'x' is no number"),
        ("nan:0:1", "three finite numbers"),
        ("1e200:0:1", "three finite numbers"),
        ("Up@+q@15", r"axis '\+q'; give \+x"),
        ("Up@+x@95", "holds 95 deg"),
        ("turn+x@+x@15", "only rotates"),
        ("", "no direction given"),
    ],
)
def test_words_that_are_no_direction_are_refused(word: str, text: str) -> None:
    with pytest.raises(InputError, match=text):
        parse_spatial_directions(word)


def test_one_motion_counts_once_whatever_it_is_called() -> None:
    words = "1:2:0,2:4:0,Out,0:3:0,turn+x,turn@2:0:0,90,Up@+z@15,Up@0:0:2@15,turn@1:1:0"
    names = [each.name for each in parse_spatial_directions(words)]
    assert names == ["1:2:0", "Out", "turn+x", "Up@+z@15", "turn@1:1:0"]


def test_turns_go_on_past_half_a_turn() -> None:
    path = spatial_path_of(TURNS[0])
    np.testing.assert_allclose(path.length, TURN_ARM * TURN)
    assert np.linalg.norm(path.turns[-1]) > np.pi


def test_a_held_rotation_comes_first_and_stays() -> None:
    path = spatial_path_of(parse_spatial_directions("Up@+x@15")[0], length=0.02)
    whole = whole_spatial_path(path)
    turned = len(whole.moves) - len(path.moves)
    assert turned == 15
    np.testing.assert_allclose(whole.turns[turned:], np.tile([np.deg2rad(15), 0, 0], (len(path.moves), 1)))
    np.testing.assert_allclose(whole.moves[: turned + 1], 0)
    np.testing.assert_allclose(whole.moves[-1], [0, 0, 0.02])
    both = stacked_paths([whole, path])
    np.testing.assert_allclose(both.moves[1, -15:], np.tile(path.moves[-1], (15, 1)))


def test_a_rotation_about_any_axis_leaves_the_axis() -> None:
    axis = np.array([1.0, 2.0, -1.0])
    path = spatial_path_of(about(axis))
    turned = matrix_of(quaternion_of(path.turns)) @ axis
    np.testing.assert_allclose(turned, np.tile(axis, (len(turned), 1)), atol=1e-12)
