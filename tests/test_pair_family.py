"""A family of hands and objects: what is drawn of it, what never is, and what is outside by which number."""

from dataclasses import replace

import numpy as np
import pytest

from inhand.errors import InputError
from inhand.hands.family import HandFamily
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held, check_fit
from inhand.hands.hand import HandSpec
from inhand.hands.object_family import ObjectFamily
from inhand.hands.objects import ObjectSpec, polygon
from inhand.hands.pair_family import HELD_OUT_HANDS, HELD_OUT_OBJECTS, PairFamily

FAMILY = PairFamily()
STANDARD, CUBE = load_hand("2v2_50.50_50.50_1.1_53"), load_object("cube_39")


def test_drawn_pairs_fit_lie_inside_and_never_in_the_regions_that_are_kept() -> None:
    rng = np.random.default_rng(4)
    drawn = [FAMILY.drawn(rng, number) for number in range(12)]
    for held in drawn:
        assert FAMILY.outside(held) is None
        assert not 0.060 <= held.hand.palm_width <= 0.066
        assert not 0.0395 <= np.ptp(polygon(held.object), axis=0).max() <= 0.0425
        check_fit(*held)
    assert {len(held.hand.limits) for held in drawn} == {4, 5, 6}
    assert {held.object.shape for held in drawn} == {"box", "ellipse", "polygon"}
    assert len({held.object.size[0] > held.object.size[1] for held in drawn}) == 2
    again = np.random.default_rng(4)
    assert [FAMILY.drawn(again, number) for number in range(3)] == drawn[:3]


def test_what_is_held_out_is_inside_and_partly_in_regions_of_which_nothing_is_drawn() -> None:
    hands, objects = [load_hand(name) for name in HELD_OUT_HANDS], [load_object(name) for name in HELD_OUT_OBJECTS]
    assert [FAMILY.hand_outside(hand) for hand in hands] == [None] * 12
    assert [FAMILY.objects.outside(spec) for spec in objects] == [None] * 10
    assert sum(FAMILY.kept(Held(hand, CUBE)) for hand in hands) == 7
    assert sum(FAMILY.kept(Held(STANDARD, spec)) for spec in objects) == 4


@pytest.mark.parametrize(
    ("hand", "text"),
    [
        (load_hand("2v2_50.50_50.50_0.7.1_53"), "its left finger is 100.8 mm long, the family's 115.2 to 144 mm"),
        (load_hand("2v2_50.50_85.15_1.1_53"), "link 0 of its right finger has a share of 0.85, the family's 0.2 to"),
        (load_hand("2v2_50.50_50.50_1.1_90"), "its palm width is 90 mm, the family's 40 to 80 mm"),
        (replace(STANDARD, stiffness=9.0), "its stiffness is 9, the family's 3.5 to 7"),
        (load_hand("examples/gripper.toml"), "outlines of their own"),
        (
            replace(STANDARD, right=replace(STANDARD.right, limits=((-1.0, 1.0), (0.0, 2.0)))),
            "-57 to 57, 0 to 115 deg, the family's free or lab",
        ),
    ],
)
def test_a_hand_outside_is_told_by_its_number_and_the_range(hand: HandSpec, text: str) -> None:
    found = FAMILY.outside(Held(hand, CUBE))
    assert found is not None
    assert found.startswith(f"hand {hand.name!r} is outside of the policy's family: ")
    assert text in found


@pytest.mark.parametrize(
    ("spec", "text"),
    [
        (load_object("cube_60"), "its longer side is 60.0 mm, the family's 22 to 55 mm"),
        (load_object("box_50x10"), "its shorter side is 0.2 of the longer, the family's 0.32 to 1 of the longer"),
        (replace(CUBE, friction=0.3), "its friction is 0.3, the family's 0.7 to 1.4"),
        (replace(CUBE, mass=0.2), "its mass is 0.2 kg, the family's 0.02 to 0.05 kg"),
    ],
)
def test_an_object_outside_is_told_by_its_number_and_the_range(spec: ObjectSpec, text: str) -> None:
    found = FAMILY.outside(Held(STANDARD, spec))
    assert found == f"object {spec.name!r} is outside of the policy's family: {text}"


def test_a_hand_of_other_links_is_outside_unless_its_mirror_image_is_inside() -> None:
    mirrored = load_hand("3v2_40.30.30_50.50_1.1_53")
    assert FAMILY.hand_outside(mirrored) is None
    found = replace(FAMILY, hands=HandFamily(forms=("2v2", "3v3"))).hand_outside(mirrored)
    assert found == "its links are 3v2, the family's 2v2, 3v3 and what these are in a mirror"


def test_bounds_without_objects_and_pairs_that_never_fit_are_refused() -> None:
    with pytest.raises(InputError, match=r"size of a family of objects is 0\.05 to 0\.03"):
        ObjectFamily(size=(0.05, 0.03))
    with pytest.raises(InputError, match="at least one shape, aspects of 1 at most"):
        ObjectFamily(corners=(2, 5))
    wide = replace(FAMILY, objects=ObjectFamily(size=(0.4, 0.5)), hands=HandFamily(forms=("2v2",)))
    with pytest.raises(InputError, match=r"none fit each other; of the last object 'drawn 0' is \d+.* wide"):
        wide.drawn(np.random.default_rng(0), 0)
