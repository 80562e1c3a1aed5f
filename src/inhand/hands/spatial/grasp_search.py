"""Contact search in space: from which contacts of all fingers an object can be carried farthest along a path."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from inhand.caches import Arrays, cached
from inhand.geometry import Array, inverse_quaternion, turn
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.forces import BALANCED, GripRules
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.rolling import Margins, Tracks, off_the_palm, roll
from inhand.hands.spatial.start_contacts import balancing_of, stack_of
from inhand.hands.spatial.start_tuples import Ranked, Together, held_together
from inhand.rotations import SpatialPath

if TYPE_CHECKING:
    from inhand.hands.spatial.tuples import Stack


MORE = 4
"""Grasps of a block that are looked at, for each to be kept: some are alike."""


@dataclass(frozen=True)
class SpatialSearchConfig:
    """How a search looks; near the prototype's, guessed where it says so."""

    spacing: float = 0.006
    """Contacts tried on the object are about so far apart [m]."""
    step: float = 0.002
    """Poses looked at on the way are at most so far apart [m]."""
    turn: float = np.deg2rad(3.0)
    """And turned at most so far [rad] (guessed)."""
    every: int = 5
    """Forces and fingers are looked at on one pose of so many, and where they end on each."""
    margins: Margins = field(default_factory=Margins)
    """What fingers keep."""
    share: float = 0.7
    """Share of the friction that a plan may use."""
    rules: GripRules = field(default_factory=GripRules)
    """How contacts hold; their friction is the hand's and the object's."""
    cost: float = 0.01
    """Way that a grip is worth which uses none of its cones, against one that uses all [m]."""
    keep: int = 6
    """Grasps to return for each path."""
    apart: float = 0.006
    """Two of them differ by more than this at a contact [m]."""
    block: int = 500
    """Tuples that are followed at a time, the most promising first."""
    most: int = 5000
    """Tuples that are followed for one path at most (guessed)."""


@dataclass(frozen=True, eq=False)
class SpatialGrasp:
    """Contacts of all fingers, and how far they are predicted to carry the object."""

    points: Array
    """Contacts in the object's frame `(N, 3)` [m]."""
    normals: Array
    """Outward normals there `(N, 3)`."""
    joints: Array
    """Joint angles that touch them at the start `(n,)` [rad]."""
    way: float
    """Way along the path up to which the grip is predicted to hold [m]."""
    value: float
    """By what grasps are ranked: the way less a cost for cones that are used [m]."""


def search_grasps(
    held: tuple[SpatialHand, SolidSpec],
    start: Array,
    paths: Sequence[SpatialPath],
    gravities: Array,
    *,
    config: SpatialSearchConfig | None = None,
    progress: Callable[[], None] | None = None,
) -> list[list[SpatialGrasp]]:
    """Return the best grasps for each path from a start pose `(7,)`, best first; an empty list where none holds.

    A grasp holds up to a pose as long as all fingers follow rolling (`rolling.roll`), keep off object, palm and each
    other, and their contacts balance the object's weight inside the share of their cones under each of the gravities
    `(G, 3)` [m/s^2]. Tuples of contacts are followed in the order of what they can be worth at most, until no other
    can be worth more than those found. What was found is kept on disk.
    """
    config, gravities = config or SpatialSearchConfig(), np.atleast_2d(gravities)
    rules = rules_for(held, config.rules, config.share)

    def compute(path: SpatialPath) -> Arrays:
        together = _together(held[0], held[1], tuple(start.tolist()), config, rules)
        return as_arrays(_search(held, start, (path, gravities), together, (config, rules)))

    found = []
    for path in paths:
        key = (*held, start, path.moves, path.turns, gravities, config)
        found.append(grasps_from(cached("spatial grasps", key, __name__, partial(compute, path))))
        if progress is not None:
            progress()
    return found


@lru_cache(maxsize=2)
def _together(
    hand: SpatialHand, spec: SolidSpec, start: tuple[float, ...], config: SpatialSearchConfig, rules: GripRules
) -> Together:
    """Return contacts that hold an object at its start under some gravity, which takes longer than following a path."""
    return held_together((hand, spec), np.array(start), config.spacing, config.margins, rules)


def grasps_from(rows: Arrays) -> list[SpatialGrasp]:
    """Return the grasps whose parts are the rows of arrays."""
    points, normals, joints, ways, values = (rows[each.name] for each in fields(SpatialGrasp))
    each = zip(points, normals, joints, ways.tolist(), values.tolist(), strict=True)
    return [SpatialGrasp(*row) for row in each]


def as_arrays(grasps: list[SpatialGrasp]) -> Arrays:
    """Return the parts of grasps as the rows of arrays."""
    return {each.name: np.array([getattr(grasp, each.name) for grasp in grasps]) for each in fields(SpatialGrasp)}


def rules_for(held: tuple[SpatialHand, SolidSpec], rules: GripRules, share: float) -> GripRules:
    """Return rules with a share of the friction of hand and object, converged."""
    return replace(rules, friction=share * held[0].friction * held[1].friction)


def ways_of(path: SpatialPath, step: float, turned: float) -> Array:
    """Return ways `(S,)` [m] along one path that are at most a step [m] and a turn [rad] apart."""
    far = float(np.linalg.norm(np.diff(path.moves, axis=0), axis=-1).sum()) / step
    far = max(far, float(np.linalg.norm(np.diff(path.turns, axis=0), axis=-1).sum()) / turned)
    return np.linspace(0.0, float(path.length), max(int(np.ceil(far - 1e-9)), 1) + 1)


def weights_of(spec: SolidSpec, poses: Array, gravities: Array) -> Array:
    """Return the forces that hold an object at poses `(..., S, 7)` against gravities `(..., G, 3)`, in its frame.

    They are `(..., S, G, 3)` [N].
    """
    back = inverse_quaternion(poses[..., None, 3:])
    return np.ascontiguousarray(turn(back, -spec.mass * gravities))


@dataclass(frozen=True, eq=False)
class Explored:
    """Tuples of contacts that were followed along a path."""

    way: Array
    """Way to each pose `(S,)` [m]."""
    poses: Array
    """Poses of the object `(S, 7)`."""
    tracks: list[Tracks]
    """Contacts of each finger."""
    numbers: NDArray[np.int64]
    """The track of each finger `(T, N)`."""
    reached: NDArray[np.int64]
    """How many poses each tuple holds `(T,)`."""
    values: Array
    """What each is worth `(T,)` [m]; -inf where it goes nowhere."""


@dataclass(frozen=True, eq=False)
class Tracked:
    """Where the fingers alone follow a path."""

    way: Array
    """Way to each pose `(S,)` [m]."""
    poses: Array
    """Poses of the object `(S, 7)`."""
    tracks: list[Tracks]
    """Contacts of each finger."""
    lengths: list[NDArray[np.int64]]
    """How many poses each finger follows alone from each contact, and the object is off the palm `(K,)`."""


def tracked(
    held: tuple[SpatialHand, SolidSpec],
    asked: tuple[Array, SpatialPath],
    together: Together,
    config: SpatialSearchConfig,
    *,
    fixed: bool,
) -> Tracked:
    """Return how far the fingers follow a path from a start pose `(7,)`, their contacts rolling or `fixed`."""
    start, path = asked
    way = ways_of(path, config.step, config.turn)
    poses = SpatialPath(*path.at(way)).poses(start)
    rows = kinematics.rows_of(poses)[None]
    clear = int(off_the_palm(*held, rows, config.margins.palm).sum())
    rows = np.ascontiguousarray(rows[:, : max(clear, 1)])
    tracks = [roll(held, f, each, rows, config.margins, fixed=fixed) for f, each in enumerate(together.starts)]
    return Tracked(way, poses, tracks, [np.minimum(each.lengths, clear) for each in tracks])


def explore(
    held: tuple[SpatialHand, SolidSpec],
    asked: tuple[Array, SpatialPath, Array],
    together: Together,
    how: tuple[SpatialSearchConfig, GripRules, bool],
    enough: Callable[[float], bool],
) -> Iterator[Explored]:
    """Give tuples of contacts, followed along a path, block by block, those first that can be worth most.

    Args:
        held: hand and object.
        asked: start pose `(7,)`, path from it, gravities `(G, 3)` [m/s^2].
        together: contacts at the start.
        how: how to look, how contacts hold, and whether they stay where they are on the object instead of rolling.
        enough: told the most that tuples of the next block can be worth [m], says whether to stop.
    """
    (start, path, gravities), (config, rules, fixed) = asked, how
    found = tracked(held, (start, path), together, config, fixed=fixed)
    way, stack = found.way, stack_of(held[0], found.tracks, config.margins)
    weights = weights_of(held[1], found.poses, gravities)[None]
    for block in _blocks(together.ranked(found.lengths, way, config.cost), config, enough):
        numbers = together.numbers(block.rows)
        reached, used = follow_tuples(stack, numbers, block.lengths, (weights, rules), config.every)
        values = np.where(reached > 0, way[np.maximum(reached - 1, 0)] - config.cost * used, -np.inf)
        yield Explored(way, found.poses, found.tracks, numbers, reached, values)


def _blocks(ranked: Iterator[Ranked], config: SpatialSearchConfig, enough: Callable[[float], bool]) -> Iterator[Ranked]:
    """Give tuples block by block, `config.most` in all, until there are enough for the most that the next is worth."""
    some = (each for each in ranked if len(each.rows))
    left, given = next(some, None), 0
    while left is not None and given < config.most and not enough(float(left.bounds[0])):
        size = min(config.block, config.most - given)
        while len(left.rows) < size and (more := next(some, None)) is not None:
            left = left.joined(more)
        yield left.some(slice(size))
        left, given = left.some(slice(size, None)), given + size
        if not len(left.rows) and given < config.most:
            left = next(some, None)


def _search(
    held: tuple[SpatialHand, SolidSpec],
    start: Array,
    asked: tuple[SpatialPath, Array],
    together: Together,
    how: tuple[SpatialSearchConfig, GripRules],
) -> list[SpatialGrasp]:
    config, rules = how
    kept: list[SpatialGrasp] = []

    def enough(bound: float) -> bool:
        return len(kept) == config.keep and kept[-1].value >= bound

    for block in explore(held, (start, *asked), together, (config, rules, False), enough):
        best = np.argsort(-block.values, kind="stable")[: MORE * config.keep]
        reached = [(int(t), int(block.reached[t]) - 1) for t in best if block.reached[t] > 1]
        made = [
            grasp_of(together, block.tracks, block.numbers[t], float(block.way[last]), float(block.values[t]))
            for t, last in reached
        ]
        kept[:] = spread([*kept, *made], config)
    return kept


def follow_tuples(
    stack: Stack,
    numbers: NDArray[np.int64],
    lengths: NDArray[np.int64],
    forces: tuple[Array, GripRules],
    every: int,
) -> tuple[NDArray[np.int64], Array]:
    """Return how many poses tuples of tracks hold `(T,)`, and the largest share of a cone that they use `(T,)`."""
    from inhand.hands.spatial.tuples import Asked, hold_tuples

    weights, rules = forces
    told = np.array(lengths, dtype=np.int64), np.zeros(len(numbers))
    asked = Asked(np.ascontiguousarray(numbers), told[0], weights, told[1], every, BALANCED)
    hold_tuples(stack, asked, balancing_of(numbers.shape[1], rules))
    return told


def grasp_of(
    together: Together, tracks: list[Tracks], numbers: NDArray[np.int64], way: float, value: float
) -> SpatialGrasp:
    """Return the grasp of a tuple of contacts by their numbers `(N,)`."""
    own = list(zip(together.starts, tracks, numbers, strict=True))
    points, normals = (np.stack([getattr(each, what)[k] for each, _, k in own]) for what in ("points", "normals"))
    joints = np.concatenate([track.joints[k, 0] for _, track, k in own])
    return SpatialGrasp(points, normals, joints, way, value)


def spread(grasps: list[SpatialGrasp], config: SpatialSearchConfig) -> list[SpatialGrasp]:
    """Return the best grasps that are apart from each other."""
    kept: list[SpatialGrasp] = []
    for grasp in sorted(grasps, key=lambda each: -each.value):
        if all(np.abs(grasp.points - other.points).max() > config.apart for other in kept):
            kept.append(grasp)
        if len(kept) == config.keep:
            break
    return kept
