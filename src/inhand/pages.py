"""Parts that the Markdown pages of all runs share."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from inhand.versions import versions

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

NOTHING = "-"
"""A cell without a value."""
NO_VERDICT = "A simulation that diverged says nothing about the hand: lower its stiffness, torque or physics step."
"""Follows a sentence about trials of which one diverged."""


@dataclass(frozen=True)
class Picture:
    """A figure of the page."""

    text: str
    """What it shows."""
    path: str
    """Where it lies, seen from the page."""


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


def again_lines(words: str) -> list[str]:
    """Return how a page's run is repeated, and the versions that it ran on."""
    found = ", ".join(f"{name} {version}" for name, version in versions().items())
    return ["## Run it again", "", f"    {words}", "", f"Versions: {found}.", ""]


def listed_lines(title: str, sentences: Sequence[str]) -> list[str]:
    """Return sentences as a part of the page with a title; nothing without any."""
    return [f"## {title}", "", *[f"* {sentence}" for sentence in sentences], ""] if sentences else []


def table_lines(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return a table as Markdown."""
    shown = [header, tuple("---" for _ in header), *rows]
    return ["| " + " | ".join(row) + " |" for row in shown]


def picture_lines(pictures: Sequence[Picture]) -> list[str]:
    """Return pictures, each with its text below it, as Markdown."""
    lines = []
    for picture in pictures:
        lines += [f"![{picture.text}]({picture.path})", "", f"*{picture.text}*", ""]
    return lines
