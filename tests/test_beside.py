"""Earlier runs set beside a new one."""

from dataclasses import replace
from pathlib import Path

import pytest

from inhand.asterisk_test.beside import MOST, load_beside
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.report import Run, command, write_report
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.asterisk_test.table import HEADER, table_rows, with_beside
from inhand.control.trial import Trial, save_trial
from inhand.errors import InputError

CONFIG = AsteriskConfig(controller="thesis-ik", directions="Out", trials=1)


@pytest.fixture(scope="module")
def trials() -> tuple[Trial, ...]:
    return simulate(CONFIG, prepare(CONFIG))


@pytest.fixture
def earlier(trials: tuple[Trial, ...], tmp_path: Path) -> Path:
    folder = tmp_path / "earlier"
    (folder / "trials").mkdir(parents=True)
    passport = replace(trials[0].passport, engine="bullet")
    save_trial(replace(trials[0], passport=passport), folder / "trials" / "out_1.npz")
    return folder


def test_an_earlier_run_is_named_by_its_controller_and_engine(earlier: Path) -> None:
    (beside,) = load_beside([earlier])
    assert beside.name == "thesis-ik (bullet)"
    assert [result.direction for result in beside.results] == ["Out"]


def test_its_distances_stand_after_the_runs_own(trials: tuple[Trial, ...], earlier: Path) -> None:
    results = [result_of_trial(trial) for trial in trials]
    beside = load_beside([earlier])
    header, rows = with_beside(HEADER, table_rows([*results, replace(results[0], direction="In")], ()), beside)
    assert header[:4] == ("Direction", "Distance [mm]", "thesis-ik (bullet) [mm]", "Limit [mm]")
    assert rows[0][1] == rows[0][2]
    assert rows[1][2] == "-"


def test_it_has_a_panel_and_a_column_in_the_report(trials: tuple[Trial, ...], earlier: Path, tmp_path: Path) -> None:
    results = tuple(result_of_trial(trial) for trial in trials)
    config = replace(CONFIG, beside=(earlier,))
    out = tmp_path / "new"
    write_report(Run(config, trials, results, beside=load_beside(config.beside)), out)
    assert (out / "figures" / "panels.png").is_file()
    assert "thesis-ik (bullet) [mm]" in (out / "report.md").read_text(encoding="utf-8")
    assert f"--beside {earlier}" in command(config)


def test_folders_that_are_no_runs_and_too_many_are_refused(earlier: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--beside .* holds no trials of a run; give the --out folder"):
        load_beside([tmp_path])
    with pytest.raises(InputError, match=rf"--beside names {MOST + 1} runs; at most {MOST} fit beside"):
        load_beside([earlier] * (MOST + 1))
