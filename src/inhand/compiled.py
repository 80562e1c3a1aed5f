"""Functions compiled to machine code by Numba, kept on disk for the next run.

Numba would keep a kernel by the date of its own file alone, blind to changes of the functions that it calls, and would
load whatever it finds. Here the folder's name is a digest of the kernel's module, of all of ours that it imports and of
the versions that made it, and a file that is not what was written is thrown away and made anew.

Importing this file imports Numba: only modules of compiled functions do, and those who call these import them late.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import wraps
from importlib.metadata import version
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
from llvmlite.binding import get_host_cpu_features, get_host_cpu_name

from inhand.caches import base, sources

P = ParamSpec("P")
R = TypeVar("R")

INNER: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False}
"""Without `_nrt` Numba would count who holds each array at every use: half of a step's time. Kernels make none."""
WRAPPERLESS: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""What only kernels call needs no way in from Python: two thirds of the time to compile."""


def inner(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that is compiled into the kernels that call it (twice as fast as calls between them)."""
    return _called_by_kernels(function, forceinline=True)


def leaf(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that is compiled by itself: one of loops over few arrays, which is faster alone."""
    return _called_by_kernels(function)


def _called_by_kernels(function: Callable[P, R], **how: bool) -> Callable[P, R]:
    """Return a compiled function, but not one more for each constant among its arguments, as Numba would make."""
    compiled: Any = numba.njit(**INNER, **WRAPPERLESS, **how)(function)
    if not vars(numba.config)["DISABLE_JIT"]:
        found, plain = compiled.get_call_template, numba.types.unliteral
        compiled.get_call_template = lambda args, named: found(
            tuple(map(plain, args)), {name: plain(kind) for name, kind in named.items()}
        )
    return cast("Callable[P, R]", compiled)


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that Python calls, compiled at its first call or read from the cache on disk."""
    settings = vars(numba.config)
    if settings["DISABLE_JIT"]:
        return function
    name = function.__name__
    folder = cache_folder(function.__module__)
    if folder is None:
        compiled = numba.njit(**INNER)(function)
    else:
        # Numba reads where to write from its settings, while it decorates.
        before, settings["CACHE_DIR"] = settings["CACHE_DIR"], str(folder)
        try:
            compiled = numba.njit(**INNER, cache=True)(function)
        finally:
            settings["CACHE_DIR"] = before

    def first(*args: P.args, **kwargs: P.kwargs) -> R:
        with _alone(folder, name):
            if len(compiled.overloads) == 0:  # no other thread has been here meanwhile
                if folder is not None:
                    _drop_damaged(folder, name)
                _begin(function, folder)
            result = compiled(*args, **kwargs)
            if folder is not None:
                _write_digests(folder, name)
        return cast("R", result)

    @wraps(function)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        known = len(compiled.overloads)  # `signatures` would hash every array's type at each call
        if known == 0:
            return first(*args, **kwargs)
        result = compiled(*args, **kwargs)
        if len(compiled.overloads) > known and folder is not None:
            _write_digests(folder, name)
        return cast("R", result)

    return run


def is_kept(module: str, name: str) -> bool:
    """Return whether a kernel of a module has been compiled for this machine."""
    folder = cache_folder(module)
    return folder is not None and (folder / f"{name}.json").is_file()


def cache_folder(module: str) -> Path | None:
    """Return the folder for a module's compiled code, of exactly these sources; None where none can be written."""
    made_by = [sys.version, *map(version, ("numba", "llvmlite", "numpy")), sources(module)]
    return _folder(module.removeprefix("inhand."), made_by)


def programs_folder() -> Path | None:
    """Return the folder for what JAX compiles on this kind of processor, which JAX does not tell apart, or None."""
    return _folder("programs", [get_host_cpu_name(), get_host_cpu_features().flatten()])


def _folder(name: str, made_by: list[str]) -> Path | None:
    digest = hashlib.sha256("\0".join(made_by).encode()).hexdigest()[:16]
    place = os.environ.get("NUMBA_CACHE_DIR")
    folder = (Path(place) if place else base() / "compiled") / f"{name}-{digest}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None


@contextmanager
def _alone(folder: Path | None, name: str) -> Iterator[None]:
    """Wait for others that compile a kernel, or read it: what one has compiled the next finds on disk."""
    with ExitStack() as held:
        if folder is not None:
            with suppress(ImportError, OSError):  # where no file can be locked each compiles
                import fcntl

                file = held.enter_context((folder / f"{name}.lock").open("w"))
                fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _begin(function: Callable[..., object], folder: Path | None) -> None:
    """Say what the first call of a kernel waits for, where it has to be compiled.

    What a kernel belongs to stands before the colon in the docstring of its package.
    """
    if folder is None or not any(file.suffix == ".nbc" for file in _files(folder, function.__name__)):
        package = sys.modules[function.__module__.rpartition(".")[0] or function.__module__].__doc__ or ""
        what = f"{package[:1].lower()}{package.partition(':')[0][1:]} ({function.__name__})"
        often = "once for this machine: up to 15 s"
        if folder is None:
            often = "up to 15 s in every run, as the cache cannot be written: set NUMBA_CACHE_DIR to a folder that can"
        logging.getLogger("inhand").warning("compiling %s, %s", what, often)


def _files(folder: Path, name: str) -> list[Path]:
    """Return the files that Numba keeps for a kernel: an index, and code for each kind of arguments."""
    return sorted(folder.rglob(f"*.{name}-*.nb[ci]"))


def _digests(folder: Path, name: str) -> dict[str, str]:
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in _files(folder, name)}


def _write_digests(folder: Path, name: str) -> None:
    """Write down what was kept for a kernel, in one step, so that no reader sees half of it."""
    part = folder / f"{name}.json.{os.getpid()}"
    try:
        part.write_text(json.dumps(_digests(folder, name)), encoding="utf-8")
        part.replace(folder / f"{name}.json")
    except OSError:
        part.unlink(missing_ok=True)


def _drop_damaged(folder: Path, name: str) -> None:
    """Remove what Numba kept for a kernel unless every file is as it was written down."""
    try:
        written = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        written = {}
    if written != _digests(folder, name):
        for file in _files(folder, name):
            file.unlink(missing_ok=True)
