"""What the pages of all runs are made of, and the Markdown page; `plots/page/` makes the one for a browser."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, TypeAlias

from inhand.versions import versions

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

NOTHING = "-"
"""A cell without a value."""
NO_VERDICT = "A simulation that diverged says nothing about the hand: lower its stiffness, torque or physics step."
"""Follows a sentence about trials of which one diverged."""


def spread(mean: float, sd: float = math.nan, digits: int = 1) -> str:
    """Return a mean with its standard deviation, where several trials give one; a dash where nothing is known."""
    if not math.isfinite(mean):
        return NOTHING
    return f"{mean:z.{digits}f}" + (f" ± {sd:.{digits}f}" if math.isfinite(sd) else "")


def counted(count: int, noun: str) -> str:
    """Return how many there are of something: 1 trial, 2 trials."""
    return f"{count} {noun}" + "s" * (count != 1)


def options(config: DataclassInstance, without: Collection[str] = ()) -> list[str]:
    """Return the words of a command line that give a configuration's settings, without some of them."""
    words: list[str] = []
    for field in fields(config):
        value, option = getattr(config, field.name), "--" + field.name.replace("_", "-")
        if field.name in without:
            continue
        if isinstance(value, bool):
            words += [option] if value else []
        elif isinstance(value, tuple):
            words += [option, *map(str, value)] if value else []
        elif value is not None:
            words += [option, str(value)]
    return words


@dataclass(frozen=True)
class Table:
    """A table of texts."""

    title: str
    """Stands above it; may be empty."""
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Listed:
    """Sentences as a list; without any the text for none, and nothing at all where there is none."""

    sentences: tuple[str, ...]
    title: str = ""
    none: str = ""

    def __bool__(self) -> bool:
        """Return whether it says anything."""
        return bool(self.sentences or self.none)


@dataclass(frozen=True)
class Picture:
    """A picture that lies at a path, seen from the page."""

    text: str
    """What it shows."""
    path: str


@dataclass(frozen=True)
class Again:
    """How a page's run is repeated."""

    words: str
    """The command line."""
    versions: tuple[tuple[str, str], ...]
    """Names and versions of what it ran on."""


Part: TypeAlias = str | Table | Listed | Picture | Again
"""A part of a page. A text is a paragraph; one that begins with `# ` is the page's title, with `## ` a heading."""


def page_of(*parts: Part) -> str:
    """Return a page in Markdown; an empty line stands between two parts, and those that say nothing are left out."""
    return "\n\n".join(_markdown(part) for part in parts if part) + "\n"


def _markdown(part: Part) -> str:
    match part:
        case Table(title, header, rows):
            cells = [[cell.replace("|", "\\|") for cell in row] for row in (header, ["---"] * len(header), *rows)]
            return _below(title, "\n".join("| " + " | ".join(row) + " |" for row in cells))
        case Listed(sentences, title, none):
            return _below(title, "\n".join(f"* {sentence}" for sentence in sentences) or none)
        case Picture(text, path):
            return f"![{text}]({path})\n\n*{text}*"
        case Again(words, found):
            told = ", ".join(f"{name} {version}" for name, version in found)
            return f"## Run it again\n\n    {words}\n\nVersions: {told}."
        case _:
            return part


def _below(title: str, told: str) -> str:
    return f"## {title}\n\n{told}" if title else told


def again(words: str) -> Again:
    """Return how a page's run is repeated, and the versions that it ran on."""
    return Again(words, tuple(versions().items()))


def listed(sentences: Iterable[str], title: str = "", none: str = "") -> Listed:
    """Return sentences as a list, below a title; without any the text for none."""
    return Listed(tuple(sentences), title, none)


def table_of(header: Sequence[str], rows: Iterable[Sequence[str]], title: str = "") -> Table:
    """Return a table below a title."""
    return Table(title, tuple(header), tuple(map(tuple, rows)))
