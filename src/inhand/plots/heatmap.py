"""Heat map: one number for each pair of a row and a column, written into its cell, failures named below it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.plots.sheet import sheet
from inhand.plots.style import INK, RULE, TICK_POINTS

CELL_IN, NOTE_IN, BAR_IN = (0.66, 0.42), 0.13, 0.16
"""Width and height of a cell, height of a second and further line of its notes, and width of the colour bar [in]."""
NOTE_POINTS = 7.0
WHOLE = 10.0
"""Where the scale goes up to this or more, numbers are shown without digits after the point."""
COLOURS = "viridis"
"""Even steps of lightness from dark to light, readable without seeing colour."""


@dataclass(frozen=True, eq=False)
class HeatMap:
    """Numbers of R rows and C columns.

    Raises:
        InputError: no cell, or values or notes of another shape.
    """

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    values: Array
    """One number per cell `(R, C)`, drawn from 0 to `top`; NaN where there is none."""
    notes: Sequence[Sequence[str]]
    """Short lines per cell (R lists of C), such as its spread and what failed there, or an empty text."""
    top: float = 1.0
    """The number of the brightest colour; numbers have two digits after the point, none where it is 10 or more."""

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
    """Return a heat map with its colour bar, beside which the text `scale` stands."""
    lines = max(note.count("\n") + 1 for row in heat.notes for note in row)
    height = max((CELL_IN[1] + NOTE_IN * (lines - 1)) * len(heat.rows), 1.2)
    sizes = (CELL_IN[0] * len(heat.columns), height), (BAR_IN, height)
    with sheet([sizes], title, subtitle, gap=(0.2, 0.0)) as (figure, (ax, bar)):
        _draw_cells(ax, heat, lines)
        figure.colorbar(ScalarMappable(Normalize(0.0, heat.top), COLOURS), bar, label=scale)
        for spine in (*ax.spines.values(), *bar.spines.values()):
            spine.set_visible(False)
    return figure


def _draw_cells(ax: Axes, heat: HeatMap, most: int) -> None:
    """Draw every cell with its number and at most so many lines of notes; one without a number is hatched."""
    rows, columns = len(heat.rows), len(heat.columns)
    for i, j in np.ndindex(rows, columns):
        value, note = float(heat.values[i, j]), heat.notes[i][j]
        known = np.isfinite(value)
        colour = colormaps[COLOURS](float(np.clip(value / heat.top, 0.0, 1.0))) if known else "white"
        cell = Rectangle((j, i), 1, 1, facecolor=colour, edgecolor="white" if known else RULE, linewidth=1.2)
        ax.add_patch(cell).set_hatch("" if known else "////")
        lines = [(f"{value:z.{0 if heat.top >= WHOLE else 2}f}", TICK_POINTS)] if known else []
        lines += [(line, NOTE_POINTS) for line in note.split("\n") if line]
        box = None if known else {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
        for number, (text, size) in enumerate(lines, start=1):
            place = i + 0.5 + (number - (len(lines) + 1) / 2) / (most + 2)
            written = ax.text(j + 0.5, place, text, ha="center", va="center", bbox=box)
            written.set(fontsize=size, color=_ink_on(colour))
    ax.grid(visible=False)
    ax.set(xlim=(0, columns), ylim=(rows, 0))
    ax.set_xticks(np.arange(columns) + 0.5, heat.columns, rotation=45, ha="left", rotation_mode="anchor")
    ax.set_yticks(np.arange(rows) + 0.5, heat.rows)
    ax.tick_params(pad=3, labelcolor=INK, top=True, labeltop=True, labelbottom=False)


def _ink_on(colour: str | tuple[float, float, float, float]) -> str:
    """Return white on dark and ink on light colours (luma of ITU-R BT.601)."""
    return "white" if np.dot(to_rgb(colour), (0.299, 0.587, 0.114)) < 0.5 else INK
