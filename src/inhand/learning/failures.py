"""Trials that lost their object: the path, and where and why it ended (thesis figures 4.2, 4.5 and 4.6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from inhand.asterisk_test.results import Result
from inhand.asterisk_test.scenes import counted_rows
from inhand.control.scenes import scene_at
from inhand.control.trial import LOST_CONTACT, NO_GRASP, Trial
from inhand.errors import InputError
from inhand.geometry import Array, perpendicular, unit
from inhand.plots.asterisk import CROSS_POINTS, add_legend
from inhand.plots.shapes import FAINT, Extent, SceneOutline, draw_scene, scene_points, show_extent
from inhand.plots.style import (
    INK,
    MUTED,
    TICK_POINTS,
    axes_box,
    darker,
    direction_colour,
    heading_height,
    new_figure,
    write_heading,
)

MOST_FAILURES = 12
"""Trials that one figure shows."""
COLUMNS = 4
SIDE_IN = 2.15
"""Side of the square axes of one trial [in]."""
GAP_IN, TEXT_IN = 0.2, 0.62
LET_GO = "#c1121f"
"""Where a finger let go."""
SCENE_MARGIN_MM = 4.0


@dataclass(frozen=True, eq=False)
class Failure:
    """How one trial ended without the object in the hand."""

    name: str
    """Direction and number of the trial."""
    reason: str
    """What happened, and where on the way."""
    angle_deg: float
    """The direction [deg]."""
    path_mm: Array
    """Object positions `(N, 2)` [mm] from the start of manipulation to the end of the trial."""
    end: int
    """Row of the path at which contact was lost first, or the last one."""
    limit_mm: float | None
    """How far the hand could carry the object [mm]."""
    outline: SceneOutline
    """The hand and the object at that row."""
    contacts_mm: Array
    """The points of the F fingers nearest to the object at that row `(F, 2)` [mm]."""
    held: tuple[bool, ...]
    """Whether each finger touched at that row."""


def failure_of(trial: Trial, result: Result) -> Failure:
    """Return how a trial ended."""
    path, _, touching = trial.manipulated_path()
    start = min(trial.manipulation.start, len(trial.time) - 1)
    origin = trial.object_pose[start, :2]
    end = min(counted_rows(trial), len(path) - 1)
    row = min(start + end, len(trial.time) - 1)
    return Failure(
        name=f"{result.direction}, trial {result.trial}",
        reason=_reason(result, trial.passport.hand.finger_names),
        angle_deg=result.angle_deg or 0.0,
        path_mm=path,
        end=end,
        limit_mm=result.limit if result.angle_deg is not None else None,
        outline=scene_at(trial, row, origin),
        contacts_mm=1e3 * (trial.finger_points[row, :, :2] - origin),
        held=tuple(touching[end].tolist()),
    )


def failures_figure(failures: Sequence[Failure], title: str = "", subtitle: str = "") -> Figure:
    """Return the figure of one to twelve trials that failed, each with the hand and object at its end.

    Args:
        failures: The trials.
        title: First line.
        subtitle: Second line, smaller.

    Raises:
        InputError: none, or more than a figure holds.
    """
    if not 1 <= len(failures) <= MOST_FAILURES:
        raise InputError(f"{len(failures)} failed trials given: a figure shows 1 to {MOST_FAILURES}; split them")
    columns = min(len(failures), COLUMNS)
    count = -(-len(failures) // columns)
    width = max(0.75 + columns * (SIDE_IN + GAP_IN), 7.4)
    figure = new_figure(width, 0.8 + count * (SIDE_IN + TEXT_IN) + heading_height(title, subtitle))
    extent = _extent(failures)
    for number, failure in enumerate(failures):
        row, column = divmod(number, columns)
        bottom = 0.95 + (count - 1 - row) * (SIDE_IN + TEXT_IN)
        ax = figure.add_axes(axes_box(figure, (0.65 + column * (SIDE_IN + GAP_IN), bottom, SIDE_IN, SIDE_IN)))
        draw_failure(ax, failure, extent)
        below = number + columns >= len(failures)
        ax.tick_params(labelleft=column == 0, labelbottom=below)
        ax.set_xlabel("x [mm]" if below else "", fontsize=TICK_POINTS, color=INK)
        ax.set_ylabel("y [mm]" if column == 0 else "", fontsize=TICK_POINTS, color=INK)
    write_heading(figure, title, subtitle)
    handles = _handles(failures)
    add_legend(figure, handles, (0.5, 0.14 / figure.get_size_inches()[1]), columns=3, loc="lower center")
    return figure


def draw_failure(ax: Axes, failure: Failure, extent: Extent) -> None:
    """Draw one trial on axes in mm: hand and object where contact was lost, the way there, and the way after it."""
    show_extent(ax, extent)
    draw_scene(ax, failure.outline, FAINT)
    colour = direction_colour(failure.angle_deg)
    if failure.limit_mm is not None:
        _draw_target(ax, failure.angle_deg, failure.limit_mm)
    before, after = failure.path_mm[: failure.end + 1], failure.path_mm[failure.end :]
    ax.plot(*after.T, color=colour, linewidth=1.2, linestyle=":", zorder=2.8)
    ax.plot(*before.T, color=colour, linewidth=2.0, solid_capstyle="round", zorder=3.0)
    ax.plot(0, 0, marker="o", markersize=3.0, color=INK, linestyle="none", zorder=4.0)
    edge = [withStroke(linewidth=3.2, foreground="white")]
    ax.plot(
        *before[-1], marker="x", markersize=CROSS_POINTS, markeredgewidth=1.8, color=darker(colour, 0.35),
        linestyle="none", path_effects=edge, zorder=5.0,
    )  # fmt: skip
    for point, held in zip(failure.contacts_mm, failure.held, strict=True):
        face = INK if held else "white"
        edge_colour = INK if held else LET_GO
        ax.plot(
            *point, marker="o", markersize=4.5 if held else 6.0, markerfacecolor=face, markeredgecolor=edge_colour,
            markeredgewidth=1.5, linestyle="none", zorder=4.5,
        )  # fmt: skip
    for text, points_up in ((failure.name, 17), (failure.reason, 5)):
        written = ax.annotate(text, (0.0, 1.0), (0, points_up), xycoords="axes fraction", textcoords="offset points")
        written.set(fontsize=TICK_POINTS if points_up > 5 else TICK_POINTS - 1.5, color=INK if points_up > 5 else MUTED)
        written.set_fontweight("bold" if points_up > 5 else "normal")


def _draw_target(ax: Axes, angle_deg: float, limit_mm: float) -> None:
    """Draw the straight target to the reach limit, with a cap across it."""
    along = unit(np.deg2rad(angle_deg))
    tip, across = limit_mm * along, 3.5 * perpendicular(along)
    ax.plot([0, tip[0]], [0, tip[1]], color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)), zorder=2.0)
    ax.plot(*np.stack([tip - across, tip + across], axis=-1), color=MUTED, linewidth=1.4, zorder=2.0)


def _reason(result: Result, fingers: tuple[str, ...]) -> str:
    """Return what happened in a few words, with the place against the limit."""
    if result.outcome == NO_GRASP:
        return "the grasp failed"
    who = f"{result.first_lost} let go" if result.outcome == LOST_CONTACT and result.first_lost else result.outcome
    if result.first_lost == " and ".join(fingers):
        who = "both let go" if result.outcome == LOST_CONTACT else result.outcome
    place = f"{result.metrics.distance_mm:.0f}"
    if result.angle_deg is None or not result.limit:
        return f"{who} at {place} mm"
    return f"{who} at {place} of {result.limit:.0f} mm ({100 * (result.fraction or 0.0):.0f}%)"


def _extent(failures: Sequence[Failure]) -> Extent:
    """Return a square that shows every scene, target and path until contact was lost [mm]."""
    drawn = [np.zeros((1, 2))]
    for failure in failures:
        drawn += [scene_points(failure.outline), failure.path_mm[: failure.end + 1]]
        if failure.limit_mm is not None:
            drawn.append(failure.limit_mm * unit(np.deg2rad(failure.angle_deg))[None])
    points = np.concatenate(drawn)
    low, high = points.min(axis=0) - SCENE_MARGIN_MM, points.max(axis=0) + SCENE_MARGIN_MM
    middle, half = (low + high) / 2, float((high - low).max()) / 2
    return float(middle[0] - half), float(middle[0] + half), float(middle[1] - half), float(middle[1] + half)


def _handles(failures: Sequence[Failure]) -> list[Artist]:
    """Return the legend; only what is drawn."""
    handles: list[Artist] = [
        Line2D([], [], color=INK, marker="x", linewidth=2.0, label="path to the loss, or the end"),
        Line2D([], [], color=INK, linestyle=":", linewidth=1.2, label="path after the loss"),
        Line2D([], [], color=MUTED, linestyle=(0, (4, 3)), linewidth=1.0, label="target to the reach limit"),
    ]
    if any(not all(failure.held) for failure in failures):
        handles.append(
            Line2D(
                [], [], marker="o", markerfacecolor="white", markeredgecolor=LET_GO, markeredgewidth=1.5,
                linestyle="none", label="finger that let go",
            )
        )  # fmt: skip
    handles.append(Line2D([], [], marker="o", markersize=4.5, color=INK, linestyle="none", label="finger that held"))
    handles.append(Patch(facecolor=FAINT.object, edgecolor=FAINT.object_edge, label="hand, object at that moment"))
    return handles
