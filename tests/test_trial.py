"""Trials: what an episode leaves, and the file it is kept in."""

import json
import zipfile
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from inhand.control.trial import FORMAT, LOST_CONTACT, MANIPULATE, NO_GRASP, Passport, Trial, load_trial, save_trial
from inhand.errors import InputError
from inhand.geometry import spatial
from inhand.hands.names import CATALOGUE as HANDS
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.sim.state import CONTACT_TOLERANCE

PHASES = ("place", "grasp", MANIPULATE)


def made_trial(hand: str = HANDS[0], thing: str = "cube_39", rows: int = 12) -> Trial:
    """Return a made-up trial: four rows of each phase, the object moving along +y and turning past half a turn."""
    spec = parse_hand_name(hand)
    rng = np.random.default_rng(rows)
    along = 1e-3 * np.arange(rows)
    pose = np.column_stack([np.full(rows, 0.01), 0.09 + along, np.linspace(3.0, 3.3, rows)])
    passport = Passport(
        hand=spec,
        object=OBJECTS[thing],
        controller="ik",
        primitive="Out",
        angle_deg=90.0,
        rotation_deg=0.0,
        path="straight line, 1 mm",
        trial=2,
        seed=7,
        substeps=5,
        timestep=0.004,
        versions={"inhand": "0", "numpy": "2"},
    )
    return Trial(
        passport=passport,
        outcome=LOST_CONTACT,
        phases=PHASES,
        phase=np.arange(rows) // 4,
        time=0.02 * np.arange(rows, dtype=float),
        object_pose=spatial(pose, 0.05),
        joint_angles=rng.normal(size=(rows, spec.n_joints)),
        targets=rng.normal(size=(rows, spec.n_joints)),
        gaps=np.tile([0.0, 2 * CONTACT_TOLERANCE], (rows, 1)),
        contact_links=rng.integers(0, 2, (rows, 2)),
        finger_points=rng.normal(size=(rows, 2, 2)),
        object_points=rng.normal(size=(rows, 2, 2)),
        reference=np.column_stack([np.zeros(5), 1e-3 * np.arange(5), np.zeros(5)]),
    )


@pytest.mark.parametrize("hand", [*HANDS, "2v2_50.50_50.50_1.1_53:lab-limits"])
@pytest.mark.parametrize("thing", ["cube_39", "ellipse_40x25", "hourglass"])
def test_saving_and_loading_changes_nothing(hand: str, thing: str, tmp_path: Path) -> None:
    trial = made_trial(hand, thing)
    save_trial(trial, tmp_path / "trial.npz")
    again = load_trial(tmp_path / "trial.npz")
    assert again.passport == trial.passport
    assert hash(again.passport.hand) == hash(trial.passport.hand)
    for field in fields(Trial):
        before, after = getattr(trial, field.name), getattr(again, field.name)
        if isinstance(before, np.ndarray):
            assert after.dtype == before.dtype, field.name
            np.testing.assert_array_equal(after, before, err_msg=field.name)
        else:
            assert after == before, field.name


def test_a_trial_from_before_objects_had_corners_loads(tmp_path: Path) -> None:
    path = tmp_path / "trial.npz"
    save_trial(made_trial(), path)
    with np.load(path, allow_pickle=False) as data:
        arrays = {name: data[name] for name in data.files}
    head = json.loads(str(arrays["head"]))
    del head["passport"]["object"]["corners"]
    np.savez(path, **arrays | {"head": np.array(json.dumps(head))})
    assert load_trial(path).passport.object == OBJECTS["cube_39"]


def test_the_direction_of_a_rotation_stays_none(tmp_path: Path) -> None:
    trial = made_trial()
    turning = replace(trial, passport=replace(trial.passport, angle_deg=None, rotation_deg=-60.0))
    save_trial(turning, tmp_path / "cw.npz")
    assert load_trial(tmp_path / "cw.npz").passport.angle_deg is None


def test_files_hold_no_pickles_and_leave_no_part(tmp_path: Path) -> None:
    path = tmp_path / "trial.npz"
    save_trial(made_trial(), path)
    assert [each.name for each in tmp_path.iterdir()] == ["trial.npz"]
    with np.load(path, allow_pickle=False) as data:
        assert all(data[name].dtype.kind in "fiU" for name in data.files)
        assert json.loads(str(data["head"]))["format"] == FORMAT


def test_saving_again_replaces_the_file(tmp_path: Path) -> None:
    path = tmp_path / "trial.npz"
    save_trial(made_trial(), path)
    save_trial(replace(made_trial(), outcome=NO_GRASP), path)
    assert load_trial(path).outcome == NO_GRASP


def test_the_manipulated_path_starts_at_manipulation_and_never_jumps_a_turn() -> None:
    trial = made_trial()
    assert trial.manipulation == slice(8, 12)
    path, rotation, touching = trial.manipulated_path()
    np.testing.assert_allclose(path, [(0, 0), (0, 1), (0, 2), (0, 3)], atol=1e-9)
    np.testing.assert_allclose(rotation, np.rad2deg(0.3 / 11) * np.arange(4), atol=1e-9)
    np.testing.assert_array_equal(touching, np.tile([True, False], (4, 1)))


def test_a_finger_touches_up_to_the_tolerance() -> None:
    trial = made_trial(rows=3)
    gaps = np.array([(-1e-3, CONTACT_TOLERANCE), (0.0, 1.01 * CONTACT_TOLERANCE), (1.0, 0.0)])
    np.testing.assert_array_equal(
        replace(trial, gaps=gaps).touching, [(True, True), (True, False), (False, True)]
    )  # fmt: skip


def test_a_failed_grasp_gives_one_row_at_the_origin_without_contact() -> None:
    trial = replace(made_trial(rows=8), outcome=NO_GRASP)
    path, rotation, touching = trial.manipulated_path()
    assert trial.manipulation == slice(8, 8)
    np.testing.assert_array_equal(path, [(0, 0)])
    np.testing.assert_array_equal(rotation, [0])
    assert not touching.any()


def rewritten(path: Path, change: Callable[[dict[str, Any]], None]) -> None:
    """Write a trial whose head was changed."""
    save_trial(made_trial(), path)
    with np.load(path) as data:
        arrays = {name: data[name] for name in data.files}
    head = json.loads(str(arrays["head"]))
    change(head)
    arrays["head"] = np.array(json.dumps(head))
    np.savez(path, **arrays)


def test_a_trial_of_another_format_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "old.npz"
    rewritten(path, lambda head: head.update(format=FORMAT + 1))
    with pytest.raises(InputError, match=rf"has trial format {FORMAT + 1}; this version reads {FORMAT}: run it again"):
        load_trial(path)


def test_a_missing_trial_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no trial file .*nowhere\.npz: give a \.npz file from the `trials` folder"):
        load_trial(tmp_path / "nowhere.npz")


def test_a_folder_is_no_trial(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no trial file"):
        load_trial(tmp_path)


def empty(path: Path) -> None:
    path.write_bytes(b"")


def junk(path: Path) -> None:
    path.write_bytes(b"no zip file at all" * 20)


def truncated(path: Path) -> None:
    save_trial(made_trial(), path)
    path.write_bytes(path.read_bytes()[:-200])


def flipped(path: Path) -> None:
    save_trial(made_trial(), path)
    content = bytearray(path.read_bytes())
    for i in range(60, 400):
        content[i] ^= 0x55
    path.write_bytes(bytes(content))


def one_array(path: Path) -> None:
    with path.open("wb") as file:
        np.save(file, np.zeros(3))


def no_head(path: Path) -> None:
    np.savez(path, time=np.zeros(3))


def another_zip(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("readme.txt", "hello")


def head_is_a_list(path: Path) -> None:
    np.savez(path, head=np.array("[1]"))


def head_is_no_json(path: Path) -> None:
    np.savez(path, head=np.array("{"))


def no_hand(path: Path) -> None:
    rewritten(path, lambda head: head.update(passport={}))


def strange_passport(path: Path) -> None:
    rewritten(path, lambda head: head["passport"].update(colour="red"))


@pytest.mark.parametrize(
    "damage",
    [
        empty,
        junk,
        truncated,
        flipped,
        one_array,
        no_head,
        another_zip,
        head_is_a_list,
        head_is_no_json,
        no_hand,
        strange_passport,
    ],
)
def test_files_that_are_no_trials_are_refused(damage: Callable[[Path], None], tmp_path: Path) -> None:
    path = tmp_path / "bad.npz"
    damage(path)
    with pytest.raises(InputError, match=r"bad\.npz is not a trial: .*give a \.npz file from the `trials` folder"):
        load_trial(path)
