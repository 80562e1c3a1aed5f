"""Data that travels: recordings, Minari and LeRobot out and back to the last bit; policies with their cards."""

import importlib.util
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import inhand as front
from commands import Call
from inhand.asterisk_test.people.human import read_human_file, read_human_folder
from inhand.asterisk_test.people.human_write import recording_name
from inhand.control.catalogue import find_controller
from inhand.control.policy import Policy, load_policy
from inhand.control.spatial_catalogue import learned_entry
from inhand.control.trial import Trial, load_trials, write_trials
from inhand.errors import InputError
from inhand.learning.datasets import DatasetEpisode, env_spec_of, read_dataset, read_head
from inhand.learning.lerobot_files import read_episodes, read_features
from inhand.learning.model_card import card

HERE = importlib.util.find_spec("pyarrow") is not None
lerobot = pytest.mark.skipif(not HERE, reason="the extra `lerobot` (pyarrow) is not installed")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small run: two directions, one of which recordings have no word for, and a turn."""
    out = tmp_path_factory.mktemp("runs") / "test"
    write_trials(front.asterisk(controller="thesis-ik", directions="Right,Right',cw", trials=1).trials, out)
    return out


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small dataset."""
    out = tmp_path_factory.mktemp("sets") / "set"
    return front.record(directions="Right", episodes=3, out=out, horizon=12).folder


def bits(values: object) -> tuple[str, bytes]:
    array = np.asarray(values)
    return array.dtype.str, array.tobytes()


def same(one: DatasetEpisode, other: DatasetEpisode) -> bool:
    return all(bits(a) == bits(b) for a, b in zip(vars(one).values(), vars(other).values(), strict=True))


def trials_of(run: Path) -> dict[str, Trial]:
    return {trial.passport.primitive: trial for trial in load_trials(run)}


def test_trials_become_recordings_and_come_back(run: Path, tmp_path: Path, inhand: Call) -> None:
    out = tmp_path / "csv"
    code, told, err = inhand("export", run, "--as", "csv", "--out", out)
    assert (code, err) == (0, "")
    assert "Left out: recordings of the Asterisk Test have no word for Right'; they know Out, Out-Right, Right" in told
    assert told.endswith(f"2 files: {out}\n")
    assert {path.name for path in out.iterdir()} == {"thesis-ik_2v2_c_n_1.csv", "thesis-ik_2v2_n_cw_1.csv", "run.toml"}
    trials = trials_of(run)
    for name, file in (("Right", "thesis-ik_2v2_c_n_1.csv"), ("cw", "thesis-ik_2v2_n_cw_1.csv")):
        path, rotation, _ = trials[name].manipulated_path()
        found = read_human_file(out / file)
        assert (found.primitive, found.subject, found.hand, found.unit) == (name, "thesis-ik", "2v2", "mm, degrees")
        assert bits(found.path_mm) == bits(path - path[0])
        assert bits(np.abs(found.rotation_deg)) == bits(np.abs(rotation))
    assert len(read_human_folder(out).trials) == 2


def test_a_trial_that_hardly_moves_is_no_recording(run: Path, tmp_path: Path, inhand: Call) -> None:
    trial = trials_of(run)["Right"]
    pose = trial.object_pose.copy()
    pose[:, :2] = pose[0, :2] + 1e-3 * (pose[:, :2] - pose[0, :2])
    write_trials([replace(trial, object_pose=pose)], tmp_path)
    code, _, err = inhand("export", tmp_path / "trials" / "right_1.npz", "--as", "csv", "--out", tmp_path / "csv")
    assert code == 2
    assert re.search(r"Right, trial 1, moves 0\.\d+ mm: of a recording that never leaves 1 mm nobody could tell", err)
    assert not (tmp_path / "csv").exists()


def test_a_recording_is_measured_like_its_trial(run: Path, tmp_path: Path, inhand: Call) -> None:
    assert inhand("export", run / "trials" / "right_1.npz", "--as", "csv", "--out", tmp_path / "csv")[0] == 0
    rows = json.loads(inhand("metrics", tmp_path / "csv", run / "trials" / "right_1.npz", "--json")[1])["table"]
    human, trial = rows
    assert human["direction"] == trial["direction"] == "Right"
    assert human["max_distance_mm"] == pytest.approx(trial["carried_mm"], abs=1.0)


def test_a_direction_without_a_word_alone_is_refused(run: Path, tmp_path: Path, inhand: Call) -> None:
    code, _, err = inhand("export", run / "trials" / "right1_1.npz", "--as", "csv", "--out", tmp_path / "csv")
    assert code == 2
    assert err.startswith("inhand: recordings of the Asterisk Test have no word for Right'; they know")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputError, match="no word for Right'"):
        recording_name(trials_of(run)["Right'"])


def test_trials_become_minari_episodes(run: Path, tmp_path: Path, inhand: Call) -> None:
    minari = pytest.importorskip("minari")
    out = tmp_path / "minari"
    assert inhand("export", run, "--as", "minari", "--out", out)[0] == 0
    episodes = list(minari.MinariDataset(out / "data"))
    for trial, episode in zip(load_trials(run), episodes, strict=True):
        seen = np.hstack([trial.joint_angles, trial.object_pose]).astype(np.float32)
        assert bits(episode.observations) == bits(seen)
        assert bits(episode.actions) == bits(trial.targets[1:].astype(np.float32))
        assert not episode.rewards.any()
        assert episode.terminations[-1] != episode.truncations[-1]
    code, _, err = inhand("import", out, "--out", tmp_path / "back")
    assert code == 2
    assert f"{out} holds trials as `inhand export` writes them: joint angles, poses and targets, without" in err
    assert not (tmp_path / "back").exists()


@lerobot
def test_trials_become_lerobot_frames(run: Path, tmp_path: Path, inhand: Call) -> None:
    out = tmp_path / "lerobot"
    assert inhand("export", run, "--as", "lerobot", "--out", out)[0] == 0
    features = read_features(out)
    found = list(read_episodes(out, features))
    for trial, frames in zip(load_trials(run), found, strict=True):
        assert bits(frames.arrays["observation.state"]) == bits(trial.joint_angles[:-1].astype(np.float32))
        assert bits(frames.arrays["observation.environment_state"]) == bits(trial.object_pose[:-1].astype(np.float32))
        assert bits(frames.arrays["action"]) == bits(trial.targets[1:].astype(np.float32))
        assert frames.about["outcome"] == trial.outcome
        times = frames.arrays["timestamp"].astype(float)
        assert times == pytest.approx(trial.time[:-1] - trial.time[0], abs=1e-5)
    info = json.loads((out / "meta" / "info.json").read_text())
    assert info["features"]["action"]["names"] == ["left 0 [rad]", "left 1 [rad]", "right 0 [rad]", "right 1 [rad]"]
    assert (info["codebase_version"], info["fps"], info["total_episodes"]) == ("v3.0", 50, 3)
    stats = json.loads((out / "meta" / "stats.json").read_text())["action"]
    every = np.vstack([trial.targets[1:] for trial in load_trials(run)]).astype(np.float32)
    assert stats["mean"] == pytest.approx(every.mean(axis=0, dtype=float))
    assert stats["std"] == pytest.approx(every.std(axis=0, dtype=float))
    assert (stats["min"], stats["max"]) == (every.min(axis=0).tolist(), every.max(axis=0).tolist())
    assert stats["count"] == [len(every)]


@lerobot
def test_demonstrations_go_to_lerobot_and_come_back(dataset: Path, tmp_path: Path, inhand: Call) -> None:
    out, back = tmp_path / "lerobot", tmp_path / "back"
    assert inhand("export", dataset, "--as", "lerobot", "--out", out)[0] == 0
    code, told, _ = inhand("import", out, "--out", back)
    assert (code, told) == (0, f"3 episodes: {back}\nLearn from it: inhand train --demonstrations {back}\n")
    (there, before), (here, after) = read_dataset(dataset), read_dataset(back)
    assert there == here
    assert env_spec_of(dataset) == env_spec_of(back)
    assert [same(one, other) for one, other in zip(before, after, strict=True)] == [True] * 3


@pytest.mark.skipif(importlib.util.find_spec("lerobot") is None, reason="lerobot itself is not installed")
def test_lerobot_reads_what_is_written(dataset: Path, tmp_path: Path, inhand: Call) -> None:
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    out = tmp_path / "lerobot"
    assert inhand("export", dataset, "--as", "lerobot", "--out", out)[0] == 0
    found = LeRobotDataset("inhand/test", root=out)
    rows = [(episode.observations[:-1], episode.actions) for episode in read_dataset(dataset)[1]]
    seen, done = (np.vstack(each) for each in zip(*rows, strict=True))
    frames: list[dict[str, Any]] = [found[k] for k in range(len(found))]
    assert bits(np.stack([frame["observation.state"].numpy() for frame in frames])) == bits(seen)
    assert bits(np.stack([frame["action"].numpy() for frame in frames])) == bits(done)


def test_a_minari_dataset_comes_in(dataset: Path, tmp_path: Path, inhand: Call) -> None:
    back = tmp_path / "back"
    assert inhand("import", dataset, "--out", back)[0] == 0
    (there, before), (here, after) = read_dataset(dataset), read_dataset(back)
    assert there == here
    assert all(same(one, other) for one, other in zip(before, after, strict=True))


@lerobot
def test_a_layout_that_does_not_fit_is_refused_with_both(
    run: Path, dataset: Path, tmp_path: Path, inhand: Call
) -> None:
    out, back = tmp_path / "lerobot", tmp_path / "back"
    assert inhand("export", run, "--as", "lerobot", "--out", out)[0] == 0
    code, _, err = inhand("import", out, "--out", back)
    assert code == 2
    assert "does not say what its numbers mean (meta/inhand.json is not there)" in err
    code, _, err = inhand("import", out, "--like", dataset, "--out", back)
    assert code == 2
    size = read_head(dataset).kind.size
    assert "  there: observation.state float32[4], observation.environment_state float32[7]" in err
    assert f"  here:  observation.state float32[{size}], action float32[4], wanted float32[4]" in err
    assert not back.exists()


@lerobot
@pytest.mark.parametrize(
    ("entry", "told"),
    [
        ({"codebase_version": "v2.1"}, "codebase_version is 'v2.1'; this version reads v3.0"),
        ({"fps": 30}, "has 30 frames a second; decisions here are 50 a second"),
        ({"fps": "fast"}, "fps is 'fast'; it must be a number"),
        ({"features": None}, "features is None; it must be a table"),
    ],
)
def test_a_foreign_lerobot_dataset_is_refused(
    entry: dict[str, Any], told: str, dataset: Path, tmp_path: Path, inhand: Call
) -> None:
    out = tmp_path / "lerobot"
    assert inhand("export", dataset, "--as", "lerobot", "--out", out)[0] == 0
    info = out / "meta" / "info.json"
    info.write_text(json.dumps(json.loads(info.read_text()) | entry))
    code, _, err = inhand("import", out, "--out", tmp_path / "back")
    assert code == 2
    assert told in err
    assert not (tmp_path / "back").exists()


def test_what_has_no_trials_is_refused(run: Path, dataset: Path, tmp_path: Path, inhand: Call) -> None:
    told = {
        (tmp_path, "csv"): "holds no trials and no dataset: give the folder of a run of asterisk, trace or evaluate",
        (dataset, "csv"): "is a dataset: demonstrations are no recordings of trials; use --as lerobot",
        (dataset, "minari"): "is a Minari dataset already: minari.MinariDataset(",
        (run, "policy"): "no trained policy in",
        ("ik", "policy"): "ik is no learned policy",
    }
    for (place, form), text in told.items():
        code, _, err = inhand("export", place, "--as", form, "--out", tmp_path / "out")
        assert (code, text in err) == (2, True), err
    assert inhand("export", run, "--as", "csv", "--results", run)[0] == 2
    assert "holds no dataset" in inhand("import", tmp_path)[2]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("asked", "whom", "driven"),
    [
        (("rl", None), "one hand", True),
        (("rl-privileged", None), "one hand", False),
        (("rl", "2v3_50.50_40.30.30_1.1_53"), "hands of its family", True),
        (("rl", "3f_60.60_40_10"), "one hand", False),
    ],
)
def test_a_card_says_for_which_hands_a_policy_is(asked: tuple[str, str | None], whom: str, driven: bool) -> None:
    entry, policy = learned_entry(*asked)
    page = card(entry.name, policy, {}, None)
    assert f"It is for {whom}, and for objects like those it learned with." in page
    assert ("inhand.drive" in page) == driven


def test_a_policy_travels_with_its_card(tmp_path: Path, inhand: Call) -> None:
    out = tmp_path / "policy"
    code, told, err = inhand("export", "rl", "--as", "policy", "--out", out)
    assert (code, told, err) == (0, f"Policy and card: {out}\n", "")
    shipped = find_controller("rl").policy
    assert isinstance(shipped, Policy)
    assert load_policy(out).digest == shipped.digest
    page = (out / "README.md").read_text(encoding="utf-8")
    assert page.startswith("---\nlicense: apache-2.0\n")
    for text in ("## What it sees", "direction, unit vector", "## What it was trained with", "None stand here"):
        assert text in page
