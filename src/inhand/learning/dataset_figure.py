"""Where the episodes of a dataset ended."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.pages import counted
from inhand.plots.sheet import sheet
from inhand.plots.style import INK, direction_colour

SIDE_IN = 4.2
"""Side of the square axes [in]."""


def dataset_figure(angle_deg: Array, distance: Array, lost: NDArray[np.bool_], title: str) -> Figure:
    """Return the figure of where episodes ended, seen from where they began.

    Of each episode that is its direction [deg], the way along it at its end [m], and whether it lost the object `(E,)`.
    """
    subtitle = f"{counted(len(lost), 'episode')}, {int(lost.sum())} of them lost the object"
    angle = np.deg2rad(angle_deg)
    ends = 1e3 * distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    colours = np.array([direction_colour(each) for each in angle_deg])
    looks = ((~lost, "o", 9.0, "end of an episode"), (lost, "x", 22.0, "object lost there"))
    keys = [
        Line2D([], [], color=INK, marker=marker, markersize=size**0.5, linestyle="none", label=text)
        for _, marker, size, text in looks
    ]
    with sheet([[(SIDE_IN, SIDE_IN)]], title, subtitle, below=[keys]) as (figure, (ax,)):
        for rows, marker, size, _ in looks:
            x, y = ends[rows].T
            ax.scatter(x, y, size, colours[rows].tolist(), marker=marker, linewidths=0.9, alpha=0.6, zorder=2.0)
        ax.set_aspect("equal", adjustable="datalim")
        ax.set(xlabel="to the right [mm]", ylabel="away from the palm [mm]")
    return figure
