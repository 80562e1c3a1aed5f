"""How Sphinx makes the site: `make docs`. Pages are Markdown that a code host shows as well."""

import sys
from pathlib import Path

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

autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_numpy_docstring = False

html_theme = "furo"
html_title = "inhand"
html_static_path = ["static"]
html_css_files = ["wide.css"]
html_show_copyright = False
copybutton_prompt_text = "$ "

PLACE = "<!-- made from the code -->"
"""Where a page has what is made from the code."""


def fill(_: Sphinx, name: str, source: list[str]) -> None:
    """Put in what is made from the code, and behind the first page the side bar."""
    from from_code import api, commands, contents, environments

    pages = {"api": api.page, "command-line": commands.page, "environments": environments.page}
    if name in pages:
        source[0] = source[0].replace(PLACE, pages[name]())
    if name == "index":
        source[0] += "\n" + contents.side_bar(source[0])


def setup(app: Sphinx) -> None:
    """Have pages filled when they are read."""
    sys.path.insert(0, str(Path(__file__).parent))
    app.connect("source-read", fill)
