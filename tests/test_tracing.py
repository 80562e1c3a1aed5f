"""What is measured of a followed plan, against closed forms, and how it is told and drawn."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from inhand.control.catalogue import find_controller
from inhand.control.scenes import scene_at
from inhand.control.trial import DIVERGED, LOST_CONTACT, NO_GRASP, REACHED, STOPPED, Trial
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array
from inhand.hands.fit import Held
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE
from inhand.plots.replay import write_replay
from inhand.sim.walls import clearance
from inhand.tracing.figures import MOST_PANELS, one_plan, trace_figure
from inhand.tracing.follow import Followed
from inhand.tracing.plan import Plan, plan_along
from inhand.tracing.run import TraceSetup
from inhand.tracing.table import COLUMNS, faults, trace_entry, trace_rows, what_was_done
from inhand.tracing.tasks import TASKS, WALL_WAY, the_wall
from inhand.tracing.trace import PUSHED, Trace, deviations, measured_rows, trace_of
from inhand.tracing.walk import Event
from made import passport, trial_at

HAND, CUBE = parse_hand_name("2v2_50.50_50.50_1.1_53"), CATALOGUE["cube_39"]
HELD = Held(HAND, CUBE)
START = HAND.start_pose
BEFORE, PERIOD = 3, 0.02
LINE = plan_along("line", START + np.array([(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)]), START)
BENT = plan_along("bent", START + np.array([(0.02, 0.0, 0.0), (0.02, 0.04, 0.0), (0.06, 0.04, 0.0)]), START)
TURNED = plan_along("turned", START + np.array([(0.0, 0.0, 0.0), (0.0, 0.02, 0.5)]), START)


def along(plan: Plan, count: int = 51) -> tuple[Array, Array]:
    """Return poses on a plan, `count` on each primitive, both ends among them, and the primitive of each."""
    poses = [np.linspace(leg.start, leg.end, count) for leg in plan.legs]
    return np.concatenate(poses), np.repeat(np.arange(len(poses)), count)


def followed_of(
    plan: Plan,
    poses: Array,
    legs: Array,
    outcome: str = REACHED,
    *,
    come: float | None = None,
    events: tuple[Event, ...] = (),
    touching: Array | None = None,
    trial: int = 1,
) -> Followed:
    """Return a made-up trial that was at poses `(M, 3)`, on those primitives; before them a grasp of three rows."""
    begun = np.tile(poses[0] if len(poses) else START, (BEFORE, 1))
    every = np.concatenate([begun, poses.reshape(-1, 3)])
    rows = len(every)
    gaps = np.zeros((rows, 2))
    if touching is not None:
        gaps[BEFORE:] = np.where(touching, 0.0, 0.01)
    told = {"primitive": plan.name, "path": plan.name, "angle_deg": None, "trial": trial, "timestep": PERIOD / 5}
    made = trial_at(
        every,
        passport(**told),
        outcome=outcome,
        phases=("grasp", "manipulate"),
        phase=(np.arange(rows) >= BEFORE).astype(np.int64),
        joint_angles=np.tile([1.2, -0.6, -1.2, 0.6], (rows, 1)),
        gaps=gaps,
        reference=plan.path.poses - START,
    )
    way = float(plan.way[-1]) if come is None else come
    return Followed(plan, made, legs.astype(np.int64), events, way)


def setup_of(*plans: Plan, task: str | None = None) -> TraceSetup:
    known = None if task is None else TASKS[task]
    return TraceSetup(HELD, find_controller("ik"), plans, known, None if task else 0.1, ())


def test_a_path_on_its_plan_has_no_error() -> None:
    for plan in (LINE, BENT, TURNED):
        poses, legs = along(plan)
        trace = trace_of(followed_of(plan, poses, legs))
        assert (trace.completion, trace.failures, trace.pushed_s, trace.done, trace.dropped) == (
            1,
            0,
            None,
            True,
            False,
        )
        for value in (trace.rms_mm, trace.max_mm, trace.frechet_mm, trace.turn_deg, trace.end_mm, trace.end_deg):
            assert value == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("off", [0.002, -0.004])
def test_a_constant_offset_is_root_mean_square_largest_and_frechet_distance(off: float) -> None:
    poses, legs = along(LINE)
    trace = trace_of(followed_of(LINE, poses + np.array([0.0, off, 0.1]), legs))
    for value in (trace.rms_mm, trace.max_mm, trace.frechet_mm, trace.end_mm):
        assert value == pytest.approx(1e3 * abs(off))
    assert (trace.turn_deg, trace.end_deg) == pytest.approx((np.rad2deg(0.1),) * 2)
    assert trace.time_s == pytest.approx(51 * PERIOD)


def test_the_largest_force_and_overlap_are_those_of_any_row() -> None:
    found = followed_of(LINE, *along(LINE))
    rows = len(found.trial.time)
    forces, penetration = np.zeros((rows, 2, 3)), np.zeros(rows)
    forces[0, 1], penetration[5] = (0.0, 3.0, 4.0), 2e-4
    trace = trace_of(replace(found, trial=replace(found.trial, forces=forces, penetration=penetration)))
    assert (trace.force_max_n, trace.penetration_max_mm) == pytest.approx((5.0, 0.2))
    (_, (row,)) = trace_rows([trace])
    assert row[-2:] == ("5.00", "0.20")


def test_a_wave_has_the_root_mean_square_of_a_wave() -> None:
    poses, legs = along(LINE, 2001)
    share = np.linspace(0, 1, 2001)
    poses[:, 1] += 0.003 * np.sin(10 * np.pi * share)
    trace = trace_of(followed_of(LINE, poses, legs))
    assert trace.rms_mm == pytest.approx(3 / np.sqrt(2), rel=1e-3)
    assert trace.max_mm == pytest.approx(3)
    assert trace.frechet_mm == pytest.approx(3, rel=0.02)


def test_a_frechet_distance_minds_what_the_largest_error_does_not() -> None:
    poses, legs = along(LINE)
    cut = poses[: len(poses) // 2]
    trace = trace_of(followed_of(LINE, cut, legs[: len(cut)], STOPPED, come=0.05))
    assert trace.max_mm == pytest.approx(0, abs=1e-9)
    assert trace.frechet_mm == pytest.approx(1e3 * (0.1 - cut[-1, 0]))


def test_a_long_plan_has_more_points_between_which_distances_are_taken() -> None:
    zigzag = np.zeros((41, 3))
    zigzag[:, 0], zigzag[:, 1] = 0.05 * (np.arange(41) % 2), 0.001 * np.arange(41)
    plan = plan_along("zigzag", START + zigzag, START, tolerance=0.0)
    poses, legs = along(plan)
    trace = trace_of(followed_of(plan, poses + np.array([0.0, 0.0005, 0.0]), legs))
    assert plan.way[-1] > 1.9
    assert trace.frechet_mm < 1.2


@pytest.mark.parametrize("plan", [LINE, BENT])
@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_completion_is_the_share_of_the_way_after_the_approach(plan: Plan, share: float) -> None:
    poses, legs = along(plan)
    before = plan.way[plan.approach]
    come = before + share * (plan.way[-1] - before)
    trace = trace_of(followed_of(plan, poses, legs, STOPPED, come=come))
    assert trace.completion == pytest.approx(share)
    assert type(trace.completion) is float
    assert not trace.done


def test_only_what_reached_its_end_is_complete() -> None:
    poses, legs = along(LINE)
    assert trace_of(followed_of(LINE, poses, legs, STOPPED)).completion == 0.999
    assert trace_of(followed_of(BENT, *along(BENT), LOST_CONTACT, come=0.001)).completion == 0.0


def test_the_approach_is_not_measured() -> None:
    poses, legs = along(BENT)
    assert BENT.approach == 1
    wild = np.where((legs < 1)[:, None], poses + np.array([0.0, 0.03, 0.5]), poses)
    trace = trace_of(followed_of(BENT, wild, legs))
    assert trace.max_mm == pytest.approx(0, abs=1e-9)
    assert trace.turn_deg == pytest.approx(0, abs=1e-9)
    assert trace.time_s == pytest.approx(2 * 51 * PERIOD)
    measured, which = measured_rows(followed_of(BENT, wild, legs))
    assert len(measured) == 2 * 51
    assert set(which) == {1, 2}


def test_a_trial_that_never_came_to_its_plan_has_no_errors() -> None:
    empty = trace_of(followed_of(LINE, np.empty((0, 3)), np.empty(0), NO_GRASP, come=0.0))
    poses, legs = along(BENT)
    lost = trace_of(followed_of(BENT, poses[:20], legs[:20], LOST_CONTACT, come=0.01))
    for trace in (empty, lost):
        assert np.isnan([trace.rms_mm, trace.max_mm, trace.frechet_mm]).all()
        assert (trace.completion, trace.time_s, trace.dropped) == (0, 0, True)


def test_a_primitive_that_starts_before_its_line_is_still_on_the_path() -> None:
    before = np.array([(0.02, 0.0392, 0.0)]) + START
    rows = deviations(followed_of(BENT, before, np.array([2])))
    assert rows.off[0] == pytest.approx(0, abs=1e-12)
    assert rows.way[0] == pytest.approx(0.04)
    aside = deviations(followed_of(BENT, before + np.array([0.001, 0.0, 0.0]), np.array([2])))
    assert aside.off[0] == pytest.approx(0.0008)  # nearer to the line that begins than to the one that ends
    approach = deviations(followed_of(BENT, START + np.array([(0.0192, 0.0, 0.0)]), np.array([1])))
    assert approach.off[0] == pytest.approx(0.0008)  # the approach is no part of the path


def test_the_way_goes_on_with_moves_and_turns() -> None:
    rows = deviations(followed_of(TURNED, *along(TURNED)))
    assert len(TURNED.legs) == 2
    assert rows.way[[0, 50, 51, -1]] == pytest.approx([0, 0.5 * TURN_ARM, 0.5 * TURN_ARM, 0.5 * TURN_ARM + 0.02])
    assert (np.diff(rows.way) >= -1e-12).all()


def test_a_turn_allows_every_angle_on_its_way() -> None:
    poses, legs = along(TURNED)
    assert trace_of(followed_of(TURNED, poses, legs)).turn_deg == pytest.approx(0, abs=1e-9)
    over = np.where((legs == 0)[:, None], poses + np.array([0.0, 0.0, 0.05]), poses)
    assert trace_of(followed_of(TURNED, over, legs)).turn_deg == pytest.approx(np.rad2deg(0.05))


def pushed(rows: int, touching: Array | None = None) -> Trace:
    """Return what is measured where the object stood against the wall for so many rows of a hundred."""
    plan = TASKS["wall"].plan(HELD, np.random.default_rng(0))
    poses = np.tile(START, (100, 1))
    poses[20 : 20 + rows, 1] += WALL_WAY
    wall = the_wall(HELD)
    assert clearance(wall, CUBE, poses)[[0, 20]] == pytest.approx([WALL_WAY, 0.0])
    return trace_of(followed_of(plan, poses, np.ones(100), touching=touching), wall)


def test_a_push_counts_while_the_object_touches_wall_and_fingers() -> None:
    trace = pushed(60)
    assert trace.pushed_s == pytest.approx(60 * PERIOD)
    assert trace.done
    once_off = np.ones((100, 2), dtype=bool)
    once_off[45, 1] = False
    trace = pushed(60, once_off)
    assert trace.pushed_s == pytest.approx(34 * PERIOD)
    assert not trace.done
    assert pushed(60, np.zeros((100, 2), dtype=bool)).pushed_s == 0.0


def test_what_follows_a_push_may_start_where_it_ended() -> None:
    plan = TASKS["wall"].plan(HELD, np.random.default_rng(0))
    assert [leg.kind for leg in plan.legs] == ["move", "press", "move"]
    beyond = np.array([(START[0], START[1] + WALL_WAY, 0.0)])
    assert trace_of(followed_of(plan, beyond, np.array([2]))).max_mm == pytest.approx(0, abs=1e-9)


EVENTS = (
    Event(0.04, 1, (START[0] + 0.02, START[1] + 0.0003), 0.006, 0.1, "left its path"),
    Event(0.5, 1, (START[0] + 0.02, START[1] + 0.01), 0.0, 0.0, "stuck"),
    Event(0.9, 1, (START[0] + 0.02, START[1] + 0.01), 0.0, 0.0, "lost a finger"),
    Event(0.9, 1, (START[0] + 0.02, START[1] + 0.01), 0.0, 0.0, "gave up"),
)


def bad_trials() -> tuple[Followed, ...]:
    poses, legs = along(BENT)
    return (
        followed_of(BENT, poses + np.array([0.0, 0.0, 0.1]), legs, events=EVENTS[:1]),
        followed_of(BENT, poses[:60], legs[:60], STOPPED, come=0.03, events=EVENTS, trial=2),
        followed_of(BENT, poses[:60], legs[:60], LOST_CONTACT, come=0.03, events=EVENTS[2:3], trial=3),
        followed_of(BENT, np.empty((0, 3)), np.empty(0), NO_GRASP, come=0.0, trial=4),
        followed_of(BENT, poses[:60], legs[:60], DIVERGED, come=0.03, trial=5),
        followed_of(BENT, poses, legs, trial=6),
    )


def test_what_went_wrong_is_told_a_sentence_a_trial() -> None:
    found = bad_trials()
    traces = [trace_of(each) for each in found]
    assert [trace.failures for trace in traces] == [1, 3, 1, 0, 0, 0]
    told = faults(setup_of(BENT), found, traces)
    assert told[0] == (
        "Trial 1, reached: left its path at (20.0, 0.3) mm after 0.0 s, 6.0 mm and 5.7 deg off, in primitive 2 of 3"
        " (move); then went on to the end."
    )
    assert told[1].startswith("Trial 2, stopped: left its path at (20.0, 0.3) mm")
    assert "; stuck at (20.0, 10.0) mm after 0.5 s, " in told[1]
    assert told[1].endswith("; 1 more; gave up at (20.0, 6.4) mm after 12.5 % of the way.")
    assert told[2].startswith("Trial 3, lost contact: lost a finger at (20.0, 10.0) mm")
    assert told[2].endswith("; ended at (20.0, 6.4) mm after 12.5 % of the way.")
    assert told[3] == "Trial 4, no grasp: the fingers did not hold the object at the start."
    assert told[4].endswith("says nothing about the hand: lower its stiffness, torque or physics step.")
    assert len(told) == 5


def test_a_push_that_was_too_short_is_told() -> None:
    plan = TASKS["wall"].plan(HELD, np.random.default_rng(0))
    poses, legs = along(plan)
    found = followed_of(plan, poses, legs)
    setup = setup_of(plan, task="wall")
    (told,) = faults(setup, [found], [trace_of(found, setup.wall)])
    assert told.startswith("Trial 1, reached: pushed against the wall for ")
    assert told.endswith(f" s instead of {PUSHED:g} s.")
    assert what_was_done(setup) == "Task wall by ik"


def test_rows_and_entries_have_every_number() -> None:
    found = bad_trials()
    traces = [trace_of(each) for each in found]
    header, rows = trace_rows(traces)
    assert header == tuple(COLUMNS)[:-1]
    assert all(len(row) == len(header) for row in rows)
    assert rows[3] == ("4", NO_GRASP, "0.0", "-", "-", "-", "0.0", "0.0", "0", "0.00", "0.00")
    assert rows[5][:5] == ("6", REACHED, "100.0", "0.00", "0.00")
    header, (row,) = trace_rows([pushed(60)])
    assert header == tuple(COLUMNS)
    assert row[-1] == "1.2"
    entry = trace_entry(found[1], traces[1], START)
    assert asdict(traces[1]).items() <= entry.items()
    assert (entry["legs"], entry["approach_legs"], entry["way_mm"]) == (3, 1, pytest.approx(80))
    first = entry["events"][0]
    assert first["place_mm"] == pytest.approx([20, 0.3])
    assert (first["leg"], first["kind"], first["what"]) == (1, "move", "left its path")
    assert (first["time_s"], first["off_mm"]) == (0.04, pytest.approx(6))
    assert what_was_done(setup_of(BENT)) == "Bent of 100 mm by ik"


def drawn(setup: TraceSetup, found: tuple[Followed, ...]) -> tuple[Figure, list[str]]:
    """Return the figure of a run and the texts of its legend."""
    figure = trace_figure(setup, found, [trace_of(each, setup.wall) for each in found], "title", "subtitle")
    (legend,) = figure.legends
    return figure, [text.get_text() for text in legend.get_texts()]


def test_trials_of_one_plan_share_a_panel_and_say_what_failed() -> None:
    found = bad_trials()
    figure, texts = drawn(setup_of(BENT), found)
    assert one_plan(found)
    assert len(figure.axes) == 2
    assert texts[:2] == ["trial 1: RMS 0.00 mm", "trial 2: RMS 0.00 mm"]
    assert texts[3] == "trial 4"
    assert set(texts) >= {"plan", "approach", "left its path", "stuck", "lost a finger", "gave up", "object lost"}
    assert "grip ends" not in texts
    panel, errors = figure.axes
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("x [mm]", "y [mm]")
    assert panel.get_aspect() == 1
    assert errors.get_xlabel() == "way along the plan [mm]"


def test_many_trials_share_a_colour() -> None:
    poses, legs = along(LINE)
    found = tuple(followed_of(LINE, poses, legs, trial=number) for number in range(1, 9))
    _, texts = drawn(setup_of(LINE), found)
    assert texts[:2] == ["trial 1: RMS 0.00 mm", "trials 2 to 8"]
    assert "approach" not in texts


def test_trials_with_plans_of_their_own_have_panels_and_turns_have_axes() -> None:
    plans = [
        plan_along("pose", START + np.array([(0.0, 0.0, 0.0), (0.01 * k, 0.02, 0.1)]), START)
        for k in range(MOST_PANELS + 2)
    ]
    found = tuple(followed_of(plan, *along(plan), trial=k + 1) for k, plan in enumerate(plans))
    figure, texts = drawn(setup_of(*plans), found)
    assert not one_plan(found)
    assert len(figure.axes) == MOST_PANELS + 2
    assert [ax.get_title(loc="left") for ax in figure.axes[:2]] == ["trial 1", "trial 2"]
    assert figure.axes[-1].get_ylabel() == "rotation [°]"
    assert "object turned, as planned" in texts


def test_a_wall_is_drawn_and_nothing_to_measure_is_said() -> None:
    plan = TASKS["wall"].plan(HELD, np.random.default_rng(0))
    _, texts = drawn(setup_of(plan, task="wall"), (followed_of(plan, *along(plan)),))
    assert "wall" in texts
    poses, legs = along(BENT)
    figure, _ = drawn(setup_of(BENT), (followed_of(BENT, poses[:20], legs[:20], LOST_CONTACT, come=0.01),))
    assert [text.get_text() for text in figure.axes[1].texts] == ["no trial came to the end of the approach"]


def test_a_replay_shows_a_wall_and_says_what_it_is_told(tmp_path: Path) -> None:
    found = followed_of(LINE, *along(LINE, 4))
    assert isinstance(found.trial, Trial)
    frames = [scene_at(found.trial, row, START[:2]) for row in range(4)]
    trail = np.column_stack([np.arange(4.0), np.zeros(4)])
    wall = 1e3 * (the_wall(HELD).outline - START[:2])

    def picture(name: str, wall_mm: Array | None = None, texts: list[str] | None = None) -> Array:
        with Image.open(write_replay(frames, trail, tmp_path / name, wall_mm=wall_mm, texts=texts)) as opened:
            return np.asarray(opened.convert("RGB"), dtype=float)

    plain = picture("plain.gif")
    walled, told = picture("wall.gif", wall_mm=wall), picture("told.gif", texts=["primitive 1 of 9"] * 4)
    hatched = np.abs(walled - [227, 231, 235]).max(axis=-1) < 3
    assert hatched.sum() > 20
    assert not (np.abs(plain - [227, 231, 235]).max(axis=-1) < 3).any()
    rows, columns = np.nonzero(np.abs(told - plain).max(axis=-1) > 60)
    assert rows.max() < 40
    assert columns.min() > 240
    with pytest.raises(InputError, match="3 texts given for 4 frames: give one text per frame"):
        write_replay(frames, trail, tmp_path / "a.gif", texts=["", "", ""])
    with pytest.raises(InputError, match=r"wall has shape \(4,\)"):
        write_replay(frames, trail, tmp_path / "a.gif", wall_mm=np.zeros(4))
    assert not (tmp_path / "a.gif").exists()
