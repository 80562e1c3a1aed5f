"""The hand and the object drawn to scale, moving them, and the marks and extents of all axes in mm."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.plots.sheet import Size, halo
from inhand.plots.style import darker

CROSS_POINTS = 6.5
"""Width of the cross that marks a lost contact [pt]."""
WALL: dict[str, Any] = {"facecolor": "#e3e7eb", "edgecolor": "#8a949e", "hatch": "////"}
"""The look of a wall."""

Extent: TypeAlias = tuple[float, float, float, float]
"""What axes show: left, right, bottom and top [mm], origin at the object's start."""


def check_points(points: Array, what: str) -> None:
    """Check that an array is a list of planar points.

    Args:
        points: The array to look at; it may be empty and may hold NaN.
        what: The name the error text gives it.

    Raises:
        InputError: the shape is not `(N, 2)`.
    """
    shape = np.shape(points)
    if len(shape) != 2 or shape[1] != 2:
        raise InputError(f"{what} has shape {shape}; it must be (N, 2): give one row of x and y [mm] per point")


@dataclass(frozen=True, eq=False)
class SceneOutline:
    """The hand and the object at one instant, seen from above, in the palm frame [mm].

    Raises:
        InputError: an outline is not `(K, 2)`, or the origin is not two numbers.
    """

    links: tuple[Array, ...]
    """Outline `(K, 2)` of each finger link [mm]; an open list of corners, closed when drawn."""
    palm: Array
    """Outline `(K, 2)` of the palm [mm]."""
    object: Array
    """Outline `(K, 2)` of the object [mm]."""
    joints: Array
    """Centres `(J, 2)` of the joints [mm]."""
    origin_mm: Array
    """Where the object started `(2,)` [mm]; every figure puts its origin there."""
    fingers: tuple[str, ...] = ()
    """Names of the fingers, for what tells of contact."""

    def __post_init__(self) -> None:
        """Check every shape once, where the outline is made."""
        for number, link in enumerate(self.links):
            check_points(link, f"outline of link {number}")
        check_points(self.palm, "outline of the palm")
        check_points(self.object, "outline of the object")
        check_points(self.joints, "joint centres")
        if np.shape(self.origin_mm) != (2,):
            raise InputError(f"origin_mm has shape {np.shape(self.origin_mm)}; give the object's start as (2,) [mm]")


@dataclass(frozen=True)
class SceneLook:
    """Colours of a drawn scene."""

    hand: str
    hand_edge: str
    object: str
    object_edge: str
    line_points: float


FAINT = SceneLook(hand="#f4f5f7", hand_edge="#d9dee3", object="#eceff2", object_edge="#c3cad1", line_points=0.8)
"""Behind paths: there to give the scale, never in the way."""
CLEAR = SceneLook(hand="#d5dbe1", hand_edge="#8a949e", object="#f5c26b", object_edge="#a86f12", line_points=1.1)
"""Where the scene itself is the picture, as in a replay."""


@dataclass(frozen=True, eq=False)
class SceneArtists:
    """The patches of one drawn scene, kept to be moved."""

    links: tuple[Polygon, ...]
    palm: Polygon
    object: Polygon
    joints: Line2D

    def all(self) -> tuple[Polygon | Line2D, ...]:
        """Return every artist, back to front."""
        return (self.palm, *self.links, self.joints, self.object)


def draw_scene(ax: Axes, outline: SceneOutline, look: SceneLook = FAINT) -> SceneArtists:
    """Draw the hand and the object to scale, origin at the object's start, and return the artists."""

    def patch(corners: Array, fill: str, edge: str, layer: float) -> Polygon:
        shape = Polygon(_shifted(corners, outline), closed=True, facecolor=fill, edgecolor=edge, zorder=layer)
        shape.set(linewidth=look.line_points, joinstyle="round")
        return shape

    joints = Line2D(*_shifted(outline.joints, outline).T, linestyle="none", marker="o", markersize=3.5, zorder=1.2)
    joints.set(markerfacecolor="white", markeredgecolor=look.hand_edge, markeredgewidth=look.line_points)
    artists = SceneArtists(
        links=tuple(patch(link, look.hand, look.hand_edge, 1.1) for link in outline.links),
        palm=patch(outline.palm, look.hand, look.hand_edge, 1.0),
        object=patch(outline.object, look.object, look.object_edge, 1.3),
        joints=joints,
    )
    for polygon in (artists.palm, *artists.links, artists.object):
        ax.add_patch(polygon)
    ax.add_line(artists.joints)
    return artists


def move_scene(artists: SceneArtists, outline: SceneOutline) -> None:
    """Move the patches of a drawn scene to another instant of the same hand and object.

    Raises:
        InputError: the number of links differs from the drawn one.
    """
    if len(outline.links) != len(artists.links):
        raise InputError(
            f"outline with {len(outline.links)} links given to a drawing of {len(artists.links)}: "
            "all frames of a replay must show the same hand"
        )
    for polygon, link in zip(artists.links, outline.links, strict=True):
        polygon.set_xy(_shifted(link, outline))
    artists.palm.set_xy(_shifted(outline.palm, outline))
    artists.object.set_xy(_shifted(outline.object, outline))
    artists.joints.set_data(*_shifted(outline.joints, outline).T)


def scene_points(outline: SceneOutline) -> Array:
    """Return every corner `(N, 2)` of a scene [mm], origin at the object's start."""
    return _shifted(np.concatenate([*outline.links, outline.palm, outline.object]), outline)


def extent_of(points: Array, margin_mm: float, least_mm: float = 20.0) -> Extent:
    """Return the box around points `(N, 2)` [mm], widened by a margin; NaN rows do not count.

    Args:
        points: The points [mm]; with none that is finite the box stands around the origin.
        margin_mm: Added on every side [mm].
        least_mm: The box reaches at least this far from its middle on every side [mm].
    """
    finite = points[np.isfinite(points).all(axis=1)]
    if len(finite) == 0:
        finite = np.zeros((1, 2))
    low, high = finite.min(axis=0) - margin_mm, finite.max(axis=0) + margin_mm
    middle, half = (low + high) / 2, np.maximum((high - low) / 2, least_mm)
    low, high = middle - half, middle + half
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def square_of(points: Array, margin_mm: float, least_mm: float = 20.0) -> Extent:
    """Return the square around points `(N, 2)` [mm], as `extent_of` its box."""
    left, right, bottom, top = extent_of(points, margin_mm, least_mm)
    x, y, half = (left + right) / 2, (bottom + top) / 2, max(right - left, top - bottom) / 2
    return x - half, x + half, y - half, y + half


def show_extent(ax: Axes, extent: Extent) -> None:
    """Make axes show that extent [mm], equal both ways."""
    ax.set(xlabel="x [mm]", ylabel="y [mm]", xlim=extent[:2], ylim=extent[2:])
    ax.set_aspect("equal", adjustable="box")


def size_of(extent: Extent, width_in: float) -> Size:
    """Return the size [in] of axes of a width that show an extent to scale, unless that is very flat or very tall."""
    return width_in, width_in * float(np.clip((extent[3] - extent[2]) / (extent[1] - extent[0]), 0.6, 1.4))


def joined(extents: Sequence[Extent]) -> Extent:
    """Return the smallest extent [mm] that shows several whole."""
    left, right, bottom, top = zip(*extents, strict=True)
    return min(left), max(right), min(bottom), max(top)


def draw_cross(ax: Axes, place: Array, colour: str, marker: str = "x", points: float = CROSS_POINTS) -> None:
    """Mark where something went wrong `(2,)` [mm] with a cross in a darker colour."""
    (cross,) = ax.plot(*place, marker=marker, markersize=points, linestyle="none", path_effects=halo(3.2), zorder=5.0)
    cross.set(color=darker(colour, 0.35), markeredgewidth=0.0 if marker == "X" else 1.8)


def scene_key(label: str) -> Patch:
    """Return the legend entry of a scene drawn behind paths."""
    return Patch(facecolor=FAINT.object, edgecolor=FAINT.object_edge, label=label)


def _shifted(points: Array, outline: SceneOutline) -> Array:
    return np.asarray(points, dtype=float) - outline.origin_mm
