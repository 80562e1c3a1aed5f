"""Starts of a hand in space: directions, axes and gravities drawn on the sphere, grasps planned for them, and how far.

A grasp is planned under one gravity; half of the starts that it holds are under another, as objects that are turned or
hands that are moved would be. Directions and gravities near those that evaluations count as never shown are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from inhand.control.controller import Controller, SpatialTask
from inhand.control.loop import Bench, Told, simulate
from inhand.control.spatial_follow import Ending, spatial_limit
from inhand.control.spatial_ik import SpatialIkController
from inhand.control.spatial_ik_sensed import SpatialIkSensedController
from inhand.control.spatial_policy import MARGIN
from inhand.control.spatial_rehearsal import closed_at
from inhand.control.spatial_sensed_plan import following
from inhand.control.trial import REACHED
from inhand.geometry import Array
from inhand.hands.spatial.following import FollowRules
from inhand.hands.spatial.grasp_search import SpatialGrasp, search_grasps
from inhand.hands.spatial.gravity import GRAVITY, PALMS
from inhand.hands.spatial.pair import SpatialPair
from inhand.learning.config import Training
from inhand.learning.experts import taught_reach
from inhand.learning.progress import NEVER_SHOWN
from inhand.learning.space import Space
from inhand.learning.starts import Noise, Starts, drawn_worlds, taken
from inhand.rotations import SpatialPath, pose_from
from inhand.sim.disturbance import Disturbance
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.names import SPATIAL
from inhand.tasks.spatial.paths import spatial_path_of, stacked_paths
from inhand.tasks.spatial.primitives import DIRECTIONS, MAP, TURNS, SpatialPrimitive, about, along

SEEN = (*DIRECTIONS, *TURNS)
"""Primitives that evaluations count as shown."""
UNSEEN = tuple(each for each in MAP if each not in DIRECTIONS)
"""72 directions that are never shown: those of the map between the named ones."""
TESTED = UNSEEN[::3]
"""Those of them that evaluations of a training run try."""
NEVER: tuple[tuple[float, float, float], ...] = ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
"""Where gravity pulls, in the palm frame, in evaluations of gravities that are never shown."""
NEVER_DEG = 20.0
"""Half width of the caps about those that no start's gravity lies in [deg]."""
AT_ONCE = 8
"""Primitives that are planned under one gravity."""
FAR = 0.75
"""Of the grasps of a primitive those are taken that are planned to go at least this share of the best."""
SHORTEST = 0.004
"""Grips that are predicted to carry an object less far are not learned or tested with [m]."""


@dataclass(frozen=True, eq=False)
class Planned:
    """Primitives with the grasps that were found for them."""

    primitives: tuple[SpatialPrimitive, ...]
    grasps: tuple[tuple[SpatialGrasp, ...], ...]
    gravity: Array
    """Gravity under which each was planned `(P, 3)` [m/s^2]."""


def drawn_vectors(rng: np.random.Generator, count: int, without: Array, apart_deg: float) -> Array:
    """Return unit vectors `(count, 3)` drawn evenly on the sphere, none nearer than an angle to those left out."""
    found = np.empty((0, 3))
    while len(found) < count:
        drawn = rng.standard_normal((4 * count, 3))
        drawn /= np.linalg.norm(drawn, axis=-1, keepdims=True)
        near = (drawn @ without.T).max(axis=-1) > np.cos(np.deg2rad(apart_deg))
        found = np.concatenate([found, drawn[~near]])
    return found[:count]


def unseen_directions() -> Array:
    """Return the directions that are never shown as unit vectors `(72, 3)`."""
    return np.array([each.direction for each in UNSEEN])


def gravities(rng: np.random.Generator, count: int) -> Array:
    """Return gravities `(count, 3)` [m/s^2] that may be shown: a quarter those of the palms, the others anywhere."""
    never = np.array(NEVER) / np.sqrt(3)
    anywhere = drawn_vectors(rng, count, never, NEVER_DEG)
    palms = np.array(list(PALMS.values()))[rng.integers(len(PALMS), size=count)]
    return GRAVITY * np.where(rng.random((count, 1)) < 0.25, palms, anywhere)


def planned(held: SpatialPair, config: Training, told: Told) -> Planned:
    """Return grasps of the named primitives and of as many drawn directions and axes as the configuration has."""
    rng = np.random.default_rng((config.seed, 5))
    drawn = drawn_vectors(rng, config.drawn, unseen_directions(), config.held_out)
    axes = drawn_vectors(rng, config.drawn // 2, np.zeros((1, 3)), 0.0)
    primitives = (*SEEN, *map(along, drawn), *map(about, axes))
    primitives = tuple(primitives[k] for k in rng.permutation(len(primitives)))
    found = searched(held, primitives, gravities(rng, len(primitives)), partial(told, "planning grasps"))
    kept = [k for k, (group, _) in enumerate(found) if group]
    groups = tuple(tuple(g for g in found[k][0] if g.way >= FAR * found[k][0][0].way) for k in kept)
    return Planned(tuple(primitives[k] for k in kept), groups, np.array([found[k][1] for k in kept]))


def searched(
    held: SpatialPair, primitives: Sequence[SpatialPrimitive], pulls: Array, told: Callable[[int, int], None]
) -> list[tuple[list[SpatialGrasp], Array]]:
    """Return the grasps of each primitive, best first, and the gravity `(3,)` [m/s^2] that they hold against.

    `AT_ONCE` primitives are planned under one gravity, the next of those given.
    """
    found = list[tuple[list[SpatialGrasp], Array]]()
    for number, first in enumerate(range(0, len(primitives), AT_ONCE)):
        told(first, len(primitives))
        paths = [spatial_path_of(each) for each in primitives[first : first + AT_ONCE]]
        found += [(group, pulls[number]) for group in search_grasps(held, held.start, paths, pulls[number][None])]
    return found


def pool_of(held: SpatialPair, config: Training, plans: Planned, count: int, rng: np.random.Generator) -> Starts:
    """Return starts for demonstrations: primitives of a plan, directions a little off, and how far each is to go."""
    rows = rng.integers(len(plans.primitives), size=count)
    grasps = [plans.grasps[k][rng.integers(len(plans.grasps[k]))] for k in rows.tolist()]
    space = space_of([plans.primitives[k] for k in rows.tolist()], plans.gravity[rows])
    other = rng.random((count, 1)) < 0.5
    space = replace(space, gravity=np.where(other, gravities(rng, count), space.gravity))
    starts = gripped(held, grasps, space, rng, config.noise, disturb=load_disturbance(config.disturb))
    turned = spread(starts.asked_in_space, config, rng)
    return told(held, config, replace(starts, space=turned), rng)


def tests_of(held: SpatialPair, config: Training, told: Told) -> Starts:
    """Return starts for evaluations, as far as their grips reach.

    They are `trials` of every named primitive under gravities that may be shown, and of directions that are never shown
    under gravities that are not either.
    """
    rng, tell = np.random.default_rng((config.seed, 6)), partial(told, "planning grasps to test with")
    found = searched(held, SEEN, gravities(rng, len(SEEN)), tell) * config.trials
    found += searched(held, TESTED, never(len(TESTED)), tell)
    whole = zip((*SEEN * config.trials, *TESTED), found, strict=True)
    kept = [(primitive, group[0], pull) for primitive, (group, pull) in whole if group]
    space = space_of([primitive for primitive, _, _ in kept], np.array([pull for _, _, pull in kept]))
    grasps, disturb = [grasp for _, grasp, _ in kept], load_disturbance(config.disturb)
    return far_enough(held, config, gripped(held, grasps, space, rng, config.noise, disturb=disturb), rng)


def never(count: int) -> Array:
    """Return gravities that are never shown, in turn `(count, 3)` [m/s^2]."""
    return np.resize(GRAVITY / np.sqrt(3) * np.array(NEVER), (count, 3))


def names_of(space: Space) -> list[str]:
    """Return the names of what is asked, one for all directions that are never shown."""
    known = {each.name for each in SEEN}
    return [each.name if each.name in known else NEVER_SHOWN for each in primitives_of(space)]


def spread(space: Space, config: Training, rng: np.random.Generator) -> Space:
    """Return what is asked with directions and axes drawn about those that the grasps were planned for."""
    off = np.deg2rad(config.recipe.grip_spread) * rng.standard_normal((len(space.along), 3))
    off *= rng.random((len(off), 1)) < 0.5

    def turned(units: Array) -> Array:
        moved = units + np.where(units.any(axis=-1, keepdims=True), off, 0.0)
        return np.asarray(moved / np.maximum(np.linalg.norm(moved, axis=-1, keepdims=True), 1e-9))

    new = turned(space.along)
    near = (new @ unseen_directions().T).max(axis=-1) > np.cos(np.deg2rad(config.held_out))
    return replace(space, along=np.where(near[:, None], space.along, new), about=turned(space.about))


def midway(held: SpatialPair, config: Training, kept: Starts, count: int, rng: np.random.Generator) -> Starts:
    """Return some states on the way of other episodes as starts, with new primitives and ways to go."""
    rows = rng.choice(len(kept), min(count, len(kept)), replace=False)
    fresh = kept.rows(rows)
    named = [SEEN[k] for k in rng.integers(len(SEEN), size=len(rows)).tolist()]
    space = spread(space_of(named, fresh.asked_in_space.gravity), config, rng)
    return told(held, config, replace(fresh, space=space), rng)


def told(held: SpatialPair, config: Training, starts: Starts, rng: np.random.Generator) -> Starts:
    """Return the starts that can go some way, told to go as far as their grip is predicted to carry, or less."""
    far = far_enough(held, config, starts, rng)
    share = np.where(rng.random(len(far)) < config.recipe.whole, 1.0, rng.random(len(far)))
    return replace(far, distance=share * far.distance)


def far_enough(held: SpatialPair, config: Training, starts: Starts, rng: np.random.Generator) -> Starts:
    """Return the starts whose grip carries the object at least `SHORTEST`, told to go so far.

    That is what is predicted or, in worlds that differ, what the teacher comes to in each.
    """
    if starts.disturbed is None:
        reach = reach_in_space(held, starts)
    else:
        reach = taught_reach(held, starts, rng, config.recipe.expert)
    rows = np.flatnonzero(reach >= SHORTEST)
    return replace(starts.rows(rows), distance=reach[rows])


def reach_in_space(held: SpatialPair, starts: Starts) -> Array:
    """Return how far the grip of each start is predicted to carry its object `(N,)` [m]."""
    space = starts.asked_in_space
    paths = [spatial_path_of(each) for each in primitives_of(space)]
    task = SpatialTask(held.hand, (held.object,) * len(starts), stacked_paths(paths), gravity=space.gravity)
    return spatial_limit(task, starts.state, Ending(FollowRules(), MARGIN))


def primitives_of(space: Space) -> list[SpatialPrimitive]:
    """Return what is asked as primitives."""
    pairs = zip(space.along, space.about, strict=True)
    return [about(axis) if axis.any() else along(direction) for direction, axis in pairs]


def space_of(primitives: Sequence[SpatialPrimitive], gravity: Array) -> Space:
    """Return primitives, each under its gravity `(N, 3)` [m/s^2], as what is asked of starts."""
    moves = np.array([each.direction or (0.0, 0.0, 0.0) for each in primitives])
    turns = np.array([each.axis if each.direction is None else np.zeros(3) for each in primitives])
    return Space(moves, turns, gravity)


def gripped(
    held: SpatialPair,
    grasps: Sequence[SpatialGrasp],
    space: Space,
    rng: np.random.Generator,
    noise: Noise,
    *,
    disturb: Disturbance | None = None,
) -> Starts:
    """Return starts in which fingers alone hold objects, gripped and lifted as in a trial; those lost are left out.

    Each is held in a world of its own that `disturb` draws, and then on senses.
    """
    hand, spec = held
    count = len(grasps)
    off = noise.position * rng.standard_normal((count, 3)), noise.rotation * rng.standard_normal((count, 3))
    poses, worlds = pose_from(hand.start_pose, *off), drawn_worlds(hand, disturb, rng, count)
    task = SpatialTask(hand, (spec,) * count, SpatialPath.still(count), distance=np.zeros(count), gravity=space.gravity)
    holds: Callable[[SpatialTask], Controller] = SpatialIkController if worlds is None else SpatialIkSensedController
    closed = closed_at(hand, grasps, poses) if worlds is None else following(hand, grasps)
    simulator, found = simulate(task, closed, poses, None, Bench(SPATIAL), holds=holds, disturbed=worlds)
    starts = taken(simulator, found.states[-1], np.arange(count), np.zeros(count))
    starts = replace(starts, space=space, disturbed=worlds)
    return starts.rows(np.flatnonzero(np.array(found.outcomes) == REACHED))
