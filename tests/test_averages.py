"""Averages of trials: every trial counts once, and the published human distances come out."""

import math
from pathlib import Path

import numpy as np
import pytest

from inhand import geometry
from inhand.asterisk_test.averages import average_path, compat_average, summarise
from inhand.asterisk_test.metrics import measure, measure_human
from inhand.asterisk_test.people.human import read_human_folder
from inhand.errors import InputError
from inhand.geometry import Array

ONE_PERSON_MM = {
    "Out": 49.5,
    "Out-Right": 60.9,
    "Right": 72.7,
    "In-Right": 52.5,
    "In": 44.3,
    "In-Left": 48.7,
    "Left": 78.4,
    "Out-Left": 59.9,
}
"""Mean distance of one person over three trials (asterisk-test.md)."""


def line(length: float, lateral: float = 0.0, rows: int = 200) -> Array:
    along = np.linspace(0, length, rows)
    return np.column_stack([along, lateral * np.minimum(along / 10, 1)])


@pytest.mark.parametrize("angle", [0.0, 45.0, -90.0, 157.5])
def test_the_mean_of_equal_trials_is_the_trial(angle: float) -> None:
    path = geometry.rotate(math.radians(angle), line(50))
    average = average_path([path, path], angle, 50.0)
    along, lateral = geometry.rotate(-math.radians(angle), average.points_mm).T
    np.testing.assert_allclose(along, np.linspace(0, 50, 11), atol=1e-9)
    np.testing.assert_allclose(lateral, 0, atol=1e-9)
    np.testing.assert_allclose(average.lateral_sd_mm, 0, atol=1e-9)


def test_every_trial_counts_once_however_many_rows_it_has() -> None:
    average = average_path([line(50, 6.0, rows=2000), line(50, 0.0, rows=100)], 0.0, 50.0)
    np.testing.assert_allclose(average.points_mm[3:, 1], 3.0)
    np.testing.assert_allclose(average.lateral_sd_mm[3:], np.std([6, 0], ddof=1))


def test_the_line_ends_where_it_is_told() -> None:
    average = average_path([line(20), line(40, 4.0), line(90)], 0.0, 50.0)
    assert average.points_mm[-1] == pytest.approx([50, 0])
    assert average.points_mm[6] == pytest.approx([30, 2])
    np.testing.assert_array_equal(average.points_mm[0], 0)


def test_release_after_the_farthest_row_does_not_count() -> None:
    path = line(50)
    released = np.concatenate([path, np.column_stack([np.linspace(50, 20, 400), np.full(400, 30.0)])])
    np.testing.assert_allclose(average_path([released], 0.0, 50.0).points_mm, average_path([path], 0.0, 50.0).points_mm)


def test_a_gap_is_nan_and_a_motionless_trial_a_point() -> None:
    jump = np.array([(0, 0), (1.0, 0), (40, 0)])
    average = average_path([jump], 0.0, 40.0)
    assert np.isnan(average.points_mm[3]).all()
    short = average_path([np.array([[0.0, 0.0], [0.03, 0.0]]), np.array([[0.0, 0.0], [0.002, 0.0]])], 0.0, 0.016)
    np.testing.assert_allclose(short.points_mm, [[0.0, 0.0], [0.016, 0.0]])
    still = average_path([np.zeros((5, 2))], 0.0, 0.0)
    np.testing.assert_array_equal(still.points_mm, [[0, 0]])
    np.testing.assert_array_equal(still.lateral_sd_mm, [0])


def test_compat_pools_all_rows_of_all_trials() -> None:
    many, few = line(0.3, rows=301), line(0.3, rows=31) + np.array([0, 0.11])
    average = compat_average([many, few], 0.0)
    assert average.shape == (26, 2)
    np.testing.assert_array_equal(average[0], 0)
    near = [np.abs(path[:, 0] - 0.125) <= 0.024 for path in (many, few)]
    rows = [int(each.sum()) for each in near]
    assert rows[0] > 9 * rows[1] > 9
    i = 1 + 6
    lateral = np.concatenate([path[each, 1] for path, each in zip((many, few), near, strict=True)])
    assert average[i, 1] == pytest.approx(lateral.mean())
    assert np.isnan(average[-1]).all()


def test_compat_turns_with_the_direction() -> None:
    path = line(0.5, 0.02)
    straight = compat_average([path], 0.0)
    turned = compat_average([geometry.rotate(math.radians(135), path)], 135.0)
    np.testing.assert_allclose(turned, geometry.rotate(math.radians(135), straight), atol=1e-9)


def test_unusable_input_is_refused() -> None:
    with pytest.raises(InputError, match="there is no trial to average: give at least one path"):
        average_path([], 0.0, 50.0)
    with pytest.raises(InputError, match="row 0 is not finite"):
        compat_average([np.full((3, 2), np.nan)], 0.0)
    with pytest.raises(InputError, match="there is no trial to summarise"):
        summarise([])


def test_summary_of_metrics() -> None:
    trials = [measure(line(length), np.zeros(200), 0.0) for length in (40.0, 50.0, 60.0)]
    summary = summarise(trials)
    assert summary["distance_mm"].mean == pytest.approx(50)
    assert summary["distance_mm"].sd == pytest.approx(10)
    assert "contact_fraction" not in summary
    assert summarise(trials[:1])["distance_mm"].sd == 0
    unknown = summarise([measure(line(40.0), None, 0.0)])
    assert math.isnan(unknown["rotation_max_deg"].mean)


def test_the_published_distances_of_one_person_come_out(asterisk_data: Path) -> None:
    # The published means are over three trials, of which two are here, so they can only be near.
    trials = read_human_folder(asterisk_data / "human").trials
    for name, published in ONE_PERSON_MM.items():
        mine = [trial for trial in trials if trial.primitive == name]
        assert len(mine) == 2
        farthest = summarise([measure_human(trial) for trial in mine])["max_distance_mm"]
        assert farthest.mean == pytest.approx(published, abs=6), name


def test_averages_of_the_real_recordings(asterisk_data: Path) -> None:
    trials = read_human_folder(asterisk_data / "human").trials
    for name, published in ONE_PERSON_MM.items():
        mine = [trial for trial in trials if trial.primitive == name]
        angle = mine[0].angle_deg
        assert angle is not None
        farthest = summarise([measure_human(trial) for trial in mine])["max_distance_mm"].mean
        average = average_path([trial.filtered_mm for trial in mine], angle, farthest)
        assert np.isfinite(average.points_mm).all()
        tip = geometry.rotate(-math.radians(angle), average.points_mm[-1])
        assert tip[0] == pytest.approx(published, abs=6), name
        assert average.lateral_sd_mm.max() < 20
