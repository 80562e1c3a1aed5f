"""The folder of a run: never another run's results overwritten by accident, never half a run left in place."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from inhand.errors import InputError

MARK = "metrics.json"
"""The file that marks a folder as a run's."""


def check_folder(out: Path, *, overwrite: bool, mark: str = MARK) -> None:
    """Refuse an output folder that holds something; a folder that holds `mark` is one that may be replaced.

    Raises:
        InputError: the folder holds a run and `overwrite` is off, or holds anything else, or is a file, or holds the
            current folder.
    """
    for place in (out, *out.parents):
        if place.exists() and not place.is_dir():
            raise InputError(f"--out {out} is a file; give a folder that does not exist yet")
    if out.resolve() in (Path.cwd(), *Path.cwd().parents):
        raise InputError(f"--out {out} holds the folder you are in; give a folder inside it")
    _check_writable(out)
    if not out.is_dir() or not any(out.iterdir()):
        return
    if not (out / mark).is_file():
        raise InputError(f"--out {out} holds files that are no run of inhand; give another folder")
    if not overwrite:
        raise InputError(f"--out {out} holds the results of a run; give another folder, or --overwrite to replace it")


@contextmanager
def run_folder(out: Path) -> Iterator[Path]:
    """Give a temporary folder beside `out` to write a run to; it takes the place of `out` once all is written."""
    out = out.resolve()
    temporary, old = out.with_name(out.name + ".part"), out.with_name(out.name + ".old")
    shutil.rmtree(temporary, ignore_errors=True)
    temporary.mkdir(parents=True)
    try:
        yield temporary
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    if out.exists():
        shutil.rmtree(old, ignore_errors=True)  # what a run that was killed right here has left
        out.replace(old)
    temporary.replace(out)
    shutil.rmtree(old, ignore_errors=True)


@contextmanager
def in_place(path: Path) -> Iterator[Path]:
    """Give a temporary name beside a file to write to; it takes the file's place once all is written."""
    temporary = path.with_name(path.name + ".part")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _check_writable(out: Path) -> None:
    """Refuse a place where no folder can be made, before anything is run."""
    try:
        out.resolve().parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=out.resolve().parent):
            return
    except OSError as error:
        raise InputError(f"--out {out} cannot be written: {error.strerror}; give another folder") from error
