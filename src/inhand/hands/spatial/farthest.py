"""How far any contacts could carry an object in space, rolling or fixed: joints, bodies, friction and weight alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, partial

import numpy as np

from inhand.caches import Arrays, cached
from inhand.geometry import Array
from inhand.hands.spatial.forces import GripRules
from inhand.hands.spatial.grasp_search import Explored, SpatialSearchConfig, explore, rules_for
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.rolling import NONE
from inhand.hands.spatial.start_tuples import Together, held_together
from inhand.rotations import SpatialPath, placed


@dataclass(frozen=True)
class SpatialReachConfig:
    """How finely limits in space are looked for."""

    spacing: float = 0.006
    """Contacts tried on the object are about so far apart [m]."""
    step: float = 0.002
    """Poses looked at on the way are at most so far apart [m]."""
    turn: float = np.deg2rad(3.0)
    """And turned at most so far [rad]."""
    friction: float | None = None
    """Coefficient of friction; None for the product of both bodies'."""
    most: int = 20_000
    """Tuples of contacts that are followed for one path at most (guessed)."""


@dataclass(frozen=True, eq=False)
class SpatialFarthest:
    """The farthest pose along a path that some contacts hold."""

    way: float
    """Way along the path [m]."""
    pose: Array
    """Pose of the object `(7,)`."""
    joints: Array
    """Joint angles that hold it there `(n,)` [rad]."""
    contacts: Array
    """Contacts there in the palm frame `(N, 3)` [m]."""


def farthest_in_space(
    held: tuple[SpatialHand, SolidSpec],
    paths: Sequence[SpatialPath],
    gravities: Array,
    config: SpatialReachConfig | None = None,
    progress: Callable[[], None] | None = None,
) -> list[SpatialFarthest | None]:
    """Return how far contacts of all fingers could carry an object along each path from its start, None if not at all.

    Contacts are those of a lattice at the start; they roll without slip, or stay on the object. At every pose on the
    way joints keep their limits, no link meets the object, no finger another and the object not the palm, and forces
    inside the friction cones balance the weight under each gravity `(G, 3)` [m/s^2]. Nothing keeps a margin. Tuples of
    contacts are followed in the order of how far they can go at most, until none can go farther.
    """
    config, gravities = config or SpatialReachConfig(), np.atleast_2d(gravities)
    hand, spec = held
    if config.friction is not None:
        spec = replace(spec, friction=config.friction / max(hand.friction, 1e-9))
    looked = SpatialSearchConfig(
        config.spacing, config.step, config.turn, margins=NONE, share=1.0, cost=0.0, most=config.most
    )
    rules = rules_for((hand, spec), GripRules(rounds=60), 1.0)
    start = hand.start_pose
    together = cache(lambda: held_together((hand, spec), start, looked.spacing, looked.margins, rules))

    def compute(path: SpatialPath) -> Arrays:
        found = _farthest((hand, spec), (start, path, gravities), together(), (looked, rules))
        return {} if found is None else {f.name: np.array(getattr(found, f.name)) for f in fields(found)}

    limits: list[SpatialFarthest | None] = []
    for path in paths:
        key = (hand, spec, path.moves, path.turns, gravities, looked)
        known = cached("spatial reach", key, __name__, partial(compute, path))
        made = (known["pose"], known["joints"], known["contacts"]) if known else None
        limits.append(None if made is None else SpatialFarthest(float(known["way"]), *made))
        if progress is not None:
            progress()
    return limits


def _farthest(
    held: tuple[SpatialHand, SolidSpec],
    asked: tuple[Array, SpatialPath, Array],
    together: Together,
    how: tuple[SpatialSearchConfig, GripRules],
) -> SpatialFarthest | None:
    best: list[SpatialFarthest] = []

    def enough(bound: float) -> bool:
        return bool(best) and best[-1].way >= bound

    for fixed in (False, True):
        for block in explore(held, asked, together, (*how, fixed), enough):
            t = int(block.values.argmax())
            if block.reached[t] and (not best or block.values[t] > best[-1].way):
                best.append(_end(block, t))
    return best[-1] if best else None


def _end(block: Explored, t: int) -> SpatialFarthest:
    last = int(block.reached[t]) - 1
    own = list(zip(block.tracks, block.numbers[t], strict=True))
    contacts = placed(block.poses[last], np.stack([track.points[k, last] for track, k in own]))
    joints = np.concatenate([track.joints[k, last] for track, k in own])
    return SpatialFarthest(float(block.way[last]), block.poses[last], joints, contacts)
