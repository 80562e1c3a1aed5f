"""What figures are drawn for: our own pages, or a column of a paper.

As matplotlib's own settings are, it is what a block of code is run with, so that every figure that the block draws, by
whatever function, comes out so.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

MM_PER_IN = 25.4
COLUMN_POINTS = 7.0
"""Size of ticks' texts in a column, where pages have 9 [pt]."""
MARGIN_IN = 0.05
"""Free space around what a figure in a column shows [in]."""


@dataclass(frozen=True)
class Paper:
    """What figures are drawn for."""

    suffix: str = ".png"
    """.png, .pdf or .svg."""
    width_in: float | None = None
    """Width of a column [in], for figures of exactly that width, with smaller texts, and without headings, since papers
    have captions; None for pages, on which a figure is as large as it needs."""


PAGE = Paper()
_PAPER: ContextVar[Paper | None] = ContextVar("paper", default=None)


def paper() -> Paper:
    """Return what figures are drawn for."""
    return _PAPER.get() or PAGE


@contextmanager
def drawn_for(wanted: Paper) -> Iterator[None]:
    """Let the figures of a block be drawn for a paper."""
    before = _PAPER.set(wanted)
    try:
        yield
    finally:
        _PAPER.reset(before)
