"""Plans of paths: made once, on every core that may be used, and the same wherever they are made."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from inhand import caches
from inhand.control import shipped_plans
from inhand.control.shipped_plans import plans_of
from inhand.cores import one_core, usable
from inhand.errors import InputError

Planned = Callable[[list[int]], dict[str, np.ndarray]]
KEYS = [f"path {row}" for row in range(5)]


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., dict[str, np.ndarray]]:
    """Return what plans five paths with two cores, beside what is kept of them."""
    monkeypatch.setenv(caches.PLACE, str(tmp_path / "cache"))
    monkeypatch.setattr(shipped_plans, "usable", lambda: 2)

    def make(planned: Planned, at_once: int = 16) -> dict[str, np.ndarray]:
        return plans_of("test", KEYS, "inhand.cores", planned, at_once=at_once)

    return make


def test_paths_are_planned_by_other_processes_and_then_known(made: Callable[..., dict[str, np.ndarray]]) -> None:
    def planned(rows: list[int]) -> dict[str, np.ndarray]:
        return {
            "way": 2.0 * np.array(rows),
            "by": np.full(len(rows), os.getpid()),
            "cores": np.full(len(rows), usable()),
        }

    found = made(planned)
    assert found["way"].tolist() == [0.0, 2.0, 4.0, 6.0, 8.0]
    assert os.getpid() not in found["by"]
    assert found["cores"].tolist() == [1] * 5

    def never(rows: list[int]) -> dict[str, np.ndarray]:
        raise AssertionError(rows)

    again = made(never)
    assert all(np.array_equal(again[name], found[name]) for name in found)


@pytest.mark.parametrize("fault", [ImportError, InputError])
def test_what_others_cannot_begin_is_done_here(
    fault: type[Exception], made: Callable[..., dict[str, np.ndarray]]
) -> None:
    here = os.getpid()

    def planned(rows: list[int]) -> dict[str, np.ndarray]:
        if os.getpid() != here:
            raise fault("a notebook's class")
        return {"way": np.array(rows, dtype=float)}

    assert made(planned)["way"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_a_fault_of_what_plans_is_raised_as_it_is(made: Callable[..., dict[str, np.ndarray]]) -> None:
    def planned(rows: list[int]) -> dict[str, np.ndarray]:
        raise ZeroDivisionError(f"{rows} in process {os.getpid()}")

    with pytest.raises(ZeroDivisionError) as fault:
        made(planned)
    assert str(os.getpid()) not in str(fault.value)
    assert "in planned" in str(fault.value.__cause__)


def test_on_one_core_paths_are_planned_here_so_many_at_a_time(
    monkeypatch: pytest.MonkeyPatch, made: Callable[..., dict[str, np.ndarray]]
) -> None:
    monkeypatch.setattr(shipped_plans, "usable", usable)
    parts: list[list[int]] = []

    def planned(rows: list[int]) -> dict[str, np.ndarray]:
        parts.append(rows)
        if len(parts) > 2:
            raise ValueError("no grasp")
        return {"way": np.array(rows, dtype=float)}

    with one_core(), pytest.raises(ValueError, match="no grasp"):
        made(planned, at_once=2)
    assert parts == [[0, 1], [2, 3], [4]]
    with one_core():
        parts.clear()
        assert made(planned, at_once=2)["way"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert parts == [[4]]  # what was planned before the fault is kept
