"""A cell of a sweep, one hand with one object: what it is computed from, its file, and its computation."""

from __future__ import annotations

import json
import os
import re
import signal
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import as_entry, result_of_trial, write_json
from inhand.asterisk_test.run import prepare, simulate
from inhand.control.catalogue import find_controller
from inhand.errors import InputError
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.tasks.primitives import parse_directions

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


def job_of(config: AsteriskConfig, hand: HandSpec, spec: ObjectSpec, versions: Mapping[str, str], folder: Path) -> Job:
    """Return the job of a run of one hand with one object, whose file lies in a folder."""
    settings: dict[str, Any] = {
        "hand": asdict(hand),
        "object": asdict(spec),
        "directions": [asdict(primitive) for primitive in parse_directions(config.directions)],
        "trials": config.trials,
        "seed": config.seed,
        "noise_mm": config.noise_mm,
        "noise_deg": config.noise_deg,
        "controller": config.controller,
        "engine": config.engine,
        "versions": dict(versions),
    }
    policy = find_controller(config.controller).policy
    if policy is not None:
        settings["policy"] = policy.digest
    path = folder / f"{_plain(hand.name)}__{_plain(spec.name)}.json"
    return Job(config, (hand.name, spec.name), json.loads(json.dumps(settings)), path)


def compute(job: Job, parent: int) -> Job:
    """Run a cell on one thread and write its file; a cell that cannot be run leaves the reason in it.

    Args:
        job: the cell.
        parent: process that leads the sweep; once it is gone, so is the process that computes for it.
    """

    def watch(phase: str, running: int, step: int) -> None:
        del phase, running, step
        if parent not in (os.getpid(), os.getppid()):
            signal.raise_signal(signal.SIGTERM)

    clock, cpu = time.perf_counter(), time.process_time()
    entries: list[dict[str, Any]] = []
    reason = None
    try:
        trials = simulate(job.config, prepare(job.config), watch, threads=1)
        entries = [as_entry(result_of_trial(trial)) for trial in trials]
    except (InputError, RuntimeError) as error:  # RuntimeError: the engine itself gave up
        reason = str(error)
    content = {
        "hand": job.names[0],
        "object": job.names[1],
        "reason": reason,
        "seconds": time.perf_counter() - clock,
        "cpu_seconds": time.process_time() - cpu,
        "trials": entries,
        "settings": job.settings,
    }
    write_json(content, job.path)
    return job


def read_cell(path: Path) -> dict[str, Any]:
    """Return the content of a cell's file.

    Raises:
        InputError: the file is no cell.
    """
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if {"hand", "object", "reason", "seconds", "cpu_seconds", "trials", "settings"} <= set(content):
            return content
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"{path} is no cell of a sweep: {error}; remove it to have it computed again") from error
    raise InputError(f"{path} is no cell of a sweep; remove it to have it computed again")


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
