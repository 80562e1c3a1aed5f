"""Reach against a slow, independent search, for three hands and a box."""

import numpy as np
import pytest

from brute_contacts import Grid
from brute_reach import brute_reach
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import parse_object_name
from inhand.hands.reach.limits import farthest
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import GROUPS, Primitive, parse_directions

CUBE = parse_object_name("cube_39")
SYMMETRIC = ("2v2_50.50_50.50_1.1_53", "2v2_65.35_65.35_1.1_53")
UNEVEN = "2v2_70.30_50.50_0.9.1_53"
COARSE = Grid(step=0.004, slide=0.003, turn=np.deg2rad(4.0))
"""The search's grid. A grid that is too coarse breaks the chain of grips early and fails the test."""
FINER = Grid(step=0.004, slide=0.002, turn=np.deg2rad(3.0))
"""The grid where the last grips are a narrow chain; `benchmarks/reach_check.py` has it everywhere, in smaller steps."""
NARROW = {(SYMMETRIC[0], "Right'"), (UNEVEN, "In-Left")}


def mirrored(direction: Primitive) -> Primitive:
    """Return the direction on the other side of the hand's mid-line."""
    (found,) = (d for d in GROUPS["all"] if np.allclose(d.unit, direction.unit * [-1, 1]))
    return found


CASES = (
    *((UNEVEN, name) for name in ("Out-Right", "In-Left", "In'-Right'", "Out'-Left'")),
    *((SYMMETRIC[0], name) for name in ("Out", "In", "Right'")),
    (SYMMETRIC[1], "Right"),
)
"""Directions on every side, of the symmetric hands with their mirror images; `benchmarks/reach_check.py` has all."""


@pytest.mark.parametrize(("name", "along"), CASES)
def test_reach_agrees_with_a_brute_force_search(name: str, along: str) -> None:
    hand, (direction,) = parse_hand_name(name), parse_directions(along)
    alike = {direction, mirrored(direction)} if name in SYMMETRIC else {direction}
    grid = FINER if (name, along) in NARROW else COARSE
    expected = brute_reach(hand, CUBE.size[0], hand.friction * CUBE.friction, direction.unit, grid)
    assert expected > 0.03
    for each in alike:
        found = farthest(hand, CUBE, hand.start_pose + straight_path(each, 0.25).poses)
        assert found is not None
        assert found.way == pytest.approx(expected, abs=1e-3)
