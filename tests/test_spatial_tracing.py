"""Sequences in space: plans of places and rotations, drawings in planes, and one small run of the command."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import inhand as front
from commands import Call
from inhand.control.episode import MANIPULATE
from inhand.control.phases import Grasp
from inhand.control.spatial_ik import SpatialIkConfig
from inhand.control.spatial_rehearsal import LONGEST, longest_of
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import REACHED, save_trial
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array
from inhand.hands.spatial.following import follow_grips
from inhand.hands.spatial.grasp_search import SpatialSearchConfig
from inhand.hands.spatial.hand import SpatialHand
from inhand.rotations import SpatialPath, multiply, quaternion_of, vector_of
from inhand.sim.disturbance import BENCH, DISTURBANCES, Differences, Disturbance
from inhand.tracing import run as trace_run
from inhand.tracing.config import TraceConfig
from inhand.tracing.drawing import larger_side, scaled
from inhand.tracing.plan import STEP, Leg, Plan, plan_along
from inhand.tracing.poses import Pose, apart, between, full, nearest_rotation, poses_of
from inhand.tracing.report import TraceRun
from inhand.tracing.run import check_trace, prepare_trace, simulate_trace
from inhand.tracing.spatial_drawings import find_spatial_drawing
from inhand.tracing.spatial_tasks import REORIENT
from inhand.tracing.trace import trace_of
from inhand.tracing.walk import SequenceConfig, Walk
from page_reader import Read
from test_spatial_engine import CUBE, HAND, fingers_at

STANDARD = "3f_60.60_40_10"
WORDS = ("--hand", STANDARD, "--object", "cube_50", "--path", "V@yz", "--size", 12, "--trials", 1, "--gravity", "down")
HERE: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
CORNER = Plan(
    "corner",
    (
        Leg("move", HERE, (0.0, 0.0, 0.02, 0.0, 0.0, 0.0)),
        Leg("turn", (0.0, 0.0, 0.02, 0.0, 0.0, 0.0), (0.0, 0.0, 0.02, 0.4, 0.0, 0.0)),
    ),
)


@pytest.fixture(scope="module")
def run() -> TraceRun:
    """A letter, the palm looking down, from a search that is quick: few contacts and grasps."""
    quick = SpatialSearchConfig(spacing=0.012, keep=2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("inhand.control.spatial_rehearsal.search_of", lambda *_: quick)
        return front.trace("V@yz", STANDARD, "cube_50", size=12.0, trials=1, gravity="down")


def test_worlds_of_sequences_are_disturbed(run: TraceRun, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: dict[str, Any] = {}

    def simulated(*_: object, **told: object) -> None:
        seen.update(told)
        raise InterruptedError

    monkeypatch.setattr("inhand.tracing.follow.simulate", simulated)

    def grasp(*_: object, **__: object) -> Grasp:
        return Grasp(np.zeros((2, 9)), np.zeros((2, 9)))

    planner: Any = grasp
    setup = replace(run.setup, controller=replace(run.setup.controller, grasp=planner), plans=run.setup.plans * 2)
    with pytest.raises(InterruptedError):
        simulate_trace(replace(run.config, disturb="bench", trials=2), setup)
    one, other = seen["disturbed"]
    assert one.spec == BENCH
    assert one.drawn.mass != other.drawn.mass
    assert len(one.drawn.bias) == 6
    huge = Disturbance("huge", Differences(size=(1.0, 900.0)))
    with pytest.raises(InputError, match="disturbance 'huge' cannot be drawn: object 'cube_50'"):
        check_trace(replace(run.config, disturb=DISTURBANCES.name_of(huge)))


# Poses and plans


def test_rotations_between_poses_are_those_of_space() -> None:
    rng = np.random.default_rng(0)
    for vectors in rng.standard_normal((20, 2, 3)):
        one, other = ((0.0, 0.0, 0.0, *vector) for vector in vectors.tolist())
        away = multiply(quaternion_of(vectors[1]), quaternion_of(-vectors[0]))
        assert apart(one, other) == pytest.approx(float(np.linalg.norm(vector_of(away))), abs=1e-6)
        way = between(one, other, np.linspace(0.0, 1.0, 5))
        np.testing.assert_allclose(full(way[[0, -1]])[:, 3:], quaternion_of(vectors) * _signs(way, vectors), atol=1e-9)
        steps = [apart(tuple(a), tuple(b)) for a, b in zip(way[:-1].tolist(), way[1:].tolist(), strict=True)]
        np.testing.assert_allclose(steps, steps[0], atol=1e-6)  # it turns evenly


def _signs(way: Array, vectors: Array) -> Array:
    """Return the signs that make quaternions of the same rotations the same."""
    found = full(way[[0, -1]])[:, 3:], quaternion_of(vectors)
    return np.asarray(np.sign((found[0] * found[1]).sum(axis=-1, keepdims=True)))


def test_the_nearest_rotation_of_a_turn_lies_on_it() -> None:
    start, end = HERE, (0.0, 0.0, 0.0, 0.0, 0.6, 0.0)
    assert nearest_rotation(start, end, (0.0, 0.0, 0.0, 0.0, 0.2, 0.0)) == pytest.approx((0.0, 0.2, 0.0))
    assert nearest_rotation(start, end, (0.0, 0.0, 0.0, 0.0, -0.1, 0.0)) == pytest.approx((0.0, 0.0, 0.0))
    assert nearest_rotation(start, end, (0.0, 0.0, 0.0, 0.0, 0.9, 0.0)) == pytest.approx((0.0, 0.6, 0.0))
    tilted = (0.0, 0.0, 0.0, *vector_of(multiply(quaternion_of([0.1, 0.0, 0.0]), quaternion_of([0.0, 0.3, 0.0]))))
    turn = Leg("turn", start, end)
    assert turn.allowed(tilted) == pytest.approx((0.0, 0.3, 0.0), abs=2e-3)
    assert turn.turned(tilted) == pytest.approx(0.1, abs=1e-3)
    assert Leg("move", HERE, (0.01, 0.0, 0.0, 0.0, 0.0, 0.0)).turned(tilted) == pytest.approx(apart(HERE, tilted))


def test_a_plan_in_space_turns_first_and_then_moves() -> None:
    start = np.array([0.0, 0.0, 0.08, 0.0, 0.0, 0.0])
    plan = plan_along("there", start + np.array([[0.0] * 6, [0.01, 0.0, 0.02, 0.0, 0.3, 0.0]]), start, stay=0.5)
    assert [(leg.kind, leg.stay) for leg in plan.legs] == [("turn", 0.0), ("move", 0.5)]
    assert plan.in_space
    assert plan.way[-1] == pytest.approx(TURN_ARM * 0.3 + math.hypot(0.01, 0.02))
    assert plan.path.length == pytest.approx(plan.way[-1])
    assert np.linalg.norm(np.diff(plan.path.poses[:, :3], axis=0), axis=-1).max() <= STEP * (1 + 1e-6)
    assert plan.come(1, (0.005, 0.0, 0.09, 0.0, 0.3, 0.0)) == pytest.approx(plan.way[1] + math.hypot(0.005, 0.01))
    with pytest.raises(InputError, match=r"give an array \(N, 6\) of x, y, z \[m\] and a rotation vector"):
        plan_along("flat", np.zeros((2, 3)), start)


def test_a_walk_in_space_brings_back_what_has_left_its_path() -> None:
    walk = Walk(CORNER, SequenceConfig(), 0.02)
    assert walk.begin(HERE).end == CORNER.legs[0].end
    assert walk.decide((0.0, 0.0, 0.01, 0.05, 0.0, 0.0), touching=True) is None
    beside = (0.0, 0.006, 0.01, 0.0, 0.0, 0.0)
    asked = walk.decide(beside, touching=True)
    assert asked is not None
    assert asked.what == "hold"
    assert (walk.events[0].what, walk.events[0].place) == ("left its path", beside[:3])
    while asked is None or asked.what == "hold":
        asked = walk.decide(beside, touching=True)
    assert (asked.what, asked.end) == ("move", (0.0, 0.0, 0.01, 0.0, 0.0, 0.0))
    turned = Walk(CORNER, SequenceConfig(), 0.02)
    turned.begin(HERE)
    tilted = (0.0, 0.0, 0.01, 0.0, 0.3, 0.0)
    asked = turned.decide(tilted, touching=True)
    while asked is None or asked.what == "hold":
        asked = turned.decide(tilted, touching=True)
    assert asked.what == "turn"
    assert asked.end == pytest.approx((0.0, 0.0, 0.01, 0.0, 0.0, 0.0), abs=1e-9)


def test_the_last_pose_of_a_path_is_looked_at_whatever_the_stride() -> None:
    joints, pose = fingers_at(0.0)[None], HAND.start_pose[None]
    gravity = np.array([[0.0, 0.0, -9.81]])
    for steps in (8, 9):  # of which every second one is looked at
        moves = np.linspace(0.0, 0.006, steps)[None, :, None] * np.array([0.0, 0.0, 1.0])
        path = SpatialPath(moves, np.zeros_like(moves))
        assert follow_grips((HAND, CUBE), (joints, pose), (path, pose, gravity))[0] == pytest.approx(0.006)


# Drawings


def test_a_drawing_lies_in_the_plane_that_it_is_asked_for() -> None:
    for plane, still in (("xy", 2), ("xz", 1), ("yz", 0)):
        drawing = scaled(find_spatial_drawing(f"R@{plane}"), 0.03)
        assert larger_side(drawing) == pytest.approx(0.03)
        assert np.ptp(drawing.poses[:, :3], axis=0)[still] == 0.0
        assert not drawing.poses[:, 3:].any()
    both = find_spatial_drawing("I@xz+L@yz")
    assert both.name == "I in xz + L in yz"
    assert (np.ptp(both.poses[:, :3], axis=0) > 0).tolist() == [True, True, True]
    helix = scaled(find_spatial_drawing("helix"), 0.02).poses
    np.testing.assert_allclose(np.hypot(helix[:, 0], helix[:, 1]), 0.01)
    assert (np.diff(helix[:, 2]) > 0).all()
    assert find_spatial_drawing("helix@yz").poses[-1, 0] == pytest.approx(0.5)  # along the plane's normal


def test_a_way_point_of_a_file_turns_about_the_normal_of_its_plane(tmp_path: Path) -> None:
    (tmp_path / "turn.csv").write_text("x_mm,y_mm,theta_deg\n0,0,0\n10,5,20\n")
    flat, upright = (find_spatial_drawing(f"{tmp_path / 'turn.csv'}{at}").poses for at in ("", "@xz"))
    assert flat[-1] == pytest.approx([0.01, 0.005, 0.0, 0.0, 0.0, np.deg2rad(20)])
    assert upright[-1] == pytest.approx([0.01, 0.0, 0.005, 0.0, -np.deg2rad(20), 0.0])
    with pytest.raises(InputError, match="some of these drawings have a size of their own, others have not"):
        find_spatial_drawing(f"A+{tmp_path / 'turn.csv'}")


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"path": "A@zx"}, r"'A@zx': unknown plane 'zx'; allowed are xy, xz, yz of the palm frame"),
        (
            {"path": "helx"},
            r"unknown --path 'helx'; did you mean helix\?; allowed are square.*helix.*, each in a plane",
        ),
        ({"path": "key"}, r"unknown --path 'key'.* and the tasks pose, place, reorient"),
        ({"path": "pose", "size": 20.0}, "--path pose is a task and has no size"),
        ({"disturb": "feild"}, "unknown disturbance 'feild'; did you mean field?"),
        ({"gravity": "0,0,0"}, "gravity '0,0,0' has no length"),
        ({"controller": "rl"}, "a policy knows single primitives"),
        ({"controller": "ik-sensed"}, "ik-sensed there knows single primitives"),
        ({"hand": "2v2_50.50_50.50_1.1_53", "object": "cube_39", "gravity": "up"}, "--gravity up with 2v2_50.50"),
    ],
)
def test_what_cannot_be_traced_in_space_is_refused(settings: dict[str, Any], text: str) -> None:
    config = replace(TraceConfig(hand=STANDARD, object="cube_50"), **settings)
    with pytest.raises(InputError, match=text):
        check_trace(config)


def test_a_drawing_that_no_grip_carries_is_refused_with_the_largest(monkeypatch: pytest.MonkeyPatch) -> None:
    def half(held: object, plan: Plan) -> float:
        del held
        side = 1e3 * np.ptp(np.array([leg.end for leg in plan.legs])[:, :3], axis=0).max()
        return float(plan.way[-1]) if side <= 31.0 else 0.05

    monkeypatch.setattr("inhand.tracing.fit.carried", half)
    monkeypatch.setattr(trace_run, "carried", half)
    config = TraceConfig(hand=STANDARD, object="cube_50", path="square@xz", size=60.0)
    with pytest.raises(InputError, match=r"is too much for one grip: the best single grip .* give --size 30 or less"):
        prepare_trace(config)
    assert prepare_trace(replace(config, scale=True)).size == pytest.approx(0.030, abs=1e-3)


def test_a_drawing_in_space_without_a_size_gets_half_of_what_a_grip_carries(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trace_run, "_largest", lambda *_: 0.06)
    setup = prepare_trace(TraceConfig(hand=STANDARD, object="cube_50", path="star@xz"))
    assert setup.size == pytest.approx(0.03)
    assert setup.notes == ("Size 30 mm is 50 % of the reachable 60 mm.",)


# A run


def test_one_grip_traces_a_letter_against_gravity(run: TraceRun) -> None:
    (trace,), (followed,) = run.traces, run.followed
    assert (trace.outcome, trace.completion, trace.failures) == (REACHED, 1.0, 0)
    assert trace.rms_mm < 0.4
    trial = followed.trial
    assert isinstance(trial, SpatialTrial)
    assert trial.touching[trial.manipulation].all()
    path = poses_of(trial.object_pose[trial.manipulation], space=True)
    assert 1e3 * np.ptp(path[:, :3], axis=0) == pytest.approx([0.0, 10.0, 13.0], abs=3.0)
    moved = replace(trial, object_pose=trial.object_pose + np.array([0.003, 0, 0, 0, 0, 0, 0]))
    aside = trace_of(replace(followed, trial=moved))
    assert aside.rms_mm == pytest.approx(3.0, abs=0.2)


def test_the_command_in_space_leaves_what_it_leaves_in_the_plane(
    inhand: Call, run: TraceRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("inhand.tracing.tracing.run_trace", lambda *_: run)
    folder = tmp_path / "run"
    code, out, err = inhand("trace", *WORDS, "--out", folder)
    assert (code, err) == (0, "")
    assert "V in yz of 12 mm by ik: cube_50, 3f_60.60_40_10" in out
    names = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert {"trace.json", "report.md", "report.html", "figures/trace.png", "figures/replay.gif"} < names
    with Image.open(folder / "figures" / "trace.png") as picture:
        assert min(picture.size) > 600
    entry = json.loads((folder / "trace.json").read_text())["trials"][0]
    loaded = front.load(folder)
    assert isinstance(loaded, TraceRun)
    assert loaded.traces == run.traces
    assert loaded.table()["rms_mm"][0] == pytest.approx(entry["rms_mm"])
    views = Read(loaded.html()).views()
    assert len(views["player"]["trials"]) == 1
    report = (folder / "report.md").read_text()
    assert "Gravity down (0.00, 0.00, 9.81 m/s² in the palm frame)" in report
    assert "V in yz of 12 mm by ik" in report


def test_a_trial_of_a_drawing_in_space_is_measured_and_shown_as_no_primitive(
    run: TraceRun, tmp_path: Path, inhand: Call
) -> None:
    file = tmp_path / "drawn.npz"
    save_trial(run.followed[0].trial, file)
    told = f"inhand: {file} followed {run.followed[0].trial.passport.primitive}, which is no primitive"
    for words in (["metrics", file], ["view", file, "--browser"], ["report", file, "--out", tmp_path / "page.html"]):
        code, out, err = inhand(*words)
        assert (code, out) == (2, "")
        assert err.startswith(told)
        assert "`inhand asterisk`" in err or "the folder of the run of `inhand trace`" in err
    assert [each.name for each in tmp_path.iterdir()] == ["drawn.npz"]


def test_tasks_of_space_go_where_they_say(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("inhand.tracing.spatial_tasks._ways", lambda _: np.array([0.06, 0.08, 0.04, 0.06, 0.08, 0.04]))
    monkeypatch.setattr("inhand.tracing.fit.carried", lambda _, plan: float(plan.way[-1]))
    config = TraceConfig(hand=STANDARD, object="cube_50", trials=20)
    ends = np.array([plan.legs[-1].end for plan in prepare_trace(replace(config, path="pose")).plans])
    away = ends[:, :3] - HAND.start_pose[:3]
    assert (np.linalg.norm(away / np.array([0.03, 0.04, 0.02]), axis=-1) <= 1 + 1e-9).all()
    assert 0 < np.linalg.norm(ends[:, 3:], axis=-1).max() <= np.deg2rad(15.0)
    assert len(np.unique(away, axis=0)) == 20
    (plan,) = prepare_trace(replace(config, path="reorient", trials=1)).plans
    assert [leg.kind for leg in plan.legs] == ["turn"] * 6
    assert plan.legs[-1].end == pytest.approx((*HAND.start_pose[:3], 0.0, 0.0, 0.0))
    assert sorted(max(leg.end[3:]) for leg in plan.legs) == pytest.approx([0.0] * 3 + [REORIENT] * 3)


def test_objects_are_carried_for_as_long_as_their_paths_need() -> None:
    short, long = (
        SpatialPath(np.linspace(0, way, 5)[None, :, None] * np.ones(3), np.zeros((1, 5, 3))) for way in (0.05, 0.5)
    )
    config = SpatialIkConfig()
    assert longest_of(short, config) == LONGEST
    assert longest_of(long, config) > 0.5 * math.sqrt(3) / config.speed


def test_the_hand_of_a_sequence_is_one_of_space(run: TraceRun) -> None:
    assert isinstance(run.setup.hand, SpatialHand)
    assert run.followed[0].trial.phases[-1] == MANIPULATE
