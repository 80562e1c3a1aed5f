"""Primitives and the words for them."""

import math

import numpy as np
import pytest

from inhand.errors import InputError
from inhand.tasks.primitives import TRAIN, TURNS, UNSEEN, Primitive, parse_directions, primitive_at, with_twists


def names(text: str) -> list[str]:
    return [primitive.name for primitive in parse_directions(text)]


def test_directions_run_clockwise_from_out_in_steps_of_45_degrees() -> None:
    for i, primitive in enumerate(TRAIN):
        assert math.remainder(primitive.angle - math.radians(90 - 45 * i), math.tau) == pytest.approx(0, abs=1e-12)
    for i, primitive in enumerate(UNSEEN):
        assert math.remainder(primitive.angle - math.radians(67.5 - 45 * i), math.tau) == pytest.approx(0, abs=1e-12)


def test_train_and_unseen_have_the_thesis_names_and_angles() -> None:
    assert [p.name for p in TRAIN] == ["Out", "Out-Right", "Right", "In-Right", "In", "In-Left", "Left", "Out-Left"]
    assert [p.angle_deg for p in TRAIN] == [90, 45, 0, -45, -90, -135, 180, 135]
    assert " ".join(p.name for p in UNSEEN) == "Out' Out'-Right' Right' In'-Right' In' In'-Left' Left' Out'-Left'"
    assert [p.angle_deg for p in UNSEEN] == [67.5, 22.5, -22.5, -67.5, -112.5, -157.5, 157.5, 112.5]


def test_unit_points_along_the_angle() -> None:
    np.testing.assert_allclose(TRAIN[0].unit, [0, 1], atol=1e-15)
    np.testing.assert_allclose(TRAIN[5].unit, [-math.sqrt(0.5), -math.sqrt(0.5)], atol=1e-15)


def test_a_rotation_has_no_direction() -> None:
    with pytest.raises(InputError, match="cw only rotates and has no direction: give one that translates"):
        _ = TURNS[0].unit


@pytest.mark.parametrize(("text", "count"), [("train", 8), ("UNSEEN", 8), ("all", 16), ("train, all", 16), ("c c", 1)])
def test_groups_and_duplicates(text: str, count: int) -> None:
    assert len(parse_directions(text)) == count


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a b c d e f g h", [p.name for p in TRAIN]),
        ("no,ne,ea,se,so,sw,we,nw", [p.name for p in TRAIN]),
        ("out-RIGHT", ["Out-Right"]),
        ("Out'-Right' Out-Right' out'-right", ["Out'-Right'"]),
        ("In\u2019", ["In'"]),
        ("Out2 in2-left2 IN2", ["Out'", "In'-Left'", "In'"]),
        ("out-prime In-Prime-Left-prime Out-prime-Right", ["Out'", "In'-Left'", "Out'-Right'"]),
        ("Left, Out Left", ["Left", "Out"]),
        ("45 -180 180 67.5 -292.5 405", ["Out-Right", "Left", "Out'"]),
        ("30, -12.5 deg 30.0 390", ["30 deg", "-12.5 deg"]),
        ("10°", ["10 deg"]),
        ("cw ccw pp mm", ["cw", "ccw"]),
    ],
)
def test_words(text: str, expected: list[str]) -> None:
    assert names(text) == expected


def test_a_sequence_of_words_is_read_in_order() -> None:
    assert [p.name for p in parse_directions(["Right", "train"])][:3] == ["Right", "Out", "Out-Right"]


def test_every_primitive_is_found_by_its_own_name() -> None:
    for primitive in (*TRAIN, *UNSEEN, *TURNS, primitive_at(-12.345678)):
        assert parse_directions(primitive.name) == (primitive,)


def test_turns_go_the_way_their_name_says() -> None:
    assert [math.copysign(1, p.rotation_deg) for p in TURNS] == [-1, 1]
    assert Primitive("x", None).angle_deg is None


def test_an_unknown_word_gets_near_matches_and_the_allowed_words() -> None:
    with pytest.raises(InputError, match=r"unknown direction 'Outt'; did you mean .*Out") as error:
        parse_directions("Right Outt")
    assert "train, unseen, all" in str(error.value)
    assert "Out2-Right2" in str(error.value)
    assert "-12.5" in str(error.value)


def test_a_word_like_no_other_gets_no_guess() -> None:
    with pytest.raises(InputError, match=r"unknown direction 'qqqqq'\. Use train"):
        parse_directions("qqqqq")


def test_a_direction_in_space_is_told_to_be_one() -> None:
    with pytest.raises(InputError, match=r"unknown direction 'Up'.* are of a hand in space, such as 3f_60\.60_40_10"):
        parse_directions("Up")


@pytest.mark.parametrize("text", ["nan", "inf", "-inf"])
def test_angles_must_be_finite(text: str) -> None:
    with pytest.raises(InputError, match="is not a finite angle: give degrees"):
        parse_directions(text)


@pytest.mark.parametrize("text", ["", " , ", []])
def test_no_direction_at_all(text: str | list[str]) -> None:
    with pytest.raises(InputError, match="no direction given"):
        parse_directions(text)


def test_a_held_twist_is_clockwise_as_p_first_and_counter_clockwise_as_m() -> None:
    found = [(each.name, each.rotation_deg) for each in with_twists(TRAIN[:1], 15.0)]
    assert found == [("Out p15", -15.0), ("Out m15", 15.0)]
