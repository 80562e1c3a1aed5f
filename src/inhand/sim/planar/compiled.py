"""Functions compiled to machine code by Numba, kept on disk for the next run.

Numba keys what it keeps to the file of the outermost function alone, so that a change in a function which that one
calls would go unnoticed. Here the folder's name is a digest of every source file of the engine and of the versions
that made it: what another version wrote lies elsewhere and is never read.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import ParamSpec, TypeVar, cast

import numba
import platformdirs

P = ParamSpec("P")
R = TypeVar("R")


def cache_folder() -> Path | None:
    """Return the folder for compiled code of exactly these sources and versions; None where none can be written."""
    here = Path(__file__).parent
    made_by = [sys.version, version("numba"), version("numpy"), *(p.read_text() for p in sorted(here.glob("*.py")))]
    digest = hashlib.sha256("\0".join(made_by).encode()).hexdigest()[:16]
    base = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("inhand")
    folder = Path(base) / f"planar-{digest}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return None


def inner(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that is compiled as a part of the kernels that call it."""
    return cast("Callable[P, R]", numba.njit(nogil=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True, forceinline=True)(function))


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that Python calls, compiled at its first call or read from the cache on disk."""
    folder = cache_folder()
    if folder is None:
        return inner(function)
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder)
    try:
        return cast("Callable[P, R]", numba.njit(nogil=True, error_model="numpy", cache=True)(function))
    finally:
        numba.config.CACHE_DIR = before
