"""The picture of a comparison: how much of every task each kind of controller completes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from inhand.plots.style import (
    INK,
    LABEL_POINTS,
    MUTED,
    TICK_POINTS,
    axes_box,
    dress_axes,
    heading_height,
    new_figure,
    series_look,
    write_heading,
)

ROW_IN, PANEL_IN, GAP_IN, LEFT_IN = 0.3, 1.35, 0.8, 1.75
"""Height of a row, width of a task's panel, the gap between two and the room for names [in]."""
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
    height = ROW_IN * len(names)
    width = LEFT_IN + len(tasks) * (PANEL_IN + GAP_IN)
    figure = new_figure(width, 0.95 + height + heading_height(title, subtitle) + 0.25)
    kinds = list(dict.fromkeys(name.partition(",")[0] for name in names))
    for column, task in enumerate(tasks):
        left = LEFT_IN + column * (PANEL_IN + GAP_IN)
        ax = figure.add_axes(axes_box(figure, (left, 0.85, PANEL_IN, height)))
        dress_axes(ax)
        ax.grid(visible=False, axis="y")
        ax.set(xlim=(0, 100), ylim=(len(names) - 0.5, -0.5), xticks=[0, 50, 100])
        ax.set_title(task, fontsize=LABEL_POINTS, color=INK, pad=6, loc="left")
        ax.set_yticks(range(len(names)), names if column == 0 else [""] * len(names))
        ax.tick_params(axis="y", labelcolor=INK)
        for row, name in enumerate(names):
            _draw(ax, row, bars[name, task], series_look(kinds.index(name.partition(",")[0])).colour)
    write_heading(figure, title, subtitle)
    full = figure.get_size_inches()[1]
    note = "Completion [%], mean over seeds and episodes; line: 95 % bootstrap interval; shaded: trained on this task"
    figure.text(0.2 / width, 0.28 / full, note, fontsize=TICK_POINTS - 0.5, color=MUTED)
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
