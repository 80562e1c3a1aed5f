"""The study of a policy of a hand in space: what a row of its table says."""

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("tyro", reason="studies are run by words")

from inhand.hands.spatial.gravity import gravity_of
from inhand.learning.space_pools import NEVER, NEVER_DEG
from space import HEADER, SENSED_HEADER, Compared, SpaceConfig, sensed_cases, sensed_row, told


def test_what_was_lost_has_come_nowhere_and_is_not_off_its_line() -> None:
    kept = np.array([[True, False, True], [True, True, True]])
    come, off = np.array([[0.05, 0.09, 0.03], [0.05, 0.03, 0.04]]), np.array([[1e-4, 0.1, 3e-4], [0.01, 3.0, 0.01]])
    parts = [Compared(kept[:, :2], come[:, :2], off[:, :2]), Compared(kept[:, 2:], come[:, 2:], off[:, 2:])]
    row = dict(zip(HEADER, told("some", parts), strict=True))
    assert row["Trials"] == "3"
    assert (row["Kept"], row["Expert keeps"]) == ("2 (66.7 %)", "3 (100.0 %)")
    assert row["Share of the expert"] == "0.667"
    assert row["Off the line [mm]"] == "0.20, 0.29"
    assert row["Turned off [deg]"] == "0.57, 0.57"


def test_gravities_near_those_never_shown_are_one_in_three_and_all_named_paths_come_in_turn() -> None:
    cases = sensed_cases(SpaceConfig(anywhere=50, gravities=8, paths=8))
    assert [len(each.primitives) for each in cases] == [40, 10, *[8] * 8]
    drawn = cases[2:]
    assert len({each.name for case in drawn[:4] for each in case.primitives}) == 32
    corners = np.array(NEVER) / np.sqrt(3)
    near = [
        (corners @ np.array(gravity_of(each.gravity)) / 9.81).max() > np.cos(np.deg2rad(NEVER_DEG)) for each in drawn
    ]
    assert [k for k, each in enumerate(drawn) if each.name == "gravities never shown"] == [0, 3, 6]
    assert near[0]
    assert near[3]
    assert near[6]


def test_what_no_finger_held_is_lost_and_counts_as_no_way() -> None:
    rows = pd.DataFrame({
        "outcome": ["reached", "no grasp", "lost contact", "end of grip"], "lost": [False, True, True, False],
        "way": [0.8, 0.0, 0.0, 0.4], "angle_deg": [10.0, 20.0, 30.0, None],
        "lateral_max_mm": [1.0, 9.0, 9.0, 5.0], "rotation_max_deg": [2.0, 9.0, 9.0, 50.0],
    })  # fmt: skip
    row = dict(zip(SENSED_HEADER, sensed_row(("some", "field", "rl"), [rows[:1], rows[1:]]), strict=True))
    assert row["Kept, 95 %"] == "2 of 4, 15.0 to 85.0 %"
    assert row["No grasp"] == "1"
    assert row[SENSED_HEADER[5]] == "0.300, 0.267, 0.400"
    assert row["Off"] == "1.0, 2.0"
