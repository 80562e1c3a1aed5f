"""Grasps tried out in simulation: how a plan closes on the object, and which of several holds it best.

A search on paper does not know what closing the fingers does: the object turns a little, a contact settles elsewhere.
So the best few grasps of every path are closed in simulated worlds of their own, by the phases of every trial, and
carry the object to where the grip that is measured there is predicted to end. Of those that keep it the one that goes
farthest is taken.

Where the object stands some millimetres off, links of the two fingers can graze each other far along a path that is
free from where it was planned. A path that falls short of what the search promised is given more: grasps close to the
best, and fingers that close a little on the side of the planned start, so that they draw the object there.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inhand.control.controller import Task
from inhand.control.ik import IkConfig, IkController
from inhand.control.loop import Bench, simulate
from inhand.control.phases import Grasp
from inhand.control.trial import REACHED, TIME_OUT
from inhand.geometry import Array, Path, rotate, transform, way_along
from inhand.hands.fit import Held
from inhand.hands.grasp_search import GraspPlan, SearchConfig, moved_along, plan_grasps
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, convex_pieces
from inhand.hands.rolling import Starts, roll
from inhand.sim.names import ENGINE

LOSS = 1.0
"""Way that losing the object costs a grasp [m]: more than any other grasp can gain."""
APPROACH = 5
"""Poses on the way from a path's start to where the object stands."""
PLAN_EVERY = 3
"""Of a path's poses the search looks at one in so many, 3 mm apart: it only compares grasps."""
SHORT = 0.008
"""A grasp that goes less far than was promised by more than this falls short [m]: guessed, twice what the margins of
search and expert take."""
CLOSE, CLOSE_APART = 3, 0.0015
"""Grasps tried where one falls short, and the distance by which a contact of two of them differs [m]."""
DRAWN = (0.0, 0.25, 0.375, 0.5)
"""Shares of the way to the planned start by which fingers are then tried to close short of where the object stands.
Farther than that the object turns too far, or is lost (13 starts of `benchmarks/starts.py`)."""


def closing_joints(
    hand: HandSpec,
    spec: ObjectSpec,
    plans: Sequence[GraspPlan],
    poses: Array,
    starts: Array,
    *,
    squeeze: float = SearchConfig.squeeze,
) -> Grasp:
    """Return the joint angles that stand off the contacts of a plan for each path, and those that press on them.

    Each was planned for a pose `(P, 3)`, from which the fingers roll to where its object stands `(P, 3)`, to aim
    `squeeze` inside it [m].
    """
    held, drawn = Held(hand, spec), np.array([plan.drawn for plan in plans])[:, None]
    opened = _beside(held, plans, (poses, starts), SearchConfig.opening)
    return Grasp(opened, _beside(held, plans, (poses, starts + drawn * (poses - starts)), -squeeze))


def _beside(held: Held, plans: Sequence[GraspPlan], ends: tuple[Array, Array], off: float) -> Array:
    """Return joint angles `(P, n_joints)` [rad] a little off the contacts of plans, or inside the object where below 0.

    The fingers roll from the planned contacts and poses to where the object is, the two ends `(P, 3)`.
    """
    hand, spec = held
    way = ends[0][:, None] + np.linspace(0.0, 1.0, APPROACH)[:, None] * (ends[1] - ends[0])[:, None]
    found = np.empty((len(plans), hand.n_joints))
    for i, (finger, place) in enumerate(zip(hand.fingers, hand.slices, strict=True)):
        contacts = np.stack([plan.contacts[i] for plan in plans])
        planned = Starts(contacts, np.stack([plan.joints[place] for plan in plans]), convex_pieces(spec))
        tracks = roll(hand, finger, planned, way)
        at = np.arange(len(plans)), np.where(tracks.held[:, -1], APPROACH - 1, 0)
        pose = way[at]
        points, normals = transform(pose, tracks.points[at]), rotate(pose[:, 2], tracks.normals[at])
        found[:, place] = moved_along(finger, tracks.joints[at], points, off * normals)
    return found


def best_grasps(
    held: Held,
    poses: Array,
    starts: Array,
    config: tuple[SearchConfig | None, IkConfig | None] = (None, None),
    *,
    engine: str = ENGINE,
) -> list[GraspPlan]:
    """Return for every path the grasp that carries its object farthest in simulation; equal paths are searched once.

    Rehearsals follow every pose of the paths `(P, S, 3)`, as trials do: a grip that ends between two poses of a coarser
    path would end sooner than rehearsed. Objects stand at `starts` `(P, 3)`; `config` has the numbers of the search and
    of the expert.
    """
    search = config[0] or SearchConfig()
    distinct, index = np.unique(poses[:, ::PLAN_EVERY], axis=0, return_inverse=True)
    plans = plan_grasps(*held, distinct, search)
    best, ways = _farthest(held, [plans[k] for k in index], (poses, starts), config[1], engine)
    reaches = [max(plan.reach for plan in group) for group in plans]
    promised = way_along(distinct)[np.arange(len(distinct)), np.array(reaches) - 1]
    short = np.flatnonzero(ways < promised[index] - SHORT)
    if len(short) == 0:
        return best
    wanted, which = np.unique(index[short], return_inverse=True)
    close = plan_grasps(*held, distinct[wanted], replace(search, count=CLOSE, apart=CLOSE_APART))
    groups = [[replace(plan, drawn=share) for share in DRAWN for plan in close[k]] for k in which]
    others, farther = _farthest(held, groups, (poses[short], starts[short]), config[1], engine)
    for k, other, way in zip(short, others, farther, strict=True):
        if way > ways[k]:
            best[k] = other
    return best


def _farthest(
    held: Held, groups: Sequence[Sequence[GraspPlan]], where: tuple[Array, Array], config: IkConfig | None, engine: str
) -> tuple[list[GraspPlan], Array]:
    """Return of each path's grasps the first of those that go farthest, and how far `(P,)` [m], less what is lost."""
    hand, spec = held
    owner = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    each = [plan for group in groups for plan in group]
    poses, starts = (part[owner] for part in where)
    task = Task(hand, (spec,) * len(each), Path(poses - poses[:, :1]))
    expert = IkController(task, config)
    grasp = closing_joints(*held, each, poses[:, 0], starts)
    _, found = simulate(task, grasp, starts, lambda _: expert, Bench(engine))
    value = expert.progress - np.where(np.isin(found.outcomes, (REACHED, TIME_OUT)), 0.0, LOSS)
    best = [int(np.flatnonzero(owner == number)[value[owner == number].argmax()]) for number in range(len(groups))]
    return [each[number] for number in best], value[best]
