"""Data that travels: trials and demonstrations in forms that others read, and demonstrations back from these."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np

from inhand.asterisk_test.people.human_write import write_recording
from inhand.control.contract import joint_names
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import LOST, AnyTrial, Passport, load_all, load_any
from inhand.errors import InputError
from inhand.folders import run_folder
from inhand.learning.dataset_cards import OURS, DatasetHead, DatasetKind
from inhand.learning.datasets import (
    DATA,
    MARK,
    DatasetEpisode,
    about_of,
    check_installed,
    env_spec_of,
    episode_from,
    read_dataset,
    read_head,
    read_told,
    told_head,
    write_dataset,
)
from inhand.learning.lerobot_files import (
    FRAMES,
    INFO,
    Features,
    Frames,
    check_pyarrow,
    read_episodes,
    read_features,
    write_lerobot,
)
from inhand.learning.minari_files import Entry, add_episodes, new_storage
from inhand.learning.space import Space, primitives_of
from inhand.records import read_json, read_json_file, text_of
from inhand.repeats import NAME
from inhand.tasks.primitives import primitive_at

Form = Literal["csv", "minari", "lerobot"]
STATE, ACTION, WANTED, REWARD, DONE = "observation.state", "action", "wanted", "next.reward", "next.done"
OBJECT, FORCE = "observation.environment_state", "observation.contact_force"
POSE = ("x [m]", "y [m]", "z [m]", "qw", "qx", "qy", "qz")
HEAD = f"meta/{OURS}.json"
"""Our part of a LeRobotDataset: what `inhand record` says of its datasets."""
TRIALS = f"{OURS}/trials-v0"
"""What Minari calls a dataset of trials."""
DECISIONS_HZ = 50
"""Decisions and rows of a trial a second."""


@dataclass(frozen=True)
class Exported:
    """What was written."""

    count: int
    """Episodes or files."""
    notes: tuple[str, ...]
    """What was left out and why, a sentence each."""


def export_run(place: Path, out: Path, form: Form, *, overwrite: bool = False) -> Exported:
    """Write the trials of a run or a file, or a dataset's demonstrations, in another form.

    Args:
        place: the folder of a run or of a dataset, or a trial's `.npz` file.
        out: folder to write to.
        form: csv (recordings of the Asterisk Test), minari or lerobot.
        overwrite: whether an earlier export that the folder holds may be replaced.

    Raises:
        InputError: nothing there that can be written so, an extra that is missing, or a folder that may not be written.
    """
    dataset = (place / MARK).is_file()
    if dataset and form == "csv":
        raise InputError(f"{place} is a dataset: demonstrations are no recordings of trials; use --as lerobot")
    if dataset and form == "minari":
        raise InputError(f'{place} is a Minari dataset already: minari.MinariDataset("{place / DATA}")')
    if form != "csv":
        (check_pyarrow if form == "lerobot" else check_installed)(f"--as {form}")
    trials = [] if dataset else _trials(place)
    with run_folder(out, overwrite=overwrite, mark=NAME) as folder:
        if dataset:
            return Exported(_demonstrations_as_lerobot(place, folder), ())
        return {"csv": _as_recordings, "minari": _as_minari, "lerobot": _as_lerobot}[form](trials, folder)


def _trials(place: Path) -> list[AnyTrial]:
    if place.is_file():
        return [load_any(place)]
    if not (place / "trials").is_dir():
        raise InputError(
            f"{place} holds no trials and no dataset: give the folder of a run of asterisk, trace or evaluate, one of"
            " `inhand record`, or a trial's .npz file"
        )
    return load_all(place)


def _as_recordings(trials: list[AnyTrial], folder: Path) -> Exported:
    notes: dict[str, None] = {}
    count = 0
    for trial in trials:
        if isinstance(trial, SpatialTrial):
            raise InputError(
                "recordings of the Asterisk Test hold x, y and one angle of an object on a table;"
                " of a hand in space they would leave out height and tilt, and their names know no such hand: use"
                " --as lerobot or --as minari, which hold whole poses"
            )
        try:
            write_recording(trial, folder)
            count += 1
        except InputError as error:
            notes[f"Left out: {error}"] = None
    if not count:
        raise InputError(next(iter(notes)).removeprefix("Left out: "))
    return Exported(count, tuple(notes))


def _as_lerobot(trials: list[AnyTrial], folder: Path) -> Exported:
    hand = trials[0].passport.hand
    joints = [f"{name} [rad]" for name in joint_names(hand)]
    forces = [f"{finger} {axis} [N]" for finger in hand.finger_names for axis in "xyz"]
    names = {STATE: joints, ACTION: joints, OBJECT: POSE, FORCE: forces}
    period = trials[0].passport.period
    return Exported(write_lerobot(folder, map(trial_frames, trials), round(1 / period), hand.name, names), ())


def trial_frames(trial: AnyTrial) -> Frames:
    """Return a trial as frames: each state but the last, and the joint targets that lead from it to the next.

    Raises:
        InputError: it has fewer than two rows.
    """
    steps = len(trial.time) - 1
    if steps < 1:
        raise InputError(
            f"{trial.passport.primitive}, trial {trial.passport.trial}, has no step from a row to the next"
        )
    arrays = {
        STATE: trial.joint_angles[:-1],
        OBJECT: trial.object_pose[:-1],
        FORCE: trial.forces[:-1].reshape(steps, -1),
        ACTION: trial.targets[1:],
    }
    passport = trial.passport
    return Frames(
        f"Move {passport.object.name} along {passport.path} with hand {passport.hand.name}"
        if isinstance(passport, Passport) and passport.angle_deg is None
        else f"Move {passport.object.name} {passport.primitive} with hand {passport.hand.name}",
        {name: values.astype(np.float32) for name, values in arrays.items()} | {DONE: np.arange(steps) == steps - 1},
        {"outcome": trial.outcome, "controller": passport.controller, "trial": passport.trial, "seed": passport.seed},
    )


def _as_minari(trials: list[AnyTrial], folder: Path) -> Exported:
    """Write trials as Minari's episodes: joint angles and the object's pose, joint targets, no reward."""
    n_joints = trials[0].passport.hand.n_joints
    place = folder.resolve() / DATA
    place.mkdir()
    storage = new_storage(place, (n_joints + len(POSE), n_joints), np.inf)
    passport = trials[0].passport
    storage.update_metadata({
        "dataset_id": TRIALS, "minari_version": version("minari"),
        "author": {OURS}, "algorithm_name": passport.controller,
        "description": f"Trials of {passport.controller}: joint angles [rad] and pose of the object (position [m],"
        " quaternion w x y z) in the palm frame, joint targets [rad]; rewards are 0, for none were told",
    })  # fmt: skip
    add_episodes(storage, [_minari_entry(trial) for trial in trials])
    return Exported(len(trials), ())


def _minari_entry(trial: AnyTrial) -> Entry:
    steps = len(trial.time) - 1
    last, lost = np.arange(steps) == steps - 1, trial.outcome in LOST
    arrays = {
        "observations": np.hstack([trial.joint_angles, trial.object_pose]).astype(np.float32),
        "actions": trial.targets[1:].astype(np.float32),
        "rewards": np.zeros(steps),
        "terminations": last & lost,
        "truncations": last & (not lost),
    }
    return arrays, {}, {"trial": trial.passport.trial, "seed_of_run": trial.passport.seed}


def _demonstrations_as_lerobot(place: Path, folder: Path) -> int:
    head, episodes = read_dataset(place)
    hand = head.kind.hand
    joints = list(joint_names(hand))
    frames = (demonstration_frames(episode, head) for episode in episodes)
    count = write_lerobot(folder, frames, DECISIONS_HZ, hand.name, {ACTION: joints, WANTED: joints})
    (folder / HEAD).write_text(text_of({"head": told_head(head), "env_spec": env_spec_of(place)}), encoding="utf-8")
    return count


def demonstration_frames(episode: DatasetEpisode, head: DatasetHead) -> Frames:
    """Return a demonstration as frames; its last observation stands beside them."""
    count = len(episode.rewards)
    arrays = {
        STATE: episode.observations[:-1],
        ACTION: episode.actions,
        WANTED: episode.wanted,
        REWARD: episode.rewards,
        DONE: np.arange(count) == count - 1,
    }
    about: dict[str, Any] = {name: np.asarray(getattr(episode, name)).tolist() for name in about_of(head.kind)}
    about |= {name: bool(getattr(episode, name)) for name in ("terminated", "truncated")}
    about["last_observation"] = episode.observations[-1].tolist()
    return Frames(f"Move {head.object.name} {_way_of(episode)} with hand {head.kind.hand.name}", arrays, about)


def _way_of(episode: DatasetEpisode) -> str:
    """Return the name of what an episode was asked."""
    asked = episode.along, episode.about, episode.gravity
    if any(each is None for each in asked):
        return primitive_at(episode.angle_deg).name
    (only,) = primitives_of(Space(*(np.asarray(each)[None] for each in asked)))
    return only.name


def episode_of(frames: Frames, kind: DatasetKind) -> DatasetEpisode:
    """Return the demonstration of a kind that frames are.

    Raises:
        InputError: what stood beside them is not there.
    """
    about, arrays = frames.about, frames.arrays
    beside = about_of(kind)
    lacking = [name for name in (*beside, "terminated", "truncated", "last_observation") if about.get(name) is None]
    if lacking:
        raise InputError(f"its episodes do not tell {', '.join(lacking)}, which demonstrations here have beside them")
    found = {
        "observations": np.vstack([arrays[STATE], np.asarray(about["last_observation"], dtype=np.float32)]),
        "actions": arrays[ACTION],
        "wanted": arrays[WANTED],
        "rewards": arrays[REWARD],
    }
    ends = bool(about["terminated"]), bool(about["truncated"])
    return episode_from(found, {name: about[name] for name in beside}, ends)


def import_demonstrations(place: Path, out: Path, like: Path | None = None, *, overwrite: bool = False) -> int:
    """Write a dataset of `inhand record` from demonstrations in another form, and return how many there were.

    Args:
        place: the folder of a LeRobotDataset v3, or of a Minari dataset.
        out: folder of the new dataset.
        like: a dataset whose hand, object, observations and actions it is to have; needed where it does not say.
        overwrite: whether a dataset that the folder holds may be replaced.

    Raises:
        InputError: no dataset, one that cannot be read, or one whose layout does not fit: the text shows both.
    """
    check_installed("`inhand import`")
    if (place / INFO).is_file():
        head, spec = _head_of(place, like)
        episodes = _from_lerobot(place, head)
    elif (place / MARK).is_file():
        _refuse_trials(place)
        head, stored = read_dataset(place)
        spec, episodes = env_spec_of(place), iter(stored)
    else:
        raise InputError(f"{place} holds no dataset: give the folder with {INFO} (LeRobot) or {MARK} (Minari)")
    count = 0

    def counted() -> Iterator[DatasetEpisode]:
        nonlocal count
        for episode in episodes:
            count += 1
            yield episode

    with run_folder(out, overwrite=overwrite, mark=MARK) as folder:
        write_dataset(folder, counted(), head, spec)
    return count


def _refuse_trials(place: Path) -> None:
    """Refuse what `inhand export --as minari` writes of trials.

    Raises:
        InputError: the text tells why they are no demonstrations, and what is.
    """
    content = read_json_file(place / MARK)
    if isinstance(content, dict) and content.get("dataset_id") == TRIALS:
        raise InputError(
            f"{place} holds trials as `inhand export` writes them: joint angles, poses and targets, without the"
            " observations, rewards and wanted actions that are learned from. Demonstrations are recorded by `inhand"
            " record`; the trials themselves are read by `inhand.load` from the folder of their run"
        )


def _head_of(place: Path, like: Path | None) -> tuple[DatasetHead, str | None]:
    """Return what a LeRobotDataset says of itself in our words, or what the dataset that it is to be like says."""
    if like is not None:
        return read_head(like), env_spec_of(like)
    file = place / HEAD
    if not file.is_file():
        raise InputError(
            f"{place} does not say what its numbers mean ({HEAD} is not there): name a dataset of `inhand record` that"
            " it is like, with --like"
        )
    try:
        content = read_json(file.read_bytes())
        entry = content if isinstance(content, dict) else {}
        spec = entry.get("env_spec")
        return read_told(entry.get("head")), spec if isinstance(spec, str) else None
    except InputError as error:
        raise InputError(f"{file}: {error}; name a dataset that it is like, with --like") from error


def _from_lerobot(place: Path, head: DatasetHead) -> Iterator[DatasetEpisode]:
    """Give the demonstrations of a LeRobotDataset whose layout is looked at now."""
    features, n_joints = read_features(place), head.kind.hand.n_joints
    wanted = {
        STATE: ("float32", head.kind.size),
        ACTION: ("float32", n_joints),
        WANTED: ("float32", n_joints),
        REWARD: ("float64", 1),
        DONE: ("bool", 1),
    }
    there = {name: kind for name, kind in features.kinds.items() if name not in FRAMES}
    if any(there.get(name) != kind for name, kind in wanted.items()):
        needed = Features(features.fps, wanted)
        raise InputError(
            f"the layout of {place} does not fit observations {head.kind.interface.layout} and actions"
            f" {head.kind.actions} of hand {head.kind.hand.name}:\n  there: {features.told()}\n  here:  {needed.told()}"
        )
    if round(features.fps) != DECISIONS_HZ:
        raise InputError(f"{place} has {features.fps:g} frames a second; decisions here are {DECISIONS_HZ} a second")
    return (episode_of(frames, head.kind) for frames in read_episodes(place, features))
