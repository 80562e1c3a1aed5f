"""Trials that lost their object: the path, and where and why it ended (thesis figures 4.2, 4.5 and 4.6)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from inhand.asterisk_test.results import Result
from inhand.asterisk_test.scenes import counted_rows
from inhand.control.scenes import scene_at
from inhand.control.trial import LOST_CONTACT, NO_GRASP, Trial
from inhand.errors import InputError
from inhand.geometry import Array, perpendicular, unit
from inhand.plots.shapes import (
    Extent,
    SceneOutline,
    draw_cross,
    draw_scene,
    scene_key,
    scene_points,
    show_extent,
    square_of,
)
from inhand.plots.sheet import sheet, write_above
from inhand.plots.style import INK, MUTED, direction_colour

MOST_FAILURES = 12
"""Trials that one figure shows."""
COLUMNS = 4
SIDE_IN = 2.15
"""Side of the square axes of one trial [in]."""
RED = "#c1121f"
LET_GO: dict[str, Any] = {"marker": "o", "markerfacecolor": "white", "markeredgecolor": RED, "linestyle": ""}
HELD: dict[str, Any] = {"marker": "o", "markersize": 4.5, "color": INK, "linestyle": ""}
"""Marks of a finger that let go, and of one that held."""
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
    """The points of the fingers nearest to the object at that row `(F, 2)` [mm]."""
    held: tuple[bool, ...]
    """Whether each finger touched at that row."""


def failure_of(trial: Trial, result: Result) -> Failure:
    """Return how a trial ended."""
    path, _, touching = trial.manipulated_path()
    origin = trial.object_pose[trial.onset, :2]
    end = min(counted_rows(trial), len(path) - 1)
    row = min(trial.onset + end, len(trial.time) - 1)
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


def failures_figure(
    failures: Sequence[Failure], title: str = "", subtitle: str = "", names: Sequence[str] = ()
) -> Figure:
    """Return the figure of one to twelve trials that failed, each with the hand and object at its end.

    Above each stands its name, or another of `names`.

    Raises:
        InputError: none, or more than a figure holds.
    """
    if not 1 <= len(failures) <= MOST_FAILURES:
        raise InputError(f"{len(failures)} failed trials given: a figure shows 1 to {MOST_FAILURES}; split them")
    counts = [len(failures[first : first + COLUMNS]) for first in range(0, len(failures), COLUMNS)]
    rows, extent = [[(SIDE_IN, SIDE_IN)] * count for count in counts], _extent(failures)
    with sheet(rows, title, subtitle, gap=(0.25, 0.62), below=[_handles(failures)]) as (figure, axes):
        for number, (ax, failure) in enumerate(zip(axes, failures, strict=True)):
            draw_failure(ax, failure if not names else replace(failure, name=names[number]), extent)
            left, lowest = number % COLUMNS == 0, number + COLUMNS >= len(failures)
            ax.set(xlabel="x [mm]" if lowest else "", ylabel="y [mm]" if left else "")
            ax.tick_params(labelleft=left, labelbottom=lowest)
    return figure


def draw_failure(ax: Axes, failure: Failure, extent: Extent) -> None:
    """Draw one trial on axes in mm: hand and object where contact was lost, the way there, and the way after it."""
    show_extent(ax, extent)
    draw_scene(ax, failure.outline)
    colour = direction_colour(failure.angle_deg)
    if failure.limit_mm is not None:
        along = unit(np.deg2rad(failure.angle_deg))
        tip, across = failure.limit_mm * along, 3.5 * perpendicular(along)
        ax.plot(*np.stack([np.zeros(2), tip]).T, "--", color=MUTED, linewidth=0.9, zorder=2.0)
        ax.plot(*np.stack([tip - across, tip + across]).T, color=MUTED, linewidth=1.4, zorder=2.0)
    before, after = failure.path_mm[: failure.end + 1], failure.path_mm[failure.end :]
    ax.plot(*after.T, ":", color=colour, linewidth=1.2, zorder=2.8)
    ax.plot(*before.T, color=colour, linewidth=2.0, zorder=3.0)
    ax.plot(0, 0, "o", markersize=3.0, color=INK, zorder=4.0)
    draw_cross(ax, before[-1], colour)
    for point, held in zip(failure.contacts_mm, failure.held, strict=True):
        ax.plot(*point, zorder=4.5, **(HELD if held else LET_GO))
    write_above(ax, failure.name, failure.reason)


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
    return square_of(np.concatenate(drawn), SCENE_MARGIN_MM)


def _handles(failures: Sequence[Failure]) -> list[Artist]:
    """Return the legend; only what is drawn."""
    handles: list[Artist] = [
        Line2D([], [], color=INK, marker="x", linewidth=2.0, label="path to the loss, or the end"),
        Line2D([], [], color=INK, linestyle=":", linewidth=1.2, label="path after the loss"),
        Line2D([], [], color=MUTED, linestyle="--", linewidth=1.0, label="target to the reach limit"),
    ]
    if any(not all(failure.held) for failure in failures):
        handles.append(Line2D([], [], label="finger that let go", **LET_GO))
    return [*handles, Line2D([], [], label="finger that held", **HELD), scene_key("hand, object at that moment")]
