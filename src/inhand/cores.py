"""Cores of this machine: how many a process may use, and work on all of them, each piece in a process of its own."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

from inhand.errors import InputError

J = TypeVar("J")
R = TypeVar("R")
TRIES = 3
"""How often a piece is begun before whoever asked gives up."""
WATCH = "end with the parent"
"""Name of the thread that ends a process that computes for another which is gone."""
_alone: ContextVar[bool] = ContextVar("alone", default=False)


def usable() -> int:
    """Return how many cores may be used: those of this process, or one where it is a piece of what uses them all."""
    if _alone.get():
        return 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def one_core() -> Iterator[None]:
    """Use one core alone: others have the rest."""
    token = _alone.set(True)
    try:
        yield
    finally:
        _alone.reset(token)


def on_one_core(work: Callable[[J], R], job: J) -> R:
    """Do a job on one core."""
    with one_core():
        return work(job)


def on_cores(work: Callable[[J], R], jobs: Sequence[J], count: int = 0) -> Iterator[R]:
    """Do jobs in so many processes of this machine at a time, 0 for one on each core, and give what each comes to.

    What was being done where one is killed is done again. Once this process is gone, so are those that work for it.

    Raises:
        InputError: processes were killed `TRIES` times.
    """
    from joblib import Parallel, delayed, parallel_config

    left = dict(enumerate(jobs))
    for _ in range(TRIES):
        with parallel_config("loky", inner_max_num_threads=1):
            workers = Parallel(n_jobs=count or -1, batch_size=1, return_as="generator_unordered")
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
    return job[0], on_one_core(work, job[1])


def end_with(parent: int) -> None:
    """Let this process end within a second of its parent's end, however busy it is; once in a process is enough."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os.kill(os.getpid(), signal.SIGTERM)

    if parent != os.getpid() and all(thread.name != WATCH for thread in threading.enumerate()):
        threading.Thread(target=watch, name=WATCH, daemon=True).start()
