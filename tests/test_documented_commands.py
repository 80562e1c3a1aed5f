"""Every command line in README.md and docs/ is one that the commands take: no option that is told can be gone."""

import contextlib
import io
import re
import shlex
from pathlib import Path

import pytest

from inhand.cli.asked import asked
from inhand.cli.commands import COMMANDS
from inhand.errors import InputError

ROOT = Path(__file__).resolve().parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
FENCED = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SPAN = re.compile(r"`(inhand [^`\n]+)`")
LINE = re.compile(r"^ *(?:\$ )?(inhand .*?)(?: +#.*| +\|.*)?$", re.MULTILINE)
CALLED = re.compile(r"\$\((inhand [^)]+)\)")

PAGE = r"""
Say `inhand hands`, `inhand.reach`.

    inhand asterisk --trials 2   # words
    inhand trace \
        --path R | head

```python
inhand = 1
```
```sh
$ inhand reach
eval "$(inhand completion bash)"
```
"""
"""What a page may say."""


def command_lines(text: str) -> list[str]:
    """Return the command lines of a page: in blocks that are indented or fenced, and between back-ticks."""
    shell = [body for kind, body in FENCED.findall(text) if kind in ("", "sh")]
    words = FENCED.sub("", text)
    indented = "\n".join(line for line in words.splitlines() if line.startswith("    "))
    blocks = re.sub(r"\\\n *", "", "\n".join([*shell, indented]))
    return [
        *LINE.findall(blocks),
        *CALLED.findall(blocks),
        *SPAN.findall(re.sub(r"^    .*$", "", words, flags=re.MULTILINE)),
    ]


def fault(line: str) -> str:
    """Return what is wrong with a command line, as the commands tell it; nothing where it can be run."""
    words = shlex.split(line)[1:]
    if words[0] == "help":
        return "" if set(words[1:]) <= set(COMMANDS) else f"{words[1:]} are no commands"
    if words == ["--version"] or (len(words) == 1 and words[0] in COMMANDS):  # a name, which may need arguments
        return ""
    told = io.StringIO()
    try:
        with contextlib.redirect_stderr(told), contextlib.redirect_stdout(told):
            asked(words)
    except InputError as error:
        return str(error)
    except SystemExit as stopped:
        return told.getvalue() if stopped.code else ""
    return ""


def test_command_lines_are_found_and_their_faults() -> None:
    lines = command_lines(PAGE)
    assert sorted(lines) == [
        "inhand asterisk --trials 2",
        "inhand completion bash",
        "inhand hands",
        "inhand reach",
        "inhand trace --path R",
    ]
    assert not any(map(fault, [*lines, "inhand help trace", "inhand --version"]))
    assert "--gone" in fault("inhand asterisk --gone 3")
    assert "--seed" in fault("inhand asterisk --seed one")
    assert "walk" in fault("inhand walk")
    assert "are no commands" in fault("inhand help walk")


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_the_command_lines_of_a_page_are_taken(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    faults = {line: told for line in command_lines(page.read_text(encoding="utf-8")) if (told := fault(line))}
    assert not faults
