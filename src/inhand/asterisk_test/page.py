"""The Markdown page of a run."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.results import Result
from inhand.asterisk_test.table import endings, failures, shown_columns, table_rows, with_beside
from inhand.pages import Picture, again_lines, listed_lines, options, picture_lines, table_lines

COLUMNS = (
    "Distance is the progress along the direction up to the first loss of contact, mean ± SD over the trials."
    " Lateral (largest distance from the line, mm), Off path (the same from a path that is not straight),"
    " Turn (largest rotation, deg), Contact (share of steps with every finger touching), Gap (longest time"
    " without), Force (largest of a finger on the object, N) and Overlap (deepest of a link and the object, mm) are"
    " the worst trial's; Eff. is the mean efficiency. Outcome is the worst, and how many trials had it."
)
"""What the columns of the table hold."""


def page(
    config: AsteriskConfig,
    results: Sequence[Result],
    people: Sequence[HumanTrial],
    notes: Sequence[str],
    pictures: tuple[Sequence[Picture], Sequence[Picture]],
    *,
    subject: str,
    beside: tuple[str, Sequence[Beside]] = ("", ()),
) -> str:
    """Return the page: what was run, the table, what failed and why, the figures, and how to run it again.

    `subject` names controller, object and hand; `beside` is the run's name among those set beside it, and they.
    """
    lines = [
        f"# Asterisk Test: {subject}",
        "",
        f"{config.trials} trial(s) for each direction along {config.paths} paths, start noise {config.noise_mm:g} mm"
        f" and {config.noise_deg:g} deg (standard deviations), seed {config.seed}.",
        "",
        COLUMNS,
        "",
        *table_lines(*with_beside(*shown_columns(table_rows(results, people)), *beside)),
        "",
        *listed_lines("Set beside it", [f"{run.name}: {', '.join(run.settings)}." for run in beside[1]]),
        endings(results),
        "",
        *listed_lines("What failed", failures(results)),
        *people_lines(people),
        *[f"* {note}" for note in notes],
        "",
        "## Figures",
        "",
        *picture_lines(pictures[0]),
        "## First trial of every direction",
        "",
        *picture_lines(pictures[1]),
        *again_lines(command(config)),
    ]
    return "\n".join(lines)


def command(config: AsteriskConfig) -> str:
    """Return the command line that repeats a run, quoted for a shell."""
    return shlex.join(["inhand", "asterisk", *options(config)])


def people_lines(people: Sequence[HumanTrial]) -> list[str]:
    """Return what a reader must know of people's trials."""
    if not people:
        return []
    units = sorted({trial.unit for trial in people})
    return [
        f"People: {len(people)} recorded trials ({'; '.join(units)}). Their x and y are written in the moving object's"
        " frame: distances along a direction compare well (about 3 mm), lateral ones do not (up to 14 mm).",
        "",
    ]
