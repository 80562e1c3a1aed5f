"""Plans: a path in the hand as a sequence of primitives, each along a straight line or a turn on the spot."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import SAME, Array, Path, distance_to
from inhand.tasks.paths import TURN_STEP
from inhand.tracing.poses import Pose, apart, arms, between, nearest_rotation, places, plain, turned_beyond

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
    start: Pose
    """Pose of the object where it is planned to start: x [m], y [m], theta [rad]; or that in space."""
    end: Pose
    """Pose where it ends; of a press, where it would end if nothing resisted."""
    stay: float = 0.0
    """Time to hold the object at the end, or to press [s]."""

    @property
    def length(self) -> float:
        """Way of the leg [m]; a turn counts as an arc at `TURN_ARM`, a press goes nowhere."""
        return 0.0 if self.kind == "press" else float(Path(np.array([self.start, self.end])).length)

    def allowed(self, pose: Pose) -> Pose:
        """Return the rotation that the leg has on its way and that is nearest to a pose's [rad]."""
        return nearest_rotation(self.start, self.end, pose)

    def turned(self, pose: Pose) -> float:
        """Return by how much a pose is turned out of what the leg allows [rad]."""
        return turned_beyond(self.start, self.end, pose)


@dataclass(frozen=True, eq=False)
class Plan:
    """A sequence of primitives for one object."""

    name: str
    """What it does."""
    legs: tuple[Leg, ...]
    """The primitives in their order; each starts where the one before it is planned to end."""
    approach: int = 0
    """Number of legs at the beginning that only lead to the path and are not measured."""
    around: tuple[Leg, ...] = ()
    """A way from its start round all places that it can go to: contacts that roll stand where the object's pose has
    them, however it came there, so a grasp that goes round goes anywhere within. Empty where none is known."""

    @property
    def in_space(self) -> bool:
        """Whether its poses are those of space."""
        return len(self.legs[0].start) > 3

    @property
    def way(self) -> Array:
        """Way up to the start of each leg and to the end of the last `(L + 1,)` [m]."""
        return np.concatenate([[0.0], np.cumsum([leg.length for leg in self.legs])])

    @cached_property
    def path(self) -> Path:
        """The object's poses along all legs `(S, k)`, at most `STEP` or `TURN_STEP` apart."""
        found = [np.array([self.legs[0].start])]
        for leg in self.legs:
            parts = max(leg.length / STEP, apart(leg.start, leg.end) / TURN_STEP)
            if leg.kind != "press":
                shares = np.linspace(0.0, 1.0, max(int(np.ceil(parts - SAME)), 1) + 1)[1:]
                found.append(between(leg.start, leg.end, shares))
        return Path(np.concatenate(found))

    @property
    def gripped(self) -> Path:
        """The poses `(S, k)` along which its grasp is chosen, where nobody looks: round its places, or its path."""
        return Plan(self.name, self.around).path if self.around else self.path

    def carried(self, way: float) -> float:
        """Return the way along the plan up to which a grasp is trusted that goes so far along those poses [m]."""
        return way * float(self.way[-1] / self.gripped.length) if self.around else way

    def come(self, number: int, pose: Pose) -> float:
        """Return the way that an object at a pose has come [m], which is on a leg, or past the last."""
        if number >= len(self.legs):
            return float(self.way[-1])
        leg = self.legs[number]
        here, start, end = (np.array(each) * arms(len(each)) for each in (pose, leg.start, leg.end))
        come = float((here - start) @ (end - start)) / max(leg.length, SAME)
        return float(self.way[number] + min(max(come, 0.0), leg.length))

    def measured(self) -> Plan:
        """Return the plan without its approach."""
        return Plan(self.name, self.legs[self.approach :])


def plan_along(name: str, poses: Array, start: Array, *, stay: float = 0.0, tolerance: float = TOLERANCE) -> Plan:
    """Return the plan that follows way-points `(N, k)` from a start pose `(k,)`, and stays at the last for `stay` [s].

    In the plane way-points are x, y, theta, in space x, y, z and a rotation vector. Where two differ in angle the
    object is turned on the spot first (the order of the Asterisk Test's twists), then carried. Way-points that lie
    within the tolerance [m] of a straight line between others fall away.

    Raises:
        InputError: no way-points, some that are not finite, or all at the start.
    """
    poses = np.asarray(poses, dtype=float)
    if poses.ndim != 2 or poses.shape[1:] != start.shape or len(poses) == 0:
        wanted = "x [m], y [m], theta [rad]" if len(start) == 3 else "x, y, z [m] and a rotation vector [rad]"
        raise InputError(f"way-points of shape {poses.shape}; give an array (N, {len(start)}) of {wanted}")
    if not np.isfinite(poses).all():
        row = int(np.argwhere(~np.isfinite(poses))[0, 0])
        raise InputError(f"way-point {row + 1} of {name} is {poses[row].tolist()}: give finite numbers")
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
    """Return which way-points `(N, k)` are kept so that none lies farther than the tolerance [m] from their line.

    Douglas and Peucker's cut: the farthest point from a chord is kept, and both parts are looked at in turn. An angle
    counts as an arc at `TURN_ARM`.
    """
    points = poses * arms(poses.shape[1])
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
    """Return the legs through way-points `(N, k)`: at each, a turn on the spot first, then a move."""
    legs, first = [], places(poses.shape[1])
    for here, there in pairwise(poses):
        turned = np.concatenate([here[:first], there[first:]])
        if np.abs(turned - here).max() > SAME:
            legs.append(Leg("turn", plain(here), plain(turned)))
        if np.linalg.norm(there - turned) > SAME:
            legs.append(Leg("move", plain(turned), plain(there)))
    return legs
