"""Results kept on disk for the next run, by what they were computed from.

The name of a file is a digest of all that a result depends on: the inputs, the sources that compute it and the versions
they ran on. So what another version wrote is never looked at. Inside stands a digest of the name and the contents: a
file that is not what was written is made anew.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import os
import platform
import re
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Arrays: TypeAlias = dict[str, NDArray[Any]]
"""A result: arrays of numbers by name."""

PLACE = "INHAND_CACHE"
"""Environment variable: the folder of all caches, in place of the user's; `off` keeps no results."""
LARGEST = 200_000_000
"""Results that were not used for longest are dropped beyond this [byte]; guessed: some 50,000 limits of a reach."""
ROUNDS = 64
"""One result in so many, as it is kept, looks whether there are too many: among 10,000 files that takes 0.2 s."""
DIGEST = 64
"""Characters of a digest."""
PACKAGE = Path(__file__).parent
_IMPORTS = re.compile(r"^\s*(?:from (inhand[\w.]*) import (\([^)]*\)|.*)|import (inhand[\w.]*))", re.MULTILINE)


def cached(kind: str, inputs: object, module: str, compute: Callable[[], Arrays]) -> Arrays:
    """Return a result from the cache, or compute it and keep it.

    Args:
        kind: what it is; a word.
        inputs: all that it depends on: dataclasses, sequences and mappings of numbers, texts and arrays.
        module: name of the module of ours that computes it; its sources and those that it imports belong to the key.
        compute: gives the result where it is not known.
    """
    key = key_of(kind, inputs, module)
    found = look_up(key)
    if found is None:
        found = compute()
        keep(key, found)
    return found


def key_of(kind: str, inputs: object, module: str) -> str:
    """Return the name of the result that a module of ours computes from inputs; see `cached`."""
    digest = hashlib.sha256(f"{sources(module)} {_versions()} ".encode())
    _tell(digest.update, inputs)
    return f"{kind}-{digest.hexdigest()}"


def name_of(inputs: object) -> str:
    """Return a name that follows from inputs alone, whatever computes something of them; see `cached`."""
    digest = hashlib.sha256()
    _tell(digest.update, inputs)
    return digest.hexdigest()


def look_up(key: str) -> Arrays | None:
    """Return a result that was kept; None where there is none, or not as it was written."""
    folder = _folder()
    if folder is None:
        return None
    try:
        content = (folder / key).read_bytes()
        if content[:DIGEST] != _seal(key, content[DIGEST:]):
            return None
        with np.load(io.BytesIO(content[DIGEST:]), allow_pickle=False) as file:
            found = {name: file[name] for name in file.files}
    except (OSError, ValueError):
        return None
    with suppress(OSError):
        os.utime(folder / key)  # the oldest are dropped, by when they were last used
    return found


def keep(key: str, result: Arrays) -> None:
    """Keep a result, in one step, so that no reader sees half of it; where nothing can be written it is not kept."""
    folder = _folder()
    if folder is None:
        return
    stream, arrays = io.BytesIO(), dict[str, Any](result)
    np.savez(stream, **arrays)
    content = stream.getvalue()
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, prefix="part-", delete=False) as file:
            file.write((seal := _seal(key, content)) + content)
        Path(file.name).replace(folder / key)
        if int(seal[:8], 16) % ROUNDS == 0:
            _drop_oldest(folder)


def base() -> Path:
    """Return the folder of all caches, which may not be there."""
    import platformdirs

    place = os.environ.get(PLACE, "")
    return Path(platformdirs.user_cache_dir("inhand") if place in {"", "off"} else place)


@cache
def sources(module: str) -> str:
    """Return a digest of the sources of a module of ours and of all of ours that it imports, at any depth."""
    texts: dict[str, str] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in texts or not name.startswith("inhand."):
            continue
        path = PACKAGE.joinpath(*name.split(".")[1:])
        path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        if not path.is_file():
            continue  # a name in a module
        texts[name] = path.read_text(encoding="utf-8")
        for source, names, alone in _IMPORTS.findall(texts[name]):
            waiting += [source or alone, *(f"{source}.{each}" for each in re.findall(r"\w+", names))]
    return hashlib.sha256("\0".join(f"{name}\0{texts[name]}" for name in sorted(texts)).encode()).hexdigest()


@cache
def _versions() -> str:
    """Return what else the numbers of a result come from."""
    return " ".join([platform.python_version(), platform.machine(), *map(version, ("numpy", "scipy", "numba"))])


def _folder() -> Path | None:
    """Return where results are kept; None where none are to be."""
    return None if os.environ.get(PLACE) == "off" else base() / "results"


def _seal(key: str, content: bytes) -> bytes:
    """Return what a file begins with: a digest of its name and of what follows."""
    return hashlib.sha256(key.encode() + content).hexdigest().encode()


def _drop_oldest(folder: Path) -> None:
    """Remove files that were not used for longest until the others have room."""
    with os.scandir(folder) as entries:
        files = sorted(((entry.stat().st_mtime, entry.stat().st_size, entry.path) for entry in entries), reverse=True)
    total = 0
    for _, size, path in files:
        total += size
        if total > LARGEST:
            Path(path).unlink(missing_ok=True)


def _tell(update: Callable[[bytes], None], value: object) -> None:
    """Tell a digest a value, its kind and its size, so that no two values are told alike."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {"": type(value).__qualname__} | {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        value = tuple(item for pair in value.items() for item in pair)
    if isinstance(value, tuple | list):
        update(f"({len(value)} ".encode())
        for each in value:
            _tell(update, each)
    elif isinstance(value, np.ndarray):
        content = np.ascontiguousarray(value)
        update(f"{content.dtype.str}{content.shape} ".encode())
        update(content.tobytes())
    elif value is None or isinstance(value, str | int | float):
        text = repr(value)
        update(f"{type(value).__name__}{len(text)} {text}".encode())
    else:
        raise TypeError(f"{type(value).__name__} is nothing that a cache can name a result by")
