"""How well plans were followed: tracking error, completion and time of every world of a run."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.control.trial import LOST, REACHED
from inhand.geometry import Array, Path, distance_to, frechet, longest_run, planar
from inhand.hands.spatial.objects import SolidSpec
from inhand.sim.walls import Wall, clearance
from inhand.tracing.follow import Followed
from inhand.tracing.plan import Plan
from inhand.tracing.poses import apart, arms, place, places, plain, poses_of

POINTS, MOST_POINTS = 300, 1000
"""Points of path and plan between which the Frechet distance is taken: one for each millimetre of the plan, but not
fewer or more than these."""
TOUCHES = 3e-4
"""An object touches a wall where it is nearer than this [m]."""
PUSHED = 1.0
"""Time for which an object must have been pushed against a wall, held by all fingers [s]."""

SAME = 1e-18
"""Squares of lengths below this are none [m^2]."""


@dataclass(frozen=True)
class Trace:
    """What one trial of following a plan reached."""

    trial: int
    outcome: str
    """How it ended."""
    completion: float
    """Share of the plan's way that was come along, after the approach; 1 only where every primitive was done."""
    rms_mm: float
    """Root mean square over the rows of the distance from the planned path [mm]."""
    max_mm: float
    """Largest such distance [mm]."""
    frechet_mm: float
    """Discrete Frechet distance of the path to the plan [mm]; up to half the spacing of its points too long."""
    turn_deg: float
    """Largest angle between object and plan while moving [deg]."""
    end_mm: float
    """Distance of the object from the end of the plan, at the last row [mm],"""
    end_deg: float
    """and its angle from it [deg]."""
    time_s: float
    """Time from the end of the approach to the end [s]."""
    failures: int
    """Primitives that failed and were tried again, or not."""
    force_max_n: float
    """Largest force of a finger on the object in any row of the trial [N]."""
    penetration_max_mm: float
    """Deepest overlap of a link and the object in any row of the trial [mm]."""
    pushed_s: float | None
    """Longest time for which the object was pushed against a wall, held by all fingers [s]; None without a wall."""

    @property
    def dropped(self) -> bool:
        """Whether the object was lost, or never held."""
        return self.outcome in LOST

    @property
    def done(self) -> bool:
        """Whether all that was asked was done."""
        return self.outcome == REACHED and (self.pushed_s is None or self.pushed_s >= PUSHED)


@dataclass(frozen=True, eq=False)
class Deviations:
    """How far the object was from its plan in each of M rows."""

    way: Array
    """Way along the plan, from the end of the approach `(M,)` [m]."""
    off: Array
    """Distance from the planned path `(M,)` [m]: from the primitive under way or the one before."""
    turned: Array
    """Angle between the object and what that primitive allows `(M,)` [rad]."""


def trace_of(followed: Followed, wall: Wall | None = None) -> Trace:
    """Return what one world reached, and of a wall for how long it was pushed against it."""
    plan, trial = followed.plan, followed.trial
    poses, _ = measured_rows(followed)
    rows = deviations(followed)
    off, turned = 1e3 * rows.off, rows.turned
    approach, whole = plan.way[plan.approach], plan.way[-1]
    last, end = plain(poses_of(trial.object_pose[-1], space=plan.in_space)), plan.legs[-1].end
    done = trial.outcome == REACHED
    return Trace(
        trial.passport.trial,
        trial.outcome,
        1.0 if done else float(min(max((followed.come - approach) / (whole - approach), 0.0), 0.999)),
        float(np.sqrt(np.mean(off**2))) if len(off) else np.nan,
        float(off.max(initial=0.0)) if len(off) else np.nan,
        _frechet(poses, plan) if len(off) else np.nan,
        float(np.rad2deg(turned.max(initial=0.0))),
        1e3 * math.dist(place(last), place(end)),
        math.degrees(apart(last, end)),
        len(poses) * trial.passport.period,
        sum(event.what != "gave up" for event in followed.events),
        trial.force_max_n,
        trial.penetration_max_mm,
        None if wall is None else _pushed(followed, wall),
    )


def measured_rows(followed: Followed) -> tuple[Array, NDArray[np.int64]]:
    """Return the object's poses `(M, k)` after the approach [m, rad], and the primitive of each `(M,)`."""
    poses = poses_along(followed)
    count = len(followed.plan.legs)
    measured = (followed.legs >= followed.plan.approach) & (followed.legs < count)
    return poses[measured], followed.legs[measured]


def poses_along(followed: Followed) -> Array:
    """Return the object's poses `(M, k)` in the manipulation phase [m, rad], as its plan has them."""
    trial = followed.trial
    return poses_of(trial.object_pose[trial.manipulation], space=followed.plan.in_space)


def turned_deg(poses: Array) -> Array:
    """Return how far poses `(M, k)` are turned `(M,)` [deg]: counter-clockwise, in space about any axis."""
    if poses.shape[1] > 3:
        return np.asarray(np.rad2deg(np.linalg.norm(poses[:, 3:], axis=-1)))
    return np.asarray(np.rad2deg(np.unwrap(poses[:, 2])))


def deviations(followed: Followed) -> Deviations:
    """Return how far the object was from its plan, row by row after the approach."""
    plan, (poses, legs) = followed.plan, measured_rows(followed)
    ends = _ends(plan)[legs]
    start, end = ends[:, 0], ends[:, 1]
    turned = np.array([plan.legs[leg].turned(plain(pose)) for leg, pose in zip(legs, poses, strict=True)])
    scale = arms(poses.shape[1])
    line, gone = (end - start) * scale, (poses - start) * scale
    share = np.clip((gone * line).sum(axis=-1) / np.maximum((line**2).sum(axis=-1), SAME), 0.0, 1.0)
    way = plan.way[legs] - plan.way[plan.approach] + share * np.diff(plan.way)[legs]
    return Deviations(way, _off(plan, poses, legs), turned)


def _ends(plan: Plan) -> Array:
    """Return where each primitive of a plan starts and ends `(L, 2, k)` [m, rad]."""
    return np.array([(leg.start, leg.end) for leg in plan.legs])


def _off(plan: Plan, poses: Array, legs: NDArray[np.int64]) -> Array:
    """Return the distance `(M,)` [m] from the line of the primitive under way or the one before, whichever is nearer.

    A primitive has arrived a little before its end, and a push ends where something resisted: there the next one
    starts, still on the planned path.
    """
    first = places(poses.shape[1])
    lines = [_ends(plan)[which][..., :first] for which in (legs, np.maximum(legs - 1, plan.approach))]
    return np.minimum(*(distance_to(poses[:, :first], line[:, 0], line[:, 1]) for line in lines))


def _frechet(poses: Array, plan: Plan) -> float:
    """Return the discrete Frechet distance of the positions of poses `(M, k)` to a plan without its approach [mm]."""
    wanted = plan.measured()
    count = int(np.clip(np.ceil(1e3 * wanted.way[-1]), POINTS, MOST_POINTS))
    path, target = (_evenly(points, count) for points in (poses, wanted.path.poses))
    return 1e3 * frechet(path, target)


def _evenly(poses: Array, count: int) -> Array:
    """Return points `(count, 2)`, in space `(count, 3)`, evenly along poses `(M, k)`; standing still counts once."""
    first = places(poses.shape[1])
    line = Path(np.where(np.arange(poses.shape[1]) < first, poses, 0.0))
    return line.at(np.linspace(0.0, line.length, count))[:, :first]


def _pushed(followed: Followed, wall: Wall) -> float:
    """Return the longest time for which the object touched a wall, held by all fingers [s]."""
    trial = followed.trial
    spec = trial.passport.object
    if isinstance(spec, SolidSpec):
        return 0.0
    near = clearance(wall, spec, planar(trial.object_pose)) <= TOUCHES
    return longest_run(near & trial.touching.all(axis=-1)) * trial.passport.period
