"""Grasps tried out in simulation: how a plan closes on the object, and which of several holds it best.

A search on paper does not know what closing the fingers does: the object turns a little, a contact settles elsewhere.
So the best few grasps of every path are closed in simulated worlds of their own, by the phases of every trial, and
carry the object to where the grip that is measured there is predicted to end. Of those that keep it the one that goes
farthest is taken.

No set point passes the end that is predicted for its grip. So the grasp whose end is farthest is carried first, and
another only where it could still be the one that is taken: the choice is that of carrying them all.

Where the object stands some millimetres off, links of the two fingers can graze each other far along a path that is
free from where it was planned. A path that falls short of what the search promised is given more: grasps close to the
best, and fingers that close a little on the side of the planned start, so that they draw the object there.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Task
from inhand.control.ik import IkConfig, IkController
from inhand.control.loop import Bench, Recording, run_episodes, sense, simulate
from inhand.control.phases import Grasp, standard_phases
from inhand.control.trial import REACHED, TIME_OUT
from inhand.geometry import Array, Path, rotate, transform, way_along
from inhand.hands.fit import Held
from inhand.hands.grasp_search import PLAN_EVERY, GraspPlan, SearchConfig, moved_along, plan_grasps
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, convex_pieces
from inhand.hands.rolling import Starts, roll
from inhand.sim.engine import Simulator
from inhand.sim.memory import batches
from inhand.sim.names import ENGINE
from inhand.sim.state import State, select

LOSS = 1.0
"""Way that losing the object costs a grasp [m]: more than any other grasp can gain."""
LEAST, SLOWEST = 8.0, 0.02
"""Time for which objects are carried at least [s], and the speed at which longer paths are followed at least [m/s]."""
APPROACH = 5
"""Poses on the way from a path's start to where the object stands."""
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


def rehearsed(
    held: Held,
    poses: Array,
    starts: Array,
    config: tuple[SearchConfig | None, IkConfig | None] = (None, None),
    *,
    engine: str = ENGINE,
    fixed: bool = False,
) -> tuple[list[GraspPlan], Array]:
    """Return for every path the grasp that carries its object farthest in simulation, and how far `(P,)` [m].

    Equal paths are searched once. What is lost counts as far less.

    Rehearsals follow every pose of the paths `(P, S, 3)`, as trials do: a grip that ends between two poses of a coarser
    path would end sooner than rehearsed. Objects stand at `starts` `(P, 3)`; `config` has the numbers of the search and
    of the expert. Paths count from where objects are when they are held, or, `fixed`, stay where they are.
    """
    search = config[0] or SearchConfig()
    distinct, index = np.unique(poses[:, ::PLAN_EVERY], axis=0, return_inverse=True)
    plans = plan_grasps(*held, distinct, search)
    best, ways = farthest(held, [plans[k] for k in index], (poses, starts), (config[1], fixed), engine)
    reaches = [max(plan.reach for plan in group) for group in plans]
    promised = way_along(distinct)[np.arange(len(distinct)), np.array(reaches) - 1]
    short = np.flatnonzero(ways < promised[index] - SHORT)
    if len(short) == 0:
        return best, ways
    wanted, which = np.unique(index[short], return_inverse=True)
    close = plan_grasps(*held, distinct[wanted], replace(search, count=CLOSE, apart=CLOSE_APART))
    groups = [[replace(plan, drawn=share) for share in DRAWN for plan in close[k]] for k in which]
    others, farther = farthest(held, groups, (poses[short], starts[short]), (config[1], fixed), engine)
    for k, other, way in zip(short, others, farther, strict=True):
        if way > ways[k]:
            best[k], ways[k] = other, way
    return best, ways


def farthest(
    held: Held,
    groups: Sequence[Sequence[GraspPlan]],
    where: tuple[Array, Array],
    how: tuple[IkConfig | None, bool],
    engine: str,
) -> tuple[list[GraspPlan], Array]:
    """Return of each path's grasps the first of those that go farthest, and how far `(P,)` [m], less what is lost."""
    parts = [
        _farthest_together(held, groups[part], (where[0][part], where[1][part]), how, engine)
        for part in batches(engine, [len(group) for group in groups])
    ]
    return [plan for plans, _ in parts for plan in plans], np.concatenate([ways for _, ways in parts])


def _farthest_together(
    held: Held,
    groups: Sequence[Sequence[GraspPlan]],
    where: tuple[Array, Array],
    how: tuple[IkConfig | None, bool],
    engine: str,
) -> tuple[list[GraspPlan], Array]:
    (hand, spec), (config, fixed) = held, how
    owner = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    each = [plan for group in groups for plan in group]
    poses, starts = (part[owner] for part in where)
    task = Task(hand, (spec,) * len(each), Path(poses - poses[:, :1]), start=poses[:, 0] if fixed else None)
    simulator, closed = simulate(task, closing_joints(*held, each, poses[:, 0], starts), starts, None, Bench(engine))
    gripped, expert = closed.states[-1], IkController(task, config)
    expert.begin(sense(gripped))
    task = replace(task, distance=expert.limit)
    # What a grasp is worth is known where it holds nothing, and else is not more than where its set point stops.
    worth = np.where(np.array(closed.outcomes) == REACHED, -np.inf, -LOSS)
    best = first_best(worth, expert.limit, owner, lambda worlds: carried(simulator, task, gripped, worlds, config))
    return [each[number] for number in best], worth[best]


def first_best(
    worth: Array, most: Array, owner: NDArray[np.int64], find: Callable[[NDArray[np.int64]], Array]
) -> list[int]:
    """Return of each owner's grasps the first of those that are worth most; find out only what that depends on.

    The one with the farthest bound is looked at first, then, where others could be worth more, twice as many at a
    time: a few in one batch take hardly longer than one.

    Args:
        worth: of each grasp `(N,)`, minus infinity where it is not known, which is filled in.
        most: what it is worth at most `(N,)`.
        owner: whose it is `(N,)`, counted from 0.
        find: gives what some grasps are worth, by number.
    """
    mine = [np.flatnonzero(owner == number) for number in range(owner[-1] + 1)]
    at_once = 1
    while True:
        best = [int(of[worth[of].argmax()]) for of in mine]
        asked = list[int]()
        for of, leading in zip(mine, best, strict=True):
            bound = np.where(np.isneginf(worth[of]), most[of], -np.inf)
            ahead = (bound > worth[leading]) | ((bound == worth[leading]) & (of < leading))
            order = np.argsort(np.where(ahead, -bound, np.inf), kind="stable")
            asked += of[order[: min(at_once, ahead.sum())]].tolist()
        if not asked:
            return best
        worth[asked] = find(np.array(asked))
        at_once *= 2


class _Carrier:
    """The expert in some worlds of a batch."""

    def __init__(self, task: Task, worlds: NDArray[np.int64], config: IkConfig | None) -> None:
        distance = None if task.distance is None else task.distance[worlds]
        objects = tuple(task.objects[world] for world in worlds)
        start = None if task.start is None else task.start[worlds]
        part = replace(task, objects=objects, path=Path(task.path.poses[worlds]), distance=distance, start=start)
        self._expert, self._worlds = IkController(part, config), worlds
        self.ways = [np.zeros(len(worlds))]
        """How far the set points had come after every decision, the start first."""

    def begin(self, state: State) -> None:
        self._expert.begin(select(state, self._worlds))

    def act(self, state: State) -> Array:
        targets = state.targets.copy()
        targets[self._worlds] = self._expert.act(select(state, self._worlds))
        self.ways.append(self._expert.progress)
        return targets

    def finished(self, state: State) -> NDArray[np.bool_]:
        done = np.ones(state.n_worlds, dtype=bool)
        done[self._worlds] = self._expert.finished(select(state, self._worlds))
        return done


def carried(
    simulator: Simulator, task: Task, gripped: State, worlds: NDArray[np.int64], config: IkConfig | None
) -> Array:
    """Return how far the expert carries objects that are gripped in some worlds, less what is lost [m]."""
    found, ways = carry(simulator, task, gripped, worlds, config)
    kept = np.isin(np.array(found.outcomes)[worlds], (REACHED, TIME_OUT))
    return ways[found.last[worlds], np.arange(len(worlds))] - np.where(kept, 0.0, LOSS)


def carry(
    simulator: Simulator, task: Task, gripped: State, worlds: NDArray[np.int64], config: IkConfig | None
) -> tuple[Recording, Array]:
    """Return what comes of objects that the expert carries in some worlds `(K,)`, and the ways of its set points.

    They are after each decision `(T, K)` [m], at the start first.
    """
    carrier = _Carrier(task, worlds, config)
    farthest = 0.0 if task.distance is None else float(task.distance[worlds].max(initial=0.0))
    longest = max(LEAST, farthest / SLOWEST)
    phases = standard_phases(Grasp(gripped.targets, gripped.targets), lambda _: carrier, longest=longest)[-1:]
    here = np.isin(np.arange(task.n_worlds), worlds)
    return run_episodes(simulator, task, phases, gripped, worlds=here), np.stack(carrier.ways)
