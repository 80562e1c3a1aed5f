"""The asterisk in space: distances and shares of the limit in three planes and on maps of all directions, and turns.

Three planes and two maps of the sphere carry the numbers; the solid view gives an impression and comes second.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize, to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D
from scipy.spatial import ConvexHull

from inhand.geometry import Array
from inhand.plots.sheet import STYLE, halo, new_figure, sheet
from inhand.plots.style import GRID, INK, LABEL_POINTS, MUTED, RULE, TICK_POINTS, TITLE_POINTS

AXES = (("Left", "Right"), ("In", "Out"), ("Down", "Up"))
"""Names of the directions against and along x, y and z of the palm."""
PLANES = ((0, 1), (0, 2), (1, 2))
"""Which axes a plane shows, across and up."""
HALVES = {1.0: "away from the palm (Up in the middle)", -1.0: "towards the palm (Down in the middle)"}
"""What the maps of the directions of positive and of negative z show."""
IN_PLANE = 1e-6
"""A direction lies in a plane where its part across is less than this."""
PLANE_IN, MAP_IN, SOLID_IN = 2.7, 2.7, 6.4
"""Sides of a plane, a map and the solid view [in]."""
SPACE_IN = 0.35
"""Free space between the key of the maps and the turns [in], besides what is between all axes."""
SHARE = Normalize(0.5, 1.0)
"""Shares of the limit from one end of the colours to the other."""
MANY = 98
"""From so many directions on a map is filled in between: fewer would show colours that nobody measured."""
LEAST_MM = 20.0
"""Half the side of a plane shows at least this far [mm]."""


@dataclass(frozen=True, eq=False)
class SpatialCurve:
    """The mean path of one direction in space."""

    name: str
    direction: Array
    """Unit vector `(3,)`."""
    points_mm: Array
    """Mean path `(N, 3)` from the start [mm]."""
    distance_mm: float
    """Mean distance [mm]."""
    limit_mm: float | None = None
    """How far the hand could go [mm]."""
    failed: bool = False
    """Whether a trial lost its object."""

    @property
    def share(self) -> float:
        """Share of the limit, NaN where there is none."""
        return self.distance_mm / self.limit_mm if self.limit_mm else np.nan


@dataclass(frozen=True)
class Turned:
    """How far the object was turned about one axis."""

    name: str
    mean_deg: float
    limit_deg: float | None = None
    failed: bool = False


def spatial_figure(curves: Sequence[SpatialCurve], turns: Sequence[Turned], title: str, subtitle: str) -> Figure:
    """Return the figure of a run in space: planes above, maps of directions and turns below.

    A part without anything to show is left out.
    """
    rows = [[(PLANE_IN, PLANE_IN)] * 3 + [(0.12, PLANE_IN)]] if curves else []
    below = [(MAP_IN, MAP_IN)] * 2 + [(0.12, MAP_IN)] if curves else []
    below += [(SPACE_IN, 0.1)] * bool(curves and turns) + [(2.3, 0.34 * len(turns) + 0.3)] * bool(turns)
    with sheet([*rows, below], title, subtitle, gap=(0.62, 0.85)) as (figure, axes):
        left = list(axes)
        if curves:
            largest = _largest(curves)
            for ax, plane in zip(left[:3], PLANES, strict=True):
                _draw_plane(ax, curves, plane, largest)
            _bar(figure, left[3], ScalarMappable(SHARE, _colours()), "share of the limit")
            distance = Normalize(0.0, max(curve.distance_mm for curve in curves))
            for ax, way in zip(left[4:6], HALVES, strict=True):
                _draw_map(ax, curves, way, distance)
            _bar(figure, left[6], ScalarMappable(distance, "YlGnBu"), "distance [mm]")
            left = left[7:]
        if curves and turns:
            left.pop(0).axis("off")
        if turns:
            _draw_turns(left[0], turns)
    return figure


def _colours() -> Colormap:
    return mpl.colormaps["viridis"]


def _look(curve: SpatialCurve) -> tuple[float, float, float, float] | str:
    """Return the colour of a curve: by its share, grey without a limit."""
    return _colours()(SHARE(curve.share)) if np.isfinite(curve.share) else MUTED


def colour_of(curve: SpatialCurve) -> str:
    """Return the same for a page."""
    return to_hex(_look(curve))


def in_plane(curve: SpatialCurve, plane: tuple[int, int]) -> bool:
    """Return whether a direction lies in the plane of two axes."""
    across = ({0, 1, 2} - set(plane)).pop()
    return bool(abs(curve.direction[across]) < IN_PLANE)


def on_half(curve: SpatialCurve, way: float) -> bool:
    """Return whether a direction is on the map of one half, on whose rim are those of both."""
    return bool(way * curve.direction[2] > -IN_PLANE)


def _largest(curves: Sequence[SpatialCurve]) -> float:
    return max(LEAST_MM, *(max(curve.distance_mm, curve.limit_mm or 0.0) for curve in curves)) * 1.16


def _bar(figure: Figure, ax: Axes, mapping: ScalarMappable, text: str) -> None:
    """Draw the key of colours into axes of its own."""
    bar = figure.colorbar(mapping, cax=ax)
    bar.set_label(text, fontsize=TICK_POINTS)
    ax.set_frame_on(False)


def _draw_plane(ax: Axes, curves: Sequence[SpatialCurve], plane: tuple[int, int], largest: float) -> None:
    """Draw the directions that lie in a plane: their mean paths, the limits joined, the distances beside the ends."""
    a, b = plane
    mine = [curve for curve in curves if in_plane(curve, plane)]
    mine.sort(key=lambda curve: np.arctan2(curve.direction[b], curve.direction[a]))
    limits = np.array([curve.direction[[a, b]] * (curve.limit_mm or np.nan) for curve in mine]).reshape(-1, 2)
    if len(limits) > 2:
        ax.plot(*np.concatenate([limits, limits[:1]]).T, color=RULE, linewidth=1.0, zorder=1.5)
    for curve in mine:
        ax.plot(*curve.points_mm[:, [a, b]].T, color=_look(curve), linewidth=2.6, zorder=2.0)
        if curve.failed:
            ax.plot(*curve.points_mm[-1, [a, b]], "x", color="#d1242f", markersize=6, markeredgewidth=1.6, zorder=3.0)
        x, y = curve.direction[[a, b]] * (max(curve.distance_mm, curve.limit_mm or 0.0) + 0.085 * largest)
        ax.text(x, y, f"{curve.distance_mm:.0f}", fontsize=TICK_POINTS - 1, ha="center", va="center", zorder=4.0)
    ax.set(xlim=(-largest, largest), ylim=(-largest, largest), aspect="equal")
    name_plane(ax, a, b)


def name_plane(ax: Axes, a: int, b: int) -> None:
    """Write on axes of a plane, along axes a and b of the palm, what they are and which way they go."""
    ax.set_xlabel(f"{AXES[a][0]}  ·  {AXES[a][1]} [mm]", fontsize=TICK_POINTS)
    ax.set_ylabel(f"{AXES[b][0]}  ·  {AXES[b][1]} [mm]", fontsize=TICK_POINTS)
    ax.set_title(f"{AXES[a][1]} and {AXES[b][1]}", fontsize=LABEL_POINTS)
    ax.tick_params(labelsize=TICK_POINTS - 1.5)


def _draw_map(ax: Axes, curves: Sequence[SpatialCurve], way: float, distance: Normalize) -> None:
    """Draw half of all directions on a map of equal areas, the palm's normal in its middle, Right at the right."""
    ax.set_title(HALVES[way], fontsize=TICK_POINTS)
    if len(curves) >= MANY:
        _fill(ax, curves, way, distance)
    ax.add_patch(Circle((0, 0), 1.0, fill=False, edgecolor=RULE, linewidth=0.9))
    few = len(curves) < MANY
    for curve in curves:
        if not on_half(curve, way):
            continue
        x, y = on_map(curve.direction, way)
        colour = mpl.colormaps["YlGnBu"](distance(curve.distance_mm))
        edge = "#d1242f" if curve.failed else INK
        ax.plot(x, y, "o", color=colour, markersize=11 if few else 4, markeredgecolor=edge, markeredgewidth=0.7)
        if few:
            ax.annotate(
                f"{curve.distance_mm:.0f}", (x, y), (0, -11), textcoords="offset points", ha="center", va="center",
                fontsize=TICK_POINTS - 1.5, path_effects=halo(2.0),
            )  # fmt: skip
    for text, (x, y) in zip(AXES[0] + AXES[1], ((-1.27, 0.0), (1.27, 0.0), (0.0, -1.28), (0.0, 1.14)), strict=True):
        ax.text(x, y, text, ha="center", va="center", fontsize=TICK_POINTS - 1, color=MUTED)
    ax.set(xlim=(-1.4, 1.4), ylim=(-1.38, 1.25), aspect="equal")
    ax.axis("off")


def on_map(direction: Array, way: float) -> Array:
    """Return where directions `(..., 3)` lie on the map of one half `(..., 2)`, whose rim is a circle of radius 1.

    It is Lambert's azimuthal projection, which keeps areas: at angle t from the middle the radius is sqrt(2) sin(t/2).
    """
    angle = np.arccos(np.clip(way * direction[..., 2], -1.0, 1.0))
    flat = np.linalg.norm(direction[..., :2], axis=-1)
    share = np.sqrt(2.0) * np.sin(angle / 2) / np.maximum(flat, 1e-12)
    return np.asarray(direction[..., :2] * share[..., None])


def _fill(ax: Axes, curves: Sequence[SpatialCurve], way: float, distance: Normalize) -> None:
    """Colour a map between its directions by the means of those near by."""
    grid = np.linspace(-1.0, 1.0, 201)
    x, y = np.meshgrid(grid, grid)
    radius = np.hypot(x, y)
    angle = 2 * np.arcsin(np.clip(radius, 0.0, 1.0) / np.sqrt(2.0))
    flat = np.sin(angle) / np.maximum(radius, 1e-12)
    looked = np.stack([x * flat, y * flat, way * np.cos(angle)], axis=-1)
    apart = np.arccos(np.clip(looked @ np.array([curve.direction for curve in curves]).T, -1.0, 1.0))
    weight = 1.0 / (apart + 0.03) ** 4
    value = (weight @ np.array([curve.distance_mm for curve in curves])) / weight.sum(axis=-1)
    shown = np.ma.masked_where(radius > 1.0, value)
    ax.imshow(shown, extent=(-1, 1, -1, 1), origin="lower", cmap="YlGnBu", norm=distance, interpolation="bilinear")


def _draw_turns(ax: Axes, turns: Sequence[Turned]) -> None:
    """Draw the mean angle turned about each axis over the limit."""
    for row, turn in enumerate(turns):
        limit = turn.limit_deg
        if limit is not None:
            ax.plot([0, limit], [row, row], color=GRID, linewidth=7.0, solid_capstyle="butt")
        colour = _colours()(SHARE(turn.mean_deg / limit)) if limit else MUTED
        ax.plot([0, turn.mean_deg], [row, row], color="#d1242f" if turn.failed else colour, linewidth=3.4)
        ax.text(
            max(turn.mean_deg, limit or 0.0) + 5, row, f"{turn.mean_deg:.0f}°", va="center", fontsize=TICK_POINTS - 1
        )
    farthest = max(max(turn.mean_deg, turn.limit_deg or 0.0) for turn in turns)
    ax.set(xlim=(0, 1.2 * farthest + 10), ylim=(len(turns) - 0.4, -0.6))
    ax.set_yticks(range(len(turns)), [turn.name for turn in turns])
    ax.set_xlabel("turned [deg], limit in grey", fontsize=TICK_POINTS)
    ax.set_title("Turns", fontsize=LABEL_POINTS)
    ax.grid(axis="y", visible=False)
    ax.tick_params(labelsize=TICK_POINTS - 1)


def solid_figure(curves: Sequence[SpatialCurve], title: str, subtitle: str) -> Figure:
    """Return the solid view: all mean paths, the hull of the limits, and shadows of the paths on three walls."""
    with mpl.rc_context(STYLE):
        figure = new_figure(SOLID_IN, SOLID_IN)
        ax: Any = figure.add_axes((0.0, 0.0, 1.0, 0.93), projection="3d")
        largest = _largest(curves)
        _draw_hull(ax, curves)
        for curve in curves:
            ax.plot(*curve.points_mm.T, color=_look(curve), linewidth=2.6)
            ax.scatter(*curve.points_mm[-1], color=_look(curve), s=20, edgecolor=INK, linewidth=0.4, depthshade=False)
            for axis, wall in enumerate((-largest, largest, -largest)):
                shadow = curve.points_mm.copy()
                shadow[:, axis] = wall
                ax.plot(*shadow.T, color=GRID, linewidth=1.1, zorder=0)
        ax.set(xlim=(-largest, largest), ylim=(-largest, largest), zlim=(-largest, largest))
        ax.set_box_aspect((1, 1, 1))
        ax.view_init(22, -58)
        for axis, (low, high), name in zip((ax.xaxis, ax.yaxis, ax.zaxis), AXES, "xyz", strict=True):
            axis.pane.set_facecolor((1, 1, 1, 0))
            axis.set_tick_params(labelsize=TICK_POINTS - 2)
            getattr(ax, f"set_{name}label")(f"{low}  ·  {high} [mm]", fontsize=TICK_POINTS)
        figure.text(0.02, 0.98, title, fontsize=TITLE_POINTS, fontweight="bold", va="top")
        figure.text(0.02, 0.945, subtitle, color=MUTED, va="top")
    return figure


def _draw_hull(ax: Axes3D, curves: Sequence[SpatialCurve]) -> None:
    """Draw the surface between the limits of neighbouring directions, where these lie in no plane."""
    known = [curve for curve in curves if curve.limit_mm]
    directions = np.array([curve.direction for curve in known])
    if len(known) < 4 or np.linalg.matrix_rank(directions - directions[0], tol=IN_PLANE) < 3:
        return
    ends = directions * np.array([curve.limit_mm for curve in known])[:, None]
    faces = [ends[face] for face in ConvexHull(directions).simplices]
    look = {"facecolor": (0.35, 0.45, 0.6, 0.05), "edgecolor": (0.3, 0.35, 0.45, 0.25), "linewidth": 0.5}
    ax.add_collection3d(Poly3DCollection(faces, **look))
