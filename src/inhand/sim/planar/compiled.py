"""Functions compiled to machine code by Numba, kept on disk for the next run.

Numba would keep a kernel by the date of its own file alone, blind to changes of the functions that it calls, and would
load whatever it finds. Here the folder's name is a digest of all sources of the engine and of the versions that made
it, and a file that is not what was written is thrown away and made anew.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import sys
from collections.abc import Callable
from functools import wraps
from importlib.metadata import version
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
import platformdirs

P = ParamSpec("P")
R = TypeVar("R")

INNER: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False}
"""Without `_nrt` Numba would count who holds each array at every use: half of a step's time. Kernels make none."""
WRAPPERLESS: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""What only kernels call needs no way in from Python: two thirds of the time to compile."""
SEAL = "digests.json"


def inner(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that is compiled into the kernels that call it (twice as fast as calls between them)."""
    return cast("Callable[P, R]", numba.njit(**INNER, **WRAPPERLESS, forceinline=True)(function))


def leaf(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that is compiled by itself: one of loops over few arrays, which is faster alone."""
    return cast("Callable[P, R]", numba.njit(**INNER, **WRAPPERLESS)(function))


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that Python calls, compiled at its first call or read from the cache on disk."""
    settings = vars(numba.config)
    if settings["DISABLE_JIT"]:
        return function
    folder = cache_folder()
    if folder is None:
        compiled = numba.njit(**INNER)(function)
    else:
        _drop_damaged(folder)
        # Numba reads where to write from its settings, while it decorates.
        before, settings["CACHE_DIR"] = settings["CACHE_DIR"], str(folder)
        try:
            compiled = numba.njit(**INNER, cache=True)(function)
        finally:
            settings["CACHE_DIR"] = before

    @wraps(function)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        if not compiled.signatures:
            _begin(function.__name__, folder)
        known = len(compiled.signatures)
        result = compiled(*args, **kwargs)
        if len(compiled.signatures) > known and folder is not None:
            _seal(folder)
        return cast("R", result)

    return run


def cache_folder() -> Path | None:
    """Return the folder for compiled code of exactly these sources and versions; None where none can be written."""
    here = Path(__file__).parent
    sources = [path.read_text(encoding="utf-8") for path in sorted(here.glob("*.py"))]
    made_by = [sys.version, version("numba"), version("llvmlite"), version("numpy"), *sources]
    digest = hashlib.sha256("\0".join(made_by).encode()).hexdigest()[:16]
    base = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("inhand")
    folder = Path(base) / f"planar-{digest}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None


def _begin(name: str, folder: Path | None) -> None:
    """Say what the first call of a kernel waits for, where it has to be compiled."""
    if folder is None or not any(folder.rglob(f"*.{name}-*.nbc")):
        kept = "" if folder is not None else "; the cache cannot be written, so every run does: set NUMBA_CACHE_DIR"
        logging.getLogger("inhand").warning("compiling the planar engine, %s: some 10 s%s", name, kept)


def _digests(folder: Path) -> dict[str, str]:
    """Return the digests of the files that Numba keeps in a folder."""
    files = sorted(folder.rglob("*.nb[ci]"))
    return {str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def _seal(folder: Path) -> None:
    """Write down what was kept, in one step, so that no reader sees half of it."""
    part = folder / f"{SEAL}.{os.getpid()}"
    try:
        part.write_text(json.dumps(_digests(folder)), encoding="utf-8")
        part.replace(folder / SEAL)
    except OSError:
        part.unlink(missing_ok=True)


def _drop_damaged(folder: Path) -> None:
    """Remove what Numba kept unless every file is as it was written down."""
    try:
        sealed = json.loads((folder / SEAL).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        sealed = {}
    if sealed != _digests(folder):
        for file in folder.rglob("*.nb[ci]"):
            file.unlink(missing_ok=True)
