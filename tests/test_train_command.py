"""`inhand train` and `inhand evaluate`: a small training end to end, stopped, gone on with, drawn and evaluated."""

from __future__ import annotations

import importlib.util
import json
import re
import sys
import tomllib
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
import pandas as pd
import pytest
from PIL import Image

import inhand as front
from commands import Call
from inhand.cli import train as command
from inhand.control.catalogue import CONTROLLERS, find_controller
from inhand.control.trial import file_name
from inhand.errors import InputError
from inhand.learning import seeds
from inhand.learning import train as trains
from inhand.learning.config import Training
from inhand.learning.presets import preset
from inhand.learning.progress import Reached
from inhand.learning.report import Compared
from inhand.learning.run_cards import card_of, read_config
from inhand.learning.train import Trained
from inhand.records import text_of
from page_reader import Read

if TYPE_CHECKING:
    from inhand.learning.journal import Evaluation
    from inhand.learning.progress import Learned

learns = pytest.mark.skipif(
    importlib.util.find_spec("jax") is None, reason="learning needs the extra `rl`: pip install 'inhand[rl]'"
)


def opened(path: Path) -> tuple[int, int]:
    with Image.open(path) as picture:
        picture.load()
        return picture.size


@learns
def test_a_training_is_watched_drawn_and_evaluated(tmp_path: Path, inhand: Call) -> None:
    run = tmp_path / "my run"
    code, out, err = inhand("train", "--preset", "smoke", "--episodes", 60, "--seed", 2, "--out", run)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert "recording demonstrations: 32 of 32" in lines
    told = [line for line in lines if line.startswith("episode ")]
    assert told[0].startswith("episode 0: return ")
    assert "the expert's" in told[0]
    assert "of the limit" in told[-1]
    assert "updates/s" in told[-1]
    for word in (
        "The best policy, at episode",
        "trained directions",
        "unseen directions",
        "Across [mm]",
        "Out'-Right'",
    ):
        assert word in out
    assert f"Policy: {run / 'best'}" in lines
    for name in ("learning", "progress", "directions"):
        assert min(opened(run / "figures" / f"{name}.png")) > 300
    view = Read((run / "report.html").read_text(encoding="utf-8"))
    titles = [chart["title"] for each in view.contents().values() for chart in each["charts"]]
    assert titles[:5] == ["Return", "Distance", "Lost objects", "Sum of the rewards", "Last reward of an episode"]
    page = (run / "report.md").read_text()
    assert page.startswith("# Training: my run\n")
    assert "cube_39 with 2v2_50.50_50.50_1.1_53, seed 2" in page
    for text in (page, (run / "report.html").read_text(encoding="utf-8")):
        command = text.rpartition("Run it again")[2]
        assert all(words in command for words in ("inhand train --out ", "--preset smoke", "--seed 2", "--episodes 60"))
    assert json.loads((run / "config.json").read_text())["config"]["episodes"] == 60

    code, _, err = inhand("train", "--out", run, "--resume")
    assert code == 2
    assert "is finished; its policy is in" in err
    code, out, err = inhand("evaluate", run, "--trials", 1, "--episodes", 18, "--out", tmp_path / "evaluated")
    assert (code, err) == (0, "")
    assert "Trained directions: my_run | ik" in out
    assert "Objects lost in 18 episodes: my_run " in out
    check_evaluation(tmp_path / "evaluated")
    check_loaded(run, tmp_path)


@learns
def test_several_seeds_are_trained_side_by_side_and_gone_on_with(
    tmp_path: Path, inhand: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "seeds"
    begun: list[tuple[int, str]] = []

    def begin(config: Training, folder: Path, **_: object) -> None:
        """Leave what a training leaves, as far as it is read."""
        begun.append((config.seed, folder.name))
        reached = asdict(Reached(0.1 * config.seed, 1, 2, 0.003, 0.1, 5.0, 6.0))
        angles = {f"{angle:g}": reached for angle in np.arange(0.0, 360.0, 22.5)}
        folder.mkdir()
        (folder / "config.json").write_text(text_of(card_of(config)))
        (folder / "metrics.jsonl").write_text(
            json.dumps({"kind": "evaluation", "step": 30, "score": 1.0, "directions": angles}) + "\n"
        )
        (folder / "report.md").touch()

    monkeypatch.setattr(seeds, "begin", begin)
    words = ("train", "--preset", "smoke", "--episodes", 30, "--jobs", 1, "--out", out)
    assert inhand(*words, "--seeds", 3)[0] == 0
    code, printed, _ = inhand(*words, "--seeds", 3, 4, "--json")
    assert (code, begun) == (0, [(3, "seed-3"), (4, "seed-4")])  # the one that is there is not trained again
    told = json.loads(printed)
    assert [row["seed"] for row in told["table"]] == [3, 4]
    assert told["table"][0] == pytest.approx(
        {"seed": 3, "trained": 0.3, "unseen": 0.3, "lost": 16, "trials": 32, "across_mm": 3.0, "turned_deg": 5.7296},
        abs=1e-4,
    )
    assert told["told"][-1].endswith(f"inhand report {out / 'seed-3'} {out / 'seed-4'}")
    assert tomllib.loads((out / "run.toml").read_text())["seeds"] == [3, 4]
    mean = seeds.rows(pd.read_csv(out / "seeds.csv"))[-1]
    assert mean == ("mean", "0.350 ± 0.071", "0.350 ± 0.071", "32 of 64", "3.0 ± 0.0", "5.7 ± 0.0")
    for more, text in (
        (("--seeds", 3, "--hand", "2v2_65.35_65.35_1.1_53"), "holds a training of other settings in seed-3"),
        (("--seeds", 3, 3), "--seeds 3 3: give each seed once"),
        (("--seeds", 3, "--seed", 4), "--seed beside --seeds: leave it out"),
        (("--seeds", 3, "--resume"), "--resume beside --seeds: leave it out"),
        ((), "--jobs, --backend and --address are for several trainings: give --seeds"),
    ):
        code, _, err = inhand(*words, *more)
        assert code == 2
        assert text in err
    (out / "notes.txt").write_text("mine")
    assert "holds notes.txt, which --seeds has not made" in inhand(*words, "--seeds", 3)[2]


def check_loaded(run: Path, folder: Path) -> None:
    """Check that a training and its evaluation come back as the values that the functions return."""
    trained, compared = front.load(run), front.load(folder / "evaluated")
    assert isinstance(trained, Trained)
    assert isinstance(compared, Compared)
    assert (trained.config.episodes, trained.config.seed, trained.config.engine) == (60, 2, "planar")
    card = json.loads((run / "config.json").read_text())
    del card["config"]["engine"]
    (folder / "config.json").write_text(json.dumps(card))
    assert read_config(folder).engine == "mujoco"  # what a card that names none was trained in
    assert len(trained.table()) == 16
    assert trained.policy.trained["seed"] == 2
    assert trained._repr_png_().startswith(b"\x89PNG")
    assert find_controller(CONTROLLERS.name_of(trained)).name == "my_run"
    content = json.loads((folder / "evaluated" / "metrics.json").read_text())
    table = compared.table()
    assert len(table) == 36
    mine = table[(table["controller"] == "my_run") & (table["direction"] == "Out")]
    told = [entry["distance_mm"] for entry in content["trials"] if entry["direction"] == "Out"]
    assert list(mine["distance_mm"]) == pytest.approx(told)
    assert list(table["direction"][:18]) == [entry["direction"] for entry in content["trials"]]
    assert any("joints" in note for note in compared.notes)
    assert "<table" in compared._repr_html_()
    again = json.loads((trained.save(folder / "copy") / "config.json").read_text())
    assert again == json.loads((run / "config.json").read_text())


def check_evaluation(folder: Path) -> None:
    """Check what an evaluation of 18 episodes leaves."""
    content = json.loads((folder / "metrics.json").read_text())
    assert len(content["trials"]) == len(content["expert"]["trials"]) == 18
    assert [(t["direction"], t["trial"]) for t in content["trials"][-2:]] == [("Out", 2), ("Out-Right", 2)]
    assert len(content["directions"]) == len(content["expert"]["directions"]) == 16
    assert all(entry["trials"] == 1 for entry in content["directions"])
    assert content["policy"]["seed"] == 2
    assert len(list((folder / "trials").glob("*.npz"))) == len(list((folder / "ik" / "trials").glob("*.npz"))) == 18
    page = (folder / "report.md").read_text()
    for text in ("## Trained directions", "## Unseen directions", "## What failed", "figures/learning.png"):
        assert text in page
    failed = content["failed"]["policy"]
    assert ("my_run: no trial failed." in page) == (not failed)
    assert (folder / "figures" / "failures_1.png").is_file() == bool(failed)
    for name in failed:
        assert (folder / "trials" / f"{file_name(name.rpartition(' ')[0])}_{name.rpartition(' ')[2]}.npz").is_file()
    for name in ("trained_directions", "unseen_directions", "radar", "learning", "progress", "directions"):
        assert min(opened(folder / "figures" / f"{name}.png")) > 300
    assert "inhand evaluate" in page


@learns
def test_a_stopped_training_says_what_is_kept_and_goes_on(
    tmp_path: Path, inhand: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    from threadpoolctl import threadpool_info, threadpool_limits

    run, threads = tmp_path / "run", list[int]()
    evaluated = command.Watch.evaluated

    def stop_at(episodes: int) -> Callable[..., None]:
        def told(self: command.Watch, found: Evaluation) -> None:
            threads.extend(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas")
            evaluated(self, found)
            if found.counters.episodes >= episodes:
                raise KeyboardInterrupt

        return told

    monkeypatch.setattr(command.Watch, "evaluated", stop_at(30))
    with threadpool_limits(2, "blas"):
        code, out, err = inhand("train", "--preset", "smoke", "--episodes", 60, "--out", run)
    assert (code, err) == (130, "")
    assert set(threads) == {1}  # threads of BLAS would fight with the updates for the cores
    last, again = out.splitlines()[-2:]
    assert last.startswith("Stopped. Kept: the run up to episode 3")
    assert again == f"Go on with: inhand train --out {run} --resume"
    assert not (run / "report.md").exists()
    code, _, err = inhand("train", "--out", run, "--resume", "--seed", 3, "--episodes", 5)
    assert code == 2
    assert "leave out --seed, --episodes, or train anew with another --out" in err
    code, _, err = inhand("train", "--out", run)
    assert code == 2
    assert "holds the results of a run; give another folder, or --overwrite" in err
    monkeypatch.setattr(command.Watch, "evaluated", evaluated)
    with monkeypatch.context() as patch:
        patch.setattr("inhand.learning.report.write_training", lambda *_: sys.exit(137))  # killed before the figures
        assert inhand("train", "--out", run, "--resume")[0] == 137
    assert not (run / "report.md").exists()
    with monkeypatch.context() as patch:
        patch.setattr("inhand.learning.report.curve_pictures", lambda *_: [])  # another test looks at them
        code, out, err = inhand("train", "--out", run, "--resume")
    assert (code, err) == (0, "")
    assert "recording demonstrations" not in out
    assert (run / "report.md").is_file()
    code, _, err = inhand("train", "--out", run, "--resume")
    assert code == 2
    assert "is finished; its policy is in" in err


def test_settings_reach_a_training_and_its_parts() -> None:
    found = trains.changed(preset("smoke"), {"batch": 8, "push": 0.0, "episodes": 5, "observation": "grip-open"})
    assert (found.learning.batch, found.recipe.push, found.episodes) == (8, 0.0, 5)
    assert found.interface.observation == "grip-open"
    assert found.recipe.episodes == preset("smoke").recipe.episodes
    with pytest.raises(InputError, match="unknown keyword 'bach'; did you mean batch"):
        trains.changed(found, {"bach": 8})
    with pytest.raises(InputError, match="hand is 3; it must be a text"):
        trains.changed(found, {"hand": 3})
    with pytest.raises(InputError, match=r"--resume goes on with .*: leave out --episodes, or train anew"):
        front.train(episodes=3, out="nowhere", resume=True)
    with pytest.raises(InputError, match="unknown preset 'best'"):
        front.train(preset="best")


def test_a_wrong_preset_is_told_the_presets_in_their_order(inhand: Call) -> None:
    code, _, err = inhand("train", "--preset", "foo")
    assert code == 2
    presets = [
        "default",
        "privileged",
        "family",
        "family-privileged",
        "from-family",
        "spatial",
        "spatial-privileged",
        "thesis",
        "smoke",
        "None",
    ]
    assert re.findall(r"'([\w-]+)'", err.partition("Expected")[2]) == presets


def test_a_title_tells_names_not_files(tmp_path: Path) -> None:
    (tmp_path / "file.toml").write_text('name = "brick"\nshape = "box"\nsize_mm = [30, 40, 100]\n')
    config = replace(preset("smoke"), object=str(tmp_path / "file.toml"))
    run = Trained(config, tmp_path, cast("Learned", None))
    assert run.title == f"smoke training, brick with {config.hand}, seed {config.seed}"
    (tmp_path / "file.toml").unlink()
    assert f"{tmp_path / 'file.toml'} with" in run.title


def test_what_is_kept_at_each_stage(tmp_path: Path) -> None:
    assert trains.kept(tmp_path / "none")[0] == "Stopped before anything was written."
    assert trains.kept(tmp_path)[0].startswith("Stopped before all demonstrations were there")
    (tmp_path / "ready.npz").touch()
    first, again = trains.kept(tmp_path)
    assert first == "Stopped before the first checkpoint. Kept: grasps and demonstrations."
    assert again.endswith("--resume")


def test_training_is_an_extra(tmp_path: Path, inhand: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trains, "PACKAGES", ("no_such_package",))
    code, out, err = inhand("train", "--out", tmp_path / "run")
    assert (code, out) == (2, "")
    assert err == "inhand: `inhand train` needs the extra `rl`: pip install 'inhand[rl]'\n"
    assert not (tmp_path / "run").exists()


@learns
@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--preset", "thesis", "--episodes", "0"), "episodes 0: give at least 1"),
        (("--hand", "2v2"), "2v2"),
        (("--seed=-1",), "--seed -1: a seed is 0 or more"),
        (("--resume",), "no training run in"),
    ],
)
def test_wrong_trainings_are_refused(words: tuple[str, ...], text: str, tmp_path: Path, inhand: Call) -> None:
    code, out, err = inhand("train", "--out", tmp_path / "run", *words)
    assert (code, out) == (2, "")
    assert text in err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("ik",), "'ik' is no learned policy: give the folder of a run of `inhand train`"),
        (("rl", "--last"), "--last: rl holds no last policy"),
        (("nothing",), "unknown controller 'nothing'"),
        (("rl", "--episodes", "0"), "--episodes 0: give at least one episode"),
        (("rl", "--trials", "0"), "--trials 0: give at least one trial"),
        (("rl", "--human", "nowhere"), "nowhere is not there"),
    ],
)
def test_wrong_evaluations_are_refused(words: tuple[str, ...], text: str, tmp_path: Path, inhand: Call) -> None:
    code, out, err = inhand("evaluate", *words, "--out", tmp_path / "run")
    assert (code, out) == (2, "")
    assert text in err
    assert not (tmp_path / "run").exists()
