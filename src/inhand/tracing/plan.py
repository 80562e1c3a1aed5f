"""Plans: a path in the hand as a sequence of primitives, each along a straight line or a turn on the spot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import SAME, TURN_ARM, Array, Path, distance_to
from inhand.tasks.paths import TURN_STEP

Kind = Literal["move", "turn", "press"]
"""What a primitive does: carry the object straight on, turn it on the spot, or push it on against what resists."""
TOLERANCE = 3e-4
"""How far a plan may leave its path [m]; a turn counts as an arc at `TURN_ARM`."""
STEP = 1e-3
"""Spacing of the poses of a plan [m]."""


@dataclass(frozen=True)
class Leg:
    """One primitive of a plan."""

    kind: Kind
    """What it does."""
    start: tuple[float, float, float]
    """Pose of the object where it is planned to start: x [m], y [m], theta [rad]."""
    end: tuple[float, float, float]
    """Pose where it ends; of a press, where it would end if nothing resisted."""
    stay: float = 0.0
    """Time to hold the object at the end, or to press [s]."""

    @property
    def length(self) -> float:
        """Way of the leg [m]; a turn counts as an arc at `TURN_ARM`, a press goes nowhere."""
        return 0.0 if self.kind == "press" else float(Path(np.array([self.start, self.end])).length)

    def turned(self, theta: float) -> float:
        """Return by how much an angle is out of what the leg allows, signed [rad]."""
        middle, half = (self.start[2] + self.end[2]) / 2, abs(self.end[2] - self.start[2]) / 2
        away = math.remainder(theta - middle, 2 * math.pi)
        return math.copysign(max(abs(away) - half, 0.0), away)


@dataclass(frozen=True, eq=False)
class Plan:
    """A sequence of primitives for one object."""

    name: str
    """What it does."""
    legs: tuple[Leg, ...]
    """The primitives in their order; each starts where the one before it is planned to end."""
    approach: int = 0
    """Number of legs at the beginning that only lead to the path and are not measured."""

    @property
    def way(self) -> Array:
        """Way up to the start of each leg and to the end of the last `(L + 1,)` [m]."""
        return np.concatenate([[0.0], np.cumsum([leg.length for leg in self.legs])])

    @cached_property
    def path(self) -> Path:
        """The object's poses along all legs `(S, 3)`, at most `STEP` or `TURN_STEP` apart."""
        found = [np.array([self.legs[0].start])]
        for leg in self.legs:
            start, end = np.array(leg.start), np.array(leg.end)
            parts = max(leg.length / STEP, abs(end[2] - start[2]) / TURN_STEP)
            if leg.kind != "press":
                shares = np.linspace(0.0, 1.0, max(int(np.ceil(parts - SAME)), 1) + 1)[1:]
                found.append(start + shares[:, None] * (end - start))
        return Path(np.concatenate(found))

    def come(self, number: int, pose: tuple[float, float, float]) -> float:
        """Return the way that an object at a pose has come [m], which is on a leg, or past the last."""
        if number >= len(self.legs):
            return float(self.way[-1])
        leg = self.legs[number]
        here, start, end = (np.array(each) * (1.0, 1.0, TURN_ARM) for each in (pose, leg.start, leg.end))
        come = float((here - start) @ (end - start)) / max(leg.length, SAME)
        return float(self.way[number] + min(max(come, 0.0), leg.length))

    def measured(self) -> Plan:
        """Return the plan without its approach."""
        return Plan(self.name, self.legs[self.approach :])


def plan_along(name: str, poses: Array, start: Array, *, stay: float = 0.0, tolerance: float = TOLERANCE) -> Plan:
    """Return the plan that follows way-points `(N, 3)` from a start pose, and stays at the last for `stay` [s].

    Where two way-points differ in angle the object is turned on the spot first (the order of the Asterisk Test's
    twists), then carried. Way-points that lie within the tolerance [m] of a straight line between others fall away.

    Raises:
        InputError: no way-points, some that are not finite, or all at the start.
    """
    poses = np.asarray(poses, dtype=float)
    if poses.ndim != 2 or poses.shape[1:] != (3,) or len(poses) == 0:
        raise InputError(f"way-points of shape {poses.shape}; give an array (N, 3) of x [m], y [m], theta [rad]")
    if not np.isfinite(poses).all():
        row = int(np.argwhere(~np.isfinite(poses))[0, 0])
        raise InputError(f"way-point {row + 1} of {name} is {poses[row].tolist()}: give finite x, y and theta")
    kept = poses[simplified(poses, tolerance)]
    legs = _legs(np.concatenate([start[None], kept[:1]]))
    approach = len(legs)
    legs += _legs(kept)
    if not legs:
        raise InputError(f"{name} goes nowhere: all of its way-points are where the object starts")
    if stay:
        last = legs[-1]
        legs[-1] = Leg(last.kind, last.start, last.end, stay)
    return Plan(name, tuple(legs), approach if approach < len(legs) else 0)


def simplified(poses: Array, tolerance: float) -> NDArray[np.int64]:
    """Return which way-points `(N, 3)` are kept so that none lies farther than the tolerance [m] from their line.

    Douglas and Peucker's cut: the farthest point from a chord is kept, and both parts are looked at in turn. An angle
    counts as an arc at `TURN_ARM`.
    """
    points = poses * np.array([1.0, 1.0, TURN_ARM])
    keep = np.zeros(len(points), dtype=bool)
    keep[[0, -1]] = True
    parts = [(0, len(points) - 1)]
    while parts:
        first, last = parts.pop()
        between = points[first + 1 : last]
        if len(between) == 0:
            continue
        away = distance_to(between, points[first], points[last])
        farthest = int(away.argmax())
        if away[farthest] > tolerance:
            middle = first + 1 + farthest
            keep[middle] = True
            parts += [(first, middle), (middle, last)]
    return np.flatnonzero(keep)


def _legs(poses: Array) -> list[Leg]:
    """Return the legs through way-points `(N, 3)`: at each, a turn on the spot first, then a move."""
    legs = []
    for here, there in pairwise(poses):
        turned = np.array([here[0], here[1], there[2]])
        if abs(turned[2] - here[2]) > SAME:
            legs.append(Leg("turn", triple(here), triple(turned)))
        if np.hypot(*(there - turned)[:2]) > SAME:
            legs.append(Leg("move", triple(turned), triple(there)))
    return legs


def triple(pose: Array | Sequence[float]) -> tuple[float, float, float]:
    """Return a pose as plain numbers."""
    x, y, theta = (float(value) for value in pose)
    return x, y, theta
