"""Paths of an object in space over their plans, in three planes, and how far off they were along the way."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from inhand.control.spatial_scenes import faces_of
from inhand.geometry import Array
from inhand.hands.spatial.objects import SolidSpec
from inhand.plots.sheet import sheet
from inhand.plots.spatial_asterisk import PLANE_IN, PLANES, name_plane
from inhand.plots.style import INK, MUTED
from inhand.tracing.figures import (
    BAND,
    BANDS,
    FAR_MM,
    PLOT_IN,
    Path,
    draw_errors,
    draw_path,
    draw_turns,
    handles_of,
    one_plan,
    path_of,
    plan_line,
    turns_there,
)
from inhand.tracing.follow import Followed
from inhand.tracing.trace import Trace

ROOM = 1.12
"""Side of a plane, as a share of what is drawn in it."""
LEAST_MM = 20.0
"""It is at least so long [mm]."""


def spatial_trace_figure(
    spec: SolidSpec, followed: Sequence[Followed], traces: Sequence[Trace], title: str = "", subtitle: str = ""
) -> Figure:
    """Return the figure of a run in space: every path over its plan in three planes, its errors and rotation below."""
    paths = [path_of(k, *each, few=len(traces)) for k, each in enumerate(zip(followed, traces, strict=True))]
    turns = turns_there(paths)
    wide = 3 * PLANE_IN + 2 * 0.62, PLOT_IN
    rows = [[(PLANE_IN, PLANE_IN)] * 3, [wide], *([[wide]] if turns else [])]
    middle, side = _shown(paths)
    with sheet(rows, title, subtitle, gap=(0.62, 0.65), beside=handles_of(paths)) as (figure, axes):
        for ax, plane in zip(axes[:3], PLANES, strict=True):
            _draw_plane(ax, spec, paths, plane)
            for name, k in zip("xy", plane, strict=True):
                ax.set(**{f"{name}lim": (middle[k] - side / 2, middle[k] + side / 2)})
            ax.set_aspect("equal")
        draw_errors(axes[3], paths)
        if turns:
            draw_turns(axes[4], paths, shared=one_plan(followed))
    return figure


def _shown(paths: Sequence[Path]) -> tuple[Array, float]:
    """Return the middle `(3,)` of what the planes show, and how much of each axis they show [mm]."""
    plans = np.concatenate([_plan(path) for path in paths])
    far = plans.min(axis=0) - FAR_MM, plans.max(axis=0) + FAR_MM
    drawn = np.concatenate([plans, *(np.clip(path.points_mm, *far) for path in paths)])
    low, high = drawn.min(axis=0), drawn.max(axis=0)
    return (low + high) / 2, max(ROOM * float((high - low).max()), LEAST_MM)


def _plan(path: Path) -> Array:
    """Return a plan's positions `(S, 3)` [mm] from the object's start."""
    return plan_line(path.followed.plan, path.followed.trial.passport.hand.start_pose)


def _draw_plane(ax: Axes, spec: SolidSpec, paths: Sequence[Path], plane: tuple[int, int]) -> None:
    """Draw the object's outline at the start, plans and paths, seen along one axis."""
    a, b = plane
    corners = 1e3 * np.concatenate(faces_of(spec))[:, list(plane)]
    outline = corners[ConvexHull(corners).vertices]
    ax.add_patch(Polygon(outline, fill=False, edgecolor=MUTED, linewidth=0.8, linestyle=":", zorder=1.9))
    for path in paths if not one_plan([path.followed for path in paths]) else paths[:1]:
        plan, origin = path.followed.plan, path.followed.trial.passport.hand.start_pose
        ax.plot(*plan_line(plan.measured(), origin)[:, [a, b]].T, color=BAND, linewidth=BANDS[0], zorder=2.0)
        ends = 1e3 * (np.array([leg.end[:3] for leg in plan.legs]) - origin[:3])[:, [a, b]]
        if plan.approach:
            ways = np.concatenate([np.zeros((1, 2)), ends[: plan.approach]])
            ax.plot(*ways.T, color=MUTED, linewidth=1.0, linestyle="--", alpha=0.7, zorder=2.1)
        ax.plot(*ends[max(plan.approach - 1, 0) :].T, "o", color=INK, markersize=1.8, zorder=3.6)
    for path in reversed(paths):
        draw_path(ax, path, plane)
    ax.plot(0, 0, "o", markersize=4.4, color=INK, markerfacecolor="white", zorder=4.5)
    name_plane(ax, a, b)
