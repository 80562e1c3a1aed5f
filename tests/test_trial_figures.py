"""Radar, donut and single-trial figures: they render from nothing to sixteen directions and show their input."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Wedge

from figure_reader import NAMES, SIXTEEN, dashed, drawn, legend_texts, texts, xy
from inhand.errors import InputError
from inhand.geometry import unit
from inhand.plots.donut import DonutSeries, donut_figure
from inhand.plots.path import TrialPath, orientation_ticks, path_figure
from inhand.plots.radar import RadarSeries, draw_radar, radar_figure
from inhand.plots.save import save_figure
from inhand.plots.shapes import SceneOutline
from inhand.plots.sheet import new_figure
from inhand.plots.style import INK


@pytest.fixture
def outline() -> SceneOutline:
    """Return a palm and a 39 mm square without fingers [mm]."""
    corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
    palm = corners * 53.0 - np.array([0.0, 26.5])
    middle = np.array([0.0, 93.6])
    return SceneOutline((), palm, corners * 39.0 + middle, np.empty((0, 2)), middle)


def directions(names: dict[float, str]) -> list[tuple[str, float]]:
    return [(name, angle) for angle, name in names.items()]


def test_a_sheet_that_is_drawn_on_again_shows_what_a_new_one_would(outline: SceneOutline, tmp_path: Path) -> None:
    many, few = np.linspace(0, 60, 40), np.linspace(0, 7, 12)
    first = TrialPath("Out", 90.0, np.c_[0 * many, many], many, np.ones((40, 2), bool), ("left", "right"))
    other = TrialPath("Right", 0.0, np.c_[few, few / 9], -few, np.eye(12, 2) > 0, failed=True)
    again = path_figure(first, outline=outline, title="the first", subtitle="of two")
    save_figure(again, tmp_path / "first.png")
    for name, on in (("again", again), ("new", None)):
        save_figure(path_figure(other, title="the other", again=on), tmp_path / f"{name}.png")
    assert (tmp_path / "again.png").read_bytes() == (tmp_path / "new.png").read_bytes()


def test_radar_stands_like_the_compass_and_closes_each_line() -> None:
    distance = np.array([50.0, 60, 90, 65, 65, 62, 88, 58])
    series = [RadarSeries("human", distance, distance / 100), RadarSeries("IK", distance / 2, distance / 200)]
    figure = radar_figure(directions(NAMES), series, "Both")
    drawn(figure)
    assert [ax.get_title() for ax in figure.axes] == ["Distance [mm]", "Efficiency"]
    assert legend_texts(figure) == ["human", "IK"]
    ax = figure.axes[0]
    first = ax.lines[0]
    assert len(xy(first)) == 9
    assert xy(first)[0] == pytest.approx(xy(first)[-1])
    assert sorted(xy(first)[:-1, 1]) == sorted(distance)
    names = {text.get_text(): text.get_window_extent() for text in ax.texts}
    middle = ax.get_window_extent()
    assert names["Out"].y0 > middle.y1
    assert names["In"].y1 < middle.y0
    assert names["Left"].x1 < middle.x0 < middle.x1 < names["Right"].x0
    assert ax.get_ylim() == (0.0, 100.0)
    assert [line.get_linestyle() for line in ax.lines] == ["-", "--"]


def test_radar_draws_no_area_over_a_gap_and_takes_any_number_of_directions() -> None:
    row = np.where(np.arange(16) == 3, np.nan, 40.0)
    figure = radar_figure(directions(SIXTEEN), [RadarSeries("IK", row, np.ones(16))])
    drawn(figure)
    assert len(figure.axes[0].patches) == 0
    assert len(figure.axes[1].patches) == 1
    for names, series in (
        ({90.0: "Out"}, [RadarSeries("IK", np.array([0.0]), np.array([np.nan]))]),
        (NAMES, []),
        ({}, []),
    ):
        drawn(radar_figure(directions(names), series))


def test_radar_direction_names_do_not_overlap() -> None:
    figure = radar_figure(directions(SIXTEEN), [])
    drawn(figure)
    boxes = [text.get_window_extent() for text in figure.axes[0].texts if text.get_text() in SIXTEEN.values()]
    assert len(boxes) == 16
    assert [(i, j) for i in range(16) for j in range(i) if boxes[i].overlaps(boxes[j])] == []
    assert all(box.x0 >= 0 and box.x1 <= figure.bbox.width for box in boxes)


def test_radar_refuses_a_series_of_another_length_and_straight_axes() -> None:
    with pytest.raises(InputError, match=r"efficiency of series 'IK' has shape \(2,\) for 1 directions"):
        radar_figure([("Out", 90.0)], [RadarSeries("IK", np.zeros(1), np.zeros(2))])
    with pytest.raises(InputError, match="make them with projection='polar'"):
        draw_radar(new_figure(2, 2).add_subplot(), [("Out", 90.0)], [], least=1.0)


def test_donut_turns_each_way_from_the_top() -> None:
    series = [DonutSeries("human", 43.0, 44.0, (30, 50), (41, 46)), DonutSeries("IK", 61.0, float("nan"))]
    figure = donut_figure(series, "Rotation", "2v2")
    drawn(figure)
    ax = figure.axes[0]
    pieces = [(patch.theta1, patch.theta2) for patch in ax.patches if isinstance(patch, Wedge)][1:]
    assert pieces == [(47.0, 90.0), (90.0, 134.0), (29.0, 90.0)]
    assert {"43°", "44°", "61°", "none"} <= set(texts(ax))
    assert legend_texts(figure) == ["human", "IK", "smallest to largest"]
    assert ax.get_aspect() == 1.0
    right = next(text for text in ax.texts if text.get_text() == "43°")
    left = next(text for text in ax.texts if text.get_text() == "44°")
    assert left.get_position()[0] < 0 < right.get_position()[0]


def test_everything_of_a_way_lies_on_its_side_of_the_donut() -> None:
    clockwise = DonutSeries("IK", 60.0, float("nan"), (50.0, 70.0), None, (80.0, 90.0))
    counter = DonutSeries("IK", float("nan"), 60.0, None, (50.0, 70.0), (80.0, 90.0))
    for one, side in ((clockwise, 1.0), (counter, -1.0)):
        ax = donut_figure([one]).axes[0]
        piece = [patch for patch in ax.patches if isinstance(patch, Wedge)][1]
        assert side * np.cos(np.deg2rad(piece.theta1 + piece.theta2) / 2) > 0
        (arc,) = [xy(line) for line in ax.lines if len(xy(line)) == 40]
        assert (side * arc[:, 0] > 0).all()
        (text,) = [text for text in ax.texts if text.get_text() == "60°" and text.get_color() == INK]
        assert side * text.get_position()[0] > 0
    limits = [xy(line) for line in ax.lines if line.get_zorder() == 3.5]
    assert [float(np.sign(tick[0, 0])) for tick in limits] == [1.0, -1.0]
    assert np.degrees(np.arctan2(limits[0][0, 0], limits[0][0, 1])) == pytest.approx(80.0)


def test_donut_of_nothing_shows_its_scale() -> None:
    figure = donut_figure([])
    drawn(figure)
    assert {"0°", "90°", "180°"} <= set(texts(figure.axes[0]))
    assert figure.legends == []
    assert "smallest to largest" not in legend_texts(donut_figure([DonutSeries("IK", 0.0, 0.0)]))


def trial(angle: float = 45.0, *, failed: bool = False) -> TrialPath:
    points = np.linspace(0, 60, 50)[:, None] * unit(np.deg2rad(angle))
    contact = np.ones((50, 2), dtype=bool)
    contact[20:25, 1] = False
    return TrialPath("Out-Right", angle, points, np.linspace(0, 20, 50), contact, failed=failed)


def test_single_trial_shows_path_deviations_and_contact(outline: SceneOutline) -> None:
    figure = path_figure(trial(failed=True), outline=outline, title="Trial", subtitle="one")
    drawn(figure)
    path, rotation, lateral, strip = figure.axes
    assert path.get_aspect() == 1.0
    assert lateral.get_ylabel() == "lateral [mm]"
    assert xy(lateral.lines[-1])[:, 1] == pytest.approx(np.zeros(50), abs=1e-9)
    assert xy(rotation.lines[-1])[:, 1] == pytest.approx(np.linspace(0, 20, 50))
    assert xy(rotation.lines[-1])[-1, 0] == pytest.approx(60.0)
    assert [label.get_text() for label in strip.get_yticklabels()] == ["finger 1", "finger 2"]
    assert strip.yaxis_inverted()
    touching = strip.collections[3].get_paths()
    assert [tuple(piece.get_extents().intervalx) for piece in touching] == [(0.0, 0.4), (0.5, 1.0)]
    assert "contact lost" in legend_texts(figure)


@pytest.mark.parametrize("angle", [0.0, 45.0, 90.0, -112.5])
def test_orientation_crosses_turn_with_the_object_and_not_with_the_direction(angle: float) -> None:
    ticks = orientation_ticks(trial(angle), 2.0)
    assert len(ticks) == 24
    arms = np.array([end - start for start, end in ticks])
    assert arms[0] == pytest.approx([4.0, 0.0])
    assert arms[12] == pytest.approx([0.0, 4.0])
    assert arms[11] == pytest.approx(4.0 * unit(np.deg2rad(20.0)))
    assert arms[23] == pytest.approx(4.0 * unit(np.deg2rad(110.0)))
    assert ticks[-1][0] + arms[-1] / 2 == pytest.approx(60.0 * unit(np.deg2rad(angle)))


def test_single_trial_without_movement_contact_or_points(outline: SceneOutline) -> None:
    for points in (np.zeros((1, 2)), np.zeros((20, 2)), np.empty((0, 2)), np.full((3, 2), np.nan)):
        still = TrialPath("In", -90.0, points, np.zeros(len(points)), failed=True)
        figure = path_figure(still, outline=outline)
        drawn(figure)
        assert len(figure.axes) == 3
    drawn(path_figure(TrialPath("In", -90.0, np.zeros((1, 2)), np.zeros(1), np.ones((0, 2), dtype=bool))))


def test_single_trial_draws_a_given_target() -> None:
    reference = np.array([(0.0, 0.0), (5.0, 20.0), (0.0, 40.0)])
    one = TrialPath("Out", 90.0, reference, np.zeros(3), target_mm=reference + 1.0, target_rotation_deg=15.0)
    figure = path_figure(one)
    assert xy(dashed(figure.axes[0])[0]) == pytest.approx(reference + 1.0)
    assert xy(dashed(figure.axes[1])[0])[:, 1] == pytest.approx([15.0, 15.0])


def test_single_trial_refuses_arrays_that_do_not_belong_together() -> None:
    points = np.zeros((4, 2))
    with pytest.raises(InputError, match=r"rotation of trial 'Out' has shape \(3,\) for 4 points"):
        TrialPath("Out", 90.0, points, np.zeros(3))
    with pytest.raises(InputError, match=r"contact has shape \(4,\); it must be \(T, F\)"):
        TrialPath("Out", 90.0, points, np.zeros(4), np.ones(4, dtype=bool))
    with pytest.raises(InputError, match="1 finger names given for 2 columns of contact: give as many"):
        TrialPath("Out", 90.0, points, np.zeros(4), np.ones((4, 2), dtype=bool), ("left",))
    with pytest.raises(InputError, match=r"target of trial 'Out' has shape \(4,\)"):
        TrialPath("Out", 90.0, points, np.zeros(4), target_mm=np.zeros(4))
