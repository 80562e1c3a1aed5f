"""Radar of distance and of efficiency per direction, several series in one, laid out like the compass."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from inhand.errors import InputError
from inhand.geometry import Array, unit
from inhand.plots.sheet import halo, sheet
from inhand.plots.style import MUTED, TICK_POINTS, darker, direction_colour, series_look

RADAR_IN = 2.75
"""Diameter of one radar [in]."""


@dataclass(frozen=True, eq=False)
class RadarSeries:
    """One controller, or one group of people, over every direction."""

    name: str
    """What the legend says."""
    distance_mm: Array
    """Distance `(D,)` along each direction [mm]; NaN where there is no trial."""
    efficiency: Array
    """Distance over arc length `(D,)` [-]; NaN where there is no trial."""


def radar_figure(directions: Sequence[tuple[str, float]], series: Sequence[RadarSeries], title: str = "") -> Figure:
    """Return two radars, distance [mm] and efficiency [-], with Out at the top.

    Args:
        directions: Thesis name and angle [deg, counter-clockwise from +x] of each of the D directions.
        series: What to compare; none at all leaves the two grids empty.
        title: Written above both.

    Raises:
        InputError: a series does not hold one number per direction.
    """
    for one in series:
        _check(one, len(directions))
    looks = [series_look(number) for number in range(len(series))]
    keys = [
        Line2D([], [], color=look.colour, linestyle=look.dashes, marker=look.marker, markersize=4.5, label=one.name)
        for one, look in zip(series, looks, strict=True)
    ]
    rows = [[(RADAR_IN, RADAR_IN)] * 2]
    with sheet(rows, title, below=[keys], gap=(1.9, 0.0), projection="polar") as (figure, (distance, efficiency)):
        draw_radar(distance, directions, [one.distance_mm for one in series], least=10.0)
        draw_radar(efficiency, directions, [one.efficiency for one in series], least=1.0)
        distance.set_title("Distance [mm]", loc="center", pad=28)
        efficiency.set_title("Efficiency", loc="center", pad=28)
    return figure


def draw_radar(ax: Axes, directions: Sequence[tuple[str, float]], rows: Sequence[Array], *, least: float) -> None:
    """Draw one quantity per direction on polar axes, with the names of the directions around.

    Args:
        ax: Polar axes.
        directions: Name and angle [deg] of each of the D directions.
        rows: One row `(D,)` for each series; a NaN leaves a gap.
        least: The scale reaches at least this far; above 0.

    Raises:
        InputError: the axes are not polar.
    """
    if not isinstance(ax, PolarAxes):
        raise InputError("a radar was given straight axes: make them with projection='polar'")
    angles = np.deg2rad([angle for _, angle in directions])
    around = np.argsort(angles % (2 * np.pi), kind="stable")
    closed = np.append(around, around[:1])
    for number, row in enumerate(rows):
        look = series_look(number)
        (line,) = ax.plot(angles[closed], row[closed], color=look.colour, linewidth=1.6, clip_on=False, zorder=3.0)
        line.set(linestyle=look.dashes, marker=look.marker, markersize=4.5)
        line.set(markeredgecolor="white", markeredgewidth=0.6)
        if len(around) > 2 and np.isfinite(row).all():
            ax.fill(angles[around], row[around], color=look.colour, alpha=0.06, linewidth=0, zorder=2.0)
    finite = [float(value) for row in rows for value in row if np.isfinite(value)]
    _dress(ax, directions, max([least, *finite]))


def _dress(ax: PolarAxes, directions: Sequence[tuple[str, float]], farthest: float) -> None:
    """Write the direction names around and a few round numbers along one free spoke."""
    ax.set_rmin(0.0)
    rounds = MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, farthest)
    rings = [float(value) for value in rounds if value > 0.0]
    ax.set_rmax(rings[-1])
    ax.set_yticks(rings, [""] * len(rings))
    angles = [angle for _, angle in directions]
    ax.set_xticks([np.deg2rad(angle % 360.0) for angle in angles], [""] * len(angles))
    for name, angle in directions:
        _write_direction(ax, name, angle)
    beside_out = np.deg2rad(90.0 - min(360.0 / max(len(directions), 1), 45.0) / 2)
    for value in rings:
        number = ax.text(beside_out, value, f"{value:g}", ha="center", va="center", path_effects=halo(), zorder=4.0)
        number.set(fontsize=TICK_POINTS - 1, color=MUTED)


def _write_direction(ax: PolarAxes, name: str, angle_deg: float) -> None:
    """Write a direction's name outside the circle, turned away from it, in the colour of the direction."""
    x, y = unit(np.deg2rad(angle_deg))
    side = "left" if x > 0.2 else "right" if x < -0.2 else "center"
    height = "bottom" if y > 0.6 else "top" if y < -0.6 else "center"
    edge = (np.deg2rad(angle_deg), ax.get_rmax())
    text = ax.annotate(name, edge, (5 * x, 5 * y), textcoords="offset points", ha=side, va=height)
    text.set_color(darker(direction_colour(angle_deg), 0.4))


def _check(series: RadarSeries, count: int) -> None:
    for what, row in (("distance_mm", series.distance_mm), ("efficiency", series.efficiency)):
        if np.shape(row) != (count,):
            raise InputError(
                f"{what} of series {series.name!r} has shape {np.shape(row)} for {count} directions: "
                "give one number per direction, NaN where there is no trial"
            )
