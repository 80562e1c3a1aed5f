"""How Sphinx makes the site: `make docs`. Pages are Markdown that a code host shows as well."""

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

from inhand import __version__

project = "inhand"
author = "the authors of inhand"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
exclude_patterns = ["from_code"]
nitpick_ignore_regex = [("py:.*", ".*")]  # docstrings name things in single back-ticks, which are no links
default_role = "code"

myst_heading_anchors = 4
smartquotes = False  # two dashes of an option are not a long one

autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_numpy_docstring = False

html_theme = "furo"
html_title = "inhand"
html_static_path = ["static"]
html_css_files = ["wide.css"]
html_show_copyright = False
copybutton_prompt_text = "$ "

NAMED = re.compile(r"\[([\w-]+\.md)\](\(\1(?:#[^)]*)?\))")
"""A link whose text is the file that it leads to; the site shows the title or the heading instead."""
HIDDEN = "\N{RATIO}"
"""Stands for a colon while napoleon works."""
PLACE = "<!-- made from the code -->"
"""Where a page has what is made from the code."""


def fill(_: Sphinx, name: str, source: list[str]) -> None:
    """Put in titles of links and what is made from the code, and behind the first page the side bar."""
    from from_code import api, commands, contents, environments

    pages = {"api": api.page, "command-line": commands.page, "environments": environments.page}
    source[0] = NAMED.sub(r"[]\2", source[0])
    if name in pages:
        source[0] = source[0].replace(PLACE, pages[name]())
    if name == "index":
        source[0] += "\n" + contents.side_bar(source[0])


def dash(_: Sphinx, page: nodes.document) -> None:
    """Put a dash between an argument and what is said of it."""
    for text in list(page.findall(nodes.Text)):
        if text == " -- ":
            text.parent.replace(text, nodes.Text(" \N{EN DASH} "))


def colons(before: str, after: str) -> Callable[..., None]:
    """Return what changes the colons of what is said of a field, which napoleon would take for the end of a type."""

    def change(_: Sphinx, what: str, *told: Any) -> None:
        if what in {"attribute", "property"}:
            told[-1][:] = [line.replace(before, after) for line in told[-1]]

    return change


def setup(app: Sphinx) -> None:
    """Have pages filled when they are read."""
    sys.path.insert(0, str(Path(__file__).parent))
    app.connect("source-read", fill)
    app.connect("doctree-read", dash)
    app.connect("autodoc-process-docstring", colons(":", HIDDEN), priority=100)
    app.connect("autodoc-process-docstring", colons(HIDDEN, ":"), priority=900)
