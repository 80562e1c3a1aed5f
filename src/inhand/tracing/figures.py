"""Paths of the object over the plans that they follow, and how far off they were along the way."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from inhand.control.scenes import scene_at
from inhand.control.trial import Trial
from inhand.geometry import Array, transform
from inhand.hands.fit import Held
from inhand.hands.objects import polygon
from inhand.hands.spatial.fit import SpatialHeld
from inhand.plots.shapes import WALL, Extent, draw_cross, draw_scene, extent_of, scene_key, show_extent
from inhand.plots.sheet import sheet
from inhand.plots.style import INK, MUTED, series_look
from inhand.sim.walls import Wall
from inhand.tracing.follow import Followed
from inhand.tracing.plan import Plan
from inhand.tracing.poses import places
from inhand.tracing.run import TraceSetup
from inhand.tracing.trace import Trace, deviations, poses_along, turned_deg

MOST_PANELS = 4
"""Trials that get a panel each where every trial has a plan of its own."""
MOST_COLOURS = 6
"""Trials with a colour each; of more, all but the first share one."""
ONE_IN, SEVERAL_IN = 4.7, 2.9
"""Width of the one panel, and of one of several [in]."""
GAP_IN, PLOT_IN = 0.25, 1.15
"""Room between panels, and height of the axes below [in]."""
LEAST_TURN = 5.0
"""Rotation that is shown at least, each way [deg]."""
FAR_MM = 25.0
"""How far beyond its plan a path is shown [mm]: an object that was thrown goes on."""
TALLEST = 1.1
"""Largest height of a panel, as a share of its width."""
TURNED = 1e-6
"""An object is turned by more than this [rad]."""
MOST_TURNED = 4
"""Turned places of the object on a plan that are outlined."""
BAND, BANDS = "#c3ccd5", (5.6, 3.2)
"""The planned line: its colour, and its widths in a panel of several trials and of one [pt]."""
OTHERS = "#7fa8c9"
"""Trials that have no colour of their own."""
MARKS = {"lost a finger": "x", "left its path": "+", "stuck": "1", "grip ends": "2", "gave up": "3", "object lost": "X"}
"""Crosses of what goes wrong."""


@dataclass(frozen=True, eq=False)
class Path:
    """One trial as it is drawn."""

    followed: Followed
    trace: Trace
    points_mm: Array
    """Object positions in the manipulation phase `(M, 2)`, in space `(M, 3)` [mm] from the object's start."""
    colour: str
    first: bool
    """Whether it is drawn stronger."""
    alone: bool = False
    """Whether it has a panel of its own."""

    @property
    def line_points(self) -> float:
        """Width of its lines [pt]: a strong first one, with the others as thin lines on top of it."""
        if self.alone:
            return 1.1
        return 2.2 if self.first else 0.8

    @property
    def layer(self) -> float:
        """Layer of its lines."""
        return 3.0 if self.first else 3.2

    @property
    def faults(self) -> list[tuple[str, Array]]:
        """What went wrong, and where `(2,)`, in space `(3,)` [mm] from the object's start."""
        origin = self.followed.trial.passport.hand.start_pose
        events = self.followed.events
        found = [(event.what, 1e3 * (np.array(event.place) - origin[: len(event.place)])) for event in events]
        if self.trace.dropped and len(self.points_mm):
            found.append(("object lost", self.points_mm[-1]))
        return found


def trace_figure(
    setup: TraceSetup, followed: Sequence[Followed], traces: Sequence[Trace], title: str = "", subtitle: str = ""
) -> Figure:
    """Return the figure of a run: every path over its plan, below them the error along the way, and the rotation.

    Trials of one plan share a panel. Where each has its own, the first `MOST_PANELS` get a panel each.
    """
    held = setup.held
    if isinstance(held, SpatialHeld):
        raise TypeError("a run in space has a figure of its own")
    shared = one_plan(followed)
    few = len(traces) if shared else 1
    paths = [path_of(k, *each, few=few, alone=not shared) for k, each in enumerate(zip(followed, traces, strict=True))]
    panels = [paths] if shared else [[path] for path in paths[:MOST_PANELS]]
    shown = [path for panel in panels for path in panel]
    width = ONE_IN if len(panels) == 1 else SEVERAL_IN
    extent = _extent(setup, held, shown)
    height = width * (extent[3] - extent[2]) / (extent[1] - extent[0])
    turns = turns_there(shown)
    wide = len(panels) * (width + GAP_IN) - GAP_IN, PLOT_IN
    rows = [[(width, height)] * len(panels), [wide], *([[wide]] if turns else [])]
    with sheet(rows, title, subtitle, gap=(GAP_IN, 0.65), beside=_handles(held, setup.wall, shown)) as (figure, axes):
        for ax, panel in zip(axes, panels, strict=False):
            show_extent(ax, extent)
            _draw_panel(ax, held, setup.wall, panel)
            ax.set_title("" if shared else f"trial {panel[0].trace.trial}", loc="left", fontweight="normal")
        for ax in axes[1 : len(panels)]:
            ax.set_ylabel("")
            ax.tick_params(labelleft=False)
        draw_errors(axes[len(panels)], shown)
        if turns:
            draw_turns(axes[-1], shown, shared=shared)
    return figure


def plan_line(plan: Plan, origin: Array) -> Array:
    """Return the positions `(S, 2)`, in space `(S, 3)` [mm] along a plan, approach included, from an origin [m]."""
    first = places(plan.path.poses.shape[1])
    return np.asarray(1e3 * (plan.path.poses[:, :first] - origin[:first]))


def turns_there(paths: Sequence[Path]) -> bool:
    """Return whether plans turn the object."""
    return any(leg.kind == "turn" for path in paths for leg in path.followed.plan.legs)


def one_plan(followed: Sequence[Followed]) -> bool:
    """Return whether all trials of a run follow the same plan, and so share a panel."""
    return all(each.plan.legs == followed[0].plan.legs for each in followed)


def path_of(number: int, followed: Followed, trace: Trace, *, few: int, alone: bool = False) -> Path:
    """Return a trial as it is drawn, in a colour of its own if it is the first or one of few."""
    poses = poses_along(followed)
    first = places(poses.shape[1])
    points = 1e3 * (poses[:, :first] - followed.trial.passport.hand.start_pose[:first])
    colour = series_look(number).colour if few <= MOST_COLOURS or number == 0 else OTHERS
    return Path(followed, trace, points, colour, number == 0, alone)


def _extent(setup: TraceSetup, held: Held, paths: Sequence[Path]) -> Extent:
    """Return what the panels show: plans, paths unless they go far, the object at its start, and a wall [mm]."""
    origin = held.start[:2]
    plans = np.concatenate([plan_line(path.followed.plan, origin) for path in paths])
    far = plans.min(axis=0) - FAR_MM, plans.max(axis=0) + FAR_MM
    drawn = [plans, 1e3 * polygon(held.object), *(np.clip(path.points_mm, *far) for path in paths)]
    drawn += [corners for path in paths for corners in _turned(held, path.followed.plan)]
    if setup.wall is not None:
        drawn.append(wall_mm(setup.wall, origin))
    left, right, bottom, top = extent_of(np.concatenate(drawn), 7.0, least_mm=30.0)
    wider = max((top - bottom) / TALLEST - (right - left), 0.0) / 2
    return left - wider, right + wider, bottom, top


def _draw_panel(ax: Axes, held: Held, wall: Wall | None, paths: Sequence[Path]) -> None:
    """Draw hand and object at the start, the plan that paths share, the paths, and where something went wrong."""
    trial, origin = paths[0].followed.trial, held.start[:2]
    if isinstance(trial, Trial):
        draw_scene(ax, scene_at(trial, trial.onset, origin))
    if wall is not None:
        ax.add_patch(Polygon(wall_mm(wall, origin), **WALL, linewidth=0.9, zorder=1.25))
    plan = paths[0].followed.plan
    for corners in _turned(held, plan):
        ax.add_patch(Polygon(corners, fill=False, edgecolor=MUTED, linewidth=0.8, linestyle=":", zorder=1.9))
    ends = [leg.end[:2] for leg in plan.legs[max(plan.approach - 1, 0) :] if leg.kind != "press"]
    ax.plot(*plan_line(plan.measured(), origin).T, color=BAND, linewidth=BANDS[paths[0].alone], zorder=2.0)
    if plan.approach:
        ways = np.concatenate([[plan.legs[0].start[:2]], [leg.end[:2] for leg in plan.legs[: plan.approach]]])
        ax.plot(*(1e3 * (ways - origin)).T, color=MUTED, linewidth=1.0, linestyle="--", alpha=0.7, zorder=2.1)
    ax.plot(*(1e3 * (np.array(ends) - origin)).T, "o", color=INK, markersize=2.4, zorder=3.6)
    for path in reversed(paths):
        draw_path(ax, path)
    ax.plot(0, 0, "o", markersize=4.4, color=INK, markerfacecolor="white", zorder=4.5)


def draw_path(ax: Axes, path: Path, plane: tuple[int, int] = (0, 1)) -> None:
    """Draw one trial's path in a plane of two axes, its approach lighter, and a cross where something went wrong."""
    begun = int(np.argmax(path.followed.legs >= path.followed.plan.approach)) if len(path.followed.legs) else 0
    missed = not (path.followed.legs >= path.followed.plan.approach).any()
    parts = [(path.points_mm[: len(path.points_mm) if missed else begun + 1], 0.45)]
    if not missed:
        parts.append((path.points_mm[begun:], 1.0))
    for points, alpha in parts:
        ax.plot(
            *points[:, list(plane)].T, color=path.colour, alpha=alpha, linewidth=path.line_points, zorder=path.layer
        )
    for what, place in path.faults:
        draw_cross(ax, place[list(plane)], path.colour, MARKS[what], 8.0)


def draw_errors(ax: Axes, paths: Sequence[Path]) -> None:
    """Draw how far each path was from its plan over the way along it."""
    most, longest = 1.0, 10.0
    for path in reversed(paths):
        rows = deviations(path.followed)
        ax.plot(1e3 * rows.way, 1e3 * rows.off, color=path.colour, linewidth=path.line_points, zorder=path.layer)
        most = max(most, 1.1e3 * float(rows.off.max(initial=0.0)))
        longest = max(longest, 1e3 * float(path.followed.plan.measured().way[-1]))
    if not any((path.followed.legs >= path.followed.plan.approach).any() for path in paths):
        told = "no trial came to the end of the approach"
        ax.text(0.5, 0.45, told, transform=ax.transAxes, ha="center", color=MUTED)
    ax.set(
        xlabel="way along the plan [mm]", ylabel="error [mm]", xlim=(-0.01 * longest, 1.01 * longest), ylim=(0, most)
    )


def draw_turns(ax: Axes, paths: Sequence[Path], *, shared: bool) -> None:
    """Draw each object's rotation over time, and dashed where its plan wants it; of one plan the first trial's."""
    ax.set(xlabel="time since the plan began [s]", ylabel="rotation [°]")
    for path in reversed(paths):
        theta = turned_deg(poses_along(path.followed))
        time = np.arange(1, len(theta) + 1) * path.followed.trial.passport.period
        ax.plot(time, theta, color=path.colour, linewidth=path.line_points, zorder=path.layer)
        if path.first or not shared:
            legs = path.followed.plan.legs
            wanted = [legs[min(leg, len(legs) - 1)].end for leg in path.followed.legs.tolist()]
            colour = MUTED if shared else path.colour
            ax.step(
                time,
                turned_deg(np.array(wanted)),
                color=colour,
                linewidth=1.1,
                linestyle="--",
                where="post",
                zorder=2.5,
            )
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, -LEAST_TURN), max(high, LEAST_TURN))


def _turned(held: Held, plan: Plan) -> list[Array]:
    """Return the outlines of the object where a plan has it turned [mm]; none where those are many."""
    ends = [leg.end for leg in plan.legs if leg.kind != "press" and leg.end[:2] != plan.legs[0].start[:2]]
    there = dict.fromkeys(place for place in ends if abs(place[2]) > TURNED)
    outlines = [1e3 * (transform(np.array(place), polygon(held.object)) - held.start[:2]) for place in there]
    return outlines if len(outlines) <= MOST_TURNED else []


def wall_mm(wall: Wall, origin: Array) -> Array:
    """Return the corners `(4, 2)` [mm] of a wall from an origin `(2,)` [m]."""
    return np.asarray(1e3 * (wall.outline - origin))


def handles_of(paths: Sequence[Path]) -> list[Artist]:
    """Return the legend of plans and paths: only what is drawn."""
    handles: list[Artist] = []
    for path in paths if len(paths) <= MOST_COLOURS else paths[:2]:
        number, rms = path.trace.trial, path.trace.rms_mm
        rest = len(paths) > MOST_COLOURS and not path.first
        text = f"trials 2 to {len(paths)}" if rest else f"trial {number}"
        text += f": RMS {rms:.2f} mm" if np.isfinite(rms) and not rest else ""
        handles.append(Line2D([], [], color=path.colour, linewidth=path.line_points, label=text))
    plans = [path.followed.plan for path in paths]
    handles.append(Line2D([], [], color=BAND, linewidth=BANDS[paths[0].alone], label="plan"))
    if any(plan.approach for plan in plans):
        handles.append(Line2D([], [], color=MUTED, linewidth=1.0, linestyle="--", label="approach"))
    handles.append(Line2D([], [], color=INK, linestyle="none", marker="o", markersize=2.6, label="ends of primitives"))
    found = {what for path in paths for what, _ in path.faults}
    return handles + [
        Line2D([], [], color=INK, linestyle="none", marker=mark, markersize=7, label=what)
        for what, mark in MARKS.items()
        if what in found
    ]


def _handles(held: Held, wall: Wall | None, paths: Sequence[Path]) -> list[Artist]:
    """Return the legend of the plane, where a scene is drawn as well."""
    handles = handles_of(paths)
    if any(_turned(held, path.followed.plan) for path in paths):
        handles.append(Patch(fill=False, edgecolor=MUTED, linestyle=":", label="object turned, as planned"))
    if wall is not None:
        handles.append(Patch(label="wall", **WALL))
    return [*handles, scene_key("hand, object at start")]
