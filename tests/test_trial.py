"""Trials: what an episode leaves, and the file it is kept in."""

import io
import json
import re
import zipfile
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.lib.format import write_array_header_1_0
from numpy.typing import NDArray

from inhand.control.episode import MANIPULATE, TWIST
from inhand.control.trial import FORMAT, LOST_CONTACT, NO_GRASP, Trial, load_trial, save_trial
from inhand.errors import InputError
from inhand.geometry import planar, spatial
from inhand.hands.names import CATALOGUE as HANDS
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.sim.state import CONTACT_TOLERANCE
from made import passport, trial_at

PHASES = ("place", "grasp", MANIPULATE)


def made_trial(hand: str = HANDS[0], thing: str = "cube_39", rows: int = 12) -> Trial:
    """Return a made-up trial: four rows of each phase, the object moving along +y and turning past half a turn."""
    spec = parse_hand_name(hand)
    rng = np.random.default_rng(rows)
    along = 1e-3 * np.arange(rows)
    pose = np.column_stack([np.full(rows, 0.01), 0.09 + along, np.linspace(2.85, 3.2, rows)])
    signed = passport(
        hand=spec,
        object=OBJECTS[thing],
        trial=2,
        seed=7,
        path="straight line, 1 mm",
        versions={"inhand": "0", "numpy": "2"},
    )
    return trial_at(
        pose,
        signed,
        outcome=LOST_CONTACT,
        phases=PHASES,
        phase=np.arange(rows) // 4,
        joint_angles=rng.normal(size=(rows, spec.n_joints)),
        targets=rng.normal(size=(rows, spec.n_joints)),
        gaps=np.tile([0.0, 2 * CONTACT_TOLERANCE], (rows, 1)),
        contact_links=np.column_stack([np.arange(rows) % len(finger.links) for finger in spec.fingers]),
        finger_points=rng.normal(size=(rows, 2, 3)),
        object_points=rng.normal(size=(rows, 2, 3)),
        forces=rng.normal(size=(rows, 2, 3)),
        penetration=1e-4 * rng.random(rows),
        reference=np.column_stack([np.zeros(5), 1e-3 * np.arange(5), np.zeros(5)]),
    )


@pytest.mark.parametrize("hand", [*HANDS, "2v2_50.50_50.50_1.1_53:lab-limits"])
@pytest.mark.parametrize("thing", ["cube_39", "ellipse_40x25", "hourglass"])
def test_saving_and_loading_changes_nothing(hand: str, thing: str, tmp_path: Path) -> None:
    trial = made_trial(hand, thing)
    save_trial(trial, tmp_path / "trial.npz")
    again = load_trial(str(tmp_path / "trial.npz"))
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
    assert np.ptp(planar(trial.object_pose[8:])[:, 2]) > 6  # half a turn is passed on the way
    path, rotation, touching = trial.manipulated_path()
    np.testing.assert_allclose(path, [(0, 0), (0, 1), (0, 2), (0, 3)], atol=1e-9)
    np.testing.assert_allclose(rotation, np.rad2deg(0.35 / 11) * np.arange(4), atol=1e-9)
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


def rewritten(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Write a trial whose head was changed."""
    save_trial(made_trial(), path)
    with np.load(path) as data:
        arrays = {name: data[name] for name in data.files}
    head = json.loads(str(arrays["head"]))
    change(head)
    arrays["head"] = np.array(json.dumps(head))
    np.savez(path, **arrays)


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


HEADS: list[tuple[Callable[[dict[str, Any]], object], str]] = [
    (lambda head: head.update(format=3), "it has format 3; this version reads 2"),
    (lambda head: head.update(passport={}), "passport has no field hand"),
    (lambda head: head.update(passport=[]), "passport is []; it must be a table"),
    (
        lambda head: head.update(outcome="won"),
        "outcome is 'won'; it must be reached or end of grip or no movement or lost contact",
    ),
    (lambda head: head.update(phases="grasp"), "phases is 'grasp'; it must be a list"),
    (lambda head: head.update(phases=["grasp"]), "phase holds [0, 1, 2]; it must hold numbers from 0 to 0"),
    (lambda head: head["passport"].update(colour="red"), "passport.colour is a field that this version does not know"),
    (lambda head: head["passport"].update(angle_deg="90"), "passport.angle_deg is '90'; it must be a number or null"),
    (lambda head: head["passport"].update(object=None), "passport.object is None; it must be a table"),
    (lambda head: head["passport"].update(trial=1.5), "passport.trial is 1.5; it must be a whole number"),
    (lambda head: head["passport"].update(substeps=-5), "passport: substeps is -5; it must be above 0"),
    (lambda head: head["passport"]["versions"].update(numpy=2), "must be a text"),
    (lambda head: head["passport"]["object"].update(shape="ball"), "shape is 'ball'; it must be box or cylinder or"),
    (lambda head: head["passport"]["object"].update(size=[1, 2]), "size is [1, 2]; it must be a list of length 3"),
    (lambda head: head["passport"]["object"].update(mass=-1), "passport.object: object 'cube_39': mass -1 kg"),
    (lambda head: head["passport"]["hand"]["left"].update(links=[0.05]), "2 limits for the 1 links of the left finger"),
    (lambda head: head["passport"]["hand"]["left"].update(bend=0), "2 links and bend 0"),
    (lambda head: head["passport"]["hand"]["right"]["links"].append("x"), "right.links[2] is 'x'; it must be a number"),
    (lambda head: head["passport"]["hand"].update(friction=True), "hand.friction is True; it must be a number"),
]
"""Changes of a head, and what the text says of it."""


@pytest.mark.parametrize(("change", "text"), HEADS)
def test_a_head_that_cannot_be_is_refused(
    change: Callable[[dict[str, Any]], object], text: str, tmp_path: Path
) -> None:
    rewritten(tmp_path / "bad.npz", change)
    with pytest.raises(InputError, match=rf"bad\.npz is not a trial: .*{re.escape(text)}.*run it again"):
        load_trial(tmp_path / "bad.npz")


def test_a_head_nested_beyond_measure_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "bad.npz", head=np.array("[" * 100_000))
    with pytest.raises(InputError, match="its JSON is nested too deeply"):
        load_trial(tmp_path / "bad.npz")


ROWS = made_trial()
ARRAYS: list[tuple[str, NDArray[Any] | None, str]] = [
    ("time", None, "it has no array time"),
    ("time", ROWS.time.astype(str), "time holds <U32; it must hold numbers"),
    ("time", ROWS.time > 0, "time holds bool; it must hold numbers"),
    ("time", ROWS.time + 1j, "time holds complex128; it must hold numbers"),
    ("time", ROWS.time[:-1], "time has the shape (11,); it must be (12,)"),
    ("time", ROWS.time[:, None], "time has the shape (12, 1); it must be (12,)"),
    ("object_pose", ROWS.object_pose[:, :3], "object_pose has the shape (12, 3); it must be (12, 7)"),
    ("object_pose", np.full((12, 7), np.nan), "object_pose holds nan at [0, 0]; it must hold finite numbers"),
    ("joint_angles", np.zeros((12, 6)), "joint_angles has the shape (12, 6); it must be (12, 4)"),
    ("gaps", np.zeros((12, 3)), "gaps has the shape (12, 3); it must be (12, 2)"),
    ("phase", ROWS.phase - 1, "phase holds [-1, 0, 1]; it must hold numbers from 0 to 2"),
    ("phase", ROWS.phase / 1.0, "phase holds float64; it must hold whole numbers"),
    ("contact_links", ROWS.contact_links + 2, "it must hold numbers from 0 to 1"),
    ("contact_links", np.tile([0, 2], (12, 1)), "contact_links holds [2]; it must hold numbers from 0 to 1"),
    ("object_pose", np.full((12, 7), 1e300), "object_pose holds 1e+300 at [0, 0]; it must hold finite numbers below"),
    ("reference", np.zeros((5, 2)), "reference has the shape (5, 2); it must be (5, 3)"),
    ("reference", np.zeros((0, 3)), "reference has the shape (0, 3) and holds nothing"),
    ("reference", np.zeros((1, 3)), "reference has one way-point; a path has two or more"),
]
"""Arrays in the place of a trial's, and what the text says of them."""


@pytest.mark.parametrize(("name", "array", "text"), ARRAYS)
def test_arrays_that_cannot_be_are_refused(name: str, array: NDArray[Any] | None, text: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.npz"
    save_trial(ROWS, path)
    with np.load(path) as data:
        arrays = {key: data[key] for key in data.files} | {name: array}
    np.savez(path, **{key: value for key, value in arrays.items() if value is not None})
    with pytest.raises(InputError, match=rf"bad\.npz is not a trial: .*{re.escape(text)}"):
        load_trial(path)


@pytest.mark.parametrize("shape", [(10**15,), (-1,), (10**9, 10**9), (13,)])
def test_a_shape_that_the_file_does_not_hold_is_refused_before_it_is_made(
    shape: tuple[int, ...], tmp_path: Path
) -> None:
    path = tmp_path / "bad.npz"
    save_trial(ROWS, path)
    with zipfile.ZipFile(path) as file:
        content = {name: file.read(name) for name in file.namelist()}
    header = io.BytesIO()
    write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": shape})
    content["time.npy"] = header.getvalue() + bytes(96)
    with zipfile.ZipFile(path, "w") as file:
        for name, part in content.items():
            file.writestr(name, part)
    with pytest.raises(InputError, match=rf"time claims the shape {re.escape(str(shape))}.*the file holds 96"):
        load_trial(path)


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
    ],
)
def test_files_that_are_no_trials_are_refused(damage: Callable[[Path], None], tmp_path: Path) -> None:
    path = tmp_path / "bad.npz"
    damage(path)
    with pytest.raises(InputError, match=r"bad\.npz is not a trial: .*give a \.npz file from the `trials` folder"):
        load_trial(path)


def test_the_rotation_counts_from_the_grasp_before_a_twist() -> None:
    trial = made_trial()
    pose = np.column_stack([np.zeros(12), 0.001 * np.arange(12), np.repeat([0.0, 0.2, 0.2], 4)])
    pose[4, 2] = 0.0
    twisted = replace(trial, phases=("grasp", TWIST, MANIPULATE), object_pose=spatial(pose, 0.05))
    assert twisted.grasped == 4
    np.testing.assert_allclose(twisted.manipulated_path()[1], np.rad2deg(0.2), atol=1e-9)


def test_contacts_are_told_by_their_torque_and_how_long_they_are_deep() -> None:
    trial = made_trial()
    still = np.zeros((12, 2, 3))
    points, forces = still.copy(), still.copy()
    points[5, 1] = trial.object_pose[5, :3] + (0.02, 0.01, 0.03)
    forces[5, 1] = (0.5, -1.5, 9.0)
    depth = np.zeros(12)
    depth[[2, 9, 10]] = 2e-3, 0.6e-3, 0.4e-3  # in the grasp; in the last four rows, those of manipulation
    trial = replace(trial, object_points=points, forces=forces, penetration=depth)
    assert trial.torque_max_nmm == pytest.approx(35.0)  # 20 mm x 1.5 N + 10 mm x 0.5 N, round the upright axis
    assert trial.penetration_max_mm == pytest.approx(2.0)
    assert trial.penetration_mean_mm == pytest.approx(0.25)
    assert trial.penetration_share == pytest.approx(0.25)
    never = replace(trial, phase=np.zeros(12, dtype=np.int64))
    assert (never.penetration_mean_mm, never.penetration_share) == (0.0, 0.0)
