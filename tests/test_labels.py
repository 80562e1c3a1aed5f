"""Labels of trials."""

import numpy as np
import pytest

from inhand.asterisk_test.labels import is_averaged, labels_of
from inhand.errors import InputError
from inhand.geometry import Array

X = np.linspace(0, 0.4, 101)
STILL = np.zeros(101)


def path(lateral: Array = STILL, along: Array = X) -> Array:
    return np.column_stack([along, lateral])


def test_a_clean_trial_has_no_label() -> None:
    assert labels_of(path(), STILL, 0.0) == frozenset()


@pytest.mark.parametrize(
    ("label", "points", "turn"),
    [
        ("no movement", path(along=0.2 * X), STILL),
        ("not centred", path() + np.array([0.06, 0]), STILL),
        ("deviated", path(np.where((X > 0.2) & (X < 0.25), 0.3, 0.0)), STILL),
        ("end deviated", path(np.where(X > 0.39, -0.3, 0.0)), STILL),
        ("rotation deviated", path(), np.where(X < 0.05, -80.0, 0.0)),
        ("backtracking", path(along=np.concatenate([X[:80], X[80] - X[:21] * 1.5])), STILL),
    ],
)
def test_each_label_alone(label: str, points: Array, turn: Array) -> None:
    assert labels_of(points, turn, 0.0) == {label}


def test_limits_hold_on_the_safe_side() -> None:
    assert labels_of(path(np.where((X > 0.2) & (X < 0.235), 0.3, 0.0)), STILL, 0.0) == frozenset()
    assert labels_of(path() + np.array([0.049, 0]), STILL, 0.0) == frozenset()
    assert labels_of(path(along=X * 0.26), STILL, 0.0) == frozenset()
    assert labels_of(path(), np.where(X < 0.035, 80.0, 0.0), 0.0) == frozenset()


def test_the_end_is_the_last_tenth_of_the_rows_rounded_up() -> None:
    # Of 101 rows the last 11 are the end: from row 90 on.
    for row, label in ((89, frozenset()), (90, {"end deviated"}), (100, {"end deviated"})):
        assert labels_of(path(np.where(np.arange(101) == row, 0.3, 0.0)), STILL, 0.0) == label, row


def test_labels_turn_with_the_direction() -> None:
    left = path(np.where(X > 0.39, -0.3, 0.0)) * -1
    assert labels_of(left, STILL, 180.0) == {"end deviated"}
    assert labels_of(path(), STILL, 180.0) == {"no movement", "backtracking"}


def test_a_rotation_is_judged_by_its_angle() -> None:
    assert labels_of(np.zeros((101, 2)), 100 * X, None) == frozenset()
    assert labels_of(np.zeros((101, 2)), 20 * X, None) == {"no movement"}


def test_a_single_row_and_an_unknown_rotation_are_ordinary() -> None:
    assert labels_of(np.zeros((1, 2)), None, 0.0) == {"no movement"}


def test_averages_leave_out_the_deviated_kinds() -> None:
    assert is_averaged(frozenset())
    assert is_averaged({"no movement", "not centred", "backtracking"})
    for label in ("deviated", "end deviated", "rotation deviated"):
        assert not is_averaged({label, "backtracking"})


def test_rows_must_be_finite() -> None:
    with pytest.raises(InputError, match="row 0 is not finite"):
        labels_of(np.full((2, 2), np.nan), None, 0.0)
