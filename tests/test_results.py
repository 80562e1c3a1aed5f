"""Results of trials: the numbers of metrics.json, the table and the sentences about what failed."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from inhand.asterisk_test.endings import ended
from inhand.asterisk_test.people.human import read_human_file
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.results import (
    RECORDED,
    as_entry,
    by_direction,
    result_of_human,
    result_of_trial,
    summary_of,
)
from inhand.asterisk_test.scenes import trial_path
from inhand.asterisk_test.table import HEADER, endings, failures, table_rows
from inhand.control.episode import MANIPULATE
from inhand.control.trial import (
    DIVERGED,
    GRIP_END,
    LOST_CONTACT,
    NO_GRASP,
    NO_MOVEMENT,
    REACHED,
    TIME_OUT,
    Trial,
    write_json,
)
from inhand.geometry import spatial
from inhand.tasks.primitives import primitive_at
from made import passport, trial_at

REQUIRED = (
    "direction",
    "angle_deg",
    "trial",
    "distance_mm",
    "max_distance_mm",
    "lateral_max_mm",
    "lateral_rms_mm",
    "rotation_max_deg",
    "rotation_final_deg",
    "arc_length_mm",
    "efficiency",
    "contact_fraction",
    "longest_gap_s",
    "outcome",
    "force_max_n",
    "penetration_max_mm",
)
"""Keys that every entry of the list `trials` has."""
STANDARD = "2v2_50.50_50.50_1.1_53"


def straight(
    angle_deg: float = 90.0, mm: float = 40.0, number: int = 1, outcome: str = REACHED, lost: slice | None = None
) -> Trial:
    """Return a trial that moves straight along a direction in 1 mm rows, its right finger off in some rows."""
    primitive = primitive_at(angle_deg)
    rows = int(mm) + 3
    along = np.concatenate([np.zeros(2), np.arange(rows - 2) / 1e3])
    pose = np.column_stack([along[:, None] * primitive.unit + (0, 0.0936), np.zeros(rows)])
    gaps = np.zeros((rows, 2))
    if lost is not None:
        gaps[2:][lost, 1] = 0.002
    return trial_at(
        pose,
        passport(primitive=primitive.name, angle_deg=angle_deg, trial=number),
        outcome=outcome,
        phases=("grasp", MANIPULATE),
        phase=(np.arange(rows) >= 2).astype(np.int64),
        gaps=gaps,
        reference=np.column_stack([1e-3 * np.arange(60)[:, None] * primitive.unit, np.zeros(60)]),
    )


def no_grasp(angle_deg: float = 90.0) -> Trial:
    """Return a trial that never came to manipulation."""
    trial = straight(angle_deg, outcome=NO_GRASP)
    return replace(trial, phase=np.zeros_like(trial.phase))


def recorded(folder: Path) -> HumanTrial:
    """Return a recording of 30 mm straight out, slow and at rest before and after."""
    out = [*[0] * 20, *(row / 10 for row in range(300)), *[30] * 20]
    path = folder / "p1_2v2_a_n_1.csv"
    path.write_text("frame,x,y,rmag\n" + "".join(f"{row},0,{mm},0\n" for row, mm in enumerate(out)))
    return read_human_file(path)


def test_an_entry_has_the_keys_that_readers_rely_on() -> None:
    for trial in (straight(), no_grasp(), straight(lost=slice(5, 9))):
        entry = as_entry(result_of_trial(trial))
        assert tuple(key for key in entry if key in REQUIRED) == REQUIRED
        assert all(value is None or isinstance(value, str | int | float | list) for value in entry.values())


def test_a_straight_trial_in_numbers() -> None:
    entry = as_entry(result_of_trial(straight(mm=40)))
    assert (entry["direction"], entry["angle_deg"], entry["trial"], entry["outcome"]) == ("Out", 90.0, 1, REACHED)
    for key in ("distance_mm", "max_distance_mm", "arc_length_mm", "carried_mm"):
        assert entry[key] == pytest.approx(40), key
    for key in ("lateral_max_mm", "lateral_rms_mm", "rotation_max_deg", "rotation_final_deg"):
        assert entry[key] == pytest.approx(0, abs=1e-9), key
    assert (entry["efficiency"], entry["contact_fraction"], entry["longest_gap_s"]) == (pytest.approx(1), 1.0, 0)
    assert (entry["first_lost"], entry["source"]) == (None, "ik")


def test_the_largest_force_and_overlap_of_any_row_are_told_of_every_trial(tmp_path: Path) -> None:
    gentle = straight()
    forces, overlap = np.zeros((len(gentle.time), 2, 3)), np.zeros(len(gentle.time))
    forces[1, 1], overlap[-1] = (-1.2, 0.0, 1.6), 4e-4  # while closing, and at the end
    hard = result_of_trial(replace(straight(number=2), forces=forces, penetration=overlap))
    entry = as_entry(hard)
    assert (entry["force_max_n"], entry["penetration_max_mm"]) == (pytest.approx(2.0), pytest.approx(0.4))
    both = [result_of_trial(gentle), hard]
    (summary,) = summary_of(both)
    assert (summary["force_max_n"], summary["penetration_max_mm"]) == (pytest.approx(2.0), pytest.approx(0.4))
    row = dict(zip(HEADER, table_rows(both, ())[0], strict=True))
    assert (row["Force"], row["Overlap"]) == ("2.00", "0.40")
    human = as_entry(result_of_human(recorded(tmp_path)))
    assert (human["force_max_n"], human["penetration_max_mm"]) == (None, None)


def test_distance_counts_up_to_the_first_loss_and_carried_to_the_end() -> None:
    result = result_of_trial(straight(mm=40, lost=slice(11, 14)))
    assert result.metrics.distance_mm == pytest.approx(10)
    assert result.carried_mm == pytest.approx(40)
    assert result.metrics.longest_gap_s == pytest.approx(0.06)
    assert result.metrics.contact_fraction == pytest.approx(38 / 41)
    assert result.first_lost == "right"


def test_a_failed_grasp_is_no_distance_and_no_contact() -> None:
    entry = as_entry(result_of_trial(no_grasp()))
    assert (entry["distance_mm"], entry["contact_fraction"], entry["outcome"]) == (0.0, 0.0, NO_GRASP)
    assert entry["first_lost"] is None


@pytest.mark.parametrize(
    ("outcome", "kept"),
    [(REACHED, True), (LOST_CONTACT, False), (NO_GRASP, False), (TIME_OUT, False), (DIVERGED, False), (RECORDED, True)],
)
def test_only_reached_and_recorded_trials_kept_the_object(outcome: str, kept: bool) -> None:
    assert replace(result_of_trial(straight()), outcome=outcome).kept is kept


@pytest.mark.parametrize(
    ("outcome", "lost"), [("lost contact", True), ("no grasp", True), ("diverged", True), ("time out", False)]
)
def test_a_trial_whose_time_ran_out_has_lost_nothing_and_is_not_crossed_out(outcome: str, lost: bool) -> None:
    result = replace(result_of_trial(straight()), outcome=outcome)
    assert result.lost is lost
    assert trial_path(straight(), result).failed is lost


def test_metrics_of_the_original_software_come_when_asked_for() -> None:
    assert "asterisk_test" not in as_entry(result_of_trial(straight()))
    entry = as_entry(result_of_trial(straight(), compatible=True))
    assert set(entry["asterisk_test"]) >= {"dist", "mvt_eff", "max_err", "t_fd", "area_btwn", "max_a_loc"}
    assert entry["asterisk_test"]["dist"] == pytest.approx(40 / 135, abs=0.01)


def test_a_hand_of_unknown_span_has_no_labels() -> None:
    trial = straight()
    strange = replace(trial, passport=replace(trial.passport, hand=replace(trial.passport.hand, name="mine")))
    entry = as_entry(result_of_trial(strange, compatible=True))
    assert entry["labels"] is None
    assert "asterisk_test" not in entry
    assert as_entry(result_of_trial(trial))["labels"] == []


def test_a_recording_has_no_contact_and_no_known_end(tmp_path: Path) -> None:
    human = recorded(tmp_path)
    entry = as_entry(result_of_human(human))
    assert (entry["direction"], entry["outcome"], entry["source"]) == ("Out", RECORDED, "p1_2v2_a_n_1.csv")
    assert (entry["contact_fraction"], entry["longest_gap_s"]) == (None, None)
    assert entry["distance_mm"] == pytest.approx(30, abs=0.5)


def test_directions_have_mean_and_sd_in_order_of_appearance() -> None:
    trials = [straight(0, 30, 1), straight(0, 40, 2), straight(90, 20, 1), straight(0, 50, 3, LOST_CONTACT)]
    results = [result_of_trial(trial) for trial in trials]
    assert {name: len(group) for name, group in by_direction(results).items()} == {"Right": 3, "Out": 1}
    right, out = summary_of(results)
    assert (right["direction"], right["angle_deg"], right["trials"]) == ("Right", 0.0, 3)
    assert right["outcomes"] == {LOST_CONTACT: 1, REACHED: 2}
    assert right["distance_mm"] == {"mean": pytest.approx(40), "sd": pytest.approx(10)}
    assert out["distance_mm"] == {"mean": pytest.approx(20), "sd": 0.0}
    numbers = set(REQUIRED) - {"direction", "angle_deg", "trial", "outcome"}
    assert numbers <= set(right)


def test_json_has_no_nan_and_no_part_stays(tmp_path: Path) -> None:
    content: dict[str, Any] = {
        "trials": [{"a": math.nan, "b": [math.inf, 1.5], "c": (-math.inf, np.float64("nan"))}],
        "out": Path("some") / "folder",
        "whole": 3,
    }
    write_json(content, tmp_path / "metrics.json")

    def no_constants(name: str) -> None:
        pytest.fail(f"{name} is no JSON")

    read = json.loads((tmp_path / "metrics.json").read_text(encoding="utf-8"), parse_constant=no_constants)
    assert read["trials"] == [{"a": None, "b": [None, 1.5], "c": [None, None]}]
    assert (read["out"], read["whole"]) == ("some/folder", 3)
    assert [each.name for each in tmp_path.iterdir()] == ["metrics.json"]


@pytest.mark.parametrize(("value", "kept"), [(np.int64(5), 5), (np.bool_(True), True), (np.float64(0.5), 0.5)])
def test_json_keeps_numbers_numbers(value: object, kept: object, tmp_path: Path) -> None:
    write_json({"value": value}, tmp_path / "numbers.json")
    assert json.loads((tmp_path / "numbers.json").read_text())["value"] == kept


def test_an_unknown_rotation_is_null(asterisk_data: Path, tmp_path: Path) -> None:
    path = next((asterisk_data / "thesis_ik").glob("*_a_n_1.csv"))
    write_json(as_entry(result_of_human(read_human_file(path), compatible=True)), tmp_path / "m.json")
    entry = json.loads((tmp_path / "m.json").read_text())
    assert entry["rotation_max_deg"] is None
    assert entry["distance_mm"] > 20


def test_the_table_has_one_row_for_each_direction(tmp_path: Path) -> None:
    human = recorded(tmp_path)
    results = [
        result_of_trial(t) for t in (straight(90, 30), straight(90, 40, 2, LOST_CONTACT, slice(21, 41)), straight(0))
    ]
    out, right = (dict(zip(HEADER, row, strict=True)) for row in table_rows(results, [human]))
    assert out["Direction"] == "Out"
    assert out["Distance [mm]"] == "25.0 ± 7.1"
    assert float(out["Human [mm]"]) == pytest.approx(30, abs=0.5)
    assert (out["Contact"], out["Gap [s]"], out["Outcome"]) == ("0.512", "0.40", "1/2 lost contact")
    assert (right["Distance [mm]"], right["Human [mm]"], right["Outcome"]) == ("40.0", "-", "1/1 reached")


@pytest.mark.parametrize(
    ("mm", "limit", "outcome"),
    [
        (59.0, 0.0, REACHED),
        (54.0, 0.1, GRIP_END),
        (15.0, 0.1, GRIP_END),
        (14.0, 0.1, NO_MOVEMENT),  # a tenth of the fingers' 144 mm
        (0.0, 0.0448, NO_MOVEMENT),
        (0.0, None, NO_MOVEMENT),
        (14.0, 0.02, GRIP_END),  # the hand could hardly have gone farther
    ],
)
def test_what_the_loop_calls_reached_is_told_apart(mm: float, limit: float | None, outcome: str) -> None:
    trial = straight(mm=mm)
    trial = replace(trial, passport=replace(trial.passport, limit=limit))
    assert ended(trial).outcome == outcome
    assert ended(replace(trial, outcome=LOST_CONTACT)).outcome == LOST_CONTACT


@pytest.mark.parametrize(("turned", "outcome"), [(9.0, NO_MOVEMENT), (11.0, GRIP_END), (147.0, REACHED)])
def test_a_trial_that_turns_is_told_apart_by_its_angle(turned: float, outcome: str) -> None:
    still = straight(mm=0.0)
    angle = np.deg2rad(np.array([0.0, 0.0, turned]))
    pose = np.column_stack([np.zeros((3, 2)), angle])
    passport = replace(still.passport, angle_deg=None, rotation_deg=150.0)
    reference = np.deg2rad([[0.0, 0.0, 0.0], [0.0, 0.0, 150.0]])
    phase = np.array([0, 1, 1])
    trial = replace(still, object_pose=spatial(pose, 0.05), passport=passport, reference=reference, phase=phase)
    assert ended(trial).outcome == outcome


def test_standing_still_is_told_with_what_the_hand_could_do() -> None:
    still = ended(straight(mm=0.0))
    still = replace(still, passport=replace(still.passport, limit=0.0448))
    gone = straight(0.0, 45, outcome=GRIP_END)
    gone = replace(gone, passport=replace(gone.passport, limit=0.050))
    results = [result_of_trial(still), result_of_trial(gone)]
    assert [result.kept for result in results] == [False, True]
    assert failures(results) == ["Out: no movement in 1 of 1 trials after 0 of 45 mm."]
    assert endings(results) == (
        "1 of 2 trials kept the object: 1 stopped where the grip was predicted to end. They came 0.90 of the hand's"
        " limit on average, at least 0.90 (Right, 45 of 50 mm)."
    )


def test_what_failed_says_how_often_which_finger_and_where() -> None:
    trials = [
        straight(90, 40, 1),
        straight(90, 40, 2, LOST_CONTACT, slice(21, 41)),
        straight(90, 30, 3, LOST_CONTACT, slice(11, 31)),
        straight(0),
    ]
    assert failures([result_of_trial(trial) for trial in trials]) == [
        "Out: lost contact in 2 of 3 trials after 20, 10 mm (40, 30 mm with lost and regained contacts allowed),"
        " first by right."
    ]


def test_a_grasp_that_never_held_has_no_distance_to_tell() -> None:
    (sentence,) = failures([result_of_trial(no_grasp())])
    assert sentence == "Out: no grasp in 1 of 1 trials."


def test_a_simulation_that_diverged_is_told_as_no_verdict_on_the_hand() -> None:
    trials = [straight(90, 40, 1), straight(90, 25, 2, DIVERGED), replace(no_grasp(), outcome=DIVERGED)]
    results = [result_of_trial(trial) for trial in trials]
    assert [result.first_lost for result in results] == [None] * 3
    (row,) = table_rows(results, [])
    assert row[-1] == "2/3 diverged"
    assert failures(results) == [
        "Out: diverged in 2 of 3 trials after 25, 0 mm (25, 0 mm with lost and regained contacts allowed)."
        " A simulation that diverged says nothing about the hand: lower its stiffness, torque or physics step."
    ]


@pytest.mark.parametrize("make", [straight, no_grasp])
def test_results_do_not_change_their_trial(make: Callable[[], Trial]) -> None:
    trial, again = make(), make()
    result_of_trial(trial, compatible=True)
    np.testing.assert_array_equal(trial.object_pose, again.object_pose)
    np.testing.assert_array_equal(trial.gaps, again.gaps)


def test_errors_of_a_bent_path_are_taken_from_it_and_not_from_the_line() -> None:
    turn = np.linspace(0.0, np.pi / 2, 43)
    bow = np.column_stack([0.06 * (np.cos(turn) - 1), 0.06 * np.sin(turn), np.zeros(43)])
    trial = straight(mm=40)
    pose = bow[[0, 0, *range(41)]] + np.array([0.0, 0.0936, 0.0])
    bent = result_of_trial(replace(trial, object_pose=spatial(pose, 0.05), reference=bow))
    assert bent.bent
    assert bent.metrics.lateral_max_mm > 50
    assert bent.metrics.path_max_mm == pytest.approx(0.0, abs=1e-6)
    assert bent.metrics.path_rms_mm == pytest.approx(0.0, abs=1e-6)
    off = result_of_trial(replace(trial, object_pose=spatial(pose, 0.05), reference=bow * (2.0, 1.0, 1.0)))
    assert off.metrics.path_max_mm is not None
    assert off.metrics.path_max_mm > 5
    rows = [dict(zip(HEADER, row, strict=True)) for row in table_rows([bent], [])]
    assert rows[0]["Off path"] == "0.0"
    assert not result_of_trial(trial).bent
    assert table_rows([result_of_trial(trial)], [])[0][HEADER.index("Off path")] == "-"
