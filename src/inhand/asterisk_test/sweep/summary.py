"""What a sweep found, as frames: a row for each trial, their cases, and the means that compare hands."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from inhand.asterisk_test.beside import SETTINGS
from inhand.asterisk_test.cells import CellFile
from inhand.asterisk_test.results import tidy, turning
from inhand.control.trial import KEPT
from inhand.hands.hand import HandSpec
from inhand.hands.spatial.hand import SpatialHand
from inhand.records import read_record

CASE = ["hand", "object", "direction"]
"""What one case is: a hand, an object and a direction, over its trials."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """All cells of a sweep; what was reached and limits are in mm, in deg for directions that only rotate."""

    hands: tuple[str, ...]
    """Names of the hands, in the order asked for."""
    objects: tuple[str, ...]
    directions: tuple[str, ...]
    """Names of the directions, clockwise from Out, turns last; in space as they were asked for."""
    cells: pd.DataFrame
    """A row for each hand with each object: `reason` why it could not be run, `seconds`, `cpu_seconds`."""
    trials: pd.DataFrame
    """A row for each trial: `SETTINGS`, `reached`, `limit`, `finger_mm`, and what `as_entry` gives."""
    cases: pd.DataFrame
    """A row for each case that ran: means over its trials, `share` of the limit, whether all `kept`, `why` not."""

    @property
    def alike(self) -> tuple[str, ...]:
        """Directions whose distances have a common mean: the translations, or all where all rotate."""
        rotate = set(self.cases.direction[self.cases.rotates])
        return tuple(name for name in self.directions if name not in rotate) or self.directions

    @property
    def unit(self) -> str:
        """Unit of their distances."""
        return "deg" if len(self.cases) and self.cases.rotates.all() else "mm"

    @cached_property
    def anew(self) -> "Sweep | None":
        """The sweep as it comes with fingers placed anew, which is no part of the test; None where they may not be."""
        if "placed_anew" not in self.trials:
            return None
        ways = self.trials.reindex(columns=["regrasped_mm", "regrasped_deg"]).astype(float)
        reached = ways.regrasped_mm.fillna(ways.regrasped_deg)
        share = reached / self.trials.limit.replace(0.0, np.nan)
        trials = self.trials.assign(reached=reached, fraction_of_limit=share)
        return replace(self, trials=trials, cases=_cases(trials))


def sweep_of(contents: Iterable[CellFile], directions: Sequence[str]) -> Sweep:
    """Return the sweep that the contents of its cells' files make up, its directions in an order."""
    cells = list(contents)
    entries = []
    for cell in cells:
        finger = 1e3 * read_record(cell.settings["hand"], _kind(cell)).finger_length
        disturb = cell.settings.get("disturb") or {"name": "none"}
        settings = cell.hand, cell.object, cell.settings["controller"], cell.settings["engine"], disturb["name"]
        same = {**dict(zip(SETTINGS, settings, strict=True)), "finger_mm": finger}
        entries += [same | entry for entry in cell.trials]
    trials = tidy(entries, (*SETTINGS, "finger_mm"))
    told = [(cell.hand, cell.object, cell.reason, cell.seconds, cell.cpu_seconds) for cell in cells]
    table = pd.DataFrame(told, columns=["hand", "object", "reason", "seconds", "cpu_seconds"])
    names = tuple(table.hand.unique()), tuple(table.object.unique()), tuple(directions)
    return Sweep(*names, table, trials, _cases(trials))


def _kind(cell: CellFile) -> type[HandSpec | SpatialHand]:
    """Return whether the hand of a cell is in the plane or in space, where gravity is among its settings."""
    return SpatialHand if "gravity" in cell.settings else HandSpec


def compared(sweep: Sweep, by: Sequence[str]) -> pd.DataFrame:
    """Return hands compared over what they were run with: a row for each group of cases, with its means.

    Distances and limits are means over `Sweep.alike`, where a case that could not be run counts as 0; in shares it does
    not count. `sd` is the standard deviation over trials of the group's mean distance: the spread that repeating
    the whole sweep with other start noise would show.

    Args:
        sweep: what was found.
        by: of `CASE`, the hand and what else tells groups apart; they are the frame's index.

    Returns:
        `distance`, `sd` (NaN of one trial), `limit`, both in finger lengths (`distance_size`, `limit_size`), `share`,
        `share_sd`, `median`, `least`, and how many `cases` there are and were `kept`.
    """
    keys = list(by)
    names = {"hand": sweep.hands, "object": sweep.objects, "direction": sweep.alike}
    out_of = math.prod(len(names[key]) for key in CASE if key not in keys)

    def counted(rows: pd.DataFrame) -> pd.DataFrame:
        return rows if "direction" in keys else rows[rows.direction.isin(sweep.alike)]

    cases, every = counted(sweep.cases).groupby(keys, sort=False), sweep.cases.groupby(keys, sort=False)
    found = (cases[["reached", "limit"]].sum() / out_of).rename(columns={"reached": "distance"})
    size = cases.finger_mm.first().where(~cases.rotates.first())
    found["distance_size"], found["limit_size"] = found.distance / size, found.limit / size
    repeated = [*keys, "trial"]
    found["sd"] = (counted(sweep.trials).groupby(repeated).reached.sum() / out_of).groupby(keys).std()
    found["share_sd"] = sweep.trials.groupby(repeated).fraction_of_limit.mean().groupby(keys).std()
    found["share"], found["median"], found["least"] = every.share.mean(), every.share.median(), every.share.min()
    found["cases"], found["kept"] = every.size(), every.kept.sum()
    return found


def _why(end: str, finger: object) -> str:
    """Return how a trial ended, and by which finger if one let go: left, or one that is called finger 1."""
    if not isinstance(finger, str):
        return end
    return f"{end} by {finger}" if "finger" in finger else f"{end} by the {finger} finger"


def _cases(trials: pd.DataFrame) -> pd.DataFrame:
    failed = ~trials.outcome.isin(KEPT)
    told = trials.assign(
        kept=~failed,
        rotates=turning(trials),
        why=[_why(*row) for row in zip(trials.outcome, trials.first_lost, strict=True)],
    )
    told["why"] = told.why.where(failed)
    cases = told.groupby(CASE, sort=False).agg(
        rotates=("rotates", "first"),
        trials=("trial", "size"),
        reached=("reached", "mean"),
        sd=("reached", "std"),
        limit=("limit", "first"),
        finger_mm=("finger_mm", "first"),
        kept=("kept", "all"),
        why=("why", lambda ends: "; ".join(ends.dropna().unique())),
    )
    cases["share"] = cases.reached / cases.limit.replace(0.0, np.nan)
    return cases.reset_index()
