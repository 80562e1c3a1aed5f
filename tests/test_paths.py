"""Reference paths: straight ones and those taken from recordings."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from inhand import geometry
from inhand.asterisk_test.people.human import read_human_file, read_human_folder
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.people.paths import human_path
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array
from inhand.tasks.paths import TURN_STEP, straight_path, twist_poses, whole_path
from inhand.tasks.primitives import TRAIN, TURNS, UNSEEN, Primitive


def made_trial(path_mm: Array, rotation_deg: Array | None = None, *, signed: bool = False) -> HumanTrial:
    """Return a trial along Right."""
    turn = np.zeros(len(path_mm)) if rotation_deg is None else rotation_deg
    return HumanTrial(
        source="made.csv",
        subject="made",
        hand="2v2",
        direction="c",
        primitive="Right",
        angle_deg=0.0,
        twist_deg=0.0,
        trial=1,
        unit="mm, degrees",
        frame=np.arange(len(path_mm), dtype=float),
        start_mm=np.zeros(2),
        path_mm=path_mm,
        rotation_deg=turn,
        rotation_signed=signed,
        rotation_usable=True,
        filtered_mm=path_mm,
        filtered_rotation_deg=turn,
        moving=(0, len(path_mm)),
    )


@pytest.mark.parametrize("primitive", [*TRAIN, *UNSEEN], ids=lambda each: each.name)
def test_a_straight_path_lies_on_its_direction(primitive: Primitive) -> None:
    path = straight_path(primitive, length=0.1, step=0.004)
    np.testing.assert_allclose(path.poses[:, :2], path.way[:, None] * primitive.unit, atol=1e-15)
    np.testing.assert_array_equal(path.poses[:, 2], 0)
    assert path.length == pytest.approx(0.1, abs=1e-15)
    assert np.diff(path.way).max() <= 0.004 + 1e-12


def test_a_straight_path_holds_a_twist() -> None:
    path = straight_path(Primitive("Right p15", 0.0, -15.0), length=0.1)
    np.testing.assert_array_equal(path.poses[:, 2], 0)
    assert path.twist == pytest.approx(-math.radians(15))
    before, whole = twist_poses(path), whole_path(path)
    np.testing.assert_array_equal(before[:, :2], 0)
    assert before[0, 2] == 0
    assert np.diff(before[:, 2]).min() >= -TURN_STEP - 1e-12
    np.testing.assert_allclose(whole[: len(before)], before)
    np.testing.assert_allclose(whole[len(before) - 1 :, 2], -math.radians(15))
    np.testing.assert_allclose(whole[-1, :2], (0.1, 0), atol=1e-12)
    np.testing.assert_allclose(np.diff(whole[len(before) - 1 :, 0]), np.diff(path.way), atol=1e-12)


def test_without_a_twist_the_whole_path_is_the_path() -> None:
    path = straight_path(Primitive("Right", 0.0), length=0.1)
    np.testing.assert_array_equal(whole_path(path), path.poses)
    np.testing.assert_array_equal(twist_poses(path), np.zeros((1, 3)))


@pytest.mark.parametrize(("primitive", "sign"), [(TURNS[0], -1), (TURNS[1], 1)])
def test_a_turn_has_its_angle_as_progress(primitive: Primitive, sign: int) -> None:
    path = straight_path(primitive)
    np.testing.assert_allclose(TURN_ARM * path.poses[:, 2], sign * path.way)
    assert path.length == pytest.approx(TURN_ARM * abs(math.radians(primitive.rotation_deg)))
    np.testing.assert_array_equal(path.poses[:, :2], 0)


def test_poses_along_a_path_are_interpolated_and_held_at_the_ends() -> None:
    path = straight_path(TRAIN[1], length=0.1)
    poses = path.at([-1.0, 0.0, 0.0505, 0.1, 7.0])
    np.testing.assert_allclose(np.linalg.norm(poses[:, :2], axis=1), [0, 0, 0.0505, 0.1, 0.1], atol=1e-12)
    assert poses.shape == (5, 3)


@pytest.mark.parametrize(("length", "step"), [(0.0, 0.001), (-1.0, 0.001), (math.nan, 0.001), (0.1, 0.0)])
def test_lengths_and_steps_must_be_positive(length: float, step: float) -> None:
    with pytest.raises(InputError, match=r"(length|step) .* is not usable: give a positive, finite number"):
        straight_path(TRAIN[0], length=length, step=step)


def test_a_turn_by_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="rotation of still 0 is not usable"):
        straight_path(Primitive("still", None, 0.0))


def test_a_wandering_hand_leaves_the_path_and_not_its_rows() -> None:
    course = np.concatenate([np.linspace(0, 30, 60), np.linspace(30, 10, 60), np.linspace(10, 50, 90)])
    course = np.concatenate([course, np.full(100, 50.0), np.linspace(50, 20, 600)])
    lateral = 0.1 * course
    lateral[-600:] = 25.0
    path = human_path(made_trial(np.column_stack([course, lateral])))
    np.testing.assert_allclose(path.poses[:, 0], np.linspace(0.0, 0.05, 51))
    np.testing.assert_allclose(path.poses[:, 1], 0.1 * path.poses[:, 0], atol=2e-4)
    np.testing.assert_allclose(path.poses[0], 0, atol=1e-15)


def test_one_outlier_does_not_bend_the_path() -> None:
    points = np.column_stack([np.linspace(0, 40, 200), np.zeros(200)])
    points[100, 1] = 17.0
    np.testing.assert_allclose(human_path(made_trial(points)).poses[:, 1], 0, atol=1e-12)


def test_fast_frames_leave_no_gaps() -> None:
    points = np.column_stack([np.arange(0, 80, 13.0), 0.5 * np.arange(0, 80, 13.0)])
    path = human_path(made_trial(points))
    assert np.isfinite(path.poses).all()
    np.testing.assert_allclose(path.poses[:, 1], 0.5 * path.poses[:, 0], atol=1.1e-3)


def test_a_translation_keeps_its_rotation() -> None:
    points, turn = np.column_stack([np.linspace(0, 40, 200), np.zeros(200)]), np.linspace(-15, -11, 200)
    np.testing.assert_array_equal(human_path(made_trial(points, turn, signed=True)).poses[:, 2], 0)


def test_a_trial_that_hardly_moves_has_no_path() -> None:
    still = made_trial(np.zeros((20, 2)))
    with pytest.raises(InputError, match=r"Right of made.csv: the object moves less than one step.*use another trial"):
        human_path(still)
    away = replace(still, filtered_mm=np.column_stack([np.linspace(0, -30, 20), np.zeros(20)]))
    with pytest.raises(InputError, match="less than one step"):
        human_path(away)


def test_paths_of_the_real_recordings(asterisk_data: Path) -> None:
    for trial in read_human_folder(asterisk_data / "human").trials:
        path = human_path(trial)
        assert np.isfinite(path.poses).all()
        assert np.all(np.diff(path.way) > 0)
        np.testing.assert_allclose(path.poses[0], 0, atol=1e-15)
        if trial.angle_deg is None:
            turned = path.poses[:, 2] * (-1 if trial.primitive == "cw" else 1)
            np.testing.assert_allclose(turned, TURN_STEP * np.arange(len(turned)), atol=1e-12)
            assert 25 < math.degrees(turned[-1]) < 52
        else:
            along, lateral = geometry.rotate(-math.radians(trial.angle_deg), path.poses[:, :2]).T
            np.testing.assert_allclose(along, 0.001 * np.arange(len(along)), atol=1e-12)
            assert 0.035 < along[-1] < 0.085
            # The person walked the object up to 24 mm sideways; per mm of progress the path follows calmly.
            assert np.abs(np.diff(lateral)).max() < 0.005


def test_a_straight_recording_gives_a_straight_path(asterisk_data: Path) -> None:
    trial = read_human_file(asterisk_data / "straight" / "exp_2v2_h_n_1.csv")
    path = human_path(trial)
    np.testing.assert_allclose(path.poses[:, :2], 0.001 * np.arange(71)[:, None] * TRAIN[7].unit, atol=1e-9)
