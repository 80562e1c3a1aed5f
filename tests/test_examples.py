"""The Python blocks of README.md and docs/ run as they stand, each page from top to bottom."""

import json
import re
import runpy
from pathlib import Path

import pytest

import inhand

ROOT = Path(__file__).resolve().parents[1]
ELSEWHERE = {"learn_with_sb3.py", "real_hand.py", "simulated_hand.py"}
"""Run by tests of their own: they need another library, or each other."""
EXAMPLES = sorted(path for path in (ROOT / "examples").glob("*.py") if path.name not in ELSEWHERE)
BLOCK = re.compile(r"^```(python[^\n]*)\n(.*?)^```$", flags=re.MULTILINE | re.DOTALL)


@pytest.fixture(autouse=True)
def bare_reports(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw what examples draw themselves alone: reports have tests of their own."""
    monkeypatch.setattr("inhand.asterisk_test.report.Run.pictures", lambda *_: [])
    monkeypatch.setattr("inhand.learning.report.curve_pictures", lambda *_: [])


def blocks(text: str) -> list[tuple[int, str]]:
    """Return line and code of every Python block that is not marked `python no-run`."""
    return [
        (text[: found.start(2)].count("\n") + 1, found[2])
        for found in BLOCK.finditer(text)
        if "no-run" not in found[1].split()
    ]


def test_blocks_are_found_and_marked_ones_left_out() -> None:
    text = "words\n```python\na = 1\n```\n```sh\nls\n```\n```python no-run\nb\n```\n```python\nc\nd\n```\n"
    assert blocks(text) == [(3, "a = 1\n"), (12, "c\nd\n")]


PAGES = [path for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))) if blocks(path.read_text())]


@pytest.mark.parametrize("example", sorted((ROOT / "examples").glob("*.py")), ids=lambda path: path.name)
def test_examples_are_short(example: Path) -> None:
    assert len(example.read_text(encoding="utf-8").splitlines()) <= 40


def test_the_readme_has_an_example() -> None:
    assert ROOT / "README.md" in PAGES


def test_the_notebook_shows_nothing_old_and_asks_for_what_is_there() -> None:
    """It runs in `make release`, by Jupyter."""
    notebook = json.loads((ROOT / "examples" / "first_steps.ipynb").read_text(encoding="utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells)
    code = "\n".join("".join(cell["source"]) for cell in cells)
    compile(code, "first_steps.ipynb", "exec")
    assert {"reach", "asterisk"} <= set(re.findall(r"inhand\.(\w+)\(", code)) <= set(inhand.__all__)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_the_examples_of_a_page_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = blocks(page.read_text(encoding="utf-8"))
    lines: list[str] = []
    for line, code in found:
        # The empty lines make a traceback name the line of the page.
        lines += [""] * (line - 1 - len(lines)) + code.splitlines()
    script = tmp_path / f"{page.stem}.py"
    script.write_text("\n".join(lines) + "\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(script), run_name="__main__")


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_scripts_run_in_an_empty_folder_and_are_short(
    example: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert len(example.read_text(encoding="utf-8").splitlines()) <= 40
    if example.stem == "learn":
        pytest.importorskip("minari", reason="learning needs the extra `rl`: pip install 'inhand[rl]'")
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(example), run_name="__main__")
