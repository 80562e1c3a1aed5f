"""Grips that go on where their contacts slide: carried in simulation until they are lost, and told to stop before that.

Where hardly anything but fingertips holds an object the force at each lies on the line between the two contacts. The
search (`hands/grasp_search.py`) ends a grip where that line comes to the edge of a friction cone. What happens there is
no loss: the finger slides along the face the way that it pushes, so that the line becomes steeper again, and stays at
the edge while the object is carried on. How far that goes depends on all contacts at once, and the expert's law never
holds a contact to its place. So grips are looked for whose lines leave the cones, and each is carried from several
starts, as much off the plan as trials' are, to the end of what the fingers can follow. One that is lost there, or not
straight, is carried again to a little before. Paths that turn the object are left to contacts that do not slide.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inhand.caches import cached
from inhand.control.controller import Task
from inhand.control.ik import IkConfig, IkController
from inhand.control.loop import Bench, sense, simulate
from inhand.control.rehearsal import carry, closing_joints
from inhand.control.trial import REACHED, TIME_OUT
from inhand.geometry import Array, Path, way_along, wrap_angle
from inhand.hands.fit import Held
from inhand.hands.grasp_search import PLAN_EVERY, GraspPlan, SearchConfig, plan_grasps
from inhand.sim.engine import Simulator
from inhand.sim.memory import batches
from inhand.sim.state import State

CONES = (1.3, 1.8)
"""Shares of the friction coefficient that grips are searched for, as if their contacts stayed where they are,"""
COUNT = 3
"""and how many of each for a path."""
STARTS, SPREAD = 6, (0.001, 0.001, float(np.deg2rad(1.0)))
"""From how many starts each is carried, and how far off the plan these are, standard deviations [m, m, rad]."""
GAIN = 0.004
"""They have to go farther than a grip that does not slide by more than this [m]: it is surer."""
TRIES, AGAIN, SPARE = 4, 2, 0.004
"""How often grips of a path are carried, the best so many after the first time, and how far before where they were lost
or crooked they are then to stop [m]."""
ACROSS, TURNED = 0.002, float(np.deg2rad(5.0))
"""An object that is farther off its line [m] or turned by more [rad] is not carried straight."""
KEPT = 0.001
"""Distance kept from the end to which all were carried [m]."""


def sliding_grasps(
    held: Held, poses: Array, found: tuple[list[GraspPlan], Array], engine: str
) -> tuple[list[GraspPlan], Array]:
    """Return the grasp of each path and how far it is to go `(P,)` [m], NaN for as far as contacts do not slide.

    Args:
        held: the hand and the object.
        poses: paths `(P, S, 3)`.
        found: the best grasps whose contacts do not slide, and how far they carried the objects `(P,)` [m].
        engine: in which they are tried.
    """
    best, told = list(found[0]), np.full(len(poses), np.nan)
    straight = np.flatnonzero((poses[..., 2] == poses[:, :1, 2]).all(axis=1))
    if len(straight) == 0:
        return best, told
    distinct, index = np.unique(poses[straight], axis=0, return_inverse=True)
    searched, promised = _candidates(held, distinct)
    asked = (*held, distinct, engine)
    ways = cached("sliding", asked, __name__, partial(_tried, held, searched, (distinct, promised), engine))
    for path, k in zip(straight.tolist(), index, strict=True):
        if ways["way"][k] > found[1][path] + GAIN:
            best[path], told[path] = searched[k][int(ways["which"][k])], ways["way"][k] - KEPT
    return best, told


def _candidates(held: Held, poses: Array) -> tuple[list[list[GraspPlan]], Array]:
    """Return grasps of each path `(P, S, 3)`, and how far one is promised to go whose contacts stay `(P,)` [m]."""
    looked, way = poses[:, ::PLAN_EVERY], way_along(poses)[:, ::PLAN_EVERY]
    surest = plan_grasps(*held, looked)
    promised = np.array([way[k, max(plan.reach for plan in plans) - 1] for k, plans in enumerate(surest)])
    known: list[dict[bytes, GraspPlan]] = [{} for _ in poses]
    for cone in CONES:
        for k, plans in enumerate(plan_grasps(*held, looked, SearchConfig(cone=cone, count=COUNT))):
            farther = [plan for plan in plans if way[k, plan.reach - 1] > promised[k] + GAIN]
            known[k] |= {plan.contacts.tobytes(): plan for plan in farther}
    return [list(plans.values()) for plans in known], promised


def _tried(held: Held, groups: list[list[GraspPlan]], paths: tuple[Array, Array], engine: str) -> dict[str, Array]:
    """Return the number of the best grasp of each path and how far it carries from every start [m]."""
    way, which = np.zeros((2, len(groups)))
    for part in batches(engine, [STARTS * len(group) for group in groups]):
        ends = _carried(held, groups[part], (paths[0][part], paths[1][part]), engine)
        way[part] = [own.max(initial=0.0) for own in ends]
        which[part] = [own.argmax() if len(own) else 0 for own in ends]
    return {"way": way, "which": which}


def _carried(held: Held, groups: Sequence[Sequence[GraspPlan]], paths: tuple[Array, Array], engine: str) -> list[Array]:
    """Return how far each of the paths' grasps carries its object straight from all starts [m].

    It is 0 where that is no farther than so much of each path `(P,)` [m], which come with these.
    """
    plans, owner = [plan for group in groups for plan in group], np.repeat(np.arange(len(groups)), [*map(len, groups)])
    if not plans:
        return [np.zeros(0)] * len(groups)
    off = SPREAD * np.random.default_rng(0).standard_normal((STARTS, 3))
    each = [plan for plan in plans for _ in range(STARTS)]
    poses = np.repeat(paths[0][owner], STARTS, axis=0)
    starts = poses[:, 0] + np.tile(off, (len(plans), 1))
    task = Task(held.hand, (held.object,) * len(each), Path(poses - poses[:, :1]))
    simulator, closed = simulate(task, closing_joints(*held, each, poses[:, 0], starts), starts, None, Bench(engine))
    gripped, kept = closed.states[-1], simulator.snapshot()
    expert = IkController(task, IkConfig(friction_share=CONES[-1]))
    expert.begin(sense(gripped))
    left = (np.array(closed.outcomes) == REACHED).reshape(-1, STARTS).all(axis=1)
    end, come = expert.limit.reshape(-1, STARTS).min(axis=1), np.zeros(len(plans))
    for number in range(TRIES):
        least = np.maximum(paths[1], [come[owner == k].max(initial=0.0) for k in range(len(groups))])
        left &= end > least[owner] + GAIN
        chosen = np.flatnonzero(left & (_rank(np.where(left, end, 0.0), owner) < (AGAIN if number else len(plans))))
        if len(chosen) == 0:
            break
        worlds = (STARTS * chosen[:, None] + np.arange(STARTS)).ravel()
        simulator.restore(worlds, kept, worlds)
        asked = replace(task, distance=np.repeat(end, STARTS))
        straight, whole = (part.reshape(-1, STARTS) for part in _straight(simulator, asked, gripped, worlds))
        done = whole.all(axis=1)
        come[chosen[done]] = end[chosen[done]]
        left[chosen[done]] = False
        end[chosen] = straight.min(axis=1) - SPARE
    return np.split(come, np.cumsum([len(group) for group in groups])[:-1])


def _rank(ends: Array, owner: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many others of the same owner have farther ends, or as far ones before `(N,)`."""
    farther = (ends[None] > ends[:, None]) | ((ends[None] == ends[:, None]) & (np.tri(len(ends), k=-1) > 0))
    return np.asarray((farther & (owner[None] == owner[:, None])).sum(axis=1))


def _straight(
    simulator: Simulator, task: Task, gripped: State, worlds: NDArray[np.int64]
) -> tuple[Array, NDArray[np.bool_]]:
    """Return how far set points had come when objects were lost or no longer straight, and which never were `(K,)`."""
    found, ways = carry(simulator, task, gripped, worlds, None)
    moved = np.stack([state.pose[worlds] for state in found.states]) - gripped.pose[worlds]
    x, y = np.moveaxis(task.path.poses[worlds, -1, :2], -1, 0) / task.path.length[worlds]
    off = np.abs(moved[..., 1] * x - moved[..., 0] * y) > ACROSS
    off |= np.abs(wrap_angle(moved[..., 2])) > TURNED
    last, rows = found.last[worlds], np.arange(len(worlds))
    first = np.where(off.any(axis=0), off.argmax(axis=0), len(off))
    kept = np.isin(np.array(found.outcomes)[worlds], (REACHED, TIME_OUT))
    return ways[np.minimum(last, first), rows], kept & (first > last)
