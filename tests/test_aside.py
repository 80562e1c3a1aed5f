"""Work in a second process: done elsewhere, its errors told here, and done here where there is no other."""

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import active_children, get_context

import pytest

from inhand import aside
from inhand.aside import here, second_process
from inhand.geometry import unit


def _process() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(1, get_context("spawn"))


def test_another_process_does_it_and_tells_its_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(aside, "_pool", _process)
    monkeypatch.setattr(aside, "usable", lambda: 2)
    with second_process("inhand.geometry") as begin:
        number, wrong, nothing = begin(os.getpid), begin(unit, "x"), begin(unit, 0.0)
        assert number() != os.getpid()
        assert nothing().tolist() == [1.0, 0.0]
        with pytest.raises(ValueError, match="x"):
            wrong()
    assert not active_children()  # its thread, still at work as the interpreter ends, would write to a closed pipe


@pytest.mark.parametrize(("cores", "pool"), [(1, _process), (2, lambda: None)])
def test_it_is_done_here_with_one_core_or_where_there_is_no_process(
    cores: int, pool: Callable[[], ProcessPoolExecutor | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(aside, "_pool", pool)
    monkeypatch.setattr(aside, "usable", lambda: cores)
    with second_process("inhand.geometry") as begin:
        assert begin is here
        assert begin(os.getpid)() == os.getpid()
