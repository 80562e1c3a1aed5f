"""The page for a browser: what is in it, how names are escaped, how small it is, how near packed numbers are."""

import base64
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.report import Run
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.control.episode import SHAPES
from inhand.control.replays import MOST_TRIALS, Shown, player_of
from inhand.geometry import Array, planar
from inhand.pages import again, listed, table_of
from inhand.plots.page.document import SCRIPTS, WebPart, html_of, settings_of
from inhand.plots.page.packed import packed, packed_flags
from page_reader import EVIL, Read, named, unpacked

CONFIG = AsteriskConfig(controller="thesis-ik", directions="Out,Right,cw", trials=1, seed=2)


@pytest.fixture(scope="module")
def finished() -> Run:
    """Return a run in which trials lose their object."""
    trials = simulate(CONFIG, prepare(CONFIG))
    return Run(CONFIG, trials, tuple(result_of_trial(trial) for trial in trials))


@pytest.fixture(scope="module")
def page(finished: Run) -> str:
    return finished.html()


# Packed numbers.


@pytest.mark.parametrize("rows", [1, 2, 300])
def test_packed_numbers_are_half_a_step_off_at_most(rows: int) -> None:
    drawn = np.random.default_rng(rows).normal(size=(rows, 5))
    columns: Array = drawn * np.array([1e-9, 1.0, 1e6, 0.0, 0.0]) + np.array([0.0, 1e3, 0.0, -7.25, 0.0])
    found = packed(columns)
    off = np.abs(unpacked(found) - columns)
    assert (off <= 0.5 * np.array(found.step) + 1e-9 * np.abs(columns).max()).all()
    same = np.ptp(columns, axis=0) == 0
    np.testing.assert_array_equal(unpacked(found)[:, same], columns[:, same])


def test_flags_are_bits_of_a_byte() -> None:
    flags = np.array([[True, False, False], [True, True, False], [False, False, True], [False, False, False]])
    assert list(base64.b64decode(packed_flags(flags))) == [1, 3, 4, 0]


def test_a_trial_is_replayed_where_it_was(finished: Run, page: str) -> None:
    for trial, told in zip(finished.trials, Read(page).views()["player"]["trials"], strict=True):
        columns, joints = unpacked(told["packed"]), trial.passport.hand.n_joints
        np.testing.assert_allclose(columns[:, :joints], trial.joint_angles, atol=1e-4)
        pose = planar(trial.object_pose)
        np.testing.assert_allclose(columns[:, joints : joints + 2], 1e3 * pose[:, :2], atol=0.01)
        np.testing.assert_allclose(np.cos(columns[:, joints + 2]), np.cos(pose[:, 2]), atol=1e-3)
        points = columns[:, joints + 3 :].reshape(len(columns), -1, 4)
        np.testing.assert_allclose(points[..., :2], 1e3 * trial.finger_points[..., :2], atol=0.01)
        np.testing.assert_allclose(points[..., 2:], trial.forces[..., :2], atol=0.01)
        touching = np.frombuffer(base64.b64decode(told["contact"]), np.uint8)
        np.testing.assert_array_equal((touching[:, None] >> np.arange(2)) & 1, trial.touching)
        assert (told["rows"], told["start"]) == (len(trial.time), trial.manipulation.start)
        assert told["period"] == trial.passport.period


def test_a_trial_whose_grasp_failed_is_played_from_its_beginning(finished: Run) -> None:
    trial = replace(finished.trials[0], outcome="no grasp", phase=np.zeros_like(finished.trials[0].phase))
    run = replace(finished, trials=(trial,), results=(result_of_trial(trial),))
    (told,) = Read(run.html()).views()["player"]["trials"]
    ended = "no grasp: once the fingers had closed, not all of them held the object"
    assert (told["start"], told["told"]) == (0, ended)
    place = unpacked(told["packed"])[0, trial.passport.hand.n_joints :][:2]
    np.testing.assert_allclose(told["target"][:2], place, atol=0.02)


def test_48_trials_take_less_than_a_megabyte(finished: Run) -> None:
    trial = finished.trials[0]
    rows = [name for name in SHAPES if name != "reference"]
    long: dict[str, Any] = {name: np.concatenate([getattr(trial, name)] * 8)[:300] for name in rows}
    many = tuple(replace(trial, passport=replace(trial.passport, trial=k), **long) for k in range(1, 49))
    run = replace(finished, trials=many, results=tuple(result_of_trial(each) for each in many))
    assert 400_000 < len(run.html()) < 1_000_000


def test_of_very_many_trials_those_that_failed_are_kept(finished: Run) -> None:
    good = replace(finished.trials[0], outcome="reached")
    every = [replace(good, passport=replace(good.passport, trial=k)) for k in range(1, MOST_TRIALS + 20)]
    every[-1] = replace(every[-1], outcome="lost contact")
    found = player_of([Shown(trial, "a", "") for trial in every])
    assert len(found.trials) == MOST_TRIALS
    assert [each.failed for each in found.trials] == [False] * (MOST_TRIALS - 1) + [True]


# What is in a page.


def test_a_page_has_all_and_fetches_nothing(page: str) -> None:
    read = Read(page)
    told = " ".join(text for _, text in read.texts)
    assert read.tags[0] == ("html", {"lang": "en"})
    for name in ("thesis-ik on cube_39", "Replay", "Results", "What failed", "Run it again", "mujoco-core", "noise_mm"):
        assert name in told
    assert "inhand asterisk --hand 2v2_50.50_50.50_1.1_53" in told
    assert not [attrs for _, attrs in read.tags if "src" in attrs or not str(attrs.get("href", "#")).startswith("#")]
    assert "url(" not in page
    policy = next(attrs["content"] for tag, attrs in read.tags if tag == "meta" and "http-equiv" in attrs)
    assert str(policy).startswith("default-src 'none'")


def test_the_asterisk_has_its_curves_limits_and_numbers(finished: Run, page: str) -> None:
    (panel,) = Read(page).views()["asterisks"]["panels"]
    assert [curve["name"] for curve in panel["curves"]] == ["Out", "Right"]
    curve, result = panel["curves"][0], finished.results[0]
    assert curve["label"] == pytest.approx(result.metrics.distance_mm, abs=0.01)
    assert curve["limit"] == pytest.approx(result.limit)
    assert curve["told"][1] == "1 trial: lost contact"
    assert curve["failed"]
    assert {shape["kind"] for shape in panel["scene"]} == {"palm", "link", "object"}
    assert Read(page).views()["player"]["picker"]["plain"]


def test_a_run_beside_another_can_be_laid_over_it(finished: Run) -> None:
    other = Beside("another", finished.trials, finished.results)
    views = Read(replace(finished, beside=(other,)).html()).views()
    assert [panel["title"] for panel in views["asterisks"]["panels"]] == ["another", "thesis-ik"]
    assert {trial["group"] for trial in views["player"]["trials"]} == {"another", "thesis-ik"}
    assert len(views["player"]["hands"]) == len(views["player"]["objects"]) == 1


def test_a_run_that_only_turns_has_no_asterisk(finished: Run) -> None:
    turns = replace(finished, trials=finished.trials[2:], results=finished.results[2:])
    views = Read(turns.html()).views()
    assert "asterisks" not in views
    assert views["player"]["picker"] is None
    assert views["player"]["trials"][0]["angle"] is None


def test_the_same_run_gives_the_same_bytes(finished: Run, page: str) -> None:
    assert finished.html() == page


def test_a_page_is_written_beside_the_report(finished: Run, page: str, tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("inhand.asterisk_test.tested.Tested.write_report", lambda *_: None)
        finished.write(tmp_path)
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page


# Names of all kinds.


def test_names_are_texts_wherever_they_stand(finished: Run) -> None:
    plain, evil = Read(named(finished, "name").html()), Read(named(finished, EVIL).html())
    spared = {"code"}  # what stands between back-ticks
    assert [tag for tag, _ in evil.tags if tag not in spared] == [tag for tag, _ in plain.tags if tag not in spared]
    assert "img" not in {tag for tag, _ in evil.tags}
    assert not [name for _, attrs in evil.tags for name in attrs if name.startswith("on")]
    heading = next(text for tag, text in evil.texts if tag == "h1")
    assert heading == f"Asterisk Test: {EVIL} on {EVIL} with {EVIL}"
    assert evil.views()["player"]["trials"][0]["group"] == EVIL
    assert evil.views()["asterisks"]["panels"][0]["title"] == EVIL


def test_parts_are_escaped() -> None:
    parts: list[WebPart] = [
        f"# {EVIL}",
        EVIL,
        f"## {EVIL}",
        table_of([EVIL], [[EVIL]], EVIL),
        listed([EVIL], EVIL),
        again(EVIL),
    ]
    read = Read(html_of(EVIL, [*parts, settings_of({EVIL: EVIL})]))
    known = {
        "html",
        "head",
        "meta",
        "title",
        "style",
        "body",
        "a",
        "header",
        "div",
        "span",
        "nav",
        "ul",
        "li",
        "button",
    }
    known |= {"main", "h1", "h2", "section", "p", "code", "table", "thead", "tbody", "tr", "th", "td", "pre", "details"}
    assert {tag for tag, _ in read.tags} == known | {"summary", "dl", "dt", "dd", "footer", "script"}
    whole = "".join(text for _, text in read.texts)
    assert whole.count(EVIL.replace("`", "")) + whole.count(EVIL) >= 12


def test_code_stands_between_back_ticks_and_a_single_one_stays() -> None:
    text = html_of("", ["# t", "see `a<b` and `c`", "one ` alone"])
    assert "<p>see <code>a&lt;b</code> and <code>c</code></p>" in text
    assert "<p>one ` alone</p>" in text


def test_numbers_are_aligned_to_the_right_and_long_texts_are_broken() -> None:
    text = html_of("", ["# t", table_of(["a", "b", "c"], [["x", "1.0 ± 0.1", "y" * 60], ["y", "-", ""]])])
    assert '<th scope="col" class="text">a</th><th scope="col">b</th><th scope="col" class="text">c</th>' in text
    assert f'<td class="text">x</td><td>1.0 ± 0.1</td><td class="text long">{"y" * 60}</td>' in text


def test_scripts_are_one_module_without_imports(page: str) -> None:
    script = page.rpartition('<script type="module">')[2].partition("</script>")[0]
    assert not re.search(r"^(import|export) ", script, flags=re.MULTILINE)
    names = re.findall(r"^(?:async )?(?:function|class|const|let) (\w+)", script, flags=re.MULTILINE)
    assert len(names) == len(set(names)) > 30
    assert "innerHTML" not in script
    folder = Path(html_of.__code__.co_filename).parent
    assert sorted(path.stem for path in (folder / "script").glob("*.js")) == sorted(SCRIPTS)
    for path in (*(folder / "script").glob("*.js"), folder / "page.css"):
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 350, path.name
