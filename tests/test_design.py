"""A design study: it finds the better hand, goes on where it was stopped, and says what bounds and aims cannot be."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

import inhand
from commands import Call
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.design import run
from inhand.asterisk_test.design.asked import Asked, ask
from inhand.asterisk_test.design.config import DesignConfig
from inhand.asterisk_test.design.figure import star
from inhand.asterisk_test.design.finals import Bout, fight
from inhand.asterisk_test.design.looked import Look, Looked, bar_of, front_of, look, reached, variants
from inhand.asterisk_test.design.run import DesignRun
from inhand.asterisk_test.design.search import search
from inhand.asterisk_test.study import command
from inhand.errors import InputError
from inhand.geometry import TURN_ARM
from inhand.hands.files import load_hand
from inhand.hands.hand import HandSpec
from inhand.records import configured
from inhand.tasks.reach import Limit
from page_reader import Read

SMALL: dict[str, Any] = {
    "directions": "In,Right",
    "forms": ("2v2",),
    "finger_mm": (144.0, 144.0),
    "hands": 3,
    "finalists": 2,
    "seeds": 1,
    "controllers": ("thesis-ik",),
}
"""Settings of the study of these tests."""
STANDARD = "2v2_50.50_50.50_1.1_53"


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> DesignRun:
    """Return a small study, written to its folder."""
    out = tmp_path_factory.mktemp("results") / "design"
    found = inhand.design(["cube_39"], aims=("mean", "least"), out=out, **SMALL)
    found.save(out)
    return found


def again(study: DesignRun, **changed: Any) -> DesignRun:
    return run.run_design(replace(study.config, **changed))


def refused_limits(*given: object) -> tuple[Limit, ...]:
    raise AssertionError(given)


def test_the_winner_is_the_farthest_of_the_best_and_known_hands_come_first(study: DesignRun) -> None:
    found, table = study.found, study.table().set_index("hand")
    assert [each.number for each in found.looked] == [1, 2, 3]
    known = table[table.catalogue]
    assert len(known) == 7
    between = [name for name in known.index if name.startswith("2v2") and "0.9" not in name]
    assert table.loc["hand 1", "mean"] == known.loc[between, "mean"].max()  # those between the bounds come first
    assert found.front[0].aims["mean"] == table["mean"][~table.catalogue].max()
    carried = [final.means["thesis-ik"] for final in found.finals]
    assert carried == sorted(carried, reverse=True)
    assert table.loc[study.winner.name, "winner"]
    assert table.loc[study.winner.name, "thesis-ik"] == carried[0]
    assert found.known.looked.hand.name == known["mean"].idxmax()
    assert found.off[""] == pytest.approx(table.loc[study.winner.name, "mean"])
    assert found.off["links +1 mm"] > found.off["links -1 mm"]


def test_every_seed_is_simulated_with_its_own_start_and_what_is_kept_is_counted(tmp_path: Path) -> None:
    config = configured(DesignConfig, SMALL | {"objects": ["cube_39"], "directions": "In,Right", "out": tmp_path})
    asked, hand = ask(config), load_hand(STANDARD)
    bout = Bout(hand, asked.objects[0], asked, AsteriskConfig(controller="ik", seed=3), 2, tmp_path / "bout.json")
    fought = fight(bout)
    alone = [inhand.asterisk(hand=STANDARD, directions="In,Right", trials=1, seed=seed).table() for seed in (3, 4)]
    far = [dict(zip(each["direction"], each["distance_mm"], strict=True)) for each in alone]
    names = [each.name for each in asked.primitives]
    np.testing.assert_allclose(fought.distances, [[each[name] for name in names] for each in far])
    assert fought.distances[0] != fought.distances[1]
    assert fought.kept == 4


def test_the_winners_files_give_the_same_score(study: DesignRun) -> None:
    asked, folder = study.found.asked, study.config.out / "winner"
    score = asked.mean(study.found.winner.looked.table)
    for name, close in (("winner.toml", 1e-12), ("winner_urdf.toml", 0.3), ("winner_mjcf.toml", 0.3)):
        hand = inhand.hand(folder / name)
        assert abs(asked.mean(reached(asked, hand)[0]) - score) < close
    assert inhand.hand(folder / "winner.toml") == study.winner


def test_a_study_goes_on_and_computes_nothing_twice(study: DesignRun, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("INHAND_CACHE", "off")
    monkeypatch.setattr("inhand.asterisk_test.design.run._off", lambda *_: study.found.off)
    with monkeypatch.context() as patch:
        patch.setattr("inhand.asterisk_test.design.looked.limits", refused_limits)
        patch.setattr("inhand.asterisk_test.design.finals.simulate", refused_limits)
        same = again(study)
        assert inhand.load(study.config.out).table().equals(study.table())
    assert same.table().equals(study.table())
    more = again(study, hands=4)
    assert [each.hand for each in more.found.looked[:3]] == [each.hand for each in study.found.looked]
    assert len(more.found.looked) == 4
    assert (study.config.out / "cells" / "hand_0004.json").is_file()


def test_a_stopped_study_tells_how_far_it_is(
    inhand: Call, monkeypatch: pytest.MonkeyPatch, study: DesignRun, tmp_path: Path
) -> None:
    def stopped(*given: object) -> Looked:
        job = given[0]
        assert isinstance(job, Look)
        if job.number > 0:
            raise KeyboardInterrupt
        return look(job)

    del study  # whose limits are known now
    monkeypatch.setattr("inhand.asterisk_test.design.search.look", stopped)
    options = ["--objects", "cube_39", "--directions", "In,Right", "--jobs", "1", "--out", tmp_path / "d"]
    code, out, err = inhand("design", *options)
    assert code == 130
    assert "Done so far: 7 of 7 catalogue. The same command goes on from there" in out
    assert "nothing was overwritten" in err
    assert len(list((tmp_path / "d" / "cells").glob("catalogue_*.json"))) == 7


def test_another_study_in_the_folder_is_refused_with_both_shown(study: DesignRun) -> None:
    before = sorted(path.name for path in (study.config.out / "cells").iterdir())
    with pytest.raises(InputError) as error:
        again(study, aims=("mean", "length"), palm_mm=(50.0, 60.0))
    told = str(error.value)
    assert "aims is mean, least there and mean, length now" in told
    assert "bounds.palm_width is [0.04, 0.08] there and [0.05, 0.06] now" in told
    assert sorted(path.name for path in (study.config.out / "cells").iterdir()) == before


def test_the_page_tells_the_answer_and_how_to_run_it_again(study: DesignRun) -> None:
    views = Read((study.config.out / "report.html").read_text(encoding="utf-8")).views()
    (front,) = views["charts"]["charts"]
    assert front["lines"][-1]["names"] == [f"{study.winner.name} (2v2)"]
    page = (study.config.out / "report.md").read_text(encoding="utf-8")
    assert f"Winner: {study.winner.name} (2v2), mean reach" in page
    assert "Controller thesis-ik carries objects" in page
    assert " --forms 2v2 --finger-mm 144.0 144.0 --objects cube_39 --directions In,Right" in page
    assert command("design", study.config) in page
    content = json.loads((study.config.out / "design.json").read_text(encoding="utf-8"))
    assert content["tolerance_mm"] == pytest.approx(study.found.off)
    rows = (study.config.out / "hands.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + 7 + 3


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.findobj(Text)]


@pytest.mark.parametrize("aims", [("mean", "least"), ("mean",)])
def test_the_figure_has_the_front_and_the_hands(study: DesignRun, aims: tuple[str, ...]) -> None:
    found = replace(study.found, asked=replace(study.found.asked, aims=aims))
    shown = texts(replace(study, found=found).figure())
    assert "Mean reach [mm]" in shown
    assert ("Least reach [mm]" if len(aims) > 1 else "Hand of the study") in shown
    assert f"{study.winner.name} (2v2)" in shown
    assert found.known.looked.hand.name in shown
    assert "by the other alone" not in shown  # two directions make no outline, which that would explain


def asked_of(**changed: Any) -> Asked:
    return ask(DesignConfig(**({"objects": ("cube_39",), "directions": "train", "forms": ("2v2",)} | changed)))


def seen(asked: Asked, number: int, hand: HandSpec, reach: float) -> Looked:
    row = (reach,) * len(asked.primitives)
    aims = {"mean": reach, "length": 1e3 * sum(finger.length for finger in hand.fingers)}
    return Looked(number, hand, (row,), aims=aims)


def test_a_hopeless_hand_is_given_up_and_one_that_is_short_is_not(tmp_path: Path) -> None:
    asked, hand = asked_of(), load_hand(STANDARD)
    best = seen(asked, 1, hand, 300.0)
    assert [asked.primitives[k].name for k in asked.coarse] == ["Out", "Right", "In", "Left"] or len(asked.coarse) == 2
    job = Look(2, hand, asked, bar_of(asked, [best]), tmp_path / "hand.json")
    found = look(job)
    assert not found.whole
    assert np.isfinite(found.table).sum() == len(asked.coarse)
    coarse = asked.mean(found.table, asked.coarse)
    assert found.aims["mean"] == pytest.approx(coarse)  # as the best one's, all directions are as good as the coarse
    short = replace(hand, left=replace(hand.left, links=(0.07, 0.07)))
    assert look(replace(job, hand=short)).whole
    assert front_of(asked, [best, seen(asked, 2, hand, 200.0), seen(asked, 3, short, 200.0), found])[1].number == 3


@pytest.mark.parametrize("sampler", ["tpe", "nsga2"])
def test_a_sampler_learns_and_proposes_the_same_hands_again(
    sampler: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def wide(job: Look) -> Looked:
        return seen(job.asked, job.number, job.hand, 1e3 * job.hand.link_width + 1e3 * job.hand.palm_width)

    def searched(seed: int, hands: int) -> list[Looked]:
        config = configured(DesignConfig, {"sampler": sampler, "seed": seed, "hands": hands})
        return search(config, asked, [], tmp_path, lambda _: None)

    asked = asked_of(aims=("mean",))
    monkeypatch.setattr("inhand.asterisk_test.design.search.look", wide)
    hands = searched(3, 50)
    assert [each.hand for each in searched(3, 25)] == [each.hand for each in hands[:25]]
    assert searched(4, 1)[0].hand != hands[0].hand
    reach = [each.aims["mean"] for each in hands]
    assert np.mean(reach[40:]) > np.mean(reach[:20]) + 3


def test_turns_count_as_an_arc_and_hands_that_hold_nothing_as_nothing() -> None:
    asked = asked_of(directions="cw", objects=("cube_39", "cube_43"))
    reach, reasons = reached(asked, load_hand(STANDARD))
    assert reach[0, 0] == pytest.approx(np.deg2rad(99.69) * 1e3 * TURN_ARM, abs=0.1)
    narrow = load_hand("2v2_50.50_50.50_1.1_5")
    reach, reasons = reached(replace(asked, objects=(asked.objects[0], inhand.object("box_400x30"))), narrow)
    assert reach[1, 0] == 0.0
    assert len(reasons) == 1
    assert "'box_400x30' is 400.0 mm wide" in reasons[0]


def test_hands_a_little_off() -> None:
    off = variants(load_hand(STANDARD))
    assert list(off)[:2] == ["links +1 mm", "left links +1 mm, right -1"]
    assert off["left links -1 mm, right +1"].left.links == pytest.approx((0.071, 0.071))
    assert off["friction -20 %"].friction == pytest.approx(0.4)
    assert not any("limits" in name for name in off)  # joints that turn freely have none
    bounded = variants(load_hand(f"{STANDARD}:lab-limits"))["joint limits -2 deg"]
    assert np.rad2deg(bounded.right.limits) == pytest.approx(np.add(np.rad2deg([(-1.57, 1.57), (0.0, 2.09)]), (2, -2)))


def test_a_star_through_tips() -> None:
    angles = np.arange(4) * np.pi / 2
    fine = np.array([0.0, np.pi / 4, np.pi / 2, 5.5])
    assert star(angles, np.ones(4), fine) == pytest.approx([1, np.sqrt(0.5), 1, 1 / (np.cos(5.5) - np.sin(5.5))])
    assert star(np.array([0.0, 1.0]), np.array([1.0, 2.0]), np.array([0.0, 3.0])) == pytest.approx([1.0, 0.0])
    assert star(angles, np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.3])) == pytest.approx([0.0])


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"object_weights": (0.0,)}, "--object-weights 0: they sum to nothing; give at least one of cube_39"),
        ({"object_weights": (1.0, 2.0)}, "--object-weights 1 2: give one weight for each of cube_39"),
        ({"direction_weights": (1.0, -1.0)}, "--direction-weights 1 -1: a weight is 0 or more"),
        ({"direction_weights": (0.0, 0.0)}, "they sum to nothing; give at least one of In, Right"),
        ({"aims": ("mena",)}, "--aims: unknown aim 'mena'; did you mean mean"),
        ({"aims": ("mean", "mean")}, "--aims mean mean: name at least one, each once"),
        ({"hands": 0}, "--hands 0: give at least 1"),
        ({"palm_mm": (80.0, 40.0)}, "--palm-mm 80 40: give the lowest value, above 0, and one no lower"),
        ({"forms": ("3v3",), "share": (0.4, 0.6)}, "no 3 links of the left finger of 3v3"),
        (
            {"finger_mm": (26.0, 28.0), "tip_mm": (4.0, 4.0), "share": (0.45, 0.55)},
            "no hand between these bounds can hold object 'cube_39': between the default bounds of --finger-mm there",
        ),
        (
            {"objects": ("box_400x30",)},
            r"hold object 'box_400x30': nor is there one between the default bounds: use a smaller object, or wider",
        ),
    ],
)
def test_what_cannot_be_searched_is_refused(changed: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        asked_of(directions="In,Right", **changed)


def test_without_optuna_the_extra_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("inhand.asterisk_test.design.search.find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"a design study needs the extra `design`: pip install 'inhand\[design\]'"):
        run.run_design(DesignConfig(objects=("cube_39",), out=tmp_path / "d"))
    assert list(tmp_path.iterdir()) == []
