"""A finished reach of any hand: its table, its figures and its folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from inhand.asterisk_test.config import ReachCommand
from inhand.control.trial import write_json
from inhand.repeats import write_repeat
from inhand.shown import HTML, Shown, frame
from inhand.versions import versions

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

MARK = "reach.json"
"""The file that marks a folder as one of a reach."""


@dataclass(frozen=True, eq=False)
class Reached(Shown):
    """How far a hand could carry an object, in the plane or in space."""

    mark = MARK

    config: ReachCommand
    held: Any
    """The hand and the object."""
    limits: tuple[Any, ...]
    """The limit of each direction."""
    notes: tuple[str, ...] = ()
    """What a reader should know, a sentence each."""

    @property
    def subtitle(self) -> str:
        """What was assumed, in a line."""
        raise NotImplementedError

    @property
    def friction(self) -> float:
        """Coefficient between finger and object that was assumed."""
        hand, spec = self.held
        given = self.config.friction
        return float(hand.friction * spec.friction) if given is None else given

    def entries(self) -> list[dict[str, Any]]:
        """Return the limits as the JSON has them, each with the last grip."""
        raise NotImplementedError

    def figures(self) -> Mapping[str, Figure]:
        """Return its figures by the names of their files."""
        raise NotImplementedError

    def table(self) -> DataFrame:
        """Return a row for each direction: its limit and the last grip."""
        return frame(self.entries())

    def write(self, folder: Path) -> None:
        """Write everything into a folder that is there."""
        from inhand.plots.save import save_figure

        for name, figure in self.figures().items():
            save_figure(figure, folder / name)
        content = {
            "limits": self.entries(),
            "config": asdict(self.config),
            "friction": self.friction,
            "notes": self.notes,
            "versions": versions(),
        }
        (folder / HTML).write_text(self.html(), encoding="utf-8")
        write_json(content, folder / self.mark)
        self.table().to_csv(folder / "limits.csv", index=False)
        write_repeat(folder, "reach", self.config)

    def draw(self, folder: Path) -> None:
        """Draw its figures into `figures` of a folder."""
        from inhand.plots.save import save_picture

        for name, figure in self.figures().items():
            save_picture(figure, folder, name, "")
