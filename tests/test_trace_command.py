"""`inhand trace` end to end: what it leaves and prints, and what it refuses before anything is written."""

import contextlib
import io
import json
import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import inhand as front
from commands import Call
from inhand import caches
from inhand.cli.answer import tell
from inhand.cli.commands import Printing
from inhand.cli.terminal import print_table
from inhand.cli.trace import SPARE, run_trace
from inhand.control.trial import load_trial
from inhand.errors import InputError
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.tracing import fit
from inhand.tracing import report as trace_report
from inhand.tracing import run as trace_run
from inhand.tracing.config import TraceConfig
from inhand.tracing.drawing import Drawing, larger_side, scaled
from inhand.tracing.fit import carried
from inhand.tracing.named import find_path
from inhand.tracing.report import TraceRun
from inhand.tracing.run import plan_of, prepare_trace
from inhand.tracing.table import trace_rows
from inhand.tracing.tasks import find_task
from inhand.tracing.trace import Trace
from page_reader import Read

STANDARD = "2v2_50.50_50.50_1.1_53"
SMALL = ("--path", "L", "--size", "24", "--trials", "1")
SVG = '<svg xmlns="http://www.w3.org/2000/svg">{}</svg>'


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small run, with what it printed."""
    out = tmp_path_factory.mktemp("results") / "small run"
    with contextlib.redirect_stdout(io.StringIO()) as printed, pytest.MonkeyPatch.context() as patch:
        patch.setattr(trace_report, "FRAME_STEPS", 2)  # as it is for users
        tell("trace", run_trace(TraceConfig(path="square", size=30, trials=2, seed=4, out=out)), Printing())
    (out / "printed.txt").write_text(printed.getvalue(), encoding="utf-8")
    return out


@pytest.fixture
def no_film(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw no replay."""
    monkeypatch.setattr(trace_report, "write_replay", lambda *_, **__: None)


def test_a_run_leaves_numbers_report_figures_and_trials(run: Path) -> None:
    names = {str(path.relative_to(run)) for path in run.rglob("*") if path.is_file()}
    assert names == {
        "run.toml",
        "trials.csv",
        "trace.json",
        "report.html",
        "report.md",
        "figures/trace.png",
        "figures/replay.gif",
        "trials/square_1.npz",
        "trials/square_2.npz",
        "printed.txt",
    }
    for path in (run / "figures").iterdir():
        with Image.open(path) as picture:
            picture.load()
            assert min(picture.size) > 400, path.name
            assert getattr(picture, "n_frames", 1) > (50 if path.suffix == ".gif" else 0)
    trial = load_trial(run / "trials" / "square_2.npz")
    assert (trial.passport.path, trial.passport.trial, trial.passport.seed) == ("square", 2, 4)
    assert trial.outcome == "reached"


def test_a_run_is_loaded_as_it_was(run: Path, tmp_path: Path) -> None:
    loaded = front.load(run)
    assert isinstance(loaded, TraceRun)
    views = Read(loaded.html()).views()
    assert len(views["player"]["trials"]) == len(loaded.traces)
    assert views["player"]["trials"][0]["target"]
    assert [chart["title"] for chart in views["charts"]["charts"]] == [
        "Distance from the plan",
        "Rotation of the object",
    ]
    assert isinstance(loaded, TraceRun)
    content = json.loads((run / "trace.json").read_text())
    for entry, row in zip(content["trials"], loaded.table().to_dict("records"), strict=True):
        assert {name: entry[name] for name in ("trial", "outcome", "rms_mm", "max_mm", "time_s", "done")} == {
            name: pytest.approx(row[name]) for name in ("trial", "outcome", "rms_mm", "max_mm", "time_s", "done")
        }
    loaded.save(tmp_path / "again")
    assert (tmp_path / "again" / "report.md").read_text().splitlines()[:14] == (
        (run / "report.md").read_text().splitlines()[:14]
    )
    again = json.loads((tmp_path / "again" / "trace.json").read_text())
    assert again["followed"] == content["followed"]
    del again["config"]["engine"]
    (tmp_path / "again" / "trace.json").write_text(json.dumps(again))
    assert front.load(tmp_path / "again").config.engine == "mujoco"  # as every run before there was another
    (tmp_path / "again" / "trials" / "square_2.npz").unlink()
    with pytest.raises(InputError, match=r"trace.json: it tells of 2 trials, and 1 are there; run it again"):
        front.load(tmp_path / "again")


def test_a_trial_of_a_drawing_has_no_metrics_of_a_primitive(run: Path, tmp_path: Path, inhand: Call) -> None:
    file = run / "trials" / "square_1.npz"
    code, out, err = inhand("metrics", file, "--out", tmp_path / "numbers.json")
    assert (code, out) == (2, "")
    told = "followed square, which is no primitive: its errors are in the trace.json of its run; give trials of"
    assert err == f"inhand: {file} {told} `inhand asterisk`\n"
    assert not list(tmp_path.iterdir())


def test_the_numbers_tell_everything_about_the_run(run: Path) -> None:
    content = json.loads((run / "trace.json").read_text(encoding="utf-8"))
    assert list(content) == ["trials", "size_mm", "followed", "notes", "config", "versions", "seed"]
    assert [each["trial"] for each in content["trials"]] == [1, 2]
    for each in content["trials"]:
        assert set(each) >= {field.name for field in fields(Trace)} | {"done", "events"}
        assert (each["outcome"], each["completion"], each["done"], each["events"]) == ("reached", 1.0, True, [])
        assert 0 < each["rms_mm"] < each["max_mm"] < 1.5
        assert each["frechet_mm"] >= each["max_mm"] - 1e-9
        assert (each["legs"], each["approach_legs"]) == (5, 1)
        assert each["way_mm"] == pytest.approx(120)
        assert each["pushed_s"] is None
    assert content["size_mm"] == pytest.approx(30)
    assert content["seed"] == content["config"]["seed"] == 4
    assert (content["config"]["path"], content["config"]["hand"]) == ("square", STANDARD)
    assert content["versions"]["python"].startswith("3.")


def test_a_run_prints_its_table_and_where_the_report_is(run: Path) -> None:
    printed = (run / "printed.txt").read_text(encoding="utf-8")
    assert f"Square of 30 mm by ik: cube_39, {STANDARD}" in printed
    for word in ("Trial", "Outcome", "Done [%]", "RMS [mm]", "Max [mm]", "Fréchet [mm]", "Failures", "100.0"):
        assert word in printed
    assert "Pushed" not in printed
    assert printed.count("reached") == 2
    assert printed.rstrip().endswith(f"Report: {run / 'report.html'}")
    told = "No limits are given for joints of 2v2_50.50_50.50_1.1_53 ("
    assert told in printed
    assert f"* {told}" in (run / "report.md").read_text(encoding="utf-8")


def test_the_report_has_the_table_the_figures_and_the_command(run: Path) -> None:
    text = (run / "report.md").read_text(encoding="utf-8")
    assert text.startswith(f"# Square of 30 mm by ik: cube_39 with {STANDARD}\n")
    assert "| 1 | reached | 100.0 |" in text
    assert "Every trial followed its plan to the end without a failure." in text
    assert "2 trials of 5 primitives, 1 of them an approach, then 120 mm of way" in text
    for picture in re.findall(r"!\[.*\]\((.*)\)", text):
        assert (run / picture).is_file()
    drawn = "--seed 4 --noise-mm 1.0 --noise-deg 1.0 --disturb none"
    held = f"--hand 2v2_50.50_50.50_1.1_53 --object cube_39 --engine planar {drawn}"
    assert f"    inhand trace {held} --controller ik --trials 2 --path square --size 30.0 --out '{run}'\n" in text


def test_the_table_fits_a_terminal_of_100_columns(
    run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    traces = front.load(run)
    assert isinstance(traces, TraceRun)
    header, rows = trace_rows([replace(traces.traces[0], outcome="lost contact", pushed_s=1.0)])
    for width, spared in ((100, "Overlap [mm]"), (80, "Overlap [mm], Force [N], Fréchet [mm], Time [s]")):
        monkeypatch.setenv("COLUMNS", str(width))
        print_table("A trace", header, rows, numbers=2, spare=SPARE)
        *table, told = re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out).splitlines()
        assert max(map(len, table)) <= width
        assert len([line for line in table if "lost contact" in line and "100.0" in line]) == 1
        assert told == f"Left out, for want of width: {spared} (the report has them)"


def test_a_second_run_of_a_drawing_searches_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(caches.PLACE, str(tmp_path))
    configs = TraceConfig(path="L", trials=1), TraceConfig(path="L", trials=1, size=24)
    first = [prepare_trace(config) for config in configs]
    for module, name in ((fit, "farthest"), (fit, "plan_grasps"), (trace_run, "largest")):
        monkeypatch.setattr(module, name, None)
    for config, before in zip(configs, first, strict=True):
        again = prepare_trace(config)
        assert (again.size, again.notes, again.plans[0].legs) == (before.size, before.notes, before.plans[0].legs)
    with pytest.raises(TypeError, match="not callable"):
        prepare_trace(TraceConfig(path="L", trials=1, size=25))


def test_the_search_for_whether_a_drawing_fits_tells_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(caches.PLACE, "off")
    told: list[tuple[str, int, int]] = []
    way = prepare_trace(TraceConfig(path="L", size=24), lambda *now: told.append(now)).plans[0].way[-1]
    assert {(what, whole) for what, _, whole in told} == {("whether letter L fits, mm", round(1e3 * way))}
    come = [now for _, now, _ in told]
    assert (come[0], come[1], come[-1], come) == (0, 2, round(1e3 * way), sorted(come))


def test_a_second_run_is_refused_and_overwriting_replaces(run: Path, tmp_path: Path, inhand: Call) -> None:
    before = (run / "trace.json").read_bytes()
    code, _, err = inhand("trace", *SMALL, "--out", run)
    assert (code, (run / "trace.json").read_bytes()) == (2, before)
    assert err == f"inhand: --out {run} holds the results of a run; give another folder, or --overwrite to replace it\n"
    out = tmp_path / "other"
    out.mkdir()
    (out / "metrics.json").write_text("{}")
    code, _, err = inhand("trace", *SMALL, "--out", out, "--overwrite")
    assert (code, [path.name for path in out.iterdir()]) == (2, ["metrics.json"])
    assert "holds files that are no run of this kind" in err
    (out / "metrics.json").rename(out / "trace.json")
    code, printed, err = inhand("trace", *SMALL, "--out", out, "--overwrite", "--controller", "rl-privileged")
    assert (code, err) == (0, "")
    assert "Letter L of 24 mm by rl-privileged" in printed
    assert "The policy moves; twists and recoveries are the expert's (`ik`)." in printed
    assert sorted(path.name for path in out.iterdir()) == [
        "figures",
        "report.html",
        "report.md",
        "run.toml",
        "trace.json",
        "trials",
        "trials.csv",
    ]
    assert (out / "trials" / "letter_l_1.npz").is_file()
    assert [path.name for path in tmp_path.iterdir()] == ["other"]


@pytest.mark.usefixtures("no_film")
def test_a_trial_that_fails_is_told_and_kept(tmp_path: Path, inhand: Call) -> None:
    code, printed, err = inhand(
        "trace", "--path", "key", "--trials", "1", "--controller", "thesis-ik", "--out", tmp_path / "run"
    )
    assert (code, err) == (0, "")
    content = json.loads((tmp_path / "run" / "trace.json").read_text(encoding="utf-8"))
    (trial,) = content["trials"]
    assert trial["outcome"] in {"stopped", "lost contact"}
    assert not trial["done"]
    assert content["size_mm"] is None
    assert trial["events"]
    for event in trial["events"]:
        assert set(event) == {"time_s", "leg", "kind", "place_mm", "off_mm", "what"}
        assert 0 <= event["leg"] < trial["legs"]
        assert np.hypot(*event["place_mm"]) < 60
    (sentence,) = [line for line in printed.splitlines() if line.startswith("Trial 1, ")]
    assert f"{trial['events'][0]['what']} at (" in sentence
    assert f"* {sentence}" in (tmp_path / "run" / "report.md").read_text(encoding="utf-8")


@pytest.mark.usefixtures("no_film")
def test_a_task_with_a_wall_shows_the_push(tmp_path: Path, inhand: Call) -> None:
    code, printed, _ = inhand("trace", "--path", "wall", "--trials", "1", "--out", tmp_path / "run")
    assert code == 0
    assert "Task wall by ik" in printed
    assert "Pushed [s]" in printed
    (trial,) = json.loads((tmp_path / "run" / "trace.json").read_text(encoding="utf-8"))["trials"]
    assert trial["pushed_s"] >= 1
    assert "Pushed is the longest time against the wall" in (tmp_path / "run" / "report.md").read_text(encoding="utf-8")


def test_a_long_replay_is_faster_than_it_was(run: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(trace_report, "MOST_FRAMES", 10)
    del run
    run_trace(TraceConfig(path="L", size=24, trials=1, out=tmp_path / "run"))
    with Image.open(tmp_path / "run" / "figures" / "replay.gif") as picture:
        assert getattr(picture, "n_frames", 1) <= 10
    assert re.search(r"Replay of trial 1, [\d.]+ x as fast", (tmp_path / "run" / "report.md").read_text())


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--path", "sqare"), "unknown --path 'sqare'; did you mean square"),
        (("--path", "wal"), "unknown --path 'wal'; did you mean wall?; allowed are square, "),
        (("--path", "nowhere.svg"), "there is no such file; give the path of a .svg file that is there"),
        (("--path", "square", "--size", "0"), "--size 0: give a positive size in mm"),
        (("--path", "square", "--size", "-5"), "--size -5: give a positive size in mm"),
        (("--path", "square", "--size", "nan"), "--size is nan; it must be a finite number"),
        (("--path", "key", "--size", "20"), "--path key is a task and has no size: leave --size and --scale out"),
        (("--path", "tour", "--scale"), "--path tour is a task and has no size"),
        (("--trials", "0"), "--trials 0: give at least one trial"),
        (("--seed", "-1"), "--seed -1: a seed is 0 or more"),
        (("--noise-mm", "-1"), "--noise-mm -1: noise must be 0 or more"),
        (("--noise-deg", "nan"), "--noise-deg is nan; it must be a finite number"),
        (("--controller", "ki"), "unknown controller 'ki'; did you mean ik?"),
        (("--hand", "2v2"), "2v2"),
        (("--object", "cub_39"), "cub_39"),
        (("--object", "box_200x39"), "is 200.0 mm wide"),
    ],
)
def test_bad_words_are_refused_before_anything_is_written(
    words: tuple[str, ...], text: str, tmp_path: Path, inhand: Call
) -> None:
    code, printed, err = inhand("trace", *words, "--out", tmp_path / "run")
    assert (code, printed.strip()) == (2, "")
    assert err.startswith("inhand: ")
    assert text in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("empty.svg", SVG.format(""), "it shows no path and no shape; its elements are (none); draw one of"),
        ("words.svg", SVG.format("<text>hello</text>"), "it holds <text>, which is neither a path nor a basic shape"),
        (
            "jump.svg",
            SVG.format('<path d="M0,0 L10,0 M20,0 L30,0"/>'),
            "the path jumps from (10, 0) to (20, 0), 10 of the file's units, but is to be one line: the hand",
        ),
        ("gap.csv", "x_mm,y_mm\n0,0\n10,nan\n", "line 3: column y_mm holds 'nan', not a finite number"),
        ("one.csv", "x_mm,y_mm\n0,0\n", "the file ends with 1 way-point; it needs two or more"),
        ("still.csv", "x_mm,y_mm\n0,0\n0,0\n", "still goes nowhere: all of its way-points are where the object starts"),
    ],
)
def test_bad_files_are_refused_before_anything_is_written(
    name: str, content: str, text: str, tmp_path: Path, inhand: Call
) -> None:
    (tmp_path / name).write_text(content, encoding="utf-8")
    code, printed, err = inhand("trace", "--path", tmp_path / name, "--out", tmp_path / "run")
    assert (code, printed.strip()) == (2, "")
    assert text in err
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_shape_that_is_too_large_is_refused_with_the_largest_that_fits(
    tmp_path: Path, inhand: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fit, "EXACT", 0.015)
    monkeypatch.setattr(fit, "SMALLEST", 0.06)  # which saves most of the search
    code, _, err = inhand("trace", "--path", "J", "--size", "130", "--out", tmp_path / "run")
    assert code == 2
    assert list(tmp_path.iterdir()) == []
    found = re.fullmatch(
        r"inhand: letter J of 130 mm lies outside of what the hand can reach with this object: from"
        r" \((-?\d+), (-?\d+)\) to .* \(mm from the object's start\); the largest that fits is (\d+) mm: give --size"
        r" \3 or less, or --scale\n",
        err,
    )
    assert found is not None
    x, y, most = (int(number) for number in found.groups())
    assert np.hypot(x, y) > 40
    assert 60 < most < 120
    monkeypatch.setattr(trace_run, "largest", lambda *_: most / 1e3)
    config = TraceConfig(path="J", size=200, trials=1, scale=True)
    setup = prepare_trace(config)
    assert setup.size == pytest.approx(most / 1e3)
    assert setup.notes == (f"Scaled from 200 to {most} mm, the largest that fits.",)
    assert carried(setup.held, setup.plans[0]) == pytest.approx(setup.plans[0].way[-1])


def test_a_drawing_beyond_the_fingers_is_refused_without_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trace_run, "fit_of", lambda *_: pytest.fail("searched"))
    told = r"lies (\d+) mm from where the (left|right) finger begins, .* reaches (\d+) mm; give --size (\d+) or less"
    with pytest.raises(InputError, match=rf"square of 500 mm is too large for hand .*way-point 3 {told}") as error:
        prepare_trace(TraceConfig(path="square", size=500))
    found = re.search(told, str(error.value))
    assert found is not None
    away, most, size = (int(found[k]) for k in (1, 3, 4))
    held = Held(load_hand(TraceConfig.hand), load_object(TraceConfig.object))
    corner = np.hypot(*(np.array(held[0].start_position) - held[0].left.base + 0.25))
    assert away == round(1e3 * corner)
    assert 144 + 27 < most < 180  # finger and half the cube's diagonal, and a little for the finger's round tip
    fit.check_extent(held, scaled(find_path("square"), size / 1e3 - 0.001))
    with pytest.raises(InputError, match=r"square of \d+ mm is too large for hand"):
        fit.check_extent(held, scaled(find_path("square"), size / 1e3 + 0.001))
    with pytest.raises(InputError, match="square of 500 mm is too large for hand"):
        find_task("square:500").plan(held, np.random.default_rng(0))
    short = load_hand("2v2_70.30_50.50_0.9.1_53")  # whose left finger is 14 mm shorter
    beside = Drawing("line", np.array([(0.0, 0.0, 0.0), (-0.005, 0.072, 0.0)]), sized=True)
    with pytest.raises(InputError, match="where the left finger begins"):
        fit.check_extent(Held(short, held.object), beside)
    back_and_forth = np.tile([(0.0, 0.0, 0.0), (0.05, 0.0, 0.0)], (201, 1))
    with pytest.raises(InputError, match=r"zigzag has a way of 20.1 m, turns counted as arcs; it may have 20 m"):
        fit.check_extent(held, Drawing("zigzag", back_and_forth, sized=True))


def test_a_drawing_without_a_size_gets_a_share_of_the_reachable_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(caches.PLACE, "off")
    monkeypatch.setattr(trace_run, "largest", lambda *_: 0.05)
    setup = prepare_trace(TraceConfig(path="star", trials=2))
    assert setup.size == pytest.approx(0.03)
    assert setup.notes == ("Size 30 mm is 60 % of the reachable 50 mm.",)
    assert setup.plans[0] is setup.plans[1]
    assert larger_side(scaled(find_path("star"), 0.03)) == pytest.approx(0.03)
    assert setup.plans[0].legs == plan_of(setup.held, scaled(find_path("star"), 0.03)).legs
    monkeypatch.setattr(trace_run, "largest", lambda *_: 0.0)
    with pytest.raises(InputError, match=r"no size of star lies inside the reach of hand '2v2.*'; use another hand"):
        prepare_trace(TraceConfig(path="star"))
    monkeypatch.setattr(fit, "carried", lambda *_: 0.01)
    with pytest.raises(InputError, match=r"carries the object only 10 of \d+ mm along it; and no size of it fits"):
        prepare_trace(TraceConfig(path="star", size=30))


def test_way_points_of_a_file_keep_their_size_and_their_turns(tmp_path: Path) -> None:
    (tmp_path / "hop.csv").write_text("x_mm,y_mm,theta_deg\n0,0,0\n10,0,10\n10,-10,0\n", encoding="utf-8")
    setup = prepare_trace(TraceConfig(path=str(tmp_path / "hop.csv"), trials=1))
    assert setup.size == pytest.approx(0.01)
    assert [leg.kind for leg in setup.plans[0].legs] == ["turn", "move", "turn", "move"]
    larger = prepare_trace(TraceConfig(path=str(tmp_path / "hop.csv"), trials=1, size=20))
    assert larger.size == pytest.approx(0.02)
