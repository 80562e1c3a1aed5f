"""Work on every core: what studies compute side by side, each piece in a process of its own."""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from inhand.asterisk_test.clusters import TRIES, on_dask, on_ray, on_slurm
from inhand.control.run_config import SpreadConfig
from inhand.errors import InputError

J = TypeVar("J")
R = TypeVar("R")
WATCH = "end with the parent"
"""Name of the thread that ends a process that computes for a study which is gone."""


def spread(work: Callable[[J], R], jobs: Sequence[J], config: SpreadConfig) -> Iterator[R]:
    """Do jobs where a study says and give what each comes to, in the order in which they end.

    Args:
        work: does a job.
        jobs: the jobs.
        config: how many at a time, and on what.

    Raises:
        InputError: workers died too often, or there is no such cluster.
    """
    if jobs:
        yield from BACKENDS[config.backend](work, jobs, config)


def on_cores(work: Callable[[J], R], jobs: Sequence[J], config: SpreadConfig) -> Iterator[R]:
    """Do jobs in processes of this machine; what was being done where one is killed is done again.

    Once this process is gone, so are those that work for it.

    Raises:
        InputError: processes were killed `TRIES` times.
    """
    from joblib import Parallel, delayed, parallel_config

    left = dict(enumerate(jobs))
    for _ in range(TRIES):
        with parallel_config("loky", inner_max_num_threads=1):
            workers = Parallel(n_jobs=config.jobs or -1, batch_size=1, return_as="generator_unordered")
            try:
                for number, done in workers(delayed(_led)(work, each, os.getpid()) for each in tuple(left.items())):
                    del left[number]
                    yield done
            except BrokenProcessPool:
                continue
        return
    raise InputError(
        f"processes that computed were killed {TRIES} times, perhaps for want of memory: the same command goes on where"
        " this one stopped, and a smaller --jobs needs less memory"
    )


def _led(work: Callable[[J], R], job: tuple[int, J], leader: int) -> tuple[int, R]:
    """Do a numbered job in a process that ends with the one that leads."""
    end_with(leader)
    return job[0], work(job[1])


BACKENDS = {"loky": on_cores, "ray": on_ray, "dask": on_dask, "slurm": on_slurm}
"""What does jobs, by the word of --backend."""


def end_with(parent: int) -> None:
    """Let this process end within a second of its parent's end, however busy it is; once in a process is enough."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os.kill(os.getpid(), signal.SIGTERM)

    if parent != os.getpid() and all(thread.name != WATCH for thread in threading.enumerate()):
        threading.Thread(target=watch, name=WATCH, daemon=True).start()
