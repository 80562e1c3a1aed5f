"""A study of robustness: what is kept and lost under disturbances and their strengths, and what goes with a loss."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from scipy.stats import binomtest, spearmanr

import inhand
from commands import Call
from inhand.asterisk_test.cells import CellFile, _keep_lost
from inhand.asterisk_test.robustness import tables
from inhand.asterisk_test.robustness.cases import Case, Contender, _cost, cases_of, curves_of, plan
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.robustness.figures import strength_figure
from inhand.asterisk_test.robustness.run import RobustnessRun
from inhand.asterisk_test.robustness.sensitivity import sensitivity
from inhand.asterisk_test.robustness.summary import Robustness, retention, robustness_of, wilson
from inhand.control.policy import Cost, Policy
from inhand.control.trial import load_trial
from inhand.errors import InputError
from inhand.sim.disturbance import FIELD, LEVELS, SINGLES, Camera, Differences, Disturbance, Pushes
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.drawn import Drawn, check_drawn, draw
from inhand.sim.strengths import scaled
from page_reader import Read
from test_simulator import CUBE, HAND
from test_trial import made_trial

SMALL = (
    "--controllers", "ik", "--disturbances", "late", "--curves", "friction-0.5", "--jobs", "1",
    "--strengths", "1", "2", "--directions", "In,Out", "--trials", "1",
)  # fmt: skip
"""Words of the small study."""
LATE = Disturbance("late", camera=Camera(delay_ms=(40.0, 40.0)))
"""One of a user's."""
SLIPPERY = 'name = "slippery"\n[differs]\nfriction = 0.5\n'


def entry(direction: str, trial: int, distance: float, outcome: str = "reached", **drawn: Any) -> dict[str, Any]:
    """Return a trial of a cell's file, its limit 100 mm."""
    more = {"drawn": drawn} if drawn else {}
    return {
        "direction": direction, "angle_deg": 90.0, "trial": trial, "distance_mm": distance, "limit_mm": 100.0,
        "outcome": outcome, "lateral_max_mm": distance / 10, "rotation_max_deg": distance / 5, "force_max_n": distance,
        "torque_max_nmm": 2 * distance, "penetration_max_mm": 0.2, "penetration_mean_mm": trial / 10,
        "penetration_share": 0.0, **more,
    }  # fmt: skip


def cell(*trials: dict[str, Any], reason: str | None = None) -> CellFile:
    return CellFile("hand", "cube", reason, 1.0, 1.0, list(trials), {})


def study(*cells: CellFile, names: tuple[str, ...] = ("a",), kin: dict[str, Any] | None = None) -> Robustness:
    """Return a study of some controllers, undisturbed and under field."""
    contenders = [Contender(name, name, "sensed", "no training", kin) for name in names]
    return robustness_of(cells, contenders, [Case("none", "none"), Case("field", "field")], 0)


@pytest.fixture(scope="module")
def found() -> Robustness:
    """Return a study of two controllers, one of which cannot be run under field."""
    plain = [entry("Out", 1, 80.0), entry("Out", 2, 60.0), entry("In", 1, 100.0), entry("In", 2, 100.0)]
    field = [
        entry("In", 2, 50.0), entry("In", 1, 90.0, "lost contact"), entry("Out", 2, 60.0), entry("Out", 1, 40.0),
    ]  # fmt: skip
    return study(cell(*plain), cell(*plain), cell(*field), cell(reason="too wide"), names=("a", "b"))


@pytest.mark.parametrize("spec", [*LEVELS, *SINGLES], ids=lambda spec: spec.name)
def test_a_strength_goes_from_nothing_to_what_a_disturbance_says(spec: Disturbance) -> None:
    nothing = scaled(spec, 0.0)
    world = draw(nothing, (3, 1, 4), 4).drawn
    assert replace(world, zero=()) == Drawn((3, 1, 4))
    assert not np.any(world.zero)
    assert (nothing.camera.noise_mm, nothing.camera.missing, nothing.encoders.noise_deg) == (0.0, 0.0, 0.0)
    assert nothing.pushes.push_mns == 0.0
    assert scaled(spec, 1.0) is spec
    assert load_disturbance(spec.name) == spec
    assert load_disturbance(f"{spec.name}@0") is None
    half = scaled(spec, 0.5)
    assert half.name == f"{spec.name}@0.5"
    assert half not in {nothing, spec}
    assert load_disturbance(f"{spec.name}@0.5") == half


def test_factors_have_the_strength_as_power_and_sizes_as_factor() -> None:
    spec = Disturbance("own", Differences((0.5, 4.0), start_mm=3.0), camera=Camera(25.0, 2.0, delay_ms=(20.0, 60.0)))
    twice = scaled(replace(spec, pushes=Pushes(10.0, 1.0, 2)), 2.0)
    assert twice.differs.friction == (0.25, 16.0)
    assert twice.differs.mass == (1.0, 1.0)
    assert (twice.differs.start_mm, twice.camera.noise_mm, twice.camera.delay_ms) == (6.0, 4.0, (40.0, 120.0))
    assert twice.camera.rate_hz == pytest.approx(1 / 0.06)  # 40 ms between frames are 20 ms more than a decision
    assert scaled(spec, 0.0).camera.rate_hz == pytest.approx(50.0)
    assert twice.pushes == Pushes(20.0, 1.0, 2)
    assert scaled(Disturbance("still"), 2.0).camera == Camera()


@pytest.mark.parametrize("mass", [(1.0, 1e6), (1e-6, 1.0)])
def test_what_no_object_can_be_at_either_end_cannot_be_drawn(mass: tuple[float, float]) -> None:
    with pytest.raises(InputError, match="disturbance 'own' cannot be drawn: object 'cube_39': its mass"):
        check_drawn(Disturbance("own", Differences(mass=mass)), HAND, CUBE)


def test_singles_change_one_quantity_and_those_that_belong_to_it() -> None:
    for spec in SINGLES:
        world = draw(spec, (1,), 4).drawn
        assert draw(spec, (1,), 4).drawn == world
    names = {each.name for each in SINGLES}
    assert len(names) == len(SINGLES)
    asked = {"friction-0.6", "mass-4", "size-0.95", "size-1.05", "pose-noise-2mm", "pose-bias-2mm", "pose-bias-3deg"}
    assert asked | {"pose-late-60ms", "commands-late-40ms", "push-20mns", "start-3mm-5deg"} <= names


def test_words_for_several_stand_for_each_and_points_of_curves_are_not_told_in_tables() -> None:
    config = RobustnessConfig(disturbances=("levels", "hard@0.5"), curves=("field",), strengths=(0.5, 1.0))
    names = [(case.name, case.row) for case in cases_of(config)]
    rows = [(name, True) for name in ("none", "bench", "field", "hard", "hard@0.5")]
    assert names == [*rows, ("field@0.5", False)]
    assert curves_of(config) == {"field": {0.0: "field@0", 0.5: "field@0.5", 1.0: "field@1"}}
    every = [case.name for case in cases_of(replace(config, disturbances=("singles@2",), curves=()))]
    assert every == ["none", *(f"{each.name}@2" for each in SINGLES)]
    assert curves_of(replace(config, curves=("none", "field@0"))) == {}


def test_two_disturbances_of_one_name_are_refused(tmp_path: Path) -> None:
    for number in (1, 2):
        (tmp_path / f"{number}.toml").write_text(SLIPPERY.replace("0.5", f"0.{number}"))
    files = tuple(str(tmp_path / f"{number}.toml") for number in (1, 2))
    for disturbances, curves in ((files, ()), (files[:1], files[1:])):
        config = RobustnessConfig(disturbances=disturbances, curves=curves, strengths=(1.0,), out=tmp_path / "out")
        with pytest.raises(InputError, match="two disturbances are called 'slippery'"):
            plan(config)
    assert not (tmp_path / "out").exists()


def test_an_interval_of_a_share_is_wilsons() -> None:
    for count, total in ((0, 1008), (19, 1008), (48, 48), (3, 7)):
        known = binomtest(count, total).proportion_ci(0.95, "wilson")
        assert wilson(count, total) == pytest.approx((known.low, known.high), abs=1e-4)


def test_what_is_kept_is_the_way_over_that_of_the_same_trials_undisturbed(found: Robustness) -> None:
    row = found.row("a", "field")
    assert row is not None
    assert (row["trials"], row["lost"]) == (4, 1)
    assert row["share"] == pytest.approx((0.5 + 0.0 + 0.6 + 0.4) / 4)
    assert row["retention"] == pytest.approx(1.5 / 3.4)
    assert (row["least"], row["least_direction"]) == (pytest.approx(0.25), "In")
    assert (row["lateral_median_mm"], row["turn_median_deg"]) == (5.0, 10.0)  # of what was kept
    assert (row["force_max_n"], row["torque_max_nmm"]) == (90.0, 180.0)
    assert row["penetration_mean_mm"] == pytest.approx(0.15)
    assert row["retention_low"] < row["retention"] < row["retention_high"]
    assert found.row("b", "field") is None


def test_a_trial_is_set_against_itself_undisturbed_and_turns_are_no_deviation() -> None:
    plain = [entry("Out", k + 1, way) for k, way in enumerate((90.0, 70.0, 50.0, 30.0))]
    turned = entry("cw", 1, 10.0) | {"angle_deg": None, "rotation_final_deg": 50.0, "limit_deg": 100.0}
    field = [each | {"distance_mm": each["distance_mm"] / 2} for each in reversed(plain)]
    row = study(cell(*plain, turned), cell(*field, turned | {"rotation_final_deg": 25.0})).row("a", "field")
    assert row is not None
    assert (row["retention_low"], row["retention"], row["retention_high"]) == pytest.approx((0.5, 0.5, 0.5))
    assert row["turn_95_deg"] > 10.0  # of the translations: 6 to 18 deg
    assert row["turn_median_deg"] == pytest.approx(12.0)


def test_what_could_not_be_run_is_told(found: Robustness) -> None:
    assert found.stopped == ("b under field could not be run: too wide",)


def test_retention_is_paired_and_says_the_same_for_the_same_seed() -> None:
    rng = np.random.default_rng(1)
    whole = rng.uniform(0.3, 0.9, 400)
    assert retention(0.8 * whole, whole, 0) == pytest.approx((0.8, 0.8, 0.8))  # pairs share what differs between them
    way = whole * rng.uniform(0.0, 1.0, 400)
    assert retention(way, whole, 3) == retention(way, whole, 3) != retention(way, whole, 4)
    middle, low, high = retention(way, whole, 0)
    assert high - low == pytest.approx(4 * np.std(way - middle * whole) / np.sqrt(400) / whole.mean(), rel=0.15)
    assert np.isnan(retention(way, np.zeros(400), 0)).all()


def test_tables_tell_every_number(found: Robustness) -> None:
    assert tables.kept_table(found).rows == (("none", "1.00, 0/4", "1.00, 0/4"), ("field", "0.44, 1/4", "-"))
    table = tables.controller_table(found, found.contenders[0])
    told = dict(zip(table.header[:8], table.rows[1][:8], strict=True))
    assert told["95 % [%]"] == "4.6 to 69.9"
    assert told | {"95 %": "", "95 % [%]": ""} == {
        "Disturbance": "field", "Trials": "4", "Lost": "1", "Share": "0.375", "Least": "0.25 (In)",
        "Retention": "0.441", "95 %": "", "95 % [%]": "",
    }  # fmt: skip
    assert tables.controller_table(found, found.contenders[1]).rows[1] == ("field", *["-"] * 14)
    assert tables.contenders_table(found).rows[0] == ("a", "sensed", "no training")
    assert tables.summary(found)[0].startswith("a goes 0.850 of the hand's limit undisturbed and loses 0 of 4 objects.")
    assert "under field 0.441" in tables.summary(found)[0]
    assert tables.summary(found)[-1] == "4 disturbed trials took one core 1 s by the clock, 1 s of its own."
    assert tables.seeds_table(found) is None


def test_the_range_over_seeds_is_of_controllers_that_differ_in_their_seed_alone() -> None:
    plain = [entry("Out", 1, 80.0), entry("Out", 2, 80.0)]
    worse, worst = ([entry("Out", 1, way), entry("Out", 2, 40.0, "lost contact")] for way in (80.0, 40.0))
    kin = {"s0": {"preset": "x"}, "s1": {"preset": "x"}, "other": {"preset": "y"}, "ik": None}
    contenders = [Contender(name, name, "sensed", "not told", trained) for name, trained in kin.items()]
    cells = [cell(*part) for part in (plain, plain, plain, plain, worse, worst, worst, worst)]
    seeds = robustness_of(cells, contenders, [Case("none", "none"), Case("field", "field")], 0)
    table = tables.seeds_table(seeds)
    assert table is not None
    assert len(table.rows) == 2
    assert table.rows[1] == ("s0, s1", "field", "0.375, 0.250 to 0.500", "50.0, 50.0 to 50.0")


def worlds(count: int) -> list[dict[str, Any]]:
    """Return trials whose objects are lost where friction is low, whatever else was drawn."""
    drawn = [draw(FIELD, (7, number), 4).drawn for number in range(count)]
    return [
        entry("Out", k + 1, 50.0, "lost contact" if each.friction < 0.8 else "reached", **vars(each))
        for k, each in enumerate(drawn)
    ]


def test_what_goes_with_a_loss_is_found_and_what_does_not_is_not() -> None:
    trials = worlds(120)
    plain = [{key: value for key, value in each.items() if key != "drawn"} for each in trials]
    found = study(cell(*plain), cell(*trials))
    table = sensitivity(found, "field", 0).set_index("quantity")
    friction = np.array([each["drawn"]["friction"] for each in trials])
    lost = np.array([each["outcome"] != "reached" for each in trials])
    assert table.correlation["friction"] == pytest.approx(spearmanr(friction, lost).statistic)
    assert table.high["friction"] < -0.6
    others = table.drop("friction")
    assert (others.low < 0).sum() + (others.high > 0).sum() > 1.8 * len(others)
    assert "joints late" not in table.index  # does not differ at field
    assert {"start turned", "joints' zeros off", "commands late", "size"} <= set(table.index)
    told = tables.sensitivity_table({"field": table.reset_index()}).rows
    assert told[0][:2] == ("field", "a")
    assert told[0][2].startswith("friction -0.")
    assert sensitivity(found, "none", 0).empty
    few = study(cell(*plain), cell(*(each | {"outcome": "reached"} for each in trials[4:]), *trials[:4]))
    assert sensitivity(few, "field", 0).empty


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RobustnessRun:
    """Return a small study that was saved."""
    out = tmp_path_factory.mktemp("results") / "study"
    study = inhand.robustness(
        "ik",
        LATE,
        curves="friction-0.5",
        strengths=[1, 2],
        directions=["In", "Out"],
        trials=1,
        out=out,
    )
    study.save(out)
    return study


def test_a_study_is_saved_loaded_and_gone_on_with(
    run: RobustnessRun, tmp_path: Path, inhand: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = run.config.out
    stamps = {path.name: path.stat().st_mtime_ns for path in (out / "cases").glob("*.json")}
    names = "none", "late", "friction-0.5", "friction-0.5-2"
    assert set(stamps) == {f"ik__{name}.json" for name in names}
    code, said, _ = inhand("robustness", *SMALL, "--out", out)
    assert code == 0
    assert "4 cells, 4 of them already" in said
    assert "ik goes" in said
    assert {path.name: path.stat().st_mtime_ns for path in (out / "cases").glob("*.json")} == stamps
    monkeypatch.setattr("inhand.asterisk_test.robustness.page.draw_figures", lambda *_: [])  # as they are drawn already
    again = run.save(tmp_path / "copy")
    assert (again / "robustness.csv").read_text() == (out / "robustness.csv").read_text()
    code, _, told = inhand("robustness", *SMALL, "--out", out, "--seed", 3)
    assert code == 2
    assert "4 cells of other settings; of ik under none seed is 0 there and 3 now" in told


def test_the_folder_of_another_study_is_refused(run: RobustnessRun, tmp_path: Path, inhand: Call) -> None:
    sweep = "--hands", HAND.name, "--objects", CUBE.name, "--directions", "In", "--controller", "thesis-ik"
    for command, words in (("sweep", sweep), ("robustness", SMALL)):
        (tmp_path / command / ("cells" if command == "robustness" else "cases")).mkdir(parents=True)
        code, _, told = inhand(command, *words, "--out", tmp_path / command)
        assert code == 2
        assert "holds files that are no run of this kind; give another folder" in told
    with pytest.raises(InputError, match="holds files that are no run"):
        run.save(tmp_path)


def test_a_saved_study_is_loaded_with_its_tables_and_figure(run: RobustnessRun) -> None:
    again = inhand.load(run.config.out)
    assert isinstance(again, RobustnessRun)
    pd.testing.assert_frame_equal(again.table(), run.table())
    assert list(run.table().disturb) == ["none", "late", "friction-0.5", "friction-0.5@2"]
    assert set(run.trials().controller) == {"ik"}
    late = run.trials().set_index("disturb")["drawn.camera_s"]
    assert (late["late"] == 0.04).all()
    assert late["none"].isna().all()
    texts = {text.get_text() for text in run.figure().axes[0].texts}
    assert "1.00" in texts


def test_the_page_and_its_pictures_tell_all(run: RobustnessRun) -> None:
    out = run.config.out
    views = Read((out / "report.html").read_text(encoding="utf-8")).views()
    assert views["heat"]["maps"][0]["columns"] == ["ik"]
    assert [line["name"] for line in views["charts"]["charts"][0]["lines"]] == ["ik"]
    text = (out / "report.md").read_text()
    for part in (
        "# Robustness: 1 controller x 4 disturbances",
        "| ik | privileged | no training |",
        "## Share of the undisturbed way, and objects lost",
        "* friction-0.5@2: differs.friction 0.25",
        "--disturbances late --curves friction-0.5",
    ):
        assert part in text
    pictures = re.findall(r"\]\((figures/.*?)\)", text)
    assert {"figures/kept.png", "figures/strength_friction-0.5.png"} <= set(pictures)
    for name in pictures:
        with Image.open(out / name) as picture:
            assert min(picture.size) > 200
    content = json.loads((out / "robustness.json").read_text())
    assert [row["disturb"] for row in content["rows"]] == [case["name"] for case in content["disturbances"]]
    kept, lost = strength_figure(run.config, run.found, "friction-0.5").axes
    for ax, name in ((kept, "retention"), (lost, "lost")):
        rows = [run.found.row("ik", case) or {} for case in ("none", "friction-0.5", "friction-0.5@2")]
        wanted = [row[name] / (row["trials"] if name == "lost" else 1) for row in rows]
        np.testing.assert_allclose(np.asarray(ax.lines[0].get_ydata()), wanted)
        np.testing.assert_allclose(np.asarray(ax.lines[0].get_xdata()), [0, 1, 2])


def test_trials_that_lost_their_object_can_be_shown_again(run: RobustnessRun) -> None:
    trials = run.trials()
    lost = trials[trials.lost]
    assert len(lost) > 0
    for disturb, direction in zip(lost.disturb, lost.direction, strict=True):
        folder = run.config.out / "cases" / f"ik__{disturb.replace('@', '-')}"
        trial = load_trial(folder / f"{direction.lower()}_1.npz")
        assert trial.outcome in {"lost contact", "no grasp"}
        assert trial.passport.disturb == disturb
        assert f"`{folder.relative_to(run.config.out)}`" in (run.config.out / "report.md").read_text()


def test_kept_trials_are_of_as_many_directions_as_there_are_and_take_the_place_of_those_before(tmp_path: Path) -> None:
    trials = [
        replace(made_trial(), passport=replace(made_trial().passport, primitive=name, trial=number))
        for name in ("In", "Left", "Out")
        for number in (1, 2, 3)
    ]
    _keep_lost(trials, tmp_path / "kept")
    names = ["in_1.npz", "in_2.npz", "left_1.npz", "out_1.npz"]
    assert sorted(path.name for path in (tmp_path / "kept").iterdir()) == names
    _keep_lost([trials[4], replace(trials[0], outcome="reached")], tmp_path / "kept")
    assert [path.name for path in (tmp_path / "kept").iterdir()] == ["left_2.npz"]


def test_what_training_took_is_told_where_a_folder_or_a_card_says_it(tmp_path: Path) -> None:
    policy = Policy((), (), "grip", "steps", "planned", {})
    assert _cost(tmp_path, policy) == "not told"
    (tmp_path / "finished.json").write_text('{"decisions": 1200000, "seconds": 480.0}')
    assert _cost(tmp_path / "best", policy) == "1,200,000 decisions in 8.0 minutes"
    signed = replace(policy, cost=Cost(3500, 612000, 23000, 144.0))
    told = "3,500 episodes, 612,000 decisions, 23,000 updates, 2.4 minutes of a core"
    assert _cost(tmp_path / "best", signed) == told
