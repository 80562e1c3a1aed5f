"""Sequences on what a hand can know: what they decide on, what primitives see, and what is planned before."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.path import Path as Edge
from numpy.typing import NDArray

import inhand
from inhand import caches
from inhand.control import sensed_plan
from inhand.control.catalogue import CONTROLLERS, learned, rough_grasp
from inhand.control.controller import Task
from inhand.control.estimator import WAIT
from inhand.control.ik_sensed import SENSED_PRIMITIVE
from inhand.control.loop import Bench
from inhand.control.phases import Grasp
from inhand.control.policy import Policy
from inhand.control.seen import Seen
from inhand.control.sensed_plan import Candidate, Carrier
from inhand.control.trial import LOST_CONTACT, REACHED, STOPPED, Trial
from inhand.errors import InputError
from inhand.geometry import Array, planar, way_along
from inhand.hands.grasp_search import GraspPlan
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.disturbance import FIELD, Camera, Disturbance
from inhand.sim.names import ENGINE
from inhand.sim.state import State
from inhand.tasks.layouts import find_layout
from inhand.tracing import run
from inhand.tracing.config import TraceConfig
from inhand.tracing.follow import follow
from inhand.tracing.plan import plan_along
from inhand.tracing.run import prepare_trace
from inhand.tracing.sequencer import Sequencer
from inhand.tracing.tasks import draw_points, find_task
from test_sequencing import ASIDE, HELD, THREE, plan_of

SEEN = Disturbance("seen", encoders=FIELD.encoders, camera=FIELD.camera, commands=FIELD.commands)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plan in few worlds."""
    monkeypatch.setattr(sensed_plan, "ROUNDS", ((2, 2),))
    monkeypatch.setattr(sensed_plan, "CANDIDATES", 1)


class Watcher:
    """Stays where it is, sees what is sensed, and counts how often it was made."""

    reads = "sensed"
    made = 0

    def __init__(self, task: Task) -> None:
        """Be one more."""
        Watcher.made += 1
        del task

    @staticmethod
    def grasp(
        hand: HandSpec, spec: ObjectSpec, poses: Array, starts: Array | None = None, *, engine: str = ENGINE
    ) -> Grasp:
        """Hold the middle of the sides, good for 60 mm of every path."""
        rough = rough_grasp(hand, spec, poses, starts, engine=engine)
        return Grasp(rough.opened, rough.closed, np.minimum(way_along(poses)[:, -1], 0.06))

    def begin(self, seen: Seen) -> None:
        """Take what is sensed."""
        assert type(seen) is Seen

    def act(self, seen: Seen) -> Array:
        """Hold on."""
        assert type(seen) is Seen
        return seen.targets

    def finished(self, seen: Seen) -> NDArray[np.bool_]:
        """Never end."""
        return np.zeros(seen.n_worlds, dtype=bool)


def test_a_drawing_is_traced_on_noisy_and_late_senses() -> None:
    run = inhand.trace("square", size=24.0, trials=2, controller="ik-sensed", disturb=SEEN)
    for followed, trace in zip(run.followed, run.traces, strict=True):
        assert (trace.outcome, trace.completion, followed.events) == (REACHED, 1.0, ())
        assert followed.trial.passport.reads == "sensed"
        assert trace.rms_mm < 3.0
        assert trace.end_mm < 3.0
        # It waits for frames once, and not again before each primitive.
        poses = followed.trial.object_pose[followed.trial.manipulation, :2][20:]
        moving = np.linalg.norm(poses[10:] - poses[:-10], axis=-1) > 1e-3
        assert moving.mean() > 0.95


def test_a_sequence_decides_on_what_is_believed_and_metrics_on_what_is_true() -> None:
    away = Disturbance("biased", camera=Camera(rate_hz=50.0, bias_mm=4.0))
    run = inhand.trace("square", size=24.0, trials=2, controller="ik-sensed", disturb=away)
    for followed, trace in zip(run.followed, run.traces, strict=True):
        assert isinstance(followed.trial, Trial)
        assert followed.trial.passport.disturbed is not None
        bias = 1e3 * np.array(followed.trial.passport.disturbed.drawn.bias[:2])
        ends = followed.trial.object_pose[-1, :2] - np.array(followed.plan.legs[-1].end[:2])
        assert (trace.outcome, trace.completion) == (REACHED, 1.0)
        assert 1e3 * ends @ -bias / np.linalg.norm(bias) > 1.0  # who sees it too far to the right stops too far left
        assert trace.end_mm > 1.0


def test_primitives_of_a_users_controller_see_what_is_sensed_and_go_as_far_as_was_planned() -> None:
    run = inhand.trace("square", size=10.0, trials=1, controller=Watcher, disturb=SEEN, scale=True)
    (followed,) = run.followed
    assert {event.what for event in followed.events} == {"stuck", "gave up"}
    assert Watcher.made == 4  # once, and three times again


def test_what_a_sensed_controller_does_not_plan_to_carry_is_refused_or_scaled() -> None:
    name = CONTROLLERS.name_of(Watcher)
    refused = r"the best single grip carries the object only 60 of \d+ mm along it; the largest that fits is 12 mm"
    with pytest.raises(InputError, match=refused):
        prepare_trace(TraceConfig(path="square", size=40, controller=name))
    assert prepare_trace(TraceConfig(path="square", size=40, controller="ik")).size == pytest.approx(0.04)
    scaled = prepare_trace(TraceConfig(path="square", size=40, controller=name, scale=True))
    assert scaled.size == pytest.approx(0.012, abs=0.001)
    with pytest.raises(InputError, match=r"task key, trial 1 .* carries the object only 60 of 66 mm along it"):
        prepare_trace(TraceConfig(path="key", controller=name, trials=1))


def test_a_tour_is_gripped_for_all_places_that_it_can_go_to(monkeypatch: pytest.MonkeyPatch) -> None:
    one, other = (find_task("tour").plan(HELD, np.random.default_rng(seed)) for seed in (0, 1))
    np.testing.assert_array_equal(one.gripped.poses, other.gripped.poses)
    assert one.gripped.length < one.path.length / 5
    edge = Edge(1.01 * (one.gripped.poses - HELD.start)[:, :2])
    assert edge.contains_points(draw_points(HELD, 100, np.random.default_rng(0))).all()
    way, entry = float(one.way[-1]), CONTROLLERS[CONTROLLERS.name_of(Watcher)]
    rest = 0.06 / float(one.gripped.length)
    carries = vars(run)["_planned"](TraceConfig(path="tour"), entry)
    assert carries(HELD, one) == pytest.approx(rest * way)  # what is not trusted to go round is not to go anywhere
    gone: list[Task] = []
    monkeypatch.setattr("inhand.tracing.follow.SensedSequencer", lambda task, *_, **__: gone.append(task))
    with pytest.raises(AttributeError):
        follow(HELD, entry, [one], ASIDE[:1], Bench())
    assert gone[0].distance == pytest.approx([rest * way])


def test_a_tour_is_held_well_inside_what_friction_carries_as_its_primitives_carry(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = list[tuple[list[float], object]]()

    def tried(_held: object, _paths: object, left: list[Candidate], by: Carrier, _draws: range) -> list[Candidate]:
        asked.append(([each.reach for each in left], getattr(by.make, "keywords", {}).get("config")))
        raise InputError("enough")

    found = [Candidate(0, GraspPlan(np.zeros((2, 2)), np.zeros((2, 2)), np.zeros(4), 1), reach) for reach in (0.4, 0.5)]
    monkeypatch.setattr(sensed_plan, "candidates", lambda *_: (found, np.array([0.5])))
    monkeypatch.setattr(sensed_plan, "_tried", tried)
    monkeypatch.setenv(caches.PLACE, "off")
    for plan in (find_task("tour").plan(HELD, np.random.default_rng(0)), THREE[0]):
        with pytest.raises(InputError, match="enough"):
            follow(HELD, CONTROLLERS["ik-sensed"], [plan], ASIDE[:1], Bench())
    assert asked == [([0.5], SENSED_PRIMITIVE), ([0.4, 0.5], None)]


def test_a_policy_of_a_whole_task_on_senses_is_asked_from_where_it_believes_the_object() -> None:
    told = list[Array]()

    class Listens(Policy):
        def __call__(self, observation: Array) -> Array:
            told.append(observation[0, :4])
            return np.zeros((len(observation), HELD.hand.n_joints))

    weights = np.zeros((find_layout("senses").size(HELD.hand), HELD.hand.n_joints))
    policy = Listens((weights,), (np.zeros(HELD.hand.n_joints),), "senses", "fine", "sensed", {"task": "walk"})
    (found,) = follow(HELD, learned("whole", policy), [THREE[0]], ASIDE[:1], Bench())
    assert (found.trial.passport.reads, found.trial.outcome) == ("sensed", STOPPED)
    assert found.come < 0.002
    waits = round(WAIT / 0.02)
    assert all(each[3] == 0 for each in told[: waits - 1])
    assert all(each[3] > 0 for each in told[waits + 1 :])
    way = np.array(THREE[0].legs[0].end[:2]) - THREE[0].legs[0].start[:2]
    assert told[-1][:2] @ way > 0.9 * np.linalg.norm(way)


def test_a_learned_policy_carries_out_every_primitive_itself_and_waits_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Grasp and way are planned with what can carry a drawing, which bends."""
    told = list[Array]()

    class Listens(Policy):
        def __call__(self, observation: Array) -> Array:
            told.append(observation[:, :4])
            return np.zeros((len(observation), HELD.hand.n_joints))

    weights = np.zeros((find_layout("senses").size(HELD.hand), HELD.hand.n_joints))
    policy = Listens((weights,), (np.zeros(HELD.hand.n_joints),), "senses", "fine", "sensed", {})
    monkeypatch.setattr("inhand.tracing.follow.IkController", lambda *_: pytest.fail("the expert was asked"))
    turns = plan_along("turns", np.stack([HELD.start, HELD.start + np.array([0.0, 0.0, 0.2])]), HELD.start)
    moves, turned = follow(HELD, learned("student", policy), [THREE[0], turns], ASIDE[:2], Bench())
    for found in (moves, turned):
        assert found.trial.passport.reads == "sensed"
        assert {event.what for event in found.events} == {"stuck", "gave up"}  # one that does nothing
    alone = [each[0] for each in told if len(each) == 1]
    assert {-1.0, 0.0, 1.0} >= {float(each[2]) for each in alone} > {0.0}
    waits = round(WAIT / 0.02)
    assert all((each[:, 3] == 0).all() for each in told[:waits])  # it holds while first frames come in
    going = [float(each[3]) for each in alone[:80]]
    assert min(going) > 0.0  # and then no more


def test_nothing_is_told_of_a_world_after_its_object_was_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    made = list[Sequencer]()

    class Dropping(Sequencer):
        def act(self, state: State) -> Array:
            targets = super().act(state)
            made[:] = [self]
            for finger, place in zip(HELD.hand.fingers, HELD.hand.slices, strict=True):
                targets[0, place.start] -= finger.bend * 0.8 * (len(self.legs) > 12)
            return targets

    monkeypatch.setattr("inhand.tracing.follow.Sequencer", Dropping)
    far = plan_of((20, 0, 0), (20, 20, 0), (-20, 20, 0))
    lost, kept = follow(HELD, CONTROLLERS["ik"], [THREE[0], far], ASIDE[:2], Bench())
    assert (lost.trial.outcome, kept.trial.outcome) == (LOST_CONTACT, REACHED)
    rows = lost.trial.manipulation
    assert [event.what for event in lost.events] == ["lost a finger"]
    assert lost.events[-1].time <= (rows.stop - rows.start) * 0.02
    made[0].walks[0].leg += 1  # as it might while the other goes on
    x, y, theta = planar(lost.trial.object_pose[-1]).tolist()
    assert made[0].end_of(0, rows.stop - rows.start, (x, y, theta)).come == lost.come
    (alone,) = follow(HELD, CONTROLLERS["ik"], [THREE[0]], ASIDE[:1], Bench())
    assert alone.events == lost.events
    assert alone.come == pytest.approx(lost.come)
