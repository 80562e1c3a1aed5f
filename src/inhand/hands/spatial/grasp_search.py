"""Contact search in space: from which contacts of all fingers an object can be carried farthest along a path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array, inverse_quaternion, turn
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.forces import BALANCED, GripRules
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.rolling import Margins, Tracks, off_the_palm, roll
from inhand.hands.spatial.start_contacts import Together, balancing_of, held_together, stack_of
from inhand.rotations import SpatialPath

if TYPE_CHECKING:
    from inhand.hands.spatial.tuples import Stack


@dataclass(frozen=True)
class SpatialSearchConfig:
    """How a search looks; the numbers are the prototype's unless marked guessed."""

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
    cost: float = 0.02
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
    can be worth more than those found.
    """
    config = config or SpatialSearchConfig()
    rules = rules_for(held, config.rules, config.share)
    together = held_together(held, start, config.spacing, config.margins, rules)
    found = []
    for path in paths:
        found.append(_search(held, start, (path, np.atleast_2d(gravities)), together, (config, rules)))
        if progress is not None:
            progress()
    return found


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


def _search(
    held: tuple[SpatialHand, SolidSpec],
    start: Array,
    asked: tuple[SpatialPath, Array],
    together: Together,
    how: tuple[SpatialSearchConfig, GripRules],
) -> list[SpatialGrasp]:
    config, rules = how
    path, gravities = asked
    way = ways_of(path, config.step, config.turn)
    moves, turns = path.at(way)
    poses = SpatialPath(moves, turns).poses(start)
    rows = kinematics.rows_of(poses)[None]
    off = int(off_the_palm(*held, rows, config.margins.palm).sum())
    rows = np.ascontiguousarray(rows[:, : max(off, 1)])
    tracks = [roll(held, f, each, rows, config.margins) for f, each in enumerate(together.starts)]
    lengths = np.min([each.lengths[together.numbers[:, f]] for f, each in enumerate(tracks)], axis=0)
    bound = way[np.maximum(lengths - 1, 0)] - config.cost * together.used
    order = np.argsort(-bound, kind="stable")
    order = order[lengths[order] > 1][: config.most]
    stack, weights = stack_of(held[0], tracks, config.margins), weights_of(held[1], poses, gravities)[None]
    kept: list[SpatialGrasp] = []
    for first in range(0, len(order), config.block):
        block = order[first : first + config.block]
        if len(kept) >= config.keep and kept[config.keep - 1].value >= bound[block[0]]:
            break
        reached, used = follow_tuples(stack, together.numbers[block], lengths[block], (weights, rules), config.every)
        values = np.where(reached > 1, way[np.maximum(reached - 1, 0)] - config.cost * used, -np.inf)
        made = [
            _grasp(together, tracks, together.numbers[block[t]], (float(way[reached[t] - 1]), float(values[t])))
            for t in np.argsort(-values, kind="stable")[: 4 * config.keep]
            if reached[t] > 1
        ]
        kept = _spread([*kept, *made], config)
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


def _grasp(
    together: Together, tracks: list[Tracks], numbers: NDArray[np.int64], worth: tuple[float, float]
) -> SpatialGrasp:
    points = np.stack([each.points[k] for each, k in zip(together.starts, numbers, strict=True)])
    normals = np.stack([each.normals[k] for each, k in zip(together.starts, numbers, strict=True)])
    joints = np.concatenate([each.joints[k, 0] for each, k in zip(tracks, numbers, strict=True)])
    return SpatialGrasp(points, normals, joints, *worth)


def _spread(grasps: list[SpatialGrasp], config: SpatialSearchConfig) -> list[SpatialGrasp]:
    """Return the best grasps that are apart from each other."""
    kept: list[SpatialGrasp] = []
    for grasp in sorted(grasps, key=lambda each: -each.value):
        if all(np.abs(grasp.points - other.points).max() > config.apart for other in kept):
            kept.append(grasp)
        if len(kept) == config.keep:
            break
    return kept
