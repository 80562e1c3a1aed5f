"""Work where a study says: on every core of this machine, on a Ray or Dask cluster, or as an array of SLURM's jobs.

A piece whose worker dies is done again by another, up to `TRIES` times in all; the others go on. Pieces write their
files themselves, so that the study's folder must be one that all machines see, under the same path.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import TypeVar

from inhand.control.run_config import SpreadConfig
from inhand.cores import TRIES, on_cores, on_one_core
from inhand.errors import InputError, needs_extra

J = TypeVar("J")
R = TypeVar("R")
WAIT_S = 20.0
"""How long a cluster may take to answer [s]: guessed, twice what a busy one takes."""
PACKAGES = {"ray": "ray", "dask": "distributed", "slurm": "submitit"}
"""What each backend needs; its extra has its name."""
SLURM_S = 24 * 3600
"""Longest time of one of SLURM's jobs [s]."""


def check_spread(config: SpreadConfig) -> None:
    """Refuse what no study can be spread over.

    Raises:
        InputError: fewer than 0 at a time, an address of what has none, or a package that is missing.
    """
    if config.jobs < 0:
        raise InputError(f"--jobs {config.jobs}: give how many to compute at a time, or 0 for one on each core")
    if config.address is not None and config.backend not in {"ray", "dask"}:
        raise InputError(f"--address is of a cluster: give it with --backend ray or dask, not {config.backend}")
    package = PACKAGES.get(config.backend)
    if package is not None and find_spec(package) is None:
        raise needs_extra(config.backend, f"--backend {config.backend}")


def spread(work: Callable[[J], R], jobs: Sequence[J], config: SpreadConfig) -> Iterator[R]:
    """Do jobs, each on one core, where a study says, and give what each comes to, in the order in which they end.

    Args:
        work: does a job.
        jobs: the jobs.
        config: how many at a time, and on what.

    Raises:
        InputError: workers died too often, or there is no such cluster.
    """
    if not jobs:
        return
    if config.backend == "loky":
        yield from on_cores(work, jobs, config.jobs)
    else:
        yield from CLUSTERS[config.backend](partial(on_one_core, work), jobs, config)


def there(work: Callable[[J], R], job: J, folder: str) -> R:
    """Do a job from the folder that the study was begun in."""
    if Path(folder).is_dir():
        os.chdir(folder)
    return work(job)


def on_ray(work: Callable[[J], R], jobs: Sequence[J], config: SpreadConfig) -> Iterator[R]:
    """Do jobs on a Ray cluster, or on this machine where no address is given; give what they come to as they end.

    Raises:
        InputError: no cluster answers at the address, or a job's worker has died too often.
    """
    import ray

    began = time.monotonic()
    own = not ray.is_initialized()
    if own:
        here = {"num_cpus": config.jobs or None} if config.address is None else {}
        try:
            _reach(config.address)
            ray.init(config.address, include_dashboard=False, log_to_driver=False, logging_level="ERROR", **here)
        except (OSError, RuntimeError, ValueError) as error:
            raise _silent(config, began, "ray start --head") from error
    try:
        task = ray.remote(num_cpus=1, max_retries=TRIES - 1)(there)
        coming, most = iter(jobs), config.jobs or len(jobs)
        running: list[object] = []
        while True:
            running += [task.remote(work, job, str(Path.cwd())) for job in islice(coming, most - len(running))]
            if not running:
                return
            (done, *_), running = ray.wait(running)
            yield ray.get(done)
    except _lost_by_ray() as error:
        raise _died(error) from error
    finally:
        if own:
            ray.shutdown()


def on_dask(work: Callable[[J], R], jobs: Sequence[J], config: SpreadConfig) -> Iterator[R]:
    """Do jobs on a Dask cluster, or on this machine where no address is given; give what they come to as they end.

    Raises:
        InputError: no scheduler answers at the address, or a job's worker has died too often.
    """
    from distributed import Client, KilledWorker, as_completed

    began = time.monotonic()
    here = {"n_workers": config.jobs or None, "threads_per_worker": 1, "dashboard_address": None}
    try:
        client = Client(config.address, timeout=WAIT_S) if config.address else Client(**here)
    except (OSError, TimeoutError, ValueError) as error:
        raise _silent(config, began, "dask scheduler") from error
    with client:
        folder = str(Path.cwd())
        waiting = [client.submit(there, work, job, folder, pure=False, retries=TRIES - 1) for job in jobs]
        try:
            for future in as_completed(waiting):
                yield future.result()
        except KilledWorker as error:
            raise _died(error) from error


def on_slurm(work: Callable[[J], R], jobs: Sequence[J], config: SpreadConfig, cluster: str = "slurm") -> Iterator[R]:
    """Do jobs as an array of SLURM's; give what they come to as they end. Its own files lie in the study's folder.

    Raises:
        InputError: there is no SLURM here, or a job has died too often.
    """
    import submitit

    folder = str(Path.cwd())
    try:
        executor = submitit.AutoExecutor(folder=config.out / "slurm", cluster=cluster)
    except (RuntimeError, ValueError) as error:
        told = f"--backend slurm: there is no sbatch on this machine ({error})"
        raise InputError(f"{told}; log in where there is") from error
    executor.update_parameters(timeout_min=SLURM_S // 60, cpus_per_task=1)
    if cluster == "slurm":
        executor.update_parameters(slurm_array_parallelism=config.jobs or len(jobs))
    left = list(jobs)
    for _ in range(TRIES):
        begun = executor.map_array(there, [work] * len(left), left, [folder] * len(left))
        jobs_of, left = dict(zip(begun, left, strict=True)), []
        for done in submitit.helpers.as_completed(begun):
            if isinstance(done.exception(), submitit.core.utils.UncompletedJobError):
                left.append(jobs_of[done])
            else:
                yield done.result()
        if not left:
            return
    raise _died(f"{len(left)} of SLURM's jobs have ended without a result")


def _reach(address: str | None) -> None:
    """Knock at an address of host and port: Ray itself tries for minutes, and then ends the process.

    Raises:
        OSError: nothing answers.
    """
    host, _, port = (address or "").rpartition(":")
    if port.isdigit():
        socket.create_connection((host, int(port)), timeout=WAIT_S).close()


def _silent(config: SpreadConfig, began: float, start: str) -> InputError:
    """Return the error of an address where nothing answers."""
    waited = time.monotonic() - began
    return InputError(
        f"--address {config.address}: no {config.backend} cluster answered within {waited:.0f} s; start one with"
        f" `{start}` and give the address that it tells, or leave --address out to compute on this machine"
    )


def _lost_by_ray() -> tuple[type[Exception], ...]:
    """Return what Ray raises where workers died too often; what the work itself raises is none of it."""
    from ray import exceptions

    return exceptions.WorkerCrashedError, exceptions.OutOfMemoryError, exceptions.NodeDiedError


def _died(error: object) -> InputError:
    return InputError(
        f"a worker died {TRIES} times over the same piece, perhaps for want of memory ({error}): the same command goes"
        " on where this one stopped"
    )


CLUSTERS = {"ray": on_ray, "dask": on_dask, "slurm": on_slurm}
"""What does jobs, by the word of --backend."""
