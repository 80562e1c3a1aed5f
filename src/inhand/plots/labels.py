"""Place the labels at the tips of an asterisk so that none lies on another or on a line."""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from inhand.geometry import Array, unit

CHARACTER_WIDTH = 0.64
"""Width of a digit of DejaVu Sans, matplotlib's own font, as a share of the type size."""
CHARACTER_HEIGHT = 0.76
"""Height of a digit of the same font as a share of the type size."""
GAP_POINTS = 4.5
"""Free space between the tip and its label [pt]."""
PAD_POINTS = 3.0
"""Free space between a label and anything else, both sides together [pt]."""
STEP_POINTS = 1.0
"""How far a label moves outward at each try [pt]."""
TRIES = 150


def mm_per_point(ax: Axes) -> float:
    """Return how many mm one printer's point stands for on axes in mm whose limits are set."""
    ax.apply_aspect()
    left, right = ax.get_xlim()
    figure = ax.get_figure(root=True)
    dots_per_point = (figure.dpi if figure is not None else 100.0) / 72.0
    return float((right - left) / (ax.get_window_extent().width / dots_per_point))


def label_sizes(texts: list[str], points: float, scale: float) -> Array:
    """Return width and height `(L, 2)` [mm] of one-line texts.

    Args:
        texts: The texts.
        points: Type size [pt].
        scale: mm per point, from `mm_per_point`.
    """
    widths = [len(text) * CHARACTER_WIDTH for text in texts]
    return np.array([(width, CHARACTER_HEIGHT) for width in widths]).reshape(-1, 2) * points * scale


def place_labels(
    tips: Array, angles_deg: Array, sizes: Array, *, obstacles: Array, owners_deg: Array, scale: float
) -> Array:
    """Return the middles `(L, 2)` [mm] of labels that start at their tips and move outward until they are free.

    A label moves along its own direction, so that it still says which path it belongs to. The longest path goes
    first: the short ones near the centre, where lines are close, give way. Where no place is free of lines, the
    first one free of other labels is taken.

    Args:
        tips: Ends of the paths `(L, 2)` [mm].
        angles_deg: Directions `(L,)` [deg].
        sizes: Width and height of each label `(L, 2)` [mm].
        obstacles: Points of drawn lines `(M, 2)` [mm].
        owners_deg: For each obstacle `(M,)` the direction [deg] whose labels may cover it, NaN for none.
        scale: mm per point.
    """
    placed = np.full((len(tips), 2), np.nan)
    padded = sizes + PAD_POINTS * scale
    for i in np.argsort(-np.hypot(*tips.T), kind="stable"):
        direction = unit(np.deg2rad(angles_deg[i]))
        reach = np.abs(direction) @ sizes[i] / 2 + GAP_POINTS * scale
        steps = reach + np.arange(TRIES) * STEP_POINTS * scale
        middles = tips[i] + steps[:, None] * direction
        others = placed[np.isfinite(placed[:, 0])], padded[np.isfinite(placed[:, 0])]
        clear = ~_overlaps(middles, padded[i], *others)
        lines = obstacles[~np.isclose(owners_deg, angles_deg[i])]
        free = clear & ~_overlaps(middles, padded[i], lines, np.zeros_like(lines))
        choice = np.flatnonzero(free if free.any() else clear)
        placed[i] = middles[choice[0] if len(choice) else 0]
    return placed


def _overlaps(middles: Array, size: Array, others: Array, other_sizes: Array) -> NDArray[np.bool_]:
    """Return for each middle `(T, 2)` whether a box of that size there meets any other box `(M, 2)`."""
    wide = size + other_sizes
    near = np.all((others > middles.min(axis=0) - wide) & (others < middles.max(axis=0) + wide), axis=1)  # of all tries
    apart = np.abs(middles[:, None] - others[near])
    meets: NDArray[np.bool_] = np.all(apart < wide[near] / 2, axis=2)
    return np.asarray(np.any(meets, axis=1))
