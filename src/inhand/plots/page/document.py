"""The page for a browser as one text: parts as HTML, views as data, style and scripts inside, no links out."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.resources import files
from typing import NewType, TypeAlias

from inhand.pages import Again, Listed, Part, Picture, Table
from inhand.plots.page.views import View
from inhand.records import compact, table_of

Html = NewType("Html", str)
"""Text that is markup; every other text is escaped on its way into the page."""
SCRIPTS = ("dom", "theme", "tables", "motion", "solid", "stage", "chart", "grids", "asterisk", "maps", "player", "main")
"""The modules of the page in an order in which each comes after what it imports."""
LONG = 34
"""A cell of more characters is broken into lines."""
MANY = 12
"""A list of more sentences stands in several columns where there is room."""
NUMBER = re.compile(r"[+\-\u2212]?[\d.]|-(,|$)|\u2013$")
"""How a cell begins that is aligned to the right: with a number, or with a dash for nothing."""


@dataclass(frozen=True)
class Settings:
    """What was asked for: names and values."""

    values: Mapping[str, object]
    title: str = "Configuration"


WebPart: TypeAlias = Part | View | Settings
"""A part of a page for a browser."""


def html_of(kind: str, parts: Sequence[WebPart]) -> str:
    """Return a page.

    Args:
        kind: what kind of run it is of, a few words.
        parts: from top to bottom, the title first. Pictures are left out: views take their place.
    """
    title, *rest = [part for part in parts if part and not isinstance(part, Picture)]
    head = str(title).removeprefix("# ")
    sections, places = _sections(rest)
    script, style = _script(), Html(_file("page.css"))
    policy = f"default-src 'none'; script-src '{_digest(script)}'; style-src '{_digest(style)}'; img-src data:"
    links = Html("".join(f'<li><a href="#{name}">{escape(text)}</a></li>' for name, text in places))
    return Html(
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(head)}</title>\n<style>{style}</style>\n</head>\n<body>\n"
        '<a class="skip" href="#main">To the content</a>\n'
        f'<header class="top"><div class="wrap"><span class="brand">inhand</span><nav aria-label="Sections"><ul>{links}'
        '</ul></nav><button type="button" id="theme" hidden></button></div></header>\n'
        f'<main class="wrap" id="main">\n<h1>{escape(head)}</h1>\n{sections}</main>\n'
        f'<footer class="wrap">{escape(kind)}; made by inhand. Nothing on this page comes from a network.</footer>\n'
        f'<script type="module">{script}</script>\n</body>\n</html>\n'
    )


def _sections(parts: Iterable[WebPart]) -> tuple[Html, list[tuple[str, str]]]:
    """Return parts as sections, one for each title, and the places of the titles with their texts."""
    sections: list[list[str]] = [[]]
    places: list[tuple[str, str]] = []
    for number, part in enumerate(parts):
        title = _title(part)
        if title:
            place = f"part-{len(places) + 1}"
            places.append((place, title.replace("`", "")))
            sections.append([f'<h2 id="{place}">{_inline(title)}</h2>'])
        sections[-1].append(_html(part, number))
    intro, *titled = ("\n".join(filter(None, section)) for section in sections)
    whole = [f'<section class="intro">\n{intro}\n</section>\n'] if intro else []
    whole += [f'<section aria-labelledby="part-{k}">\n{each}\n</section>\n' for k, each in enumerate(titled, start=1)]
    return Html("".join(whole)), places


def _title(part: WebPart) -> str:
    match part:
        case str():
            return part.removeprefix("## ") if part.startswith("## ") else ""
        case Again():
            return "Run it again"
        case Picture():
            return ""
        case _:
            return part.title


def _html(part: WebPart, number: int) -> Html:
    match part:
        case Table():
            found = _table(part)
        case Listed():
            found = _list(part)
        case Again(words, versions):
            found = Html(f"<pre><code>{escape(words)}</code></pre>\n{_folded('Versions', dict(versions))}")
        case View():
            found = _view(part, f"view-{number}")
        case Settings(values):
            found = _folded("All settings", values)
        case str() if not part.startswith("## "):
            found = Html(f"<p>{_inline(part)}</p>")
        case _:
            found = Html("")
    return found


def _list(part: Listed) -> Html:
    items = "".join(f"<li>{_inline(sentence)}</li>" for sentence in part.sentences)
    many = ' class="many"' if len(part.sentences) > MANY else ""
    return Html(f"<ul{many}>{items}</ul>") if items else Html(f"<p>{_inline(part.none)}</p>")


def _view(view: View, name: str) -> Html:
    data = compact(view.content).replace("<", "\\u003c")  # no text may end the script that holds it
    above = f"<p>{_inline(view.told)}</p>\n" if view.told else ""
    return Html(
        f'{above}<div class="view" data-view="{view.kind}" data-content="{name}"></div>\n'
        f'<script type="application/json" id="{name}">{data}</script>\n'
        "<noscript><p>This part needs JavaScript, which is in the page itself.</p></noscript>"
    )


def _table(table: Table) -> Html:
    columns = list(zip(*table.rows, strict=True)) or [()] * len(table.header)
    text = [not all(NUMBER.match(cell) for cell in column if cell) for column in columns]

    def cell(tag: str, content: str, column: int) -> str:
        names = ["text"] * text[column] + ["long"] * (tag == "td" and len(content) > LONG)
        marked = f' class="{" ".join(names)}"' if names else ""
        scope = ' scope="col"' if tag == "th" else ""
        return f"<{tag}{scope}{marked}>{_inline(content)}</{tag}>"

    def row(tag: str, cells: Sequence[str]) -> str:
        return f"<tr>{''.join(cell(tag, content, k) for k, content in enumerate(cells))}</tr>"

    body = "\n".join(row("td", cells) for cells in table.rows)
    name = escape(table.title or "Results")
    return Html(
        f'<div class="table" role="region" aria-label="{name}" tabindex="0"><table>\n<thead>{row("th", table.header)}'
        f"</thead>\n<tbody>\n{body}\n</tbody></table></div>"
    )


def _folded(title: str, values: Mapping[str, object]) -> Html:
    pairs = "".join(f"<dt>{escape(name)}</dt><dd>{escape(_value(value))}</dd>" for name, value in _leaves(values))
    return Html(f"<details><summary>{escape(title)}</summary><dl>{pairs}</dl></details>")


def _leaves(values: Mapping[str, object], before: str = "") -> list[tuple[str, object]]:
    """Return a tree of settings as one level."""
    found: list[tuple[str, object]] = []
    for name, value in values.items():
        found += _leaves(value, f"{before}{name}.") if isinstance(value, dict) else [(before + name, value)]
    return found


def _value(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_value, value)) or "none"
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "none"}[value]
    return str(value)


def _inline(text: str) -> Html:
    """Return a text with what stands between back-ticks as code."""
    parts = escape(text).split("`")
    if len(parts) % 2 == 0:
        return Html(escape(text))
    return Html("".join(f"<code>{part}</code>" if k % 2 else part for k, part in enumerate(parts)))


@cache
def _script() -> Html:
    """Return all scripts as one module: what they import from each other stands above them."""
    whole = "\n".join(_file(f"script/{name}.js") for name in SCRIPTS)
    without = re.sub(r'^import \{[^}]*\} from "\./\w+\.js";\n', "", whole, flags=re.MULTILINE)
    return Html(re.sub(r"^export ", "", without, flags=re.MULTILINE))


@cache
def _file(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    """Return what a browser compares an inline script or style with."""
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


def settings_of(config: object) -> Settings:
    """Return a configuration as a part of a page."""
    return Settings(table_of(config))
