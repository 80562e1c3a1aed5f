"""What studies of many cells share: their run, and the files that they write."""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from inhand.folders import check_folder, in_place
from inhand.hands.spatial.files import is_spatial_hand
from inhand.hands.spatial.gravity import USUAL_PALM
from inhand.pages import options
from inhand.records import checked
from inhand.shown import Shown, path_of
from inhand.sim.engines import engine_in_space

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass(frozen=True, eq=False)
class Study(Shown):
    """A finished study; its cells lie in the folder `out` of its configuration."""

    seconds: float
    """How long this call took [s]."""
    notes: tuple[str, ...]
    """What a reader should know, a sentence each."""
    cells: ClassVar[str]
    """Folder of the cells' files inside that of the study."""

    def save(self, folder: str | Path, *, overwrite: bool = False) -> Path:
        """Write cells, numbers, figures and report, as its command does, and return the folder.

        Raises:
            InputError: the folder holds something, or another study and `overwrite` is off.
        """
        out = Path(path_of("folder", folder))
        if out.resolve() != self.config.out.resolve():
            check_folder(out, overwrite=overwrite, mark=self.mark)
            shutil.copytree(self.config.out / self.cells, out / self.cells, dirs_exist_ok=True)
        replace(self, config=replace(self.config, out=out)).write(out)
        return out


def told_in(content: Mapping[str, Any]) -> tuple[float, tuple[str, ...]]:
    """Return how long a study took [s] and its notes, as its JSON tells them; older ones tell no notes."""
    name = "wall_s" if "wall_s" in content else "seconds"
    return checked(name, content.get(name), float), checked("notes", content.get("notes", ()), tuple[str, ...])


def place_told(hand: str, engine: str, gravity: str | None) -> str:
    """Return in which engine a study of a hand runs, and in space how gravity pulls."""
    if not is_spatial_hand(hand):
        return f"engine {engine}"
    return f"engine {engine_in_space(engine)}, gravity {gravity or USUAL_PALM}"


def command(word: str, config: DataclassInstance) -> str:
    """Return the command line that repeats a study, quoted for a shell; what is as by default is left out."""
    plain = type(config)()
    usual = [each.name for each in fields(plain) if getattr(config, each.name) == getattr(plain, each.name)]
    return shlex.join(["inhand", word, *options(config, [*usual, "overwrite"])])


def write_texts(texts: Mapping[str, str], folder: Path) -> None:
    """Write texts by their files' names, each under a temporary name that is then moved into place."""
    for name, text in texts.items():
        with in_place(folder / name) as part:
            part.write_text(text, encoding="utf-8")
