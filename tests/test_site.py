"""The documentation's site: every page in its contents, every public name, option and environment in its references.

`make docs` builds it, where a warning is an error.
"""

import re
from dataclasses import fields
from pathlib import Path

import pytest

import inhand
from from_code import api, commands, contents
from inhand.cli.commands import COMMANDS
from inhand.environment_ids import IDS
from inhand.tasks.layouts import LAYOUTS

DOCS = Path(__file__).resolve().parents[1] / "docs"


def test_the_contents_have_every_page_once() -> None:
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    listed = [page for pages in contents.sections(text).values() for page in pages]
    pages = sorted(path.stem for path in DOCS.glob("*.md") if path.stem != "index")
    assert sorted(listed) == pages, "docs/index.md lists every page once, as `* [What it is](page.md)` below a heading"
    assert contents.side_bar("## A\n\n* [One](one.md): words\n\n## B\n\nnothing\n") == (
        "```{toctree}\n:hidden:\n:caption: A\n\none\n```"
    )


@pytest.mark.parametrize("page", ["api", "command-line", "environments"])
def test_pages_that_are_made_from_the_code_have_a_place_for_it(page: str) -> None:
    text = (DOCS / "conf.py").read_text(encoding="utf-8")
    (place,) = re.findall(r'^PLACE = "(.*)"$', text, re.MULTILINE)
    assert f'"{page}"' in text
    assert place in (DOCS / f"{page}.md").read_text(encoding="utf-8").splitlines()


def test_the_reference_of_the_commands_has_every_option() -> None:
    page = commands.page()
    for name, kind in COMMANDS.items():
        section = page.partition(f"\n## {name}\n")[2].partition("\n## ")[0]
        told = set(re.findall(r"`--([\w-]+)", section))
        positional = section.count("| `") - section.count("| `--")
        missing = {field.name.replace("_", "-") for field in fields(kind)} - told
        assert len(missing) == positional, (name, missing)
    assert "| `--twist FLOAT` | Twist to hold in translations [deg]" in page
    assert "`--quiet" in page.partition("\n## ")[0]


def test_the_reference_of_the_api_has_every_public_name() -> None:
    page = api.page()
    named = re.findall(r"^\.\. auto\w+:: (\S+)$", page, re.MULTILINE)
    assert len(set(named)) == len(named)
    assert {f"inhand.{name}" for name in inhand.__all__ if name != "register"} <= set(named)
    assert "inhand.register.controller" in named
    assert ".. autoexception:: inhand.InputError\n" in page
    assert ".. autoclass:: inhand.asterisk_test.report.Run\n" in page


def test_the_reference_of_the_environments_has_all_that_can_be_asked_for() -> None:
    pytest.importorskip("gymnasium", reason="environments need the extra `rl`")
    from from_code import environments

    page = environments.page()
    assert all(f"`{name}`" in page for name in (*IDS, *LAYOUTS, "gain", "fine", "nearest_mm"))
    assert "| 4 to 6 | object size l, b, h [m] | 0.06 | 0.06 |" in page
    assert "| `horizon` | `250` | Decisions after which" in page  # of a configuration that it inherits from
    assert "| `stop` | `False` | Whether the object is to stay" in page
