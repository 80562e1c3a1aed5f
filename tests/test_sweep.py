"""A sweep over hands and objects: it goes on where it was killed, hides no failure, and names the best hand."""

import asyncio
import json
import re
import shutil
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

import inhand
from inhand import cli
from inhand.asterisk_test.cells import CellFile, read_cell
from inhand.asterisk_test.study import command
from inhand.asterisk_test.sweep import tables
from inhand.asterisk_test.sweep.config import HANDS, OBJECTS, SweepConfig
from inhand.asterisk_test.sweep.page import KINDS, OVER, figure_of, parts
from inhand.asterisk_test.sweep.summary import Sweep, sweep_of
from inhand.asterisk_test.sweep.sweep import directions_of, plan
from inhand.errors import InputError
from inhand.hands.files import load_hand
from inhand.pages import page_of
from inhand.plots.heatmap import HeatMap, heatmap_figure
from inhand.plots.style import INK
from inhand.records import table_of, text_of
from page_reader import Read

STANDARD, WIDE = "2v2_50.50_50.50_1.1_53", "2v2_50.50_50.50_1.1_80"
CUBE, HUGE = "cube_39", "box_400x30"
SCRIPT = Path(sys.executable).with_name("inhand")


def words(out: Path, *more: str) -> list[str]:
    """Return the words of the small sweep of these tests."""
    start = ["sweep", "--hands", STANDARD, WIDE, "--objects", CUBE, HUGE]
    return [*start, "--controller", "thesis-ik", "--directions", "In,Out", "--jobs", "2", "--out", str(out), *more]


def sweep(monkeypatch: pytest.MonkeyPatch, out: Path, *more: str) -> int:
    """Run the small sweep in this process; return its exit code."""
    monkeypatch.setattr(sys, "argv", ["inhand", *words(out, *more)])
    try:
        cli.main()
    except SystemExit as stop:
        return int(stop.code or 0)
    return 0


def stamps(out: Path) -> dict[str, int]:
    """Return when each cell's file was written."""
    return {path.name: path.stat().st_mtime_ns for path in (out / "cells").glob("*.json")}


async def killed_after_a_cell(out: Path) -> None:
    """Run the sweep in a process of its own and kill that while it computes its second cell."""
    null = asyncio.subprocess.DEVNULL
    process = await asyncio.create_subprocess_exec(SCRIPT, *words(out), stdout=null, stderr=null)
    for _ in range(600):
        if process.returncode is not None or stamps(out):
            break
        await asyncio.sleep(0.1)
    process.send_signal(signal.SIGKILL)
    await process.wait()


WORKER = """
import os, time
from inhand.cores import end_with
from inhand.pages import page_of
end_with(os.getppid())
print(os.getpid(), flush=True)
time.sleep(60)
"""


def test_a_worker_ends_within_two_seconds_of_its_sweep() -> None:
    async def seconds() -> float:
        pipe = asyncio.subprocess.PIPE
        parent = "import subprocess, sys; subprocess.run([sys.executable, '-c', sys.argv[1]])"
        process = await asyncio.create_subprocess_exec(sys.executable, "-c", parent, WORKER, stdout=pipe)
        assert process.stdout is not None
        await asyncio.wait_for(process.stdout.readline(), 60)
        process.terminate()
        began = time.monotonic()
        await asyncio.wait_for(process.stdout.read(), 30)  # ends when the worker, which holds the pipe, has ended
        return time.monotonic() - began

    assert asyncio.run(seconds()) < 2.0


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, int]]:
    """Return the folder of a sweep that was killed and then run again to its end, and what the kill had left."""
    out = tmp_path_factory.mktemp("results") / "sweep"
    asyncio.run(killed_after_a_cell(out))
    left = stamps(out)
    with pytest.MonkeyPatch.context() as patch:
        assert sweep(patch, out) == 0
    return out, left


def test_a_killed_sweep_goes_on_and_computes_nothing_twice(killed: tuple[Path, dict[str, int]]) -> None:
    out, left = killed
    now = stamps(out)
    assert 1 <= len(left) < 4
    assert len(now) == 4
    assert {name: now[name] for name in left} == left
    assert not list(out.rglob("*.part"))


def test_only_the_cell_that_is_missing_is_computed(
    killed: tuple[Path, dict[str, int]], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out, _ = killed
    monkeypatch.setattr("inhand.plots.save.save_figure", lambda *_: None)
    stepped = []
    monkeypatch.setattr("inhand.asterisk_test.spread.step_once", lambda: stepped.append("planar"))
    before = stamps(out)
    gone = next(name for name in before if "400" in name)
    (out / "cells" / gone).unlink()
    assert sweep(monkeypatch, out) == 0
    after = stamps(out)
    assert [name for name in before if after[name] != before[name]] == [gone]
    assert "4 cells, 3 of them already" in capsys.readouterr().out
    assert sweep(monkeypatch, out) == 0
    assert stamps(out) == after
    assert stepped == ["planar"]  # here, before other processes compute; not where there is nothing to compute


def test_cells_of_other_settings_are_refused_with_what_differs(
    killed: tuple[Path, dict[str, int]], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out, _ = killed
    before = stamps(out)
    assert sweep(monkeypatch, out, "--seed", "5", "--directions", "In") == 2
    said = capsys.readouterr().err
    assert "4 cells of other settings" in said
    assert "seed is 0 there and 5 now" in said
    assert "directions is In, Out there and In now" in said
    assert "--overwrite" in said
    assert stamps(out) == before


def test_overwrite_computes_again_only_what_differs(killed: tuple[Path, dict[str, int]]) -> None:
    out, _ = killed
    same = SweepConfig(
        hands=(STANDARD,), objects=(CUBE, HUGE), controller="thesis-ik", directions="In,Out", out=out, overwrite=True
    )
    assert len(plan(same).waiting) == 0
    assert len(plan(replace(same, trials=2)).waiting) == 2
    assert len(plan(replace(same, objects=(CUBE, "cube_43"))).waiting) == 1


def test_a_sweep_of_another_version_is_read_as_it_stands(
    killed: tuple[Path, dict[str, int]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(killed[0], tmp_path / "old")
    for path in (tmp_path / "old" / "cells").glob("*.json"):
        content = json.loads(path.read_text(encoding="utf-8"))
        content["settings"]["versions"]["source"] = "an older one"
        path.write_text(json.dumps(content), encoding="utf-8")
    monkeypatch.setattr("inhand.asterisk_test.cells.compute", lambda *_: pytest.fail("nothing is computed"))
    pd.testing.assert_frame_equal(inhand.load(tmp_path / "old").table(), inhand.load(killed[0]).table())
    next((tmp_path / "old" / "cells").glob("*.json")).unlink()
    with pytest.raises(InputError, match="is no cell of a study"):
        inhand.load(tmp_path / "old")


def test_the_report_holds_numbers_figures_and_what_could_not_be_run(killed: tuple[Path, dict[str, int]]) -> None:
    out, _ = killed
    content = json.loads((out / "sweep.json").read_text())
    assert len(content["cells"]) == 4
    shares = [case["share"] for case in content["cases"]]
    assert len(shares) == 4
    assert content["median_share"] == pytest.approx(np.median(shares))
    trials, table = pd.read_csv(out / "trials.csv"), inhand.load(out).table()
    numbers = table.select_dtypes("number").dropna(axis="columns")
    assert len(numbers.columns) > 15
    pd.testing.assert_frame_equal(trials[numbers.columns], numbers, check_exact=True)
    assert (trials.reached / trials.limit).tolist() == pytest.approx(shares)
    page = Read((out / "report.html").read_text(encoding="utf-8"))
    first, *_ = page.views()["heat"]["maps"]
    assert (len(first["rows"]), len(page.views()["heat"]["maps"])) == (2, 6)
    assert "cannot run" in {note for row in first["notes"] for note in row}
    text = (out / "report.md").read_text()
    assert "its skill, over 4 cases" in text
    assert "* No limits are given for joints of " in text
    assert re.search(rf"{STANDARD} with {HUGE} could not be run: .*400.0 mm wide", text)
    assert "2 of 4 cells" in text
    assert re.search(r"All cells took one core \d+ s by the clock", text)
    for heading in ("Best hand for each direction, over", "Best hand for each object", "What failed"):
        assert f"## {heading}" in text
    for name in re.findall(r"\]\((figures/.*?)\)", text):
        with Image.open(out / name) as picture:
            assert min(picture.size) > 200
    assert len(re.findall(r"\]\(figures/", text)) == len(KINDS) * len(OVER)


@pytest.mark.parametrize(
    ("config", "text"),
    [
        (SweepConfig(hands=()), "--hands names none"),
        (SweepConfig(jobs=-1), "--jobs -1"),
        (SweepConfig(objects=(CUBE, CUBE)), "asked for twice"),
        (SweepConfig(trials=0), "--trials 0"),
        (SweepConfig(hands=("2v9",)), "unknown hand"),
        (SweepConfig(gravity="up"), "--gravity up with 2v2_50.50_50.50_1.1_53, a hand in the plane"),
        (SweepConfig(hands=(STANDARD, "3f_60.60_40_10")), f"--hands {STANDARD} is in the plane and 3f_60.60_40_10 in"),
    ],
)
def test_what_no_cell_could_run_with_is_refused_before_any(tmp_path: Path, config: SweepConfig, text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        plan(replace(config, out=tmp_path / "sweep"))


def test_a_folder_of_other_files_and_a_damaged_cell_are_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    config = SweepConfig(hands=(STANDARD,), objects=(CUBE,), out=tmp_path)
    with pytest.raises(InputError, match="holds files that are no run of this kind"):
        plan(config)
    (tmp_path / "cells").mkdir()
    (tmp_path / "cells" / f"{STANDARD}__{CUBE}.json").write_text("{")
    with pytest.raises(InputError, match="is no cell of a study"):
        plan(config)


def entry(direction: str, reached: float, outcome: str = "reached", trial: int = 1) -> dict[str, Any]:
    """Return a trial of a cell's file, its limit 100 mm or deg."""
    turns = direction in {"cw", "ccw"}
    far, limit = ("rotation_final_deg", "limit_deg") if turns else ("distance_mm", "limit_mm")
    return {
        "direction": direction, "angle_deg": None if turns else 0.0, far: reached, limit: 100.0, "trial": trial,
        "fraction_of_limit": reached / 100, "outcome": outcome, "first_lost": None if outcome == "reached" else "left",
    }  # fmt: skip


def twice(direction: str, reached: float) -> list[dict[str, Any]]:
    """Return two trials that reach the same."""
    return [entry(direction, reached, trial=trial) for trial in (1, 2)]


def cell(hand: str, thing: str, *trials: dict[str, Any], reason: str | None = None) -> CellFile:
    """Return the content of a cell's file, of a hand with the fingers of the standard one."""
    settings = {"controller": "ik", "engine": "mujoco", "hand": table_of(load_hand(STANDARD))}
    return CellFile(hand, thing, reason, 30.0, 20.0, list(trials), settings)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"seconds": "1"}, "seconds is '1'; it must be a number"),
        ({"reason": 1}, "reason is 1; it must be a text or null"),
        ({"trials": [1]}, r"trials[0] is 1; it must be a table"),
        ({"more": 1}, "more is a field that this version does not know"),
    ],
)
def test_a_cell_says_which_field_is_wrong(tmp_path: Path, change: dict[str, Any], text: str) -> None:
    path = tmp_path / "cell.json"
    path.write_text(text_of(cell("a", "x", entry("In", 1.0))))
    assert read_cell(path) == cell("a", "x", entry("In", 1.0))
    path.write_text(text_of(table_of(cell("a", "x")) | change))
    with pytest.raises(InputError, match=rf"is no cell of a study: {re.escape(text)}.*; remove it"):
        read_cell(path)


@pytest.fixture(scope="module")
def found() -> Sweep:
    """Return two trials of two hands and two objects, one of which the second hand cannot hold."""
    lost = [entry("In", 60.0), entry("In", 20.0, "lost contact", trial=2)]
    contents = [
        cell("a", "x", *twice("In", 90.0), *twice("Out", 20.0), *twice("cw", 50.0)),
        cell("a", "y", *lost, *twice("Out", 40.0), *twice("cw", 50.0)),
        cell("b", "x", *twice("In", 70.0), *twice("Out", 95.0), *twice("cw", 102.5)),
        cell("b", "y", reason="too wide"),
    ]
    return sweep_of(contents, directions_of(SweepConfig(directions="cw,In,Out")))


def test_best_hands_means_and_shares_are_those_of_the_cases(found: Sweep) -> None:
    assert found.directions == ("Out", "In", "cw")
    assert found.cases.share.median() == pytest.approx(0.5)
    assert found.cases.share.mean() == pytest.approx((0.9 + 0.2 + 0.5 + 0.4 + 0.4 + 0.5 + 0.7 + 0.95 + 1.025) / 9)
    assert found.cases.kept.mean() == pytest.approx(8 / 9)
    finger = 1e3 * load_hand(STANDARD).finger_length
    ways = tables.best_by_direction(found).rows
    assert ways[1] == ("In", "a", "65.0 ± 14.1", "b", "35.0 ± 0.0", "a", "100.0", "a", f"{65 / finger:.2f}")
    assert ways[0] == ("Out", "b", "47.5 ± 0.0", "a", "30.0 ± 0.0", "a", "100.0", "b", f"{47.5 / finger:.2f}")
    assert ways[2] == ("cw", "b", "51.2 ± 0.0 deg", "a", "50.0 ± 0.0 deg", "a", "100.0 deg", "-", "-")
    assert tables.best_by_object(found).rows[1] == (
        "y",
        "a",
        "40.0 ± 14.1",
        "-",
        "-",
        "a",
        "100.0",
        "a",
        f"{40 / finger:.2f}",
    )
    each = tables.best_of_each(found).rows
    assert each[0] == ("Out", "x", "b", "95.0 ± 0.0", "a", "100.0")
    assert each[3] == ("In", "y", "a", "40.0 ± 28.3", "a", "100.0")
    assert each[4] == ("cw", "x", "b", "102.5 ± 0.0 deg", "a", "100.0 deg")
    hands = tables.hands_table(found).rows
    a, b, limit = (f"{far / finger:.2f}" for far in (47.5, 41.25, 100.0))
    assert hands[0] == ("a", "2 of 2", "47.5 ± 7.1", a, "100.0", limit, "0.48 ± 0.05", "0.45", "0.20", "5/6")
    assert hands[1] == (
        "b",
        "1 of 2",
        "41.2 ± 0.0",
        b,
        "50.0",
        f"{50 / finger:.2f}",
        "0.89 ± 0.00",
        "0.95",
        "0.70",
        "3/3",
    )
    assert tables.cells_table(found).rows[3] == ("b", "y", *["-"] * 8, "30.0")


def test_what_failed_is_told_with_its_numbers(found: Sweep) -> None:
    assert tables.failures(found) == [
        "b with y could not be run: too wide",
        "a with y, In: lost contact by the left finger, after 40 of 100 mm",
    ]
    assert tables.poor(found) == ["a with x: Out 0.20", "a with y: Out 0.40"]
    assert tables.beyond(found) == ["b with x, cw: 102 against a limit of 100 deg (1.02)"]
    said = " ".join(tables.summary(found))
    assert "8 of 9 cases (88.9 %)" in said
    assert "8 of 12 cases (66.7 %)" in said
    assert " s of its own: 1.5 and 2.2 cells a minute." in said


def test_heat_maps_show_distance_limit_and_skill_with_their_spread(found: Sweep) -> None:
    def texts(kind: str, column: str, trials: int = 2) -> set[str]:
        figure = figure_of(SweepConfig(trials=trials), found, kind, column)
        return {text.get_text() for text in figure.findobj(Text)}

    finger = 1e3 * load_hand(STANDARD).finger_length
    far = texts("distance", "object")
    assert {"55", "40", "± 0.0", "± 14.1", f"{40 / finger:.2f} L", "1 failed", "cannot run", "Distance [mm]"} <= far
    assert {"100", f"{100 / finger:.2f} L"} <= texts("limit", "object")
    assert {"65", "35", "Out", "In"} <= texts("distance", "direction")
    assert "cw" not in texts("limit", "direction")
    assert {"0.65", "± 0.14", "1 failed", "cw"} <= texts("share", "direction")
    assert any("n = 1 trial for each direction, so no spread is known" in text for text in texts("share", "object", 1))


def test_one_trial_has_no_spread_and_turns_alone_are_in_degrees() -> None:
    named = entry("In", 20.0, "lost contact") | {"first_lost": "finger 1"}
    assert sweep_of([cell("a", "x", named)], ("In",)).cases.why.tolist() == ["lost contact by finger 1"]
    turns = sweep_of([cell("a", "x", entry("cw", 40.0), entry("ccw", 60.0))], ("cw", "ccw"))
    table = tables.hands_table(turns)
    assert table.header[2:6] == ("Distance [deg]", "Distance [L]", "Limit [deg]", "Limit [L]")
    assert table.rows == (("a", "1 of 1", "50.0", "-", "100.0", "-", "0.50", "0.50", "0.40", "2/2"),)
    assert "n = 1 trial" in page_of(*parts(SweepConfig(), turns, 1.0, []))
    assert "±" not in page_of(*parts(SweepConfig(), turns, 1.0, []))


def test_a_sweep_in_which_nothing_could_be_run_says_so() -> None:
    nothing = sweep_of([cell("a", "x", reason="too wide")], ("In",))
    assert tables.hands_table(nothing).rows == (("a", "0 of 1", *["-"] * 8),)
    text = page_of(*parts(SweepConfig(), nothing, 1.0, []))
    assert "a with x could not be run: too wide" in text
    assert "0 of 1 cells" in text
    for kind in KINDS:
        assert heading_fits(figure_of(SweepConfig(), nothing, kind, "direction"))


def heading_fits(figure: Figure) -> bool:
    """Return whether every text of a figure lies inside of it."""
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in figure.findobj(Text) if text.get_text()]
    return all(box.x0 >= 0 and box.x1 <= figure.bbox.x1 and box.y1 <= figure.bbox.y1 for box in boxes)


def test_a_title_fits_a_small_sweep(found: Sweep) -> None:
    for kind in KINDS:
        assert heading_fits(figure_of(SweepConfig(), found, kind, "object"))


def test_a_heat_map_writes_every_number_and_marks_what_failed() -> None:
    heat = HeatMap(
        ("a", "b"), ("x", "y"), np.array([[0.5, -1e-9], [np.nan, 1.0]]), [["", "2 lost"], ["cannot run", ""]]
    )
    figure = heatmap_figure(heat, "Fraction", "Title")
    shown = [text.get_text() for text in figure.axes[0].findobj(Text)]
    assert {"0.50", "0.00", "1.00", "2 lost", "cannot run"} <= set(shown)
    ink = {text.get_text(): text.get_color() for text in figure.axes[0].texts}
    assert (ink["0.00"], ink["1.00"]) == ("white", INK)  # on dark and on light
    hatched = [patch for patch in figure.axes[0].patches if patch.get_hatch()]
    assert len(hatched) == 1
    with pytest.raises(InputError, match="one value and one note per cell"):
        HeatMap(("a",), ("x", "y"), np.zeros((2, 1)), [["", ""]])


def test_the_default_sweep_is_wide_and_its_command_short(tmp_path: Path) -> None:
    assert len(HANDS) >= 12
    assert len(OBJECTS) >= 10
    assert len(plan(SweepConfig(out=tmp_path / "sweep")).waiting) == len(HANDS) * len(OBJECTS)
    config = SweepConfig(hands=("a", "b"), seed=3)
    assert command("sweep", config) == "inhand sweep --seed 3 --hands a b"
    assert command("sweep", SweepConfig()) == "inhand sweep"
