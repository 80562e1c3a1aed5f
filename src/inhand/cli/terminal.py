"""What the commands print."""

import logging
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from typing import Literal

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

WORD, AROUND = 12, 3
"""A word of a heading that is longer may be broken; what a column takes beside its text."""
PIPED_WIDTH = 160
"""Columns of a table that is written to a file or a pipe."""


def print_table(
    title: str, header: Sequence[str], rows: Sequence[Sequence[str]], numbers: int = 1, spare: Sequence[str] = ()
) -> None:
    """Print a table; columns from index `numbers` on are aligned to the right.

    Where it is too wide for the terminal, columns in `spare` are left out, the first first, and named below.
    """
    console = Console()
    if not console.is_terminal:
        console = Console(width=PIPED_WIDTH)
    columns = dict(enumerate(zip(header, *rows, strict=True)))
    left_out: list[str] = []
    for name in spare:
        if name in header and _width(columns.values(), broken=True) > console.width:
            del columns[header.index(name)]
            left_out.append(name)
    squeezed = spare and _width(columns.values()) > console.width
    table = Table(title=title, title_justify="left")
    for i, column in columns.items():
        side: Literal["left", "right"] = "right" if i >= numbers else "left"
        width = _width([column], broken=True) - AROUND - 1 if squeezed else None
        table.add_column(Text(header[i]), justify=side, no_wrap=i == 0, overflow="fold", width=width)
    for row in rows:
        table.add_row(*(Text(row[i]) for i in columns))
    console.print(table)
    if left_out:
        say(f"Left out, for want of width: {', '.join(left_out)} (the report has them)")


def _width(columns: Collection[Sequence[str]], *, broken: bool = False) -> int:
    """Return what columns take, a heading and its cells each; a heading may be broken, at spaces or when it is long."""
    headings = ([min(len(word), WORD) for word in name.split()] if broken else [len(name)] for name, *_ in columns)
    cells = ([len(cell) for cell in column[1:]] for column in columns)
    return 1 + sum(AROUND + max(*heading, *column, 0) for heading, column in zip(headings, cells, strict=True))


def say(text: str) -> None:
    """Print one line without markup or wrapping."""
    Console(soft_wrap=True).print(text, markup=False, highlight=False, emoji=False)


class Screen:
    """What a command shows while it runs: a bar, a table below lines that stay; lines alone where nobody watches."""

    def __init__(self, *, spoken: bool, over_s: float) -> None:
        """Show nothing yet; `progress` has the arguments."""
        self._bar = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[more]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            speed_estimate_period=over_s,
        )
        self._row = self._bar.add_task("preparing", total=None, more="")
        self.live = Live(self._bar, transient=True)
        self._spoken = spoken

    @property
    def watched(self) -> bool:
        """Whether somebody watches."""
        return self.live.console.is_terminal

    def __call__(self, what: str, done: int, total: int, more: str = "", *, silent: bool = False) -> None:
        """Show what is being done, how far it is, and how far it has to go (0: nobody knows).

        Args:
            what: is being done.
            done: how far it is.
            total: how far it has to go.
            more: stands behind the bar in the place of both numbers.
            silent: no line of its own where nobody watches.
        """
        if (total or None) != self._bar.tasks[self._row].total:
            self._bar.reset(self._row, total=total or None)
        counts = f"{done} of {total}" if total else ""
        self._bar.update(self._row, description=what, completed=done, more=more or counts)
        if self._spoken and not silent and not self.watched:
            say(f"{what}: {counts}")

    def line(self, text: str, below: Table) -> None:
        """Write a line that stays, and show a table below it where somebody watches."""
        if self.watched:
            self.live.console.print(text, markup=False, highlight=False, soft_wrap=True)
            self.live.update(Group(below, self._bar))
        else:
            say(text)


class InBar(logging.Handler):
    """Shows in a screen's bar what the package logs."""

    def __init__(self, screen: Screen) -> None:
        """Show it in a screen."""
        super().__init__()
        self._screen = screen

    def emit(self, record: logging.LogRecord) -> None:
        """Show what is told until something else is; what has no room in the bar also stays above it."""
        text = record.getMessage()
        self._screen(text, 0, 0)
        if len(text) > self._screen.live.console.width:
            self._screen.live.console.print(text, markup=False, highlight=False, soft_wrap=True)


@contextmanager
def progress(*, spoken: bool = False, over_s: float = 600.0) -> Iterator[Screen]:
    """Give what a command shows while it runs; it is gone at the end.

    Args:
        spoken: whether each part is a line of its own where nobody watches.
        over_s: the time left is told from what was done in this time [s].
    """
    screen = Screen(spoken=spoken, over_s=over_s)
    with _told_by(screen) if screen.watched else nullcontext():
        yield screen


@contextmanager
def _told_by(screen: Screen) -> Iterator[None]:
    """Show a screen, and in its bar what the package logs meanwhile, such as what is compiled or planned."""
    logger, handler = logging.getLogger("inhand"), InBar(screen)
    level = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        with screen.live:
            yield
    finally:
        logger.setLevel(level)
        logger.removeHandler(handler)


@contextmanager
def trials_shown(total: int) -> Iterator[Callable[[str, int, int], None]]:
    """Give what a simulation of trials tells its phase, the trials still running and its step, and show them."""
    with progress() as tell:
        yield lambda phase, running, step: tell(f"{phase}, step {step}, trials done:", total - running, total)
