"""The reach limits of a hand and an object along primitives, as numbers to measure a controller against."""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache

import numpy as np

from inhand.caches import Arrays, cached
from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array, unit
from inhand.hands.fit import Held
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, polygon
from inhand.hands.reach.limits import Farthest, ReachConfig, farthest, why_none
from inhand.hands.shapes import link_outline, palm_outline
from inhand.tasks.paths import ReferencePath, path_of, whole_path
from inhand.tasks.primitives import Primitive


@dataclass(frozen=True, eq=False)
class Limit:
    """How far a hand could carry an object along one primitive."""

    primitive: Primitive
    distance: float
    """Distance along its direction [m], or angle turned where it only rotates [rad]."""
    end: Farthest


def limits(
    hand: HandSpec,
    spec: ObjectSpec,
    primitives: Sequence[Primitive],
    config: ReachConfig | None = None,
    progress: Callable[[str], None] | None = None,
) -> tuple[Limit, ...]:
    """Return the limit of every primitive, from the start of the object; `progress` is told the name of each.

    A held twist comes before the translation and is not part of the distance.

    Raises:
        InputError: no pair of contacts holds the object at the start.
    """
    start = start_grip(hand, spec, config)
    found = []
    for primitive in primitives:
        found.append(_limit(Held(hand, spec), primitive, config) or Limit(primitive, 0.0, start))
        if progress is not None:
            progress(primitive.name)
    return tuple(found)


def _limit(held: Held, primitive: Primitive, config: ReachConfig | None) -> Limit | None:
    """Return the limit of a primitive, None where not even its first pose has a grip."""
    path = path_of(primitive)
    end = _farthest(held, held.start + whole_path(path), config)
    return None if end is None else Limit(primitive, _distance(primitive, end, path), end)


def _farthest(held: Held, path: Array, config: ReachConfig | None) -> Farthest | None:
    """Return `farthest` of a hand and an object, computed once and kept on disk."""

    def compute() -> Arrays:
        end = farthest(*held, path, config)
        return {} if end is None else {name: np.array(value) for name, value in asdict(end).items()}

    known = cached("reach", (_depends(*held, config or ReachConfig()), path), __name__, compute)
    return Farthest(float(known["way"]), known["pose"], known["joints"], known["contacts"]) if known else None


@lru_cache(maxsize=64)
def _depends(hand: HandSpec, spec: ObjectSpec, config: ReachConfig) -> tuple[object, ...]:
    """Return all of a hand and an object that their limits depend on: no names, masses or motors."""
    fingers = tuple(
        (finger.base, finger.links, finger.limits, *(link_outline(hand, finger, k) for k in range(len(finger.links))))
        for finger in hand.fingers
    )
    friction = hand.friction * spec.friction if config.friction is None else config.friction
    return fingers, palm_outline(hand), polygon(spec), replace(config, friction=friction)


def start_grip(hand: HandSpec, spec: ObjectSpec, config: ReachConfig | None = None) -> Farthest:
    """Return a grip that holds the object at its start.

    Raises:
        InputError: there is none; the text says which constraint fails.
    """
    origin = hand.start_pose[None]
    found = _farthest(Held(hand, spec), origin, config)
    if found is None:
        why = why_none(hand, spec, origin, config)
        raise InputError(
            f"no start grasp holds object {spec.name!r} with hand {hand.name!r}: {why}; use another object, hand, start"
            " or friction"
        )
    return found


def _distance(primitive: Primitive, end: Farthest, path: ReferencePath) -> float:
    if primitive.angle_deg is None:
        return end.way / TURN_ARM
    if primitive.path is not None:  # the farthest along the direction, as metrics count it
        return float((path.poses[path.way <= end.way, :2] @ unit(math.radians(primitive.angle_deg))).max())
    return max(end.way - TURN_ARM * abs(path.twist), 0.0)
