"""Work on every core: what studies compute side by side, each piece in a process of its own."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from inhand.errors import InputError

J = TypeVar("J")
R = TypeVar("R")


def on_cores(work: Callable[[J, int], R], jobs: Sequence[J], at_a_time: int) -> Iterator[R]:
    """Do jobs and give what each comes to, in the order in which they end.

    Args:
        work: does a job; its second argument is this process, at whose end its own has to end.
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
            yield from workers(delayed(work)(job, os.getpid()) for job in jobs)
        except BrokenProcessPool as error:
            raise InputError(
                "a process that computed was killed, perhaps for want of memory: the same command goes on where this"
                " one stopped, and a smaller --jobs needs less memory"
            ) from error
