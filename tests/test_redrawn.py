"""Figures drawn again for a paper: their form, their width, and what is left of them elsewhere."""

import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

import inhand as front
from commands import Call
from inhand.control.trial import write_trials
from inhand.errors import InputError
from inhand.plots.paper import COLUMN_POINTS, MM_PER_IN, Paper, drawn_for, paper
from inhand.plots.sheet import Size, sheet
from inhand.plots.style import TICK_POINTS


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a small reach and a small test."""
    place = tmp_path_factory.mktemp("runs")
    front.reach(directions="Right,Left", resolution_mm=6).save(place / "reach")
    write_trials(front.asterisk(controller="thesis-ik", directions="Out", trials=1).trials, place / "test")
    return place


HEADING = "A heading that is longer than the figure"


def drawn(rows: list[list[Size]], width_mm: float = 0) -> Figure:
    """Return a sheet, for a column where it has a width."""
    keys = [Line2D([], [], label=f"key {k}") for k in range(6)]
    with drawn_for(Paper(width_in=width_mm / MM_PER_IN or None)), sheet(rows, HEADING, beside=keys) as (figure, axes):
        for ax in axes:
            ax.set_ylabel("way [mm]")
    return figure


def widths_mm(folder: Path) -> set[float]:
    """Return the widths of the pages of PDF files."""
    found = {re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ", path.read_bytes()) for path in folder.rglob("*.pdf")}
    return {round(float(each[1]) / 72 * MM_PER_IN, 1) for each in found if each}


def test_figures_of_a_run_become_as_wide_as_a_column(runs: Path, tmp_path: Path, inhand: Call) -> None:
    out = tmp_path / "figures"
    code, told, err = inhand("figures", runs / "reach", "--width-mm", 85, "--out", out)
    assert (code, err) == (0, "")
    assert told == f"1 file in {out}: reach.pdf\n"
    assert widths_mm(out) == {85.0}
    before = (out / "reach.pdf").read_bytes()
    assert inhand("figures", runs / "reach", "--out", out)[0] == 2
    assert (out / "reach.pdf").read_bytes() == before
    assert inhand("figures", runs / "reach", "--out", out, "--overwrite", "--format", "svg")[0] == 0
    assert sorted(path.name for path in out.iterdir()) == ["reach.svg", "run.toml"]


def test_a_trial_of_choice_is_drawn_with_its_replay(runs: Path, tmp_path: Path, inhand: Call) -> None:
    out = tmp_path / "trial"
    code, _, err = inhand("figures", runs / "test" / "trials" / "out_1.npz", "--format", "svg", "--out", out)
    assert (code, err) == (0, "")
    names = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert names == {"asterisk.svg", "radar.svg", "paths/out.svg", "replay.gif", "run.toml"}


def test_a_reach_has_its_table_as_csv(runs: Path) -> None:
    assert (runs / "reach" / "limits.csv").read_text().startswith("direction,angle_deg,")


def test_a_column_has_its_width_and_smaller_texts_and_no_heading() -> None:
    page, column = drawn([[(3.0, 2.0)]]), drawn([[(3.0, 2.0)]], width_mm=85)
    assert column.get_figwidth() * MM_PER_IN == pytest.approx(85, abs=0.3)
    sizes = {float(text.get_fontsize()) for text in column.findobj(Text) if isinstance(text, Text) and text.get_text()}
    assert max(sizes) < TICK_POINTS
    assert COLUMN_POINTS in sizes
    assert [text.get_text() for text in column.texts] == []
    assert [text.get_text() for text in page.texts] == [HEADING]
    (low,) = [legend.get_window_extent().y1 / column.dpi for legend in column.legends]
    assert low < column.axes[0].get_position().y0 * column.get_figheight()
    assert paper() == Paper()


def test_rows_that_do_not_fit_are_broken() -> None:
    beside = drawn([[(3.0, 2.0), (3.0, 2.0)]], width_mm=178)
    below = drawn([[(3.0, 2.0), (3.0, 2.0)]], width_mm=60)
    assert len({ax.get_position().y0 for ax in beside.axes}) == 1
    assert len({ax.get_position().x0 for ax in below.axes}) == 1
    assert below.get_figwidth() * MM_PER_IN == pytest.approx(60, abs=0.3)


def test_a_column_without_room_is_refused() -> None:
    with pytest.raises(InputError, match=r"a figure has no room in 40 mm: give --width-mm \d+ or more") as error:
        drawn([[(3.0, 2.0)]], width_mm=40)
    least = float(str(error.value).split("--width-mm ")[1].split()[0])
    assert drawn([[(3.0, 2.0)]], width_mm=least).get_figwidth() * MM_PER_IN == pytest.approx(least, abs=0.3)


@pytest.mark.parametrize("width", [39.9, 401, "nan"])
def test_a_width_that_no_figure_has_is_refused(width: float, tmp_path: Path, inhand: Call) -> None:
    code, _, err = inhand("figures", tmp_path, "--width-mm", width)
    assert code == 2
    assert "--width-mm" in err
