"""What a page for a browser holds, read back; and a run whose names are markup."""

import base64
import json
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.report import Run
from inhand.geometry import Array
from inhand.plots.page.packed import Packed

EVIL = "<img src=x onerror=alert(1)>\"'&</script><!-- 🙂 `code`"
"""A name that is markup wherever it is not escaped."""


class Read(HTMLParser):
    """What a browser would make of a page: tags with their attributes, and texts by the tag that holds them."""

    def __init__(self, page: str) -> None:
        """Read a page."""
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[str, str]] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep a tag."""
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        """Keep a text."""
        self.texts.append((self.tags[-1][0] if self.tags else "", data))

    def contents(self) -> dict[str, Any]:
        """Return what each view draws, by its name."""
        names = [attrs["id"] for tag, attrs in self.tags if tag == "script" and "id" in attrs]
        data = [text for tag, text in self.texts if tag == "script" and text.startswith("{")]
        return {str(name): json.loads(text) for name, text in zip(names, data, strict=True)}

    def views(self) -> dict[str, Any]:
        """Return what each view draws, by its kind."""
        contents = self.contents()
        shown = [attrs for _, attrs in self.tags if "data-view" in attrs]
        return {str(attrs["data-view"]): contents[str(attrs["data-content"])] for attrs in shown}


def unpacked(found: dict[str, Any] | Packed) -> Array:
    """Return packed columns as the page's script reads them."""
    entry = vars(found) if isinstance(found, Packed) else found
    counts = np.frombuffer(base64.b64decode(entry["data"]), "<u2").reshape(-1, entry["rows"]).T
    low, step = (np.array(entry[name], dtype=float) for name in ("low", "step"))
    return np.asarray(low + counts * step, dtype=float)


def named(run: Run, name: str) -> Run:
    """Return a run whose hand, object, controller and folder have a name."""
    passport = run.trials[0].passport
    hand, thing = replace(passport.hand, name=name), replace(passport.object, name=name)
    trials = tuple(
        replace(trial, passport=replace(trial.passport, hand=hand, object=thing, controller=name))
        for trial in run.trials
    )
    config = replace(run.config, hand=name, object=name, out=Path(name.replace("/", "")))
    notes, beside = (name,), (Beside(name, trials, run.results, told=name),)
    return replace(run, config=config, trials=trials, notes=notes, beside=beside, label=name)
