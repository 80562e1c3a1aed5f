"""The report of a run: its page, its figures, and the command that repeats it."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.people.human import read_human_folder
from inhand.asterisk_test.report import Run, command
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.asterisk_test.scenes import average_curve, compatible_curve, counted_rows, trial_path
from inhand.asterisk_test.table import HEADER
from inhand.cli.asked import asked
from inhand.control.scenes import scene_at, start_scene
from inhand.control.trial import Trial, file_name
from inhand.tasks.primitives import TRAIN, TURNS, UNSEEN

CONFIG = AsteriskConfig(controller="thesis-ik", directions="Out,Right", trials=2, seed=2)
PICTURE = re.compile(r"!\[.+\]\(([^)]+)\)")


@pytest.fixture(scope="module")
def finished() -> Run:
    """Return a run in which trials lose their object."""
    trials = simulate(CONFIG, prepare(CONFIG))
    return Run(CONFIG, trials, tuple(result_of_trial(trial) for trial in trials))


@pytest.fixture(scope="module")
def written(finished: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of its report."""
    folder = tmp_path_factory.mktemp("report")
    finished.write_report(folder)
    return folder


def linked(folder: Path) -> list[Path]:
    """Return the files that the page shows."""
    return [folder / name for name in PICTURE.findall((folder / "report.md").read_text(encoding="utf-8"))]


def opened(path: Path) -> tuple[int, int, int]:
    """Return width, height and frames of a picture that can be read to its end."""
    with Image.open(path) as picture:
        frames = getattr(picture, "n_frames", 1)
        picture.seek(frames - 1)
        picture.load()
        return (*picture.size, frames)


def test_every_picture_of_the_page_is_there_and_opens(written: Path) -> None:
    pictures = linked(written)
    assert len(pictures) == len(set(pictures)) >= 5
    for path in pictures:
        width, height, frames = opened(path)
        assert min(width, height) > 200, path.name
        assert (frames > 5) is (path.suffix == ".gif"), path.name
    on_disk = {path for path in (written / "figures").rglob("*") if path.is_file()}
    assert on_disk == set(pictures)


def test_the_page_tells_what_was_run_what_came_out_and_how_to_repeat_it(written: Path) -> None:
    text = (written / "report.md").read_text(encoding="utf-8")
    assert text.startswith("# Asterisk Test: thesis-ik on cube_39 with 2v2_50.50_50.50_1.1_53\n")
    assert "start noise 1 mm and 1 deg (standard deviations), seed 2" in text
    assert "| " + " | ".join(name for name in HEADER if name not in {"Human [mm]", "Off path"}) + " |" in text
    assert len(re.findall(r"^\| (Out|Right) \|", text, flags=re.MULTILINE)) == 2
    assert "## What failed" in text
    assert re.search(r"^\* Out: lost contact in \d of 2 trials after .* mm", text, flags=re.MULTILINE)
    assert "    inhand asterisk --hand" in text
    assert "mujoco-core 4." in text


def test_people_stand_beside_the_controller(
    finished: Run, asterisk_data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("inhand.asterisk_test.report.write_replay", lambda *_, **__: None)
    folder = read_human_folder(asterisk_data / "human")
    replace(finished, people=folder.trials, notes=folder.notes).write_report(tmp_path)
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "figures/panels.png" in text
    assert opened(tmp_path / "figures" / "panels.png")[0] > 400
    assert f"People: {len(folder.trials)} recorded trials" in text
    assert "moving object's frame" in text
    for note in folder.notes:
        assert f"* {note}" in text


def test_a_run_that_only_turns_has_a_report(tmp_path: Path) -> None:
    config = replace(CONFIG, controller="ik", directions="cw,ccw", trials=1)
    trials = simulate(config, prepare(config))
    Run(config, trials, tuple(result_of_trial(trial) for trial in trials)).write_report(tmp_path)
    assert all(opened(path) for path in linked(tmp_path))
    assert "| cw | " in (tmp_path / "report.md").read_text()


def test_a_run_without_any_grasp_has_a_report(finished: Run, tmp_path: Path) -> None:
    trials = tuple(
        replace(trial, outcome="no grasp", phase=np.zeros_like(trial.phase)) for trial in finished.trials
    )  # fmt: skip
    run = replace(finished, trials=trials, results=tuple(result_of_trial(trial) for trial in trials))
    run.write_report(tmp_path)
    assert "2/2 no grasp" in (tmp_path / "report.md").read_text()
    assert all(opened(path) for path in linked(tmp_path))


def test_a_run_in_which_all_was_kept_says_so(finished: Run) -> None:
    kept = [replace(result, outcome="reached") for result in finished.results]
    text = replace(finished, results=tuple(kept)).page()
    assert "All 4 trials kept the object: 4 came to the end of their path. They came " in text
    assert "## What failed" not in text


def test_a_file_is_named_by_its_name_and_not_by_its_path(finished: Run) -> None:
    run = replace(finished, config=replace(CONFIG, hand="my folder/hand.toml", object="my folder/object.toml"))
    title, told = run.page().splitlines()[0], [text.get_text() for text in run.figure().texts]
    assert title == "# Asterisk Test: thesis-ik on cube_39 with 2v2_50.50_50.50_1.1_53"
    assert told[1] == "2v2_50.50_50.50_1.1_53, cube_39; mean of 2 trials a direction"


def test_every_primitive_has_a_file_name_of_its_own() -> None:
    names = [primitive.name for primitive in TRAIN + UNSEEN + TURNS] + ["30 deg", "-30 deg", "12.5 deg"]
    files = [file_name(name) for name in names]
    assert len(set(files)) == len(files)
    assert all(re.fullmatch(r"[a-z0-9_.-]+", name) for name in files)


@pytest.mark.parametrize(
    "config",
    [
        AsteriskConfig(),
        AsteriskConfig(hand="my hand.toml", directions="In',-45", out=Path("new results/it's"), seed=3, trials=1),
        AsteriskConfig(paths="human", human=Path("my recordings"), noise_mm=0.123456789, noise_deg=0.0),
        AsteriskConfig(compatible=True),
    ],
)
def test_the_command_repeats_the_run(config: AsteriskConfig) -> None:
    words = shlex.split(command(config))
    assert words[0] == "inhand"
    assert asked(words[1:]).config == config


# What the figures are drawn from.


def first(run: Run) -> Trial:
    return run.trials[0]


def test_the_scene_is_drawn_around_the_object_in_mm(finished: Run) -> None:
    scene = start_scene(first(finished))
    np.testing.assert_allclose(
        scene.object.mean(axis=0), 1e3 * first(finished).object_pose[first(finished).manipulation.start, :2], atol=1e-6
    )
    assert np.ptp(scene.object, axis=0) == pytest.approx([39, 39], abs=3)
    assert len(scene.links) == 4
    elsewhere = scene_at(first(finished), -1, np.array([0.01, 0.02]))
    np.testing.assert_allclose(elsewhere.origin_mm, [10, 20])


def test_curves_end_where_contact_was_first_lost(finished: Run) -> None:
    trials, results = finished.trials[:2], finished.results[:2]
    curve = average_curve(trials, results)
    assert (curve.name, curve.angle_deg, curve.failed) == ("Out", 90.0, True)
    assert curve.label_mm == pytest.approx(np.mean([result.metrics.distance_mm for result in results]))
    assert curve.points_mm[-1, 1] == pytest.approx(max(curve.label_mm, 0.0))
    for trial in trials:
        count = counted_rows(trial)
        touching = np.asarray(trial.manipulated_path()[2].all(axis=1))
        assert touching[: count - 1].all()
        assert count == len(touching) or not touching[count] or count == 1


def test_a_bent_reference_is_the_target_of_its_direction(finished: Run) -> None:
    trials, bent = finished.trials[:2], [replace(result, bent=True) for result in finished.results[:2]]
    for average in (average_curve, compatible_curve):
        assert average(trials, finished.results[:2]).target_mm is None
        curve = average(trials, bent)
        assert curve.target_mm is not None
        np.testing.assert_allclose(curve.target_mm, 1e3 * trials[0].reference[:, :2])
        assert curve.limit_mm is None


def test_a_trial_is_drawn_with_the_part_of_its_reference_that_it_came_along(finished: Run) -> None:
    drawn = trial_path(first(finished), finished.results[0])
    shown = max(finished.results[0].metrics.max_distance_mm, 10)
    assert drawn.target_mm is not None
    assert drawn.contact is not None
    assert drawn.target_mm[-1, 1] == pytest.approx(shown, abs=1.0)
    assert len(drawn.points_mm) == len(drawn.rotation_deg) == len(drawn.contact)
    assert drawn.failed
