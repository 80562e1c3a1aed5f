"""What stands in a figure, as tests read it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from inhand.geometry import Array

NAMES = {90.0: "Out", 45.0: "Out-Right", 0.0: "Right", -45.0: "In-Right"}
NAMES |= {-90.0: "In", -135.0: "In-Left", 180.0: "Left", 135.0: "Out-Left"}
SIXTEEN = NAMES | {angle - 22.5: f"{name}'" for angle, name in NAMES.items()}


def drawn(figure: Figure) -> Figure:
    """Return the figure after all but the pixels of a draw, so that texts and axes know where they are."""
    figure.draw_without_rendering()
    return figure


def xy(line: Line2D) -> Array:
    return np.asarray(line.get_xydata(), dtype=float)


def texts(ax: Axes) -> list[str]:
    return [text.get_text() for text in ax.texts]


def legend_texts(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def dashed(ax: Axes) -> list[Line2D]:
    return [line for line in ax.lines if line.get_linestyle() == "--"]
