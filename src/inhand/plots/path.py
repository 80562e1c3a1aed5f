"""One trial: its path against the target, what it did beside the direction, and which fingers touched."""

from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array, perpendicular, unit
from inhand.plots.curves import true_runs
from inhand.plots.shapes import (
    Extent,
    SceneOutline,
    check_points,
    draw_cross,
    draw_scene,
    scene_key,
    show_extent,
    square_of,
)
from inhand.plots.sheet import sheet
from inhand.plots.style import INK, MUTED, darker, direction_colour

WIDTH_IN, PLOT_IN, ROW_IN = 4.4, 1.05, 0.17
"""Side of the square axes of the path, height of those of lateral and rotation, and of a finger's contacts [in]."""
TICKS = 12
"""Orientation ticks along the path."""


@dataclass(frozen=True, eq=False)
class TrialPath:
    """One trial, in the frame of the object's start.

    Raises:
        InputError: the arrays do not belong together.
    """

    name: str
    """Thesis name of the direction."""
    angle_deg: float
    """The direction [deg], counter-clockwise from +x."""
    points_mm: Array
    """Object positions `(N, 2)` [mm] from the start."""
    rotation_deg: Array
    """Object rotation `(N,)` from the start [deg], counter-clockwise."""
    contact: NDArray[np.bool_] | None = None
    """Whether each finger touched at each step `(T, F)`; T may differ from N."""
    fingers: tuple[str, ...] = ()
    """Names of the fingers; empty means finger 1, finger 2 and so on."""
    target_mm: Array | None = None
    """The reference path `(M, 2)` [mm]; None means straight along the direction."""
    target_rotation_deg: float = 0.0
    """The rotation to hold [deg]."""
    failed: bool = False
    """Whether the contact was lost."""
    step_s: float = 0.02
    """Time between two steps [s]."""

    def __post_init__(self) -> None:
        """Check the shapes once, where the trial is made."""
        check_points(self.points_mm, f"path of trial {self.name!r}")
        if self.target_mm is not None:
            check_points(self.target_mm, f"target of trial {self.name!r}")
        if np.shape(self.rotation_deg) != (len(self.points_mm),):
            raise InputError(
                f"rotation of trial {self.name!r} has shape {np.shape(self.rotation_deg)} for "
                f"{len(self.points_mm)} points: give one angle [deg] per point"
            )
        if self.contact is not None:
            check_contact(self.contact, self.fingers)


def check_contact(contact: NDArray[np.bool_], fingers: tuple[str, ...]) -> None:
    """Check that contacts are `(T, F)` and that there is a name for each finger, or none at all.

    Raises:
        InputError: they are not.
    """
    if np.ndim(contact) != 2:
        raise InputError(
            f"contact has shape {np.shape(contact)}; it must be (T, F): one row per step, a column per finger"
        )
    if fingers and len(fingers) != np.shape(contact)[1]:
        raise InputError(
            f"{len(fingers)} finger names given for {np.shape(contact)[1]} columns of contact: give as many"
        )


def path_figure(
    trial: TrialPath,
    *,
    outline: SceneOutline | None = None,
    title: str = "",
    subtitle: str = "",
    again: Figure | None = None,
) -> Figure:
    """Return the figure of one trial: path, lateral and rotation over progress, contact over time.

    The outline is that of hand and object at the start, drawn faintly behind the path. The figure of another trial with
    as many fingers may be given `again` to be drawn on, where that one is not needed any more: three times as fast.
    """
    fingers = 0 if trial.contact is None else np.shape(trial.contact)[1]
    heights = [WIDTH_IN, PLOT_IN, PLOT_IN, *([ROW_IN * fingers] if fingers else [])]
    rows = [[(WIDTH_IN, height)] for height in heights]
    with sheet(rows, title, subtitle, beside=_handles(trial, outline), gap=(0.0, 0.55), again=again) as (figure, axes):
        draw_path(axes[0], trial, outline=outline)
        draw_deviations(axes[2], axes[1], trial)
        if trial.contact is not None and fingers:
            draw_contact(axes[3], trial.contact, trial.fingers, trial.step_s)
    return figure


def draw_path(ax: Axes, trial: TrialPath, *, outline: SceneOutline | None = None) -> None:
    """Draw the path against its target on equal axes in mm, with small crosses that turn with the object.

    A cross stands upright where the object has not turned, whatever the direction of the path.
    """
    extent, colour = _extent(trial, outline), direction_colour(trial.angle_deg)
    show_extent(ax, extent)
    if outline is not None:
        draw_scene(ax, outline)
    ax.plot(*_target(trial).T, "--", color=MUTED, linewidth=1.1, zorder=2.0)
    for ends in orientation_ticks(trial, 0.028 * (extent[1] - extent[0])):
        ax.plot(*np.stack(ends).T, color=darker(colour, 0.4), linewidth=1.2, zorder=2.8)
    ax.plot(*trial.points_mm.T, color=colour, linewidth=2.2, zorder=3.0)
    ax.plot(0, 0, "o", markersize=3.6, color=INK, zorder=4.5)
    finite = trial.points_mm[np.isfinite(trial.points_mm).all(axis=1)]
    if trial.failed and len(finite):
        draw_cross(ax, finite[-1], colour)


def draw_deviations(lateral: Axes, rotation: Axes, trial: TrialPath) -> None:
    """Draw the lateral part [mm] and the rotation [deg] over the progress along the direction [mm]."""
    along = unit(np.deg2rad(trial.angle_deg))
    progress, aside = trial.points_mm @ along, trial.points_mm @ perpendicular(along)
    lateral.set(xlabel="progress [mm]", ylabel="lateral [mm]")
    rotation.set(ylabel="rotation [°]")
    finite = progress[np.isfinite(progress)]
    low, high = float(np.min(finite, initial=0.0)), float(np.max(finite, initial=10.0))
    margin = 0.02 * (high - low) + 0.5
    for ax, values, wanted, least in (
        (lateral, aside, 0.0, 5.0),
        (rotation, trial.rotation_deg, trial.target_rotation_deg, 10.0),
    ):
        ax.axhline(wanted, color=MUTED, linewidth=1.1, linestyle="--", zorder=2.0)
        ax.plot(progress, values, color=direction_colour(trial.angle_deg), linewidth=1.8, zorder=3.0)
        half = 1.15 * float(np.max(np.abs(values - wanted)[np.isfinite(values)], initial=least))
        ax.set(xlim=(low - margin, high + margin), ylim=(wanted - half, wanted + half))


def draw_contact(ax: Axes, contact: NDArray[np.bool_], fingers: tuple[str, ...], step_s: float) -> None:
    """Draw one bar per finger over time [s], filled while it touched, the first finger on top.

    Raises:
        InputError: contact is not `(T, F)`, or the names do not match it.
    """
    check_contact(contact, fingers)
    steps, count = contact.shape
    names = fingers or tuple(f"finger {number + 1}" for number in range(count))
    ax.grid(visible=False)
    ax.spines["left"].set_visible(False)
    for row in range(count):
        ax.broken_barh([(0, steps * step_s)], (row + 0.15, 0.7), facecolor="#eceff2", zorder=1.0)
        touching = [(start * step_s, length * step_s) for start, length in true_runs(contact[:, row])]
        ax.broken_barh(touching, (row + 0.15, 0.7), facecolor=INK, alpha=0.8, zorder=2.0)
    ax.set(xlabel="time [s]", xlim=(0, max(steps, 1) * step_s), ylim=(count, 0))
    ax.set_yticks([row + 0.5 for row in range(count)], names)


def orientation_ticks(trial: TrialPath, half_mm: float) -> list[tuple[Array, Array]]:
    """Return both ends `(2,)` [mm] of short ticks, evenly spaced along the arc of the path.

    Args:
        trial: The trial; rows with NaN are left out.
        half_mm: Half the length of a tick [mm].
    """
    finite = np.isfinite(trial.points_mm).all(axis=1) & np.isfinite(trial.rotation_deg)
    points, turned = trial.points_mm[finite], trial.rotation_deg[finite]
    if len(points) == 0:
        return []
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    chosen = np.unique(np.searchsorted(arc, np.linspace(0.0, arc[-1], TICKS)))
    if trial.failed:
        chosen = chosen[:-1]  # the cross stands there
    angles = np.deg2rad(turned[chosen])
    arms = half_mm * np.stack([unit(angles), unit(angles + np.pi / 2)])
    return [(point - arm, point + arm) for each in arms for point, arm in zip(points[chosen], each, strict=True)]


def _target(trial: TrialPath) -> Array:
    """Return the reference `(M, 2)` [mm]: the given one, or a straight line as long as the farthest progress."""
    if trial.target_mm is not None:
        return trial.target_mm
    along = unit(np.deg2rad(trial.angle_deg))
    progress = trial.points_mm @ along
    length = float(np.max(progress[np.isfinite(progress)], initial=10.0))
    return np.stack([np.zeros(2), length * along])


def _extent(trial: TrialPath, outline: SceneOutline | None) -> Extent:
    """Return a square around path and target, and around the object too where it is drawn [mm]."""
    drawn = [trial.points_mm, _target(trial), np.zeros((1, 2))]
    if outline is not None:
        drawn.append(np.asarray(outline.object, dtype=float) - outline.origin_mm)
    return square_of(np.concatenate(drawn), 8.0, least_mm=25.0)


def _handles(trial: TrialPath, outline: SceneOutline | None) -> list[Artist]:
    """Return the legend: only what this trial shows."""
    colour = direction_colour(trial.angle_deg)
    handles: list[Artist] = [
        Line2D([], [], color=colour, linewidth=2.2, label=trial.name),
        Line2D([], [], color=MUTED, linewidth=1.1, linestyle="--", label="target"),
        Line2D([], [], color=darker(colour, 0.4), linestyle="none", marker="+", markersize=8, label="object's axes"),
    ]
    if trial.failed:
        handles.append(Line2D([], [], color=darker(colour, 0.35), linestyle="none", marker="x", label="contact lost"))
    if outline is not None:
        handles.append(scene_key("object at start"))
    if trial.contact is not None:
        handles.append(Patch(facecolor=INK, alpha=0.8, label="finger touches"))
    return handles
