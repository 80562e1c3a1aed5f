"""Where the episodes of a dataset ended."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.plots.asterisk import add_legend
from inhand.plots.style import INK, axes_box, direction_colour, dress_axes, heading_height, new_figure, write_heading

SIDE_IN = 4.2
"""Side of the square axes [in]."""


def dataset_figure(angle_deg: Array, distance: Array, lost: NDArray[np.bool_], title: str) -> Figure:
    """Return the figure of where episodes ended, seen from where they began.

    Args:
        angle_deg: direction of each episode `(E,)` [deg].
        distance: way along it at its end `(E,)` [m].
        lost: whether it lost the object `(E,)`.
        title: First line.
    """
    subtitle = f"{len(lost)} episodes, {int(lost.sum())} of them lost the object"
    figure = new_figure(SIDE_IN + 1.4, SIDE_IN + 1.2 + heading_height(title, subtitle))
    ax = figure.add_axes(axes_box(figure, (0.9, 1.0, SIDE_IN, SIDE_IN)))
    dress_axes(ax, "to the right [mm]", "away from the palm [mm]")
    angle = np.deg2rad(angle_deg)
    ends = 1e3 * distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    colours = np.array([direction_colour(each) for each in angle_deg])
    for rows, marker, size in ((~lost, "o", 9.0), (lost, "x", 22.0)):
        x, y = ends[rows].T
        ax.scatter(x, y, size, colours[rows].tolist(), marker=marker, linewidths=0.9, alpha=0.6, zorder=2.0)
    ax.set_aspect("equal", adjustable="datalim")
    write_heading(figure, title, subtitle)
    looks = (("o", 3.5, "end of an episode"), ("x", 5.5, "object lost there"))
    handles = [
        Line2D([], [], color=INK, marker=marker, markersize=size, linestyle="none", label=text)
        for marker, size, text in looks
    ]
    add_legend(figure, handles, (0.5, 0.12 / figure.get_size_inches()[1]), columns=2, loc="lower center")
    return figure
