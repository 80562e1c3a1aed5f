"""Asterisks and panels render from nothing, one point and sixteen directions, and show what they were given."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib import rc_context, rcParams
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from figure_reader import NAMES, SIXTEEN, dashed, drawn, legend_texts, texts, xy
from inhand.errors import InputError
from inhand.folders import in_place
from inhand.geometry import Array, unit
from inhand.plots.asterisk import asterisk_figure, draw_asterisk
from inhand.plots.curves import PathCurve, band_polygons, target_length, tip, true_runs
from inhand.plots.donut import DonutSeries, donut_figure
from inhand.plots.heatmap import HeatMap, heatmap_figure
from inhand.plots.panels import Panel, panels_figure
from inhand.plots.radar import RadarSeries, radar_figure
from inhand.plots.save import save_figure
from inhand.plots.shapes import SceneOutline, draw_scene, extent_of, move_scene
from inhand.plots.sheet import new_figure
from inhand.plots.style import DIRECTION_WHEEL, INK, MUTED, direction_colour, series_look


def square(x: float, y: float, side: float) -> Array:
    corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
    return np.asarray(corners * side + np.array([x, y]))


@pytest.fixture
def outline() -> SceneOutline:
    """Return a hand of two straight fingers around a 39 mm square [mm]."""
    links = tuple(np.array([(x - 11, 0), (x + 11, 0), (x + 11, 93), (x - 11, 93)], dtype=float) for x in (-30.5, 30.5))
    joints = np.array([(-30.5, 0.0), (30.5, 0.0)])
    return SceneOutline(links, square(0, -26, 53), square(0, 93.6, 39), joints, np.array([0.0, 93.6]))


def straight(angle: float, name: str, length: float, *, failed: bool = False, limit: float | None = None) -> PathCurve:
    points = np.linspace(0, length, 30)[:, None] * unit(np.deg2rad(angle))
    return PathCurve(angle, name, points, length, failed=failed, limit_mm=limit)


def star(names: dict[float, str], lengths: Sequence[float]) -> list[PathCurve]:
    return [straight(a, n, lengths[i % len(lengths)]) for i, (a, n) in enumerate(names.items())]


def boxes_of(ax: Axes) -> list[Bbox]:
    return [text.get_window_extent() for text in ax.texts]


def solid(ax: Axes) -> list[Line2D]:
    """Return the drawn paths: solid lines of the width that only paths have."""
    return [line for line in ax.lines if line.get_linestyle() == "-" and line.get_linewidth() == 2.0]


def test_thesis_directions_have_the_colours_of_the_public_software() -> None:
    for colour, angle in DIRECTION_WHEEL:
        assert direction_colour(angle) == to_hex(colour)
        assert direction_colour(angle - 360.0) == to_hex(colour)
    assert direction_colour(90.0) == to_hex("tab:blue")
    assert direction_colour(-45.0) == to_hex("tab:olive")


def test_sixteen_directions_have_sixteen_colours_that_differ() -> None:
    rgb = np.array([[int(direction_colour(22.5 * i)[k : k + 2], 16) for k in (1, 3, 5)] for i in range(16)])
    apart = np.abs(rgb[:, None] - rgb[None]).sum(axis=2)
    assert apart[~np.eye(16, dtype=bool)].min() > 35


def test_a_direction_without_an_angle_has_no_colour() -> None:
    with pytest.raises(InputError, match=r"direction angle nan has no colour: give a finite angle in degrees"):
        direction_colour(float("nan"))


def test_series_differ_without_their_colour() -> None:
    looks = [series_look(number) for number in range(4)]
    assert len({(look.dashes, look.marker) for look in looks}) == 4
    assert series_look(6) == series_look(0)


def test_asterisk_draws_each_path_and_its_target_in_the_colour_of_the_direction(outline: SceneOutline) -> None:
    figure = asterisk_figure(star(NAMES, [50, 60, 90, 65]), outline=outline, title="IK", subtitle="one trial each")
    drawn(figure)
    ax = figure.axes[0]
    wanted = {direction_colour(angle) for angle in NAMES}
    assert {to_hex(line.get_color()) for line in solid(ax)} == wanted
    assert {to_hex(line.get_color()) for line in dashed(ax)} == wanted
    assert len(solid(ax)) == len(dashed(ax)) == 8
    assert sorted(texts(ax)) == sorted(["50", "60", "90", "65"] * 2)
    assert ax.get_aspect() == 1.0
    assert legend_texts(figure)[:3] == ["Out", "Out-Right", "Right"]
    assert legend_texts(figure)[-2:] == ["target", "hand, object at start"]
    assert [text.get_text() for text in figure.texts] == ["IK", "one trial each"]


def test_asterisk_is_to_scale_and_shows_the_whole_hand(outline: SceneOutline) -> None:
    figure = asterisk_figure(star(NAMES, [50]), outline=outline)
    drawn(figure)
    ax = figure.axes[0]
    left, right = ax.get_xlim()
    bottom, top = ax.get_ylim()
    box = ax.get_window_extent()
    assert box.width / (right - left) == pytest.approx(box.height / (top - bottom), rel=1e-6)
    assert bottom < -26 - 26.5 - 93.6
    corners = np.concatenate([patch.get_path().vertices for patch in ax.patches])
    assert corners[:, 1].min() == pytest.approx(-26 - 26.5 - 93.6)
    assert corners[:, 1].max() == pytest.approx(19.5)


@pytest.mark.parametrize(
    ("lengths", "failed"), [([50, 60, 90, 65], False), ([50, 60, 90, 65], True), ([0], True), ([0, 70, 0, 0], False)]
)
def test_distances_never_overlap_even_with_sixteen_directions(lengths: list[float], failed: bool) -> None:
    curves = [
        straight(angle, name, lengths[i % len(lengths)], failed=failed)
        for i, (angle, name) in enumerate(SIXTEEN.items())
    ]
    figure = asterisk_figure(curves)
    drawn(figure)
    ax = figure.axes[0]
    boxes = boxes_of(ax)
    assert len(boxes) == 16
    meeting = [(i, j) for i in range(16) for j in range(i) if boxes[i].overlaps(boxes[j])]
    assert meeting == []
    frame = ax.get_window_extent()
    assert all(frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1 for box in boxes)


def test_two_trials_of_one_direction_keep_both_labels_apart() -> None:
    figure = asterisk_figure([straight(0, "Right", 50), straight(0, "Right", 52)])
    drawn(figure)
    first, second = boxes_of(figure.axes[0])
    assert not first.overlaps(second)
    assert legend_texts(figure) == ["Right", "target"]
    assert len(dashed(figure.axes[0])) == 1


def test_lost_contact_is_crossed_at_the_end_and_said_in_the_legend() -> None:
    figure = asterisk_figure([straight(0, "Right", 50, failed=True), straight(90, "Out", 40)])
    crosses = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    assert len(crosses) == 1
    assert xy(crosses[0])[0] == pytest.approx([50, 0])
    assert "contact lost" in legend_texts(figure)
    assert "contact lost" not in legend_texts(asterisk_figure([straight(90, "Out", 40)]))


def test_target_ends_at_the_reach_limit_with_a_cap() -> None:
    figure = asterisk_figure([straight(0, "Right", 50, limit=83.0), straight(90, "Out", 40)])
    ends = [xy(line)[-1] for line in dashed(figure.axes[0])]
    assert np.array(ends) == pytest.approx(np.array([(0.0, 50.0), (83.0, 0.0)]))
    caps = [line for line in figure.axes[0].lines if len(xy(line)) == 2 and np.allclose(xy(line)[:, 0], 83.0)]
    assert len(caps) == 1
    assert "reach limit" in legend_texts(figure)


def test_a_bent_target_is_drawn_whole_and_kept_in_sight() -> None:
    bent = np.array([(0.0, 0.0), (30.0, 20.0), (0.0, 90.0)])
    curve = replace(straight(90, "Out", 40), target_mm=bent)
    ax = asterisk_figure([curve]).axes[0]
    assert xy(dashed(ax)[0]) == pytest.approx(bent)
    assert ax.get_ylim()[1] > 90.0
    with pytest.raises(InputError, match=r"target of path 'Out' has shape \(3,\); it must be \(N, 2\)"):
        replace(curve, target_mm=np.zeros(3))


def test_band_lies_across_the_direction_and_breaks_at_a_gap() -> None:
    points = np.column_stack([np.zeros(6), np.arange(6.0)])
    points[2] = np.nan
    curve = PathCurve(90.0, "Out", points, 5.0, band_mm=np.full(6, 2.0))
    polygons = band_polygons(curve)
    assert [len(polygon) for polygon in polygons] == [4, 6]
    assert sorted(set(np.concatenate(polygons)[:, 0].round(6))) == [-2.0, 2.0]
    assert tip(curve) == pytest.approx([0, 5])
    figure = asterisk_figure([curve])
    drawn(figure)
    assert len(figure.axes[0].patches) == 2
    assert "± SD, lateral" in legend_texts(figure)


def test_asterisk_of_nothing_says_so(outline: SceneOutline) -> None:
    for figure in (asterisk_figure([], outline=outline), asterisk_figure([])):
        drawn(figure)
        assert texts(figure.axes[0]) == ["no trials"]
        assert figure.legends == []


@pytest.mark.parametrize("points", [np.zeros((1, 2)), np.zeros((30, 2)), np.empty((0, 2)), np.full((4, 2), np.nan)])
def test_paths_without_movement_are_ordinary(points: Array) -> None:
    curve = PathCurve(45.0, "Out-Right", points, 0.0, band_mm=np.zeros(len(points)), failed=True)
    assert tip(curve) == pytest.approx([0, 0])
    assert target_length([curve]) == 10.0
    figure = asterisk_figure([curve])
    drawn(figure)
    assert texts(figure.axes[0]) == ["0"]


def test_a_distance_that_is_not_known_is_not_written() -> None:
    figure = asterisk_figure([PathCurve(0.0, "Right", np.zeros((2, 2)), float("nan"))])
    drawn(figure)
    assert texts(figure.axes[0]) == []


def test_draw_asterisk_keeps_a_given_extent() -> None:
    figure = new_figure(4, 4)
    ax = figure.add_subplot()
    draw_asterisk(ax, [straight(0, "Right", 50)], outline=None, extent_mm=(-10, 70, -40, 40))
    assert (*ax.get_xlim(), *ax.get_ylim()) == (-10, 70, -40, 40)


def test_curves_that_do_not_fit_together_are_refused() -> None:
    with pytest.raises(InputError, match=r"path 'Out' has shape \(3,\); it must be \(N, 2\)"):
        PathCurve(90.0, "Out", np.zeros(3), 0.0)
    with pytest.raises(InputError, match=r"path 'Out' has a band of shape \(2,\) for 3 points: give one number \[mm\]"):
        PathCurve(90.0, "Out", np.zeros((3, 2)), 0.0, band_mm=np.zeros(2))
    with pytest.raises(InputError, match=r"path 'Out' has angle inf: give a finite angle"):
        PathCurve(np.inf, "Out", np.zeros((3, 2)), 0.0)


def test_outlines_that_are_not_planar_are_refused(outline: SceneOutline) -> None:
    with pytest.raises(InputError, match=r"outline of link 0 has shape \(4, 3\)"):
        SceneOutline((np.zeros((4, 3)),), outline.palm, outline.object, outline.joints, outline.origin_mm)
    with pytest.raises(InputError, match=r"origin_mm has shape \(3,\); give the object's start as \(2,\)"):
        SceneOutline(outline.links, outline.palm, outline.object, outline.joints, np.zeros(3))


def test_a_scene_moves_with_its_outline_and_refuses_another_hand(outline: SceneOutline) -> None:
    artists = draw_scene(new_figure(3, 3).add_subplot(), outline)
    moved = SceneOutline(outline.links, outline.palm, outline.object + 5.0, outline.joints, outline.origin_mm)
    move_scene(artists, moved)
    assert artists.object.get_xy()[0] == pytest.approx([-14.5, -14.5])
    fewer = SceneOutline(outline.links[:1], outline.palm, outline.object, outline.joints, outline.origin_mm)
    with pytest.raises(InputError, match="outline with 1 links given to a drawing of 2: all frames of a replay"):
        move_scene(artists, fewer)


def test_extent_ignores_gaps_and_keeps_a_least_size() -> None:
    points = np.array([(0.0, 0.0), (np.nan, 500.0), (100.0, 10.0)])
    assert extent_of(points, 5.0, least_mm=20.0) == (-5.0, 105.0, -15.0, 25.0)
    assert extent_of(np.empty((0, 2)), 5.0, least_mm=20.0) == (-20.0, 20.0, -20.0, 20.0)


def test_true_runs() -> None:
    assert true_runs(np.array([True, True, False, True])) == [(0, 2), (3, 1)]
    assert true_runs(np.zeros(3, dtype=bool)) == []
    assert true_runs(np.array([], dtype=bool)) == []


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_panels_share_one_scale_and_one_legend(count: int, outline: SceneOutline) -> None:
    near, far = tuple(star(NAMES, [20])), tuple(star(SIXTEEN, [95]))
    panels = [
        Panel("Human", "15 trials", near, outline),
        Panel("IK", "", far),
        Panel("A", "", ()),
        Panel("B", "", near),
    ]
    figure = panels_figure(panels[:count], "All")
    drawn(figure)
    assert len(figure.axes) == count
    assert len({(*ax.get_xlim(), *ax.get_ylim()) for ax in figure.axes}) == 1
    assert len({round(ax.get_window_extent().width, 3) for ax in figure.axes}) == 1
    ends = [np.hypot(*xy(line)[-1]) for ax in figure.axes for line in dashed(ax)]
    assert ends == pytest.approx([ends[0]] * len(ends)), "panels differ in the length of their targets"
    names = legend_texts(figure)
    assert names.count("Out") == 1
    assert ("Out'" in names) is (count > 1)
    assert "15 trials" in texts(figure.axes[0])
    width, height = figure.bbox.width, figure.bbox.height
    for legend in figure.legends:
        box = legend.get_window_extent()
        assert box.x0 >= 0
        assert box.x1 <= width
        assert 0 <= box.y0 < box.y1 <= height
    upper, lower = (legend.get_window_extent() for legend in figure.legends[::-1])
    assert upper.y0 >= lower.y1


@pytest.mark.parametrize("count", [0, 5])
def test_panels_are_one_to_four(count: int) -> None:
    with pytest.raises(InputError, match=rf"{count} panels given: a figure holds 1 to 4; split them"):
        panels_figure([Panel("", "", ())] * count)


def test_a_sheet_is_as_large_as_what_is_on_it(outline: SceneOutline) -> None:
    far, long = star(SIXTEEN, [95]), "A title that is wider than all that stands below it, however little that may be"
    heat = HeatMap(("a hand with a long name",), ("an object",), np.zeros((1, 1)), [["cannot run"]])
    names = [(name, angle) for angle, name in SIXTEEN.items()]
    for figure in (
        asterisk_figure(far, outline=outline, title=long),
        panels_figure([Panel("IK", "", tuple(far))] * 3, long),
        heatmap_figure(heat, "Distance [mm]", long, "below"),
        radar_figure(names, [RadarSeries("IK", np.ones(16), np.ones(16))]),
        donut_figure([DonutSeries(str(number), 10.0, 150.0) for number in range(6)]),
    ):
        width, height = figure.get_size_inches()
        box = figure.get_tightbbox()
        assert (box.x0, box.y0) == pytest.approx((0.15, 0.15), abs=0.02)
        assert box.x1 == pytest.approx(width - 0.15, abs=0.02)
        assert height - 0.25 < box.y1 < height


def test_numbers_beside_an_asterisk_cover_none_of_the_axes(outline: SceneOutline) -> None:
    figure = panels_figure([Panel("IK", "", tuple(star(SIXTEEN, [119, 72])), outline)] * 3)
    drawn(figure)
    for ax in figure.axes:
        numbers = [text.get_window_extent() for text in ax.texts if text.get_text() in {"119", "72"}]
        ticks = [label.get_window_extent() for label in (*ax.get_xticklabels(), *ax.get_yticklabels())]
        assert not [1 for number in numbers for tick in ticks if number.overlaps(tick)]


def test_a_figure_keeps_its_look_and_the_program_its_own() -> None:
    with rc_context({"axes.grid": False, "text.color": "red", "xtick.labelcolor": "red", "xtick.major.size": 9.0}):
        before = dict(rcParams)
        figure = asterisk_figure([straight(0, "Right", 50)], title="Right")
        figure.axes[0].set_xticks(range(0, 60, 3))
        drawn(figure)
        assert dict(rcParams) == before
    (label, *_), (line, *_) = figure.axes[0].get_xticklabels(), figure.axes[0].get_xticklines()
    assert (label.get_color(), line.get_markersize(), figure.texts[0].get_color()) == (MUTED, 0.0, INK)


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_equal_figures_give_equal_bytes_and_leave_nothing_else(tmp_path: Path, suffix: str) -> None:
    before = dict(rcParams)
    paths = [tmp_path / "made" / f"{name}.{suffix}" for name in "ab"]
    for path in paths:
        curve = straight(0, "Right", 50, failed=True)
        assert save_figure(asterisk_figure([curve], title="Right"), path) == path
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert sorted(path.name for path in (tmp_path / "made").iterdir()) == [f"a.{suffix}", f"b.{suffix}"]
    assert dict(rcParams) == before


def test_another_suffix_is_refused(tmp_path: Path) -> None:
    wanted = r"cannot write a figure as 'a.pgn': the suffix must be .png, .pdf or .svg; rename it"
    with pytest.raises(InputError, match=wanted):
        save_figure(new_figure(1, 1), tmp_path / "a.pgn")


def test_a_failed_write_keeps_the_old_file_and_leaves_no_part(tmp_path: Path) -> None:
    old = tmp_path / "a.png"
    old.write_text("old")

    def write_half() -> None:
        with in_place(old) as part:
            part.write_text("half")
            raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        write_half()
    assert old.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
