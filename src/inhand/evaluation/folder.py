"""The folder of a run: never another run's results overwritten by accident, never half a run left in place."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from inhand.errors import InputError

MARK = "metrics.json"
"""The file that marks a folder as a run's."""


def check_folder(out: Path, *, overwrite: bool) -> None:
    """Refuse an output folder that holds something.

    Raises:
        InputError: the folder holds a run and `overwrite` is off, or holds anything else, or is a file.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f"--out {out} is a file; give a folder that does not exist yet")
    if not out.is_dir() or not any(out.iterdir()):
        return
    if not (out / MARK).is_file():
        raise InputError(f"--out {out} holds files that are no run of inhand; give another folder")
    if not overwrite:
        raise InputError(f"--out {out} holds the results of a run; give another folder, or --overwrite to replace it")


@contextmanager
def run_folder(out: Path) -> Iterator[Path]:
    """Give a temporary folder beside `out` to write a run to; it takes the place of `out` once all is written."""
    out.parent.mkdir(parents=True, exist_ok=True)
    temporary = out.with_name(out.name + ".part")
    shutil.rmtree(temporary, ignore_errors=True)
    temporary.mkdir()
    try:
        yield temporary
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    if out.exists():
        shutil.rmtree(out)
    temporary.replace(out)
