"""The command line, end to end."""

import importlib.util
import json
import logging
import re
import signal
import sys
from pathlib import Path

import pandas as pd
import pytest
from PIL import Image
from rich.console import Console

from commands import Call, in_a_process
from inhand import __version__
from inhand.asterisk_test.comparison import HEADER
from inhand.cli.evaluate import SPARE
from inhand.cli.terminal import print_table, progress
from inhand.control.trial import load_trial
from inhand.errors import InputError

STANDARD = "2v2_50.50_50.50_1.1_53"
SCRIPT = Path(sys.executable).with_name("inhand")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small run, made by the console script in a shell of its own."""
    out = tmp_path_factory.mktemp("results") / "small run"
    words: list[str | Path] = ["asterisk"]
    words += ["--directions", "Right,-112.5", "--trials", "1", "--seed", "4", "--out", out, "--compatible"]
    code, printed, err = in_a_process(SCRIPT, *words)
    assert (code, err) == (0, "")
    (out / "printed.txt").write_text(printed, encoding="utf-8")
    return out


def test_a_run_leaves_numbers_report_figures_and_trials(run: Path) -> None:
    names = {str(path.relative_to(run)) for path in run.rglob("*") if path.is_file()}
    assert names >= {
        "metrics.json",
        "trials.csv",
        "report.md",
        "report.html",
        "figures/asterisk.png",
        "figures/radar.png",
        "figures/replay.gif",
        "figures/paths/right.png",
        "figures/paths/in1.png",
        "trials/right_1.npz",
        "trials/in1_1.npz",
    }
    assert not [name for name in names if name.endswith(".part")]
    for path in (*run.rglob("*.png"), *run.rglob("*.gif")):
        with Image.open(path) as picture:
            picture.load()
            assert min(picture.size) > 200, path.name


def test_the_numbers_tell_everything_about_the_run(run: Path) -> None:
    content = json.loads((run / "metrics.json").read_text(encoding="utf-8"))
    assert set(content) >= {"trials", "directions", "config", "versions", "seed"}
    (note,) = content["notes"]
    assert note.startswith("No limits are given for joints of 2v2")
    assert [(each["direction"], each["angle_deg"], each["trial"]) for each in content["trials"]] == [
        ("Right", 0.0, 1),
        ("In'", -112.5, 1),
    ]
    assert all(each["outcome"] == "end of grip" and each["distance_mm"] > 30 for each in content["trials"])
    assert all("mvt_eff" in each["asterisk_test"] for each in content["trials"])
    assert [each["direction"] for each in content["directions"]] == ["Right", "In'"]
    assert content["directions"][0]["distance_mm"]["mean"] == content["trials"][0]["distance_mm"]
    assert content["seed"] == content["config"]["seed"] == 4
    table = pd.read_csv(run / "trials.csv")
    assert table[["hand", "object", "controller", "engine"]].drop_duplicates().to_numpy().tolist() == [
        [STANDARD, "cube_39", "ik", "planar"]
    ]
    assert table.distance_mm.tolist() == table.reached.tolist() == [each["distance_mm"] for each in content["trials"]]
    assert table.limit.tolist() == [each["limit_mm"] for each in content["trials"]]
    assert content["config"]["hand"] == STANDARD
    assert content["versions"]["python"].startswith("3.")


def test_a_run_prints_its_table_and_where_the_report_is(run: Path) -> None:
    printed = (run / "printed.txt").read_text(encoding="utf-8")
    assert f"ik on cube_39 with {STANDARD}" in printed
    for word in ("Direction", "Distance [mm]", "Outcome", "Right", "In'", "1/1 end of grip"):
        assert word in printed
    assert "Human" not in printed
    told = f"No limits are given for joints of {STANDARD} ("
    assert told in printed
    assert f"* {told}" in (run / "report.md").read_text(encoding="utf-8")
    assert printed.rstrip().endswith(f"Report: {run / 'report.html'}")


def test_a_second_run_is_refused_and_overwriting_replaces(
    tmp_path: Path, inhand: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("inhand.asterisk_test.tested.Tested.write_report", lambda *_: None)
    out = tmp_path / "run"
    words = ("asterisk", "--controller", "thesis-ik", "--trials", 1, "--out", out, "--directions")
    assert inhand(*words, "Out")[0] == 0
    before = (out / "metrics.json").read_bytes()
    code, _, err = inhand(*words, "Right")
    assert code == 2
    assert err == f"inhand: --out {out} holds the results of a run; give another folder, or --overwrite to replace it\n"
    assert (out / "metrics.json").read_bytes() == before
    assert inhand(*words, "Right", "--overwrite")[0] == 0
    assert json.loads((out / "metrics.json").read_text())["trials"][0]["direction"] == "Right"
    assert not (out / "trials" / "out_1.npz").exists()
    assert [each.name for each in tmp_path.iterdir()] == ["run"]


def a_recording(folder: Path, name: str = "p1_2v2_c_n_1.csv", scale: float = 1.0) -> Path:
    """Write a recording of 30 mm to the right, at rest before and after."""
    rows = [*[0.0] * 10, *(scale * row / 10 for row in range(300)), *[30 * scale] * 10]
    path = folder / name
    path.write_text("frame,x,y,rmag\n" + "".join(f"{i},{mm:g},0,0\n" for i, mm in enumerate(rows)))
    return path


def test_trials_and_recordings_are_measured_alone(run: Path, tmp_path: Path, inhand: Call) -> None:
    csv, numbers = a_recording(tmp_path), tmp_path / "numbers.json"
    code, out, err = inhand("metrics", run / "trials" / "right_1.npz", csv, "--out", numbers)
    assert (code, err) == (0, "")
    assert "right_1.npz" in out
    assert csv.name in out
    simulated, human = json.loads(numbers.read_text())["trials"]
    made = json.loads((run / "metrics.json").read_text())["trials"]
    assert simulated == made[0]
    for place in (run, run / "trials"):
        found = json.loads(inhand("metrics", place, "--json")[1])["table"]
        assert sorted(each["direction"] for each in found) == sorted(each["direction"] for each in made)
    assert (human["direction"], human["outcome"], human["contact_fraction"]) == ("Right", "recorded", None)
    assert human["distance_mm"] == pytest.approx(30, abs=0.5)
    again = inhand("metrics", csv, "--out", numbers)
    assert again[0] == 2
    assert again[2] == f"inhand: --out {numbers} exists; give another name, or remove it first\n"


def test_a_folder_of_recordings_is_measured(tmp_path: Path, inhand: Call) -> None:
    a_recording(tmp_path)
    a_recording(tmp_path, "p2_2v2_a_n_1.csv")
    code, out, _ = inhand("metrics", tmp_path)
    assert code == 0
    assert "p1_2v2_c_n_1.csv" in out
    assert "p2_2v2_a_n_1.csv" in out


def test_what_cannot_be_viewed_is_refused(run: Path, inhand: Call) -> None:
    trial = run / "trials" / "right_1.npz"
    positive = "give a positive number; 1 is real time"
    for speed, told in (
        ("0", f"0: {positive}"),
        ("-1", f"-1: {positive}"),
        ("nan", "is nan; it must be a finite number"),
    ):
        code, _, err = inhand("view", trial, f"--speed={speed}")
        assert (code, err) == (2, f"inhand: --speed {told}\n")
    code, _, err = inhand("view", run / "nothing.npz")
    assert code == 2
    assert "no trial file" in err


@pytest.mark.skipif(importlib.util.find_spec("glfw") is not None, reason="the extra `viewer` is installed")
def test_the_viewer_is_an_extra(run: Path) -> None:
    from inhand.sim.viewer import play

    trial = load_trial(run / "trials" / "right_1.npz")
    with pytest.raises(InputError, match=r"the viewer \(.*needs the extra `viewer`: pip install 'inhand\[viewer\]'"):
        play(trial.passport.hand, trial.passport.object, trial.joint_angles, trial.object_pose, trial.time)


def test_a_recording_for_rerun_is_refused_before_anything_is_written(run: Path, inhand: Call, tmp_path: Path) -> None:
    trial = run / "trials" / "right_1.npz"
    cases: list[tuple[tuple[object, ...], str]] = [
        (("--browser",), "--rerun and --browser are two ways to show a trial: give one of them"),
        (("--out", tmp_path / "a.html"), "a.html: a recording for Rerun is a .rrd file"),
    ]
    if importlib.util.find_spec("rerun") is None:
        told = "a recording for Rerun needs the extra `rerun`: pip install 'inhand[rerun]'"
        cases.append((("--out", tmp_path / "a.rrd"), told))
    for words, told in cases:
        code, _, err = inhand("view", trial, "--rerun", *words)
        assert code == 2
        assert told in err
    assert not list(tmp_path.iterdir())


def test_rerun_has_every_row_of_bodies_contacts_forces_and_signals(run: Path, inhand: Call, tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="the extra `rerun` is not installed")
    trial, out = run / "trials" / "right_1.npz", tmp_path / "a.rrd"
    code, told, _ = inhand("view", trial, "--rerun", "--out", out)
    assert (code, told.splitlines()[0].startswith(f"Recording: {out}; look at it with: rerun")) == (0, True)
    printed = in_a_process(sys.executable, "-m", "rerun", "rrd", "print", out)[1]
    rows = len(load_trial(trial).time)
    for place in ("hand/object", "hand/left/0", "hand/contacts/right", "hand/forces/left", "signals/force_n"):
        assert re.search(rf"with {rows} rows .* /{place} ", printed), place
    assert re.search(r"with 1 rows .* /hand/palm ", printed)


def test_hands_and_objects_are_listed_by_their_whole_names(inhand: Call) -> None:
    code, out, _ = inhand("hands")
    assert code == 0
    for name in (STANDARD, "2v3_25.75_25.35.40_1.1_53", "3v3_25.40.35_40.35.25_1.1_63", "AvB_split_split_ratio_width"):
        assert name in out
    code, out, _ = inhand("objects")
    assert code == 0
    for name in ("cube_39", "cylinder_40", "ellipse_40x25", "39 x 39 x 100", "box_30x45"):
        assert name in out


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--hand", "2v2_50.50_50.50_1.1"), "unknown hand '2v2_50.50_50.50_1.1'"),
        (("--hand", "2v2_50.50_50.50_1.1_0"), "malformed hand name"),
        (("--object", "cub_39"), "unknown object 'cub_39'; did you mean cube_39"),
        (("--object", "box_300x39"), "opens to"),
        (("--controller", "ikk"), "unknown controller 'ikk'; did you mean ik"),
        (("--directions", "Oat"), "unknown direction 'Oat'; did you mean Out"),
        (("--trials", "0"), "--trials 0: give at least one trial"),
        (("--seed=-1",), "--seed -1: a seed is 0 or more"),
        (("--noise-mm=-1",), "--noise-mm -1: noise must be 0 or more"),
        (("--noise-deg", "nan"), "--noise-deg is nan; it must be a finite number"),
        (("--paths", "human"), "--paths human needs the recorded trials to follow: give their folder with --human DIR"),
        (("--human", "no_such_folder"), "folder no_such_folder is not there"),
        (("--paths", "upwards"), "invalid choice 'upwards'"),
        (("--trials", "many"), "invalid literal for int() with base 10: 'many'"),
        (("--hnad", STANDARD), "--hnad"),
    ],
)
def test_wrong_values_end_with_their_text_before_anything_is_written(
    words: tuple[str, ...],
    text: str,
    tmp_path: Path,
    inhand: Call,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = inhand("asterisk", "--out", "run", *words)
    assert code == 2
    assert text in " ".join(err.split())
    assert "Traceback" not in err
    assert out == ""
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("empty", "holds no CSV file; give one that does"),
        ("unknown", "the unit of this file is unknown"),
        ("normalised", "the unit of this file is unknown: its name says mm, but the object never moves further"),
        ("broken", "line 4"),
    ],
)
def test_folders_of_recordings_that_cannot_be_used(name: str, text: str, tmp_path: Path, inhand: Call) -> None:
    folder = tmp_path / name
    folder.mkdir()
    if name == "unknown":
        a_recording(folder, "recording.csv")
    elif name == "normalised":
        a_recording(folder, scale=1 / 170)
    elif name == "broken":
        path = a_recording(folder)
        lines = path.read_text().splitlines()
        lines[3] = "2,nan,0,0"
        path.write_text("\n".join(lines))
    code, _, err = inhand("asterisk", "--human", folder, "--out", tmp_path / "run")
    assert code == 2
    assert text in err
    assert not (tmp_path / "run").exists()
    assert inhand("metrics", folder)[0] == 2


def test_a_path_that_no_file_can_have_is_refused(inhand: Call) -> None:
    code, _, err = inhand("metrics", "x" * 300)
    assert code == 2
    assert err.startswith("inhand: xxx")
    assert err.endswith("File name too long; give another path\n")


def test_metrics_of_nothing_and_of_something_else(run: Path, inhand: Call) -> None:
    code, _, err = inhand("metrics")
    assert (code, err) == (2, "inhand: no files given: give .npz trials, .csv human files, or folders of human files\n")
    code, _, err = inhand("metrics", run / "report.md")
    assert code == 2
    assert "is neither a .npz trial, nor a .csv human file, nor a folder; give one of these (a file to write" in err


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_stopping_is_no_crash(
    tmp_path: Path,
    inhand: Call,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
    how: signal.Signals,
) -> None:
    # What a shell runs in the background ignores Ctrl-C, and so would what runs these tests.
    ignored = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, ignored))

    def stopped(*_: object, **__: object) -> None:
        signal.raise_signal(how)

    monkeypatch.setattr("inhand.cli.asterisk.run_setup", stopped)
    code, _, err = inhand("asterisk", "--trials", 1, "--directions", "Out", "--out", tmp_path / "a")
    assert (code, err) == (130, "inhand: stopped; nothing was overwritten\n")
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path, inhand: Call) -> None:
    (tmp_path / "file").write_text("text")
    words = ("asterisk", "--controller", "thesis-ik", "--trials", 1, "--directions", "Out")
    code, _, err = inhand(*words, "--out", tmp_path / "file" / "run")
    assert code == 2
    assert "--out" in err


def test_the_version_is_told_by_the_command_and_by_the_module() -> None:
    told = in_a_process(sys.executable, "-m", "inhand", "--version")
    assert told == (0, f"inhand {__version__}\n", "")


@pytest.mark.parametrize(("words", "text"), [(("help",), "asterisk"), (("help", "trace"), "--scale")])
def test_help_is_a_word_too(words: tuple[str, ...], text: str, inhand: Call) -> None:
    code, out, _ = inhand(*words)
    assert code == 0
    assert "usage: inhand" in out
    assert text in out


def test_the_table_of_an_evaluation_fits_a_terminal_of_100_columns(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "100")
    row = ("Out'-Right'", "130.0", "-0.10 | 0.92", "-13.0 | 118.0", "-", "38.8 | 10.0", "18.8 | 0.1", "0.886 | 1.000",
           "0 of 1 | 0 of 1")  # fmt: skip
    print_table("Both", HEADER, [row], spare=SPARE)
    *table, told = re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out).splitlines()
    assert max(map(len, table)) <= 100
    assert len([line for line in table if "-0.10 | 0.92" in line and row[-1] in line]) == 1
    assert told.startswith("Left out, for want of width: Contact")


def test_what_the_package_logs_stands_in_the_bar_of_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    logger = logging.getLogger("inhand")
    before = list(logger.handlers)
    with progress() as screen:
        logger.warning("compiling %s", "the planar engine")
        logger.info("planned %d of %d paths", 2, 4)
        console = Console(width=100)
        with console.capture() as written:
            console.print(screen.live.get_renderable())
        assert "planned 2 of 4 paths" in written.get()
    assert logger.handlers == before
