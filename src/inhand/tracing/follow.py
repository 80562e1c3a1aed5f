"""Run plans: place, grasp, and go through a sequence of primitives, one world for each plan."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from inhand.control.catalogue import ControllerEntry, Planner
from inhand.control.controller import Controller, SpatialTask, Task
from inhand.control.ik import IkConfig, IkController
from inhand.control.ik_sensed import SENSED_PRIMITIVE
from inhand.control.loop import Bench, simulate
from inhand.control.recording import cut_trials, passports
from inhand.control.route_policy import RouteController, SensedRouteController
from inhand.control.seen import SENSED
from inhand.control.sensed_plan import ANYWHERE, sensed_grasp
from inhand.control.spatial_catalogue import SpatialEntry
from inhand.control.spatial_trial import SpatialPassport, SpatialTrial
from inhand.control.trial import REACHED, STOPPED, AnyTrial, Passport, Trial
from inhand.geometry import Array, Path
from inhand.hands.fit import Held
from inhand.hands.spatial.fit import SpatialHeld
from inhand.sim.drawn import Disturbed
from inhand.tasks.paths import stacked
from inhand.tasks.spatial.paths import SpatialReference, stacked_paths
from inhand.tracing.plan import Plan
from inhand.tracing.poses import plain, poses_of
from inhand.tracing.sensed import SensedSequencer
from inhand.tracing.sequencer import End, Repertoire, Sequencer
from inhand.tracing.walk import Event, SequenceConfig
from inhand.tracing.ways import from_to

PUSH = 0.8
"""Force of a push against a wall [N]."""
SLOWEST = 0.008
"""Speed below which no plan is waited for [m/s]."""
SPARE = 3.0
"""Time beside that which each primitive may take for retries [s]."""
ARRIVED = 0.001
"""A plan that is followed as a whole is done where the object has come to within this of its end [m]."""


Driver: TypeAlias = Sequencer | SensedSequencer | RouteController | SensedRouteController
"""What takes worlds through plans."""


@dataclass(frozen=True, eq=False)
class Followed:
    """What one world left."""

    plan: Plan
    """Its plan."""
    trial: AnyTrial
    """What was recorded; the outcome is `stopped` where the sequencer gave up."""
    legs: NDArray[np.int64]
    """The primitive of each row of the manipulation phase `(M,)`; the number of all where the plan was done."""
    events: tuple[Event, ...]
    """What went wrong on the way."""
    come: float
    """Way along the plan that the object has come [m]."""


def repertoire_of(entry: ControllerEntry) -> Repertoire:
    """Return what a controller's primitives are carried out by.

    A privileged policy knows straight primitives only, so twists are the expert's, and so is closing the grip after a
    failure; one on real senses does these too. Pushing, where a force is commanded and not a place, is the expert's. On
    real senses its numbers are those of `ik-sensed`.
    """
    sensed, learned = entry.reads == SENSED, entry.policy is not None
    config = SENSED_PRIMITIVE if sensed else IkConfig()
    expert, own = partial(IkController, config=config), entry.primitive or entry.manipulate
    return {
        "move": own,
        "turn": own if sensed or not learned else expert,
        "press": partial(IkController, config=replace(config, push=PUSH)),
        "hold": own if sensed and learned else expert,
    }


def planner_of(entry: ControllerEntry, plans: Sequence[Plan]) -> Planner:
    """Return what chooses the grasps of plans, which are all drawings or all go anywhere."""
    planner = entry.fixed_grasp or entry.grasp
    anywhere = planner is sensed_grasp and all(plan.around for plan in plans)
    return partial(sensed_grasp, carrier=ANYWHERE) if anywhere else planner


def follow(
    held: Held,
    entry: ControllerEntry,
    plans: Sequence[Plan],
    starts: Array,
    bench: Bench,
    *,
    seed: int = 0,
    config: SequenceConfig | None = None,
    disturbed: Sequence[Disturbed] | None = None,
) -> tuple[Followed, ...]:
    """Take one object for each plan through it and return what each world left.

    Plans begin where objects are placed, in the palm frame; really they stand at `starts` `(B, 3)` [m, m, rad]. The
    low-level controller chooses the grasp for the whole plan, and how far to go where it plans that; a policy that was
    trained on a whole task follows it without a sequence. `config` says when primitives have arrived or failed;
    `disturbed` how each world is disturbed.
    """
    hand, spec = held
    poses = stacked([plan.path.poses for plan in plans])
    blind = entry.reads == SENSED
    gripped = stacked([plan.gripped.poses for plan in plans]) if blind else poses
    grasp = planner_of(entry, plans)(hand, spec, gripped, starts, engine=bench.engine)
    way = grasp.way
    if blind and way is not None:
        way = np.array([plan.carried(each) for plan, each in zip(plans, way.tolist(), strict=True)])
    task = Task(hand, (spec,) * len(plans), Path(poses - poses[:, :1]))
    driver = _driver(replace(task, start=poses[:, 0], distance=way), plans, entry, config)
    longest = max(map(_longest, plans))
    _, recording = simulate(task, grasp, starts, lambda _: driver, bench, longest=longest, disturbed=disturbed)
    same = {"hand": hand, "object": spec, "controller": entry.name, "reads": entry.reads, "engine": bench.engine}
    signed = passports(Passport, **same, seed=seed, angle_deg=None, rotation_deg=0.0)
    worlds: Sequence[Disturbed | None] = disturbed or [None] * len(plans)
    found = [
        signed(primitive=plan.name, path=plan.name, trial=number, disturbed=world)
        for number, (plan, world) in enumerate(zip(plans, worlds, strict=True), start=1)
    ]
    trials = cut_trials(Trial, recording, found, task.path.poses)
    return tuple(_followed(plan, trial, driver, k) for k, (plan, trial) in enumerate(zip(plans, trials, strict=True)))


def follow_in_space(
    held: SpatialHeld,
    entry: SpatialEntry,
    plans: Sequence[Plan],
    starts: Array,
    bench: Bench,
    *,
    seed: int = 0,
    disturbed: Sequence[Disturbed] | None = None,
) -> tuple[Followed, ...]:
    """Take one object for each plan through it with a hand in space; objects stand at `starts` `(B, 7)`.

    Each goes as far as its grasp was carried along the whole plan before, in the rehearsal, if there was one.
    """
    (hand, spec, gravity), count = held, len(plans)
    firsts = np.array([plan.legs[0].start for plan in plans])
    ways = [from_to(firsts[k], plan.path.poses) for k, plan in enumerate(plans)]
    names = [f"{plan.name} {plans.index(plan) + 1}" for plan in plans]  # trials of one plan share its grasps
    paths = [SpatialReference(way[:, :3], way[:, 3:], name) for way, name in zip(ways, names, strict=True)]
    pulls = np.tile(gravity, (count, 1))
    grasp = entry.grasp(hand, spec, paths, pulls, starts, bench=bench, fixed=True)
    task = SpatialTask(hand, (spec,) * count, stacked_paths(paths), gravity=pulls)
    parts: Repertoire = {"move": entry.manipulate, "turn": entry.manipulate, "hold": entry.holds}
    driver = Sequencer(replace(task, distance=grasp.way), plans, parts)

    def carry(task: SpatialTask) -> Controller:
        return driver if task.distance is None else entry.manipulate(task)  # who holds the object before it is carried

    longest = max(map(_longest, plans))
    _, recording = simulate(task, grasp, starts, carry, bench, longest=longest, disturbed=disturbed)
    same = {"hand": hand, "object": spec, "controller": entry.name, "reads": entry.reads, "gravity": gravity}
    signed = passports(SpatialPassport, **same, seed=seed, engine=bench.engine, along=None, about=None)
    worlds: Sequence[Disturbed | None] = disturbed or [None] * count
    found = [
        signed(primitive=plan.name, trial=number, disturbed=world)
        for number, (plan, world) in enumerate(zip(plans, worlds, strict=True), start=1)
    ]
    trials = cut_trials(SpatialTrial, recording, found, stacked(ways))
    return tuple(_followed(plan, trial, driver, k) for k, (plan, trial) in enumerate(zip(plans, trials, strict=True)))


def _driver(task: Task, plans: Sequence[Plan], entry: ControllerEntry, config: SequenceConfig | None) -> Driver:
    """Return what takes worlds through plans: a policy of a whole task by itself, all others as a sequence."""
    if entry.policy is not None and entry.policy.task:
        return (SensedRouteController if entry.reads == SENSED else RouteController)(task, entry.policy)
    if entry.reads == SENSED:
        return SensedSequencer(task, plans, repertoire_of(entry), config, remembers=entry.policy is not None)
    return Sequencer(task, plans, repertoire_of(entry), config)


def _followed(plan: Plan, trial: AnyTrial, driver: Driver, world: int) -> Followed:
    """Return what one world left, up to its last row."""
    rows = trial.manipulation
    if rows.stop <= rows.start:
        return Followed(plan, trial, np.zeros(0, dtype=np.int64), (), 0.0)
    sequence, count = driver.sequence if isinstance(driver, SensedSequencer) else driver, rows.stop - rows.start
    if isinstance(sequence, Sequencer):
        last = plain(poses_of(trial.object_pose[-1], space=plan.in_space))
        legs, end = np.array(sequence.legs)[:, world], sequence.end_of(world, count, last)
    else:
        came, whole = np.array(sequence.came)[:, world], float(plan.way[-1])
        legs = np.minimum(np.searchsorted(plan.way, came, side="right"), len(plan.legs)) - 1
        done = bool(came[-1] >= whole - ARRIVED)
        end = End(done, whole if done else float(came[-1]), ())
    if trial.outcome == REACHED and not end.done:
        trial = replace(trial, outcome=STOPPED)
    return Followed(plan, trial, legs[:count], end.events, end.come)


def _longest(plan: Plan) -> float:
    """Return the time after which a plan is not waited for any more [s]."""
    return float(plan.way[-1] / SLOWEST + sum(leg.stay + SPARE for leg in plan.legs))
