"""A cell of a sweep, one hand with one object: what it is computed from, its file, and its computation."""

import os
import re
import signal
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import as_entry, result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.control.catalogue import find_controller
from inhand.control.run_config import TrialsConfig
from inhand.control.trial import write_json
from inhand.errors import InputError
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.records import read_json, read_record, table_of
from inhand.sim.disturbance_files import load_disturbance
from inhand.tasks.primitives import parse_directions

WATCH = "end with the parent"
"""Name of the thread that ends a process that computes for a sweep which is gone."""
LONGEST = 60
"""Characters of a value that the text about other settings shows."""


@dataclass(frozen=True, eq=False)
class Job:
    """A cell to compute."""

    config: AsteriskConfig
    """The run of its directions and trials."""
    names: tuple[str, str]
    """Names of hand and object."""
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
    """Its trials, as `as_entry` gives them."""
    settings: dict[str, Any]


def job_of(config: AsteriskConfig, hand: HandSpec, spec: ObjectSpec, versions: Mapping[str, str], folder: Path) -> Job:
    """Return the job of a run of one hand with one object, whose file lies in a folder."""
    settings: dict[str, Any] = {
        "hand": hand,
        "object": spec,
        "directions": parse_directions(config.directions),
        **{field.name: getattr(config, field.name) for field in fields(TrialsConfig)},
        "disturb": load_disturbance(config.disturb),
        "versions": dict(versions),
    }
    policy = find_controller(config.controller).policy
    if policy is not None:
        settings["policy"] = policy.digest
    path = folder / f"{_plain(hand.name)}__{_plain(spec.name)}.json"
    return Job(config, (hand.name, spec.name), table_of(settings), path)


def compute(job: Job, parent: int) -> Job:
    """Run a cell on one thread and write its file; a cell that cannot be run leaves the reason in it.

    Once the process `parent`, which leads the sweep, is gone, so is the one that computes for it.
    """
    end_with(parent)
    clock, cpu = time.perf_counter(), time.process_time()
    entries: list[dict[str, Any]] = []
    reason = None
    try:
        trials = simulate(job.config, prepare(job.config), threads=1)
        entries = [as_entry(result_of_trial(trial)) for trial in trials]
    except (InputError, RuntimeError) as error:  # RuntimeError: the engine itself gave up
        reason = str(error)
    times = time.perf_counter() - clock, time.process_time() - cpu
    write_json(CellFile(*job.names, reason, *times, entries, job.settings), job.path)
    return job


def end_with(parent: int) -> None:
    """Let this process end within a second of its parent's end, however busy it is; once in a process is enough."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os.kill(os.getpid(), signal.SIGTERM)

    if parent != os.getpid() and all(thread.name != WATCH for thread in threading.enumerate()):
        threading.Thread(target=watch, name=WATCH, daemon=True).start()


def read_cell(path: Path) -> CellFile:
    """Return the content of a cell's file.

    Raises:
        InputError: the file is no cell.
    """
    try:
        return read_record(read_json(path.read_bytes()), CellFile)
    except (OSError, InputError) as error:
        raise InputError(f"{path} is no cell of a sweep: {error}; remove it to have it computed again") from error


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
