"""The sheet that every figure is drawn on: its size, its heading, its legends, and matplotlib's settings for it.

The settings hold while a sheet is made, so that a program that imports `inhand` keeps its own.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal, TypeAlias

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.text import Text
from matplotlib.transforms import ScaledTranslation

from inhand.errors import InputError
from inhand.plots.paper import COLUMN_POINTS, MARGIN_IN, MM_PER_IN, paper
from inhand.plots.style import GRID, INK, LABEL_POINTS, MUTED, RULE, TICK_POINTS, TITLE_POINTS

Size: TypeAlias = tuple[float, float]
"""Width and height of axes [in]."""
Box: TypeAlias = tuple[float, float, float, float]
"""Left, bottom, width and height of axes [in]."""
DPI = 100
"""Resolution that a sheet is laid out with [dots/in]; files have their own."""
PAD_IN, LINE_IN, LEGEND_GAP_IN = 0.15, 0.24, 0.13
"""Free space around all that a sheet shows, height of a line of its heading, and space above a legend [in]."""
ROUNDS, LEAST_SCALE = 6, 0.4
"""How often axes are fitted into a column, and the least of their own size that they are drawn in."""

STYLE: dict[Any, Any] = {
    "figure.facecolor": "white",
    "figure.autolayout": False,
    "figure.constrained_layout.use": False,
    "font.size": TICK_POINTS,
    "text.color": INK,
    "lines.solid_capstyle": "round",
    "lines.dashed_pattern": (4.0, 3.0),
    "axes.facecolor": "white",
    "axes.edgecolor": RULE,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "axes.labelsize": LABEL_POINTS,
    "axes.labelcolor": INK,
    "axes.titlesize": LABEL_POINTS,
    "axes.titlecolor": INK,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "legend.fontsize": TICK_POINTS,
    "legend.handlelength": 1.7,
    "legend.handletextpad": 0.6,
    "legend.columnspacing": 1.5,
    "legend.labelspacing": 0.45,
    "legend.borderaxespad": 0.0,
    "legend.borderpad": 0.0,
    **{f"{axis}.labelsize": TICK_POINTS for axis in ("xtick", "ytick")},
    **{f"{axis}.labelcolor": MUTED for axis in ("xtick", "ytick")},
    **{f"{axis}.major.pad": 4.0 for axis in ("xtick", "ytick")},
    **{f"{axis}.{kind}.size": 0.0 for axis in ("xtick", "ytick") for kind in ("major", "minor")},
}
"""matplotlib's settings for every figure."""


def halo(points: float = 2.6) -> list[AbstractPathEffect]:
    """Return a white rim of that width [pt], so that what lies below does not cross a text or a line."""
    return [withStroke(linewidth=points, foreground="white")]


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure of that size [in]; nothing opens a window."""
    figure = Figure(figsize=(width_in, height_in), dpi=DPI)
    FigureCanvasAgg(figure)
    return figure


@contextmanager
def sheet(
    rows: Sequence[Sequence[Size]],
    title: str = "",
    subtitle: str = "",
    *,
    gap: Size = (0.3, 0.65),
    beside: Sequence[Artist] = (),
    below: Sequence[Sequence[Artist]] = (),
    projection: Literal["polar"] | None = None,
    again: Figure | None = None,
) -> Iterator[tuple[Figure, list[Axes]]]:
    """Give a white figure and its axes to draw on; at the end it becomes as large as all that was drawn needs.

    Args:
        rows: size of each axes [in], row by row from the top, each row from the left.
        title: first line of the heading.
        subtitle: its second line, smaller.
        gap: free space between axes, across and down [in].
        beside: entries of a legend at the right of the first row.
        below: entries of legends below all axes, one legend for each list that holds any.
        projection: of the axes.
        again: a sheet of the same rows that is done with, to draw on anew: axes and ticks are what costs most.
    """
    if paper().width_in is not None:
        again = None  # its texts have a column's size already
    with mpl.rc_context(STYLE):
        boxes = _boxes(rows, gap)
        figure = new_figure(1.0, 1.0) if again is None else again
        figure.set_size_inches(1.0, 1.0)  # so that fractions of the figure are inches until it is fitted
        fresh = [] if again else [figure.add_axes(box, projection=projection) for box in boxes]
        axes = fresh or _emptied(figure, boxes)
        yield figure, axes
        if paper().width_in is not None:
            _fit_column(figure, rows, gap, [beside, *below])
            return
        if beside:
            anchor = axes[len(rows[0]) - 1].transAxes + ScaledTranslation(0.12, 0.0, figure.dpi_scale_trans)
            figure.legend(handles=list(beside), loc="upper left", bbox_to_anchor=(1, 1), bbox_transform=anchor)
        _fit(figure, boxes, [title, subtitle], below)


def _boxes(rows: Sequence[Sequence[Size]], gap: Size) -> list[Box]:
    """Return where axes of some sizes lie, row by row from the top at 0, each row from the left."""
    boxes: list[Box] = []
    top = 0.0
    for row in rows:
        left, height = 0.0, max(size[1] for size in row)
        for wide, high in row:
            boxes.append((left, top - high, wide, high))
            left += wide + gap[0]
        top -= height + gap[1]
    return boxes


def _emptied(figure: Figure, boxes: Sequence[Box]) -> list[Axes]:
    """Remove all that was drawn on a sheet, and return its axes in their boxes [in]."""
    for ax, (left, bottom, wide, high) in zip(figure.axes, boxes, strict=True):
        for artist in (*ax.lines, *ax.patches, *ax.collections, *ax.texts):
            artist.remove()
        ax.set_position((left, bottom, wide, high))
    for part in (*figure.texts, *figure.legends):
        part.remove()
    return figure.axes


def _fit(
    figure: Figure, boxes: Sequence[Box], heading: Sequence[str], below: Sequence[Sequence[Artist]], pad: float = PAD_IN
) -> None:
    """Give a sheet the size that it needs: heading at the top left, what was drawn, legends below."""
    drawn, axes = figure.get_tightbbox(), figure.axes[: len(boxes)]
    looks: tuple[dict[str, Any], ...] = ({"fontsize": TITLE_POINTS, "fontweight": "bold"}, {"color": MUTED})
    lines = [figure.text(0, 0, text, va="top", **look) for text, look in zip(heading, looks, strict=False) if text]
    inner, bottom, legends = max([drawn.width, *(_inches(line)[0] for line in lines)]), pad, []
    for handles in reversed([handles for handles in below if handles]):
        legends.append((_legend(figure, handles, inner), bottom))
        bottom += _inches(legends[-1][0])[1] + LEGEND_GAP_IN
    width, height = inner + 2 * pad, bottom + drawn.height + LINE_IN * len(lines) + 1.4 * pad
    figure.set_size_inches(width, height)
    for ax, (left, low, wide, high) in zip(axes, boxes, strict=True):
        place = left - drawn.x0 + pad, low - drawn.y0 + bottom
        ax.set_position((place[0] / width, place[1] / height, wide / width, high / height))
    for number, line in enumerate(lines):
        line.set_position((pad / width, 1 - (pad + LINE_IN * number) / height))
    for legend, low in legends:
        legend.set_bbox_to_anchor(((pad + drawn.width / 2) / width, low / height), figure.transFigure)


def _fit_column(figure: Figure, rows: Sequence[Sequence[Size]], gap: Size, below: Sequence[Sequence[Artist]]) -> None:
    """Give a sheet a column's width: smaller texts, no heading, legends below, rows broken where they do not fit."""
    width, scale = paper().width_in or 0.0, COLUMN_POINTS / TICK_POINTS
    ticks = {label for ax in figure.axes for axis in (ax.xaxis, ax.yaxis) for label in axis.get_ticklabels()}
    for text in figure.findobj(Text):
        if isinstance(text, Text) and text not in ticks:
            text.set_fontsize(scale * float(text.get_fontsize()))
    for ax in figure.axes:
        ax.tick_params(labelsize=COLUMN_POINTS)
    for across in range(max(map(len, rows)), 0, -1):
        broken = [row[first : first + across] for row in rows for first in range(0, len(row), across)]
        spaces = gap[0] * scale, max(gap) * scale if len(broken) > len(rows) else gap[1]
        boxes, factor = _narrowed(figure, broken, spaces, width - 2 * MARGIN_IN)
        if factor >= LEAST_SCALE:
            break
    else:
        _place(figure, broken, spaces, LEAST_SCALE)
        least = np.ceil(MM_PER_IN * (figure.get_tightbbox().width + 2 * MARGIN_IN)) + 1
        raise InputError(f"a figure has no room in {MM_PER_IN * width:.0f} mm: give --width-mm {least:.0f} or more")
    with mpl.rc_context({"legend.fontsize": COLUMN_POINTS, "legend.columnspacing": 1.0}):
        _fit(figure, boxes, (), below, MARGIN_IN)


def _narrowed(figure: Figure, rows: Sequence[Sequence[Size]], gap: Size, width: float) -> tuple[list[Box], float]:
    """Put axes where all that is drawn has a width [in]; return their boxes and which part of their size they have."""
    widest, factor = max(sum(size[0] for size in row) for row in rows), 1.0
    for _ in range(ROUNDS):  # texts take what they take, so that what is left for axes is found by trying
        boxes = _place(figure, rows, gap, factor)
        texts = figure.get_tightbbox().width - factor * widest
        factor = max((width - texts) / widest, 0.1)
    return boxes, factor


def _place(figure: Figure, rows: Sequence[Sequence[Size]], gap: Size, factor: float) -> list[Box]:
    """Put axes where they lie with a part of their size, and return their boxes."""
    boxes = _boxes([[(factor * wide, factor * high) for wide, high in row] for row in rows], gap)
    for ax, box in zip(figure.axes, boxes, strict=False):
        ax.set_position(box)
    return boxes


def _legend(figure: Figure, handles: Sequence[Artist], width_in: float) -> Legend:
    """Return a legend in as few even rows as a width [in] allows."""
    for rows in range(1, len(handles) + 1):
        legend = figure.legend(handles=list(handles), loc="lower center", ncols=-(-len(handles) // rows))
        if _inches(legend)[0] <= width_in or rows == len(handles):
            break
        legend.remove()
    return legend


def _inches(artist: Text | Legend) -> tuple[float, float]:
    """Return width and height of an artist [in]."""
    box = artist.get_window_extent()
    return box.width / DPI, box.height / DPI


def write_above(ax: Axes, title: str, subtitle: str) -> None:
    """Write a heading of two lines above axes, at the left."""
    bold = {"fontweight": "bold", "fontsize": LABEL_POINTS}
    for text, points_up, look in ((title, 19, bold), (subtitle, 6, {"color": MUTED})):
        ax.annotate(text, (0.0, 1.0), (0, points_up), xycoords="axes fraction", textcoords="offset points", **look)
