"""The asterisk: paths in every direction from one start, against their targets."""

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from inhand.geometry import Array, perpendicular, unit
from inhand.plots.curves import (
    PathCurve,
    band_polygons,
    clockwise_from_out,
    curves_extent,
    limit_outline,
    target_length,
    target_path,
    tip,
)
from inhand.plots.labels import label_sizes, mm_per_point, place_labels
from inhand.plots.shapes import (
    CROSS_POINTS,
    Extent,
    SceneOutline,
    draw_cross,
    draw_scene,
    scene_key,
    show_extent,
    size_of,
)
from inhand.plots.sheet import halo, sheet
from inhand.plots.style import INK, MUTED, TICK_POINTS, darker, direction_colour

AXES_WIDTH_IN = 4.7


def asterisk_figure(
    curves: Sequence[PathCurve],
    *,
    outline: SceneOutline | None = None,
    title: str = "",
    subtitle: str = "",
) -> Figure:
    """Return a figure of one asterisk with its legend (thesis figures 4.1 and 4.3).

    Curves, one per direction, may be any number in any order; the outline, of hand and object at the start, is drawn
    faintly behind them.
    """
    extent = curves_extent(curves, outline, target_length(curves))
    keys = [*direction_handles(curves), *key_handles(curves, outline)]
    with sheet([[size_of(extent, AXES_WIDTH_IN)]], title, subtitle, beside=keys) as (figure, (ax,)):
        draw_asterisk(ax, curves, outline=outline, extent_mm=extent)
    return figure


def draw_asterisk(
    ax: Axes,
    curves: Sequence[PathCurve],
    *,
    outline: SceneOutline | None,
    extent_mm: Extent,
    target_mm: float | None = None,
) -> None:
    """Draw an asterisk on axes in mm whose origin is the object's start, the palm at the bottom.

    Args:
        ax: Where to draw.
        curves: One per direction; none at all writes "no trials".
        outline: The hand and the object at the start, or None.
        extent_mm: Left, right, bottom, top [mm].
        target_mm: Length of the target lines of curves without a reach limit [mm]; None takes the farthest progress.
    """
    target_mm = target_length(curves) if target_mm is None else target_mm
    show_extent(ax, extent_mm)
    if outline is not None:
        draw_scene(ax, outline)
    ordered = clockwise_from_out(curves)
    for curve in {round(curve.angle_deg % 360.0, 6): curve for curve in ordered}.values():
        _draw_target(ax, curve, target_mm, 0.011 * (extent_mm[1] - extent_mm[0]))
    limit = limit_outline(ordered)
    if len(limit):
        ax.fill(*limit.T, facecolor="none", edgecolor=MUTED, linewidth=0.8, alpha=0.8, joinstyle="round", zorder=1.9)
    for curve in ordered:
        _draw_curve(ax, curve)
    if ordered:
        ax.plot(0, 0, "o", markersize=3.6, color=INK, zorder=4.5)
        _write_distances(ax, ordered, target_mm)
    else:
        ax.text(0.5, 0.5, "no trials", transform=ax.transAxes, ha="center", color=MUTED)


def direction_handles(curves: Sequence[PathCurve]) -> list[Artist]:
    """Return a legend entry for every direction, Out first and clockwise; a name that comes twice is shown once."""
    named = {curve.name: direction_colour(curve.angle_deg) for curve in clockwise_from_out(curves)}
    return [Line2D([], [], color=colour, linewidth=2.0, label=name) for name, colour in named.items()]


def key_handles(curves: Sequence[PathCurve], outline: SceneOutline | None) -> list[Artist]:
    """Return the legend entries that say what lines, bands, marks and outlines mean; only for what is drawn."""
    if not curves:
        return []
    handles: list[Artist] = [Line2D([], [], color=MUTED, linewidth=1.0, linestyle="--", label="target")]
    if any(curve.limit_mm is not None for curve in curves):
        handles.append(Line2D([], [], color=MUTED, linewidth=0.8, label="reach limit"))
    if any(curve.band_mm is not None for curve in curves):
        handles.append(Patch(facecolor=MUTED, alpha=0.25, linewidth=0, label="± SD, lateral"))
    if any(curve.failed for curve in curves):
        handles.append(Line2D([], [], color=INK, linestyle="none", marker="x", label="contact lost"))
    return handles if outline is None else [*handles, scene_key("hand, object at start")]


def _draw_target(ax: Axes, curve: PathCurve, target_mm: float, cap_mm: float) -> None:
    """Draw the dashed target, and a cap across its end where that end is the reach limit."""
    target, colour = target_path(curve, target_mm), direction_colour(curve.angle_deg)
    ax.plot(*target.T, "--", color=colour, linewidth=0.9, alpha=0.75, zorder=2.0)
    if curve.limit_mm is not None:
        across = cap_mm * perpendicular(unit(np.deg2rad(curve.angle_deg)))
        cap = np.stack([target[-1] - across, target[-1] + across])
        ax.plot(*cap.T, color=colour, linewidth=1.4, solid_capstyle="butt", alpha=0.85, zorder=2.0)


def _draw_curve(ax: Axes, curve: PathCurve) -> None:
    """Draw the band, the path, and where the contact was lost a cross at its end."""
    colour = direction_colour(curve.angle_deg)
    for polygon in band_polygons(curve):
        ax.fill(*polygon.T, color=colour, alpha=0.18, linewidth=0, zorder=2.5)
    ax.plot(*curve.points_mm.T, color=colour, linewidth=2.0, zorder=3.0)
    if curve.failed:
        draw_cross(ax, tip(curve), colour)


def _write_distances(ax: Axes, curves: Sequence[PathCurve], target_mm: float) -> None:
    """Write each curve's distance [mm] beyond its tip, clear of the other labels and lines."""
    labelled = [curve for curve in curves if np.isfinite(curve.label_mm)]
    texts, scale = [f"{curve.label_mm:.0f}" for curve in labelled], mm_per_point(ax)
    obstacles, owners = _drawn_points(curves, target_mm)
    middles = place_labels(
        np.array([_label_start(curve, scale) for curve in labelled]).reshape(-1, 2),
        np.array([curve.angle_deg for curve in labelled]),
        label_sizes(texts, TICK_POINTS, scale),
        obstacles=obstacles,
        owners_deg=owners,
        scale=scale,
    )
    for curve, text, (x, y) in zip(labelled, texts, middles, strict=True):
        written = ax.text(x, y, text, ha="center", va="center_baseline", path_effects=halo(), zorder=6.0)
        written.set(fontsize=TICK_POINTS, color=darker(direction_colour(curve.angle_deg), 0.4))


def _label_start(curve: PathCurve, scale: float) -> Array:
    """Return the point `(2,)` [mm] a label starts from: the tip, or beyond the cross that marks a lost contact."""
    cross_mm = CROSS_POINTS / 2 * scale if curve.failed else 0.0
    return tip(curve) + cross_mm * unit(np.deg2rad(curve.angle_deg))


def _drawn_points(curves: Sequence[PathCurve], target_mm: float) -> tuple[Array, Array]:
    """Return points `(M, 2)` [mm] on every drawn line, and `(M,)` the direction that owns a target's points [deg]."""
    points, owners = [np.zeros((1, 2))], [np.full(1, np.nan)]
    for curve in curves:
        finite = curve.points_mm[np.isfinite(curve.points_mm).all(axis=1)]
        target = target_path(curve, target_mm)
        at = np.linspace(0.0, len(target) - 1.0, 100)
        target = np.stack([np.interp(at, np.arange(len(target)), column) for column in target.T], axis=-1)
        points += [finite, target]
        owners += [np.full(len(finite), np.nan), np.full(len(target), curve.angle_deg)]
        if curve.limit_mm is not None:
            points.append(target[-1:])
            owners.append(np.full(1, np.nan))
    return np.concatenate(points), np.concatenate(owners)
