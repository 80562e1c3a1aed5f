"""Asterisks side by side on one scale with one legend: people, IK, learned (thesis figures 4.1 and 4.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inhand.errors import InputError
from inhand.plots.asterisk import add_legend, direction_handles, draw_asterisk, key_handles
from inhand.plots.curves import PathCurve, curves_extent, target_length
from inhand.plots.shapes import Extent, SceneOutline
from inhand.plots.style import (
    INK,
    LABEL_POINTS,
    MUTED,
    TICK_POINTS,
    axes_box,
    heading_height,
    new_figure,
    write_heading,
)

MOST_PANELS = 4
PANEL_WIDTH_IN = 3.25
PANEL_GAP_IN = 0.3
LEGEND_ENTRY_IN = 1.3
LEGEND_ROW_IN = 0.2


@dataclass(frozen=True, eq=False)
class Panel:
    """One asterisk of several."""

    title: str
    """Who moved the object."""
    subtitle: str
    """How many trials, or what else a reader must know."""
    curves: tuple[PathCurve, ...]
    """One per direction; may be empty."""
    outline: SceneOutline | None = None
    """The hand and the object at the start."""


def panels_figure(panels: Sequence[Panel], title: str = "") -> Figure:
    """Return one to four asterisks in a row, drawn to the same scale, with one legend below.

    Args:
        panels: From left to right.
        title: Written above all.

    Raises:
        InputError: there is no panel or there are more than four.
    """
    if not 1 <= len(panels) <= MOST_PANELS:
        raise InputError(f"{len(panels)} panels given: a figure holds 1 to {MOST_PANELS}; split them over more figures")
    every = [curve for panel in panels for curve in panel.curves]
    target_mm = target_length(every)
    extent = _common_extent(panels, target_mm)
    height = PANEL_WIDTH_IN * (extent[3] - extent[2]) / (extent[1] - extent[0])
    width = 0.85 + len(panels) * PANEL_WIDTH_IN + (len(panels) - 1) * PANEL_GAP_IN
    outline = next((panel.outline for panel in panels if panel.outline is not None), None)
    groups = [direction_handles(every), key_handles(every, outline)]
    below = 0.75 + LEGEND_ROW_IN * sum(_rows(group, width) for group in groups)
    figure = new_figure(width, below + height + 0.5 + heading_height(title, ""))
    for number, panel in enumerate(panels):
        left = 0.68 + number * (PANEL_WIDTH_IN + PANEL_GAP_IN)
        ax = figure.add_axes(axes_box(figure, (left, below, PANEL_WIDTH_IN, height)))
        draw_asterisk(ax, panel.curves, outline=panel.outline, extent_mm=extent, target_mm=target_mm)
        if number:
            ax.set_ylabel("")
            ax.tick_params(labelleft=False)
        _write_above(ax, panel)
    write_heading(figure, title)
    _add_legends(figure, groups)
    return figure


def _common_extent(panels: Sequence[Panel], target_mm: float) -> Extent:
    """Return the smallest extent [mm] that shows every panel whole."""
    each = np.array([curves_extent(panel.curves, panel.outline, target_mm) for panel in panels])
    left, right, bottom, top = each[:, 0].min(), each[:, 1].max(), each[:, 2].min(), each[:, 3].max()
    return float(left), float(right), float(bottom), float(top)


def _write_above(ax: Axes, panel: Panel) -> None:
    """Write the two lines of a panel above its axes."""
    lines = [
        ax.annotate(text, (0.0, 1.0), (0, points_up), xycoords="axes fraction", textcoords="offset points")
        for text, points_up in ((panel.title, 20), (panel.subtitle, 7))
    ]
    lines[0].set(fontsize=LABEL_POINTS, color=INK, fontweight="bold")
    lines[1].set(fontsize=TICK_POINTS, color=MUTED)


def _columns(group: Sequence[Artist], width_in: float) -> int:
    """Return a number of columns that fits the figure and fills the rows evenly."""
    return int(np.ceil(len(group) / max(_rows(group, width_in), 1)))


def _rows(group: Sequence[Artist], width_in: float) -> int:
    """Return the number of rows a group of entries takes below a figure of that width [in]."""
    return int(np.ceil(len(group) / max(int((width_in - 0.4) / LEGEND_ENTRY_IN), 1)))


def _add_legends(figure: Figure, groups: Sequence[Sequence[Artist]]) -> None:
    """Write the groups of legend entries below each other at the bottom of the figure."""
    width, height = figure.get_size_inches()
    above = 0.12
    for group in reversed(groups):
        rows = _rows(group, width)
        add_legend(figure, group, (0.5, above / height), columns=_columns(group, width), loc="lower center")
        above += LEGEND_ROW_IN * rows + 0.06
