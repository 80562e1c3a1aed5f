"""Run `inhand trace`: a drawing or a task becomes plans, which are checked against the hand's reach and followed."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from inhand.caches import Arrays, cached
from inhand.control.catalogue import ControllerEntry, find_controller
from inhand.control.draws import (
    check_count,
    check_draws,
    check_worlds,
    disturbed_worlds,
    keys_in_space,
    keys_of,
    start_noise,
    start_noise_in_space,
)
from inhand.control.knowing import check_held
from inhand.control.loop import Bench, Told
from inhand.control.seen import SENSED
from inhand.control.spatial_catalogue import SpatialEntry, find_spatial_controller
from inhand.control.spatial_weight import check_carried
from inhand.errors import InputError
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held, check_fit
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import is_spatial_hand, load_solid, load_spatial_hand
from inhand.hands.spatial.fit import SpatialHeld
from inhand.hands.spatial.gravity import USUAL_PALM, gravity_of
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.rotations import pose_from
from inhand.sim.engines import check_engine, engine_in_space
from inhand.sim.walls import Wall
from inhand.tracing.config import TraceConfig
from inhand.tracing.drawing import Drawing, larger_side, scaled
from inhand.tracing.fit import AnyHeld, Carries, carried, check_extent, fit_of, largest, reached, refusal
from inhand.tracing.follow import Followed, follow, follow_in_space, planner_of
from inhand.tracing.named import find_path
from inhand.tracing.plan import TOLERANCE, Plan, plan_along
from inhand.tracing.spatial_tasks import SPATIAL_TASKS
from inhand.tracing.tasks import TASKS, SequenceTask, fitting_plan
from inhand.tracing.trace import Trace, trace_of

SPATIAL_SHARE = 0.5
"""The same in space, where starts a millimetre off cost a grip more: at 0.6 four of twenty letters ended early."""
CLOSE = 1e-4
"""How far a plan in space may leave its drawing [m]."""
SHARE = 0.6
"""Share of the reachable size that a drawing without a size gets."""


@dataclass(frozen=True, eq=False)
class TraceSetup:
    """Everything a run needs, checked before anything is written."""

    held: AnyHeld
    """Which object is in which hand, and in space how gravity pulls."""
    controller: ControllerEntry | SpatialEntry
    """The low-level controller."""
    plans: tuple[Plan, ...]
    """The plan of each trial."""
    task: SequenceTask | None
    """The task, None where a drawing is traced."""
    size: float | None
    """Larger side of the drawing [m], None of a task."""
    notes: tuple[str, ...]
    """What a reader should know, a sentence each."""

    @property
    def hand(self) -> HandSpec | SpatialHand:
        """The hand."""
        return self.held.hand

    @property
    def object(self) -> ObjectSpec | SolidSpec:
        """The object."""
        return self.held.object

    @property
    def wall(self) -> Wall | None:
        """The wall that the object is to be pushed against, if any."""
        task = self.task
        return None if task is None or task.wall is None or isinstance(self.held, SpatialHeld) else task.wall(self.held)


Named: TypeAlias = tuple[AnyHeld, ControllerEntry | SpatialEntry, Drawing | SequenceTask]
"""Hand and object, controller, and what is to be traced or done."""


def check_trace(config: TraceConfig) -> Named:
    """Return all that a run names.

    Raises:
        InputError: a name or a number that no run can have; nothing is searched yet.
    """
    if config.trials < 1:
        raise InputError(f"--trials {config.trials}: give at least one trial")
    check_count(config.trials, f"--trials {config.trials}")
    check_draws(config)
    held, entry = _in_space(config) if is_spatial_hand(config.hand) else _in_the_plane(config)
    space = isinstance(held, SpatialHeld)
    task = SPATIAL_TASKS.get(config.path) if space else TASKS.find(config.path)
    if task is None:
        if config.size is not None and config.size <= 0:
            raise InputError(f"--size {config.size:g}: give a positive size in mm")
        drawing = find_path(config.path, space=space)
        if config.size is not None:
            drawing = scaled(drawing, config.size / 1e3)
        if drawing.sized and not config.scale:
            check_extent(held, drawing)
        return held, entry, drawing
    if config.size is not None or config.scale:
        raise InputError(f"--path {config.path} is a task and has no size: leave --size and --scale out")
    return held, entry, task


def _in_the_plane(config: TraceConfig) -> tuple[Held, ControllerEntry]:
    if config.gravity is not None:
        raise InputError(
            f"--gravity {config.gravity} with {config.hand}, a hand in the plane, whose object stands on a floor: leave"
            " it out, or use a hand in space (3f_60.60_40_10)"
        )
    held = Held(load_hand(config.hand), load_object(config.object))
    entry = find_controller(config.controller, held)
    check_fit(*held)
    check_worlds(config, *held)
    check_engine(config.engine)
    if entry.policy is not None:
        check_held(entry.policy, held.hand, (held.object,))
    return held, entry


def _in_space(config: TraceConfig) -> tuple[SpatialHeld, SpatialEntry]:
    hand, spec = load_spatial_hand(config.hand), load_solid(config.object)
    entry = find_spatial_controller(config.controller)
    if entry.policy is not None or entry.reads == SENSED:
        what = "a policy" if entry.policy is not None else f"{entry.name} there"
        raise InputError(
            f"--controller {config.controller} in a sequence of {config.hand}, a hand in space: {what} knows single"
            " primitives (inhand asterisk); use ik"
        )
    check_carried(hand, spec, config.engine)
    check_worlds(config, hand, spec)
    return SpatialHeld(hand, spec, gravity_of(config.gravity or USUAL_PALM)), entry.whole or entry


def prepare_trace(config: TraceConfig, told: Told | None = None) -> TraceSetup:
    """Return a run's setup; `told` is told how the search for the reachable size goes.

    Raises:
        InputError: anything in the configuration that cannot be run; of a drawing that is too large it says which part
            lies outside of the hand's reach, and the largest that fits.
    """
    held, entry, asked = check_trace(config)
    helped = isinstance(entry, ControllerEntry) and entry.policy is not None and entry.reads != SENSED
    notes = ("The policy moves; twists and recoveries are the expert's (`ik`).",) if helped else ()
    if isinstance(asked, SequenceTask):
        draws = [
            (np.random.default_rng((config.seed, k)), f"task {asked.name}, trial {k + 1}") for k in range(config.trials)
        ]
        carries = _planned(config, entry)
        plans = tuple(fitting_plan(asked, held, rng, name, told=told, carries=carries) for rng, name in draws)
        return TraceSetup(held, entry, plans, asked, None, notes)
    drawing, more = _sized(config, (held, entry), asked, told)
    plan = plan_of(held, drawing)
    return TraceSetup(held, entry, (plan,) * config.trials, None, larger_side(drawing), (*notes, *more))


def plan_of(held: AnyHeld, drawing: Drawing) -> Plan:
    """Return the plan that traces a drawing with a size about the object's start."""
    start = held.start
    tolerance = CLOSE if isinstance(held, SpatialHeld) else TOLERANCE
    return plan_along(drawing.name, start + drawing.poses, start, tolerance=tolerance)


def reachable_size(held: AnyHeld, drawing: Drawing, told: Told | None = None) -> float:
    """Return the largest size of a drawing that lies inside the hand's reach [m]."""
    return _largest("reach", held, drawing, reached, told)


def _largest(what: str, held: AnyHeld, drawing: Drawing, fits: Callable[[Any, Plan], bool], told: Told | None) -> float:
    """Return the largest size of a drawing that fits [m], searched once and kept on disk."""

    def compute() -> Arrays:
        tell = None if told is None else lambda size: told(f"{what} of {drawing.name}, {1e3 * size:.0f} mm", 0, 1)
        return {"size": np.array(largest(lambda size: fits(held, plan_of(held, scaled(drawing, size))), tell))}

    return float(cached("size", (what, held, drawing.poses, drawing.sized), __name__, compute)["size"])


def simulate_trace(
    config: TraceConfig, setup: TraceSetup, progress: Told | None = None
) -> tuple[tuple[Followed, ...], tuple[Trace, ...]]:
    """Follow every plan at once; return what each trial left and reached, in their order."""
    found = _followed(config, setup, progress)
    return found, tuple(trace_of(each, setup.wall) for each in found)


def _followed(config: TraceConfig, setup: TraceSetup, progress: Told | None) -> tuple[Followed, ...]:
    held, entry = setup.held, setup.controller
    if isinstance(held, SpatialHeld) and isinstance(entry, SpatialEntry):
        numbers = range(1, config.trials + 1)
        starts = pose_from(held.hand.start_pose, *start_noise_in_space(config, numbers))
        bench, keys = Bench(engine_in_space(config.engine), progress=progress), keys_in_space(config, numbers)
        worlds = disturbed_worlds(config, keys, held.hand.n_joints, space=True)
        return follow_in_space(held, entry, setup.plans, starts, bench, seed=config.seed, disturbed=worlds)
    if isinstance(held, SpatialHeld) or isinstance(entry, SpatialEntry):
        raise InputError(f"controller {entry.name!r} and hand {held.hand.name!r} are not both of the plane or of space")
    whose = [(None, 0.0, number) for number in range(1, config.trials + 1)]
    starts = held.start + start_noise(config, whose)
    worlds = disturbed_worlds(config, keys_of(config, whose), held.hand.n_joints)
    bench = Bench(config.engine, None if setup.task is None else setup.task.scene(held), progress=progress)
    return follow(held, entry, setup.plans, starts, bench, seed=config.seed, disturbed=worlds)


def _sized(
    config: TraceConfig, by: tuple[AnyHeld, ControllerEntry | SpatialEntry], drawing: Drawing, told: Told | None
) -> tuple[Drawing, tuple[str, ...]]:
    """Return the drawing at the size that is to be traced, and what a reader should know of that."""
    (held, entry), carries = by, _planned(config, by[1])
    if not drawing.sized:
        most = reachable_size(held, drawing, told)
        if most == 0:
            raise InputError(
                f"no size of {drawing.name} lies inside the reach of hand {config.hand!r}; use another hand"
            )
        share = SPATIAL_SHARE if isinstance(held, SpatialHeld) else SHARE
        return scaled(drawing, share * most), (
            f"Size {1e3 * share * most:.0f} mm is {100 * share:.0f} % of the reachable {1e3 * most:.0f} mm.",
        )
    plan = plan_of(held, drawing)
    whole = round(1e3 * float(plan.path.length))

    def followed(way: float) -> None:
        if told is not None:
            told(f"whether {drawing.name} fits, mm", round(1e3 * way), whole)

    fit = fit_of(held, plan, followed, carries)
    if fit.fits:
        return drawing, ()
    what = "grip" if carries is None else f"grip of {entry.name} in {config.engine}"
    if not fit.outside:
        what += " inside the reach"  # as are all smaller sizes then: what takes longest need not be looked at
    fitting = partial(_fits, carries=carries, inside=not fit.outside)
    most = _largest(what, held, drawing, fitting, told)
    if config.scale and most > 0:
        return scaled(drawing, most), (
            f"Scaled from {1e3 * larger_side(drawing):.0f} to {1e3 * most:.0f} mm, the largest that fits.",
        )
    floor = math.floor(1e3 * most)
    fits = f"the largest that fits is {floor} mm: give --size {floor} or less, or --scale"
    none = "and no size of it fits: use another path, hand or object"
    name = f"{drawing.name} of {1e3 * larger_side(drawing):.0f} mm"
    raise refusal(name, fit, held.start, fits if most > 0 else none)


def _fits(held: AnyHeld, plan: Plan, carries: Carries | None, *, inside: bool) -> bool:
    """Return whether a grip carries the object along a whole plan, which may be known to lie `inside` the reach."""
    whole = plan.way[-1] - 1e-9
    if carried(held, plan) < whole or not (inside or reached(held, plan)):
        return False
    return carries is None or carries(held, plan) >= whole


def _planned(config: TraceConfig, entry: ControllerEntry | SpatialEntry) -> Carries | None:
    """Return what gives how far a controller that reads what is sensed plans to carry an object; None of another."""
    if isinstance(entry, SpatialEntry) or entry.reads != SENSED:
        return None

    def carries(held: Held, plan: Plan) -> float:
        poses = plan.gripped.poses[None]
        way = planner_of(entry, [plan])(*held, poses, poses[:, 0], engine=config.engine).way
        return float(plan.way[-1]) if way is None else plan.carried(float(way[0]))

    return carries
