"""A policy of a hand in space beside the expert: its tables, figures and page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.comparison import HEADER, AnyPrimitive, ControllerTrials, rows
from inhand.asterisk_test.spatial.browser import spatial_views
from inhand.asterisk_test.spatial.report import SpatialRun, draw_replay
from inhand.learning.report import Compared
from inhand.learning.space_pools import TESTED
from inhand.pages import Picture
from inhand.plots.page.views import View
from inhand.plots.save import save_picture
from inhand.tasks.spatial.primitives import DIRECTIONS, TURNS

GROUPS = (("Directions", DIRECTIONS), ("Turns", TURNS), ("Directions never shown", TESTED))
"""What training shows by name, and some of the directions that it never shows."""
HUMAN = "Human [mm]"
"""The column that nobody can fill in space."""


@dataclass(frozen=True, eq=False)
class SpatialCompared(Compared):
    """The evaluation of a policy with a hand in space."""

    @property
    def groups(self) -> Sequence[tuple[str, Sequence[AnyPrimitive]]]:
        """Directions, turns, and directions that are never shown."""
        return GROUPS

    @property
    def tables(self) -> list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
        """Title, heading and rows of a table for each group; ways of turns are angles."""
        kept, found = [k for k, name in enumerate(HEADER) if name != HUMAN], []
        for title, group in self.groups:
            unit = "[deg]" if group is TURNS else "[mm]"
            header = [name.replace("[mm]", unit) if name.startswith(("Limit", "Dist")) else name for name in HEADER]
            cells = rows(self.policy, self.expert, (), group)
            found.append((title, tuple(header[k] for k in kept), [tuple(row[k] for k in kept) for row in cells]))
        return found

    def figure(self) -> Figure:
        """Return planes, maps of directions and turns of the policy."""
        return self.tested(self.policy).figure()

    def pictures(self, folder: Path) -> list[Picture]:
        """Draw the figures of both, and a replay, into `figures` of a folder."""
        found = []
        for each in (self.policy, self.expert):
            text = f"{each.name}: distances in three planes and on maps of directions, shares of the limit; turns"
            name = "policy.png" if each is self.policy else "expert.png"
            found.append(save_picture(self.tested(each).figure(), folder, name, text))
        return [*found, draw_replay(self.tested(self.policy), folder)]

    def views(self, shown: Sequence[Beside], replayed: Sequence[Beside]) -> list[View]:
        """Return what a page for a browser draws of means, and the player of trials."""
        return spatial_views(shown, replayed)

    def tested(self, controller: ControllerTrials) -> SpatialRun:
        """Return the shown trials of a controller as a run of the Asterisk Test."""
        return SpatialRun(self.test, *controller.first, notes=self.notes, label=controller.name)
