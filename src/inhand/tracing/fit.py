"""Whether a plan fits a hand: what lies outside of what the hand can reach, and the largest size that does not.

Two things are asked. The hand's own reach: contacts may slide, whatever controls them (docs/reach.md). And the grip:
the best single grip whose contacts roll, which is what controllers carry an object with.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inhand.control.rehearsal import PLAN_EVERY
from inhand.errors import InputError
from inhand.geometry import Array, interpolate, way_along
from inhand.hands.grasp_search import plan_grasps
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.reach.limits import farthest, reaches
from inhand.tracing.plan import Plan

LOOK = 0.004
"""Spacing at which a path that has left the reach is looked at for where it comes back [m]."""
SMALLEST, LARGEST, EXACT = 0.002, 0.5, 0.001
"""Sizes between which the largest that fits is searched, and how exactly [m]."""

Held = tuple[HandSpec, ObjectSpec]
"""A hand and an object."""


@dataclass(frozen=True, eq=False)
class Fit:
    """What a hand can do of a plan."""

    way: float
    """Length of the plan [m]; a turn counts as an arc."""
    outside: tuple[tuple[Array, Array], ...]
    """Where the plan leaves the hand's reach and comes back to it, or ends: pairs of poses `(3,)`."""
    grip: float
    """Way along the plan that the best single grip carries the object [m]."""

    @property
    def fits(self) -> bool:
        """Whether one grip carries the object along the whole plan."""
        return not self.outside and self.grip >= self.way - 1e-9


def reached(held: Held, plan: Plan) -> bool:
    """Return whether a plan lies inside the hand's reach."""
    return reaches(*held, plan.poses())


def carried(held: Held, plan: Plan) -> float:
    """Return the way along a plan that the best single grip carries the object [m].

    Raises:
        InputError: no grip holds the object at the start.
    """
    poses = plan.poses()
    looked = np.append(np.arange(0, len(poses) - 1, PLAN_EVERY), len(poses) - 1)
    reach = plan_grasps(*held, poses[looked][None])[0][0].reach
    return float(way_along(poses)[looked[reach - 1]])


def fit_of(held: Held, plan: Plan) -> Fit:
    """Return what a hand can do of a plan.

    Raises:
        InputError: no grip holds the object at the start.
    """
    return Fit(float(plan.way[-1]), _outside(held, plan), carried(held, plan))


def largest(
    fits: Callable[[float], bool], progress: Callable[[float], None] | None = None, above: float = SMALLEST
) -> float:
    """Return the largest size that fits [m], or 0 where not even the smallest does.

    Args:
        fits: whether a size [m] does; every size below one that does is taken to do so too.
        progress: told each size before it is tried.
        above: a size known to fit, or the smallest to try.
    """
    low, high = 0.0, above
    while high <= LARGEST and _tried(fits, high, progress):
        low, high = high, 2 * high
    while high - low > EXACT and low > 0:
        middle = (low + high) / 2
        low, high = (middle, high) if _tried(fits, middle, progress) else (low, middle)
    return low


def refusal(name: str, fit: Fit, origin: Array, largest_mm: str) -> InputError:
    """Return the error of a plan that does not fit: which part, and what would."""
    if fit.outside:
        parts = "; ".join(f"from {_place(start, origin)} to {_place(end, origin)}" for start, end in fit.outside)
        why = f"lies outside of what the hand can reach with this object: {parts} (mm from the object's start)"
    else:
        why = (
            f"lies inside the hand's reach, but the best single grip carries the object only {1e3 * fit.grip:.0f} of"
            f" {1e3 * fit.way:.0f} mm along it"
        )
    return InputError(f"{name} {why}; {largest_mm}")


def _tried(fits: Callable[[float], bool], size: float, progress: Callable[[float], None] | None) -> bool:
    if progress is not None:
        progress(size)
    return fits(size)


def _outside(held: Held, plan: Plan) -> tuple[tuple[Array, Array], ...]:
    """Return where a plan leaves the hand's reach and where it comes back: where some grip holds the object again."""
    found: list[tuple[Array, Array]] = []
    rest = plan.poses()
    while True:
        end = farthest(*held, rest)
        way = way_along(rest)
        gone = 0.0 if end is None else end.way
        if gone >= way[-1] - 1e-9:
            return tuple(found)
        left = interpolate(gone, way, rest)
        back = gone + LOOK
        while back < way[-1] and farthest(*held, interpolate(back, way, rest)[None]) is None:
            back += LOOK
        found.append((left, interpolate(min(back, way[-1]), way, rest)))
        if back >= way[-1]:
            return tuple(found)
        rest = np.concatenate([interpolate(back, way, rest)[None], rest[way > back + 1e-9]])


def _place(pose: Array, origin: Array) -> str:
    x, y = 1e3 * (pose[:2] - origin[:2])
    return f"({x:.0f}, {y:.0f})"
