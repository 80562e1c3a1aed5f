"""The search for a grasp: where to hold an object so that it can be carried farthest along a path.

The thesis names rough initial contacts as the likely cause of its failures towards the palm and proposes a small
optimisation search (thesis 5.1). This is it. Every posture in which the reach map lets a finger touch the object at
the start is tried, on faces and on corners alike, and rolled along the whole path (`hands/rolling.py`); a pair goes as
far as both fingers can follow, the line between their contacts stays inside both friction cones and no links meet.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.caches import Arrays, keep, key_of, look_up
from inhand.errors import InputError
from inhand.geometry import Array, cross, rotate, transform, way_along
from inhand.hands.hand import FINGER_NAMES, FingerSpec, HandSpec
from inhand.hands.kinematics import damped_least_squares, joint_positions, point_jacobian
from inhand.hands.objects import ObjectSpec, convex_pieces
from inhand.hands.reach.fingers import Body, touching_postures
from inhand.hands.reach.limits import body_of
from inhand.hands.reach.pairs import neighbours
from inhand.hands.reach.parts import Postures
from inhand.hands.rolling import Starts, Tracks, roll
from inhand.hands.touch import inclined_touches

PLAN_EVERY = 3
"""Of a path's poses the search looks at one in so many, 3 mm apart: it only compares grasps."""
INCLINATIONS = np.deg2rad([-60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0])
"""Angles between a third link and the inward normal that are tried [rad]."""


@dataclass(frozen=True)
class SearchConfig:
    """How contacts are searched and judged."""

    spacing: float = 0.002
    """Distance between tried points of the outline [m], doubled for fingers of three links."""
    fan: float = np.deg2rad(6.0)
    """Angle between tried normals on a corner [rad], doubled for fingers of three links."""
    cone: float = 0.92
    """Share of the friction coefficient that the line between the contacts may use."""
    start_cone: float = 0.82
    """The same share at the start, where closing the fingers disturbs the object."""
    tilt_cost: float = 0.012
    """Progress given up for a grip line that starts at the edge of the cone, not along the normals [m]."""
    centre_cost: float = 0.1
    """Progress given up for each metre by which the grip line misses the middle of the object."""
    company: float = 0.3
    """Weight of the neighbours' progress: a start whose neighbours reach as far forgives errors of the grasp."""
    opening: float = 0.010
    """How far the fingers stand off the object before they close [m]."""
    squeeze: float = 0.002
    """How far inside the object the fingers aim when they close, which presses them on [m]."""
    block: int = 24
    """Pairs whose fingers are checked against each other first."""
    count: int = 5
    """Grasps of each path that are kept."""
    apart: float = 0.004
    """Distance by which one of the contacts of two kept grasps must differ [m]."""


@dataclass(frozen=True)
class GraspPlan:
    """Where to hold an object for one path."""

    contacts: Array
    """Start contacts of the left and right finger in the object frame `(2, 2)` [m]."""
    normals: Array
    """Outward normals there `(2, 2)`."""
    joints: Array
    """Joint angles that touch both contacts at the path's start `(n_joints,)` [rad]."""
    reach: int
    """Number of poses of the path, from the first, that this grip can follow."""
    drawn: float = 0.0
    """Share of the way to the path's start by which the fingers close short of where the object stands."""


def plan_grasps(
    hand: HandSpec, spec: ObjectSpec, poses: Array, config: SearchConfig | None = None
) -> list[list[GraspPlan]]:
    """Return for every path `(P, S, 3)` the grasps that carry the object farthest along it, the best first.

    All paths begin at one pose, in the palm frame. What was found once is read from the cache on disk.

    Raises:
        InputError: no pair of contacts holds the object at the start; the text says which constraint fails.
    """
    config = config or SearchConfig()
    keys = [key_of("grasps", (hand, spec, path, config), __name__) for path in poses]
    kept = [look_up(key) for key in keys]
    missing = [k for k, found in enumerate(kept) if found is None]
    for k, plans in zip(missing, _search(hand, spec, poses[missing], config) if missing else (), strict=True):
        found = {name: np.array([getattr(plan, name) for plan in plans]) for name in _KEPT}
        keep(keys[k], found)
        kept[k] = found
    return [_plans_of(found) for found in kept if found is not None]


_KEPT = ("contacts", "normals", "joints", "reach")
"""What of a plan is searched."""


def _plans_of(found: Arrays) -> list[GraspPlan]:
    rows = zip(*(found[name] for name in _KEPT), strict=True)
    return [GraspPlan(contacts, normals, joints, int(reach)) for contacts, normals, joints, reach in rows]


def _search(hand: HandSpec, spec: ObjectSpec, poses: Array, config: SearchConfig) -> list[list[GraspPlan]]:
    """Search for what `plan_grasps` returns."""
    coarser = 2 if max(len(finger.links) for finger in hand.fingers) > 2 else 1
    body = body_of(spec, coarser * config.spacing, coarser * config.fan)
    # Each finger by itself: where it touches at the start, and how far it can follow every path from there.
    starts = [_starts(hand, finger, body, poses[0, 0]) for finger in hand.fingers]
    for side, found in zip(FINGER_NAMES, starts, strict=True):
        if len(found.pose) == 0:
            raise no_grasp(hand, spec, f"the {side} finger reaches no point of it within its joint limits")
    tracks = [
        _roll_all(hand, finger, (body.cells.points[found.cell], found.joints), convex_pieces(spec), poses)
        for finger, found in zip(hand.fingers, starts, strict=True)
    ]
    # Then the pairs.
    beside = tuple(neighbours(found, found, len(body.cells)) for found in starts)
    friction = np.array([config.start_cone, config.cone]) * hand.friction * spec.friction
    plans = []
    for p, path in enumerate(poses):
        left, right = (Tracks(t.points[p], t.normals[p], t.joints[p], t.held[p]) for t in tracks)
        plans.append(_best(hand, spec, path, ((left, right), beside, friction), config))
    return plans


def clear_for(hand: HandSpec, left: Array, right: Array, most: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return for how many poses, of `most` `(N,)` from the first, no link of the left finger meets one of the right.

    Their joint angles are `(N, S, n)` each.
    """
    from inhand.hands.pair_kernels import shorten
    from inhand.hands.placed import chain_of

    count = most.copy()
    chains, rooms = zip(*(chain_of(hand, finger) for finger in (hand.left, hand.right)), strict=True)
    shorten(chains, rooms, (np.ascontiguousarray(left), np.ascontiguousarray(right)), count)
    return count


def no_grasp(hand: HandSpec, spec: ObjectSpec, why: str) -> InputError:
    """Return the error of an object that cannot be held at the start."""
    return InputError(
        f"no start grasp holds object {spec.name!r} with hand {hand.name!r}: {why}; use another object, hand or start"
    )


def moved_along(finger: FingerSpec, joints: Array, points: Array, shift: Array, step: float = 0.001) -> Array:
    """Return joint angles `(..., n)` whose touching points `(..., 2)` have moved by a shift `(..., 2)` [m].

    In steps of damped least squares, the points fixed to the last link; joint limits are kept.
    """
    # A billionth more: whether a whole number of steps rounds up must not depend on what else is in the batch.
    count = max(int(np.ceil(np.linalg.norm(shift, axis=-1).max() / step + 1e-9)), 1)
    limits = np.array(finger.limits)
    for _ in range(count):
        jacobian = point_jacobian(joint_positions(finger, joints)[..., :-1, :], points)
        joints = np.clip(joints + damped_least_squares(jacobian, shift / count, 1e-3), limits[:, 0], limits[:, 1])
        points = points + shift / count
    return joints


def _starts(hand: HandSpec, finger: FingerSpec, body: Body, pose: Array) -> Postures:
    """Return the postures in which a finger's last link touches the object; of three links, at several inclinations."""
    if len(finger.links) > 2:
        points, normals = transform(pose, body.cells.points), rotate(pose[2], body.cells.normals)
        touches = inclined_touches(hand, finger, points, normals, INCLINATIONS)
        cell, which = np.nonzero(touches.reached)
        joints = touches.joints[cell, which]
        return Postures(np.zeros_like(cell), cell, joints, joints, body.cells.points[cell], body.cells.normals[cell])
    found = touching_postures(hand, finger, body, pose[None])
    return found.only(np.flatnonzero(~np.isnan(found.fixed).any(axis=-1)))


def _roll_all(
    hand: HandSpec, finger: FingerSpec, start: tuple[Array, Array], pieces: tuple[Array, ...], poses: Array
) -> Tracks:
    """Roll every start along every path `(P, S, 3)` in one batch; the tracks' axes are `(P, K, S)`."""
    points, joints = start
    count = len(points)
    starts = Starts(np.tile(points, (len(poses), 1)), np.tile(joints, (len(poses), 1)), pieces)
    flat = roll(hand, finger, starts, np.repeat(poses, count, axis=0))
    shape = (len(poses), count, poses.shape[1])
    tracked, normals, angles = (a.reshape(*shape, -1) for a in (flat.points, flat.normals, flat.joints))
    return Tracks(tracked, normals, angles, flat.held.reshape(shape))


def _best(
    hand: HandSpec,
    spec: ObjectSpec,
    poses: Array,
    found: tuple[tuple[Tracks, Tracks], tuple[NDArray[np.bool_], ...], Array],
    config: SearchConfig,
) -> list[GraspPlan]:
    """Return the plans of the pairs with the best scores whose fingers do not meet, some way apart."""
    (left, right), beside, friction = found
    reach = _common_reach(left, right, friction)
    if reach.max() == 0:
        raise no_grasp(hand, spec, "no two reachable points have their line inside both friction cones")
    way = way_along(poses)
    tilt, offset = _grip_lines(left, right)
    costs = tilt * config.tilt_cost / 0.1 + offset * config.centre_cost
    plans = _clear_plans(hand, (left, right), reach, (way, costs, beside), config)
    if not plans:
        raise no_grasp(hand, spec, "the fingers would meet in every grip that holds it")
    return plans


def _common_reach(left: Tracks, right: Tracks, friction: Array) -> NDArray[np.int64]:
    """Return for how many poses each pair `(L, R)` holds the object, by the friction at the start and on the way."""
    from inhand.hands.pair_kernels import Contacts, common_reach

    reach = np.zeros((len(left.held), len(right.held)), dtype=np.int64)
    if (friction > 0).all():
        least = np.cos(np.arctan(friction))
        one, other = (Contacts(track.points, track.normals, track.held) for track in (left, right))
        common_reach(one, other, (least[0], least[1]), reach)
    return reach


def _clear_plans(
    hand: HandSpec,
    tracks: tuple[Tracks, Tracks],
    reach: NDArray[np.int64],
    judged_by: tuple[Array, Array, tuple[NDArray[np.bool_], ...]],
    config: SearchConfig,
) -> list[GraspPlan]:
    """Return the pairs with the best scores once it counts too that fingers meet, the best first.

    A score is the way a pair carries the object, drawn towards its neighbours' mean, less the cost of its tilt. Pairs
    are looked at in the order of their scores, twice as many at a time, until no pair left could do better.
    """
    way, costs, (beside_left, beside_right) = judged_by
    # The mean of the neighbours' ways, by products with the tables of who is beside whom.
    reached = np.where(reach > 0, way[np.maximum(reach - 1, 0)], 0.0)
    count = beside_left.sum(-1)[:, None] * beside_right.sum(-1)
    around = beside_left.astype(float) @ reached @ beside_right.astype(float) / count
    extra = config.company * (around - reached) - costs
    score = np.where(reach > 0, reached + extra, -np.inf)
    # Whether fingers meet costs most, and only lowers a score: the best are looked at until none left can pass them.
    order = np.argsort(-score, axis=None, kind="stable")
    order = order[np.isfinite(score.ravel()[order])]
    pairs, holds, value, kept = order[:0], order[:0], extra[:0, 0], order[:0]
    while len(value) < len(order):
        block = order[len(value) : 2 * len(value) + config.block]
        if len(kept) == config.count and value[kept[-1]] >= score.ravel()[block[0]]:
            break
        pairs = np.concatenate([pairs, block])
        places = np.unravel_index(block, score.shape)
        # A pair holds until its fingers first meet.
        joints = [track.joints[place] for track, place in zip(tracks, places, strict=True)]
        free = clear_for(hand, joints[0], joints[1], reach.ravel()[block])
        holds = np.concatenate([holds, free])
        found = np.where(free > 0, way[np.maximum(free - 1, 0)] + extra.ravel()[block], -np.inf)
        value = np.concatenate([value, found])
        one, other = np.unravel_index(pairs, score.shape)
        contacts = np.stack([tracks[0].points[one, 0], tracks[1].points[other, 0]], axis=1)
        kept = _apart(value, contacts, config)
    return [_plan(tracks, np.unravel_index(pairs[k], score.shape), int(holds[k])) for k in kept]


def _apart(value: Array, contacts: Array, config: SearchConfig) -> NDArray[np.int64]:
    """Return the best of N plans by number, each with a contact `(N, 2, 2)` some way apart from those before it."""
    kept, left = list[int](), np.isfinite(value)
    while left.any() and len(kept) < config.count:
        kept.append(int(np.where(left, value, -np.inf).argmax()))
        left &= np.linalg.norm(contacts - contacts[kept[-1]], axis=-1).max(axis=-1) >= config.apart
    return np.array(kept, dtype=np.int64)


def _plan(tracks: tuple[Tracks, Tracks], pair: tuple[NDArray[np.int64], ...], reach: int) -> GraspPlan:
    contacts, normals, joints = (
        [getattr(track, name)[k, 0] for track, k in zip(tracks, pair, strict=True)]
        for name in ("points", "normals", "joints")
    )
    return GraspPlan(np.stack(contacts), np.stack(normals), np.concatenate(joints), reach)


def _grip_lines(left: Tracks, right: Tracks) -> tuple[Array, Array]:
    """Return of every pair's grip line at the start its tilt and its distance from the object's middle [m] `(L, R)`.

    The tilt is 1 - cos of the larger angle between the line and the contacts' normals.
    """
    line = right.points[None, :, 0] - left.points[:, None, 0]
    line /= np.maximum(np.linalg.norm(line, axis=-1, keepdims=True), 1e-9)
    cosine = np.minimum(-(line * left.normals[:, None, 0]).sum(-1), (line * right.normals[None, :, 0]).sum(-1))
    return np.asarray(1 - cosine), np.abs(cross(line, left.points[:, None, 0]))
