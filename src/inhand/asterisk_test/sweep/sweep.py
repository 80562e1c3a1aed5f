"""A sweep: which cells are there, which are to compute, and their computation on every core."""

import os
from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.run import prepare
from inhand.asterisk_test.sweep.cells import Job, compute, differences, job_of, read_cell
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.control.loop import control_step
from inhand.control.run_config import TrialsConfig
from inhand.errors import InputError
from inhand.folders import alone, check_folder, place_of, writing
from inhand.hands.files import load_hand, load_object
from inhand.sim.engines import make_simulator
from inhand.versions import versions

CELLS = "cells"
"""Folder of the cells' files inside that of the sweep."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A sweep's cells, hand by hand and within a hand object by object."""

    jobs: tuple[Job, ...]
    """All cells."""
    waiting: tuple[Job, ...]
    """Those to compute."""


def plan(config: SweepConfig) -> Plan:
    """Return the cells of a sweep and which of them its folder does not hold yet.

    Raises:
        InputError: a configuration that cannot be run, a folder that holds something else, or cells of other settings.
    """
    if config.jobs < 0:
        raise InputError(f"--jobs {config.jobs}: give how many cells to compute at a time, or 0 for one on each core")
    for option, names in (("--hands", config.hands), ("--objects", config.objects)):
        if not names:
            raise InputError(f"{option} names none: give at least one")
    prepare(_asterisk(config))  # refuses what no cell could run with
    jobs = _jobs(config, config.out / CELLS)
    _make_cells_folder(config.out)
    there = [job for job in jobs if job.path.is_file()]
    other = {job: found for job in there if (found := differences(read_cell(job.path).settings, job.settings))}
    if other and not config.overwrite:
        job, found = next(iter(other.items()))
        raise InputError(
            f"--out {config.out} holds {len(other)} cells of other settings; of {' with '.join(job.names)}"
            f" {'; '.join(found)}: give another folder, or --overwrite to compute them again"
        )
    kept = set(there) - set(other)
    return Plan(jobs, tuple(job for job in jobs if job not in kept))


def computed(jobs: Sequence[Job], at_a_time: int) -> Iterator[Job]:
    """Compute cells and give each once its file is written, in the order in which they end.

    So many run at a time, each on one core; 0 takes every core.

    Raises:
        InputError: a process that computed a cell was killed, or another sweep computes into the same folder.
    """
    if not jobs:
        return
    from joblib import Parallel, delayed, parallel_config

    cells = jobs[0].path.parent
    _step_once(jobs[0].config)
    with alone(cells, cells.parent), parallel_config("loky", inner_max_num_threads=1):
        workers = Parallel(n_jobs=at_a_time or -1, batch_size=1, return_as="generator_unordered")
        try:
            yield from workers(delayed(compute)(job, os.getpid()) for job in jobs)
        except BrokenProcessPool as error:
            raise InputError(
                "a process that computed a cell was killed, perhaps for want of memory: the same command goes on where"
                " this one stopped, and a smaller --jobs needs less memory"
            ) from error


def _step_once(config: AsteriskConfig) -> None:
    """Step a world, so that what its engine has to compile is compiled and told here, not in every process."""
    hand, spec = load_hand(config.hand), load_object(config.object)
    simulator = make_simulator(config.engine, hand, [spec], threads=1)
    start = simulator.reset(hand.start_pose[None], np.zeros((1, hand.n_joints)))
    control_step(simulator, start.targets, np.zeros(1, dtype=np.int64), 1)


def _asterisk(config: SweepConfig) -> AsteriskConfig:
    shared = {field.name: getattr(config, field.name) for field in fields(TrialsConfig)}
    return AsteriskConfig(directions=config.directions, **shared)


def _jobs(config: SweepConfig, folder: Path) -> tuple[Job, ...]:
    base, found = _asterisk(config), versions()
    hands = {text: load_hand(text) for text in config.hands}
    objects = {text: load_object(text) for text in config.objects}
    jobs: dict[Path, Job] = {}
    for hand in config.hands:
        for thing in config.objects:
            job = job_of(replace(base, hand=hand, object=thing), hands[hand], objects[thing], found, folder)
            if job.path in jobs:
                raise InputError(f"{' with '.join(job.names)} is asked for twice: give every hand and object one name")
            jobs[job.path] = job
    return tuple(jobs.values())


def _make_cells_folder(out: Path) -> None:
    folder = out / CELLS
    if not place_of(folder).is_dir():
        check_folder(out, overwrite=False, mark=CELLS)
    with writing(out):
        folder.mkdir(parents=True, exist_ok=True)
