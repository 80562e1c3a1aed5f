"""Recorded trials: every year's naming and unit, the traps in the rows, and what is refused."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from inhand.asterisk_test.metrics import measure_human
from inhand.asterisk_test.people.hand_sizes import normalise
from inhand.asterisk_test.people.human import read_human_file, read_human_folder
from inhand.asterisk_test.people.human_filter import smooth
from inhand.asterisk_test.people.human_names import parse_human_name
from inhand.asterisk_test.people.human_rows import Gaps
from inhand.asterisk_test.results import as_entry, result_of_human
from inhand.errors import InputError
from inhand.geometry import Array

CAMERA = "yaw,x,frame,pitch,rmag,roll,z,tmag,y"


def write(folder: Path, name: str, header: str, rows: list[str]) -> Path:
    path = folder / name
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def mm_rows(points: Array, rotation: Array | None = None) -> list[str]:
    turn = np.zeros(len(points)) if rotation is None else rotation
    return [f"{i},{x:.3f},{y:.3f},{r:.3f}" for i, ((x, y), r) in enumerate(zip(points, turn, strict=True))]


def ramp(length: float, rows: int = 80, lateral: float = 0.0, seed: int = 0) -> Array:
    rng = np.random.default_rng(seed)
    along = np.concatenate([np.zeros(10), np.linspace(0, length, rows - 20), np.full(10, length)])
    wander = lateral * np.sin(np.linspace(0, 3 + seed, rows)) * (along > 0)
    return np.column_stack([along, wander]) + rng.normal(0, 0.3, (rows, 2)) * (along > 0)[:, None]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("filt_josh_2v2_a_none_1.csv", ("2020", "josh", "2v2", "a", None, 0, 1)),
        ("filt_josh_2v3_b_plus15_2.csv", ("2020", "josh", "2v3", "b", None, -15, 2)),
        ("filt_josh_2v3_b_minus15_2.csv", ("2020", "josh", "2v3", "b", None, 15, 2)),
        ("filt_josh_2v2_ccw_none_3.csv", ("2020", "josh", "2v2", None, "ccw", 0, 3)),
        ("sub1_2v2_c_n_1.csv", ("2021", "sub1", "2v2", "c", None, 0, 1)),
        ("sub1_2v2_h_p15_12.csv", ("2021", "sub1", "2v2", "h", None, -15, 12)),
        ("sub1_2v2_h_m15_12.csv", ("2021", "sub1", "2v2", "h", None, 15, 12)),
        ("sub1_2v2_n_cw_1.csv", ("2021", "sub1", "2v2", None, "cw", 0, 1)),
        ("sub1_2v2_x_mm_1.csv", ("2021", "sub1", "2v2", None, "ccw", 0, 1)),
        ("exp_2v2_c_n_1.csv", ("2021", "exp", "2v2", "c", None, 0, 1)),
        ("2v2_ea_x_sub2_4.csv", ("2022", "sub2", "2v2", "c", None, 0, 4)),
        ("2v2_n_pp_sub2_4.csv", ("2022", "sub2", "2v2", None, "cw", 0, 4)),
        ("2v2_c_n_x_1.csv", ("2022", "x", "2v2", "c", None, 0, 1)),
        ("controllerhumankpNone_2v2_d_n_1.csv", ("thesis IK", "controllerhumankpNone", "2v2", "d", None, 0, 1)),
    ],
)
def test_names_of_every_year(name: str, expected: tuple[str | float | None, ...]) -> None:
    got = parse_human_name(name)
    letter = got.direction.letter if got.direction else None
    assert (got.year, got.subject, got.hand, letter, got.rotation, got.twist_deg, got.trial) == expected


@pytest.mark.parametrize(
    "name",
    [
        "trial1.csv",
        "sub1_2v2_q_n_1.csv",
        "sub1_2v2_c_p30_1.csv",
        "sub1_2v2_c_n_one.csv",
        "sub1_2v2_n_n_1.csv",
        "raw_sub1_2v2_c_n_1.csv",
        "2v2_c_n_c_n.csv",
    ],
)
def test_an_unknown_name_is_refused_because_the_unit_is_unknown(name: str) -> None:
    with pytest.raises(InputError, match=f"^{name}: the unit of this file is unknown") as error:
        parse_human_name(name)
    assert "filt_SUBJECT_HAND_DIRECTION_TWIST_TRIAL.csv (2020)" in str(error.value)
    assert "Rename the file" in str(error.value)


def test_files_of_2020_are_multiplied_by_span_and_depth(tmp_path: Path) -> None:
    rows = [f"{i},{0.005 * i},{-0.002 * i},{0.1 * i},0,0,0" for i in range(40)]
    trial = read_human_file(write(tmp_path, "filt_s_3v3_c_none_1.csv", ",x,y,rmag,f_x,f_y,f_rot_mag", rows))
    np.testing.assert_allclose(trial.path_mm[20], [0.1 * 210, -0.04 * 140])
    assert trial.unit == "normalised by 210 x 140 mm, degrees"
    np.testing.assert_allclose(normalise(trial.path_mm, "3v3")[20], [0.1, -0.04])


def test_camera_files_are_metres_in_any_column_order(tmp_path: Path) -> None:
    rows = [f"0,{0.001 * i},{i},0,{0.5 * i},0,0,0,{0.0005 * i}" for i in range(60)]
    trial = read_human_file(write(tmp_path, "2v2_ea_n_sub2_1.csv", CAMERA, rows))
    assert trial.unit == "metres, degrees"
    np.testing.assert_allclose(trial.path_mm[-1], [59, 29.5])
    assert trial.rotation_deg[-1] == 29.5


def test_the_thesis_controller_is_metres_without_a_rotation(asterisk_data: Path) -> None:
    for trial in read_human_folder(asterisk_data / "thesis_ik").trials:
        assert trial.unit == "metres, rotation column unusable"
        assert not trial.rotation_usable
        assert np.isnan(trial.rotation_deg).all()
        assert np.isnan(trial.filtered_rotation_deg).all()
        np.testing.assert_array_equal(trial.filtered_mm, trial.path_mm)
    right = read_human_file(next((asterisk_data / "thesis_ik").glob("*_c_n_1.csv")))
    np.testing.assert_allclose(right.path_mm[-1], [53.819, 2.740], atol=1e-3)


@pytest.mark.parametrize(
    ("words", "sign", "primitive"),
    [("c_p15", -1, "Right"), ("c_m15", 1, "Right"), ("n_cw", -1, "cw"), ("n_ccw", 1, "ccw")],
)
def test_the_label_gives_the_rotation_its_sign(tmp_path: Path, words: str, sign: int, primitive: str) -> None:
    rotation = np.linspace(0, 16, 80)
    path = write(tmp_path, f"s_2v2_{words}_1.csv", "frame,x,y,rmag", mm_rows(ramp(30), rotation))
    trial = read_human_file(path)
    assert trial.rotation_signed
    assert trial.primitive == primitive
    np.testing.assert_allclose(trial.rotation_deg, sign * rotation, atol=1e-3)
    assert np.sign(trial.filtered_rotation_deg[-1]) == sign


def test_without_a_label_the_rotation_stays_a_size(asterisk_data: Path) -> None:
    trial = read_human_file(asterisk_data / "human" / "filt_josh_2v2_c_none_1.csv")
    assert not trial.rotation_signed
    assert trial.rotation_deg.min() == 0


def test_the_real_folder(asterisk_data: Path) -> None:
    folder = read_human_folder(asterisk_data / "human")
    assert len(folder.trials) == 20
    assert [trial.source for trial in folder.trials] == sorted(trial.source for trial in folder.trials)
    assert len(folder.notes) == 1
    assert folder.notes[0].startswith("sub1_2v2_c_n_1.csv left out: it is the same recording as filt_josh_2v2_c_none_1")


def test_the_straight_files_are_read_as_they_are(asterisk_data: Path) -> None:
    folder = read_human_folder(asterisk_data / "straight")
    assert len(folder.trials) == 8
    for trial in folder.trials:
        assert trial.unit == "mm, degrees"
        np.testing.assert_array_equal(trial.filtered_mm, trial.path_mm)


def test_smoothing_keeps_the_width_of_the_files_own_filter_but_has_no_lag(asterisk_data: Path) -> None:
    for letter, column, size, along in (("a", "f_y", 135, 1), ("g", "f_x", 170, 0)):
        trial = read_human_file(asterisk_data / "human" / f"filt_josh_2v2_{letter}_none_1.csv")
        own = size * pd.read_csv(asterisk_data / "human" / trial.source)[column].to_numpy(dtype=float)
        mine = trial.filtered_mm[:, along]
        errors = [np.abs(own[lag:] - mine[: len(own) - lag]).mean() for lag in (0, 5, 7, 9, 14)]
        assert int(np.argmin(errors)) == 2
        assert errors[2] < 0.5 < errors[0]


def test_one_frame_that_jumps_leaves_no_trace() -> None:
    values = np.zeros((60, 2))
    values[30] = 17.0
    values[31] = -17.0
    np.testing.assert_array_equal(smooth(values), np.zeros((60, 2)))


def test_the_windows_are_five_and_fifteen_rows_about_each_row() -> None:
    step = np.repeat([[0.0], [1.0]], 30, axis=0)
    ramp = np.clip(
        (np.arange(60) - 22) / 15, 0.0, 1.0
    )  # the mean of rows k - 7 to k + 7, of which those from 30 on are 1
    np.testing.assert_allclose(smooth(step)[7:-7, 0], ramp[7:-7], atol=1e-12)
    for frames, kept in ((2, 0.0), (3, 3 / 15)):
        jump = np.zeros((60, 1))
        jump[30 : 30 + frames] = 1.0
        assert smooth(jump)[31, 0] == pytest.approx(kept)


def test_a_steady_movement_is_smoothed_to_itself() -> None:
    line = np.linspace(0, 50, 60)[:, None] * [1.0, -0.5]
    for rows in (60, 20, 7, 3, 2, 1):
        np.testing.assert_allclose(smooth(line[:rows]), line[:rows], atol=1e-12)


def test_a_recording_that_stops_at_full_speed_ends_where_it_ended(tmp_path: Path) -> None:
    points = np.linspace(0, 60, 31)[:, None] * [1.0, 0.0]
    trial = read_human_file(write(tmp_path, "s_2v2_c_n_1.csv", "frame,x,y,rmag", mm_rows(points)))
    assert measure_human(trial).distance_mm == pytest.approx(60, abs=1e-6)
    rested = np.concatenate([points, np.tile([60.0, 0.0], (5, 1))])
    assert smooth(rested).max() == pytest.approx(60)


def test_one_frame_of_release_does_not_decide_where_a_trial_ended() -> None:
    values = np.full((40, 1), 60.0)
    values[-1] = 77.0
    np.testing.assert_allclose(smooth(values), 60.0)


UNSEEN = ["0,0,0,0", "1,2,0,1", "2,,,", "3, ,nan,", "4,8,0,4", "5,,,", "6,12,0,6", "7,,,"]
"""Rows of a steady movement in which the marker was not seen four times, once at the end."""


@pytest.mark.parametrize(("gaps", "frames"), [("drop", [0, 1, 4, 6]), ("fill", [0, 1, 2, 3, 4, 5, 6])])
def test_frames_in_which_the_marker_was_not_seen(tmp_path: Path, gaps: Gaps, frames: list[int]) -> None:
    trial = read_human_file(write(tmp_path, "s_2v2_c_n_1.csv", "frame,x,y,rmag", UNSEEN), gaps)
    np.testing.assert_array_equal(trial.frame, frames)
    np.testing.assert_allclose(trial.path_mm[:, 0], 2.0 * np.array(frames))
    np.testing.assert_allclose(trial.rotation_deg, frames)
    assert str(trial.unseen) == f"4 {'left out' if gaps == 'drop' else 'filled'}, longest 2"
    entry = as_entry(result_of_human(trial))
    assert entry["unseen"] == {"frames": 4, "longest": 2, "gaps": gaps}


def test_frames_without_a_number_of_their_own_are_counted(tmp_path: Path) -> None:
    rows = ["0,0,0,0", ",,,", "2,4,0,2"]
    trial = read_human_file(write(tmp_path, "s_2v2_c_n_1.csv", "frame,x,y,rmag", rows), "fill")
    np.testing.assert_allclose(trial.path_mm[:, 0], [0, 2, 4])


def test_gaps_are_refused_by_default_and_say_what_to_do(tmp_path: Path) -> None:
    path = write(tmp_path, "s_2v2_c_n_1.csv", "frame,x,y,rmag", UNSEEN)
    text = r"line 4: x, y and rmag are empty, as in 4 of 8 rows: .*longest run 2.* --gaps drop.* --gaps fill"
    for read in (read_human_file, lambda file: read_human_folder(file.parent)):
        with pytest.raises(InputError, match=text):
            read(path)
    with pytest.raises(InputError, match="the marker was never seen"):
        read_human_file(write(tmp_path, "s_2v2_c_n_1.csv", "frame,x,y,rmag", UNSEEN[2:4]), "drop")


def test_a_stray_file_is_told_and_left_out_but_a_damaged_recording_is_not(tmp_path: Path) -> None:
    stray = write(tmp_path, "notes.csv", "day,who", ["1,2"])
    with pytest.raises(InputError, match=r"holds no recording: notes\.csv: the unit of this file is unknown"):
        read_human_folder(tmp_path)
    write(tmp_path, "s_2v2_c_n_1.csv", "frame,x,y,rmag", mm_rows(ramp(60)))
    folder = read_human_folder(tmp_path)
    assert [trial.source for trial in folder.trials] == ["s_2v2_c_n_1.csv"]
    assert folder.notes == (f"{stray.name} left out: its name is not that of a recording",)
    write(tmp_path, "s_2v2_c_n_2.csv", "frame,x,y,rmag", ["0,0,0,0", "1,zero,0,0"])
    with pytest.raises(InputError, match=r"s_2v2_c_n_2\.csv, line 3: column x holds 'zero'"):
        read_human_folder(tmp_path)


def test_leading_zero_rows_and_a_frozen_tail_are_no_movement(tmp_path: Path) -> None:
    points = np.concatenate([np.zeros((7, 2)), np.linspace(2, 40, 20)[:, None] * [1, 0], np.full((5, 2), [40, 0])])
    rotation = np.concatenate([[0, 1], np.zeros(30)])
    trial = read_human_file(write(tmp_path, "s_2v2_c_n_1.csv", "frame,x,y,rmag", mm_rows(points, rotation)))
    start, stop = trial.moving
    assert (start, stop) == (6, 27)
    assert trial.path_mm[start, 0] == 0
    assert trial.path_mm[stop - 1, 0] == 40


def test_a_motionless_trial_is_read(tmp_path: Path) -> None:
    trial = read_human_file(write(tmp_path, "s_2v2_c_n_1.csv", "frame,x,y,rmag", mm_rows(np.zeros((5, 2)))))
    assert trial.moving == (0, 1)
    one = read_human_file(write(tmp_path, "s_2v2_c_n_2.csv", "frame,x,y,rmag", ["0,12.0,3.0,0"]))
    np.testing.assert_array_equal(one.start_mm, [12, 3])
    np.testing.assert_array_equal(one.filtered_mm, [[0, 0]])


def test_a_copy_cropped_and_rounded_differently_is_left_out(tmp_path: Path) -> None:
    full = ramp(60, lateral=8)
    write(tmp_path, "b_2v2_c_n_1.csv", "frame,x,y,rmag", mm_rows(full))
    crop = [row for i, row in enumerate(mm_rows(full.round(0))) if 8 <= i < 72 and i % 9]
    write(tmp_path, "a_2v2_c_n_1.csv", "frame,x,y,rmag", crop)
    write(tmp_path, "c_2v2_c_n_1.csv", "frame,x,y,rmag", mm_rows(ramp(66, lateral=8, seed=1)))
    write(tmp_path, "d_2v2_a_n_1.csv", "frame,x,y,rmag", mm_rows(full))
    folder = read_human_folder(tmp_path)
    assert [trial.source[0] for trial in folder.trials] == ["b", "c", "d"]
    assert folder.notes[0].startswith("a_2v2_c_n_1.csv left out: it is the same recording as b_2v2_c_n_1.csv (")


def test_motionless_trials_are_no_copies_of_each_other(tmp_path: Path) -> None:
    for i in (1, 2):
        write(tmp_path, f"s_2v2_c_n_{i}.csv", "frame,x,y,rmag", mm_rows(np.zeros((30, 2))))
    assert len(read_human_folder(tmp_path).trials) == 2


@pytest.mark.parametrize(
    ("rows", "text"),
    [
        (["0,0,0,0", "1,2.0"], r"line 3: 2 cells where the header names 4; mend or remove the row"),
        (["0,0,0,0", "", "1,2,nan,0"], r"line 4: column y holds 'nan', not a finite number"),
        (["0,0,0,0", "1,2,,0"], r"line 3: column y holds '', not a finite number"),
        (["0,zero,0,0"], r"line 2: column x holds 'zero'"),
        (["0,0,0,0", "1,900,0,0"], r"line 3: 900 mm from the start, read as mm, degrees; at most 400 is plausible"),
        (["0,0,0,0", "1,9,0,400"], r"line 3: 400 degrees of rotation.* at most 360 is plausible"),
        (["0,0,0,0", "1,9,0,-3"], r"line 3: column rmag is negative"),
        (["0,0,0,0", "1,0.4,0,0"], r"unit of this file is unknown: its name says mm, but .* further than 0.4"),
        ([], r"holds a header but no rows"),
        (["0,0,0,0"] * 2001, r"has 2001 rows; a trial has at most 2000, more than a minute: cut the recording into"),
    ],
)
def test_bad_rows_are_refused_with_their_line(tmp_path: Path, rows: list[str], text: str) -> None:
    path = write(tmp_path, "s_2v2_c_n_1.csv", "frame,x,y,rmag", rows)
    with pytest.raises(InputError, match=text) as error:
        read_human_file(path)
    assert str(error.value).startswith("s_2v2_c_n_1.csv")


@pytest.mark.parametrize(
    ("name", "header", "text"),
    [
        (
            "s_2v2_c_n_1.csv",
            "frame,x,rmag",
            r"line 1: no column y among frame, x, rmag; .* needs the columns x, y, rmag",
        ),
        ("s_2v2_c_n_1.csv", "frame,x,x,y,rmag", r"line 1: column x is there twice"),
        (
            "s_2v2_c_n_1.csv",
            "frame,x,y,rmag,yaw",
            r"unit of this file is unknown: it has the camera column yaw but not",
        ),
        ("filt_s_4v4_c_none_1.csv", ",x,y,rmag", r"recordings of 2020 are divided.*no size known for hand '4v4'"),
    ],
)
def test_bad_columns_and_hands_are_refused(tmp_path: Path, name: str, header: str, text: str) -> None:
    path = write(tmp_path, name, header, [",".join("0" for _ in header.split(","))])
    with pytest.raises(InputError, match=text) as error:
        read_human_file(path)
    assert str(error.value).startswith(name)


def test_empty_missing_and_binary_files_are_refused(tmp_path: Path) -> None:
    empty = tmp_path / "s_2v2_c_n_1.csv"
    empty.write_bytes(b"")
    with pytest.raises(InputError, match=r"^s_2v2_c_n_1.csv, line [01]: no column x and y and rmag among"):
        read_human_file(empty)
    with pytest.raises(InputError, match="there is no such file; give the path of"):
        read_human_file(tmp_path / "s_2v2_c_n_2.csv")
    empty.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="cannot be read as a CSV text file"):
        read_human_file(empty)


def test_folders_without_recordings_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not there: give the folder that holds"):
        read_human_folder(tmp_path / "missing")
    with pytest.raises(InputError, match="holds no CSV file; give one that does"):
        read_human_folder(tmp_path)
    (tmp_path / "human").mkdir()
    write(tmp_path / "human", "s_2v2_c_n_1.csv", "frame,x,y,rmag", ["0,0,0,0"])
    with pytest.raises(InputError, match="holds no CSV file; its folders human do: give one of them"):
        read_human_folder(tmp_path)
