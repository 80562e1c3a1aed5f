"""The reference of the command line, from what each command's own `--help` says."""

import io
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, redirect_stdout, suppress

from inhand.cli.asked import asked
from inhand.cli.commands import COMMANDS, Printing

COLUMNS = 400
"""Width of the help that is read: no default is broken over two lines."""
LINE = re.compile(r"^  (.*?) *$", re.MULTILINE)
"""What stands in a box of a help that is not written to a terminal."""
ENTRY = re.compile(r"(\S.*?)(?:  +(.*))?$")
ABOUT = re.compile(r"usage: .*?\n\n(.*?)\n\n", re.DOTALL)
COMMON = {f"--{name}" for name in Printing.__dataclass_fields__}
"""Options of all commands, which the page tells once."""


def page() -> str:
    """Return all commands, each with its options in a table."""
    found = {name: help_of(name) for name in COMMANDS}
    common = {what: said for what, said in entries(next(iter(found.values()))).items() if _word(what) in COMMON}
    parts = ["Every command has these options besides its own:", _table(common.items())]
    return "\n\n".join([*parts, *(_command(name, text) for name, text in found.items())])


def help_of(command: str) -> str:
    """Return what `inhand COMMAND --help` prints in a wide terminal."""
    text = io.StringIO()
    with redirect_stdout(text), _wide(), suppress(SystemExit):
        asked([command, "--help"])
    return text.getvalue()


def entries(text: str) -> dict[str, str]:
    """Return what a help says of each argument and option, in its order."""
    found: dict[str, str] = {}
    name = ""
    for line in LINE.findall(text):
        if entry := ENTRY.fullmatch(line):
            name = entry[1]
            found[name] = entry[2] or ""
        elif line.strip():
            found[name] = f"{found[name]} {line.strip()}".strip()
    return found


def _command(name: str, text: str) -> str:
    about = ABOUT.match(text)
    own = {what: said for what, said in entries(text).items() if _word(what) not in COMMON | {"-h"}}
    words = " ".join(["inhand", name, *(what for what in own if not what.startswith("-")), "[OPTIONS]"])
    parts = [f"## {name}", " ".join(about[1].split()) if about else "", f"    {words}"]
    return "\n\n".join([*parts, _table(own.items())] if own else parts)


def _word(what: str) -> str:
    """Return the first word of an option, without what it takes."""
    return what.replace(",", " ").split(maxsplit=1)[0]


def _table(rows: Iterable[tuple[str, str]]) -> str:
    lines = (f"| `{_cell(what)}` | {_cell(said)} |" for what, said in rows)
    return "\n".join(["| Argument or option | What it does |", "|---|---|", *lines])


def _cell(text: str) -> str:
    return text.replace("|", "\\|").removesuffix(" (default: )")


@contextmanager
def _wide() -> Iterator[None]:
    """Have help written for a wide terminal."""
    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = str(COLUMNS)
    try:
        yield
    finally:
        if before is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = before
