"""The reach limits of a hand and an object in space along primitives, as numbers to measure a controller against."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array
from inhand.hands.spatial.farthest import SpatialFarthest, SpatialReachConfig, farthest_in_space
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.tasks.spatial.paths import SpatialReference, spatial_path_of, whole_spatial_path
from inhand.tasks.spatial.primitives import SpatialPrimitive


@dataclass(frozen=True, eq=False)
class SpatialLimit:
    """How far a hand could carry an object along one primitive."""

    primitive: SpatialPrimitive
    distance: float
    """Distance along its direction [m], or angle turned where it only rotates [rad]."""
    end: SpatialFarthest | None
    """The farthest grip; None where no contacts hold even the first pose."""


def limits_in_space(
    held: tuple[SpatialHand, SolidSpec],
    primitives: Sequence[SpatialPrimitive],
    gravities: Array,
    config: SpatialReachConfig | None = None,
    progress: Callable[[str], None] | None = None,
) -> tuple[SpatialLimit, ...]:
    """Return the limit of every primitive under all gravities `(G, 3)` [m/s^2]; `progress` is told the name of each.

    A held rotation comes before the translation and is not part of the distance.

    Raises:
        InputError: no contacts hold the object at the start.
    """
    paths = [spatial_path_of(primitive) for primitive in primitives]
    names = iter(primitives)

    def tell() -> None:
        if progress is not None:
            progress(next(names).name)

    ends = farthest_in_space(held, [whole_spatial_path(path) for path in paths], gravities, config, tell)
    if not any(end is not None for end in ends):
        raise InputError(
            f"no start grasp holds object {held[1].name!r} of {1e3 * held[1].mass:g} g with hand {held[0].name!r}:"
            " contacts that its fingers reach have no forces inside their friction cones that grip it and balance its"
            " weight; use another object, hand, gravity or friction"
        )
    made = zip(primitives, paths, ends, strict=True)
    return tuple(SpatialLimit(primitive, _distance(primitive, path, end), end) for primitive, path, end in made)


def _distance(primitive: SpatialPrimitive, path: SpatialReference, end: SpatialFarthest | None) -> float:
    if end is None:
        return 0.0
    if primitive.direction is None:
        return end.way / TURN_ARM
    if primitive.path is not None:  # the farthest along the direction, as metrics count it
        return float((path.moves[path.way <= end.way] @ np.array(primitive.direction)).max())
    return max(end.way - TURN_ARM * float(np.linalg.norm(path.hold)), 0.0)
