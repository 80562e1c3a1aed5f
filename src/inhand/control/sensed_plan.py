"""Grasps and ways for worlds that are not known: planned before the episode, for a range of frictions and starts.

The contact search gives candidates for several shares of the friction. Each is closed and carried by the controller
itself in worlds drawn from `field`, with all its senses, until it is lost or as far as any candidate is predicted to
reach. How far a path is told to go, and which candidate holds it, is what gains most: way, less a price for every
object that is lost before, and for every one that does not go straight. A hand looks at nothing for that, so it is the
same for every trial of a direction and is kept on disk. How fingers then close follows where the camera sees the
object.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.caches import Arrays
from inhand.control.controller import Task
from inhand.control.grades import DRAWN, ENOUGH, GRADES, Grade, told_way, worth_of
from inhand.control.ik_sensed import SENSED_PRIMITIVE, IkSensedController
from inhand.control.looking import slopes
from inhand.control.loop import Bench, Recording, simulate
from inhand.control.phases import Grasp, graded_grasp
from inhand.control.rehearsal import LEAST, SLOWEST, closing_joints
from inhand.control.shipped_plans import path_keys, plans_of
from inhand.control.trial import REACHED, TIME_OUT
from inhand.control.watched import ASTRAY, Carries, Watched, ways_along
from inhand.geometry import SAME, Array, Path, way_along
from inhand.hands.fit import Held
from inhand.hands.grasp_search import PLAN_EVERY, GraspPlan, SearchConfig, plan_grasps
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.drawn import draw
from inhand.sim.memory import batches
from inhand.sim.names import ENGINE

CONES = ((0.92, 0.82), (0.7, 0.65), (0.5, 0.45), (0.36, 0.36))
"""Shares of the friction on the way and at the start that candidates are searched for: it may be less than is told."""
CANDIDATES = 8
"""Candidates of each search. Paper tells them apart badly: the best of a long way was often the fifth or the eighth."""
ROUNDS = ((32, 4), (12, 8), (5, 24), (2, 96))
"""How many candidates of a path are tried, the best so far, and in how many further worlds."""
SQUEEZE = 0.0035
"""How far inside the object fingers aim when they close [m]: it may be smaller, and joints stand elsewhere."""
LOOKED = 0.7
"""Share of the way by which fingers follow an object that is seen off its plan: a camera has a bias."""
SHIFTS = np.diag([0.002, 0.002, np.deg2rad(2.0)])
"""Poses beside the plan from which it is computed how joints follow [m, m, rad]."""
STAYS, SHARES = 64, (1.0, 0.94)
"""Worlds in which ways are gone to their end, and shares of a planned way among which that of a grade is chosen."""
RISKS, FELT = (0.02, 0.05, 0.1, 0.2, 0.4), 512
"""Risks of which one is not taken beyond the planned way of a path, and worlds in which that is chosen,"""
DARING = (1.0, 5.0, 1.0)
"""where an object lost costs so much in the grade of a camera, the best first: less than where ways are told."""
PATHS = 16
"""Paths that are planned at a time, which bounds memory."""
SEED = 20_000
"""First number of the keys of the worlds that plans are tried in, away from the seeds of runs."""


@dataclass(frozen=True)
class Candidate:
    """A grasp of one of several paths."""

    path: int
    plan: GraspPlan
    reach: float
    """Way that the search promises [m]."""
    ways: tuple[tuple[tuple[float, float], ...], ...] = ()
    """How far it went in each world of each grade that it was tried in, and how far of that straight [m]; negative
    where it never held the object."""


@dataclass(frozen=True)
class Carrier:
    """Who carries objects where grasps are tried, and where."""

    make: Callable[[Any], Carries] = IkSensedController
    """Makes the controller."""
    digest: str = "ik-sensed"
    """What tells it from others."""
    module: str = __name__
    """Module on whose sources, and on those that it imports, what it does depends."""
    shares: tuple[float, ...] = ()
    """Shares of the way that is found to which candidates then carry and hold, of which the best is told: what
    is carried farther may be lost where it is to stay. Without any what is found is told."""
    grades: tuple[Grade, ...] = DRAWN
    """What ways are planned for; of several that a camera can have the usual one is the middle one or, of two, the
    last."""
    apart: bool = False
    """Whether each grade has a grasp of its own; else one serves all, the one whose ways are worth most together."""
    rounds: tuple[tuple[int, int], ...] = ()
    """How many candidates of a path are tried and in how many further worlds; without any as `ROUNDS` says."""
    stays: int = 0
    """Worlds in which ways are gone to their end, to see whether the object stays there; without any `STAYS`;"""
    last: int = 1
    """by so many candidates, of which the best is taken."""
    farthest: bool = False
    """Whether grasps alone are tried that are predicted to reach as far as any: what goes on for long is pushed often,
    and kept only well inside what friction carries."""
    feels: Callable[[Any], Carries] | None = None
    """Makes the controller that goes on beyond planned ways, until a risk that is chosen for each grade stops it."""
    engine: str = ENGINE


ANYWHERE = Carrier(partial(IkSensedController, config=SENSED_PRIMITIVE), "ik-sensed, anywhere", farthest=True)
"""Who tries the grasps of ways among places drawn anywhere, as tours: with the law of a sequence's primitives."""


def graded(carrier: Carrier) -> Carrier:
    """Return the same carrier, for whom a way is planned for each grade of a camera, to where objects stay."""
    return replace(carrier, shares=SHARES, grades=GRADES, last=2)


def sensed_grasp(
    hand: HandSpec,
    spec: ObjectSpec,
    poses: Array,
    starts: Array | None = None,
    carrier: Carrier | None = None,
    *,
    engine: str = ENGINE,
) -> Grasp:
    """Return the grasp of each path of object poses `(P, S, 3)`, with the way that is to be gone by a carrier.

    Where objects really stand is not known: `starts` is not looked at. The grasp follows where they are seen to.
    """
    del starts
    if carrier is not None and carrier.apart:
        each = [replace(carrier, grades=(grade,), apart=False) for grade in carrier.grades]
        return graded_grasp([sensed_grasp(hand, spec, poses, carrier=own, engine=engine) for own in each])
    distinct, index = np.unique(poses, axis=0, return_inverse=True)
    held, by = Held(hand, spec), replace(carrier or Carrier(), engine=engine)
    keys = plan_keys(held, distinct, by)
    plans = plans_of("sensed-plan", keys, by.module, lambda rows: _planned(held, distinct[rows], by), at_once=PATHS)
    return grasp_of(plans, index)


def grasp_of(plans: Arrays, rows: Sequence[int] | NDArray[np.int64]) -> Grasp:
    """Return the grasps of some plans, `(P, ...)` by name, with the ways of each grade where there are several."""
    whole = {name: array[rows] for name, array in plans.items()}
    ways = whole.pop("ways").T
    risks = whole.pop("risks").T if "risks" in whole else [None] * len(ways)
    usual = Grasp(**whole)
    grades = [replace(usual, way=way, risk=risk) for way, risk in zip(ways, risks, strict=True)]
    return graded_grasp(grades) if len(grades) > 1 else grades[0]


def plan_keys(held: Held, poses: Array, by: Carrier) -> list[str]:
    """Return what the plans of paths `(P, S, 3)` are looked up by among those that ship."""
    tried, felt = (by.rounds or ROUNDS, by.stays or STAYS, by.last), () if by.feels is None else (RISKS, FELT, DARING)
    numbers = (*tried, CANDIDATES, CONES, ENOUGH, ASTRAY, SQUEEZE, LOOKED, *felt)
    return path_keys((held.hand, held.object, by.digest, by.engine, by.shares, by.grades, numbers), poses)


def candidates(held: Held, poses: Array) -> tuple[list[Candidate], Array]:
    """Return grasps of paths `(P, S, 3)`, searched for each share of the friction, and farthest reaches `(P,)` [m]."""
    last = poses.shape[1] - 1
    looked = np.append(np.arange(0, last, PLAN_EVERY), last)
    some, way = poses[:, looked], way_along(poses)[:, looked]
    searches = [SearchConfig(cone=cone, start_cone=start, count=CANDIDATES) for cone, start in CONES]
    found = {
        (path, plan.contacts.tobytes()): Candidate(path, plan, float(way[path, plan.reach - 1]))
        for search in searches
        for path, plans in enumerate(plan_grasps(*held, some, search))
        for plan in plans
    }
    reach = np.zeros(len(poses))
    for each in found.values():
        reach[each.path] = max(reach[each.path], each.reach)
    return list(found.values()), reach


def _planned(held: Held, poses: Array, by: Carrier) -> dict[str, Array]:
    """Return opened and closed joints and ways of the best candidate of each path `(P, S, 3)`."""
    left, reach = candidates(held, poses)
    if by.farthest:
        left = [each for each in left if each.reach >= reach[each.path] - SAME]
    whole, first = way_along(poses)[:, -1], 0
    for best, worlds in by.rounds or ROUNDS:
        left = [each for path in range(len(poses)) for each in _best(left, path, whole[path], by)[:best]]
        left = _tried(held, (poses, reach), left, by, range(first, first + worlds))
        first += worlds
    left = [each for path in range(len(poses)) for each in _best(left, path, whole[path], by)[: by.last]]
    each = [_told(candidate, whole[candidate.path], by) for candidate in left]
    told, worth = np.array([ways for ways, _ in each]), np.array([gained for _, gained in each])
    if by.shares:
        draws = range(first, first + (by.stays or STAYS))
        stays = [
            _stayed(held, (poses, ways), left, by, (grade, part_of(grade, draws)))
            for grade, ways in zip(by.grades, told.T, strict=True)
        ]
        told, worth = np.stack([ways for ways, _ in stays], axis=-1), np.sum([gained for _, gained in stays], axis=0)
    paths = np.array([candidate.path for candidate in left])
    chosen = [int(np.where(paths == path, worth, -np.inf).argmax()) for path in range(len(poses))]
    told, left = told[chosen], [left[k] for k in chosen]
    told, seen = told[:, [grade.scatter > 0 for grade in by.grades]], [each for each in by.grades if each.scatter > 0]
    plan = {**_closing(held, left, poses), "way": told[:, told.shape[1] // 2], "ways": told}
    if by.feels is None:
        return plan
    draws = range(first + (by.stays or STAYS), first + (by.stays or STAYS) + FELT)
    risks = [
        _risked(held, (poses, ways), left, by, (replace(grade, price=price), part_of(grade, draws)))
        for grade, price, ways in zip(seen, DARING, told.T, strict=False)
    ]
    return plan | {"risks": np.stack(risks, axis=-1)}


def _told(candidate: Candidate, whole: float, by: Carrier) -> tuple[list[float], float]:
    """Return how far to go at each grade with a candidate of a path, so long in all [m], and what that is worth."""
    each = [told_way(np.array(ways), whole, grade) for ways, grade in zip(candidate.ways, by.grades, strict=True)]
    worth = sum(grade.weight * worth for grade, (_, worth) in zip(by.grades, each, strict=True))
    return [way for way, _ in each], worth


def part_of(grade: Grade, draws: range) -> range:
    """Return the share of the worlds that a grade is tried in."""
    return draws[: math.ceil(grade.share * len(draws))]


def _stayed(
    held: Held, paths: tuple[Array, Array], candidates: list[Candidate], by: Carrier, where: tuple[Grade, range]
) -> tuple[Array, Array]:
    """Return the ways [m] that are worth most of some shares of those found, where objects are to stay, and that worth.

    It counts with the grade's weight. Both are `(N,)` as the candidates, which come with the poses of the paths and the
    ways that were found.
    """
    (poses, told), (grade, draws) = paths, where
    worth, left = np.full((len(by.shares), len(candidates)), -np.inf), np.arange(len(candidates))
    for number, share in enumerate(by.shares):
        tried = [candidates[k] for k in left.tolist()]
        _, spoilt = _judged(held, (poses, share * told[left]), tried, by, where)
        worth[number, left] = worth_of(share * told[left], spoilt, len(draws), grade)
        left = left[spoilt[0] + spoilt[1] > 0]  # of a way on which nothing was lost no part is worth more
        if len(left) == 0:
            break
    return np.array(by.shares)[worth.argmax(axis=0)] * told, grade.weight * worth.max(axis=0)


def _risked(
    held: Held, paths: tuple[Array, Array], candidates: list[Candidate], by: Carrier, where: tuple[Grade, range]
) -> Array:
    """Return the risk that is not taken beyond each path's way `(P,)`: of some, the one that is worth most.

    The poses of the paths come with the ways that were found, and a candidate of each. Turns end where they were
    planned to.
    """
    moving, (grade, draws) = np.flatnonzero((paths[0][:, :1, 2] == paths[0][..., 2]).all(axis=1)), where
    worth, tried = np.zeros((len(RISKS), len(candidates))), [candidates[k] for k in moving]
    for number, risk in enumerate(RISKS if tried else ()):
        going = replace(by, make=partial(_not_taking, by.feels or by.make, risk))
        way, spoilt = _judged(held, (paths[0], paths[1][moving]), tried, going, where)
        worth[number, moving] = worth_of(way, spoilt, len(draws), grade)
    return np.asarray(np.array(RISKS)[worth.argmax(axis=0)])


def _not_taking(feels: Callable[[Any], Carries], risk: float, task: Task) -> Carries:
    return feels(replace(task, risk=np.full(task.n_worlds, risk)))


def _judged(
    held: Held, paths: tuple[Array, Array], candidates: list[Candidate], by: Carrier, where: tuple[Grade, range]
) -> tuple[Array, tuple[Array, Array]]:
    """Return how far candidates came in the mean [m], each to go a way, of how many worlds lost and gone crooked."""
    (poses, _), (grade, draws) = paths, where
    owner = np.repeat([each.path for each in candidates], len(draws))
    found, aimed = _carried(held, paths, candidates, by, where)
    lost = ~np.isin(np.array(found.outcomes), (REACHED, TIME_OUT))
    way, straight = ways_along(found, Path(poses[owner] - poses[owner, :1]), aimed, grade.straight).T
    each = np.stack([np.maximum(way, 0.0), lost, ~lost & (straight < way)]).reshape(3, -1, len(draws))
    return each[0].mean(axis=-1), (each[1].sum(axis=-1), each[2].sum(axis=-1))


def _closing(held: Held, candidates: list[Candidate], poses: Array) -> dict[str, Array]:
    """Return what a `Grasp` has of joints for candidates of paths of poses `(P, S, 3)`, by name."""
    plans, starts = [each.plan for each in candidates], poses[[each.path for each in candidates], 0]
    grasp = closing_joints(*held, plans, starts, starts, squeeze=SQUEEZE)

    def closed(shift: Array) -> Array:
        return closing_joints(*held, plans, starts, starts + shift, squeeze=SQUEEZE).closed

    follows = LOOKED * slopes(closed, SHIFTS)
    return {"opened": grasp.opened, "closed": grasp.closed, "planned": starts, "follows": follows}


def _best(candidates: list[Candidate], path: int, whole: float, by: Carrier) -> list[Candidate]:
    """Return the candidates of a path, so long in all [m], the one that is worth most first."""
    own = [each for each in candidates if each.path == path]
    return sorted(own, key=lambda each: -_told(each, whole, by)[1] if each.ways else 0.0)


def _tried(
    held: Held, paths: tuple[Array, Array], candidates: list[Candidate], by: Carrier, draws: range
) -> list[Candidate]:
    """Return candidates with the ways that they went in further worlds of each grade, the same for all.

    The paths `(P, S, 3)` come with the way up to which each is followed `(P,)` [m].
    """
    parts = batches(by.engine, [len(draws)] * len(candidates))
    return [each for part in parts for each in _tried_together(held, paths, candidates[part], by, draws)]


def _tried_together(
    held: Held, paths: tuple[Array, Array], candidates: list[Candidate], by: Carrier, draws: range
) -> list[Candidate]:
    added = []
    for grade in by.grades:
        own = part_of(grade, draws)
        reach = paths[1][[each.path for each in candidates]]
        found, aimed = _carried(held, (paths[0], reach), candidates, by, (grade, own))
        poses = paths[0][np.repeat([each.path for each in candidates], len(own))]
        ways = ways_along(found, Path(poses - poses[:, :1]), aimed, grade.straight)
        each = ways.reshape(len(candidates), len(own), 2).tolist()
        added.append([tuple((way, straight) for way, straight in rows) for rows in each])
    before = [each.ways or ((),) * len(by.grades) for each in candidates]
    return [
        replace(each, ways=tuple((*old, *new[k]) for old, new in zip(before[k], added, strict=True)))
        for k, each in enumerate(candidates)
    ]


def _carried(
    held: Held, paths: tuple[Array, Array], candidates: list[Candidate], by: Carrier, where: tuple[Grade, range]
) -> tuple[Recording, list[Array]]:
    """Return what came of candidates, each to go a way, in worlds of a grade, and how far each was to be `(B,)` [m]."""
    (poses, ways), (grade, draws) = paths, where
    owner = np.repeat([each.path for each in candidates], len(draws))
    own, starts = poses[owner], poses[owner, 0]
    grasp = Grasp(
        **{name: np.repeat(rows, len(draws), axis=0) for name, rows in _closing(held, candidates, poses).items()}
    )
    worlds = [draw(grade.worlds, (SEED, number), held.hand.n_joints) for _ in candidates for number in draws]
    task = Task(held.hand, (held.object,) * len(owner), Path(own - own[:, :1]), distance=np.repeat(ways, len(draws)))
    watched = list[Watched]()

    def carrying(task: Task) -> Watched:
        watched.append(Watched(by.make(task)))
        return watched[-1]

    longest = max(LEAST, float(ways.max()) / SLOWEST)
    _, found = simulate(task, grasp, starts, carrying, Bench(by.engine), longest=longest, disturbed=worlds)
    return found, watched[0].ways
