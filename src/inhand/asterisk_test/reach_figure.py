"""The workspace of a hand and an object: how far it could carry it, from the start pose, in every direction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from inhand.geometry import Array, transform
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, polygon
from inhand.hands.reach.limits import Farthest
from inhand.plots.asterisk import add_legend, direction_handles, draw_asterisk
from inhand.plots.curves import PathCurve, curves_extent, limit_outline
from inhand.plots.scenes import scene_of
from inhand.plots.style import axes_box, direction_colour, heading_height, new_figure, write_heading
from inhand.tasks.reach import Limit

AXES_WIDTH_IN = 5.2
LEGEND_WIDTH_IN = 1.5


def reach_figure(
    held: tuple[HandSpec, ObjectSpec], start: Farthest, limits: Sequence[Limit], title: str = "", subtitle: str = ""
) -> Figure:
    """Return a figure of the workspace: the start grip, the asterisk of limits, and the object at each of them.

    Args:
        held: the hand and the object.
        start: a grip at the start pose.
        limits: limits of primitives that translate, in any order.
        title: First line.
        subtitle: Second line, smaller.
    """
    hand, spec = held
    origin = start.pose[:2]
    curves = [_curve(limit, origin) for limit in limits]
    scene = scene_of(hand, spec, start.joints, start.pose, origin)
    bodies = [1e3 * (transform(limit.end.pose, polygon(spec)) - origin) for limit in limits]
    left, right, bottom, top = curves_extent(curves, scene, 0.0)
    corners = np.concatenate([*bodies, [[left, bottom], [right, top]]])
    low, high = corners.min(axis=0) - 3.0, corners.max(axis=0) + 3.0
    extent = (float(low[0]), float(high[0]), float(low[1]), float(high[1]))
    height = AXES_WIDTH_IN * (extent[3] - extent[2]) / (extent[1] - extent[0])
    figure = new_figure(0.75 + AXES_WIDTH_IN + LEGEND_WIDTH_IN, 0.6 + height + heading_height(title, subtitle))
    ax = figure.add_axes(axes_box(figure, (0.68, 0.55, AXES_WIDTH_IN, height)))
    outline = limit_outline(curves)
    if len(outline):
        ax.add_patch(Polygon(outline, closed=True, facecolor="#eef3f8", edgecolor="none", zorder=0.9))
    draw_asterisk(ax, curves, outline=scene, extent_mm=extent)
    for limit, body in zip(limits, bodies, strict=True):
        colour = direction_colour(limit.primitive.angle_deg or 0.0)
        ax.add_patch(
            Polygon(body, closed=True, facecolor="none", edgecolor=colour, linewidth=0.7, alpha=0.6, zorder=1.5)
        )
    write_heading(figure, title, subtitle)
    width, full = figure.get_size_inches()
    corner = ((0.68 + AXES_WIDTH_IN + 0.12) / width, (0.55 + height) / full)
    add_legend(figure, direction_handles(curves), corner, columns=1, loc="upper left")
    return figure


def _curve(limit: Limit, origin: Array) -> PathCurve:
    """Return the straight line to a limit, or to the last pose of a path of its own, its distance at the tip."""
    own = limit.primitive.path is not None
    end = 1e3 * (limit.end.pose[:2] - origin if own else limit.distance * limit.primitive.unit)
    return PathCurve(
        angle_deg=limit.primitive.angle_deg or 0.0,
        name=limit.primitive.name,
        points_mm=np.stack([np.zeros(2), end]),
        label_mm=1e3 * limit.distance,
        limit_mm=1e3 * limit.distance,
    )
