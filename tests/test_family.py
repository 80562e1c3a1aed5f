"""Families of hands: what lies between the bounds, hands drawn there, and hands written as files and read again."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from inhand.errors import InputError
from inhand.hands.family import DIMENSIONS, STEP_MM, HandFamily
from inhand.hands.files import load_hand, load_robot
from inhand.hands.hand import HandSpec
from inhand.hands.hand_text import toml_of, write_hand
from inhand.hands.names import CATALOGUE
from inhand.hands.shapes import link_outline, palm_outline

BOTH = HandFamily(("2v2", "2v3", "3v2", "3v3"), limits=("free", "lab"))
ROUNDING = 2 * STEP_MM / 1e3
"""Links are rounded to whole steps, and the last has what is left [m]."""


def lengths(hand: HandSpec) -> list[float]:
    sizes = [hand.palm_width, hand.link_width, hand.tip_length]
    return [*(link for finger in hand.fingers for link in finger.links), *sizes]


def test_drawn_hands_lie_between_the_bounds_and_are_found_again() -> None:
    rng, forms, limits = np.random.default_rng(1), set(), set()
    for k in range(60):
        hand = BOTH.drawn(f"hand {k}", rng)
        for finger in hand.fingers:
            assert BOTH.finger[0] - ROUNDING <= finger.length <= BOTH.finger[1] + ROUNDING
            shares = np.array(finger.links) / finger.length
            assert shares.min() >= BOTH.share[0] - 0.002
            assert shares.max() <= BOTH.share[1] + 0.002
        for name in ("palm_width", "link_width", "tip_length"):
            assert getattr(BOTH, name)[0] - ROUNDING <= getattr(hand, name) <= getattr(BOTH, name)[1] + ROUNDING
        assert np.allclose(np.round(np.array(lengths(hand)) * 1e4), np.array(lengths(hand)) * 1e4, atol=1e-6)
        places = BOTH.places(hand)
        assert places is not None
        assert np.allclose(lengths(BOTH.hand("again", *places)), lengths(hand), atol=1.01e-4)
        forms.add(places[0])
        limits.add(places[1])
    assert (forms, limits) == ({"2v2", "2v3", "3v2", "3v3"}, {"free", "lab"})


def test_hands_of_the_catalogue_stand_in_the_family_unless_a_number_is_outside() -> None:
    for name in CATALOGUE:
        for ending in ("", ":lab-limits"):
            assert BOTH.places(load_hand(name + ending)) is not None
    standard = load_hand(CATALOGUE[0])
    outside = (
        replace(BOTH, forms=("3v3",)),
        replace(BOTH, limits=("lab",)),
        replace(BOTH, finger=(0.12, 0.13)),
        replace(BOTH, palm_width=(0.06, 0.08)),
        replace(BOTH, link_width=(0.01, 0.02)),
    )
    assert [family.places(standard) for family in outside] == [None] * len(outside)
    uneven = load_hand("2v2_70.30_50.50_0.9.1_53")
    assert BOTH.places(uneven) is not None
    assert replace(BOTH, share=(0.32, 0.75)).places(uneven) is None


def test_a_family_has_the_dimensions_in_which_its_hands_differ() -> None:
    assert BOTH.dimensions() == DIMENSIONS
    two = HandFamily(("2v2",), finger=(0.144, 0.144), tip_length=(0.0075, 0.0075))
    assert two.dimensions() == ("left_first", "right_first", "palm_width", "link_width")
    alike = HandFamily(("3v3",), alike=True)
    assert not any(name.startswith("right") for name in alike.dimensions())
    hand = alike.hand("mirrored", "3v3", "free", dict.fromkeys(alike.dimensions(), 0.3))
    assert hand.left.links == hand.right.links


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"forms": ()}, "forms of a family of hands names none"),
        ({"palm_width": (0.08, 0.04)}, "palm_width of a family of hands is 0.08 to 0.04: give a lowest value above 0"),
        ({"share": (0.4, 0.6)}, "no 3 links of the right finger of 2v3 have shares of 0.4 to 0.6 that sum to 1"),
        ({"alike": True}, "fingers of 2v3 cannot be alike"),
        (
            {"share": (0.05, 0.9)},
            "a link may be 5.8 mm long, a share of 0.05 of a finger of 115.2 mm; a last link needs",
        ),
    ],
)
def test_bounds_without_a_hand_between_them_are_refused(changed: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        HandFamily(**changed)


def test_a_hand_is_the_same_from_every_file_that_it_is_written_to(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    for family in (HandFamily(("2v3",)), HandFamily(("3v3",), limits=("lab",))):
        form = family.forms[0]
        hand = family.drawn(f"a {form}", rng)
        plain, urdf, mjcf = (load_hand(path) for path in write_hand(hand, tmp_path / form, "best"))
        assert lengths(plain) == lengths(hand)
        assert np.allclose(plain.limits, hand.limits, atol=1e-15)
        assert replace(plain, left=hand.left, right=hand.right) == hand
        for robot in (urdf, mjcf):
            assert np.allclose(lengths(robot)[:-2], lengths(hand)[:-2], atol=1e-9)
            assert np.allclose(robot.limits, hand.limits, atol=1e-9)
            assert (robot.torque, robot.damping, robot.friction) == (hand.torque, hand.damping, hand.friction)
            assert np.isclose(robot.thickness, hand.thickness)
            assert np.allclose(sorted(palm_outline(robot).tolist()), sorted(palm_outline(hand).tolist()), atol=1e-8)
            for finger, own in zip(robot.fingers, hand.fingers, strict=True):
                for link in range(len(own.links)):
                    there, here = link_outline(robot, finger, link), link_outline(hand, own, link)
                    assert np.allclose(sorted(there.tolist()), sorted(here.tolist()), atol=2e-8)
    signs = load_robot(tmp_path / "3v3" / "best_urdf.toml").signs
    assert signs.tolist() == [1.0] * 6


def test_a_hand_with_outlines_of_its_own_is_not_written() -> None:
    gripper = load_hand(Path(__file__).resolve().parents[1] / "examples" / "gripper.toml")
    with pytest.raises(InputError, match="hand 'gripper' has outlines or masses of its own"):
        write_hand(gripper, Path("nowhere"), "best")
    assert 'name = "2v2' in toml_of(load_hand(CATALOGUE[0]))
