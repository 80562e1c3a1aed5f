"""A moving picture of one trial in space, drawn from its true geometry without GL: GIF through Pillow, MP4 by ffmpeg.

Seen from far away a ball is a circle and a rod with round ends a stadium, whichever way they lie, and of a convex body
the faces are seen that look at the viewer. So every part is drawn as it is, the far ones first.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.folders import in_place
from inhand.geometry import Array
from inhand.plots.replay import Film, Moving, empty_text, titled, view_box, writer_of
from inhand.plots.sheet import STYLE, halo
from inhand.plots.style import INK, MUTED, TICK_POINTS, series_look

VIEW_DEG = (24.0, -62.0)
"""From how high above the palm's plane, and from which side of it, the viewer looks [deg]."""
LIGHT = np.array([0.35, -0.45, 0.82])
"""Where light comes from."""
PIECES = 4
"""Parts of a rod that are sorted by their depth on their own."""
ARC = 9
"""Corners of half a circle."""
PALM, OBJECT = "#aab2ba", "#f0a33c"
FPS = 25
"""Frames a second."""
AXIS_MM = 25.0
"""Length of the palm's axes that are drawn [mm]."""


@dataclass(frozen=True, eq=False)
class SolidFrame:
    """A hand in space and its object at one instant, in mm from the object's start."""

    rods: Array
    """Ends and radius of links and tips `(R, 7)`; both ends of a ball are one."""
    fingers: NDArray[np.int64]
    """The finger of each `(R,)`."""
    faces: tuple[Array, ...]
    """Corners `(K, 3)` of the object's faces, counter-clockwise seen from outside."""
    palm: tuple[Array, ...]
    """The same of the palm."""


def write_spatial_replay(
    frames: Sequence[SolidFrame],
    trail_mm: Array,
    out: Path,
    *,
    title: str,
    target_mm: Array,
    texts: Sequence[str],
    contact: NDArray[np.bool_],
    frame_s: float,
    fingers: tuple[str, ...],
) -> Path:
    """Write an animated replay of one trial in space and return its path; the file appears whole or not at all.

    Args:
        frames: hand and object at each of the N instants.
        trail_mm: where the object was `(N, 3)` [mm] from its start.
        out: file to write: .gif, or .mp4 where an `ffmpeg` program is on the PATH.
        title: written above the picture.
        target_mm: the reference path `(M, 3)` [mm].
        texts: what to write at each instant.
        contact: whether each finger touched at each instant `(N, F)`.
        frame_s: time between two instants of the trial [s].
        fingers: names of the fingers.

    Raises:
        InputError: no frame, arrays of different lengths, another suffix, or no ffmpeg for .mp4.
    """
    _check(frames, trail_mm, texts, contact)
    write, across, up = writer_of(out), *_screen()
    screen = np.stack([across, up], axis=-1)
    with mpl.rc_context(STYLE), in_place(out) as part:
        figure, strips = titled(title, contact, frame_s, fingers)
        ax = view_box(figure)
        _limits(ax, _points(frames) @ screen)
        (line,) = ax.plot(*(target_mm @ screen).T, "--", color=MUTED, linewidth=1.1)
        over = Moving((line, *_draw_axes(ax, frames[0], screen)), lambda _: None)  # stands still, above the bodies
        parts = [_bodies(ax, frames), over, _trail(ax, trail_mm @ screen), *strips]
        write(Film(figure, parts, empty_text(ax), texts), part, FPS)
    return out


def _check(frames: Sequence[SolidFrame], trail_mm: Array, texts: Sequence[str], contact: NDArray[np.bool_]) -> None:
    """Refuse nothing to show, and what does not belong together."""
    if not frames or {len(frames)} != {len(trail_mm), len(texts), len(contact)}:
        raise InputError(
            f"{len(frames)} frames with {len(trail_mm)} points, {len(texts)} texts and {len(contact)} rows of contact:"
            " give one or more, and as many of each"
        )


def _screen() -> tuple[Array, Array]:
    """Return the unit vectors across and up the picture `(3,)` each."""
    side = np.deg2rad(VIEW_DEG[1])
    across = np.array([-np.sin(side), np.cos(side), 0.0])
    return across, np.cross(_towards(), across)


def _towards() -> Array:
    """Return the unit vector towards the viewer `(3,)`."""
    height, side = np.deg2rad(VIEW_DEG)
    return np.array([np.cos(height) * np.cos(side), np.cos(height) * np.sin(side), np.sin(height)])


def _points(frames: Sequence[SolidFrame]) -> Array:
    """Return points `(N, 3)` [mm] between which all is drawn: bodies in all frames, the palm and its axes."""
    bodies = [part for frame in frames for part in (frame.rods[:, :3], frame.rods[:, 3:6], *frame.faces)]
    palm = np.concatenate(frames[0].palm)
    return np.concatenate([*bodies, palm, palm + np.array([AXIS_MM, -8.0, 0.0])])


def _limits(ax: Axes, points: Array) -> None:
    """Give axes equal mm that hold all points."""
    low, high = points.min(axis=0) - 14.0, points.max(axis=0) + 14.0
    box = ax.get_window_extent()
    scale = float(((high - low) / (box.width, box.height)).max()) / 2
    (x, y), wide, tall = (low + high) / 2, scale * box.width, scale * box.height
    ax.set(xlim=(x - wide, x + wide), ylim=(y - tall, y + tall), aspect="equal")
    ax.axis("off")


def _bodies(ax: Axes, frames: Sequence[SolidFrame]) -> Moving:
    """Return the hand and the object, which move."""
    shown = PolyCollection([], linewidths=0.5, zorder=2.0)
    ax.add_collection(shown)

    def show(number: int) -> None:
        outlines, colours, edges = painted(frames[number])
        shown.set_verts(outlines)
        shown.set(facecolor=colours, edgecolor=edges)

    show(0)
    return Moving((shown,), show)


def painted(frame: SolidFrame) -> tuple[list[Array], list[Array], list[Array]]:
    """Return outlines `(K, 2)` [mm] in the picture, their colours and those of their edges, the farthest first."""
    towards, (across, up) = _towards(), _screen()
    screen = np.stack([across, up], axis=-1)
    drawn: list[tuple[float, Array, Array, Array]] = []
    for faces, colour in ((frame.palm, PALM), (frame.faces, OBJECT)):
        depth = float(np.concatenate(faces).mean(axis=0) @ towards)
        for face in faces:
            normal = np.cross(face[1] - face[0], face[2] - face[1])
            normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
            if normal @ towards > 0:
                tone = _lit(colour, float(normal @ LIGHT))
                drawn.append((depth, face @ screen, tone, tone if len(faces) > 12 else 0.7 * tone))
    for rod, finger in zip(frame.rods, frame.fingers.tolist(), strict=True):
        tone = _lit(series_look(finger).colour, 0.55)
        for one, two in _pieces(rod):
            outline = _stadium(one @ screen, two @ screen, float(rod[6]))
            drawn.append((float((one + two) / 2 @ towards) + 0.3 * float(rod[6]), outline, tone, 0.75 * tone))
    drawn.sort(key=lambda part: part[0])
    return [part[1] for part in drawn], [part[2] for part in drawn], [part[3] for part in drawn]


def _pieces(rod: Array) -> list[tuple[Array, Array]]:
    """Return a rod's ends, or those of its parts, `(3,)` each."""
    start, end = rod[:3], rod[3:6]
    if np.array_equal(start, end):
        return [(start, end)]
    cuts = [start + share * (end - start) for share in np.linspace(0.0, 1.0, PIECES + 1)]
    return list(pairwise(cuts))


def _lit(colour: str, light: float) -> Array:
    """Return a colour `(3,)` as bright as light falls on it."""
    return np.clip(np.array(to_rgb(colour)) * (0.72 + 0.34 * light), 0.0, 1.0)


def _stadium(one: Array, two: Array, radius: float) -> Array:
    """Return the outline `(K, 2)` of all points within a radius of a line."""
    way = two - one
    angle = np.arctan2(way[1], way[0]) if np.any(way) else 0.0
    half = np.linspace(-np.pi / 2, np.pi / 2, ARC)
    ends = [(two, angle), (one, angle + np.pi)]
    return np.concatenate([end + radius * np.stack([np.cos(half + a), np.sin(half + a)], axis=-1) for end, a in ends])


def _draw_axes(ax: Axes, frame: SolidFrame, screen: Array) -> list[Artist]:
    """Draw the palm's axes beside it, with the names of the directions, and return what was drawn."""
    artists: list[Artist] = []
    corners = np.concatenate(frame.palm)
    origin = np.array([corners[:, 0].max() + 8.0, corners[:, 1].min() - 8.0, corners[:, 2].max()])
    for axis, name in zip(np.eye(3), ("Right", "Out", "Up"), strict=True):
        line = np.stack([origin, origin + AXIS_MM * axis]) @ screen
        artists += ax.plot(*line.T, color=INK, linewidth=1.0)
        x, y = line[0] + 1.25 * (line[1] - line[0])
        look: dict[str, Any] = {"fontsize": TICK_POINTS - 1.5, "color": MUTED, "ha": "center", "va": "center"}
        artists.append(ax.text(x, y, name, **look, path_effects=halo()))
    return artists


def _trail(ax: Axes, trail: Array) -> Moving:
    """Return the way so far."""
    (line,) = ax.plot([], [], color=INK, linewidth=2.0, path_effects=halo(4.0), zorder=4.5)
    return Moving((line,), lambda number: line.set_data(*trail[: number + 1].T))
