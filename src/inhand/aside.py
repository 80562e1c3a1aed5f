"""A second process that draws while this one goes on: pictures are what a short run spends most of its time on."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, ParamSpec, Protocol, TypeVar

from inhand.cores import usable

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor

P = ParamSpec("P")
R = TypeVar("R")


class Aside(Protocol):
    """Has something done, by this process or by another."""

    def __call__(self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> Callable[[], R]:
        """Begin what a function does with arguments that can be sent, and return what waits for its result."""


def here(function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> Callable[[], R]:
    """Do it in this process, at once."""
    result = function(*args, **kwargs)
    return lambda: result


@contextmanager
def second_process(module: str) -> Iterator[Aside]:
    """Give an `Aside` whose process imports a module of ours meanwhile; this process's where there is one core alone.

    What waits for its turn at the end is given up, and so is what runs where something failed.
    """
    pool = _pool() if usable() > 1 else None
    if pool is None:
        yield here
        return
    pool.submit(import_module, module)
    try:
        yield lambda function, *args, **kwargs: pool.submit(function, *args, **kwargs).result
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    # Waited for: an interpreter that ends while a pool's thread does may write to its pipe when that is closed.
    pool.shutdown(cancel_futures=True)


def _pool() -> ProcessPoolExecutor | None:
    """Return a process that can be given work; None where the system gives none."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    try:
        # A new process, not a copy of this one: copies of threads that wait for each other would wait for ever.
        return ProcessPoolExecutor(1, get_context("spawn"), _deaf)
    except OSError:
        return None


def _deaf() -> None:
    """Leave Ctrl-C to the process that waits."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
