"""What a command ends with: told to a reader on the terminal, or to a program as JSON."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

from inhand.cli.commands import Printing
from inhand.cli.terminal import print_table, say
from inhand.records import text_of
from inhand.shown import Shown


@dataclass(frozen=True)
class Listing:
    """A table to print, as `print_table` takes it."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: int = 1
    spare: Sequence[str] = ()


@dataclass(frozen=True)
class Answer:
    """What a command ends with."""

    tables: tuple[Listing, ...] = ()
    sentences: tuple[str, ...] = ()
    """What follows the tables, a line each."""
    entries: Callable[[], object] = list
    """Gives the rows of its numbers, for a program."""
    out: Path | None = None
    """The folder or the file that it wrote."""
    failed: bool = False
    """Whether the command ends with the exit code 1: it has done its work, and found a fault."""


def of_run(run: Shown, out: Path, tables: Sequence[Listing], sentences: Sequence[str]) -> Answer:
    """Return the answer of a run with a table of numbers."""
    return Answer(tuple(tables), tuple(sentences), lambda: run.table().to_dict("records"), out)


@contextmanager
def working(printing: Printing) -> Iterator[None]:
    """Send what a command prints while it works where its options say: as JSON goes to stdout, to stderr."""
    with redirect_stdout(StringIO() if printing.quiet else sys.stderr) if _apart(printing) else nullcontext():
        yield


def _apart(printing: Printing) -> bool:
    return printing.quiet or printing.json


def tell(command: str, answer: Answer, printing: Printing) -> None:
    """Print what a command ends with."""
    if printing.json:
        told = {"command": command, "out": answer.out, "table": answer.entries(), "told": answer.sentences}
        sys.stdout.write(text_of(told))
    elif not printing.quiet:
        for table in answer.tables:
            print_table(table.title, table.header, table.rows, table.numbers, table.spare)
        for sentence in answer.sentences:
            say(sentence)
