"""A cell of a study, one run of the Asterisk Test: what it is computed from, its file, and its computation."""

import re
import shutil
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from inhand.asterisk_test.asterisk import run_setup, setup_of
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.regrasped import beside
from inhand.asterisk_test.results import as_entry, result_of_trial
from inhand.control.run_config import TrialsConfig
from inhand.control.spatial_catalogue import entry_for
from inhand.control.trial import LOST, AnyTrial, Trial, file_name, save_trial, write_json
from inhand.errors import InputError
from inhand.hands.spatial.gravity import USUAL_PALM, gravity_of
from inhand.hands.spatial.pair import AnyPair, SpatialPair
from inhand.records import read_json, read_record, table_of
from inhand.sim.disturbance_files import load_disturbance
from inhand.tasks.primitives import parse_directions
from inhand.tasks.spatial.primitives import parse_spatial_directions

LOST_KEPT = 4
"""Trials of a cell that lost their object and are kept to be shown again; one takes some 100 kB."""
LONGEST = 60
"""Characters of a value that the text about other settings shows."""


@dataclass(frozen=True, eq=False)
class Job:
    """A cell to compute."""

    config: AsteriskConfig
    """The run of its directions and trials."""
    label: str
    """What texts call it."""
    settings: dict[str, Any]
    """Everything its numbers depend on, as JSON holds it."""
    path: Path
    """Its file."""


@dataclass(frozen=True)
class CellFile:
    """What the file of a cell holds."""

    hand: str
    object: str
    reason: str | None
    """Why it could not be run, None where it ran."""
    seconds: float
    """How long it took [s]."""
    cpu_seconds: float
    """Processor time it took [s]."""
    trials: list[dict[str, Any]]
    """Its trials, as `as_entry` gives them, with what was drawn for their worlds where these are disturbed, and what
    fingers that were placed anew reached where they may be."""
    settings: dict[str, Any]


def job_of(
    config: AsteriskConfig,
    held: AnyPair,
    versions: Mapping[str, str],
    folder: Path,
    names: tuple[str, str, str],
) -> Job:
    """Return the job of a run of a hand with an object, whose file lies in a folder.

    Its `names` are what tells it from the others of its study, and the word between the two: A with B, A under B.
    """
    space = isinstance(held, SpatialPair)
    settings: dict[str, Any] = {
        "hand": held.hand,
        "object": held.object,
        "directions": (parse_spatial_directions if space else parse_directions)(config.directions),
        **{field.name: getattr(config, field.name) for field in fields(TrialsConfig)},
        "disturb": load_disturbance(config.disturb),
        "versions": dict(versions),
    }
    if config.regrasp:
        settings["regrasp"] = True
    if space:
        settings["gravity"] = gravity_of(config.gravity or USUAL_PALM)
    policy = entry_for(config.controller, held).policy
    if policy is not None:
        settings["policy"] = policy.digest
    return Job(config, " ".join(names), table_of(settings), cell_path(folder, names[0], names[2]))


def cell_path(folder: Path, first: str, second: str) -> Path:
    """Return the file in a folder of the cell that two names tell from the others."""
    return folder / f"{_plain(first)}__{_plain(second)}.json"


def kept_lost(folder: Path, first: str, second: str) -> list[Path]:
    """Return the files of a cell's trials that lost their object and were kept."""
    return sorted(_beside(cell_path(folder, first, second)).glob("*.npz"))


def _beside(cell: Path) -> Path:
    """Return the folder of the trials of a cell that are kept."""
    return cell.with_name(cell.name.removesuffix(".json"))


def compute(job: Job) -> Job:
    """Run a cell on one thread and write its file; a cell that cannot be run leaves the reason in it.

    Some trials that lost their object are kept beside it, in a folder of its name.
    """
    clock, cpu = time.perf_counter(), time.process_time()
    entries: list[dict[str, Any]] = []
    reason = None
    try:
        trials = run_setup(job.config, setup_of(job.config), threads=1)
        entries = [as_entry(result_of_trial(trial)) | _drawn(trial) for trial in trials]
        if job.config.regrasp:
            planar = [trial for trial in trials if isinstance(trial, Trial)]
            entries = [entry | told for entry, told in zip(entries, beside(planar), strict=True)]
        _keep_lost(trials, _beside(job.path))
    except (InputError, RuntimeError) as error:  # RuntimeError: the engine itself gave up
        reason = str(error)
    times = time.perf_counter() - clock, time.process_time() - cpu
    names = job.settings["hand"]["name"], job.settings["object"]["name"]
    write_json(CellFile(*names, reason, *times, entries, job.settings), job.path)
    return job


def _drawn(trial: AnyTrial) -> dict[str, Any]:
    """Return what was drawn for a trial's world, as a part of its entry; nothing where it was undisturbed."""
    disturbed = trial.passport.disturbed
    return {} if disturbed is None else {"drawn": asdict(disturbed.drawn)}


def _keep_lost(trials: Sequence[AnyTrial], folder: Path) -> None:
    """Write some of the trials that lost their object to a folder, of as many directions as there are."""
    shutil.rmtree(folder, ignore_errors=True)
    lost = sorted((trial for trial in trials if trial.outcome in LOST), key=lambda trial: trial.passport.trial)
    for trial in lost[:LOST_KEPT]:
        save_trial(trial, folder / f"{file_name(trial.passport.primitive)}_{trial.passport.trial}.npz")


def read_cell(path: Path) -> CellFile:
    """Return the content of a cell's file.

    Raises:
        InputError: the file is no cell.
    """
    try:
        return read_record(read_json(path.read_bytes()), CellFile)
    except (OSError, InputError) as error:
        raise InputError(f"{path} is no cell of a study: {error}; remove it to have it computed again") from error


def differences(there: Mapping[str, Any], asked: Mapping[str, Any]) -> list[str]:
    """Return what differs between the settings of a file and those asked for, one text each."""
    old, new = _flat(there), _flat(asked)
    return [
        f"{key} is {_shown(old.get(key))} there and {_shown(new.get(key))} now"
        for key in (*new, *(key for key in old if key not in new))
        if old.get(key) != new.get(key)
    ]


def _flat(tree: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Return a tree of settings as one level, `hand.palm_width` for a leaf."""
    leaves: dict[str, Any] = {}
    for key, value in tree.items():
        leaves |= _flat(value, f"{before}{key}.") if isinstance(value, dict) else {f"{before}{key}": value}
    return leaves


def _shown(value: object) -> str:
    if isinstance(value, list) and value and all(isinstance(item, dict) and "name" in item for item in value):
        value = ", ".join(item["name"] for item in value)
    text = str(value)
    return text if len(text) <= LONGEST else text[: LONGEST - 1] + "…"


def _plain(name: str) -> str:
    """Return a name as part of a file name that every system takes."""
    return re.sub(r"[^\w.+-]", "-", name)
