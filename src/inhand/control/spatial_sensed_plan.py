"""Grasps and ways in space for worlds that are not known, planned before the episode as `sensed_plan.py` does.

The grasps of the contact search are closed and carried by the controller itself in worlds drawn from `field`, with all
its senses, until they are lost or as far as they are predicted to reach. Of each path that grasp and that way are taken
which gain most: way, less a price for every object that is lost before, and for every one that does not go straight.
Where a camera sees better or worse than that of `field` the same grasp is told a way of its own.
Where objects really start is not looked at; how fingers close follows where the camera sees the object.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from inhand.caches import Arrays
from inhand.control.controller import SpatialTask
from inhand.control.grades import GRADES, Grade, told_way
from inhand.control.looking import slopes
from inhand.control.loop import Bench, Recording, simulate
from inhand.control.phases import Grasp
from inhand.control.policy import Policy
from inhand.control.sensed_plan import LOOKED, SEED, Carrier, grasp_of, part_of
from inhand.control.shipped_plans import path_keys, plans_of
from inhand.control.spatial_ik_sensed import SENSED_SPATIAL_IK, SOFT, SpatialIkSensedController
from inhand.control.spatial_rehearsal import closed_at, longest_of, search_of, searched
from inhand.control.spatial_sensed_policy import SpatialSensedPolicyController
from inhand.control.watched import ASTRAY, OFTEN, Watched
from inhand.geometry import TURN_ARM, Array
from inhand.hands.spatial.grasp_search import SpatialGrasp, search_grasps
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.rotations import change_between, pose_from
from inhand.sim.disturbance import FIELD
from inhand.sim.drawn import draw
from inhand.tasks.spatial.paths import SpatialReference, hold_path, stacked_paths, whole_spatial_path

ROUNDS = ((6, 3), (3, 12), (1, 72))
"""How many grasps of a path are tried, the best so far, and in how many further worlds."""
SHORT = 0.7
"""Where the best is told to go less than this share of the farthest on paper, grasps of other kinds are tried, too:
those that go farthest there are often alike, and lost or crooked all for one reason, as tips that spin."""
COARSE, APART = 0.012, 0.02
"""They are searched for among first contacts so far apart, and differ by so much at a contact [m]."""
ASIDE = 0.006
"""An object that only turns, by 100 deg and more, counts as straight up to here [m]; 14 deg at `TURN_ARM`."""
SQUEEZE = 0.006
"""How far inside the object fingers aim when they close [m]: it may be smaller, and stand elsewhere than it is seen."""
SHIFTS = np.diag(np.repeat([0.002, np.deg2rad(2.0)], 3))
"""Poses beside the start from which it is computed how joints follow, ways and rotation vectors [m, rad]."""
AHEAD = 0.001
"""How far ahead of the set point it is looked where a path leads [m]."""
PATHS = 8
"""Paths that are planned at a time, which bounds memory."""
ARMS = np.repeat([1.0, TURN_ARM], 3)
Pair = tuple[SpatialHand, SolidSpec]
USUAL = Grade(GRADES[1].scatter, FIELD, price=4.0)
"""What is planned for where objects are seen as in `field`: grasps are chosen for it, and serve the other grades."""
CARRIER = Carrier(SpatialIkSensedController, "ik-sensed", __name__, grades=(GRADES[0], USUAL, GRADES[2]), rounds=ROUNDS)
"""`ik-sensed`, where its grasps are planned."""
DEAR = 6.0
"""Price of an object lost for a policy, which is off its line by more than `ik-sensed` is."""


def carrier_in_space(policy: Policy) -> Carrier:
    """Return who carries objects where grasps are planned for a policy on real senses."""
    made, (best, usual, rough) = partial(SpatialSensedPolicyController, policy=policy), CARRIER.grades
    return replace(CARRIER, make=made, digest=policy.digest, grades=(best, replace(usual, price=DEAR), rough))


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A grasp of one of several paths."""

    path: int
    grasp: SpatialGrasp
    ways: tuple[tuple[float, float], ...] = ()
    """How far it went in each world that it was tried in, and how far of that straight [m]; negative where it never
    held the object."""

    def told(self, by: Carrier) -> tuple[float, float]:
        """Return how far a carrier is to go [m], and what that is worth."""
        return told_way(np.array(self.ways), grade=by.grades[0]) if self.ways else (0.0, self.grasp.value)


def sensed_in_space(
    hand: SpatialHand,
    spec: SolidSpec,
    paths: Sequence[SpatialReference],
    gravity: Array,
    starts: Array,
    *,
    bench: Bench,
    carrier: Carrier | None = None,
    fixed: bool = False,
    shared: bool = False,
) -> Grasp:
    """Return for every path the grasp and the way that are worth most in worlds that nobody knows.

    Raises:
        InputError: no contacts hold the object at its start.
    """
    del starts, fixed, shared
    by, gravities, names = carrier or CARRIER, np.unique(gravity, axis=0), [path.name for path in paths]
    firsts = list({path.name: path for path in reversed(paths)}.values())
    rows = {path.name: row for row, path in enumerate(firsts)}

    silent = replace(bench, progress=None)  # a screen cannot be sent to other processes

    def plan(some: list[int]) -> Arrays:
        return _planned(((hand, spec), by), [firsts[row] for row in some], gravities, silent)

    keys = plan_keys_in_space((hand, spec), firsts, gravities, by)
    plans = plans_of("sensed-plan-in-space", keys, by.module, plan, at_once=PATHS)
    return grasp_of(plans, [rows[name] for name in names])


def plan_keys_in_space(pair: Pair, paths: Sequence[SpatialReference], gravities: Array, by: Carrier) -> list[str]:
    """Return what the plans of paths under gravities `(G, 3)` [m/s^2] are looked up by among those that ship."""
    law, tried = (SENSED_SPATIAL_IK, SOFT, SQUEEZE, LOOKED, ASTRAY), (by.digest, by.grades, by.rounds)
    told = (*pair, gravities, law, tried, SHORT, COARSE, APART, ASIDE)
    both = [(path.hold, np.hstack([path.moves, path.turns])[None]) for path in paths]
    return [path_keys((*told, hold), poses)[0] for hold, poses in both]


def following(hand: SpatialHand, grasps: Sequence[SpatialGrasp]) -> Grasp:
    """Return joint angles of grasps, planned for where the hand starts objects, that follow where they are seen."""
    starts = np.tile(hand.start_pose, (len(grasps), 1))
    grasp = closed_at(hand, grasps, starts, SQUEEZE)

    def closed(shift: Array) -> Array:
        return closed_at(hand, grasps, pose_from(starts, shift[:3], shift[3:]), SQUEEZE).closed

    return replace(grasp, planned=starts, follows=LOOKED * slopes(closed, SHIFTS))


def _planned(who: tuple[Pair, Carrier], paths: Sequence[SpatialReference], gravities: Array, bench: Bench) -> Arrays:
    """Return joints and ways of the best grasp of each path, by their names in `Grasp`, and ways of each grade."""
    held, by = who
    middle = len(by.grades) // 2
    each = [(held, replace(by, grades=(grade,))) for grade in by.grades]
    chosen = _grasped(each[middle], paths, gravities, bench)
    count = sum(worlds for _, worlds in by.rounds)
    ways = np.empty((len(paths), len(each)))
    for number, own in enumerate(each):
        tried, (grade,) = chosen, own[1].grades
        if number != middle:
            draws = part_of(grade, range(count))
            tried = _tried(own, paths, [replace(one, ways=()) for one in chosen], (gravities, draws), bench)
        ways[:, number] = [one.told(own[1])[0] for one in tried]
    ways[:, 0] = np.maximum(ways[:, 0], ways[:, middle])  # fewer worlds, none of which is worse than those of `field`
    grasp = replace(following(held[0], [one.grasp for one in chosen]), way=ways[:, middle])
    return {**{name: rows for name, rows in vars(grasp).items() if rows is not None}, "ways": ways}


def _grasped(
    who: tuple[Pair, Carrier], paths: Sequence[SpatialReference], gravities: Array, bench: Bench
) -> list[_Candidate]:
    """Return the best grasp of each path for the one grade of a carrier, of another kind where the usual come short."""
    held, by = who
    groups = searched(held, paths, gravities, bench)
    chosen = _chosen(who, paths, [groups[path.name] for path in paths], gravities, bench)
    short = [
        number
        for number, (each, path) in enumerate(zip(chosen, paths, strict=True))
        if each.told(by)[0] < SHORT * groups[path.name][0].way
    ]
    others = _of_other_kinds(held, [paths[number] for number in short], gravities)
    some = [(number, group) for number, group in zip(short, others, strict=True) if group]
    if some:
        mine, left = [paths[number] for number, _ in some], [group for _, group in some]
        for (number, _), each in zip(some, _chosen(who, mine, left, gravities, bench), strict=True):
            if each.told(by)[1] > chosen[number].told(by)[1]:
                chosen[number] = each
    return chosen


def _of_other_kinds(held: Pair, paths: Sequence[SpatialReference], gravities: Array) -> list[list[SpatialGrasp]]:
    """Return grasps for each path that differ more from each other than those that go farthest."""
    config = replace(search_of(held[1], gravities), spacing=COARSE, apart=APART)
    whole = [whole_spatial_path(path) for path in paths]
    return search_grasps(held, held[0].start_pose, whole, gravities, config=config)


def _chosen(
    who: tuple[Pair, Carrier],
    paths: Sequence[SpatialReference],
    groups: Sequence[Sequence[SpatialGrasp]],
    gravities: Array,
    bench: Bench,
) -> list[_Candidate]:
    """Return the grasp of each path's group that is worth most, tried in rounds."""
    (_, by), first = who, 0
    left = [_Candidate(number, grasp) for number, group in enumerate(groups) for grasp in group]
    for best, worlds in by.rounds:
        left = [each for number in range(len(paths)) for each in _best(left, number, by)[:best]]
        left = _tried(who, paths, left, (gravities, range(first, first + worlds)), bench)
        first += worlds
    return [_best(left, number, by)[0] for number in range(len(paths))]


def _best(candidates: Sequence[_Candidate], path: int, by: Carrier) -> list[_Candidate]:
    """Return the candidates of a path, the one that is worth most first."""
    return sorted((each for each in candidates if each.path == path), key=lambda each: -each.told(by)[1])


def _tried(
    who: tuple[Pair, Carrier],
    paths: Sequence[SpatialReference],
    candidates: Sequence[_Candidate],
    worlds: tuple[Array, range],
    bench: Bench,
) -> list[_Candidate]:
    """Return candidates with the ways that they went in further worlds, under some gravities, the same for all."""
    ((hand, spec), by), (gravities, draws) = who, worlds
    whose = [each for each in candidates for _ in draws]
    mine = [paths[each.path] for each in whose]
    path, pull = stacked_paths(mine), np.tile(gravities[np.array(draws) % len(gravities)], (len(candidates), 1))
    twists = stacked_paths([hold_path(each) for each in mine])
    far = np.maximum([each.grasp.way for each in whose] - twists.length, 0.0)
    task = SpatialTask(hand, (spec,) * len(whose), path, gravity=pull, distance=far)
    disturbed = [
        draw(by.grades[0].worlds, (SEED, number), hand.n_joints, space=True) for _ in candidates for number in draws
    ]
    watched = [Watched(by.make(task))]  # which stays the last where no world holds its object

    def carrying(task: SpatialTask) -> Watched:
        watched.append(Watched(by.make(task)))
        return watched[-1]

    starts = np.tile(hand.start_pose, (len(whose), 1))
    grasp, longest = following(hand, [each.grasp for each in whose]), longest_of(path, SENSED_SPATIAL_IK)
    how: dict[str, Any] = {"twists": twists, "longest": longest, "disturbed": disturbed}
    _, found = simulate(task, grasp, starts, carrying, bench, holds=SpatialIkSensedController, **how)
    ways = _ways(found, task, watched[-1].ways, by.grades[0].straight).reshape(len(candidates), len(draws), 2)
    return [
        replace(each, ways=(*each.ways, *((way, straight) for way, straight in rows)))
        for each, rows in zip(candidates, ways.tolist(), strict=True)
    ]


def _ways(found: Recording, task: SpatialTask, aimed: Sequence[Array], straight: float) -> Array:
    """Return how far set points had gone while objects were held, not astray, and how far while straight `(B, 2)` [m].

    What moves and is farther from its path than given [m] is not `straight`. It is -1 where one never was held. Set
    points were `aimed` in each decision `(B,)` [m].
    """
    carried = np.flatnonzero(found.phase == len(found.phases) - 1)
    ways, most = np.full((2, task.n_worlds), -1.0), np.full((2, task.n_worlds), ASTRAY)
    most[1] = np.where(task.path.moves.any(axis=(1, 2)), straight, ASIDE)
    if len(carried) == 0:
        return ways.T
    begin, going = found.states[carried[0]].object_pose, found.last >= carried[0]
    for number, come in zip(carried[::OFTEN].tolist(), aimed[::OFTEN], strict=False):
        state = found.states[number]
        (moved, turned), ahead = task.path.at(come), np.concatenate(task.path.at(come + AHEAD), axis=-1)
        off = ARMS * change_between(state.object_pose, pose_from(begin, moved, turned))
        way = (ahead - np.concatenate([moved, turned], axis=-1)) * ARMS / AHEAD
        away = np.linalg.norm(off - (off * way).sum(axis=-1, keepdims=True) * way, axis=-1)
        # What is lost for a few decisions may be caught again, what is astray stays so.
        going = going & (number <= found.last) & (away <= most)
        here = going & state.touching.all(axis=-1)
        ways = np.where(here, np.maximum(ways, come), ways)
    return ways.T
