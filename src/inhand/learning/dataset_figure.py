"""Where the episodes of a dataset ended."""

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from inhand.geometry import TURN_ARM, Array
from inhand.learning.space import Space, nearest_of
from inhand.pages import counted
from inhand.plots.sheet import sheet
from inhand.plots.spatial_asterisk import AXES, PLANE_IN, PLANES
from inhand.plots.style import INK, direction_colour
from inhand.tasks.spatial.primitives import TURNS

SIDE_IN = 4.2
"""Side of the square axes [in]."""
LOOKS = (("o", 9.0, "end of an episode"), ("x", 22.0, "object lost there"))
"""Marks of episodes that kept the object, and of those that lost it."""


def dataset_figure(angle_deg: Array, distance: Array, lost: NDArray[np.bool_], title: str) -> Figure:
    """Return the figure of where episodes ended, seen from where they began.

    Of each episode that is its direction [deg], the way along it at its end [m], and whether it lost the object `(E,)`.
    """
    angle = np.deg2rad(angle_deg)
    ends = 1e3 * distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    colours = np.array([direction_colour(each) for each in angle_deg])
    with sheet([[(SIDE_IN, SIDE_IN)]], title, _told(lost), below=[_keys()]) as (figure, (ax,)):
        _draw(ax, ends, lost, colours)
        ax.set_aspect("equal", adjustable="datalim")
        ax.set(xlabel="to the right [mm]", ylabel="away from the palm [mm]")
    return figure


def dataset_figure_in_space(space: Space, distance: Array, lost: NDArray[np.bool_], title: str) -> Figure:
    """Return the same of a hand in space: where moves ended in three planes, how far turns came about their axes.

    Colours are by the direction in each plane; a turn stands at the axis that its own is nearest to.
    """
    turns = space.about.any(axis=-1)
    moves, panels = np.flatnonzero(~turns), [(PLANE_IN, PLANE_IN)]
    with sheet([panels * (len(PLANES) + 1)], title, _told(lost), gap=(0.62, 0.85), below=[_keys()]) as (figure, axes):
        for ax, plane in zip(axes, PLANES, strict=False):
            ends = 1e3 * distance[moves, None] * space.along[moves][:, plane]
            colours = [direction_colour(angle) for angle in np.rad2deg(np.arctan2(ends[:, 1], ends[:, 0]))]
            _draw(ax, ends, lost[moves], np.array(colours))
            ax.set_aspect("equal", adjustable="datalim")
            across, up = (AXES[axis][1].lower() for axis in plane)
            ax.set(xlabel=f"{across} [mm]", ylabel=f"{up} [mm]")
        _draw_turns(axes[-1], space, np.rad2deg(distance / TURN_ARM), lost, np.flatnonzero(turns))
    return figure


def _draw_turns(ax: Axes, space: Space, angle_deg: Array, lost: NDArray[np.bool_], rows: NDArray[np.int64]) -> None:
    """Draw the angles of some episodes that turn over the axis that is nearest to each."""
    names = [each.name for each in TURNS]
    places = [names.index(each.name) for each in nearest_of(space.take(rows), TURNS)]
    ends = np.stack([np.array(places, dtype=float), angle_deg[rows]], axis=-1)
    _draw(ax, ends, lost[rows], np.array([INK] * len(rows)))
    ax.set_xticks(range(len(names)), [name.removeprefix("turn") for name in names])
    ax.set(xlabel="axis", ylabel="angle [deg]", xlim=(-0.5, len(names) - 0.5))


def _told(lost: NDArray[np.bool_]) -> str:
    return f"{counted(len(lost), 'episode')}, {int(lost.sum())} of them lost the object"


def _keys() -> list[Artist]:
    return [
        Line2D([], [], color=INK, marker=marker, markersize=size**0.5, linestyle="none", label=text)
        for marker, size, text in LOOKS
    ]


def _draw(ax: Axes, ends: Array, lost: NDArray[np.bool_], colours: NDArray[Any]) -> None:
    """Draw where episodes ended `(E, 2)`."""
    for rows, (marker, size, _) in zip((~lost, lost), LOOKS, strict=True):
        x, y = ends[rows].T
        ax.scatter(x, y, size, colours[rows].tolist(), marker=marker, linewidths=0.9, alpha=0.6, zorder=2.0)
