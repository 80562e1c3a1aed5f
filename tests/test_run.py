"""Runs of the Asterisk Test: what is refused before anything happens, and the laws every run keeps."""

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.people.human import read_human_folder
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.people.paths import human_path
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.control.draws import start_noise
from inhand.control.trial import GRIP_END, OUTCOMES, Trial
from inhand.errors import InputError
from inhand.hands.names import CATALOGUE as HANDS
from inhand.tasks.paths import straight_path
from inhand.tasks.primitives import TRAIN, TURNS, UNSEEN, primitive_at

QUIET = AsteriskConfig(trials=1, noise_mm=0.0, noise_deg=0.0)


def run(config: AsteriskConfig, people: Sequence[HumanTrial] = ()) -> tuple[Trial, ...]:
    return simulate(config, prepare(config, people))


def refused(config: AsteriskConfig, text: str, people: Sequence[HumanTrial] = ()) -> None:
    with pytest.raises(InputError, match=text):
        prepare(config, people)


# What is refused.


@pytest.mark.parametrize("trials", [0, -3])
def test_no_trials(trials: int) -> None:
    refused(AsteriskConfig(trials=trials), rf"--trials {trials}: give at least one trial for each direction")


def test_noise_that_is_none() -> None:
    refused(AsteriskConfig(noise_mm=-0.5), r"--noise-mm -0.5: noise must be 0 or more")
    refused(AsteriskConfig(noise_deg=-0.5), r"--noise-deg -0.5: noise must be 0 or more")


def test_a_negative_seed() -> None:
    refused(AsteriskConfig(seed=-1), r"--seed -1: a seed is 0 or more")


def test_an_unknown_hand() -> None:
    refused(
        AsteriskConfig(hand="2v2_50.50_50.50_1.1"),
        rf"unknown hand '2v2_50\.50_50\.50_1\.1': .* five parts .* did you mean {HANDS[0]}.*`inhand hands` lists",
    )


def test_a_malformed_hand() -> None:
    refused(AsteriskConfig(hand="2v2_50.40_50.50_1.1_53"), r"malformed hand name .*'50\.40' .*sum to 100, not 90")


def test_an_unknown_object() -> None:
    refused(AsteriskConfig(object="cub_39"), r"unknown object 'cub_39'; did you mean cube_39.*`inhand objects`")


@pytest.mark.parametrize("name", ["no_such.toml", "folder/thing"])
def test_missing_files(name: str) -> None:
    refused(AsteriskConfig(hand=name), rf"no hand file {name}: give the path of a TOML file")
    refused(AsteriskConfig(object=name), rf"no object file {name}: give the path of a TOML file")


def test_an_object_of_no_size() -> None:
    refused(AsteriskConfig(object="box_39x0"), r"object 'box_39x0': size \[39, 0, 100\] mm; .*three positive lengths")


def test_an_unknown_controller() -> None:
    refused(
        AsteriskConfig(controller="ikk"),
        r"unknown controller 'ikk'; did you mean ik.*allowed are ik, ik-cautious, thesis-ik",
    )


def test_an_unknown_direction() -> None:
    refused(AsteriskConfig(directions="Out,Wright"), r"unknown direction 'Wright'; did you mean Right")
    refused(AsteriskConfig(directions=" , "), r"no direction given\. Use train, unseen, all, twist, names")


def test_an_object_too_wide_for_the_hand() -> None:
    refused(AsteriskConfig(object="box_200x39"), r"object 'box_200x39' is 200\.0 mm wide; hand .* opens to 15\d\.\d mm")


def test_an_object_that_a_rough_grasp_cannot_hold() -> None:
    config = replace(QUIET, object="box_150x39", controller="thesis-ik", directions="Out")
    with pytest.raises(
        InputError,
        match=r"no start grasp holds object 'box_150x39' .*the left finger does not reach the middle of its side;"
        r" use another object or hand, or the controller 'ik'",
    ):
        run(config)


def test_human_paths_without_people() -> None:
    refused(
        AsteriskConfig(paths="human"), r"--paths human: no human trial of direction 'Out'; the folder has none: ask"
    )


def test_human_paths_of_a_direction_that_nobody_went(asterisk_data: Path) -> None:
    people = [t for t in read_human_folder(asterisk_data / "human").trials if t.direction in "bc"]
    refused(
        AsteriskConfig(paths="human", directions="Right,In"),
        r"no human trial of direction 'In'; the folder has Out-Right, Right: ask for those with --directions, or use"
        r" --paths straight",
        people,
    )


# What a run is.


def test_every_direction_gets_its_trials_in_order() -> None:
    setup = prepare(AsteriskConfig(directions="In,unseen", trials=3))
    assert [each.trial for each in setup.assignments] == [1, 2, 3] * 9
    assert [each.primitive.name for each in setup.assignments[::3]] == ["In", *(each.name for each in UNSEEN)]


def test_trials_follow_the_recordings_of_their_direction_in_turn(asterisk_data: Path) -> None:
    people = [t for t in read_human_folder(asterisk_data / "human").trials if t.subject == "josh"]
    config = AsteriskConfig(paths="human", directions="train", trials=3)
    setup = prepare(config, people)
    assert {each.primitive for each in setup.assignments} == set(TRAIN)
    for primitive in TRAIN:
        recordings = [human_path(t) for t in people if t.primitive == primitive.name and t.twist_deg == 0]
        assert len(recordings) == 2
        followed = [each.path for each in setup.assignments if each.primitive == primitive]
        assert [path.name for path in followed] == [recordings[i].name for i in (0, 1, 0)]


def test_human_paths_are_followed(asterisk_data: Path) -> None:
    people = read_human_folder(asterisk_data / "human").trials
    config = replace(QUIET, paths="human", directions="Right,Out-Left")
    for trial in run(config, people):
        path = human_path(next(t for t in people if t.primitive == trial.passport.primitive))
        count = len(path.poses)
        np.testing.assert_array_equal(trial.reference[:count], path.poses)
        np.testing.assert_array_equal(
            trial.reference[count:], np.tile(path.poses[-1], (len(trial.reference) - count, 1))
        )
        moved = trial.manipulated_path()[0] / 1e3
        distance = np.linalg.norm(moved[:, None] - path.poses[:, :2], axis=-1).min(axis=1)
        assert distance.max() < 0.005
        assert np.linalg.norm(moved[-1]) > 0.03


def test_a_trial_tells_where_it_comes_from() -> None:
    (trial,) = run(replace(QUIET, directions="30", seed=4, controller="thesis-ik", object="cylinder_40"))
    passport = trial.passport
    assert (passport.primitive, passport.angle_deg, passport.trial, passport.seed) == ("30 deg", 30.0, 1, 4)
    assert (passport.controller, passport.object.name, passport.hand.name) == ("thesis-ik", "cylinder_40", HANDS[0])
    assert (passport.substeps, passport.timestep) == (5, 0.004)
    assert {"inhand", "mujoco-core", "numpy", "python"} <= set(passport.versions)
    assert trial.phases == ("place", "grasp", "manipulate")
    assert trial.outcome in OUTCOMES
    np.testing.assert_allclose(np.diff(trial.time), 0.02)
    np.testing.assert_array_equal(trial.reference, straight_path(primitive_at(30)).poses)


# Laws.

SMALL = replace(QUIET, directions="Out,In-Right", noise_mm=1.0, noise_deg=1.0, seed=3)


def same_bytes(first: Trial, second: Trial) -> bool:
    """Return whether two trials agree in every byte."""
    arrays = [f.name for f in fields(Trial) if isinstance(getattr(first, f.name), np.ndarray)]
    return first.outcome == second.outcome and all(
        getattr(first, name).tobytes() == getattr(second, name).tobytes() for name in arrays
    )


@pytest.fixture(scope="module")
def small() -> tuple[Trial, ...]:
    """Return two noisy trials."""
    return run(SMALL)


def test_the_same_seed_gives_the_same_bytes(small: tuple[Trial, ...]) -> None:
    for first, second in zip(small, run(SMALL), strict=True):
        assert same_bytes(first, second)


def test_another_seed_gives_another_start(small: tuple[Trial, ...]) -> None:
    for first, second in zip(small, run(replace(SMALL, seed=4)), strict=True):
        assert np.linalg.norm(first.object_pose[0, :2] - second.object_pose[0, :2]) > 1e-4


def test_the_start_noise_is_what_was_asked_for() -> None:
    config = replace(QUIET, controller="thesis-ik", directions="Out", trials=64, noise_mm=2.0, noise_deg=3.0)
    trials = run(config)
    starts = np.stack([trial.object_pose[0] for trial in trials])
    spread = 1e3 * starts[:, :2].std(axis=0)
    np.testing.assert_allclose(spread, 2.0, rtol=0.3)
    turn = np.rad2deg(2 * np.arctan2(starts[:, 6], starts[:, 3]))
    assert turn.std() == pytest.approx(3.0, rel=0.3)
    np.testing.assert_allclose(1e3 * starts[:, :2].mean(axis=0), [0, 93.6], atol=1.0)


def test_without_noise_every_trial_starts_in_the_middle_and_is_the_same() -> None:
    first, second = run(replace(QUIET, controller="thesis-ik", directions="Right", trials=2))
    np.testing.assert_allclose(first.object_pose[0], [0, 0.0936, 0.05, 1, 0, 0, 0], atol=1e-12)
    assert same_bytes(first, second)


def test_a_direction_does_not_depend_on_what_else_is_run(small: tuple[Trial, ...]) -> None:
    """Its grasp is the same; a phase waits for the slowest world of its batch, so that rows can differ by a few."""
    (alone,) = run(replace(SMALL, directions="Out"))
    assert alone.outcome == small[0].outcome
    np.testing.assert_allclose(alone.joint_angles[0], small[0].joint_angles[0], atol=1e-9)
    np.testing.assert_allclose(alone.object_pose[0], small[0].object_pose[0], atol=1e-12)
    assert abs(len(alone.time) - len(small[0].time)) <= 5
    np.testing.assert_allclose(alone.object_pose[-1], small[0].object_pose[-1], atol=5e-4)


def progress_and_side(trial: Trial) -> tuple[float, float]:
    """Return how far a trial came and how far to the left of its direction it ended [mm]."""
    path = trial.manipulated_path()[0]
    angle = np.deg2rad(trial.passport.angle_deg or 0.0)
    along, across = np.array([(np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))]) @ path[-1]
    return float(along), float(across)


@pytest.mark.parametrize(
    ("hand", "thing", "within_mm", "pairs"),
    [
        (
            HANDS[0],
            "cube_39",
            2.5,
            ((67.5, 0, -22.5, -67.5), (112.5, 180, -157.5, -112.5)),
        ),
        ("2v2_65.35_65.35_1.1_53:lab-limits", "cylinder_40", 2.5, ((45, -45), (135, -135))),
        ("3v3_25.40.35_25.40.35_1.1_63", "ellipse_40x25", 4.0, ((45, -20), (135, -160))),
    ],
)
def test_right_mirrors_left(
    hand: str, thing: str, within_mm: float, pairs: tuple[tuple[float, ...], tuple[float, ...]]
) -> None:
    """The search tries poses 3 mm apart, and round outlines leave ties that rounding breaks."""
    angles = ",".join(f"{angle:g}" for angle in (*pairs[0], *pairs[1]))
    trials = run(replace(QUIET, hand=hand, object=thing, directions=angles))
    count = len(pairs[0])
    for right, left in zip(trials[:count], trials[count:], strict=True):
        (along, across), (mirrored, other_side) = progress_and_side(right), progress_and_side(left)
        assert along == pytest.approx(mirrored, abs=within_mm), right.passport.primitive
        assert across == pytest.approx(-other_side, abs=1.0), right.passport.primitive
        assert right.outcome == left.outcome


@pytest.mark.parametrize(
    ("hand", "thing"),
    [("2v3_25.75_25.35.40_1.1_53", "cube_39"), ("2v2_70.30_50.50_0.9.1_53", "ellipse_40x25")],
)
def test_other_hands_and_objects_need_no_special_case(hand: str, thing: str) -> None:
    for trial in run(AsteriskConfig(hand=hand, object=thing, directions="Out,Left,-67.5", trials=1, seed=5)):
        result = result_of_trial(trial)
        assert result.outcome == GRIP_END, result.direction
        assert result.metrics.contact_fraction == pytest.approx(1.0, abs=0.01)
        assert result.metrics.rotation_max_deg < 8


@pytest.mark.parametrize("word", ["cw", "ccw"])
def test_rotations_turn_their_own_way(word: str) -> None:
    (trial,) = run(replace(QUIET, directions=word))
    path, rotation, touching = trial.manipulated_path()
    assert trial.passport.angle_deg is None
    assert rotation[-1] * (-1 if word == "cw" else 1) > 20
    assert np.linalg.norm(path, axis=1).max() < 3
    assert touching.all()


def test_progress_is_told() -> None:
    told: list[tuple[str, int, int]] = []
    config = replace(QUIET, directions="Out", controller="thesis-ik")
    simulate(config, prepare(config), lambda *news: told.append(news))
    assert told[0] == ("reach Out", 1, 0)
    assert [step for *_, step in told[1:]] == list(range(1, len(told)))
    assert [*dict.fromkeys(phase for phase, *_ in told[1:])] == ["place", "grasp", "manipulate"]


# Where trials start.


def test_a_start_follows_from_seed_direction_and_trial_alone() -> None:
    config = AsteriskConfig(controller="thesis-ik", directions="In", trials=1)
    alone = run(config)[0]
    beside = {(t.passport.primitive, t.passport.trial): t for t in run(replace(config, directions="cw,-90", trials=2))}
    starts = {which: trial.object_pose[0] for which, trial in beside.items()}
    assert starts["In", 1].tobytes() == alone.object_pose[0].tobytes()
    assert len({start.tobytes() for start in starts.values()}) == 4


def test_start_noise_is_paired_for_all_spellings_seeds_and_orders() -> None:
    config = AsteriskConfig(noise_mm=1.0, noise_deg=1.0)
    whose = [(p.angle_deg, p.rotation_deg, k) for p in (*TRAIN, *UNSEEN, *TURNS) for k in range(1, 6)]
    noise = start_noise(config, whose)
    assert noise[::-1].tobytes() == start_noise(config, whose[::-1]).tobytes()
    assert len(np.unique(noise, axis=0)) == len(whose)
    assert noise.std(axis=0) == pytest.approx([1e-3, 1e-3, np.deg2rad(1.0)], rel=0.2)
    assert start_noise(config, [(270.0, 0.0, 1)]).tobytes() == start_noise(config, [(-90.0, 0.0, 1)]).tobytes()
    for other in (replace(config, seed=1), replace(config, seed=2)):
        assert not np.isclose(start_noise(other, whose), noise).any(axis=1).all()
    wide = start_noise(replace(config, noise_mm=2.0), whose)
    assert wide == pytest.approx(noise * (2.0, 2.0, 1.0))
