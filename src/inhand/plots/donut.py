"""Rotation only: a donut of the angle reached each way, one ring for each series."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Wedge

from inhand.geometry import Array, unit
from inhand.plots.sheet import halo, sheet
from inhand.plots.style import INK, LABEL_POINTS, MUTED, RULE, series_look

DONUT_IN = 4.0
"""Width of the axes [in]."""
OUTER, INNER = 1.0, 0.42
"""Radii of the donut, as shares of its outer one."""
EDGE = 1.28
"""Half the width of the axes in the same unit: room for the angles around."""
TICKS_DEG = (-150, -120, -90, -60, -30, 0, 30, 60, 90, 120, 150, 180)

Spread: TypeAlias = tuple[float, float]
"""Smallest and largest angle of several trials [deg]."""


@dataclass(frozen=True)
class DonutSeries:
    """How far one controller, or one group of people, turned the object each way."""

    name: str
    """What the legend says."""
    clockwise_deg: float
    """Angle reached clockwise [deg, positive]; NaN where there is no trial."""
    counter_clockwise_deg: float
    """Angle reached counter-clockwise [deg, positive]; NaN where there is no trial."""
    clockwise_range_deg: Spread | None = None
    """Smallest and largest of the trials clockwise [deg], drawn as a thin arc."""
    counter_clockwise_range_deg: Spread | None = None
    """The same counter-clockwise [deg]."""
    limits_deg: Spread | None = None
    """How far the hand could turn it, clockwise and counter-clockwise [deg], drawn as ticks; None where unknown."""


def donut_figure(series: Sequence[DonutSeries], title: str = "", subtitle: str = "") -> Figure:
    """Return a donut of reached angles [deg]: 0 at the top, clockwise to the right, the first series outermost.

    No series at all leaves the scale alone.
    """
    keys: list[Artist] = [Patch(facecolor=series_look(i).colour, label=one.name) for i, one in enumerate(series)]
    if any(one.clockwise_range_deg or one.counter_clockwise_range_deg for one in series):
        keys.append(Line2D([], [], color=INK, linewidth=1.2, label="smallest to largest"))
    if any(one.limits_deg is not None for one in series):
        keys.append(Line2D([], [], color=MUTED, linestyle="none", marker="|", markersize=8, label="reach limit"))
    with sheet([[(DONUT_IN, DONUT_IN)]], title, subtitle, below=[keys]) as (figure, (ax,)):
        draw_donut(ax, series)
    return figure


def draw_donut(ax: Axes, series: Sequence[DonutSeries]) -> None:
    """Draw the donut on plain axes: equal, without ticks, the unit its outer radius."""
    ax.set(xlim=(-EDGE, EDGE), ylim=(-EDGE, EDGE), aspect="equal")
    ax.set_axis_off()
    width = (OUTER - INNER) / max(len(series), 1)
    ax.add_patch(Wedge((0, 0), OUTER, 0, 360, width=OUTER - INNER, facecolor="#f4f5f7", edgecolor=RULE, linewidth=0.8))
    _draw_scale(ax)
    for number, one in enumerate(series):
        outer, colour = OUTER - number * width, series_look(number).colour
        radii = (outer - width, outer)
        _draw_side(ax, radii, -1, one.clockwise_deg, one.clockwise_range_deg, colour=colour)
        _draw_side(ax, radii, 1, one.counter_clockwise_deg, one.counter_clockwise_range_deg, colour=colour)
        for sign, limit in zip((-1, 1), one.limits_deg or (), strict=False):
            tick = np.stack([_polar(radius, sign * limit) for radius in radii])
            ax.plot(*tick.T, color=MUTED, linewidth=1.4, zorder=3.5)
    ax.plot([0, 0], [INNER, OUTER + 0.05], color=INK, linewidth=1.2, zorder=4.0)
    ax.text(-EDGE, EDGE - 0.04, "↶ counter-clockwise", ha="left", va="top", color=MUTED)
    ax.text(EDGE, EDGE - 0.04, "clockwise ↷", ha="right", va="top", color=MUTED)


def _polar(radius: float, angle_deg: float | Array) -> Array:
    """Return points `(..., 2)` at angles [deg] counter-clockwise from the top."""
    return radius * unit(np.deg2rad(np.asarray(angle_deg) + 90.0))


def _draw_scale(ax: Axes) -> None:
    """Draw a light spoke and its angle every 30 deg, without a sign: the side says which way."""
    for angle in TICKS_DEG:
        spoke = np.stack([_polar(INNER, angle), _polar(OUTER, angle)])
        ax.plot(*spoke.T, color="white" if angle else INK, linewidth=0.9, zorder=1.5)
        x, y = _polar(OUTER + 0.13, angle)
        ax.text(x, y, f"{abs(angle)}°", ha="center", va="center", color=MUTED)


def _draw_side(
    ax: Axes, radii: tuple[float, float], sign: int, angle_deg: float, spread: Spread | None, *, colour: str
) -> None:
    """Draw one way of one ring: the piece from the top to the reached angle, its spread, and the angle beyond."""
    middle = sum(radii) / 2
    end = 0.0
    if np.isfinite(angle_deg):
        end = angle_deg
        ends = sorted((90.0, 90.0 + sign * angle_deg))
        piece = Wedge((0, 0), radii[1], ends[0], ends[1], width=radii[1] - radii[0], zorder=2.0)
        piece.set(facecolor=colour, alpha=0.9, edgecolor="white", linewidth=1.0)
        ax.add_patch(piece)
    if spread is not None:
        end = max(end, spread[1])
        arc = _polar(middle, sign * np.linspace(spread[0], spread[1], 40))
        ax.plot(*arc.T, color=INK, linewidth=1.2, solid_capstyle="butt", path_effects=halo(), zorder=3.0)
    text = f"{angle_deg:.0f}°" if np.isfinite(angle_deg) else "none"
    x, y = _polar(middle, sign * (end + np.rad2deg(0.045 * len(text) / middle)))
    ax.text(x, y, text, ha="center", va="center", fontsize=LABEL_POINTS, color=INK, zorder=5.0)
