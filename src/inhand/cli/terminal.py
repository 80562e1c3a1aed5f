"""What the commands print."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

PIPED_WIDTH = 160
"""Columns of a table that is written to a file or a pipe."""


def print_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]], numbers: int = 1) -> None:
    """Print a table; columns from index `numbers` on are aligned to the right."""
    table = Table(title=title, title_justify="left")
    for i, name in enumerate(header):
        table.add_column(Text(name), justify="right" if i >= numbers else "left", no_wrap=i == 0, overflow="fold")
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    console = Console()
    if not console.is_terminal:
        console = Console(width=PIPED_WIDTH)
    console.print(table)


def say(text: str) -> None:
    """Print one line without markup or wrapping."""
    Console(soft_wrap=True).print(text, markup=False, highlight=False)


@contextmanager
def trials_shown(total: int) -> Iterator[Callable[[str, int, int], None]]:
    """Give what a simulation of trials tells its phase, the trials still running and its step, and show them."""
    with Progress(
        SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), transient=True
    ) as bar:
        row = bar.add_task("searching contacts", total=total)

        def show(phase: str, running: int, step: int) -> None:
            bar.update(row, description=f"{phase}, step {step}, {running} trials running", completed=total - running)

        yield show
