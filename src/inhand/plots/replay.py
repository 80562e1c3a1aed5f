"""A moving picture of one trial, drawn from the hand's own outlines: GIF through Pillow, MP4 through ffmpeg."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.text import Text
from numpy.typing import NDArray
from PIL import Image

from inhand.errors import InputError
from inhand.folders import in_place
from inhand.geometry import Array, unit
from inhand.plots.path import check_contact, draw_contact
from inhand.plots.shapes import CLEAR, WALL, SceneOutline, check_points, draw_scene, extent_of, move_scene, scene_points
from inhand.plots.sheet import STYLE, Box, halo, new_figure
from inhand.plots.style import INK, MUTED, TICK_POINTS, TITLE_POINTS, direction_colour

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
HOLD_S = 1.0
"""How long the last frame stays before the picture starts again [s]."""


@dataclass(frozen=True, eq=False)
class Moving:
    """What changes from frame to frame."""

    artists: Sequence[Artist]
    """It, back to front."""
    show: Callable[[int], object]
    """Moves it to a frame."""


@dataclass(frozen=True, eq=False)
class Film:
    """The figure of a replay."""

    figure: Figure
    """All that stands still and all that moves."""
    parts: Sequence[Moving]
    """What moves."""
    text: Text
    told: Sequence[str]
    """What the text says at each frame."""

    @property
    def count(self) -> int:
        """Number of frames."""
        return len(self.told)

    def show(self, number: int) -> None:
        """Move everything to a frame."""
        self.text.set_text(self.told[number])
        for part in self.parts:
            part.show(number)


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
    write, target = writer_of(out), _target(trail_mm, target_angle_deg, target_path_mm)
    with mpl.rc_context(STYLE), in_place(out) as part:
        figure, strips = titled(title, contact, frame_s or 1 / fps, frames[0].fingers)
        ax = _view(figure, frames, trail_mm, target, np.empty((0, 2)) if wall_mm is None else wall_mm)
        parts = [_scene(ax, frames), _trail(ax, trail_mm, target_angle_deg), *strips]
        write(Film(figure, parts, empty_text(ax), texts or _distances(trail_mm, target_angle_deg)), part, fps)
    return out


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


def writer_of(out: Path) -> Callable[[Film, Path, int], None]:
    """Return what writes a film into a file of such a name.

    Raises:
        InputError: another suffix, or no ffmpeg for .mp4.
    """
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


def titled(
    title: str, contact: NDArray[np.bool_] | None, frame_s: float, fingers: tuple[str, ...]
) -> tuple[Figure, list[Moving]]:
    """Return the figure with its title and, where contacts are known, their strip."""
    figure = new_figure(SIDE_IN, SIDE_IN)
    figure.text(0.2 / SIDE_IN, 1 - 0.15 / SIDE_IN, title, fontsize=TITLE_POINTS, fontweight="bold", va="top")
    return figure, [] if contact is None else [_cursor(figure, contact, frame_s, fingers)]


def _axes(figure: Figure, box: Box) -> Axes:
    left, bottom, width, height = (each / SIDE_IN for each in box)
    ax = figure.add_axes((left, bottom, width, height))
    ax.tick_params(labelsize=TICK_POINTS - 1.5)
    return ax


def _view(figure: Figure, frames: Sequence[SceneOutline], trail_mm: Array, target: Array, wall: Array) -> Axes:
    """Return axes above a strip, if there is one, that hold all frames in equal mm, and what stands still on them."""
    check_points(wall, "wall")
    ax = view_box(figure)
    left, right, bottom, top = extent_of(np.concatenate([*map(scene_points, frames), trail_mm, target, wall]), 6.0)
    box = ax.get_window_extent()
    scale = max((right - left) / box.width, (top - bottom) / box.height) / 2
    x, y, wide, high = (left + right) / 2, (bottom + top) / 2, scale * box.width, scale * box.height
    ax.set(xlim=(x - wide, x + wide), ylim=(y - high, y + high), aspect="equal")
    told = ax.annotate("mm", (1, 0), (0, -16), xycoords="axes fraction", textcoords="offset points", ha="right")
    told.set(fontsize=TICK_POINTS - 1.5, color=MUTED)
    if len(wall):
        ax.add_patch(Polygon(wall, **WALL, linewidth=0.9, zorder=1.25))
    ax.plot(*target.T, "--", color=MUTED, linewidth=1.1, zorder=2.0)
    return ax


def view_box(figure: Figure) -> Axes:
    """Return axes for the picture itself, above a strip of contacts if there is one."""
    strip_in = sum(0.3 + strip.get_position().height * SIDE_IN for strip in figure.axes)
    return _axes(figure, (0.5, 0.35 + strip_in, SIDE_IN - 0.7, SIDE_IN - 0.85 - strip_in))


def _scene(ax: Axes, frames: Sequence[SceneOutline]) -> Moving:
    artists = draw_scene(ax, frames[0], CLEAR)
    return Moving(artists.all(), lambda number: move_scene(artists, frames[number]))


def _trail(ax: Axes, trail_mm: Array, angle_deg: float | None) -> Moving:
    """Return the way so far."""
    colour = INK if angle_deg is None else direction_colour(angle_deg)
    (line,) = ax.plot([], [], color=colour, linewidth=2.2, path_effects=halo(4.2), zorder=3.0)
    return Moving((line,), lambda number: line.set_data(*trail_mm[: number + 1].T))


def _distances(trail_mm: Array, angle_deg: float | None) -> list[str]:
    """Return how far along a direction, or from the start, each point of a trail is."""
    done = np.hypot(*trail_mm.T) if angle_deg is None else trail_mm @ unit(np.deg2rad(angle_deg))
    return [f"{way:.0f} mm" if np.isfinite(way) else "" for way in done]


def empty_text(ax: Axes) -> Text:
    """Return the text at the top right, above the axes."""
    # On the axes, not on the figure: matplotlib leaves out a figure's own animated artists when it saves a film.
    place, on = (1 - 0.2 / SIDE_IN, 1 - 0.17 / SIDE_IN), ax.figure.transFigure
    return ax.text(*place, "", transform=on, ha="right", va="top")


def _cursor(figure: Figure, contact: NDArray[np.bool_], frame_s: float, fingers: tuple[str, ...]) -> Moving:
    """Draw the contacts over time and return the line that says where in them a frame is."""
    strip = _axes(figure, (0.75, 0.3, SIDE_IN - 0.95, 0.13 * contact.shape[1]))
    draw_contact(strip, contact, fingers, frame_s)
    strip.set_xlabel("")
    strip.xaxis.set_major_formatter("{x:g} s")
    line = strip.axvline(0, color="#d1242f", linewidth=1.4, zorder=5.0)
    return Moving((line,), lambda number: line.set_xdata([(number + 0.5) * frame_s] * 2))


def _pictures(film: Film, which: Sequence[int]) -> Iterator[Image.Image]:
    """Yield the chosen frames as RGB pictures; only what moves is drawn again, on a copy of what stands still.

    The text, on which nothing lies, stands still until it changes: letters take longer than all else.
    """
    canvas: Any = film.figure.canvas  # Agg's own methods carry no annotations
    artists = [artist for part in film.parts for artist in part.artists]
    for artist in (*artists, film.text):
        artist.set_animated(True)
    canvas.draw()
    bare, still, written = canvas.copy_from_bbox(film.figure.bbox), None, None
    for number in which:
        film.show(number)
        if still is None or film.told[number] != written:
            canvas.restore_region(bare)
            film.text.draw(canvas.get_renderer())
            still, written = canvas.copy_from_bbox(film.figure.bbox), film.told[number]
        canvas.restore_region(still)
        for artist in artists:
            artist.draw(canvas.get_renderer())
        yield Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


def _palette(picture: Image.Image) -> Image.Image:
    """Return a picture whose palette suits the given one.

    Colours are chosen by how far apart they are: by the area that they cover the thin trail would turn grey.
    """
    chosen = picture.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE)
    entries = np.array(chosen.getpalette()).reshape(-1, 3)
    entries[(entries >= NEARLY_WHITE).all(axis=1)] = 255
    chosen.putpalette(entries.ravel().tolist())
    return chosen


def _write_gif(film: Film, part: Path, fps: int) -> None:
    """Write a GIF that loops; one palette for all frames, so that only what moved is stored."""
    sampled = np.unique(np.linspace(0, film.count - 1, SAMPLES).astype(int)).tolist()
    palette = _palette(Image.fromarray(np.concatenate([np.asarray(each) for each in _pictures(film, sampled)])))
    flat = (each.quantize(palette=palette, dither=Image.Dither.NONE) for each in _pictures(film, range(film.count)))
    each = round(100.0 / fps) * 10
    durations = [each] * (film.count - 1) + [max(each, round(1000 * HOLD_S))]
    next(flat).save(part, "GIF", save_all=True, append_images=flat, duration=durations, loop=0)


def _write_mp4(film: Film, part: Path, fps: int) -> None:
    writer = FFMpegWriter(fps=fps, codec="h264", extra_args=["-f", "mp4"])
    with writer.saving(film.figure, str(part), dpi=film.figure.dpi):
        for number in range(film.count):
            film.show(number)
            writer.grab_frame()
