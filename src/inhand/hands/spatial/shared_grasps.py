"""Contact search in space for one grasp that carries an object along many paths, each on its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inhand.caches import Arrays, cached
from inhand.geometry import Array
from inhand.hands.spatial.grasp_search import (
    SpatialGrasp,
    SpatialSearchConfig,
    as_arrays,
    follow_tuples,
    grasp_of,
    grasps_from,
    rules_for,
    spread,
    tracked,
    weights_of,
)
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.start_contacts import stack_of
from inhand.hands.spatial.start_tuples import followed, held_together
from inhand.rotations import SpatialPath

LOOKED, KEEP = 1000, 12
"""Grasps that are looked at for the few to be kept: many are alike; and how many those are at most."""


def worth_together(ways: Array, paths: Sequence[SpatialPath]) -> Array:
    """Return what grasps are worth `(K,)` that come so far along P paths `(K, P)` [m].

    It is the median over paths that move and the least over those that only turn, each a share of the farthest that any
    of them has.
    """
    turning = np.array([not path.moves.any() for path in paths])
    parts = [np.median(ways[:, ~turning], axis=1)] if not turning.all() else []
    parts += [ways[:, turning].min(axis=1)] if turning.any() else []
    return np.asarray(sum(part / max(float(part.max()), 1e-9) for part in parts))


def search_shared(
    held: tuple[SpatialHand, SolidSpec],
    start: Array,
    paths: Sequence[SpatialPath],
    gravities: Array,
    config: SpatialSearchConfig,
) -> list[SpatialGrasp]:
    """Return the grasps that are worth most along all paths together, best first; an empty list where none holds.

    They hold up to a pose as those of `search_grasps` do. Their way is the least along any path. Tuples of contacts are
    followed whose fingers alone promise most. What was found is kept on disk.
    """
    gravities = np.atleast_2d(gravities)
    key = (*held, start, [(path.moves, path.turns) for path in paths], gravities, config)
    found = cached("spatial shared grasps", key, __name__, partial(_searched, held, start, (paths, gravities), config))
    return grasps_from(found)


def _searched(
    held: tuple[SpatialHand, SolidSpec],
    start: Array,
    asked: tuple[Sequence[SpatialPath], Array],
    config: SpatialSearchConfig,
) -> Arrays:
    (paths, gravities), rules = asked, rules_for(held, config.rules, config.share)
    together = held_together(held, start, config.spacing, config.margins, rules)
    numbers = together.numbers(together.holding(together.rows()))
    if not len(numbers):
        return as_arrays([])
    every = [tracked(held, (start, path), together, config, fixed=False) for path in paths]
    lengths = [followed(each.lengths, numbers) for each in every]
    promised = np.stack([each.way[np.maximum(n - 1, 0)] for each, n in zip(every, lengths, strict=True)], axis=1)
    chosen: NDArray[np.int64] = np.argsort(-worth_together(promised, paths), kind="stable")[: config.most]
    ways = np.empty((len(chosen), len(paths)))
    for k, (each, most) in enumerate(zip(every, lengths, strict=True)):
        stack = stack_of(held[0], each.tracks, config.margins)
        weights = weights_of(held[1], each.poses, gravities)[None]
        reached, _ = follow_tuples(stack, numbers[chosen], most[chosen], (weights, rules), config.every)
        ways[:, k] = np.where(reached > 0, each.way[np.maximum(reached - 1, 0)], 0.0)
    worth = worth_together(ways, paths)
    best = [int(t) for t in np.argsort(-worth, kind="stable")[:LOOKED] if ways[t].min() > 0]
    tracks = every[0].tracks
    made = [grasp_of(together, tracks, numbers[chosen[t]], float(ways[t].min()), float(worth[t])) for t in best]
    return as_arrays(spread(made, replace(config, keep=KEEP)))
