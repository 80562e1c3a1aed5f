"""Tasks beyond paths: plans drawn for a hand and an object, what surrounds them, and when they are done."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.hands.fit import Held
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, polygon
from inhand.registry import Registry, describe
from inhand.sim.scene import SceneSpec
from inhand.sim.walls import Wall
from inhand.tasks.primitives import TRAIN, UNSEEN
from inhand.tasks.reach import limits
from inhand.tracing.drawing import scaled
from inhand.tracing.drawings import find_drawing
from inhand.tracing.fit import AnyHeld, Carries, Fit, check_extent, fit_of, refusal
from inhand.tracing.plan import Leg, Plan, plan_along
from inhand.tracing.poses import plain

SHARE = 0.5
"""Share of the hand's reach in which goals and way-points are drawn."""
TOUR, EDGE = 50, 72
"""Way-points of the tour, and of the line round all places that they are drawn from."""
TURNS = np.deg2rad(15.0)
"""Largest angle of a goal pose [rad]."""
KEY_WAY, KEY_TURN = 0.020, float(np.deg2rad(30.0))
"""How far the key is moved out [m], and how far it is turned there [rad]."""
WALL_WAY, WALL_BEFORE, WALL_BEYOND = 0.025, 0.001, 0.004
"""How far the wall stands in front of the object's face, where the push begins before it, and how far beyond the push
aims [m]."""
WALL_STAY, POSE_STAY, KEY_STAY = 1.5, 1.0, 0.5
"""Times for which the object is pushed against the wall, held at a goal pose and held turned [s]."""

DRAWS = 10
"""Plans of a task that are drawn, until one grip carries the object through."""


@dataclass(frozen=True)
class SequenceTask:
    """Something to do that is more than a path."""

    name: str
    """What the command line calls it."""
    summary: str
    """One sentence for lists."""
    plan: Callable[[Any, np.random.Generator], Plan]
    """Draws a plan, in the palm frame, for an object at its start."""
    wall: Callable[[Held], Wall] | None = None
    """What stands in the way."""

    def scene(self, held: Held) -> SceneSpec:
        """Return what surrounds the hand and the object."""
        return SceneSpec(walls=() if self.wall is None else (self.wall(held),))


def draw_points(held: Held, count: int, rng: np.random.Generator, share: float = SHARE) -> Array:
    """Return positions `(count, 2)` [m] from the object's start, spread evenly over a share of the hand's reach."""
    angles, reach = edge(held)
    points = np.empty((0, 2))
    while len(points) < count:
        drawn = reach.max() * rng.uniform(-1.0, 1.0, (4 * count, 2))
        limit = np.interp(np.arctan2(drawn[:, 1], drawn[:, 0]), angles, reach, period=2 * np.pi)
        points = np.concatenate([points, drawn[np.linalg.norm(drawn, axis=1) < limit]])
    return share * points[:count]


def edge(held: Held) -> tuple[Array, Array]:
    """Return the angles of the 16 directions from 0 on [rad], and how far the hand reaches in each `(16,)` [m]."""
    found = sorted((each.primitive.angle % (2 * np.pi), each.distance) for each in limits(*held, (*TRAIN, *UNSEEN)))
    angles, reach = np.array(found).T
    return angles, reach


def _goal(held: Held, rng: np.random.Generator, most: float = 0.0) -> Plan:
    place = draw_points(held, 1, rng)[0]
    goal, start = np.append(place, rng.uniform(-most, most) if most else 0.0), held.start
    return plan_along("pose" if most else "place", np.stack([start, start + goal]), start, stay=POSE_STAY)


def _tour(held: Held, rng: np.random.Generator) -> Plan:
    points = np.column_stack([draw_points(held, TOUR, rng), np.zeros(TOUR)])
    angles = np.linspace(0.0, 2 * np.pi, EDGE + 1)
    reach = SHARE * np.interp(angles, *edge(held), period=2 * np.pi)
    corners = reach[:, None] * np.stack([np.cos(angles), np.sin(angles), np.zeros(EDGE + 1)], axis=-1)
    around = plan_along("around", held.start + np.concatenate([corners, np.zeros((1, 3))]), held.start)
    return replace(plan_along("tour", held.start + points, held.start, tolerance=0.0), around=around.legs)


def _key(held: Held, rng: np.random.Generator) -> Plan:
    del rng
    start = held.start
    out, turned = (start + np.array([0.0, KEY_WAY, angle]) for angle in (0.0, KEY_TURN))
    first, turn, *rest = plan_along("key", np.stack([start, out, turned, out, start]), start).legs
    return Plan("key", (first, replace(turn, stay=KEY_STAY), *rest))


def _wall(held: Held, rng: np.random.Generator) -> Plan:
    del rng
    start, out = held.start, np.array([0.0, 1.0, 0.0])
    near, beyond = start + (WALL_WAY - WALL_BEFORE) * out, start + (WALL_WAY + WALL_BEYOND) * out
    there, back = (plan_along("wall", np.stack(ends), ends[0]).legs for ends in ((start, near), (near, start)))
    return Plan("wall", (*there, Leg("press", there[0].end, plain(beyond), WALL_STAY), *back))


def the_wall(held: Held) -> Wall:
    """Return the wall of the task `wall`: in front of the object, no wider than it, so that no finger meets it."""
    corners = polygon(held.object)
    x, y = held.start[:2] + np.array([0.0, corners[:, 1].max() + WALL_WAY])
    return Wall((float(x), float(y)), -90.0, length=0.6 * float(np.ptp(corners[:, 0])))


@dataclass(frozen=True)
class OwnTask:
    """A user's way-points, and how long the object is held at the last."""

    points: Callable[[HandSpec, ObjectSpec, np.random.Generator], Array]
    """Draws way-points `(N, 3)` from the object's start [m, m, rad]."""
    stay: float = 0.0
    """Time to hold the object at the last [s]."""


def _task(name: str, given: object) -> SequenceTask:
    """Return the task of a user's way-points; raise InputError where there are none."""
    if isinstance(given, SequenceTask):
        return given
    own = given if isinstance(given, OwnTask) else OwnTask(given) if callable(given) else None
    if own is None or not callable(own.points) or isinstance(own.points, type):
        raise InputError(
            f"task {name!r} is {describe(getattr(given, 'points', given))}: it must be a function of hand, object and"
            " random generator that gives way-points (N, 3) from the object's start [m, m, rad]"
        )

    def plan(held: Held, rng: np.random.Generator) -> Plan:
        points = np.asarray(own.points(*held, rng), dtype=float)
        if points.ndim != 2 or points.shape[1] != 3:
            raise InputError(f"task {name!r} gives {points.shape}: it must give way-points (N, 3) [m, m, rad]")
        return plan_along(name, held.start + points, held.start, stay=own.stay)

    return SequenceTask(name, "a user's", plan)


TASKS: Registry[SequenceTask] = Registry(
    "task",
    {
        task.name: task
        for task in (
            SequenceTask("pose", "go to a drawn pose and hold it for a second", partial(_goal, most=TURNS)),
            SequenceTask("place", "go to a drawn place without turning and hold the object there for a second", _goal),
            SequenceTask("tour", "visit fifty drawn way-points without letting go", _tour),
            SequenceTask("wall", "move out to a wall, push against it, and come back", _wall, the_wall),
            SequenceTask("key", "move out, turn by 30 deg, turn back, and return", _key),
        )
    },
    _task,
)
"""Tasks by name."""


def find_task(text: str) -> SequenceTask:
    """Return the task that a text names: one of `TASKS`, or a drawing with its size in mm, as `square:60`.

    Raises:
        InputError: there is none of that name, or the size is no positive number.
    """
    known = TASKS.find(text)
    if known is not None:
        return known
    name, colon, size = text.rpartition(":")
    if not colon:
        raise InputError(
            f"unknown task {text!r}{near_matches(text, TASKS)}; allowed are {', '.join(TASKS)} and a drawing with its"
            " size in mm, as square:60"
        )
    try:
        drawing = scaled(find_drawing(name), float(size) / 1e3)
    except ValueError as error:
        raise InputError(f"task {text!r}: {size!r} is no size; give millimetres, as square:60") from error

    def plan(held: Held, rng: np.random.Generator) -> Plan:
        del rng
        check_extent(held, drawing)
        return plan_along(text, held.start + drawing.poses, held.start)

    return SequenceTask(text, f"trace a {drawing.name} of {size} mm", plan)


def fitting_plan(
    task: SequenceTask,
    held: AnyHeld,
    rng: np.random.Generator,
    name: str,
    *,
    told: Callable[[str, int, int], None] | None = None,
    carries: Carries | None = None,
) -> Plan:
    """Return the first drawn plan of a task that a single grip carries the object through; errors call it by a name.

    `told` is told which draw is looked at, how many were, and how many will be at most; `carries` gives how far a
    controller does.

    Raises:
        InputError: none of `DRAWS` plans fits; the text says which part of the last lies outside.
    """
    drawn: list[Plan] = []
    while len(drawn) < DRAWS:
        if told is not None:
            told(f"{name}, draw {len(drawn) + 1}", len(drawn), DRAWS)
        drawn.append(task.plan(held, rng))
        fit = _fit(held, drawn[-1].legs, drawn[-1].around, carries)
        if fit.fits:
            return drawn[-1]
        if len(drawn) > 1 and drawn[-1].legs == drawn[-2].legs:
            break
    raise refusal(name, fit, held.start, "use a hand with a longer reach, another object or another --seed")


@lru_cache(maxsize=128)
def _fit(held: AnyHeld, legs: tuple[Leg, ...], around: tuple[Leg, ...], carries: Carries | None) -> Fit:
    """Return what a hand can do of a plan; the same plan of another trial is free."""
    return fit_of(held, Plan("task", legs, around=around), carries=carries)
