"""Work on every core: what studies compute side by side, each piece in a process of its own."""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from inhand.errors import InputError

J = TypeVar("J")
R = TypeVar("R")
WATCH = "end with the parent"
"""Name of the thread that ends a process that computes for a study which is gone."""


def on_cores(work: Callable[[J], R], jobs: Sequence[J], at_a_time: int) -> Iterator[R]:
    """Do jobs and give what each comes to, in the order in which they end.

    Once this process is gone, so are those that work for it.

    Args:
        work: does a job.
        jobs: the jobs.
        at_a_time: so many run at a time, each on one core; 0 takes every core.

    Raises:
        InputError: a process was killed.
    """
    if not jobs:
        return
    from joblib import Parallel, delayed, parallel_config

    with parallel_config("loky", inner_max_num_threads=1):
        workers = Parallel(n_jobs=at_a_time or -1, batch_size=1, return_as="generator_unordered")
        try:
            yield from workers(delayed(_led)(work, job, os.getpid()) for job in jobs)
        except BrokenProcessPool as error:
            raise InputError(
                "a process that computed was killed, perhaps for want of memory: the same command goes on where this"
                " one stopped, and a smaller --jobs needs less memory"
            ) from error


def _led(work: Callable[[J], R], job: J, leader: int) -> R:
    """Do a job in a process that ends with the one that leads."""
    end_with(leader)
    return work(job)


def end_with(parent: int) -> None:
    """Let this process end within a second of its parent's end, however busy it is; once in a process is enough."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os.kill(os.getpid(), signal.SIGTERM)

    if parent != os.getpid() and all(thread.name != WATCH for thread in threading.enumerate()):
        threading.Thread(target=watch, name=WATCH, daemon=True).start()
