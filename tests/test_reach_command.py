"""`inhand reach` end to end, and the limits that a run's trials carry."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import inhand as front
from inhand.asterisk_test.config import AsteriskConfig, ReachCommand
from inhand.asterisk_test.reach import Reach, compute_reach, ready_reach
from inhand.asterisk_test.results import as_entry, by_direction, result_of_trial, summary_of
from inhand.asterisk_test.run import prepare, simulate
from inhand.asterisk_test.table import HEADER, table_rows
from inhand.cli.reach import run_reach
from inhand.control.episode import TWIST
from inhand.control.trial import Trial, load_trial, save_trial
from inhand.errors import InputError
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE
from inhand.hands.reach.limits import ReachConfig
from inhand.plots.curves import PathCurve, limit_outline
from inhand.tasks import reach
from inhand.tasks.primitives import TURNS, parse_directions, with_twists
from inhand.tasks.reach import limits, start_grip

HAND = parse_hand_name("2v2_50.50_50.50_1.1_53")
CUBE = CATALOGUE["cube_39"]
COARSE = ReachConfig(resolution=0.004)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small reach."""
    out = tmp_path_factory.mktemp("reach") / "run"
    run_reach(ReachCommand(directions="Out,In,Left,cw", resolution_mm=4, out=out))
    return out


def test_it_writes_limits_with_their_last_grip(folder: Path) -> None:
    content = json.loads((folder / "reach.json").read_text())
    rows = {row["direction"]: row for row in content["limits"]}
    assert list(rows) == ["Out", "In", "Left", "cw"]
    assert content["friction"] == 0.5
    assert [note.partition(" (")[0] for note in content["notes"]] == [f"No limits are given for joints of {HAND.name}"]
    assert content["config"]["resolution_mm"] == 4
    assert rows["In"]["limit_mm"] == pytest.approx(1e3 * HAND.start_position[1] - 19.5, abs=0.6)  # cube meets palm
    assert rows["cw"]["limit_mm"] is None
    assert rows["cw"]["limit_deg"] > 90
    x, y, turn = rows["Left"]["end_pose_mm_deg"]
    assert (x, y, turn) == pytest.approx((-rows["Left"]["limit_mm"], 1e3 * HAND.start_position[1], 0), abs=0.01)
    assert np.abs(rows["Left"]["end_contacts_mm"]).max() == pytest.approx(19.5)
    assert len(rows["Left"]["end_joints_deg"]) == 4
    assert (folder / "reach.png").stat().st_size > 10_000


def test_it_is_loaded_as_it_was_computed(folder: Path, tmp_path: Path) -> None:
    asked = ReachCommand(directions="Out,In,Left,cw", resolution_mm=4)
    computed, loaded = compute_reach(asked, ready_reach(asked)), front.load(folder)
    assert isinstance(loaded, Reach)
    assert isinstance(computed, Reach)
    for ours, theirs in zip(loaded.limits, computed.limits, strict=True):
        assert ours.primitive == theirs.primitive
        assert ours.distance == pytest.approx(theirs.distance, rel=1e-12)
        for name in ("pose", "joints", "contacts", "way"):
            np.testing.assert_allclose(getattr(ours.end, name), getattr(theirs.end, name), rtol=1e-12, atol=1e-15)
    assert loaded.table().shape == computed.table().shape
    again = json.loads((loaded.save(tmp_path / "again") / "reach.json").read_text())
    assert again["limits"][0]["limit_mm"] == pytest.approx(1e3 * computed.limits[0].distance)
    (tmp_path / "again" / "reach.json").write_text(json.dumps(again | {"limits": again["limits"][:2]}))
    with pytest.raises(
        InputError, match=r"reach.json: its limits are not those of the directions .*; compute it again"
    ):
        front.load(tmp_path / "again")


def test_a_second_run_computes_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = ReachCommand(directions="Out,In,Left,cw", resolution_mm=4)
    monkeypatch.setattr(reach, "farthest", None)
    again = compute_reach(asked, ready_reach(asked))
    loaded = front.load(folder)
    assert isinstance(loaded, Reach)
    assert isinstance(again, Reach)
    for one, other in zip(again.limits, loaded.limits, strict=True):
        assert one.distance == pytest.approx(other.distance)
        np.testing.assert_allclose(one.end.joints, other.end.joints)
        np.testing.assert_allclose(one.end.contacts, other.end.contacts)
    with pytest.raises(TypeError, match="not callable"):
        limits(HAND, CUBE, parse_directions("Out"), replace(COARSE, friction=0.31))


def test_twists_get_a_figure_each(tmp_path: Path) -> None:
    run_reach(ReachCommand(directions="Out", twist=15, resolution_mm=5, out=tmp_path / "run"))
    names = sorted(path.name for path in (tmp_path / "run").iterdir())
    assert names == ["limits.csv", "reach.json", "reach_m15.png", "reach_p15.png", "report.html", "run.toml"]


def test_a_folder_that_holds_a_reach_is_kept(folder: Path) -> None:
    before = (folder / "reach.json").read_bytes()
    with pytest.raises(InputError, match="holds the results of a run; give another folder, or --overwrite"):
        run_reach(ReachCommand(directions="Out", out=folder))
    assert (folder / "reach.json").read_bytes() == before


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (
            {"resolution_mm": 0},
            "resolution 0 mm: give 0.5 to 10 mm; all directions at the finest take about 8 s",
        ),
        ({"resolution_mm": 20}, "resolution 20 mm: give 0.5 to 10 mm"),
        ({"friction": -1}, "friction -1: a coefficient of friction is 0 or more"),
        ({"friction": math.nan}, "friction is nan; it must be a finite number"),
        ({"rotation_deg": 120}, "rotation bound 120 deg: give 0 to 90 deg"),
        ({"directions": "Up"}, "unknown direction 'Up'"),
        ({"directions": "Out", "twist": 95}, "--twist 95: give the size of the twist to hold"),
        ({"directions": "cw", "twist": 15}, "primitive cw only rotates"),
        ({"friction": 0.0}, "no two reachable points have their line inside both friction cones"),
        ({"object": "box_200x39"}, "is 200.0 mm wide"),
    ],
)
def test_what_cannot_be_computed_is_refused(settings: dict[str, Any], text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        run_reach(ReachCommand(**settings, out=tmp_path / "run"))
    assert text in str(error.value)
    assert not (tmp_path / "run").exists()


def test_an_object_that_no_grip_holds_names_the_constraint() -> None:
    stiff = replace(HAND, left=replace(HAND.left, limits=((-0.01, 0.01),) * 2))
    with pytest.raises(InputError, match="the left finger reaches no point of it within its joint limits; use another"):
        start_grip(stiff, CUBE, COARSE)


def test_a_held_twist_is_not_part_of_the_distance() -> None:
    plain, *held = limits(HAND, CUBE, (*parse_directions("Out"), *with_twists(parse_directions("Out"), 15)), COARSE)
    assert [limit.primitive.name for limit in held] == ["Out p15", "Out m15"]
    assert held[0].distance == pytest.approx(held[1].distance, abs=COARSE.resolution)
    assert 0.04 < held[0].distance < plain.distance
    assert np.rad2deg(held[0].end.pose[2]) == pytest.approx(-15)


def test_a_twist_that_is_out_of_reach_leaves_no_distance() -> None:
    (turn,) = limits(HAND, CUBE, TURNS[:1], COARSE)
    narrow = replace(CUBE, friction=0.1)
    (short,) = limits(HAND, narrow, with_twists(parse_directions("Out"), 80)[:1], COARSE)
    assert turn.distance > np.deg2rad(80)
    assert short.distance == 0


@pytest.fixture(scope="module")
def twisted() -> tuple[Trial, ...]:
    """Return one trial each of Out and Right with both twists, and of a turn."""
    config = AsteriskConfig(directions="Out,Right", twist=15, trials=1)
    return simulate(config, prepare(config))


def test_twisted_trials_turn_first_and_then_hold(twisted: tuple[Trial, ...]) -> None:
    assert [t.passport.primitive for t in twisted] == ["Out p15", "Right p15", "Out m15", "Right m15"]
    for trial in twisted:
        assert trial.phases == ("place", "grasp", TWIST, "manipulate")
        path, rotation, touching = trial.manipulated_path()
        assert rotation[0] == pytest.approx(trial.passport.rotation_deg, abs=1)
        np.testing.assert_allclose(rotation, trial.passport.rotation_deg, atol=2)
        np.testing.assert_allclose(path[0], 0)
        result = result_of_trial(trial)
        assert result.kept
        assert touching.all()
        assert result.metrics.rotation_max_deg < 2
        assert result.fraction is not None
        assert 0.75 < result.fraction <= 1


def test_a_trial_keeps_its_limit(twisted: tuple[Trial, ...], tmp_path: Path) -> None:
    save_trial(twisted[0], tmp_path / "trial.npz")
    again = result_of_trial(load_trial(tmp_path / "trial.npz"))
    assert again == result_of_trial(twisted[0])
    entry = as_entry(again)
    assert entry["limit_mm"] == again.limit
    assert entry["fraction_of_limit"] == pytest.approx(entry["distance_mm"] / entry["limit_mm"])
    assert again.limit == pytest.approx(1e3 * (twisted[0].passport.limit or 0))


def test_table_and_summary_have_the_limit(twisted: tuple[Trial, ...]) -> None:
    results = [result_of_trial(trial) for trial in twisted]
    row = table_rows(results, ())[0]
    assert row[HEADER.index("Limit [mm]")] == f"{results[0].limit:.1f}"
    assert row[HEADER.index("Of limit")] == f"{results[0].fraction:.2f}"
    summary = summary_of(results)[0]
    assert summary["limit_mm"] == results[0].limit
    assert summary["fraction_of_limit"] == pytest.approx(results[0].fraction)
    assert list(by_direction(results)) == ["Out p15", "Right p15", "Out m15", "Right m15"]


def test_a_turn_is_measured_against_the_angle() -> None:
    config = AsteriskConfig(directions="twist", trials=1)
    for trial in simulate(config, prepare(config)):
        result = result_of_trial(trial)
        assert result.kept
        assert result.reached > 44
        assert result.metrics.lateral_max_mm < 5
        assert result.limit is not None
        assert result.reached < result.limit
        assert as_entry(result)["limit_deg"] == result.limit


def test_the_outline_goes_round_the_limits() -> None:
    curves = [PathCurve(a, str(a), np.zeros((1, 2)), 0.0, limit_mm=10.0 + a) for a in (180.0, 0.0, 90.0)]
    np.testing.assert_allclose(limit_outline(curves), [(10, 0), (0, 100), (-190, 0)], atol=1e-9)
    assert len(limit_outline(curves[:2])) == 0
    assert len(limit_outline([replace(c, limit_mm=None) for c in curves])) == 0
