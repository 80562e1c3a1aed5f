"""The folder of a run: never another run's results overwritten by accident, never half a run left in place."""

import errno
import os
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from inhand.errors import InputError

MARK = "metrics.json"
"""The file that marks a folder as a run's."""
DISK = (
    errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.ENAMETOOLONG,
    errno.ELOOP, errno.EEXIST, errno.ENOTDIR,
)  # fmt: skip
"""What a disk refuses, so that the user can mend it by another place."""


def check_folder(out: Path, *, overwrite: bool, mark: str = MARK) -> None:
    """Refuse an output folder that holds something; a folder that holds `mark` is one that may be replaced.

    Raises:
        InputError: the folder holds a run and `overwrite` is off, or holds anything else, or is a file, or holds the
            current folder, or no system takes its name.
    """
    place = place_of(out)
    with writing(out):
        for each in (out, *out.parents):
            if each.exists() and not each.is_dir():
                told = "" if each == out else f": {each}"
                raise InputError(f"--out {out}{told} is a file; give a folder that does not exist yet")
        if place in (Path.cwd(), *Path.cwd().parents):
            raise InputError(f"--out {out} holds the folder you are in; give a folder inside it")
        if not out.is_dir() or not any(out.iterdir()):
            return
        if not (out / mark).is_file():
            raise InputError(f"--out {out} holds files that are no run of this kind; give another folder")
    if not overwrite:
        raise InputError(f"--out {out} holds the results of a run; give another folder, or --overwrite to replace it")


@contextmanager
def run_folder(out: Path, *, overwrite: bool, mark: str = MARK, stopped: str = "") -> Iterator[Path]:
    """Give a temporary folder beside `out` to write a run to; it takes the place of `out` once all is written.

    What a killed run has left there is removed, unless it left the file `stopped`, with which a run can go on: then it
    is given, and stays where this one does not come to its end either. Until the end nothing in `out` is touched, and
    no other run may write to it.

    Raises:
        InputError: as `check_folder`; another run writes to `out`; or the disk takes no more.
    """
    place = place_of(out)
    with writing(out):
        part, old = place.with_name(place.name + ".part"), place.with_name(place.name + ".old")
        if old.is_dir() and not place.exists():  # a run was killed right between the two moves below
            old.replace(place)
    check_folder(out, overwrite=overwrite, mark=mark)
    with alone(part, out):
        try:
            if not _goes_on(part, stopped):
                clear(part)
            with writing(out):
                yield part
                if place.exists():
                    shutil.rmtree(old, ignore_errors=True)
                    place.replace(old)
                part.replace(place)
        except BaseException:
            if not _goes_on(part, stopped):
                shutil.rmtree(part, ignore_errors=True)
            raise
        shutil.rmtree(old, ignore_errors=True)


def _goes_on(part: Path, stopped: str) -> bool:
    return bool(stopped) and (part / stopped).is_file()


@contextmanager
def alone(folder: Path, out: Path) -> Iterator[None]:
    """Make a folder and keep every other process from writing there; the lock ends with the process, however it ends.

    Windows has no such lock: there nothing is kept out. `out` is what the user calls the folder.

    Raises:
        InputError: another process writes there, or the folder cannot be made.
    """
    with writing(out, (*DISK, errno.ENOENT)):
        folder.mkdir(parents=True, exist_ok=True)
    if sys.platform == "win32":
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        if not _locked(handle, folder):
            raise InputError(
                f"--out {out}: another run is writing there; wait until it has ended, or give another folder"
            )
        yield
    finally:
        os.close(handle)


def _locked(handle: int, folder: Path) -> bool:
    """Lock an open folder, and return whether it is ours: no other process has it, nor has just put it in place."""
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True  # some network disks know no locks
    return folder.is_dir() and os.fstat(handle).st_ino == folder.stat().st_ino


@contextmanager
def writing(out: Path, refusals: Sequence[int] = DISK) -> Iterator[None]:
    """Turn what a disk or a system refuses while `out` is written into an error for the user.

    Raises:
        InputError: the name is too long, a loop of links, no rights, no room.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in refusals:
            raise
        raise InputError(f"--out {out} cannot be written: {error.strerror}; give another folder") from error


def place_of(out: Path) -> Path:
    """Return a folder's place, through all links.

    Raises:
        InputError: a character that no name has, a loop of links, or a name that is too long.
    """
    if "\0" in str(out):
        raise InputError(f"--out {str(out)!r} holds a NUL, which no name of a folder can; give another folder")
    with writing(out):
        try:
            place = out.resolve()
        except RuntimeError as error:  # Python before 3.13
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP)) from error
        if place.is_symlink():  # Python from 3.13 on leaves a loop as it is
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        place.with_name(place.name + ".part").exists()  # names that are too long
    return place


def is_file(path: Path) -> bool:
    """Return whether there is such a file; no file has a name too long, or with a NUL."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def clear(folder: Path) -> None:
    """Remove everything in a folder, and keep the folder."""
    for each in folder.iterdir():
        if each.is_dir() and not each.is_symlink():
            shutil.rmtree(each)
        else:
            each.unlink()


@contextmanager
def in_place(path: Path) -> Iterator[Path]:
    """Give a temporary name beside a file to write to; it takes the file's place once all is written.

    Missing folders are made.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".part")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
