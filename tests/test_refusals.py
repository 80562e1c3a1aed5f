"""What commands refuse: in one text, with exit code 2, in seconds, before anything is written."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import cast

import pytest

import inhand
from commands import Call
from inhand.errors import InputError

RL = importlib.util.find_spec("jax") is not None

CASES = [
    ("asterisk --trials 1000000", "about 8000 GB of memory and 444 hours of one core; a run holds at most 10000"),
    ("asterisk --trials 700", "--trials 700 in each of 16 directions: 11200 trials would take about 6 GB"),
    ("trace --trials 1000000", "--trials 1000000: 1000000 trials would take about 500 GB"),
    ("evaluate --trials 1000000", "a run holds at most 10000"),
    ("evaluate --episodes 1000000", "a run holds at most 10000"),
    ("trace --path square --size 500", "square of 500 mm is too large for hand '2v2_50.50_50.50_1.1_53': way-point 3"),
    ("trace --path square --size 0.04", "the size of drawing 'square' is 0.04 mm, too small: it may be 1 to 1,000 mm"),
    ("sweep --trials 700", "--trials 700 in each of 16 directions: 11200 trials would take about 6 GB"),
    ("robustness --strengths 0.5 -0.1", "--strengths -0.1: a strength is 0, nothing, or more"),
    ("robustness --strengths nan", "--strengths nan: a strength is 0, nothing, or more"),
    ("robustness --strengths 11", "strength 11 of disturbance 'field': give a number from 0, nothing, to 10"),
    ("robustness --disturbances field@-1", "strength -1 of disturbance 'field': give a number from 0"),
    (
        "robustness --disturbances field@x",
        "strength 'x' of disturbance 'field' is no number: give one, as in",
    ),
    ("robustness --disturbances pose-late-60ms@9", "disturbance 'pose-late-60ms@9' cannot be drawn: camera.delay_ms"),
    ("robustness --disturbances field frction-0.6", "unknown disturbance 'frction-0.6'; did you mean friction-0.6"),
    ("robustness --disturbances levls", "or levels and singles, all of a kind; did you mean levels"),
    (
        "robustness --controllers ik --disturbances none --curves size-0.95 --strengths 9 --object box_2x2",
        "disturbance 'size-0.95@9' cannot be drawn:",
    ),
    ("robustness --controllers ik ikk --out file", "unknown controller 'ikk'; did you mean ik"),
    ("robustness --controllers rl-privileged --directions twist", "a learned policy knows straight primitives"),
    ("robustness --controllers ik ik --out new", "ik under none is asked for twice: give each a name of its own"),
    ("robustness --trials 700", "--trials 700 in each of 16 directions: 11200 trials would take about 6 GB"),
    ("robustness --jobs -1", "--jobs -1: give how many to compute at a time"),
    ("robustness --out file", "--out file is a file"),
    ("asterisk --disturb mass-4@10", "disturbance 'mass-4@10' cannot be drawn: object 'cube_39': its mass"),
    ("reach --resolution-mm 0.1", "resolution 0.1 mm: give 0.5 to 10 mm"),
    ("reach --resolution-mm nan", "inhand: --resolution-mm is nan; it must be a finite number"),
    ("asterisk --object cub_39 --out file", "unknown object 'cub_39'; did you mean cube_39"),
    ("trace --path sqare --out file", "unknown --path 'sqare'; did you mean square"),
    ("trace --object cub_39 --out file", "unknown object 'cub_39'; did you mean cube_39"),
    ("reach --directions Oat --out file", "unknown direction 'Oat'; did you mean Out"),
    ("sweep --objects cub_39 --out file", "unknown object 'cub_39'; did you mean cube_39"),
    ("record --expert ikk --out file", "ikk"),
    ("trace --size 60 --path square --out file", "--out file is a file"),
    ("sweep --hands 2v2_50.50_50.50_1.1_53 --objects cube_39 --out file", "--out file is a file"),
]
"""A command and what it must say; `file` is a file that is there."""


@pytest.mark.parametrize(("line", "text"), CASES)
def test_a_command_refuses_and_leaves_nothing(
    line: str, text: str, tmp_path: Path, inhand: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    if line.startswith("record") and not RL:
        pytest.skip("recording needs the extra `rl`")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    code, out, err = inhand(*line.split())
    assert (code, out) == (2, "")
    assert text in " ".join(err.split())
    assert [each.name for each in tmp_path.iterdir()] == ["file"]


NO_PLACE: list[tuple[Callable[[], object], str]] = [
    (lambda: inhand.evaluate(cast("str", None)), "run is None: give a folder or a file, as a text or a path, or a run"),
    (lambda: inhand.evaluate("rl", human=cast("str", 5)), "human is 5: give a folder"),
    (lambda: inhand.record(out=cast("str", 5)), "out is 5: give a folder"),
    *[
        (lambda: inhand.train(out=cast("str", 5)), "out is 5: give a folder"),
        (lambda: inhand.train(demonstrations=cast("str", 5)), "demonstrations is 5: give a folder"),
    ]
    * RL,
    (lambda: inhand.sweep(out=cast("str", 5)), "out is 5: give a folder"),
]


@pytest.mark.parametrize(("call", "text"), NO_PLACE)
def test_what_is_no_place_is_refused_by_name(call: Callable[[], object], text: str) -> None:
    with pytest.raises(InputError, match=text):
        call()


def test_directions_named_twice_run_once(tmp_path: Path, inhand: Call) -> None:
    words = ("reach", "--resolution-mm", 10, "--directions", "Out,Out,90", "--out", tmp_path / "run")
    code, out, err = inhand(*words)
    assert (code, err) == (0, "")
    assert out.count("Out ") == 1
