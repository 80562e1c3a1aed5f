"""Metrics: the check vectors of the Asterisk Test, laws on random paths, and ordinary odd trials."""

import math
from dataclasses import asdict, astuple
from pathlib import Path

import numpy as np
import pytest
import similaritymeasures
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from inhand import geometry
from inhand.asterisk_test.compatible import measure_asterisk
from inhand.asterisk_test.metrics import Metrics, measure, measure_human
from inhand.asterisk_test.people.human import read_human_folder
from inhand.errors import InputError
from inhand.geometry import Array

PATH = np.array([(0, 0), (0.1, 0), (0.2, 0.1), (0.3, 0.1), (0.4, 0)])
TURN = np.array([0.0, 2, 4, 6, 3])
SPIN = np.array([(0, 0, 0), (0.01, 0, 10), (0.02, 0.01, 20), (0.01, 0.01, 18)])
FIELDS = (
    "distance_mm max_distance_mm lateral_max_mm lateral_rms_mm rotation_max_deg rotation_final_deg arc_length_mm"
    " efficiency frechet_mm contact_fraction longest_gap_s path_max_mm path_rms_mm"
)
COORDINATE = st.integers(-100_000, 100_000).map(lambda each: each / 1000)
PATHS = st.integers(2, 25).flatmap(lambda rows: arrays(np.float64, (rows, 2), elements=COORDINATE))


def test_fields() -> None:
    assert list(Metrics.__dataclass_fields__) == FIELDS.split()


def test_primary_check_vector() -> None:
    metrics = measure(PATH, TURN, 0.0)
    assert metrics.distance_mm == pytest.approx(0.4)
    assert metrics.arc_length_mm == pytest.approx(0.482843, abs=5e-7)
    assert metrics.efficiency == pytest.approx(0.828427, abs=5e-7)
    assert metrics.lateral_max_mm == pytest.approx(0.1)
    assert metrics.lateral_rms_mm == pytest.approx(math.sqrt(0.02 / 5))
    assert (metrics.rotation_max_deg, metrics.rotation_final_deg) == (6, 3)
    assert metrics.frechet_mm == pytest.approx(0.1, abs=0.003)
    assert metrics.contact_fraction is None
    assert metrics.longest_gap_s is None


def test_asterisk_check_vector_of_direction_c() -> None:
    got = measure_asterisk(PATH, TURN, 0.0)
    expected = {
        "dist": 0.404040,
        "arc_len": 0.482843,
        "mvt_eff": 0.836795,
        "max_err": 0.207107,
        "max_err_rot": 12.426407,
        "t_fd": 0.110697,
        "fd": 6.000834,
        "area_btwn": 0.020122,
    }
    assert {name: round(asdict(got)[name], 6) for name in expected} == expected
    assert math.isnan(got.max_a_reg)
    assert math.isnan(got.max_a_loc)


def test_asterisk_check_vector_of_a_rotation() -> None:
    got = measure_asterisk(SPIN[:, :2], SPIN[:, 2], None)
    assert got.dist == 20
    assert got.arc_len == pytest.approx(22.000040, abs=5e-7)
    assert got.mvt_eff == pytest.approx(0.909089, abs=5e-7)
    assert got.t_fd == pytest.approx(0.022361, abs=5e-7)
    assert got.fd == pytest.approx(0.022361, abs=5e-7)
    assert math.isnan(got.max_err)


@pytest.mark.parametrize("angle", [90.0, 45.0, -135.0, 22.5])
def test_asterisk_metrics_turn_with_the_direction(angle: float) -> None:
    straight = measure_asterisk(PATH, TURN, 0.0)
    turned = measure_asterisk(geometry.rotate(math.radians(angle), PATH), TURN, angle)
    for name in ("dist", "arc_len", "mvt_eff", "max_err", "max_err_rot", "t_fd", "fd"):
        assert asdict(turned)[name] == pytest.approx(asdict(straight)[name]), name


def test_asterisk_target_rotation_and_raw_path() -> None:
    raw = PATH + np.array([0, 0.05])
    got = measure_asterisk(PATH, TURN - 15, 0.0, target_rotation_deg=-15.0, raw_path=raw)
    plain = measure_asterisk(PATH, TURN, 0.0)
    assert got.max_err_rot == pytest.approx(plain.max_err_rot)
    assert got.fd == pytest.approx(plain.fd)
    assert got.max_err == pytest.approx(0.15 / plain.arc_len)


@settings(max_examples=40, deadline=None)
@given(PATHS, PATHS)
def test_the_frechet_distance_is_the_librarys_own(one: Array, other: Array) -> None:
    for a, b in ((one, other), (other, one), (one, other[:1]), (np.c_[one, one[:, 0]], np.c_[other, -other[:, 1]])):
        assert geometry.frechet(a, b) == pytest.approx(similaritymeasures.frechet_dist(a, b), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("rows", [2, 40, 130])
def test_the_area_is_the_librarys_own(rows: int) -> None:
    """Points are put into the shorter curve as the library does, faster."""
    path = np.cumsum(np.random.default_rng(rows).normal(0.01, 0.02, (rows, 2)), axis=0)
    path[rows // 2 :, 0] = path[rows // 2, 0]  # some of its points lie above each other, and gaps are alike
    got = measure_asterisk(path, np.zeros(rows), 0.0)
    line = np.linspace(0.0, 0.5, 100)
    nearest = int(np.argmin(np.hypot(line - path[-1, 0], path[-1, 1])))
    target = np.column_stack([line, 0 * line])[: max(nearest, 1)]
    expected = similaritymeasures.area_between_two_curves(path, target) if len(target) > 1 else math.nan
    np.testing.assert_equal(got.area_btwn, float(expected))


def test_the_window_finds_the_bump() -> None:
    x = np.linspace(0, 0.45, 200)
    bump = 0.1 * np.exp(-(((x - 0.3) / 0.02) ** 2))
    got = measure_asterisk(np.column_stack([x, bump]), np.zeros(200), 0.0)
    assert got.max_a_loc == pytest.approx(0.6, abs=0.03)
    assert 0 < got.max_a_reg < got.area_btwn * 1.5
    away = measure_asterisk(np.column_stack([x, 0 * bump]), np.zeros(200), 0.0)
    assert away.max_a_reg == pytest.approx(0, abs=1e-12)


def test_the_target_line_ends_before_the_sample_nearest_to_the_end() -> None:
    line = np.column_stack([np.linspace(0, 0.5, 100), np.zeros(100)])
    got = measure_asterisk(line[:51], np.zeros(51), 0.0)
    assert got.t_fd == pytest.approx(0.5 / 99)
    assert got.dist == pytest.approx(51 * 0.5 / 99)


def test_a_path_past_the_end_of_the_line_stays_on_it() -> None:
    x = np.linspace(0, 0.9, 50)
    assert measure_asterisk(np.column_stack([x, 0 * x]), 0 * x, 0.0).dist == 0.5


@pytest.mark.parametrize("angle", [0.0, None])
@pytest.mark.parametrize("rows", [1, 2, 30])
def test_a_motionless_trial_is_ordinary(angle: float | None, rows: int) -> None:
    metrics = measure(np.full((rows, 2), 3.0), np.zeros(rows), angle)
    assert astuple(metrics)[:9] == (0,) * 9
    asterisk = measure_asterisk(np.zeros((rows, 2)), np.zeros(rows), angle)
    assert asterisk.arc_len == 0
    assert math.isnan(asterisk.mvt_eff)


def test_one_rotation_row_alone() -> None:
    assert measure(np.zeros((1, 2)), np.array([7.0]), 90.0).rotation_max_deg == 7
    assert measure(np.zeros((1, 2)), np.array([7.0]), None).rotation_max_deg == 0


def test_moving_away_is_negative_and_not_efficient() -> None:
    metrics = measure(np.array([(0, 0), (-30.0, 0)]), np.zeros(2), 0.0)
    assert metrics.distance_mm == -30
    assert metrics.max_distance_mm == 0
    assert metrics.efficiency == -1
    assert metrics.frechet_mm == 30


def test_a_rotation_reports_what_it_turned_and_how_far_it_drifted() -> None:
    metrics = measure(100 * SPIN[:, :2], -SPIN[:, 2], None)
    assert (metrics.rotation_max_deg, metrics.rotation_final_deg) == (20, 18)
    assert metrics.efficiency == pytest.approx(18 / 22)
    assert (metrics.distance_mm, metrics.max_distance_mm) == (0, 0)
    assert metrics.lateral_max_mm == pytest.approx(math.hypot(2, 1))
    assert metrics.frechet_mm == pytest.approx(metrics.lateral_max_mm)


def test_the_frechet_distance_does_not_depend_on_how_often_a_line_is_sampled() -> None:
    few = measure(np.array([(0, 0), (40.0, 0)]), np.zeros(2), 0.0)
    many = measure(np.linspace([0, 0], [40.0, 0], 500), np.zeros(500), 0.0)
    assert few.frechet_mm < 0.5
    assert many.frechet_mm < 0.5


def test_rotation_is_the_difference_from_the_target() -> None:
    metrics = measure(PATH, TURN - 15, 0.0, target_rotation_deg=-15.0)
    assert (metrics.rotation_max_deg, metrics.rotation_final_deg) == (6, 3)


def test_an_unknown_rotation_is_nan() -> None:
    metrics = measure(PATH, None, 0.0)
    assert math.isnan(metrics.rotation_max_deg)
    assert metrics.distance_mm == pytest.approx(0.4)


def test_only_rows_before_the_first_lost_contact_count() -> None:
    path = np.column_stack([10.0 * np.arange(10), np.zeros(10)])
    path[5:, 1] = 50
    turn = np.concatenate([np.zeros(5), np.full(5, 80.0)])
    contact = np.ones((10, 2), dtype=bool)
    contact[5, 0] = contact[7, 1] = contact[8, 0] = contact[9] = False
    metrics = measure(path, turn, 0.0, contact=contact, row_s=0.02)
    assert (metrics.distance_mm, metrics.arc_length_mm) == (40, 40)
    assert (metrics.lateral_max_mm, metrics.rotation_max_deg) == (0, 0)
    assert metrics.contact_fraction == pytest.approx(0.6)
    assert metrics.longest_gap_s == pytest.approx(0.06)


def test_unbroken_contact_changes_nothing_and_none_at_all_leaves_the_start() -> None:
    held = measure(PATH, TURN, 0.0, contact=np.ones((5, 2), dtype=bool))
    assert astuple(held)[:9] == astuple(measure(PATH, TURN, 0.0))[:9]
    assert (held.contact_fraction, held.longest_gap_s) == (1.0, 0)
    lost = measure(PATH, TURN, 0.0, contact=np.zeros((5, 2), dtype=bool))
    assert astuple(lost) == (*(0.0,) * 9, 0.0, 5.0, None, None)


@settings(max_examples=60, deadline=None)
@given(PATHS, st.integers(-180, 180), st.integers(-180, 180))
def test_laws_on_random_paths(path: Array, angle: int, turn: int) -> None:
    zeros = np.zeros(len(path))
    metrics = measure(path, zeros, float(angle))
    assert metrics.distance_mm <= metrics.arc_length_mm + 1e-9
    assert metrics.distance_mm <= metrics.max_distance_mm <= metrics.arc_length_mm + 1e-9
    assert 0 <= metrics.lateral_rms_mm <= metrics.lateral_max_mm + 1e-9
    assert metrics.efficiency <= 1
    assert metrics.frechet_mm >= metrics.lateral_max_mm - 1e-9
    turned = measure(geometry.rotate(math.radians(turn), path), zeros, float(angle + turn))
    for name, value in asdict(metrics).items():
        if value is not None and name != "frechet_mm":
            assert asdict(turned)[name] == pytest.approx(value, abs=1e-6), name
    # Rounding can put one point more between two rows, which moves the discrete distance by its spacing.
    spacing = max(metrics.distance_mm / 99, metrics.arc_length_mm / 300)
    assert turned.frechet_mm == pytest.approx(metrics.frechet_mm, abs=spacing + 1e-6)


@pytest.mark.parametrize(
    ("path", "turn", "text"),
    [
        (np.array([(0, 0), (1, np.nan)]), np.zeros(2), r"row 1 is not finite \(x 1.0, y nan, rotation 0.0\)"),
        (np.zeros((3, 2)), np.array([0, 0, np.inf]), r"row 2 is not finite .*give None as rotation"),
        (np.zeros((3, 3)), np.zeros(3), r"path has shape \(3, 3\) and rotation \(3,\): give a path \(T, 2\)"),
        (np.zeros((3, 2)), np.zeros(2), r"rotation \(2,\)"),
        (np.zeros((0, 2)), np.zeros(0), r"at least one row"),
    ],
)
def test_unusable_input_is_refused(path: Array, turn: Array, text: str) -> None:
    with pytest.raises(InputError, match=text):
        measure(path, turn, 0.0)
    with pytest.raises(InputError, match=text):
        measure_asterisk(path, turn, 0.0)


def test_unusable_contact_and_angles_are_refused() -> None:
    with pytest.raises(InputError, match=r"contact has shape \(4, 2\) for 5 rows"):
        measure(PATH, TURN, 0.0, contact=np.ones((4, 2), dtype=bool))
    with pytest.raises(InputError, match=r"direction nan and target rotation 0\.0 must be finite"):
        measure(PATH, TURN, math.nan)


def test_metrics_of_the_real_recordings(asterisk_data: Path) -> None:
    for folder in ("human", "thesis_ik"):
        for trial in read_human_folder(asterisk_data / folder).trials:
            metrics = measure_human(trial)
            assert math.isnan(metrics.rotation_max_deg) == (folder == "thesis_ik")
            if folder == "human" and trial.angle_deg is None:
                assert 25 < metrics.rotation_max_deg < 52
            elif folder == "human":
                assert 35 < metrics.distance_mm <= metrics.max_distance_mm < 85
                assert 0.15 < metrics.efficiency <= 1
                assert metrics.lateral_max_mm < 25
