"""Plans, one world's way through its plan, and whole plans carried out in simulation, knocks and walls included."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from inhand.control.catalogue import find_controller
from inhand.control.loop import Bench
from inhand.control.trial import REACHED, STOPPED
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array, distance_to
from inhand.hands.fit import Held
from inhand.hands.names import parse_hand_name
from inhand.hands.objects import CATALOGUE
from inhand.sim.state import State
from inhand.tasks.paths import TURN_STEP
from inhand.tasks.primitives import TRAIN, UNSEEN
from inhand.tasks.reach import limits
from inhand.tracing import fit
from inhand.tracing.config import TraceConfig
from inhand.tracing.fit import Fit, carried, fit_of, largest, reached, refusal
from inhand.tracing.follow import Followed, follow
from inhand.tracing.plan import STEP, TOLERANCE, Leg, Plan, plan_along
from inhand.tracing.poses import Pose
from inhand.tracing.run import prepare_trace, simulate_trace
from inhand.tracing.sequencer import Sequencer
from inhand.tracing.tasks import DRAWS, SHARE, TASKS, SequenceTask, draw_points
from inhand.tracing.trace import PUSHED, trace_of
from inhand.tracing.walk import Request, SequenceConfig, Walk

HAND, CUBE = parse_hand_name("2v2_50.50_50.50_1.1_53"), CATALOGUE["cube_39"]
HELD = Held(HAND, CUBE)
START = HAND.start_pose
PERIOD = 0.02
CORNER = Plan(
    "corner",
    (Leg("move", (0.0, 0.0, 0.0), (0.01, 0.0, 0.0)), Leg("move", (0.01, 0.0, 0.0), (0.01, 0.01, 0.0))),
)
FIRST: Pose = (0.0, 0.0, 0.0)
points = st.tuples(
    *[st.integers(-300, 300).map(lambda tenth: tenth / 1e4)] * 2, st.integers(-5, 5).map(lambda t: t / 10)
)
"""Poses: tenths of a millimetre [m], and tenths of a radian."""


def plan_of(*points_mm_deg: tuple[float, float, float], name: str = "path") -> Plan:
    """Return a plan through way-points in mm and degrees from the object's start."""
    given = np.array(points_mm_deg, dtype=float) * [1e-3, 1e-3, np.pi / 180]
    return plan_along(name, START + given, START)


def carry(plans: Sequence[Plan], controller: str = "ik", starts: Array | None = None) -> tuple[Followed, ...]:
    """Carry plans out, one world each, from the start or from places beside it."""
    starts = np.tile(START, (len(plans), 1)) if starts is None else starts
    return follow(HELD, find_controller(controller), plans, starts, Bench())


def begun(plan: Plan = CORNER, config: SequenceConfig | None = None, limit: float = math.inf) -> Walk:
    """Return a walk that has begun where its plan does."""
    walk = Walk(plan, config or SequenceConfig(), PERIOD, limit)
    walk.begin(plan.legs[0].start)
    return walk


def feed(walk: Walk, poses: Iterable[Pose], *, touching: bool = True) -> list[Request | None]:
    return [walk.decide(pose, touching=touching) for pose in poses]


def mode_of(walk: Walk) -> str:
    return walk.mode


def wait(walk: Walk, pose: Pose, most: int = 1000) -> Request:
    """Return the next primitive that a walk asks for while the object stays where it is."""
    for _ in range(most):
        asked = walk.decide(pose, touching=True)
        if asked is not None:
            return asked
    raise AssertionError(f"nothing was asked for in {most} decisions")


# Plans


def test_a_plan_turns_first_and_then_moves() -> None:
    plan = plan_of((0, 0, 0), (10, 0, 20), (10, 5, 20))
    assert [leg.kind for leg in plan.legs] == ["turn", "move", "move"]
    assert plan.legs[0].end == pytest.approx((*START[:2], np.deg2rad(20)))
    assert plan.legs[0].length == pytest.approx(TURN_ARM * np.deg2rad(20))
    assert plan.approach == 0


@settings(deadline=None)
@given(st.lists(points, min_size=2, max_size=8))
def test_every_primitive_starts_where_the_one_before_it_ends(drawn: list[tuple[float, float, float]]) -> None:
    poses = START + np.array(drawn)
    if np.abs(poses - START).max() < 1e-6:
        return
    plan = plan_along("drawn", poses, START)
    assert plan.legs[0].start == pytest.approx(START.tolist())
    assert plan.legs[-1].end == pytest.approx(poses[-1].tolist())
    for one, other in zip(plan.legs, plan.legs[1:], strict=False):
        assert one.end == other.start
    for leg in plan.legs:
        (x, y, theta), (u, v, phi) = leg.start, leg.end
        assert (theta if leg.kind == "move" else (x, y)) == pytest.approx(
            phi if leg.kind == "move" else (u, v), abs=1e-8
        )
    assert plan.way[-1] == pytest.approx(sum(leg.length for leg in plan.legs))
    along = plan.path
    steps = np.diff(along.poses, axis=0)
    assert np.hypot(*steps[:, :2].T).max() <= STEP * (1 + 1e-6)
    assert np.abs(steps[:, 2]).max() <= TURN_STEP * (1 + 1e-6)
    assert along.length == pytest.approx(plan.way[-1])
    come = plan.way[-1] / 3
    rest = along.beyond(come)
    assert rest.length == pytest.approx(plan.way[-1] - come)
    np.testing.assert_allclose(rest.poses[-1], along.poses[-1])


@settings(deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=60))
def test_way_points_near_a_straight_line_fall_away(wobble: list[float]) -> None:
    x = np.linspace(0.0, 0.06, len(wobble))
    poses = START + np.column_stack([x, 5 * TOLERANCE * np.array(wobble), 0 * x])
    plan = plan_along("wobble", poses, START)
    measured = plan.measured()
    ends = np.array([(leg.start, leg.end) for leg in measured.legs])[:, :, :2]
    away = np.array([distance_to(pose[:2], ends[:, 0], ends[:, 1]).min() for pose in poses])
    assert away.max() <= TOLERANCE + 1e-9
    kept = {tuple(end) for leg in measured.legs for end in (leg.start, leg.end)}
    assert kept <= {tuple(pose) for pose in poses.tolist()}


def test_points_on_a_line_are_one_primitive_unless_every_point_counts() -> None:
    poses = START + np.array([(0, 0, 0), (0.004, 0.0002, 0), (0.01, 0, 0)])
    assert len(plan_along("line", poses, START).legs) == 1
    assert len(plan_along("line", poses, START, tolerance=0.0).legs) == 2


def test_the_way_to_the_first_way_point_is_an_approach() -> None:
    plan = plan_of((-10, 5, 0), (10, 5, 0))
    assert (len(plan.legs), plan.approach) == (2, 1)
    assert plan.measured().legs == plan.legs[1:]
    assert plan_of((20, 0, 0), (20, 0, 0)).approach == 0  # nothing but the way there: it is the path


def test_a_stay_is_at_the_end_and_a_push_goes_nowhere() -> None:
    plan = plan_along("stay", START + np.array([(0, 0, 0), (0.01, 0, 0), (0.01, 0.01, 0)]), START, stay=0.5)
    assert [leg.stay for leg in plan.legs] == [0.0, 0.5]
    press = Plan("press", (CORNER.legs[0], Leg("press", (0.01, 0.0, 0.0), (0.02, 0.0, 0.0), 1.0)))
    assert press.way.tolist() == pytest.approx([0.0, 0.01, 0.01])
    assert press.path.poses[-1] == pytest.approx([0.01, 0.0, 0.0])


@pytest.mark.parametrize(
    ("poses", "text"),
    [
        (np.zeros((0, 3)), r"way-points of shape \(0, 3\); give an array \(N, 3\)"),
        (np.zeros((4, 2)), r"way-points of shape \(4, 2\)"),
        (np.array([(0.0, 0.0, 0.0), (math.nan, 0.0, 0.0)]), r"way-point 2 of bad is \[nan, 0.0, 0.0\]: give finite"),
        (np.tile(START, (3, 1)), "bad goes nowhere: all of its way-points are where the object starts"),
    ],
)
def test_what_cannot_be_planned_is_refused(poses: Array, text: str) -> None:
    with pytest.raises(InputError, match=text):
        plan_along("bad", poses, START)


# One world's way through its plan


def test_a_walk_arrives_and_starts_the_next_from_where_the_object_is() -> None:
    walk = Walk(CORNER, SequenceConfig(), PERIOD)
    assert walk.begin(FIRST) == Request("move", FIRST, (0.01, 0.0, 0.0))
    assert feed(walk, [(0.005, 0.0, 0.0), (0.009, 0.0, 0.0)]) == [None, None]
    assert walk.decide((0.0095, 0.0002, 0.01), touching=True) == Request(
        "move", (0.0095, 0.0002, 0.0), (0.01, 0.01, 0.0)
    )
    assert (walk.leg, mode_of(walk)) == (1, "go")
    assert walk.come((0.01, 0.005, 0.0)) == pytest.approx(0.015)
    assert feed(walk, [(0.01, 0.0099, 0.0)]) == [None]
    assert (walk.leg, walk.mode, walk.ended) == (2, "done", True)
    assert walk.come((0.3, 0.0, 0.0)) == pytest.approx(0.02)
    assert walk.now == CORNER.legs[-1]
    time = walk.time
    assert feed(walk, [FIRST]) == [None]
    assert walk.time == time == pytest.approx(4 * PERIOD)
    assert walk.events == []


def test_a_walk_stays_as_long_as_it_is_told() -> None:
    walk = begun(Plan("stay", (Leg("move", FIRST, (0.01, 0.0, 0.0), 0.5), CORNER.legs[1])))
    end = (0.0099, 0.0, 0.0)
    assert feed(walk, [end] * 25) == [None] * 25
    assert wait(walk, end, most=2).end == (0.01, 0.01, 0.0)
    assert walk.time == pytest.approx(0.52)


def test_a_turn_starts_at_the_angle_that_the_object_has_and_arrives_within_a_degree() -> None:
    end = math.radians(30)
    walk = Walk(Plan("turn", (Leg("turn", FIRST, (0.0, 0.0, end)), CORNER.legs[0])), SequenceConfig(), PERIOD)
    assert walk.begin((0.001, 0.0, 0.02)) == Request("turn", (0.0, 0.0, 0.02), (0.0, 0.0, end))
    assert feed(walk, [(0.001, 0.0, end - math.radians(a)) for a in (20, 10, 2)]) == [None] * 3
    assert walk.come((0.0, 0.0, end / 2)) == pytest.approx(TURN_ARM * end / 2)
    asked = walk.decide((0.001, 0.0, end - math.radians(0.9)), touching=True)
    assert asked is not None
    assert (asked.what, walk.leg) == ("move", 1)


def test_a_push_lasts_its_time_wherever_the_object_is() -> None:
    walk = begun(Plan("press", (Leg("press", FIRST, (0.02, 0.0, 0.0), 2.0), Leg("move", FIRST, (-0.01, 0.0, 0.0)))))
    asked = wait(walk, (0.001, 0.0, 0.0))
    assert walk.time == pytest.approx(2.0, abs=2 * PERIOD)
    assert asked == Request("move", (0.001, 0.0, 0.0), (-0.01, 0.0, 0.0))
    assert walk.events == []


@pytest.mark.parametrize("off", [0.006, 0.02])
def test_a_walk_that_strays_recovers_returns_and_goes_on(off: float) -> None:
    walk = begun()
    aside = (0.004, off, 0.0)
    assert feed(walk, [(0.004, 0.0049, 0.0)]) == [None]
    assert walk.decide(aside, touching=True) == Request("hold", aside, aside)
    (event,) = walk.events
    assert (event.what, event.leg, event.place) == ("left its path", 0, aside[:2])
    assert event.off == pytest.approx(off)
    assert event.time == pytest.approx(2 * PERIOD)
    assert (walk.mode, walk.rested) == ("recover", False)
    assert wait(walk, aside) == Request("move", aside, (0.004, 0.0, 0.0))
    assert mode_of(walk) == "return"
    assert walk.time == pytest.approx(2 * PERIOD + 0.4, abs=1.5 * PERIOD)
    assert feed(walk, [(0.004, share * off, 0.0) for share in (1.0, 0.9, 0.6, 0.2)]) == [None] * 4
    assert walk.decide((0.004, 0.0005, 0.0), touching=True) == Request("move", (0.004, 0.0005, 0.0), (0.01, 0.0, 0.0))
    assert mode_of(walk) == "go"
    feed(walk, [(0.01, 0.0, 0.0), (0.01, 0.01, 0.0)])
    assert mode_of(walk) == "done"
    assert len(walk.events) == 1


def test_a_turned_object_is_turned_back_before_it_is_brought_back() -> None:
    walk = begun()
    turned = (0.004, 0.003, math.radians(-20))
    feed(walk, [turned])
    assert walk.events[0].what == "left its path"
    assert walk.events[0].turned == pytest.approx(math.radians(20))
    assert wait(walk, turned) == Request("turn", turned, (0.004, 0.003, 0.0))
    assert mode_of(walk) == "return"
    assert feed(walk, [(0.004, 0.003, math.radians(a)) for a in (-18, -10, -2)]) == [None] * 3
    straight = (0.004, 0.003, math.radians(-0.5))
    assert walk.decide(straight, touching=True) == Request("move", (0.004, 0.003, 0.0), (0.004, 0.0, 0.0))
    assert walk.decide((0.004, 0.0002, 0.0), touching=True) == Request("move", (0.004, 0.0002, 0.0), (0.01, 0.0, 0.0))
    assert mode_of(walk) == "go"
    assert len(walk.events) == 1


def test_a_turned_object_goes_on_at_once_where_it_is_on_its_line() -> None:
    walk = begun()
    feed(walk, [(0.004, 0.0, math.radians(16))])
    asked = wait(walk, (0.004, 0.0, math.radians(16)))
    assert asked.what == "turn"
    assert asked.end == pytest.approx((0.004, 0.0, 0.0))
    asked = wait(walk, (0.004, 0.0, 0.0))
    assert (walk.mode, asked.end) == ("go", (0.01, 0.0, 0.0))


def test_a_walk_that_has_come_back_by_itself_goes_on_without_a_return() -> None:
    walk = begun()
    feed(walk, [(0.004, 0.006, 0.0)])
    assert wait(walk, (0.005, 0.0001, 0.0)) == Request("move", (0.005, 0.0001, 0.0), (0.01, 0.0, 0.0))
    assert mode_of(walk) == "go"


def test_the_start_noise_is_no_straying() -> None:
    walk = Walk(CORNER, SequenceConfig(), PERIOD)
    walk.begin((-0.004, 0.008, 0.0))
    assert walk.off((0.003, 0.004, 0.0)) == pytest.approx(0.0)
    assert feed(walk, [(0.003, 0.004, 0.0)]) == [None]
    assert walk.events == []


def test_what_comes_no_nearer_is_stuck() -> None:
    walk = begun()
    asked = wait(walk, (0.004, 0.0, 0.0))
    assert asked.what == "hold"
    assert walk.events[0].what == "stuck"
    assert walk.time == pytest.approx(1.0, abs=3 * PERIOD)
    creeping = begun()
    poses = [(0.004 + 0.00002 * k, 0.0, 0.0) for k in range(120)]
    assert feed(creeping, poses) == [None] * 120  # 1 mm a second is enough


def test_a_finger_that_is_off_twice_in_a_row_is_lost() -> None:
    walk = begun()
    at = (0.004, 0.0, 0.0)
    for touching in (False, True, False):
        assert walk.decide(at, touching=touching) is None
    assert walk.decide(at, touching=False) == Request("hold", at, at)
    assert walk.events[0].what == "lost a finger"
    assert wait(walk, at).end == (0.01, 0.0, 0.0)


def test_a_walk_gives_up_after_its_retries_and_says_so() -> None:
    walk = begun(config=SequenceConfig(retries=2))
    aside = (0.004, 0.006, 0.0)
    while not walk.ended:
        walk.decide(aside, touching=True)
    assert mode_of(walk) == "stopped"
    assert [event.what for event in walk.events] == ["left its path", "stuck", "stuck", "gave up"]
    assert feed(walk, [aside]) == [None]


def test_retries_are_counted_for_each_primitive() -> None:
    walk = begun(config=SequenceConfig(retries=1))
    feed(walk, [(0.004, 0.006, 0.0)])
    wait(walk, (0.004, 0.0, 0.0))
    feed(walk, [(0.01, 0.0, 0.0), (0.004, 0.004, 0.0)])
    assert walk.leg == 1
    assert (walk.mode, len(walk.events)) == ("recover", 2)
    feed(walk, [(0.01, 0.004, 0.0)] * 25)
    assert mode_of(walk) == "go"


def test_a_grip_that_ends_stops_the_object_there() -> None:
    walk = Walk(CORNER, SequenceConfig(), PERIOD, limit=0.006)
    assert walk.begin(FIRST).end == pytest.approx((0.006, 0.0, 0.0))
    assert walk.decide((0.0055, 0.0, 0.0), touching=True) == Request("hold", (0.0055, 0.0, 0.0), (0.0055, 0.0, 0.0))
    assert (walk.mode, [event.what for event in walk.events]) == ("stopped", ["grip ends"])
    enough = begun(limit=0.0195)
    feed(enough, [(0.01, 0.0, 0.0), (0.01, 0.0095, 0.0)])
    assert enough.mode == "done"


@settings(deadline=None)
@given(st.lists(st.tuples(points, st.booleans()), max_size=150), st.floats(0.0, 0.03), st.floats(0.1, 3.0))
def test_whatever_happens_a_walk_keeps_its_order(seen: list[tuple[Pose, bool]], limit: float, slow: float) -> None:
    config = SequenceConfig(patience=0.1 * slow, settle=0.05 * slow)
    walk, leg, ended = begun(config=config, limit=limit), 0, False
    for pose, touching in seen:
        asked = walk.decide(pose, touching=touching)
        assert walk.leg >= leg
        assert not ended or (asked is None and walk.ended)
        leg, ended = walk.leg, walk.ended
        assert 0 <= walk.come(pose) <= walk.plan.way[-1] + 1e-12
    assert [event.time for event in walk.events] == sorted(event.time for event in walk.events)
    for number in range(len(CORNER.legs)):
        assert sum(event.leg == number for event in walk.events) <= config.retries + 2
    assert (walk.mode == "stopped") == any(event.what in {"gave up", "grip ends"} for event in walk.events)


# What fits


def test_a_plan_inside_the_reach_fits_and_one_outside_tells_where_it_leaves() -> None:
    inside = plan_of((0, 0, 0), (15, 0, 0), (15, 15, 0))
    found = fit_of(HELD, inside)
    assert (found.fits, found.outside) == (True, ())
    assert found.way == pytest.approx(0.03)
    assert found.grip == pytest.approx(0.03)
    assert reached(HELD, inside)
    outside = plan_of((0, 0, 0), (0, 120, 0), (0, 0, 0))
    found = fit_of(HELD, outside)
    (out,) = limits(*HELD, [next(each for each in TRAIN if each.name == "Out")])
    ((left, back),) = found.outside
    assert not found.fits
    assert not reached(HELD, outside)
    assert left[1] - START[1] == pytest.approx(out.distance, abs=0.002)
    assert back[1] - START[1] == pytest.approx(out.distance, abs=0.005)
    text = str(refusal("spike", found, START, "the largest that fits is 60 mm"))
    high = 1e3 * (left[1] - START[1])
    assert text.startswith(
        f"spike lies outside of what the hand can reach with this object: from (0, {high:.0f}) to (0, "
    )
    assert text.endswith(" (mm from the object's start); the largest that fits is 60 mm")


def test_a_plan_that_no_single_grip_carries_says_how_far_one_does() -> None:
    text = str(refusal("walk", Fit(0.5, (), 0.2), START, "use another"))
    assert text == (
        "walk lies inside the hand's reach, but the best single grip carries the object only 200 of 500 mm along it;"
        " use another"
    )
    out = plan_of((0, 0, 0), (0, 100, 0))
    assert 0.03 < carried(HELD, out) < 0.1
    assert not Fit(0.1, (), carried(HELD, out)).fits


@pytest.mark.parametrize("threshold", [0.0021, 0.03, 0.0777, 0.4])
def test_the_largest_size_is_found_to_a_millimetre(threshold: float) -> None:
    told: list[float] = []
    found = largest(lambda size: size <= threshold, told.append)
    assert threshold - fit.EXACT <= found <= threshold
    assert len(told) == len(set(told)) < 20


def test_what_never_fits_has_no_size_and_what_always_fits_has_an_end() -> None:
    assert largest(lambda _: False) == 0.0
    assert largest(lambda _: True) > fit.LARGEST / 2


# Plans carried out

THREE = (
    plan_of((10, 0, 0), (10, 10, 0)),
    plan_of((0, -15, 0), (0, -15, 10), (10, -15, 10)),
    plan_of((-8, 8, 0)),
)
ASIDE = START + np.array([(0.001, 0.0, 0.0), (-0.001, -0.001, 0.01), (-0.0005, 0.0005, -0.01)])
"""Starts whose grips close in equally many decisions, so that none holds its object longer for the others' sake."""


@pytest.mark.parametrize("controller", ["ik", "rl-privileged"])
def test_worlds_go_through_their_own_plans_whatever_the_others_do(controller: str) -> None:
    together = carry(THREE, controller, ASIDE)
    again = carry(THREE, controller, ASIDE)
    for number, (plan, found, same) in enumerate(zip(THREE, together, again, strict=True)):
        assert found.trial.outcome == REACHED
        assert found.events == ()
        assert found.come == pytest.approx(plan.way[-1])
        assert (np.diff(found.legs) >= 0).all()
        assert found.legs[0] == 0
        assert found.legs[-1] == len(plan.legs)
        rows = found.trial.manipulation
        assert len(found.legs) == rows.stop - rows.start
        end = np.hypot(*(found.trial.object_pose[-1, :2] - plan.legs[-1].end[:2]))
        assert end < 0.001
        assert found.trial.object_pose.tobytes() == same.trial.object_pose.tobytes()
        (alone,) = carry([plan], controller, ASIDE[number : number + 1])
        np.testing.assert_array_equal(alone.legs, found.legs)
        np.testing.assert_allclose(alone.trial.object_pose, found.trial.object_pose, atol=1e-8)
    # They are at different primitives at the same time.
    count = min(len(found.legs) for found in together)
    assert len({tuple(found.legs[:count]) for found in together}) > 1


def test_a_turn_in_a_plan_turns_on_the_spot() -> None:
    (found,) = carry([plan_of((0, 0, 0), (0, 0, 15))])
    trace = trace_of(found)
    assert found.trial.outcome == REACHED
    assert trace.end_deg < 1.0
    assert trace.max_mm < 1.0


def knocking(joints: tuple[float, ...], first: int = 12, last: int = 22) -> type[Sequencer]:
    """Return a sequencer whose targets are moved by angles [rad] in the decisions from `first` to before `last`."""

    class Knocking(Sequencer):
        def act(self, state: State) -> Array:
            targets = super().act(state)
            return np.asarray(targets + np.array(joints) * (first <= len(self.legs) < last))

    return Knocking


KNOCKS = [
    ("rl-privileged", (0.05, 0.0, 0.05, 0.0), ("left its path",)),
    # Which comes first depends on the policy.
    ("rl-privileged", (0.1, 0.0, 0.1, 0.0), ("left its path", "lost a finger")),
    ("rl-privileged", (0.0, 0.15, 0.0, 0.15), ("left its path",)),
    ("ik", (0.0, 0.15, 0.0, 0.15), ("left its path",)),
]


@pytest.mark.parametrize(("controller", "joints", "what"), KNOCKS)
def test_an_object_that_is_knocked_aside_is_brought_back_and_goes_on(
    controller: str, joints: tuple[float, ...], what: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("inhand.tracing.follow.Sequencer", knocking(joints))
    plan = plan_of((15, 0, 0), (15, 15, 0), (-10, 15, 0))
    (found,) = carry([plan], controller)
    assert found.trial.outcome == REACHED
    assert found.events[0].what in what
    assert found.events[0].leg == 0
    assert 0.24 < found.events[0].time < 0.54
    assert len(found.events) <= 2
    trace = trace_of(found)
    assert trace.completion == 1.0
    assert trace.failures == len(found.events)
    assert trace.end_mm < 1.0


def test_a_world_that_strays_again_and_again_gives_up_with_the_object_in_the_hand() -> None:
    config = SequenceConfig(stray=0.0001, retries=1)
    (found,) = follow(HELD, find_controller("ik"), [THREE[0]], START[None], Bench(), config=config)
    assert found.trial.outcome == STOPPED
    assert found.events[-1].what == "gave up"
    assert 0 <= found.come < THREE[0].way[-1]
    assert not trace_of(found).done


# Tasks


@pytest.mark.parametrize("name", ["wall", "key"])
def test_the_expert_does_the_tasks(name: str) -> None:
    config = TraceConfig(path=name, trials=2, seed=3)
    setup = prepare_trace(config)
    assert setup.task is not None
    found, traces = simulate_trace(config, setup)
    assert [trace.done for trace in traces] == [True, True]
    for trace, each in zip(traces, found, strict=True):
        assert trace.failures == 0
        assert (trace.pushed_s is None) == (name == "key")
        assert trace.pushed_s is None or trace.pushed_s >= PUSHED
        assert trace.end_mm < 1.0
        assert trace.turn_deg < 3
        kinds = [leg.kind for leg in each.plan.legs]
        assert kinds == (["move", "press", "move"] if name == "wall" else ["move", "turn", "turn", "move"])


def test_drawn_points_lie_in_their_share_of_the_reach() -> None:
    drawn = draw_points(HELD, 300, np.random.default_rng(0))
    assert drawn.shape == (300, 2)
    longest = max(limit.distance for limit in limits(*HELD, (*TRAIN, *UNSEEN)))
    assert np.hypot(*drawn.T).max() <= SHARE * longest
    assert draw_points(HELD, 300, np.random.default_rng(0)).tobytes() == drawn.tobytes()
    half = draw_points(HELD, 300, np.random.default_rng(0), share=SHARE / 2)
    np.testing.assert_allclose(2 * half, drawn)


@pytest.mark.parametrize("controller", ["ik", "rl-privileged"])
def test_a_tour_visits_its_way_points(controller: str) -> None:
    points = np.column_stack([draw_points(HELD, 8, np.random.default_rng(1)), np.zeros(8)])
    plan = plan_along("tour", START + points, START, tolerance=0.0)
    (found,) = carry([plan], controller)
    assert found.trial.outcome == REACHED
    assert found.events == ()
    path = found.trial.object_pose[found.trial.manipulation, :2]
    for point in START[:2] + points[:, :2]:
        assert np.hypot(*(path - point).T).min() < 0.001


def drawing(*plans: Plan) -> SequenceTask:
    """Return a task that draws these plans in turn, and then the last one for ever."""
    left = list(plans)

    def draw(held: object, rng: np.random.Generator) -> Plan:
        del held, rng
        return left.pop(0) if len(left) > 1 else left[0]

    return SequenceTask("lottery", "draws", draw)


def test_a_task_is_drawn_again_until_a_grip_carries_it(monkeypatch: pytest.MonkeyPatch) -> None:
    good, far = plan_of((0, 10, 0)), plan_of((0, 100, 0))
    monkeypatch.setattr(TASKS, "_added", {"lottery": drawing(far, plan_of((0, 110, 0)), good)})
    told: list[str] = []
    setup = prepare_trace(TraceConfig(path="lottery", trials=1), lambda text, _, __: told.append(text))
    assert setup.plans == (good,)
    assert told == [f"task lottery, trial 1, draw {k}" for k in (1, 2, 3)]
    assert len(told) < DRAWS
    monkeypatch.setattr(TASKS, "_added", {"lottery": drawing(far)})
    with pytest.raises(InputError, match="task lottery, trial 1 lies outside of what the hand can reach") as error:
        prepare_trace(TraceConfig(path="lottery", trials=1))
    assert "another --seed" in str(error.value)


def test_a_seed_gives_the_same_bytes() -> None:
    config = TraceConfig(path="L", size=15, trials=2, seed=5)
    setup = prepare_trace(config)
    one, other = (simulate_trace(config, setup) for _ in range(2))
    assert one[1] == other[1]
    for first, second in zip(one[0], other[0], strict=True):
        for name in ("object_pose", "joint_angles", "targets", "gaps"):
            assert getattr(first.trial, name).tobytes() == getattr(second.trial, name).tobytes()
    assert simulate_trace(replace(config, seed=6), setup)[1] != one[1]


def test_a_walk_that_creeps_is_stuck() -> None:
    """A little nearer at every decision, but by less than counts as a gain in all of its patience."""
    walk = Walk(CORNER, SequenceConfig(), PERIOD)
    walk.begin(FIRST)
    x, y, theta = FIRST
    step = 0.8 * walk.config.gain * PERIOD / walk.config.patience
    asked = [walk.decide((x + k * step, y, theta), touching=True) for k in range(60)]
    assert [event.what for event in walk.events] == ["stuck"]
    assert [each.what for each in asked if each is not None][:1] == ["hold"]
