"""The search for contact points: where to hold an object so that it can be carried farthest along a path.

The thesis names rough initial contacts as the likely cause of its failures towards the palm and proposes a small
optimisation search (thesis 5.1). This is it: points all round the outline are tried for each finger; a contact rolls
without slipping as its finger turns; a pair counts while the line between the contacts lies inside both friction
cones (planar two-finger force closure) and no link meets object, palm or other finger.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter, uniform_filter

from inhand.errors import InputError
from inhand.geometry import Array, rotate, transform
from inhand.sim.force_closure import force_closure
from inhand.sim.hands import FINGER_NAMES, FingerSpec, HandSpec
from inhand.sim.objects import ObjectSpec, convex_pieces, outline, polygon
from inhand.sim.outlines import corner_contacts
from inhand.sim.polygons import separation
from inhand.sim.rolling import Starts, Tracks, roll
from inhand.sim.shapes import link_polygons
from inhand.sim.touch import touch

SHARP = np.deg2rad(30)
"""Turn from which a corner of the outline is a corner to a fingertip [rad], guessed."""
CORNER_NORMALS = 9
"""Directions from which a fingertip is tried on a corner."""
NEIGHBOURS = 7
"""Start contacts along each finger's outline that count as neighbours."""


@dataclass(frozen=True)
class SearchConfig:
    """How contacts are searched and judged."""

    spacing: float = 0.002
    """Distance between tried points of the outline [m]."""
    edge: float = 0.002
    """Contacts start this far from the corners of a face [m]."""
    cone: float = 0.65
    """Share of the friction coefficient that the line between the contacts may use."""
    tilt_cost: float = 0.012
    """Progress given up for a grip line that starts at the edge of the cone, not along the normals [m]."""
    company: float = 0.2
    """Weight of the neighbours' progress: a start whose neighbours reach as far forgives noise."""
    opening: float = 0.010
    """How far the fingertips stand off the object before they close [m]."""
    squeeze: float = 0.002
    """How far inside the object the fingertips aim when they close, which presses them on [m]."""
    block: int = 24
    """Pairs whose fingers are checked against each other at a time."""
    near_enough: int = 3
    """Poses by which the best pair so far may fall short of what is still left to check."""


@dataclass(frozen=True)
class GraspPlan:
    """Where to hold an object for one path."""

    contacts: Array
    """Start contacts of the left and right finger in the object frame `(2, 2)` [m]."""
    opened: Array
    """Joint angles that stand off both contacts `(n_joints,)` [rad]."""
    closed: Array
    """Joint angles that press on both contacts `(n_joints,)` [rad]."""
    reach: int
    """Number of poses of the path, from the first, that this grip can follow."""


def plan_grasps(hand: HandSpec, spec: ObjectSpec, poses: Array, config: SearchConfig | None = None) -> list[GraspPlan]:
    """Return for every path the grasp that carries the object farthest along it.

    Args:
        hand: the hand.
        spec: the object.
        poses: object poses along P paths from one start pose, in the palm frame `(P, S, 3)`.
        config: how to search.

    Raises:
        InputError: no pair of contacts holds the object at the start; the text says which constraint fails.
    """
    config = config or SearchConfig()
    try:
        return _plans(hand, spec, poses, (outline(spec, config.spacing),), config)
    except InputError:
        # No two faces that lie in each other's friction cones, as of a triangle: hold it by its corners too.
        corners = corner_contacts(polygon(spec), SHARP, CORNER_NORMALS)
        return _plans(hand, spec, poses, (outline(spec, config.spacing), corners), config)


def _plans(
    hand: HandSpec, spec: ObjectSpec, poses: Array, tried: tuple[tuple[Array, Array], ...], config: SearchConfig
) -> list[GraspPlan]:
    """Return the best grasp for every path with contacts at the points and normals that are tried."""
    starts = [_reachable(hand, finger, tried, poses[0, 0], config) for finger in hand.fingers]
    for side, (points, _) in zip(FINGER_NAMES, starts, strict=True):
        if len(points) == 0:
            raise _no_grasp(hand, spec, f"the {side} finger reaches no point of it within its joint limits")
    tracks = [
        _roll_all(hand, finger, start, convex_pieces(spec), poses)
        for finger, start in zip(hand.fingers, starts, strict=True)
    ]
    friction = config.cone * hand.friction * spec.friction
    plans = []
    for p, path in enumerate(poses):
        left, right = (Tracks(t.points[p], t.normals[p], t.joints[p], t.held[p]) for t in tracks)
        plans.append(_best(hand, spec, path, ((left, right), friction), config))
    return plans


def fingers_clear(hand: HandSpec, left: Array, right: Array) -> NDArray[np.bool_]:
    """Return whether no link of the left finger meets one of the right, for joint angles `(..., n)` each."""
    clear = np.ones(left.shape[:-1], dtype=bool)
    others = link_polygons(hand, hand.right, right)
    for link in link_polygons(hand, hand.left, left):
        for other in others:
            clear &= separation(link, other) > 0
    return clear


def _reachable(
    hand: HandSpec, finger: FingerSpec, tried: tuple[tuple[Array, Array], ...], pose: Array, config: SearchConfig
) -> tuple[Array, Array]:
    """Return the points `(K, 2)` that a finger can touch at the start, with its joint angles."""
    points, normals = tried[0]
    corner = (normals * np.roll(normals, 1, axis=0)).sum(-1) < np.cos(SHARP)
    corners = ((points + np.roll(points, 1, axis=0)) / 2)[corner]
    inner = np.linalg.norm(points[:, None] - corners, axis=-1).min(axis=-1, initial=np.inf) >= config.edge
    others = sum(len(part) for part, _ in tried[1:])
    points, normals = (np.concatenate(part) for part in zip(*tried, strict=True))
    touches = touch(hand, finger, transform(pose, points), rotate(pose[2], normals))
    chosen = touches.reached & np.concatenate([inner, np.ones(others, dtype=bool)])
    return points[chosen], touches.joints[chosen]


def _roll_all(
    hand: HandSpec, finger: FingerSpec, start: tuple[Array, Array], body: tuple[Array, ...], poses: Array
) -> Tracks:
    """Roll every start along every path `(P, S, 3)` in one batch; the tracks' axes are `(P, K, S)`."""
    points, joints = start
    count = len(points)
    starts = Starts(np.tile(points, (len(poses), 1)), np.tile(joints, (len(poses), 1)), body)
    flat = roll(hand, finger, starts, np.repeat(poses, count, axis=0))
    shape = (len(poses), count, poses.shape[1])
    tracked, normals, angles = (a.reshape(*shape, -1) for a in (flat.points, flat.normals, flat.joints))
    return Tracks(tracked, normals, angles, flat.held.reshape(shape))


def _no_grasp(hand: HandSpec, spec: ObjectSpec, why: str) -> InputError:
    return InputError(
        f"no start grasp holds object {spec.name!r} with hand {hand.name!r}: {why}; use another object, hand or start"
    )


def _best(
    hand: HandSpec, spec: ObjectSpec, poses: Array, found: tuple[tuple[Tracks, Tracks], float], config: SearchConfig
) -> GraspPlan:
    """Return the plan of the pair with the best score whose fingers do not meet."""
    (left, right), friction = found
    closed = force_closure(
        friction,
        (left.points[:, None], left.normals[:, None]),
        (right.points[None], right.normals[None]),
    )
    held = left.held[:, None] & right.held[None] & closed
    reach = np.cumprod(held, axis=-1).sum(axis=-1)
    if reach.max() == 0:
        raise _no_grasp(hand, spec, "no two reachable points have their line inside both friction cones")
    robust = np.minimum(minimum_filter(reach, size=3, mode="nearest") + 1, reach)
    score = _score(np.where(reach > 0, np.maximum(robust, 1), 0), poses, (left, right), config)
    pair, free = _clear_pair(hand, (left, right), reach, score, config)
    if free == 0:
        raise _no_grasp(hand, spec, "the fingers would meet in every grip that holds it")
    return _plan(hand, poses[0], (left, right), (pair, free), config)


def _clear_pair(
    hand: HandSpec, tracks: tuple[Tracks, Tracks], reach: NDArray[np.int64], score: Array, config: SearchConfig
) -> tuple[NDArray[np.int64], int]:
    """Return the pair that goes farthest before its fingers meet, and how many poses that is.

    Pairs are looked at in the order of their scores, a block at a time, until no pair left could go farther.
    """
    left, right = tracks
    order = np.argsort(-score, axis=None, kind="stable")
    order = order[np.isfinite(score.ravel()[order])]
    most = reach.ravel()[order]
    best, farthest = np.zeros(2, dtype=np.int64), 0
    for start in range(0, len(order), config.block):
        if start and farthest >= most[start:].max() - config.near_enough:
            break
        pairs = np.stack(np.unravel_index(order[start : start + config.block], score.shape), axis=-1)
        clear = fingers_clear(hand, left.joints[pairs[:, 0]], right.joints[pairs[:, 1]])
        free = np.minimum(np.cumprod(clear, axis=-1).sum(axis=-1), most[start : start + config.block])
        if free.max() > farthest:
            best, farthest = pairs[int(np.argmax(free))], int(free.max())
    return best, farthest


def _score(reach: NDArray[np.int64], poses: Array, tracks: tuple[Tracks, Tracks], config: SearchConfig) -> Array:
    """Return the progress [m] each pair reaches, less what a tilted or a lonely start costs `(K, K)`."""
    steps = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=-1) + np.abs(np.diff(poses[:, 2])) * 0.02
    progress = np.concatenate([[0.0], np.cumsum(steps)])
    left, right = tracks
    line = right.points[None, :, 0] - left.points[:, None, 0]
    line /= np.maximum(np.linalg.norm(line, axis=-1, keepdims=True), 1e-9)
    cosine = np.minimum(-(line * left.normals[:, None, 0]).sum(-1), (line * right.normals[None, :, 0]).sum(-1))
    reached = np.where(reach > 0, progress[np.maximum(reach - 1, 0)], 0.0)
    around = uniform_filter(reached, size=NEIGHBOURS, mode="constant")
    value = reached + config.company * (around - reached) - config.tilt_cost * (1 - cosine) / 0.1
    return np.where(reach > 0, value, -np.inf)


def _plan(
    hand: HandSpec,
    pose: Array,
    tracks: tuple[Tracks, Tracks],
    found: tuple[NDArray[np.int64], int],
    config: SearchConfig,
) -> GraspPlan:
    pair, reach = found
    contacts = np.stack([track.points[k, 0] for track, k in zip(tracks, pair, strict=True)])
    opened, closed = np.empty(hand.n_joints), np.empty(hand.n_joints)
    for i, (finger, place) in enumerate(zip(hand.fingers, hand.slices, strict=True)):
        normal = tracks[i].normals[pair[i], 0]
        touching = tracks[i].joints[pair[i], 0]
        away = np.array([-0.15 * finger.bend] + [0.0] * (len(finger.links) - 1))
        for goal, shift, fallback in ((opened, config.opening, touching + away), (closed, -config.squeeze, touching)):
            there = touch(hand, finger, transform(pose, contacts[i] + shift * normal), rotate(pose[2], normal))
            goal[place] = there.joints if there.reached else fallback
    return GraspPlan(contacts, opened, closed, reach)
