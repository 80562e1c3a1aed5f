"""A moving picture of one trial, drawn from the hand's own outlines: GIF through Pillow, MP4 through ffmpeg."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeAlias

import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from matplotlib.transforms import BboxBase
from numpy.typing import NDArray
from PIL import Image

from inhand.errors import InputError
from inhand.geometry import Array, unit
from inhand.plots.path import check_contact, draw_contact
from inhand.plots.save import written_whole
from inhand.plots.shapes import (
    CLEAR,
    SceneArtists,
    SceneOutline,
    check_points,
    draw_scene,
    extent_of,
    move_scene,
    scene_points,
)
from inhand.plots.style import (
    INK,
    MUTED,
    TICK_POINTS,
    axes_box,
    direction_colour,
    dress_axes,
    new_figure,
    write_heading,
)

SIDE_IN = 4.8
"""Width and height of a frame [in]; at the 100 dpi of `new_figure` that is 480 pixels."""
COLOURS = 96
"""Colours of a GIF: enough for smooth edges, few enough for a small file."""
NEARLY_WHITE = 246
"""From here on a colour of the palette is made white: Pillow looks colours up by their upper six bits, so that a
near white would win over white itself."""
SAMPLES = 8
"""Frames looked at to choose the colours."""
FASTEST_FPS = 50
"""GIF counts hundredths of a second, and browsers slow down anything below two of them."""
WALL = "#e3e7eb", "#8a949e"
"""Fill and edge of a wall."""
HOLD_S = 1.0
"""How long the last frame stays before the picture starts again [s]."""


class Canvas(Protocol):
    """What a replay uses of matplotlib's Agg canvas, which carries no annotations."""

    def draw(self) -> None:
        """Draw everything that does not move."""

    def get_renderer(self) -> RendererBase:
        """Return what artists draw with."""

    def copy_from_bbox(self, bbox: BboxBase, /) -> object:
        """Return the pixels of a region."""

    def restore_region(self, region: object, /) -> None:
        """Put such pixels back."""

    def buffer_rgba(self) -> memoryview:
        """Return the pixels `(height, width, 4)`."""


@dataclass(frozen=True, eq=False)
class Stage:
    """The figure of a replay: what stands still and what moves."""

    figure: Figure
    canvas: Canvas
    scene: SceneArtists
    trail: Line2D
    counter: Text
    cursor: Line2D | None
    """Where in the contact strip the frame is; None without a strip."""
    frame_s: float
    """Time between two frames in the trial [s]."""
    along: Array | None
    """Unit vector `(2,)` the counter measures along; None counts the distance from the start."""
    texts: Sequence[str] | None
    """What stands at each instant in the counter's place."""

    def moving(self) -> tuple[Artist, ...]:
        """Return every artist that changes from frame to frame, back to front."""
        last = () if self.cursor is None else (self.cursor,)
        return (*self.scene.all(), self.trail, self.counter, *last)


@dataclass(frozen=True, eq=False)
class Still:
    """What stands still behind a replay."""

    target: Array
    """The target line `(M, 2)` [mm]."""
    wall: Array
    """Corners `(K, 2)` [mm] of a wall; none where there is none."""


Writer: TypeAlias = Callable[[Stage, Sequence[SceneOutline], Array, Path, int], None]
"""Writes the frames of a stage to a file at a rate [1/s]."""


def write_replay(
    frames: Sequence[SceneOutline],
    trail_mm: Array,
    out: Path,
    *,
    fps: int = 25,
    title: str = "",
    target_angle_deg: float | None = None,
    target_path_mm: Array | None = None,
    contact: NDArray[np.bool_] | None = None,
    frame_s: float | None = None,
    wall_mm: Array | None = None,
    texts: Sequence[str] | None = None,
) -> Path:
    """Write an animated replay of one trial and return its path; the file appears whole or not at all.

    Args:
        frames: The hand and the object at each of the N instants.
        trail_mm: Where the object was `(N, 2)` [mm] from its start.
        out: File to write: .gif, or .mp4 where an `ffmpeg` program is on the PATH.
        fps: Frames per second, at most 50.
        title: Written above the picture.
        target_angle_deg: Direction of a straight target [deg]; it gives the trail its colour.
        target_path_mm: A target path `(M, 2)` [mm] from the start instead of the straight line.
        contact: Whether each finger touched at each instant `(N, F)`, drawn as a strip below over the time [s].
        frame_s: Time between two instants of the trial [s]; None where it is shown as fast as it was.
        wall_mm: Corners `(K, 2)` [mm] from the start of something that stands still.
        texts: What to write at each instant instead of the distance.

    Raises:
        InputError: no frame, arrays of different lengths, a bad rate, another suffix, or no ffmpeg for .mp4.
    """
    _check(frames, trail_mm, contact, fps, texts)
    write, touching = _writer(out), (contact, 1 / fps if frame_s is None else frame_s)
    still = Still(_target(trail_mm, target_angle_deg, target_path_mm), np.empty((0, 2)) if wall_mm is None else wall_mm)
    check_points(still.wall, "wall")
    stage = _set_stage(frames, trail_mm, still, texts, angle_deg=target_angle_deg, title=title, touching=touching)
    with written_whole(out) as part:
        write(stage, frames, trail_mm, part, fps)
    return out


def wall_patch(corners: Array) -> Polygon:
    """Return the hatched patch of a wall with corners `(K, 2)` [mm] from the object's start."""
    return Polygon(corners, closed=True, facecolor=WALL[0], edgecolor=WALL[1], hatch="////", linewidth=0.9, zorder=1.25)


def _check(
    frames: Sequence[SceneOutline],
    trail_mm: Array,
    contact: NDArray[np.bool_] | None,
    fps: int,
    texts: Sequence[str] | None,
) -> None:
    """Raise InputError where frames, trail, contact and texts do not belong together or the rate cannot be written."""
    if len(frames) == 0:
        raise InputError("a replay was given no frame: give one SceneOutline per instant")
    check_points(trail_mm, "trail")
    if len(trail_mm) != len(frames):
        raise InputError(f"{len(trail_mm)} trail points given for {len(frames)} frames: give one point [mm] per frame")
    if contact is not None:
        check_contact(contact, ())
        if len(contact) != len(frames):
            raise InputError(f"{len(contact)} rows of contact given for {len(frames)} frames: give one row per frame")
    if texts is not None and len(texts) != len(frames):
        raise InputError(f"{len(texts)} texts given for {len(frames)} frames: give one text per frame")
    if not 0 < fps <= FASTEST_FPS:
        raise InputError(f"{fps} frames per second given: the rate must be above 0 and at most {FASTEST_FPS}")


def _writer(out: Path) -> Writer:
    """Return the function that writes the format of the suffix."""
    suffix = out.suffix.lower()
    if suffix == ".gif":
        return _write_gif
    if suffix != ".mp4":
        raise InputError(f"cannot write a replay as {out.name!r}: the suffix must be .gif or .mp4")
    if not FFMpegWriter.isAvailable():
        raise InputError(
            f"cannot write {out.name!r}: .mp4 needs the ffmpeg program and there is none on the PATH; "
            f"install it or write {out.with_suffix('.gif').name!r} instead"
        )
    return _write_mp4


def _target(trail_mm: Array, angle_deg: float | None, path_mm: Array | None) -> Array:
    """Return the target line `(M, 2)` [mm]: the given path, a straight line, or nothing."""
    if path_mm is not None:
        check_points(path_mm, "target path")
        return path_mm
    if angle_deg is None:
        return np.empty((0, 2))
    along = unit(np.deg2rad(angle_deg))
    progress = trail_mm @ along
    return np.stack([np.zeros(2), float(np.max(progress[np.isfinite(progress)], initial=10.0)) * along])


def _set_stage(
    frames: Sequence[SceneOutline],
    trail_mm: Array,
    still: Still,
    texts: Sequence[str] | None,
    *,
    angle_deg: float | None,
    title: str,
    touching: tuple[NDArray[np.bool_] | None, float],
) -> Stage:
    """Draw everything once: axes that hold every frame, the target, the strip, and the artists that will move."""
    figure = new_figure(SIDE_IN, SIDE_IN)
    canvas = FigureCanvasAgg(figure)
    contact, frame_s = touching
    strip_in = 0.0 if contact is None else 0.3 + 0.13 * contact.shape[1]
    ax = figure.add_axes(axes_box(figure, (0.5, 0.35 + strip_in, SIDE_IN - 0.7, SIDE_IN - 0.85 - strip_in)))
    _dress_view(ax, np.concatenate([*map(scene_points, frames), trail_mm, still.target, still.wall]))
    if len(still.wall):
        ax.add_patch(wall_patch(still.wall))
    ax.plot(*still.target.T, color=MUTED, linewidth=1.1, linestyle=(0, (4, 3)), zorder=2.0)
    colour = INK if angle_deg is None else direction_colour(angle_deg)
    along = None if angle_deg is None else unit(np.deg2rad(angle_deg))
    halo = [withStroke(linewidth=4.2, foreground="white")]
    (trail,) = ax.plot([], [], color=colour, linewidth=2.2, path_effects=halo, zorder=3.0)
    # On the axes, not on the figure: matplotlib leaves out a figure's own animated artists when it saves a film.
    counter = ax.text(1 - 0.2 / SIDE_IN, 1 - 0.17 / SIDE_IN, "", transform=figure.transFigure, ha="right", va="top")
    counter.set(fontsize=TICK_POINTS, color=INK)
    write_heading(figure, title)
    cursor = None
    if contact is not None:
        strip = figure.add_axes(axes_box(figure, (0.75, 0.3, SIDE_IN - 0.95, 0.13 * contact.shape[1])))
        draw_contact(strip, contact, frames[0].fingers, frame_s)
        strip.set_xlabel("")
        strip.xaxis.set_major_formatter("{x:g} s")
        strip.tick_params(labelsize=TICK_POINTS - 1.5)
        cursor = strip.axvline(0, color="#d1242f", linewidth=1.4, zorder=5.0)
    stage = Stage(figure, canvas, draw_scene(ax, frames[0], CLEAR), trail, counter, cursor, frame_s, along, texts)
    for artist in stage.moving():
        artist.set_animated(True)
    return stage


def _dress_view(ax: Axes, points: Array) -> None:
    """Give the axes of the view equal mm both ways and room for every point of every frame."""
    dress_axes(ax)
    ax.set_aspect("equal", adjustable="datalim")
    left, right, bottom, top = extent_of(points, 6.0)
    box = ax.get_window_extent()
    scale = max((right - left) / box.width, (top - bottom) / box.height) / 2
    x, y = (left + right) / 2, (bottom + top) / 2
    ax.set_xlim(x - scale * box.width, x + scale * box.width)
    ax.set_ylim(y - scale * box.height, y + scale * box.height)
    ax.tick_params(labelsize=TICK_POINTS - 1.5)
    ax.annotate(
        "mm",
        (1, 0),
        (0, -16),
        xycoords="axes fraction",
        textcoords="offset points",
        ha="right",
        fontsize=TICK_POINTS - 1.5,
        color=MUTED,
    )


def _show(stage: Stage, outline: SceneOutline, trail_mm: Array) -> None:
    """Move every artist to the instant at the end of the trail so far."""
    move_scene(stage.scene, outline)
    stage.trail.set_data(*trail_mm.T)
    here = trail_mm[-1]
    done = float(np.hypot(*here)) if stage.along is None else float(here @ stage.along)
    told = f"{done:.0f} mm" if np.isfinite(done) else ""
    stage.counter.set_text(told if stage.texts is None else stage.texts[len(trail_mm) - 1])
    if stage.cursor is not None:
        stage.cursor.set_xdata([(len(trail_mm) - 0.5) * stage.frame_s] * 2)


def _pictures(
    stage: Stage, frames: Sequence[SceneOutline], trail_mm: Array, which: Sequence[int]
) -> Iterator[Image.Image]:
    """Yield the chosen frames as RGB pictures; only what moves is drawn again, on a copy of what stands still."""
    stage.canvas.draw()
    still = stage.canvas.copy_from_bbox(stage.figure.bbox)
    for index in which:
        stage.canvas.restore_region(still)
        _show(stage, frames[index], trail_mm[: index + 1])
        for artist in stage.moving():
            artist.draw(stage.canvas.get_renderer())
        yield Image.fromarray(np.asarray(stage.canvas.buffer_rgba())[..., :3].copy())


def _palette(pictures: Sequence[Image.Image]) -> Image.Image:
    """Return a picture whose palette suits all the given ones.

    A colour counts by the root of its area: by the area itself the white ground would take the whole palette and
    the thin trail would turn grey; counted once each, the edges between colours would tint the white ground.
    """
    pixels = np.concatenate([np.asarray(picture).reshape(-1, 3) for picture in pictures]).astype(np.int64)
    packed, counts = np.unique(pixels @ (65536, 256, 1), return_counts=True)
    weighted = np.repeat(packed, np.ceil(np.sqrt(counts)).astype(int))
    colours = np.stack([weighted >> 16, weighted >> 8 & 255, weighted & 255], axis=-1).astype(np.uint8)
    chosen = Image.fromarray(colours[None]).quantize(COLOURS - 1, method=Image.Quantize.MEDIANCUT)
    entries = np.array([*(chosen.getpalette() or []), 255, 255, 255]).reshape(-1, 3)
    entries[(entries >= NEARLY_WHITE).all(axis=1)] = 255
    palette = Image.new("P", (1, 1))
    palette.putpalette(entries.ravel().tolist())
    return palette


def _write_gif(stage: Stage, frames: Sequence[SceneOutline], trail_mm: Array, part: Path, fps: int) -> None:
    """Write a GIF that loops; one palette for all frames, so that only what moved is stored."""
    sampled = np.unique(np.linspace(0, len(frames) - 1, SAMPLES).astype(int)).tolist()
    palette = _palette(list(_pictures(stage, frames, trail_mm, sampled)))
    every = _pictures(stage, frames, trail_mm, range(len(frames)))
    flat = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in every)
    each = round(100.0 / fps) * 10
    durations = [each] * (len(frames) - 1) + [max(each, round(1000 * HOLD_S))]
    next(flat).save(part, save_all=True, append_images=flat, duration=durations, loop=0)


def _write_mp4(stage: Stage, frames: Sequence[SceneOutline], trail_mm: Array, part: Path, fps: int) -> None:
    """Write an H.264 film through the ffmpeg program."""
    writer = FFMpegWriter(fps=fps, codec="h264")
    with writer.saving(stage.figure, str(part), dpi=stage.figure.dpi):
        for index, outline in enumerate(frames):
            _show(stage, outline, trail_mm[: index + 1])
            writer.grab_frame()
