"""Whether a plan fits a hand: what lies outside of what the hand can reach, and the largest size that does not.

Two things are asked. The hand's own reach: contacts may slide, whatever controls them (docs/reach.md). And the grip:
the best single grip whose contacts roll, which is what controllers carry an object with.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from inhand.caches import Arrays, cached
from inhand.errors import InputError
from inhand.geometry import Array, way_along
from inhand.hands.fit import Held
from inhand.hands.grasp_search import PLAN_EVERY, plan_grasps
from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.objects import polygon
from inhand.hands.reach.limits import farthest, reaches
from inhand.hands.shapes import link_outline
from inhand.hands.spatial.fit import SpatialHeld
from inhand.rotations import SpatialPath
from inhand.tracing.drawing import Drawing, larger_side
from inhand.tracing.plan import Plan
from inhand.tracing.ways import from_to

AnyHeld: TypeAlias = Held | SpatialHeld
"""Which object is in which hand, in the plane or in space."""
Carries: TypeAlias = Callable[[Any, Plan], float]
"""Gives the way along a plan up to which a controller plans to carry the object [m], looking at nothing."""
LOOK = 0.004
"""Spacing at which a path that has left the reach is looked at for where it comes back [m]."""
LONGEST = 20.0
"""Longest way of a drawing [m] (guessed): at 40 mm/s it takes eight minutes."""
SMALLEST, LARGEST, EXACT = 0.002, 0.5, 0.001
"""Sizes between which the largest that fits is searched, and how exactly [m]."""


@dataclass(frozen=True, eq=False)
class Fit:
    """What a hand can do of a plan."""

    way: float
    """Length of the plan [m]; a turn counts as an arc."""
    outside: tuple[tuple[Array, Array], ...]
    """Where the plan leaves the hand's reach and comes back to it, or ends: pairs of poses `(3,)`."""
    grip: float
    """Way along the plan that the best single grip carries the object [m]."""
    looked: bool = True
    """Whether it was looked at what lies outside of the reach."""

    @property
    def fits(self) -> bool:
        """Whether one grip carries the object along the whole plan."""
        return not self.outside and self.grip >= self.way - 1e-9


def check_extent(held: AnyHeld, drawing: Drawing) -> None:
    """Refuse at once a drawing with a size that is farther away than fingers and object are long, and a very long one.

    In space only the latter: the search for a grip soon ends where fingers do.

    Raises:
        InputError: the text says which way-point, how far the hand reaches, and the size that cannot be passed.
    """
    way = float(way_along(drawing.poses)[-1])
    if way > LONGEST:
        raise InputError(
            f"{drawing.name} has a way of {way:,.1f} m, turns counted as arcs; it may have {LONGEST:g} m: leave a part"
            " of it out"
        )
    if isinstance(held, SpatialHeld):
        return
    hand, spec = held
    size, points = larger_side(drawing), drawing.poses[:, :2]
    most = np.array([_longest(hand, finger) for finger in hand.fingers])
    most += np.linalg.norm(polygon(spec), axis=-1).max()
    start = np.array(hand.start_position) - [finger.base for finger in hand.fingers]
    away = np.linalg.norm(points[:, None] + start, axis=-1)
    point, side = np.unravel_index((away - most).argmax(), away.shape)
    if away[point, side] > most[side]:
        fits = math.floor(1e3 * size * _share(points, start, most))
        raise InputError(
            f"{drawing.name} of {1e3 * size:.0f} mm is too large for hand {hand.name!r}: way-point {point + 1} lies"
            f" {1e3 * away[point, side]:.0f} mm from where the {hand.finger_names[side]} finger begins, which with this"
            f" object reaches {1e3 * most[side]:.0f} mm; give --size {fits} or less, or --scale"
        )


def _share(points: Array, start: Array, most: Array) -> float:
    """Return the largest share of points `(N, 2)` at which |start + share point| <= most for every finger."""
    along, square = points @ start.T, (points**2).sum(axis=-1)[:, None]
    room = most**2 - (start**2).sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.nanmin((np.sqrt(along**2 + square * room) - along) / square))


def _longest(hand: HandSpec, finger: FingerSpec) -> float:
    """Return how far from its first joint a finger has a point at all [m]."""
    before = np.concatenate([[0.0], np.cumsum(finger.links)])
    outlines = (link_outline(hand, finger, link) for link in range(len(finger.links)))
    return max(float(d + np.linalg.norm(corners, axis=-1).max()) for d, corners in zip(before, outlines, strict=False))


def reached(held: AnyHeld, plan: Plan) -> bool:
    """Return whether a plan lies inside the hand's reach; in space, whether one grip carries the object along it."""
    if isinstance(held, SpatialHeld):
        return carried(held, plan) >= float(plan.way[-1]) - 1e-9
    return reaches(*held, plan.path.poses)


def carried(held: AnyHeld, plan: Plan) -> float:
    """Return the way along a plan that the best single grip carries the object [m].

    Raises:
        InputError: no grip holds the object at the start.
    """
    if isinstance(held, SpatialHeld):
        return _carried_in_space(held, plan)
    last = len(plan.path.poses) - 1
    looked = np.append(np.arange(0, last, PLAN_EVERY), last)
    reach = plan_grasps(*held, plan.path.poses[looked][None])[0][0].reach
    return float(plan.path.way[looked[reach - 1]])


def _carried_in_space(held: SpatialHeld, plan: Plan) -> float:
    # what looks drawings up imports this file, and a wrong name is to be told at once
    from inhand.control.spatial_rehearsal import search_of
    from inhand.hands.spatial.grasp_search import search_grasps

    (hand, spec, gravity), way = held, from_to(np.array(plan.legs[0].start), plan.path.poses)
    path, pulls = SpatialPath(way[:, :3], way[:, 3:]), np.array([gravity])
    (found,) = search_grasps((hand, spec), hand.start_pose, [path], pulls, config=search_of(spec, pulls))
    if not found:
        raise InputError(
            f"no grasp of {hand.name} holds {spec.name} against its weight for {plan.name}: use a lighter or smaller"
            " object, more friction, or another hand or gravity"
        )
    return float(plan.way[-1] * found[0].way / path.length)


def fit_of(
    held: AnyHeld, plan: Plan, told: Callable[[float], None] = lambda _: None, carries: Carries | None = None
) -> Fit:
    """Return what a hand can do of a plan; `told` is told the way [m] that has been looked at.

    Where a grip carries the object along all of it and something says how far a controller `carries` it, that counts.

    Raises:
        InputError: no grip holds the object at the start.
    """
    if isinstance(held, SpatialHeld):
        return Fit(float(plan.way[-1]), (), carried(held, plan), looked=False)

    def compute() -> Arrays:
        outside = np.array(_outside(held, plan, told)).reshape(-1, 2, 3)
        return {"outside": outside, "grip": np.array(carried(held, plan))}

    known = cached("fit", (held, plan.path.poses), __name__, compute)
    fit = Fit(float(plan.way[-1]), tuple((start, end) for start, end in known["outside"]), float(known["grip"]))
    return replace(fit, grip=carries(held, plan)) if fit.fits and carries is not None else fit


def largest(fits: Callable[[float], bool], progress: Callable[[float], None] | None = None) -> float:
    """Return the largest size that fits [m], or 0 where not even the smallest does; `progress` is told each tried.

    Every size below one that fits is taken to fit too.
    """

    def tried(size: float) -> bool:
        if progress is not None:
            progress(size)
        return fits(size)

    low, high = 0.0, SMALLEST
    while high <= LARGEST and tried(high):
        low, high = high, 2 * high
    while high - low > EXACT and low > 0:
        middle = (low + high) / 2
        low, high = (middle, high) if tried(middle) else (low, middle)
    return low


def refusal(name: str, fit: Fit, origin: Array, largest_mm: str) -> InputError:
    """Return the error of a plan that does not fit: which part, and what would."""
    if fit.outside:
        parts = "; ".join(f"from {_place(start, origin)} to {_place(end, origin)}" for start, end in fit.outside)
        why = f"lies outside of what the hand can reach with this object: {parts} (mm from the object's start)"
    else:
        why = "lies inside the hand's reach, but" if fit.looked else "is too much for one grip:"
        why += f" the best single grip carries the object only {1e3 * fit.grip:.0f} of {1e3 * fit.way:.0f} mm along it"
    return InputError(f"{name} {why}; {largest_mm}")


def _outside(held: Held, plan: Plan, told: Callable[[float], None]) -> tuple[tuple[Array, Array], ...]:
    """Return where a plan leaves the hand's reach and where it comes back: where some grip holds the object again."""
    found: list[tuple[Array, Array]] = []
    rest, before = plan.path, 0.0
    while True:
        end = farthest(*held, rest.poses, told=partial(_further, told, before))
        gone = 0.0 if end is None else end.way
        if gone >= rest.length - 1e-9:
            return tuple(found)
        back = gone + LOOK
        while back < rest.length and farthest(*held, rest.at([back])) is None:
            back += LOOK
        found.append((rest.at(gone), rest.at(back)))
        if back >= rest.length:
            return tuple(found)
        rest, before = rest.beyond(back), before + back


def _further(told: Callable[[float], None], before: float, way: float) -> None:
    told(before + way)


def _place(pose: Array, origin: Array) -> str:
    x, y = 1e3 * (pose[:2] - origin[:2])
    return f"({x:.0f}, {y:.0f})"
