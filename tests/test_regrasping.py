"""Fingers that are placed anew: farther and straight, told apart, nothing that the test counts, only where asked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from inhand.asterisk_test import regrasped
from inhand.asterisk_test.asterisk import asterisk, ready
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.report import Run
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.asterisk_test.sweep import tables
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.asterisk_test.sweep.page import ANEW, map_of, parts
from inhand.asterisk_test.sweep.run import run_sweep
from inhand.asterisk_test.sweep.sweep import plan
from inhand.control.episode import SHAPES
from inhand.control.ik import IkController
from inhand.control.trial import GRIP_END, LOST_CONTACT, Trial
from inhand.errors import InputError
from inhand.loading import load
from inhand.pages import page_of
from inhand.records import read_json_file

ASKED = AsteriskConfig(object="trapezoid", directions="In,In'-Left',cw", trials=1)


@pytest.fixture(scope="module")
def run() -> Run:
    found = asterisk(object="trapezoid", directions=ASKED.directions, trials=1, regrasp=True)
    assert isinstance(found, Run)
    return found


def test_a_finger_that_is_placed_anew_carries_farther_and_straight_and_the_test_counts_none_of_it(run: Run) -> None:
    plain = [result_of_trial(trial) for trial in simulate(ASKED, prepare(ASKED), threads=1)]
    for before, result, told in zip(plain, run.results, run.apart, strict=True):
        reached = told["reached_deg" if result.turns else "reached_mm"]
        anew = told["placed_anew"] > 0
        assert result.reached <= before.reached + 0.1
        assert reached > before.reached + 10.0 if anew else reached == pytest.approx(before.reached, abs=1.0)
        assert told["lateral_mm"] < 1.0
        assert told["rotation_deg"] < 1.0
        assert not told["lost"]
        assert (result.metrics.contact_fraction or 0.0) < 1.0 if anew else result.metrics.contact_fraction == 1.0
    assert [each["placed_anew"] for each in run.apart] == [1, 0, 2]


def test_what_is_told_apart_has_a_table_and_numbers_of_its_own(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Run, "write_report", lambda *_: None)
    assert [row[0] for row in run.apart_rows] == ["In", "In'-Left'", "cw"]
    assert regrasped.TITLE in run.page()
    assert regrasped.TITLE in run.html()
    assert run.trials[0].passport.controller == regrasped.NAME
    run.save(tmp_path / "run")
    written: Any = read_json_file(tmp_path / "run" / "metrics.json")
    assert written["regrasped"] == run.apart
    again = load(tmp_path / "run")
    assert isinstance(again, Run)
    assert again.apart == run.apart
    one = load(next((tmp_path / "run" / "trials").glob("*.npz")))
    assert isinstance(one, Run)
    assert (one.config.controller, one.config.regrasp) == ("ik", True)


def test_letting_go_is_taken_only_where_it_gains_and_ends_straight(run: Run) -> None:
    anew = run.trials[0]
    held = anew.manipulated_path()[2].all(axis=-1)
    first = anew.manipulation.start + int(np.argmin(held))
    arrays = [name for name in SHAPES if name != "reference"]
    plain = replace(anew, **{name: getattr(anew, name)[:first] for name in arrays})
    aside = replace(anew, object_pose=anew.object_pose + np.linspace(0, 0.004, len(anew.time))[:, None] * np.eye(7)[0])

    def taken(*tried: Trial) -> Trial:
        several = iter([*tried, *[tried[-1]] * regrasped.MOST])
        return regrasped.farthest(lambda *_, **__: (next(several),))[0]

    assert taken(plain, anew) is anew
    assert taken(anew, plain) is anew
    assert taken(plain, aside) is plain
    assert taken(plain, replace(anew, outcome=LOST_CONTACT)) is plain
    assert taken(replace(plain, outcome=LOST_CONTACT), anew) is anew
    assert plain.outcome == GRIP_END


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"controller": "ik-cautious"}, "--regrasp with --controller ik-cautious: give ik"),
        ({"controller": "rl-privileged"}, "--regrasp with --controller rl-privileged: give ik"),
        ({"disturb": "bench"}, "--regrasp with --disturb bench: give none"),
        ({"twist": 10.0}, "--regrasp with --twist 10: give 0"),
        ({"hand": "3f_60.60_40_10", "object": "cube_50"}, "--regrasp with 3f_60.60_40_10, a hand in space"),
    ],
)
def test_where_fingers_are_not_placed_anew_it_is_refused_by_name(settings: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        ready(replace(AsteriskConfig(regrasp=True), **settings))


@pytest.mark.parametrize(("rounds", "carried"), [(0, 2), (1, 2), (2, 3)])
def test_trials_are_carried_a_third_time_only_where_fingers_let_go_twice(run: Run, rounds: int, carried: int) -> None:
    carries = []

    def carry(manipulate: Callable[[Any], Any], **_: Any) -> tuple[Trial, ...]:
        carries.append(manipulate)
        if manipulate is not IkController:
            manipulate(None).rounds = rounds
        return run.trials

    regrasped.farthest(carry)
    assert len(carries) == carried


SWEPT = SweepConfig(
    hands=(ASKED.hand,), objects=("trapezoid",), directions=ASKED.directions, trials=1, regrasp=True, jobs=1
)


def test_a_sweep_tells_what_was_placed_anew_apart_and_takes_no_cells_of_the_test(run: Run, tmp_path: Path) -> None:
    config = replace(SWEPT, out=tmp_path / "sweep")
    found = run_sweep(config)
    table = found.table().set_index("direction")
    for told in run.apart:
        row = table.loc[told["direction"]]
        assert row["regrasped_deg" if "reached_deg" in told else "regrasped_mm"] == pytest.approx(
            told.get("reached_mm", told.get("reached_deg"))
        )
        assert row["placed_anew"] == told["placed_anew"]
    hands, objects, directions = tables.anew_tables(found.sweep)
    assert [row[-2:] for row in directions.rows] == [("1 of 1", "0"), ("0 of 1", "0"), ("1 of 1", "0")]
    assert hands.rows[0][1:] == objects.rows[0][1:]
    assert float(hands.rows[0][2]) > float(hands.rows[0][5]) + 0.1
    page = page_of(*parts(config, found.sweep, 1.0, []))
    assert page.count(regrasped.TITLE) == 4
    assert map_of(found.sweep, ANEW, "object").values[0, 0] > map_of(found.sweep, "share", "object").values[0, 0] + 0.1
    assert not plan(config).waiting
    with pytest.raises(InputError, match=r"cells of other settings.*regrasp is True there and None now"):
        plan(replace(config, regrasp=False))
    assert "Fingers may be placed anew" in page
    assert regrasped.TITLE in found.html()


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"controller": "ik-sensed"}, "--regrasp with --controller ik-sensed: give ik"),
        ({"controller": "rl"}, "--regrasp with --controller rl: give ik"),
        ({"disturb": "field"}, "--regrasp with --disturb field: give none"),
        ({"hands": ("3f_60.60_40_10",), "objects": ("cube_50",)}, "--regrasp with 3f_60.60_40_10, a hand in space"),
    ],
)
def test_a_sweep_refuses_by_name_where_fingers_are_not_placed_anew(settings: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        plan(replace(SWEPT, **settings))
