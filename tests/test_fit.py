"""Whether an object fits into the open hand, and what is said where it does not."""

from dataclasses import replace

import numpy as np
import pytest

from inhand.errors import InputError
from inhand.hands.fit import ROOM, check_fit, widest_opening
from inhand.hands.hand import lab_limits
from inhand.hands.names import CATALOGUE as HANDS
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.hands.objects import ObjectSpec
from inhand.hands.touch import touch

STANDARD = HANDS[0]


def box(width: float, depth: float = 0.03) -> ObjectSpec:
    """Return a box of that width and depth [m]."""
    return ObjectSpec("crate", "box", (width, depth, 0.1))


@pytest.mark.parametrize("hand", HANDS)
def test_every_hand_takes_the_widest_object_of_the_catalogue(hand: str) -> None:
    check_fit(parse_hand_name(hand), max(OBJECTS.values(), key=lambda spec: spec.size[0]))


@pytest.mark.parametrize("name", HANDS)
def test_the_widest_opening_is_where_a_fingertip_reaches_no_farther(name: str) -> None:
    hand = parse_hand_name(name)
    half = widest_opening(hand) / 2 + ROOM

    def reached(distance: float) -> bool:
        found = [
            touch(hand, finger, np.array([sign * distance, hand.start_position[1]]), np.array([sign, 0.0])).reached
            for sign, finger in zip((-1.0, 1.0), hand.fingers, strict=True)
        ]
        return bool(np.all(found))

    assert reached(half)
    assert not any(reached(half + extra) for extra in (2e-4, 0.002, 0.01))


def test_a_wider_palm_opens_wider_and_joint_limits_never_do() -> None:
    narrow, wide = (parse_hand_name(f"2v2_50.50_50.50_1.1_{width}") for width in (53, 93))
    assert widest_opening(wide) == pytest.approx(widest_opening(narrow) + 0.0395, abs=2e-4)
    assert 0 < widest_opening(lab_limits(narrow)) <= widest_opening(narrow)


def test_an_object_wider_than_the_hand_opens_is_refused_with_the_widest_that_fits() -> None:
    hand = parse_hand_name(STANDARD)
    widest = np.floor(1e4 * widest_opening(hand, (-0.015, 0.015))) / 1e4
    check_fit(hand, box(widest - 1e-4))
    with pytest.raises(
        InputError,
        match=rf"object 'crate' is 180\.0 mm wide; hand '{STANDARD}' opens to {1e3 * widest:.1f} mm at the start:"
        r" use a narrower object or a wider hand \(left and right finger straddle the object along x\)",
    ):
        check_fit(hand, box(0.18))


def test_the_widest_that_is_told_fits() -> None:
    hand = parse_hand_name("2v3_25.75_25.35.40_1.1_53")
    with pytest.raises(InputError) as caught:
        check_fit(hand, box(0.5))
    told = float(str(caught.value).split("opens to ")[1].split(" mm")[0])
    check_fit(hand, box(told / 1e3 - 1e-4))
    with pytest.raises(InputError, match="mm wide"):
        check_fit(hand, box(told / 1e3 + 2e-4))


def test_fingers_straddle_an_object_wherever_their_limits_bring_both_beside_it() -> None:
    hand = lab_limits(parse_hand_name("2v3_25.75_25.35.40_1.1_53"))
    assert widest_opening(hand) < 0.035
    check_fit(hand, box(0.039, 0.039))
    with pytest.raises(InputError, match="mm wide"):
        check_fit(hand, box(0.06, 0.01))


def test_an_object_that_reaches_into_the_palm_is_refused() -> None:
    hand = parse_hand_name(STANDARD)
    check_fit(hand, box(0.03, 0.18))
    with pytest.raises(
        InputError,
        match=rf"object 'crate' is 188\.0 mm deep and reaches into the palm of '{STANDARD}', which leaves 187\.2 mm at"
        r" the start: use an object less deep along y",
    ):
        check_fit(hand, box(0.03, 0.188))


def test_a_hand_whose_fingers_never_straddle_the_start_opens_to_nothing() -> None:
    hand = parse_hand_name(STANDARD)
    stiff = replace(hand, left=replace(hand.left, limits=((-0.01, 0.01), (-0.01, 0.01))))
    assert widest_opening(stiff) == 0
    text = r"opens to 0\.0 mm at the start: use other joint limits than left -0\.573 to 0\.573, .*; right -180 to 180, "
    with pytest.raises(InputError, match=text + r".* a left finger bends inwards below 0"):
        check_fit(stiff, box(0.01))
