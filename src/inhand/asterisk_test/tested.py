"""A finished run of the Asterisk Test of any hand: its trials and results, its table and its folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from inhand.aside import Aside, here
from inhand.asterisk_test.beside import SETTINGS, Beside
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.results import Result, as_entry, summary_of, tidy
from inhand.asterisk_test.table import table_rows
from inhand.control.trial import write_json, write_trials
from inhand.pages import Part, page_of
from inhand.repeats import write_repeat
from inhand.shown import HTML, Shown
from inhand.versions import versions

if TYPE_CHECKING:
    from pandas import DataFrame

FRAME_STEPS = 2
"""Rows of a trial from one frame of the replay to the next (25 frames a second at 0.02 s a row)."""


@dataclass(frozen=True, eq=False)
class Tested(Shown):
    """A finished run, in the plane or in space."""

    config: AsteriskConfig
    trials: tuple[Any, ...]
    results: tuple[Result, ...]
    """Their results, in the same order."""
    people: tuple[HumanTrial, ...] = ()
    """Human trials to set beside them."""
    notes: tuple[str, ...] = ()
    """What a reader should know, a sentence each."""
    beside: tuple[Beside, ...] = ()
    """Earlier runs to set beside it."""
    label: str = ""
    """What tells it from them; without it its controller."""

    @property
    def settings(self) -> dict[str, object]:
        """What a row of its table says of its run: hand, object, controller, engine and disturbance."""
        return dict(zip(SETTINGS, self.trials[0].passport.settings, strict=False))

    def pictures(self, folder: Path, aside: Aside = here) -> list[Part]:
        """Draw figures and a replay into `figures` of a folder, some aside, and return their parts of the page."""
        raise NotImplementedError

    def draw(self, folder: Path) -> None:
        """Draw its figures and a replay into `figures` of a folder."""
        self.pictures(folder)

    def parts(self, pictures: Sequence[Part] = ()) -> list[Part]:
        """Return the parts of its page, the figures before the last."""
        raise NotImplementedError

    @cached_property
    def rows(self) -> list[tuple[str, ...]]:
        """Rows of the table that people read, under `inhand.asterisk_test.table.HEADER`, a direction each."""
        return table_rows(self.results, self.people)

    def table(self) -> DataFrame:
        """Return a row for each trial: `settings`, what its controller reads, direction, outcome, every metric."""
        same = self.settings | {"reads": self.trials[0].passport.reads}
        return tidy(same | as_entry(result) for result in self.results)

    @cached_property
    def apart(self) -> list[dict[str, Any]]:
        """What each trial reached that is no part of the test, where fingers may be placed anew."""
        return []

    @cached_property
    def apart_rows(self) -> list[tuple[str, ...]]:
        """The same as people read it, under `inhand.asterisk_test.regrasped.HEADER`, a direction each."""
        return []

    def write(self, folder: Path, aside: Aside = here) -> None:
        """Write everything into a folder that is there; pictures may be drawn aside."""
        write_trials(self.trials, folder)
        self.write_report(folder, aside)
        (folder / HTML).write_text(self.html(), encoding="utf-8")
        content = {
            "trials": [as_entry(result) for result in self.results],
            "directions": summary_of(self.results),
            "notes": self.notes,
            "config": asdict(self.config),
            "versions": versions(),
            "seed": self.config.seed,
            "reads": self.trials[0].passport.reads,
            "disturbed": [trial.passport.disturbed for trial in self.trials],
            **({"regrasped": self.apart} if self.apart else {}),
        }
        write_json(content, folder / "metrics.json")
        self.table().to_csv(folder / "trials.csv", index=False)
        write_repeat(folder, "asterisk", self.config)

    def page(self, pictures: Sequence[Part] = ()) -> str:
        """Return its page in Markdown: what was run, the table, what failed and why, figures, how to run it again."""
        return page_of(*self.parts(["## Figures", *pictures]))

    def write_report(self, folder: Path, aside: Aside = here) -> None:
        """Write figures, replay and `report.md` into a folder; pictures may be drawn aside."""
        (folder / "report.md").write_text(self.page(self.pictures(folder, aside)), encoding="utf-8")

    @property
    def name(self) -> str:
        """What tells it from the runs beside it."""
        return self.label or str(self.trials[0].passport.controller)

    @property
    def subject(self) -> str:
        """Its controller, object and hand by their names, which are shorter than files and folders."""
        passport = self.trials[0].passport
        return f"{passport.controller} on {passport.object.name} with {passport.hand.name}"


def farthest_trial(run: Tested) -> tuple[Any, Result, list[int], int]:
    """Return the trial whose object went the longest way, its result, the rows to replay, and where it set off."""
    best = int(np.argmax([result.metrics.arc_length_mm for result in run.results]))
    trial = run.trials[best]
    rows = list(range(0, len(trial.time), FRAME_STEPS))
    return trial, run.results[best], rows, trial.onset
