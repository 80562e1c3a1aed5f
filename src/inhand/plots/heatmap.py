"""Heat map: one number for each pair of a row and a column, written into its cell, failures named below it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.plots.style import (
    INK,
    LABEL_POINTS,
    MUTED,
    RULE,
    TICK_POINTS,
    axes_box,
    heading_height,
    new_figure,
    write_heading,
)

CELL_IN = (0.66, 0.42)
"""Width and height of a cell [in]."""
CHARACTER_IN = 0.082
"""Width of a character of a row's or column's name [in]."""
BAR_IN = 0.16
"""Width of the colour bar [in]."""
NOTE_POINTS = 7.0
COLOURS = "viridis"
"""Even steps of lightness from dark to light, readable without seeing colour."""


@dataclass(frozen=True, eq=False)
class HeatMap:
    """Numbers of R rows and C columns.

    Raises:
        InputError: no cell, or values or notes of another shape.
    """

    rows: tuple[str, ...]
    """Names of the rows."""
    columns: tuple[str, ...]
    """Names of the columns."""
    values: Array
    """One number per cell `(R, C)`, drawn from 0 to 1; NaN where there is none."""
    notes: Sequence[Sequence[str]]
    """A few letters per cell (R lists of C): what failed there, or an empty text."""

    def __post_init__(self) -> None:
        """Check the shapes once, where the map is made."""
        shape = (len(self.rows), len(self.columns))
        found = np.shape(self.values), (len(self.notes), *{len(row) for row in self.notes})
        if 0 in shape or found != (shape, shape):
            raise InputError(
                f"a heat map of {shape[0]} rows and {shape[1]} columns was given values of shape {found[0]} and notes"
                f" of shape {found[1]}: give one value and one note per cell, at least one cell"
            )


def heatmap_figure(heat: HeatMap, scale: str, title: str = "", subtitle: str = "") -> Figure:
    """Return a heat map with its colour bar.

    Args:
        heat: rows, columns, values from 0 to 1 and notes.
        scale: What the colour bar says.
        title: First line.
        subtitle: Second line, smaller.
    """
    left = 0.3 + CHARACTER_IN * max(map(len, heat.rows))
    above = heading_height(title, subtitle) + 0.35 + 0.72 * CHARACTER_IN * max(map(len, heat.columns))
    width, height = CELL_IN[0] * len(heat.columns), max(CELL_IN[1] * len(heat.rows), 1.2)
    figure = new_figure(max(left + width + 1.0, left + 4.5), height + above + 0.2)
    ax = figure.add_axes(axes_box(figure, (left, 0.2, width, height)))
    _draw_cells(ax, heat)
    bar = figure.add_axes(axes_box(figure, (left + width + 0.2, 0.2, BAR_IN, height)))
    _draw_bar(bar, scale)
    write_heading(figure, title, subtitle)
    return figure


def _draw_cells(ax: Axes, heat: HeatMap) -> None:
    """Draw every cell with its number and note; one without a number is hatched."""
    rows, columns = len(heat.rows), len(heat.columns)
    ax.set_xlim(0, columns)
    ax.set_ylim(rows, 0)
    for i, j in np.ndindex(rows, columns):
        value, note = float(heat.values[i, j]), heat.notes[i][j]
        known = np.isfinite(value)
        colour = colormaps[COLOURS](float(np.clip(value, 0.0, 1.0))) if known else "white"
        cell = Rectangle((j, i), 1, 1, facecolor=colour, edgecolor="white" if known else RULE, linewidth=1.2)
        if not known:
            cell.set_hatch("////")
        ax.add_patch(cell)
        ink = _ink_on(colour)
        if known:
            text = f"{value:z.2f}"
            ax.text(
                j + 0.5, i + (0.36 if note else 0.5), text, ha="center", va="center", fontsize=TICK_POINTS, color=ink
            )
        if note:
            box = None if known else {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
            place = i + (0.75 if known else 0.5)
            ax.text(j + 0.5, place, note, ha="center", va="center", fontsize=NOTE_POINTS, color=ink, bbox=box)
    ax.set_xticks(np.arange(columns) + 0.5, heat.columns, rotation=45, ha="left", rotation_mode="anchor")
    ax.set_yticks(np.arange(rows) + 0.5, heat.rows)
    ax.tick_params(length=0, pad=3, labelsize=TICK_POINTS, labelcolor=INK, top=True, labeltop=True, labelbottom=False)
    for spine in ax.spines.values():
        spine.set_visible(False)


def _draw_bar(ax: Axes, scale: str) -> None:
    """Draw the colours from 0 at the bottom to 1 at the top."""
    ax.imshow(np.linspace(0, 1, 256)[:, None], cmap=COLOURS, aspect="auto", origin="lower", extent=(0, 1, 0, 1))
    ax.set_xticks([])
    ax.yaxis.tick_right()
    ax.yaxis.set_label_position("right")
    ax.tick_params(length=0, pad=3, labelsize=TICK_POINTS, labelcolor=MUTED)
    ax.set_ylabel(scale, fontsize=LABEL_POINTS, color=INK)
    for spine in ax.spines.values():
        spine.set_visible(False)


def _ink_on(colour: str | tuple[float, float, float, float]) -> str:
    """Return white on dark and ink on light colours (luma of ITU-R BT.601)."""
    return "white" if np.dot(to_rgb(colour), (0.299, 0.587, 0.114)) < 0.5 else INK
