"""`inhand report` and `inhand view` without a display: pages of saved runs, side by side, and what they refuse."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import inhand as front
from commands import Call
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.report import Run
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.asterisk_test.spatial.report import SpatialRun
from inhand.comparing import compared
from inhand.control.episode import MANIPULATE
from inhand.control.trial import load_trial
from inhand.errors import InputError
from inhand.learning.presets import smoke
from inhand.learning.progress import Evaluated, Learned, Reached
from inhand.learning.train import Trained
from inhand.tracing.config import TraceConfig
from inhand.tracing.follow import Followed
from inhand.tracing.report import TraceRun
from inhand.tracing.run import prepare_trace
from inhand.tracing.trace import trace_of
from page_reader import Read

CONFIG = AsteriskConfig(controller="thesis-ik", directions="Out,Right", trials=1, seed=2)


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small run, without its pictures."""
    trials = simulate(CONFIG, prepare(CONFIG))
    run = Run(CONFIG, trials, tuple(map(result_of_trial, trials)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("inhand.asterisk_test.tested.Tested.write_report", lambda *_: None)
        return run.save(tmp_path_factory.mktemp("runs") / "one")


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the addresses that a browser was asked to open."""
    asked: list[str] = []

    def opened(place: str) -> bool:
        asked.append(place)
        return True

    monkeypatch.setattr("webbrowser.open", opened)
    return asked


def copied(saved: Path, to: Path) -> Path:
    shutil.copytree(saved, to)
    return to


def test_the_page_of_a_saved_run_is_made_again_and_opened(
    saved: Path, tmp_path: Path, inhand: Call, opened: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("inhand.asterisk_test.asterisk.simulate", lambda *_: pytest.fail("nothing is simulated again"))
    run = copied(saved, tmp_path / 'a <b> "c" 🙂')
    page = (run / "report.html").read_text(encoding="utf-8")
    (run / "report.html").unlink()
    code, out, err = inhand("report", run, "--open")
    assert (code, err) == (0, "")
    assert out == f"Page: {run / 'report.html'}\n"
    assert opened == [(run / "report.html").as_uri()]
    again = (run / "report.html").read_text(encoding="utf-8")
    assert Read(again).views()["player"] == Read(page).views()["player"]
    assert inhand("report", run)[0] == 0


def test_runs_are_compared(saved: Path, tmp_path: Path, inhand: Call) -> None:
    other, out = copied(saved, tmp_path / "two"), tmp_path / "both.html"
    code, _, err = inhand("report", saved, other, "--out", out)
    assert (code, err) == (0, "")
    read = Read(out.read_text(encoding="utf-8"))
    titles = [panel["title"] for panel in read.views()["asterisks"]["panels"]]
    assert titles == ["one", "two"]
    assert [trial["group"] for trial in read.views()["player"]["trials"]] == ["one", "one", "two", "two"]
    assert {"one [mm]", "two [mm]", "one, of limit"} <= {text for tag, text in read.texts if tag == "th"}
    code, _, err = inhand("report", saved, other, "--out", out)
    assert (code, err) == (2, f"inhand: --out {out} exists; give another name, or --overwrite to replace it\n")
    assert inhand("report", saved, other, "--out", out, "--overwrite")[0] == 0


def test_what_no_page_can_be_made_of_is_refused_before_anything_is_written(
    saved: Path, tmp_path: Path, inhand: Call
) -> None:
    half, later, nothing, cut = (copied(saved, tmp_path / name) for name in ("half", "later", "nothing", "cut"))
    (cut / "metrics.json").write_text('{"config":', encoding="utf-8")
    (half / "metrics.json").unlink()
    shutil.rmtree(nothing / "trials")
    content = json.loads((later / "metrics.json").read_text(encoding="utf-8"))
    content["config"]["wind"] = 9.81
    (later / "metrics.json").write_text(json.dumps(content), encoding="utf-8")
    (tmp_path / "busy.part").mkdir()
    cases = {
        (): "no run given: give the folder of one, or of several to compare",
        (tmp_path / "none",): "is not there: give the folder of a run, or a trial's .npz file",
        (half,): "holds a run that is not finished: wait for it, or give its command again",
        (tmp_path / "busy",): "holds a run that is not finished",
        (later,): "metrics.json: wind is a field that this version does not know; a later one may",
        (cut,): f"{cut / 'metrics.json'}: it is no JSON",
        (nothing,): "holds no trials: give the whole folder of a run",
        (saved, "--out", tmp_path): f"--out {tmp_path} is a folder; give the name of a file",
        (*[saved] * 7, "--out", tmp_path / "x.html"): "7 runs to compare: give 2 to 6",
        (saved, saved / "trials" / "..", "--out", tmp_path / "x.html"): "is given twice: give each run once",
    }
    before = sorted(path.name for path in tmp_path.iterdir())
    for words, told in cases.items():
        code, _, err = inhand("report", *words)
        assert code == 2
        assert told in err, err
        assert "Traceback" not in err
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_runs_of_different_kinds_are_not_compared(saved: Path) -> None:
    run, training = front.load(saved), Trained(smoke(), Path("b"), learned())
    with pytest.raises(InputError, match="a is a run of the Asterisk Test, b is a training; give runs of"):
        compared([(Path("a"), run), (Path("b"), training)])


def test_runs_in_space_are_called_so(saved: Path) -> None:
    with pytest.raises(InputError, match="b is a run of the Asterisk Test in space; give runs of"):
        compared([(Path("a"), front.load(saved)), (Path("b"), object.__new__(SpatialRun))])


def learned() -> Learned:
    """Return the record of a training of three episodes."""
    reached = Reached(0.5, 1, 2, 0.001, 0.1, 3.0, 4.0, 0.9)
    found = tuple(Evaluated(k, float(k), {"Out": reached, "Out'": reached}) for k in (0, 3))
    return Learned(np.arange(3.0), np.arange(3.0), np.array([1.0, 2.0]), np.array([2.0, 1.0]), np.zeros(2), found)


def test_trainings_are_compared() -> None:
    runs = [(Path(name), Trained(smoke(), Path(name), learned())) for name in ("a", "b")]
    read = Read(compared(runs))
    whole = " ".join(text for _, text in read.texts)
    assert "What evaluations reached, a" in whole
    assert "Rewards and losses, b" in whole
    assert "The best policies" in whole
    charts = [view for view in read.contents().values() if "charts" in view]
    assert len(charts) == 6
    assert charts[0]["charts"][1]["lines"][0]["y"] == [0.5, 0.5]


def test_traces_are_compared(saved: Path) -> None:

    config = TraceConfig(path="L", size=24.0, trials=1)
    setup = prepare_trace(config)
    trial = load_trial(saved / "trials" / "out_1.npz")
    rows = trial.phase == trial.phases.index(MANIPULATE)
    followed = Followed(setup.plans[0], trial, trial.phase[rows] * 0, (), 0.0)
    run = TraceRun(config, setup, (followed,), (replace(trace_of(followed), trial=7),), ())
    read = Read(compared([(Path("a"), run), (Path("b"), run)]))
    assert [trial["group"] for trial in read.views()["player"]["trials"]] == ["a", "b"]
    assert [line["name"] for line in read.views()["charts"]["charts"][0]["lines"]] == ["a, trial 7", "b, trial 7"]


def test_a_trial_is_shown_in_a_browser_where_there_is_no_display(
    saved: Path, tmp_path: Path, inhand: Call, opened: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr("tempfile.mkdtemp", lambda **_: str(tmp_path))
    trial = saved / "trials" / "right_1.npz"
    code, out, err = inhand("view", trial)
    assert (code, err) == (0, "")
    assert out == f"Page (no display here): {tmp_path / 'right_1.html'}\n"
    assert opened == [(tmp_path / "right_1.html").as_uri()]
    (shown,) = Read((tmp_path / "right_1.html").read_text(encoding="utf-8")).views()["player"]["trials"]
    assert shown["name"] == "Right, trial 1"
    page = tmp_path / "page.html"
    assert "as asked for" in inhand("view", trial, "--out", page)[1]
    code, _, err = inhand("view", trial, "--out", page)
    assert (code, err) == (2, f"inhand: --out {page} exists; give another name, or remove it first\n")
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    assert "Page (MuJoCo's viewer needs the extra `viewer`)" in inhand("view", trial)[1]
