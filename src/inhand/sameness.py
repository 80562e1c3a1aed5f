"""Whether two folders of runs hold the same numbers, and which versions made them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from inhand.errors import InputError
from inhand.learning.datasets import MARK as DATASET
from inhand.learning.datasets import read_dataset
from inhand.records import read_json, read_json_file, table_of
from inhand.versions import versions

ASIDE = frozenset(
    {"config", "versions", "seconds", "cpu_seconds", "wall_s", "last_sitting_s", "minari_version", "requirements"}
)
"""Keys of JSON files that tell of the folder, the versions and the clock, not of what came out."""
COMPARED = (".npz", ".json", ".csv", ".safetensors")
"""Endings of the files that are compared; pictures and pages are made of these."""


@dataclass(frozen=True)
class Same:
    """What two folders have in common."""

    same: tuple[str, ...]
    """Files of the first whose contents are the same in the second, to the last bit."""
    differ: tuple[str, ...]
    """Those whose contents are not, or that only one of both has."""
    versions: tuple[str, ...]
    """What differs between the versions that made the first and those of today, a text each."""

    def sentences(self, other: Path) -> tuple[str, ...]:
        """Say it, of a folder that is compared with the one where the run was first."""
        count = len(self.same) + len(self.differ)
        told = [f"Other versions than those of {other}: {', '.join(self.versions)}"] if self.versions else []
        if not self.differ:
            return (*told, f"All {count} files of numbers hold what those of {other} hold, to the last bit")
        return (*told, f"{len(self.differ)} of {count} files of numbers differ from {other}: {', '.join(self.differ)}")


def compared(old: Path, new: Path) -> Same:
    """Return what a run's folder has in common with one where it was run again.

    Raises:
        InputError: a file of either cannot be read.
    """
    names = sorted(_names(old) | _names(new))
    same = [name for name in names if _content(old / name) == _content(new / name)]
    there, now = _versions_of(old), versions()
    keys = [name for name in {**there, **now} if there and there.get(name) != now.get(name)]
    told = tuple(f"{key} {there.get(key, 'not told')} there, {now.get(key, 'not told')} now" for key in keys)
    return Same(tuple(same), tuple(name for name in names if name not in same), told)


def _names(folder: Path) -> set[str]:
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.suffix in COMPARED}
    return found - {name for name in found if Path(name).parts[0].startswith(".")}


def _content(path: Path) -> object:
    """Return what a file holds, without what differs between two runs of the same; None where it is not there."""
    if not path.is_file():
        return None
    if path.suffix == ".npz":
        return _numbers(path)
    if path.as_posix().endswith(DATASET):
        head, episodes = read_dataset(path.parents[1])
        return _told(table_of(head)), [[_bits(np.asarray(value)) for value in vars(each).values()] for each in episodes]
    return _told(read_json_file(path)) if path.suffix == ".json" else path.read_bytes()


def _numbers(path: Path) -> object:
    """Return the arrays of a trial, of whatever kind of hand, and what its head says."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (OSError, ValueError, BadZipFile) as error:
        raise InputError(f"{path} cannot be read: {error}") from error
    head = _told(read_json(str(arrays.pop("head")))) if "head" in arrays else None
    return {name: _bits(array) for name, array in arrays.items()}, head


def _bits(array: np.ndarray[Any, Any]) -> tuple[object, ...]:
    return array.dtype.str, array.shape, array.tobytes()


def _told(entry: object) -> object:
    """Return what JSON has held without the keys that differ between two runs of the same."""
    if isinstance(entry, dict):
        return {key: _told(value) for key, value in entry.items() if key not in ASIDE}
    return [_told(each) for each in entry] if isinstance(entry, list) else entry


def _versions_of(folder: Path) -> dict[str, str]:
    """Return the versions that a run's folder tells, of the file that tells them nearest to its top."""
    for name in sorted(_names(folder), key=lambda each: (each.count("/"), each)):
        if name.endswith(".json"):
            found = _find(read_json_file(folder / name))
            if found:
                return found
    return {}


def _find(entry: object) -> dict[str, str]:
    if not isinstance(entry, dict):
        return {}
    own = entry.get("versions")
    if isinstance(own, dict):
        return {str(key): str(value) for key, value in own.items()}
    return next((found for each in entry.values() if (found := _find(each))), {})
