"""Earlier runs set beside a new one."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.text import Text

import inhand
from inhand.asterisk_test.beside import MOST, load_beside
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.report import Run, both_radars, command, side_by_side
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.asterisk_test.table import HEADER, shown_columns, table_rows, with_beside
from inhand.cli.asterisk import SPARE
from inhand.cli.terminal import print_table
from inhand.control.trial import Trial, save_trial
from inhand.errors import InputError
from inhand.hands.files import load_hand

CONFIG = AsteriskConfig(controller="thesis-ik", directions="Out", trials=1)


@pytest.fixture(scope="module")
def trials() -> tuple[Trial, ...]:
    return simulate(CONFIG, prepare(CONFIG))


Save = Callable[..., Path]
LONG, WIDE = "2v2_65.35_65.35_1.1_53", "2v2_50.50_50.50_1.1_80"


@pytest.fixture
def saved(trials: tuple[Trial, ...], tmp_path: Path) -> Save:
    """Return what saves an earlier run into a folder, its passport changed."""

    def save(name: str, **changed: Any) -> Path:
        folder = tmp_path / name
        (folder / "trials").mkdir(parents=True)
        passport = replace(trials[0].passport, **changed)
        save_trial(replace(trials[0], passport=passport), folder / "trials" / "out_1.npz")
        return folder

    return save


def names(trials: tuple[Trial, ...], *folders: Path, labels: tuple[str, ...] = ()) -> list[str]:
    """Return the names of the new run and of earlier ones."""
    name, beside = load_beside(folders, trials[0].passport.settings, labels)
    return [name, *(run.name for run in beside)]


def test_names_tell_what_differs(trials: tuple[Trial, ...], saved: Save) -> None:
    hands = names(trials, saved("long", hand=load_hand(LONG)), saved("wide", hand=load_hand(WIDE)))
    assert hands == [CONFIG.hand, LONG, WIDE]
    assert names(trials, saved("bullet", engine="bullet")) == ["planar", "bullet"]
    both = names(trials, saved("ik", controller="ik"), saved("other", controller="ik", engine="bullet"))
    assert both == ["thesis-ik, planar", "ik, planar", "ik, bullet"]
    assert names(trials) == ["thesis-ik"]


def test_a_trial_alone_is_loaded_with_its_engine(saved: Save) -> None:
    for engine in ("planar", "bullet"):
        assert inhand.load(saved(engine, engine=engine) / "trials" / "out_1.npz").config.engine == engine


def test_what_does_not_differ_is_told_apart_by_its_folder(trials: tuple[Trial, ...], saved: Save) -> None:
    same = saved("a/run"), saved("b/run")
    assert names(trials, same[0]) == ["this run", "run"]
    assert names(trials, *same) == ["this run", "a/run", "b/run"]
    assert names(trials, saved("x", engine="bullet"), saved("y")) == ["planar (this run)", "bullet", "planar (y)"]


def test_labels_stand_instead_and_are_one_for_each_run(trials: tuple[Trial, ...], saved: Save) -> None:
    earlier = saved("earlier")
    assert names(trials, earlier, labels=("new", "old")) == ["new", "old"]
    assert names(trials, labels=("alone",)) == ["alone"]
    for count in (1, 3):
        with pytest.raises(InputError, match=rf"--label gives {count} names for 2 runs: give one for this run"):
            names(trials, earlier, labels=("new", "old", "older")[:count])
    for labels in (("same", "same"), ("new", " ")):
        with pytest.raises(InputError, match=r"--label '.+': give each run a name of its own"):
            names(trials, earlier, labels=labels)
    with pytest.raises(InputError, match=r"--beside names .*earlier twice: give each run once"):
        names(trials, earlier, earlier)


def test_table_panels_radar_and_report_have_the_names(
    trials: tuple[Trial, ...], saved: Save, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("inhand.asterisk_test.asterisk.simulate", lambda *_: trials)
    monkeypatch.setattr("inhand.asterisk_test.asterisk.finish.__defaults__", (lambda *_: trials,))
    monkeypatch.setattr("inhand.asterisk_test.report.write_replay", lambda *_, **__: None)
    earlier = saved("earlier", hand=load_hand(LONG))
    run = inhand.asterisk(controller="thesis-ik", directions="Out", trials=1, beside=earlier, label=["new", "old"])
    assert isinstance(run, Run)
    header, rows = with_beside(HEADER, table_rows(run.results, ()), run.name, run.beside)
    assert header[:4] == ("Direction", "new [mm]", "old [mm]", "Limit [mm]")
    assert rows[0][1] == rows[0][2]
    for figure in (side_by_side(run, ""), both_radars(run)):
        assert {"new", "old"} <= {text.get_text() for text in figure.findobj(Text)}
    run.write_report(tmp_path / "new")
    assert (tmp_path / "new" / "figures" / "panels.png").is_file()
    text = (tmp_path / "new" / "report.md").read_text(encoding="utf-8")
    assert "| new [mm] | old [mm] |" in text
    assert f"## Set beside it\n\n* old: {LONG}, cube_39, thesis-ik, planar." in text
    assert f"--beside {earlier} --label new old" in command(run.config)


def test_a_direction_that_only_one_of_them_has_is_left_open(trials: tuple[Trial, ...], saved: Save) -> None:
    name, beside = load_beside([saved("earlier")], trials[0].passport.settings)
    elsewhere = replace(result_of_trial(trials[0]), direction="In")
    assert with_beside(HEADER, table_rows([elsewhere], ()), name, beside)[1][0][2] == "-"


def test_folders_that_are_no_runs_and_too_many_are_refused(trials: tuple[Trial, ...], tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--beside .* holds no trials of a run; give the --out folder"):
        names(trials, tmp_path)
    with pytest.raises(InputError, match=rf"--beside names {MOST + 1} runs; at most {MOST} fit beside"):
        names(trials, *[tmp_path] * (MOST + 1))


def test_the_table_of_a_run_fits_a_terminal_of_100_columns(
    trials: tuple[Trial, ...], saved: Save, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    name, beside = load_beside([saved("earlier", hand=load_hand(LONG))], trials[0].passport.settings)
    rows = table_rows([replace(result_of_trial(trials[0]), direction="Out'-Right'")] * 3, ())
    monkeypatch.setenv("FORCE_COLOR", "1")
    for width in (100, 80):
        monkeypatch.setenv("COLUMNS", str(width))
        for header, found in (shown_columns(rows), with_beside(*shown_columns(rows), name, beside)):
            print_table("A run", header, found, spare=SPARE)
            *table, told = re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out).splitlines()
            assert max(map(len, table)) <= width
            assert len([line for line in table if "Out'-Right'" in line and found[0][-1] in line]) == 1
            assert told.startswith("Left out, for want of width: Overlap, Force")
