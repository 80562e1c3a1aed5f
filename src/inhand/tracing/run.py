"""Run `inhand trace`: a drawing or a task becomes plans, which are checked against the hand's reach and followed."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from inhand.caches import Arrays, cached
from inhand.control.catalogue import ControllerEntry, find_controller
from inhand.control.draws import check_count, check_draws, disturbed_worlds, start_noise
from inhand.control.knowing import check_held
from inhand.control.loop import Bench, Told
from inhand.control.seen import SENSED
from inhand.errors import InputError, near_matches
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held, check_fit
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.engines import check_engine
from inhand.sim.walls import Wall
from inhand.tracing.config import TraceConfig
from inhand.tracing.drawing import Drawing, larger_side, scaled
from inhand.tracing.drawings import SHAPES, find_drawing
from inhand.tracing.fit import Carries, carried, check_extent, fit_of, largest, reached, refusal
from inhand.tracing.follow import Followed, follow
from inhand.tracing.plan import Plan, plan_along
from inhand.tracing.tasks import TASKS, SequenceTask, fitting_plan
from inhand.tracing.trace import Trace, trace_of

SHARE = 0.6
"""Share of the reachable size that a drawing without a size gets."""


@dataclass(frozen=True, eq=False)
class TraceSetup:
    """Everything a run needs, checked before anything is written."""

    hand: HandSpec
    object: ObjectSpec
    controller: ControllerEntry
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
    def wall(self) -> Wall | None:
        """The wall that the object is to be pushed against, if any."""
        task = self.task
        return None if task is None or task.wall is None else task.wall(Held(self.hand, self.object))


def check_trace(config: TraceConfig) -> tuple[Held, ControllerEntry, Drawing | SequenceTask]:
    """Return hand and object, controller, and what is to be traced or done: all that a run names.

    Raises:
        InputError: a name or a number that no run can have; nothing is searched yet.
    """
    if config.trials < 1:
        raise InputError(f"--trials {config.trials}: give at least one trial")
    check_count(config.trials, f"--trials {config.trials}")
    check_draws(config)
    held = Held(load_hand(config.hand), load_object(config.object))
    entry = find_controller(config.controller)
    check_fit(*held)
    check_engine(config.engine)
    if entry.policy is not None:
        check_held(entry.policy, held.hand, (held.object,))
    task = TASKS.find(config.path)
    if task is None:
        if config.size is not None and config.size <= 0:
            raise InputError(f"--size {config.size:g}: give a positive size in mm")
        drawing = find_path(config.path)
        if config.size is not None:
            drawing = scaled(drawing, config.size / 1e3)
        if drawing.sized and not config.scale:
            check_extent(held, drawing)
        return held, entry, drawing
    if config.size is not None or config.scale:
        raise InputError(f"--path {config.path} is a task and has no size: leave --size and --scale out")
    return held, entry, task


def prepare_trace(config: TraceConfig, told: Told | None = None) -> TraceSetup:
    """Return a run's setup; `told` is told how the search for the reachable size goes.

    Raises:
        InputError: anything in the configuration that cannot be run; of a drawing that is too large it says which part
            lies outside of the hand's reach, and the largest that fits.
    """
    held, entry, asked = check_trace(config)
    helped = entry.policy is not None and entry.reads != SENSED
    notes = ("The policy moves; twists and recoveries are the expert's (`ik`).",) if helped else ()
    if isinstance(asked, SequenceTask):
        draws = [
            (np.random.default_rng((config.seed, k)), f"task {asked.name}, trial {k + 1}") for k in range(config.trials)
        ]
        carries = _planned(config, entry)
        plans = tuple(fitting_plan(asked, held, rng, name, told=told, carries=carries) for rng, name in draws)
        return TraceSetup(*held, entry, plans, asked, None, notes)
    drawing, more = _sized(config, (held, entry), asked, told)
    plan = plan_of(held, drawing)
    return TraceSetup(*held, entry, (plan,) * config.trials, None, larger_side(drawing), (*notes, *more))


def find_path(text: str) -> Drawing:
    """Return the drawing that `--path` names.

    Raises:
        InputError: there is none; the text offers near matches, tasks among them.
    """
    try:
        return find_drawing(text)
    except InputError as error:
        near = near_matches(text, (*TASKS, *SHAPES))
        if "unknown drawing" not in str(error):
            raise
        raise InputError(
            f"unknown --path {text!r}{near}; allowed are {', '.join(SHAPES)}, a letter A to Z, an .svg or .csv file,"
            f" and the tasks {', '.join(TASKS)}"
        ) from error


def plan_of(held: Held, drawing: Drawing) -> Plan:
    """Return the plan that traces a drawing with a size about the object's start."""
    start = held.start
    return plan_along(drawing.name, start + drawing.poses, start)


def reachable_size(held: Held, drawing: Drawing, told: Told | None = None) -> float:
    """Return the largest size of a drawing that lies inside the hand's reach [m]."""
    return _largest("reach", held, drawing, reached, told)


def _largest(what: str, held: Held, drawing: Drawing, fits: Callable[[Held, Plan], bool], told: Told | None) -> float:
    """Return the largest size of a drawing that fits [m], searched once and kept on disk."""

    def compute() -> Arrays:
        tell = None if told is None else lambda size: told(f"{what} of {drawing.name}, {1e3 * size:.0f} mm", 0, 1)
        return {"size": np.array(largest(lambda size: fits(held, plan_of(held, scaled(drawing, size))), tell))}

    return float(cached("size", (what, held, drawing.poses, drawing.sized), __name__, compute)["size"])


def simulate_trace(
    config: TraceConfig, setup: TraceSetup, progress: Told | None = None
) -> tuple[tuple[Followed, ...], tuple[Trace, ...]]:
    """Follow every plan at once; return what each trial left and reached, in their order."""
    held = Held(setup.hand, setup.object)
    whose = [(None, 0.0, number) for number in range(1, config.trials + 1)]
    starts = setup.hand.start_pose + start_noise(config, whose)
    worlds = disturbed_worlds(config, whose, setup.hand.n_joints)
    bench = Bench(config.engine, None if setup.task is None else setup.task.scene(held), progress=progress)
    found = follow(held, setup.controller, setup.plans, starts, bench, seed=config.seed, disturbed=worlds)
    return found, tuple(trace_of(each, setup.wall) for each in found)


def _sized(
    config: TraceConfig, by: tuple[Held, ControllerEntry], drawing: Drawing, told: Told | None
) -> tuple[Drawing, tuple[str, ...]]:
    """Return the drawing at the size that is to be traced, and what a reader should know of that."""
    (held, entry), carries = by, _planned(config, by[1])
    if not drawing.sized:
        most = reachable_size(held, drawing, told)
        if most == 0:
            raise InputError(
                f"no size of {drawing.name} lies inside the reach of hand {config.hand!r}; use another hand"
            )
        return scaled(drawing, SHARE * most), (
            f"Size {1e3 * SHARE * most:.0f} mm is {100 * SHARE:.0f} % of the reachable {1e3 * most:.0f} mm.",
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


def _fits(held: Held, plan: Plan, carries: Carries | None, *, inside: bool) -> bool:
    """Return whether a grip carries the object along a whole plan, which may be known to lie `inside` the reach."""
    whole = plan.way[-1] - 1e-9
    if carried(held, plan) < whole or not (inside or reached(held, plan)):
        return False
    return carries is None or carries(held, plan) >= whole


def _planned(config: TraceConfig, entry: ControllerEntry) -> Carries | None:
    """Return what gives how far a controller that reads what is sensed plans to carry an object; None of another."""
    if entry.reads != SENSED:
        return None

    def carries(held: Held, plan: Plan) -> float:
        poses = plan.path.poses[None]
        way = (entry.fixed_grasp or entry.grasp)(*held, poses, poses[:, 0], engine=config.engine).way
        return float(plan.way[-1] if way is None else way[0])

    return carries
