"""Parts that the Markdown pages of all runs share."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING

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


def page_of(*parts: str) -> str:
    """Return a page from its parts; an empty line stands between two, and those without a text are left out."""
    return "\n\n".join(part for part in parts if part) + "\n"


def again(words: str) -> str:
    """Return how a page's run is repeated, and the versions that it ran on."""
    found = ", ".join(f"{name} {version}" for name, version in versions().items())
    return f"## Run it again\n\n    {words}\n\nVersions: {found}."


def listed(sentences: Sequence[str], title: str = "", none: str = "") -> str:
    """Return sentences as a list, below a title; without any the text for none, and no title where there is none."""
    told = "\n".join(f"* {sentence}" for sentence in sentences) or none
    return f"## {title}\n\n{told}" if title and told else told


def table_of(header: Sequence[str], rows: Sequence[Sequence[str]], title: str = "") -> str:
    """Return a table below a title; bars in its cells do not end them."""
    cells = [[cell.replace("|", "\\|") for cell in row] for row in (header, ["---"] * len(header), *rows)]
    table = "\n".join("| " + " | ".join(row) + " |" for row in cells)
    return f"## {title}\n\n{table}" if title else table


def pictured(text: str, path: str) -> str:
    """Return a picture that lies at a path, seen from the page, with what it shows below it."""
    return f"![{text}]({path})\n\n*{text}*"
