"""Every file, link, name and picture that README.md and docs/ speak of is there."""

import re
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
FOLDERS = ("src", "tests", "examples", "benchmarks", "studies", "docs")
FILES = [path.relative_to(ROOT).as_posix() for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]
TEXTS = [(ROOT / path).read_text(encoding="utf-8") for path in FILES if path != "tests/test_docs.py"]
SETTINGS = [path.read_text(encoding="utf-8") for path in (ROOT / "pyproject.toml", *(ROOT / "examples").glob("*.toml"))]
WORDS = set(re.findall(r"\w+", "\n".join([*TEXTS, *FILES, *SETTINGS])))
YOURS = {"my_file.py", "carry.py", "FILE.py"}
"""Files of the reader."""


def spans(text: str) -> set[str]:
    """Return what stands between single back-ticks, blocks of code left out."""
    return set(re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)))


def missing_files(text: str) -> list[str]:
    """Return the Python files named in a text, by the end of their path, that are nowhere in the project."""
    named = {name for span in spans(text) for name in re.findall(r"[\w./-]+\.py\b", span)}
    return sorted(name for name in named - YOURS if not any(f"/{path}".endswith(f"/{name}") for path in FILES))


def missing_names(text: str) -> list[str]:
    """Return the names `inhand.a.b` of a text that cannot be reached."""
    named = {found[0] for span in spans(text) if (found := re.match(r"inhand(\.[A-Za-z_]\w*)+", span))}
    return sorted(name for name in named if not reached(name))


def reached(name: str) -> bool:
    """Tell whether a dotted name is a module of the package or lies in one."""
    first, *rest = name.split(".")
    here: object = import_module(first)
    for number, word in enumerate(rest, start=1):
        try:
            here = getattr(here, word)
        except AttributeError:
            if not isinstance(here, ModuleType):
                return False
            try:
                here = import_module(".".join([first, *rest[:number]]))
            except ModuleNotFoundError:
                return False
    return True


def missing_words(text: str) -> list[str]:
    """Return the names of code in a text (`snake_case`, `CamelCase`, `called()`) that no file of ours has."""
    code = {span for span in spans(text) if re.fullmatch(r"[A-Za-z_][\w.]*(\(.*\))?", span)}
    words = {word for span in code for word in span.partition("(")[0].split(".")}
    looks_like_code = re.compile(r"\w*[a-z]_[a-z]\w*|_\w+|[A-Z]\w*[a-z]\w*[A-Z]\w*")
    return sorted(word for word in words - WORDS if looks_like_code.fullmatch(word))


def broken_links(page: Path) -> list[str]:
    """Return the links of a page to files that are not there, or to headings that their page has not."""
    found = []
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        name, _, heading = link.partition("#")
        target = page.parent / name if name else page
        if "://" not in link and (not target.exists() or (heading and heading not in headings(target))):
            found.append(link)
    return found


def headings(page: Path) -> set[str]:
    """Return the headings of a page as GitHub writes them in links."""
    lines = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", line.lower()).replace(" ", "-") for line in lines}


def test_what_is_not_there_is_found(tmp_path: Path) -> None:
    text = "`sim/engine.py`, `gone.py`, `inhand.load`, `inhand.lost(1)`, `control_step`, `lost_step`, `LostStep`"
    assert missing_files(text) == ["gone.py"]
    assert missing_names(text + " `inhand.hands.hand` `inhand.hands.foot`") == ["inhand.hands.foot", "inhand.lost"]
    assert missing_words(text) == ["LostStep", "lost_step"]
    page = tmp_path / "page.md"
    page.write_text("# One `x`, two\n[a](page.md#one-x-two) [b](page.md#three) [c](lost.md) [d](https://x.org)\n")
    assert broken_links(page) == ["page.md#three", "lost.md"]


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_what_a_page_speaks_of_is_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert not missing_files(text)
    assert not missing_names(text)
    assert not missing_words(text)
    assert not broken_links(page)


def test_docstrings_name_pages_that_are_there() -> None:
    named = {name for text in TEXTS for name in re.findall(r"docs/[\w-]+\.md", text)}
    assert "docs/thesis.md" in named
    assert not [name for name in named if not (ROOT / name).exists()]


def test_the_changelog_has_each_entry_once_and_lines_of_one_width() -> None:
    """Merging two branches' entries line by line doubles what one of them has moved or wrapped anew."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    entries = [entry[:40] for entry in re.findall(r"^- (.*)$", text, re.MULTILINE)]
    assert sorted(set(entries)) == sorted(entries)
    assert not [line for line in text.splitlines() if len(line) > 120]
