"""Asterisks side by side on one scale with one legend: people, IK, learned (thesis figures 4.1 and 4.3)."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure

from inhand.errors import InputError
from inhand.plots.asterisk import direction_handles, draw_asterisk, key_handles
from inhand.plots.curves import PathCurve, curves_extent, target_length
from inhand.plots.shapes import SceneOutline, joined, size_of
from inhand.plots.sheet import sheet, write_above

MOST_PANELS = 4
PANEL_WIDTH_IN = 3.25


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
    extent = joined([curves_extent(panel.curves, panel.outline, target_mm) for panel in panels])
    outline = next((panel.outline for panel in panels if panel.outline is not None), None)
    rows = [[size_of(extent, PANEL_WIDTH_IN)] * len(panels)]
    keys = direction_handles(every), key_handles(every, outline)
    with sheet(rows, title, below=keys) as (figure, axes):
        for ax, panel in zip(axes, panels, strict=True):
            draw_asterisk(ax, panel.curves, outline=panel.outline, extent_mm=extent, target_mm=target_mm)
            write_above(ax, panel.title, panel.subtitle)
        for ax in axes[1:]:
            ax.set_ylabel("")
            ax.tick_params(labelleft=False)
    return figure
