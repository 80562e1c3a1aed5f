"""Estimates with their intervals: as curves over a strength, and as a list of one line each."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.plots.sheet import sheet, write_above
from inhand.plots.style import INK, MUTED, series_look

PANEL_IN = (3.3, 2.3)
"""Width and height of a panel of curves [in]."""
LIST_IN, LINE_IN = 2.1, 0.24
"""Width of a panel of a list, and height of one of its lines [in]."""


@dataclass(frozen=True, eq=False)
class Estimates:
    """Estimates of one series, with the ends of their intervals.

    Raises:
        InputError: they are not as many as each other.
    """

    name: str
    middle: Array
    """What is estimated `(N,)`; NaN where nothing is known."""
    low: Array
    """Where the intervals begin `(N,)`"""
    high: Array
    """and end."""
    note: str = ""
    """What a reader should know of the series."""

    def __post_init__(self) -> None:
        """Check the sizes once, where they are made."""
        if not np.shape(self.middle) == np.shape(self.low) == np.shape(self.high):
            raise InputError(f"series {self.name!r}: give each estimate both ends of its interval")


@dataclass(frozen=True, eq=False)
class Panel:
    """A panel of curves."""

    label: str
    """What its axis says."""
    series: Sequence[Estimates]
    top: float
    """The least that the axis shows; it begins at 0."""


def curves_figure(at: Array, panels: Sequence[Panel], axis: str, title: str = "", subtitle: str = "") -> Figure:
    """Return panels side by side of curves over `at` `(N,)`, called `axis`, with their intervals as bands."""
    looks = [series_look(number) for number in range(len(panels[0].series))]
    keys = [
        Line2D([], [], color=look.colour, linestyle=look.dashes, marker=look.marker, markersize=4.5, label=each.name)
        for look, each in zip(looks, panels[0].series, strict=True)
    ]
    with sheet([[PANEL_IN] * len(panels)], title, subtitle, gap=(0.75, 0.0), below=[keys]) as (figure, axes):
        for ax, panel in zip(axes, panels, strict=True):
            for look, each in zip(looks, panel.series, strict=True):
                ax.fill_between(at, each.low, each.high, color=look.colour, alpha=0.16, linewidth=0, zorder=2.0)
                (line,) = ax.plot(at, each.middle, color=look.colour, linestyle=look.dashes, linewidth=1.6, zorder=3.0)
                line.set(marker=look.marker, markersize=4.5, markeredgecolor="white", markeredgewidth=0.6)
            highest = max([panel.top, *(float(np.nanmax(each.high, initial=0.0)) for each in panel.series)])
            ax.set(xlabel=axis, ylabel=panel.label, xlim=(0.0, at[-1]), ylim=(0.0, 1.04 * highest))
    return figure


def list_figure(
    names: Sequence[str], panels: Sequence[Estimates], axis: str, title: str = "", subtitle: str = ""
) -> Figure:
    """Return panels side by side in which each name has a line with its estimate and interval; 0 in the middle."""
    size = LIST_IN, LINE_IN * len(names)
    widest = max(float(np.nanmax(np.abs([each.low, each.high]), initial=0.1)) for each in panels)
    with sheet([[size] * len(panels)], title, subtitle, gap=(0.25, 0.0)) as (figure, axes):
        for number, (ax, each) in enumerate(zip(axes, panels, strict=True)):
            colour, lines = series_look(number).colour, np.arange(len(names))
            clear = (each.low > 0) | (each.high < 0)
            ax.axvline(0.0, color=MUTED, linewidth=0.9, zorder=1.5)
            ax.hlines(lines, each.low, each.high, color=colour, linewidth=1.6, zorder=2.0)
            faces = np.where(clear, colour, "white").tolist()
            ax.scatter(each.middle, lines, s=26, zorder=3.0, edgecolors=colour, facecolors=faces)
            ax.set(xlim=(-1.08 * widest, 1.08 * widest), ylim=(len(names) - 0.5, -0.5), xlabel=axis)
            ax.set_yticks(lines, names if number == 0 else [""] * len(names))
            ax.tick_params(axis="y", labelcolor=INK)
            write_above(ax, each.name, each.note)
    return figure
