"""What a function of the front door returns shows itself in a notebook: its table and its figure."""

from __future__ import annotations

import io
import os
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from inhand.errors import InputError
from inhand.folders import MARK, run_folder
from inhand.records import Config, checked, read_json, read_record

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


C = TypeVar("C", bound=Config)
HTML = "report.html"
"""The page for a browser in a run's folder."""


@dataclass(frozen=True, eq=False)
class Shown:
    """A finished run: its table and its figure, which a notebook shows, and its folder."""

    config: Any
    mark: ClassVar[str] = MARK
    """The file that marks its folder as one of its kind."""

    def table(self) -> DataFrame:
        """Return its numbers."""
        raise NotImplementedError

    def figure(self) -> Figure:
        """Return its figure."""
        raise NotImplementedError

    def html(self) -> str:
        """Return its page for a browser, one file without anything from elsewhere.

        Raises:
            InputError: its kind has none.
        """
        raise InputError("a dataset has no page for a browser: give a run, a training or a study")

    def write(self, folder: Path) -> None:
        """Write everything into a folder that is there."""
        raise NotImplementedError

    def save(self, folder: str | Path, *, overwrite: bool = False) -> Path:
        """Write what its command writes, numbers, figures and report, and return the folder.

        Raises:
            InputError: the folder holds something, or another run and `overwrite` is off.
        """
        out = Path(path_of("folder", folder))
        with run_folder(out, overwrite=overwrite, mark=self.mark) as part:
            replace(self, config=replace(self.config, out=out)).write(part)
        return out

    def _repr_html_(self) -> str:
        return str(self.table().to_html(index=False, float_format="{:.2f}".format))

    def _repr_png_(self) -> bytes:
        with io.BytesIO() as file:
            self.figure().savefig(file, format="png")
            return file.getvalue()


@dataclass(frozen=True, eq=False)
class Kept(Shown):
    """A finished run that lives in its folder, and can be given where that folder is asked for."""

    folder: Path

    def save(self, folder: str | Path, *, overwrite: bool = False) -> Path:
        """Copy the run to another folder and return that.

        Raises:
            InputError: the folder holds something, or another run and `overwrite` is off.
        """
        out = Path(path_of("folder", folder))
        with run_folder(out, overwrite=overwrite, mark=self.mark) as part:
            shutil.copytree(self.folder, part, dirs_exist_ok=True)
        return out

    def __fspath__(self) -> str:
        """Return the folder."""
        return str(self.folder)


def frame(entries: Sequence[dict[str, Any]]) -> DataFrame:
    """Return entries of a JSON as a table, dicts in them as columns of their own; heavy parts are imported now."""
    import pandas as pd

    return pd.json_normalize([dict(entry) for entry in entries])


def saved(folder: Path, mark: str, kind: type[C], **untold: object) -> tuple[C, dict[str, Any]]:
    """Return the configuration that a run's JSON holds, its folder put in, and all that the JSON holds.

    Args:
        folder: of the run.
        mark: name of the JSON.
        kind: of the configuration.
        untold: fields that older files do not tell, as they were.

    Raises:
        InputError: the file is none of such a run.
    """
    file = folder / mark
    try:
        found = checked("content", read_json(file.read_bytes()), dict[str, Any])
        entry = checked("config", found.get("config"), dict[str, Any])
        return read_record(untold | entry | {"out": str(folder)}, kind), found
    except (InputError, OSError) as error:
        raise InputError(f"{file}: {error}") from error


def several(given: object) -> list[Any]:
    """Return what may be one thing or several of them as a list."""
    return list(given) if isinstance(given, Iterable) and not isinstance(given, str) else [given]


def path_of(name: str, given: object) -> str:
    """Return a folder or a file, or the folder of a run that lives in one, as a text.

    Raises:
        InputError: it is none of these; the text says what was given as `name`.
    """
    if isinstance(given, str | os.PathLike):
        return os.fspath(given)
    raise InputError(f"{name} is {given!r}: give a folder or a file, as a text or a path, or a run with a folder")


def listed(words: object) -> str:
    """Return words, names or angles, or one of them, as the one text that a command line has."""
    return ",".join(map(str, several(words)))
