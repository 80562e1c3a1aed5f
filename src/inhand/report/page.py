"""The Markdown page of a run."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, fields

from inhand.evaluation.beside import Beside
from inhand.evaluation.config import AsteriskConfig
from inhand.evaluation.results import Result
from inhand.evaluation.table import failures, shown_columns, table_rows, with_beside
from inhand.evaluation.versions import versions
from inhand.trials.human_trial import HumanTrial


@dataclass(frozen=True)
class Picture:
    """A figure of the page."""

    text: str
    """What it shows."""
    path: str
    """Where it lies, seen from the page."""


def page(
    config: AsteriskConfig,
    results: Sequence[Result],
    people: Sequence[HumanTrial],
    notes: Sequence[str],
    pictures: tuple[Sequence[Picture], Sequence[Picture]],
    *,
    beside: Sequence[Beside] = (),
) -> str:
    """Return the page: what was run, the table, what failed and why, the figures, and how to run it again."""
    lines = [
        f"# Asterisk Test: {results[0].source} on {config.object} with {config.hand}",
        "",
        f"{config.trials} trial(s) for each direction along {config.paths} paths, start noise {config.noise_mm:g} mm"
        f" and {config.noise_deg:g} deg (standard deviations), seed {config.seed}.",
        "",
        "Distance is the progress along the direction up to the first loss of contact, mean ± SD over the trials."
        " Lateral (largest distance from the line, mm), Turn (largest rotation, deg), Contact (share of steps with both"
        " fingers touching) and Gap (longest without, in simulation steps of 4 ms) are the worst trial's; Eff. is the"
        " mean efficiency.",
        "",
        *_table(*with_beside(*shown_columns(table_rows(results, people)), beside)),
        "",
        *_failed(results),
        *_human(people),
        *[f"* {note}" for note in notes],
        "",
        "## Figures",
        "",
        *_shown(pictures[0]),
        "## First trial of every direction",
        "",
        *_shown(pictures[1]),
        *_again(config),
    ]
    return "\n".join(lines)


def command(config: AsteriskConfig) -> str:
    """Return the command line that repeats a run, quoted for a shell."""
    words = ["inhand", "asterisk"]
    for field in fields(config):
        value = getattr(config, field.name)
        option = "--" + field.name.replace("_", "-")
        if isinstance(value, bool):
            words += [option] if value else []
        elif isinstance(value, tuple):
            words += [option, *map(str, value)] if value else []
        elif value is not None:
            words += [option, str(value)]
    return shlex.join(words)


def _again(config: AsteriskConfig) -> list[str]:
    found = ", ".join(f"{name} {version}" for name, version in versions().items())
    return ["## Run it again", "", f"    {command(config)}", "", f"Versions: {found}.", ""]


def _table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    shown = [header, tuple("---" for _ in header), *rows]
    return ["| " + " | ".join(row) + " |" for row in shown]


def _failed(results: Sequence[Result]) -> list[str]:
    sentences = failures(results)
    if not sentences:
        return ["Every trial kept the object to the end of its path or of the grip's reach.", ""]
    return ["## What failed", "", *[f"* {sentence}" for sentence in sentences], ""]


def _human(people: Sequence[HumanTrial]) -> list[str]:
    if not people:
        return []
    units = sorted({trial.unit for trial in people})
    return [
        f"People: {len(people)} recorded trials ({'; '.join(units)}). Their x and y are written in the moving object's"
        " frame: distances along a direction compare well (about 3 mm), lateral ones do not (up to 14 mm).",
        "",
    ]


def _shown(pictures: Sequence[Picture]) -> list[str]:
    lines = []
    for picture in pictures:
        lines += [f"![{picture.text}]({picture.path})", "", f"*{picture.text}*", ""]
    return lines
