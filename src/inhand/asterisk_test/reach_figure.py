"""The workspace of a hand and an object: how far it could carry it, from the start pose, in every direction."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from inhand.geometry import Array, transform
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, polygon
from inhand.hands.reach.limits import Farthest
from inhand.plots.asterisk import direction_handles, draw_asterisk
from inhand.plots.curves import PathCurve, curves_extent, limit_outline
from inhand.plots.scenes import scene_of
from inhand.plots.shapes import extent_of, joined, size_of
from inhand.plots.sheet import sheet
from inhand.plots.style import direction_colour
from inhand.tasks.reach import Limit

AXES_WIDTH_IN = 5.2


def reach_figure(
    held: tuple[HandSpec, ObjectSpec], start: Farthest, limits: Sequence[Limit], title: str = "", subtitle: str = ""
) -> Figure:
    """Return a figure of the workspace: the start grip, the asterisk of limits, and the object at each of them.

    The limits are those of primitives that translate, in any order.
    """
    hand, spec = held
    origin = start.pose[:2]
    curves = [limit_curve(limit, origin) for limit in limits]
    scene = scene_of(hand, spec, start.joints, start.pose, origin)
    bodies = [1e3 * (transform(limit.end.pose, polygon(spec)) - origin) for limit in limits]
    extent = joined([curves_extent(curves, scene, 0.0), *(extent_of(body, 3.0) for body in bodies)])
    keys = direction_handles(curves)
    with sheet([[size_of(extent, AXES_WIDTH_IN)]], title, subtitle, beside=keys) as (figure, (ax,)):
        ax.fill(*limit_outline(curves).T, facecolor="#eef3f8", edgecolor="none", zorder=0.9)
        draw_asterisk(ax, curves, outline=scene, extent_mm=extent)
        for limit, body in zip(limits, bodies, strict=True):
            colour = direction_colour(limit.primitive.angle_deg or 0.0)
            ax.fill(*body.T, facecolor="none", edgecolor=colour, linewidth=0.7, alpha=0.6, zorder=1.5)
    return figure


def limit_curve(limit: Limit, origin: Array) -> PathCurve:
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
