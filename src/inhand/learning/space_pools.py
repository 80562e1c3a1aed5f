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
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.spatial.following import FollowRules
from inhand.hands.spatial.grasp_search import SpatialGrasp, search_grasps
from inhand.hands.spatial.gravity import GRAVITY, PALMS, gravity_of
from inhand.hands.spatial.pair import SpatialPair
from inhand.learning.dataset_cards import CONTINUOUS, SPHERE, SpatialHead
from inhand.learning.experts import TEACHERS, taught_reach
from inhand.learning.progress import NEVER_SHOWN
from inhand.learning.recipe import SEEN, SpatialRecording
from inhand.learning.space import Space, primitives_of, space_of, task_in_space
from inhand.learning.starts import Noise, Starts, drawn_worlds, joined, taken
from inhand.rotations import SpatialPath, pose_from
from inhand.sim.disturbance import Disturbance
from inhand.sim.names import SPATIAL
from inhand.tasks.spatial.paths import spatial_path_of
from inhand.tasks.spatial.primitives import DIRECTIONS, MAP, SpatialPrimitive, about, along, parse_spatial_directions

UNSEEN = tuple(each for each in MAP if each not in DIRECTIONS)
"""72 directions that are never shown: those of the map between the named ones."""
TESTED = UNSEEN[::3]
"""Those of them that evaluations of a training run try."""
NEVER: tuple[tuple[float, float, float], ...] = ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
"""Where gravity pulls, in the palm frame, in evaluations of gravities that are never shown."""
NEVER_DEG = 20.0
"""Half width of the caps about those that no start's gravity lies in [deg]."""
NEAR_DEG = 1.0
"""A direction nearer than this to one of those that are never shown is that [deg]."""
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


def gravities(rng: np.random.Generator, count: int, share: float) -> Array:
    """Return gravities `(count, 3)` [m/s^2] that may be shown: a share those of the palms, the others anywhere."""
    never = np.array(NEVER) / np.sqrt(3)
    anywhere = drawn_vectors(rng, count, never, NEVER_DEG)
    palms = np.array(list(PALMS.values()))[rng.integers(len(PALMS), size=count)]
    return GRAVITY * np.where(rng.random((count, 1)) < share, palms, anywhere)


def planned(recording: SpatialRecording, told: Told) -> Planned:
    """Return grasps of the primitives to record and of as many drawn directions and axes beside.

    Raises:
        InputError: none has a grasp.
    """
    held, rng = recording.held, np.random.default_rng((recording.seed, 5))
    drawn = drawn_vectors(rng, recording.drawn, unseen_directions(), recording.held_out)
    axes = drawn_vectors(rng, recording.drawn // 2, np.zeros((1, 3)), 0.0)
    primitives = (*recording.primitives, *map(along, drawn), *map(about, axes))
    primitives = tuple(primitives[k] for k in rng.permutation(len(primitives)))
    pulls = pulls_of(recording, rng, len(primitives))
    found = searched(held, primitives, pulls, partial(told, "planning grasps"))
    kept = [k for k, (group, _) in enumerate(found) if group]
    if not kept:
        names = ", ".join(each.name for each in recording.primitives)
        raise InputError(
            f"no grasp of {held.hand.name!r} carries {held.object.name!r} along {names}: use another object, another"
            " direction or another gravity"
        )
    groups = tuple(tuple(g for g in found[k][0] if g.way >= FAR * found[k][0][0].way) for k in kept)
    return Planned(tuple(primitives[k] for k in kept), groups, np.array([found[k][1] for k in kept]))


def pulls_of(recording: SpatialRecording, rng: np.random.Generator, count: int) -> Array:
    """Return the gravities `(count, 3)` [m/s^2] of a recording: its own, or drawn ones that may be shown."""
    if recording.gravity is not None:
        return np.tile(recording.gravity, (count, 1))
    return gravities(rng, count, recording.recipe.palms)


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


def starts_in_space(
    recording: SpatialRecording, plans: Planned, count: int, rng: np.random.Generator, kept: Starts | None = None
) -> Starts:
    """Return at most `count` starts for demonstrations, some of them from states of earlier episodes."""
    again = 0 if kept is None else min(round(recording.recipe.midway * count), len(kept))
    fresh = pool_of(recording, plans, count - again, rng)
    return fresh if kept is None or not again else joined([fresh, midway(recording, kept, again, rng)])


def pool_of(recording: SpatialRecording, plans: Planned, count: int, rng: np.random.Generator) -> Starts:
    """Return starts for demonstrations: primitives of a plan, directions a little off, and how far each is to go."""
    rows = rng.integers(len(plans.primitives), size=count)
    grasps = [plans.grasps[k][rng.integers(len(plans.grasps[k]))] for k in rows.tolist()]
    space = space_of([plans.primitives[k] for k in rows.tolist()], plans.gravity[rows])
    other = rng.random((count, 1)) < 0.5
    space = replace(space, gravity=np.where(other, pulls_of(recording, rng, count), space.gravity))
    starts = gripped(recording.held, grasps, space, rng, recording.noise, disturb=recording.disturb)
    turned = spread(starts.asked_in_space, recording, rng)
    return told(recording, replace(starts, space=turned), rng)


def tests_of(recording: SpatialRecording, trials: int, told: Told) -> Starts:
    """Return starts for evaluations, as far as their grips reach.

    They are `trials` of every named primitive under gravities that may be shown, and of directions that are never shown
    under gravities that are not either.
    """
    held = recording.held
    rng, tell = np.random.default_rng((recording.seed, 6)), partial(told, "planning grasps to test with")
    found = searched(held, SEEN, gravities(rng, len(SEEN), recording.recipe.palms), tell) * trials
    found += searched(held, TESTED, never(len(TESTED)), tell)
    whole = zip((*SEEN * trials, *TESTED), found, strict=True)
    kept = [(primitive, group[0], pull) for primitive, (group, pull) in whole if group]
    space = space_of([primitive for primitive, _, _ in kept], np.array([pull for _, _, pull in kept]))
    grasps, disturb = [grasp for _, grasp, _ in kept], recording.disturb
    return far_enough(recording, gripped(held, grasps, space, rng, recording.noise, disturb=disturb), rng)


def never(count: int) -> Array:
    """Return gravities that are never shown, in turn `(count, 3)` [m/s^2]."""
    return np.resize(GRAVITY / np.sqrt(3) * np.array(NEVER), (count, 3))


def shown_unseen(head: SpatialHead) -> list[str]:
    """Return what of a dataset evaluations count as never shown: directions, or its gravity."""
    asked = () if head.directions == CONTINUOUS else parse_spatial_directions(head.directions)
    moves = [each for each in asked if each.direction is not None]
    near = np.array([each.direction for each in moves]).reshape(-1, 3) @ unseen_directions().T
    shown = [each.name for each, row in zip(moves, near, strict=True) if row.max() > np.cos(np.deg2rad(NEAR_DEG))]
    if head.gravity != SPHERE:
        pull = np.array(gravity_of(head.gravity)) / GRAVITY
        if (never(len(NEVER)) / GRAVITY @ pull).max() > np.cos(np.deg2rad(NEVER_DEG)):
            shown.append(f"gravity {head.gravity}")
    return shown


def names_of(space: Space) -> list[str]:
    """Return the names of what is asked, one for all directions that are never shown."""
    known = {each.name for each in SEEN}
    return [each.name if each.name in known else NEVER_SHOWN for each in primitives_of(space)]


def spread(space: Space, recording: SpatialRecording, rng: np.random.Generator) -> Space:
    """Return what is asked with directions and axes drawn about those that the grasps were planned for."""
    off = np.deg2rad(recording.recipe.grip_spread) * rng.standard_normal((len(space.along), 3))
    off *= rng.random((len(off), 1)) < 0.5

    def turned(units: Array) -> Array:
        moved = units + np.where(units.any(axis=-1, keepdims=True), off, 0.0)
        return np.asarray(moved / np.maximum(np.linalg.norm(moved, axis=-1, keepdims=True), 1e-9))

    new = turned(space.along)
    near = (new @ unseen_directions().T).max(axis=-1) > np.cos(np.deg2rad(recording.held_out))
    return replace(space, along=np.where(near[:, None], space.along, new), about=turned(space.about))


def midway(recording: SpatialRecording, kept: Starts, count: int, rng: np.random.Generator) -> Starts:
    """Return some states on the way of other episodes as starts, with new primitives and ways to go."""
    rows = rng.choice(len(kept), min(count, len(kept)), replace=False)
    fresh = kept.rows(rows)
    if not len(fresh):
        return fresh
    primitives = recording.primitives
    named = [primitives[k] for k in rng.integers(len(primitives), size=len(rows)).tolist()]
    space = spread(space_of(named, fresh.asked_in_space.gravity), recording, rng)
    return told(recording, replace(fresh, space=space), rng)


def told(recording: SpatialRecording, starts: Starts, rng: np.random.Generator) -> Starts:
    """Return the starts that can go some way, told to go as far as their grip is predicted to carry, or less."""
    far = far_enough(recording, starts, rng)
    return replace(far, distance=recording.recipe.shares(len(far), rng) * far.distance)


def far_enough(recording: SpatialRecording, starts: Starts, rng: np.random.Generator) -> Starts:
    """Return the starts whose grip carries the object at least `SHORTEST`, told to go so far.

    That is what is predicted or, in worlds that differ, what a teacher comes to in each.
    """
    expert = recording.recipe.expert
    if starts.disturbed is None or expert not in TEACHERS:
        reach = reach_in_space(recording.held, starts)
    else:
        reach = taught_reach(recording.held, starts, rng, expert)
    rows = np.flatnonzero(reach >= SHORTEST)
    return replace(starts.rows(rows), distance=reach[rows])


def reach_in_space(held: SpatialPair, starts: Starts) -> Array:
    """Return how far the grip of each start is predicted to carry its object `(N,)` [m]."""
    return spatial_limit(task_in_space(held, starts.asked_in_space), starts.state, Ending(FollowRules(), MARGIN))


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
