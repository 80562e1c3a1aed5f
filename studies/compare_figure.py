"""The picture of a comparison: how much of every task each kind of controller completes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from inhand.plots.sheet import sheet
from inhand.plots.style import INK, MUTED, TICK_POINTS, series_look

ROW_IN, PANEL_IN, GAP_IN = 0.3, 1.35, 0.8
"""Height of a row, width of a task's panel, and the gap between two [in]."""
NOTE = "Completion [%], mean over seeds and episodes; line: 95 % bootstrap interval; shaded: trained on this task"
SHOWN = 0.005
"""Share of losses that is not rounded to nothing."""


@dataclass(frozen=True)
class Bar:
    """One controller on one task."""

    mean: float
    """Mean completion, 0 to 1."""
    low: float
    """Where its 95 % interval begins"""
    high: float
    """and ends."""
    dropped: float
    """Share of the episodes that lost the object."""
    trained: bool
    """Whether the controller was trained on the task."""


def compare_figure(
    names: Sequence[str], tasks: Sequence[str], bars: dict[tuple[str, str], Bar], title: str = "", subtitle: str = ""
) -> Figure:
    """Return a figure with a panel for each task and a row for each controller: completion, its interval, drops.

    Args:
        names: controllers, from top to bottom.
        tasks: tasks, from left to right.
        bars: what each controller did on each task, by name and task.
        title: First line.
        subtitle: Second line, smaller.
    """
    kinds = list(dict.fromkeys(name.partition(",")[0] for name in names))
    rows = [[(PANEL_IN, ROW_IN * len(names))] * len(tasks)]
    with sheet(rows, title, subtitle, gap=(GAP_IN, 0.0)) as (figure, axes):
        for task, ax in zip(tasks, axes, strict=True):
            ax.grid(visible=False, axis="y")
            ax.set(xlim=(0, 100), ylim=(len(names) - 0.5, -0.5), xticks=[0, 50, 100])
            ax.set_title(task, fontweight="normal")
            ax.set_yticks(range(len(names)), names if ax is axes[0] else [""] * len(names))
            ax.tick_params(axis="y", labelcolor=INK)
            for row, name in enumerate(names):
                _draw(ax, row, bars[name, task], series_look(kinds.index(name.partition(",")[0])).colour)
        note = axes[0].annotate(NOTE, (0, 0), (-100, -38), xycoords="axes fraction", textcoords="offset points")
        note.set(fontsize=TICK_POINTS - 0.5, color=MUTED)
    return figure


def _draw(ax: Axes, row: int, bar: Bar, colour: str) -> None:
    """Draw one controller's bar, its interval, and what was lost."""
    if bar.trained:
        ax.add_patch(Rectangle((0, row - 0.46), 100, 0.92, facecolor="#eef3f8", edgecolor="none", zorder=0.5))
    ax.barh(row, 100 * bar.mean, height=0.5, color=colour, alpha=0.85, zorder=2)
    ax.plot(100 * np.array([bar.low, bar.high]), [row, row], color=INK, linewidth=1.2, zorder=3)
    if bar.dropped > 0:
        text = f"{100 * bar.dropped:.0f} % lost" if bar.dropped >= SHOWN else "< 1 % lost"
        ax.text(103.0, row, text, fontsize=TICK_POINTS - 1.0, color=MUTED, va="center", clip_on=False)
