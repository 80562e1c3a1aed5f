"""The study of a policy of a hand in space: what a row of its table says."""

import numpy as np
import pytest

pytest.importorskip("tyro", reason="studies are run by words")

from space import HEADER, Compared, told


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
