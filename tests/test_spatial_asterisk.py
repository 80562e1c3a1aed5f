"""The Asterisk Test in space: one small run of the command, its folder, what is read back, and what is refused."""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from PIL import Image

import inhand
from commands import Call
from inhand.asterisk_test.asterisk import ONE, Ready, finish, ready
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.endings import ended
from inhand.asterisk_test.people.human import HumanFolder
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare
from inhand.asterisk_test.spatial.report import SpatialRun, errors_told
from inhand.asterisk_test.spatial.run import (
    SpatialAssignment,
    prepare_in_space,
    simulate_asterisk_in_space,
    starts_of,
)
from inhand.asterisk_test.spatial.scenes import drawn
from inhand.comparing import compared
from inhand.control.episode import SHAPES
from inhand.control.phases import Grasp
from inhand.control.spatial_scenes import box_faces, faces_of, rods_at, solid_frames
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import GRIP_END, NO_MOVEMENT, REACHED, load_all, load_any, load_trial, save_trial
from inhand.errors import InputError
from inhand.hands.files import load_hand
from inhand.hands.spatial.grasp_search import SpatialSearchConfig
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.kinematics import place
from inhand.hands.spatial.meshes import solid_of
from inhand.hands.spatial.names import STANDARD, parse_spatial_name
from inhand.hands.spatial.objects import SolidSpec, parse_solid_name
from inhand.learning.lerobot_files import read_episodes, read_features
from inhand.plots.spatial_asterisk import HALVES, SpatialCurve, Turned, on_map, solid_figure, spatial_figure
from inhand.plots.spatial_replay import painted, write_spatial_replay
from inhand.tasks.spatial.paths import spatial_path_of
from inhand.tasks.spatial.primitives import MAP, SpatialPrimitive, parse_spatial_directions
from inhand.tasks.spatial.reach import SpatialLimit
from page_reader import Read, unpacked

HAND = parse_spatial_name(STANDARD)
BARS = ["Distance [mm]", "Angle [deg]"]
WORDS = ("--hand", STANDARD, "--object", "cube_50", "--directions", "Down,turn+z", "--trials", 1, "--gravity", "down")


def limited(_: object, primitives: Sequence[SpatialPrimitive], *__: object, **___: object) -> list[SpatialLimit]:
    """Return limits that take no time to compute."""
    return [SpatialLimit(each, 3.0 if each.direction is None else 0.08, None) for each in primitives]


@pytest.fixture(scope="module")
def run() -> SpatialRun:
    """A move and a turn, the palm looking down, from a search that is quick: few contacts and grasps."""
    quick = SpatialSearchConfig(spacing=0.012, keep=2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("inhand.control.spatial_rehearsal.search_of", lambda *_: quick)
        patch.setattr("inhand.asterisk_test.spatial.run.limits_in_space", limited)
        made = inhand.asterisk(STANDARD, "cube_50", directions="Down,turn+z", trials=1, gravity="down")
    assert isinstance(made, SpatialRun)
    return made


@pytest.fixture(scope="module")
def folder(run: SpatialRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run.save(tmp_path_factory.mktemp("space") / "run")


def test_objects_are_carried_and_turned_and_kept(run: SpatialRun) -> None:
    down, turned = run.results
    assert (down.outcome, turned.outcome) == (GRIP_END, GRIP_END)
    assert down.reached > 40.0
    assert turned.reached > 90.0
    assert (down.turns, turned.turns) == (False, True)
    assert down.along == (0.0, 0.0, -1.0)
    assert all(result.metrics.longest_gap_s == 0.0 for result in run.results)
    assert down.metrics.lateral_max_mm < 1.0
    assert down.limit == 80.0
    assert turned.limit == pytest.approx(np.rad2deg(3.0))
    assert down.fraction == pytest.approx(down.reached / 80.0)
    passport = run.trials[0].passport
    assert passport.gravity == (0.0, 0.0, 9.81)
    assert (passport.engine, passport.reads) == ("mujoco", "privileged")


def test_the_table_has_a_row_for_each_trial(run: SpatialRun) -> None:
    table = run.table()
    assert table["gravity"].tolist() == ["down", "down"]
    assert table["direction"].tolist() == ["Down", "turn+z"]
    np.testing.assert_allclose(table["reached"], [result.reached for result in run.results])


def test_a_run_is_read_back_as_it_was_measured(run: SpatialRun, folder: Path) -> None:
    again = inhand.load(folder)
    assert isinstance(again, SpatialRun)
    assert again.results == run.results
    assert again.config == replace(run.config, out=folder)
    for trial, other in zip(again.trials, run.trials, strict=True):
        assert trial.passport == other.passport
        for name in SHAPES:
            np.testing.assert_array_equal(getattr(trial, name), getattr(other, name))
    one = inhand.load(folder / "trials" / "down_1.npz")
    assert isinstance(one, SpatialRun)
    assert one.results == run.results[:1]
    assert len(load_all(folder)) == 2


def test_the_report_says_what_was_run_and_how_well(run: SpatialRun, folder: Path) -> None:
    views = Read((folder / "report.html").read_text(encoding="utf-8")).views()
    trial, told = run.trials[0], views["player"]["trials"][0]
    columns, joints = unpacked(told["packed"]), trial.passport.hand.n_joints
    np.testing.assert_allclose(columns[:, :joints], trial.joint_angles, atol=1e-4)
    np.testing.assert_allclose(columns[:, joints : joints + 3], 1e3 * trial.object_pose[:, :3], atol=0.02)
    np.testing.assert_allclose(columns[:, joints + 3 : joints + 7], trial.object_pose[:, 3:], atol=1e-4)
    assert [each["title"] for each in views["bars"]["lists"]] == BARS
    assert [panel["title"] for panel in views["asterisks"]["panels"]] == ["Right and Up", "Out and Up"]
    (disc,) = views["maps"]["discs"]
    assert (disc["title"], disc["dots"][0]["x"], disc["dots"][0]["y"]) == (HALVES[-1.0], 0.0, 0.0)
    assert told["along"] == [0.0, 0.0, -1.0]
    page = (folder / "report.md").read_text(encoding="utf-8")
    assert "# Asterisk Test in space: ik on cube_50 with 3f_60.60_40_10" in page
    assert "gravity down (0.00, 0.00, 9.81 m/s² in the palm frame)" in page
    assert re.search(r"\| Down \| \d\d\.\d \|", page)
    assert re.search(r"\| turn\+z \| \d+\.\d deg \|", page)
    assert errors_told(run.results) in page
    assert "--gravity down" in page
    for name in ("asterisk.png", "solid.png", "replay.gif"):
        assert f"figures/{name}" in page
        with Image.open(folder / "figures" / name) as picture:
            assert min(picture.size) >= 400
    assert len(json.loads((folder / "metrics.json").read_text(encoding="utf-8"))["trials"]) == 2


def as_policy(run: SpatialRun) -> SpatialRun:
    """Return a run as if another controller had made it."""
    return replace(
        run, trials=tuple(replace(each, passport=replace(each.passport, controller="rl")) for each in run.trials)
    )


def test_runs_are_compared_on_one_page(run: SpatialRun, folder: Path) -> None:
    read = Read(compared([(Path("a"), inhand.load(folder)), (Path("b"), as_policy(run))]))
    views = list(read.contents().values())
    stars = [[panel["title"] for panel in view["panels"]] for view in views if "panels" in view]
    assert stars == [["ik", "rl"], ["ik", "rl"]]
    discs = next(view["discs"] for view in views if "discs" in view)
    assert [(each["title"], each["group"]) for each in discs] == [
        (f"{name}, {HALVES[-1.0]}", name) for name in ("ik", "rl")
    ]
    bars = next(view["lists"] for view in views if "lists" in view)
    assert [each["title"] for each in bars] == [f"{what}, {name}" for what in BARS for name in ("ik", "rl")]
    assert [each["group"] for each in bars] == ["ik", "rl"] * 2
    (angle,) = bars[3]["curves"]
    assert angle["label"] == pytest.approx(run.results[1].reached)
    assert [trial["group"] for trial in read.views()["player"]["trials"]] == ["ik", "ik", "rl", "rl"]
    assert {"ik [mm]", "rl, of limit"} <= {text for tag, text in read.texts if tag == "th"}


def test_a_run_stands_beside_an_earlier_one(run: SpatialRun, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known = ready(replace(run.config, controller="rl", beside=(folder,)))
    monkeypatch.setattr("inhand.asterisk_test.asterisk.notes_in_space", lambda *_: ())
    made = finish(replace(run.config, beside=(folder,)), known, lambda *_: as_policy(run).trials)
    assert (made.name, [other.name for other in made.beside]) == ("rl", ["ik"])
    page = made.page()
    assert "| Direction | rl [mm] | ik [mm] |" in page
    assert "ik: 3f_60.60_40_10, cube_50, ik, mujoco, down." in page
    trials = Read(made.html()).views()["player"]["trials"]
    assert [trial["group"] for trial in trials] == ["rl", "rl", "ik", "ik"]
    with pytest.raises(InputError, match="is a run in space, and this one is in the plane: give one of the same kind"):
        ready(AsteriskConfig(beside=(folder,)))


def test_trials_go_where_whole_poses_have_a_place(run: SpatialRun, folder: Path, tmp_path: Path, inhand: Call) -> None:
    code, _, err = inhand("export", folder, "--as", "csv", "--out", tmp_path / "csv")
    assert code == 2
    assert "of a hand in space they would leave out height and tilt" in err
    pytest.importorskip("pyarrow", reason="the extra `lerobot` (pyarrow) is not installed")
    assert inhand("export", folder, "--as", "lerobot", "--out", tmp_path / "lerobot")[0] == 0
    frames = list(read_episodes(tmp_path / "lerobot", read_features(tmp_path / "lerobot")))
    np.testing.assert_array_equal(
        frames[0].arrays["observation.environment_state"], run.trials[0].object_pose[:-1].astype(np.float32)
    )
    assert frames[1].task == "Move cube_50 turn+z with hand 3f_60.60_40_10"


def test_the_command_prints_the_same_table_and_metrics_measure_its_trials(
    inhand: Call, run: SpatialRun, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("inhand.asterisk_test.asterisk.simulate_asterisk_in_space", lambda *_: run.trials)
    monkeypatch.setattr("inhand.asterisk_test.spatial.report._pictures", lambda *_: [])
    monkeypatch.setattr("inhand.asterisk_test.spatial.report.draw_replay", lambda *_: "")
    code, out, err = inhand("asterisk", *WORDS, "--out", tmp_path / "run")
    assert (code, err) == (0, "")
    assert "ik on cube_50 with 3f_60.60_40_10" in out
    assert f"{run.results[0].reached:.1f}" in out
    assert (tmp_path / "run" / "report.md").is_file()
    code, out, _ = inhand("metrics", folder / "trials" / "down_1.npz")
    assert code == 0
    assert f"{run.results[0].reached:.1f}" in out


def test_one_grasp_for_all_is_asked_for_and_told(run: SpatialRun, monkeypatch: pytest.MonkeyPatch) -> None:
    config = replace(run.config, one_grasp=True)
    setup, asked = prepare_in_space(config), list[object]()

    def grasp(*_: Any, shared: bool, **__: Any) -> Grasp:
        asked.append(shared)
        raise InterruptedError

    monkeypatch.setattr("inhand.asterisk_test.spatial.run.limits_in_space", limited)
    planner: Any = grasp
    with pytest.raises(InterruptedError):
        simulate_asterisk_in_space(config, replace(setup, controller=replace(setup.controller, grasp=planner)))
    assert asked == [True]
    assert finish(config, Ready(setup, HumanFolder((), ()), (), ""), lambda *_: run.trials).notes == (ONE,)
    with pytest.raises(InputError, match=r"--one-grasp with 2v2.*, a hand in the plane"):
        ready(AsteriskConfig(one_grasp=True))


def test_the_same_trial_starts_alike_whatever_runs_beside_it() -> None:
    def noise(directions: str, trials: int) -> dict[tuple[str, int], list[float]]:
        config = AsteriskConfig(hand=STANDARD, directions=directions, trials=trials)
        whose = [
            SpatialAssignment(each, spatial_path_of(each), k + 1)
            for each in parse_spatial_directions(directions)
            for k in range(trials)
        ]
        moved, turned = starts_of(config, whose)
        return {(each.primitive.name, each.trial): [*m, *t] for each, m, t in zip(whose, moved, turned, strict=True)}

    few, many = noise("Up,turn-x", 1), noise("all,turns", 3)
    assert all(many[key] == value for key, value in few.items())
    drawn_all = np.array(list(many.values()))
    assert len(np.unique(drawn_all, axis=0)) == 96
    np.testing.assert_allclose(drawn_all.std(axis=0), [1e-3] * 3 + [np.deg2rad(1.0)] * 3, rtol=0.25)


def test_short_of_the_path_a_trial_ends_with_its_grip_or_has_not_moved(run: SpatialRun) -> None:
    trial = replace(run.trials[0], outcome=REACHED)
    assert ended(trial).outcome == GRIP_END
    still = trial.object_pose.copy()
    still[trial.manipulation] = still[trial.manipulation.start]
    assert ended(replace(trial, object_pose=still)).outcome == NO_MOVEMENT
    path, _, _ = trial.manipulated()
    near = replace(trial, reference=np.vstack([np.zeros(6), [*(path[-1] / 1e3), 0.0, 0.0, 0.0]]))
    assert ended(near).outcome == REACHED
    stopped = replace(trial, passport=replace(trial.passport, limit=1.9 * result_of_trial(trial).reached / 1e3))
    assert ended(stopped).outcome == GRIP_END


def test_what_is_no_trial_in_space_is_refused(run: SpatialRun, tmp_path: Path) -> None:
    path = tmp_path / "t.npz"
    save_trial(run.trials[0], path)
    assert isinstance(load_any(path), SpatialTrial)
    with pytest.raises(InputError, match="has a hand in space, and only trials of hands in the plane have a place"):
        load_trial(path)
    save_trial(replace(run.trials[0], reference=np.zeros((3, 3))), path)
    with pytest.raises(InputError, match=r"reference has the shape \(3, 3\); it must be \(3, 6\)"):
        load_any(path)
    with pytest.raises(InputError, match="no trial file"):
        load_any(tmp_path / "none.npz")


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"controller": "thesis-ik"}, "controller 'thesis-ik' with a hand in space; allowed are ik, ik-sensed, rl, "),
        ({"controller": "ik-sensed", "one_grasp": True}, "--one-grasp with --controller ik-sensed, whose grasps"),
        ({"controller": "rl", "one_grasp": True}, "path by path: leave it out, or use ik or rl-privileged"),
        ({"disturb": "feild"}, "unknown disturbance 'feild'; did you mean field?"),
        ({"paths": "human"}, "--paths human with 3f_60.60_40_10, a hand in space"),
        ({"phases": ("mine",), "compatible": True}, "--compatible and --phases with 3f_60.60_40_10"),
        ({"gravity": "0,0,0"}, "has no length"),
        ({"gravity": "aside"}, "allowed are up, down, sideways"),
        ({"directions": "0:0:0"}, "has no length"),
        ({"engine": "bullet"}, "runs in mujoco alone"),
        ({"trials": 0}, "at least one trial"),
        ({"noise_mm": -1.0}, "--noise-mm -1"),
        ({"object": "cube_39mm"}, "for a hand in space"),
    ],
)
def test_what_a_hand_in_space_cannot_do_yet_is_refused(settings: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        prepare_in_space(replace(AsteriskConfig(hand=STANDARD, object="cube_50"), **settings))


def test_hands_in_the_plane_have_no_gravity_and_other_commands_no_hand_in_space() -> None:
    with pytest.raises(InputError, match="a hand in the plane, whose object stands on a floor"):
        inhand.asterisk(gravity="down", trials=1)
    with pytest.raises(InputError, match="is a hand in space"):
        load_hand(STANDARD)
    with pytest.raises(InputError, match="is a hand in space"):
        prepare(AsteriskConfig(hand=STANDARD))


def test_an_object_that_is_too_heavy_for_the_motors_is_refused_with_the_most_they_hold() -> None:
    with pytest.raises(
        InputError, match=r"weighs 900 g; the motors of '3f_60\.60_40_10', 0\.6 N m, hold at most 815 g"
    ):
        prepare_in_space(AsteriskConfig(hand=STANDARD, object="sphere_50:mass_kg=0.9"))


def test_a_spec_of_ones_own_is_known_by_its_name(run: SpatialRun, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("inhand.asterisk_test.asterisk.simulate_asterisk_in_space", lambda *_: run.trials)
    mine: SpatialHand = replace(HAND, name="mine", torque=0.5)
    block = SolidSpec("block", "box", (0.04, 0.05, 0.06))
    made = inhand.asterisk(mine, block, directions="Down,turn+z", trials=1)
    assert (made.config.hand, made.config.object) == ("mine", "block")
    setup = prepare_in_space(made.config)
    assert (setup.hand, setup.object) == (mine, block)


# Pictures


def curves(names: str) -> list[SpatialCurve]:
    found = []
    for k, each in enumerate(parse_spatial_directions(names)):
        along = np.array(each.direction)
        found.append(
            SpatialCurve(each.name, along, np.linspace(0, 50, 5)[:, None] * along, 50.0, 60.0 + k, failed=k == 0)
        )
    return found


def test_figures_show_every_direction_and_turn() -> None:
    turns = [Turned("turn+x", 100.0, 120.0), Turned("turn-x", 90.0, None, failed=True)]
    figure = spatial_figure(curves("all"), turns, "title", "below")
    planes, maps = figure.axes[:3], figure.axes[4:6]
    assert [len([t for t in ax.texts if t.get_text() == "50"]) for ax in planes] == [8, 8, 8]
    assert sum(t.get_text() == "50" for ax in maps for t in ax.texts) == 26 + 8  # those on the rim stand on both
    assert [tick.get_text() for tick in figure.axes[8].get_yticklabels()] == ["turn+x", "turn-x"]
    assert len(spatial_figure([], turns, "", "").axes) == 1
    assert len(spatial_figure(curves("Up"), [], "", "").axes) == 7
    assert len(solid_figure(curves("all"), "title", "").axes) == 1


@pytest.mark.parametrize("words", ["Out-Right-Up,Out-Left-Up,In-Right-Up,In-Left-Up", "Up,Up@+x@15,1:2:3,Out"])
def test_directions_that_lie_in_a_plane_have_no_hull(words: str) -> None:
    (ax,) = solid_figure(curves(words), "title", "").axes
    assert not any(isinstance(each, Poly3DCollection) for each in ax.collections)


def test_maps_are_filled_only_where_directions_are_many() -> None:
    figure = spatial_figure(curves("map"), [], "", "")
    assert len(MAP) == 98
    assert [len(ax.images) for ax in figure.axes[4:6]] == [1, 1]
    assert not any(ax.images for ax in spatial_figure(curves("all"), [], "", "").axes[4:6])


def test_maps_keep_areas() -> None:
    rng = np.random.default_rng(0)
    all_over = rng.standard_normal((20_000, 3))
    all_over /= np.linalg.norm(all_over, axis=-1, keepdims=True)
    upper = all_over[all_over[:, 2] > 0]
    radius = np.linalg.norm(on_map(upper, 1.0), axis=-1)
    assert radius.max() <= 1.0 + 1e-9
    assert np.mean(radius < np.sqrt(0.5)) == pytest.approx(0.5, abs=0.02)  # half of the circle, half of the sphere's


def test_rods_are_where_the_kinematics_have_the_fingertips() -> None:
    joints = np.random.default_rng(0).uniform(-0.5, 0.8, (4, HAND.n_joints))
    rods, fingers = rods_at(HAND, joints)
    assert rods.shape == (4, 9, 7)
    np.testing.assert_allclose(rods[:, 2::3, :3], place(HAND, joints).tips, atol=1e-12)
    np.testing.assert_array_equal(fingers, np.repeat([0, 1, 2], 3))


@pytest.mark.parametrize(
    "spec",
    [
        *(parse_solid_name(name) for name in ("box_40x50x60", "sphere_50", "cylinder_50x60", "ellipsoid_60x50x40")),
        solid_of("wedge", np.array([[0, 0, 0], [0.04, 0, 0], [0, 0.05, 0], [0, 0, 0.06]])),
    ],
    ids=lambda spec: spec.shape,
)
def test_faces_look_outwards_and_enclose_the_solid(spec: SolidSpec) -> None:
    volume = 0.0
    for face in faces_of(spec):
        middle = face.mean(axis=0)
        normal = np.cross(face[1] - face[0], face[2] - face[1])
        assert normal @ middle > 0
        volume += sum(face[0] @ np.cross(face[k], face[k + 1]) for k in range(1, len(face) - 1)) / 6
    a, b, c = spec.size
    share = {"box": 1.0, "cylinder": np.pi / 4, "mesh": volume / (a * b * c)}.get(spec.shape, np.pi / 6)
    assert volume == pytest.approx(share * a * b * c, rel=0.06)
    assert len(box_faces(HAND.palm)) == 6


def test_a_ball_is_drawn_as_a_circle_and_hidden_faces_are_not(run: SpatialRun) -> None:
    frame = solid_frames(run.trials[0], [0], np.array(HAND.start_position))[0]
    outlines, colours, edges = painted(frame)
    assert len(outlines) == len(colours) == len(edges)
    assert len(outlines) == 3 + 3 + 3 * (2 * 4 + 1)  # faces of palm and cube that are seen, pieces of links, tips
    circles = [o for o in outlines if len(o) > 4 and np.ptp(np.linalg.norm(o - o.mean(axis=0), axis=-1)) < 0.2]
    assert sorted(np.ptp(o, axis=0).max().round(1) for o in circles) == [20.0, 20.0, 20.0]


def test_a_replay_needs_as_much_of_everything(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="0 frames with 1 points"):
        write_spatial_replay(
            [], np.zeros((1, 3)), tmp_path / "r.gif", title="", target_mm=np.zeros((2, 3)), texts=[""],
            contact=np.ones((1, 3), dtype=bool), frame_s=0.04, fingers=HAND.finger_names,
        )  # fmt: skip


def test_mean_paths_end_where_the_distance_counts(run: SpatialRun) -> None:
    curve = drawn(run.trials, run.results)[0][0]
    assert curve.points_mm[-1] @ curve.direction == pytest.approx(run.results[0].reached, abs=0.5)
