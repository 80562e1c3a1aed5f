"""Where one finger can touch an object, for many poses at once.

The contact of a finger's link with the object is a pair of places on the two normal bundles. The pair fixes the link's
angle and the place of its joint relative to the object,

    phi = angle(-n) - angle(m),   d = c - R(phi) s,

with point c and normal n of the object and point s and normal m of the link; both outlines being convex, they do not
overlap there. What is left is whether the links before can bring the joint to d: a link of two joints asks
|d - base| = first link, one of three has room to spare, and the first link turns on its base alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array, inverse_transform, rotate, transform, wrap_angle
from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.kinematics import joint_positions, link_angles
from inhand.hands.polygons import contact, edge_normals, separation
from inhand.hands.reach.bundles import Bundle, knots
from inhand.hands.shapes import link_outline, link_polygons, palm_outline
from inhand.hands.touch import within_limits

LINK_SPACING = 0.004
"""Distance between places on a link's outline, between which the miss is nearly linear [m]."""
LINK_FAN = np.deg2rad(6.0)
"""Angle between places on a link's corner [rad]."""
OVERLAP = 2e-5
"""Overlap of two outlines that still counts as touching [m]."""
FREE_BENDS = np.deg2rad([0.0, 30.0, -30.0, 60.0, -60.0, 100.0, -100.0, 140.0, -140.0])
"""Bends tried for a link beyond the one that touches [rad]."""
FIRST_LINK_STEP = np.deg2rad(2.0)
"""Step of the first link's angle [rad]."""
ROOT_STEPS = 2
"""Steps of false position between two places: 0.2 mm off after one, a few micrometres after two."""
NORMAL_ARM = 0.01
"""Arm at which the turn of a normal counts as a distance, where the nearest cell is looked for [m]."""
STRIDE = 4
"""Of the places on a third link every so many-th is tried, since its posture has room to change."""
ROUNDS = 16
"""Postures of a three-link finger that are tried for one contact."""


@dataclass(frozen=True)
class Body:
    """The object: its outline's cells and its convex pieces, in its own frame."""

    cells: Bundle
    """Cells of the outline, U of them."""
    pieces: tuple[Array, ...]
    """Convex pieces `(M, 2)` [m]."""
    chosen: NDArray[np.int64] | None = None
    """Cells that a finger's outer links are looked for at, by number; None for all."""

    @property
    def numbers(self) -> NDArray[np.int64]:
        """Numbers of the cells that are looked at."""
        return np.arange(len(self.cells)) if self.chosen is None else self.chosen

    def nearest(self, points: Array, normals: Array) -> NDArray[np.int64]:
        """Return the cells `(N,)` nearest to points `(N, 2)` [m] with outward unit normals `(N, 2)`."""
        away = np.linalg.norm(points[:, None] - self.cells.points, axis=-1)
        turned = np.linalg.norm(normals[:, None] - self.cells.normals, axis=-1)
        return np.asarray((away + NORMAL_ARM * turned).argmin(axis=-1))


@dataclass(frozen=True)
class Postures:
    """Ways in which one finger touches an object, N of them over several poses."""

    pose: NDArray[np.int64]
    """Index of the pose `(N,)`."""
    cell: NDArray[np.int64]
    """Cell of the outline that is touched `(N,)`."""
    joints: Array
    """Joint angles `(N, n)` [rad]."""
    fixed: Array
    """The same where the contact fixes them, NaN where they have room to change `(N, n)` [rad]."""
    points: Array
    """The contacts in the object's frame `(N, 2)` [m]."""
    normals: Array
    """The object's outward unit normals there `(N, 2)`."""

    def only(self, chosen: NDArray[np.bool_] | NDArray[np.int64] | slice) -> Postures:
        """Return the chosen postures."""
        return Postures(*(getattr(self, field.name)[chosen] for field in fields(self)))


def touching_postures(hand: HandSpec, finger: FingerSpec, body: Body, poses: Array) -> Postures:
    """Return how a finger can touch the object at poses `(P, 3)` in the palm frame, sorted by pose.

    Any link may touch. Joint limits are kept, and no link overlaps object or palm.
    """
    searches = (_by_first_link, _by_second_link, _by_third_link)
    parts = [part for search in searches[: len(finger.links)] for part in search(hand, finger, body, poses)]
    found = joined(parts)
    return found.only(np.argsort(found.pose, kind="stable"))


def joined(parts: Sequence[Postures]) -> Postures:
    """Return the postures of several sets in one."""
    return Postures(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Postures)))


def _contacts(finger: FingerSpec, hand: HandSpec, link: int, body: Body) -> tuple[Array, Array]:
    """Return the joint of a link `(U, B, 2)` [m] and the link's angle `(U, B)` [rad] for all pairs of places.

    In the object's frame, for the cells that are looked at and the link's places from `knots`.
    """
    places = _link_places(hand, finger, link)
    angle = body.cells.angles[body.numbers, None] + np.pi - places.angles
    return body.cells.points[body.numbers, None] - rotate(angle, places.points), angle


@cache
def _link_places(hand: HandSpec, finger: FingerSpec, link: int) -> Bundle:
    """Return the places on a link's outline, found once for all poses."""
    return knots(link_outline(hand, finger, link), LINK_SPACING, LINK_FAN)


def _by_second_link(hand: HandSpec, finger: FingerSpec, body: Body, poses: Array) -> list[Postures]:
    """Find |d - base| = first link between neighbouring places of the second link, by false position."""
    joint, angle = _contacts(finger, hand, 1, body)
    base = inverse_transform(poses, np.array(finger.base))
    # |d - base|^2 - first^2 is a product of what the contact gives and what the pose gives: one matrix product for all.
    squares = np.stack([(joint**2).sum(-1), -2 * joint[..., 0], -2 * joint[..., 1], np.ones(angle.shape)])
    rest = np.stack([np.ones(len(poses)), *base.T, (base**2).sum(-1) - finger.links[0] ** 2])
    # Single precision is good for nanometres, and only finds where to look.
    rough = rest.T.astype(np.float32) @ squares.reshape(4, -1).astype(np.float32)
    outside = (rough > 0).reshape(len(poses), *angle.shape)
    # Where the sign changes between two places of the link, one between them is a contact.
    pose, cell, knot = np.nonzero(outside[..., 1:] != outside[..., :-1])
    low, high = ((squares[:, cell, knot + k] * rest[:, pose]).sum(axis=0) for k in (0, 1))
    number = body.numbers[cell]
    places = _link_places(hand, finger, 1)
    steps = np.diff(places.points, axis=0)[knot], np.diff(places.angles)[knot]
    start, end = np.zeros(len(pose)), np.ones(len(pose))
    for _ in range(ROOT_STEPS):
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.clip(np.nan_to_num(start + (end - start) * low / (low - high)), 0.0, 1.0)
        turn = angle[cell, knot] - share * steps[1]
        place = body.cells.points[number] - rotate(turn, places.points[knot] + share[:, None] * steps[0]) - base[pose]
        miss = (place**2).sum(axis=-1) - finger.links[0] ** 2
        # The end of the bracket on the same side as the new place moves to it.
        before = (miss > 0) == (low > 0)
        start, low = np.where(before, share, start), np.where(before, miss, low)
        end, high = np.where(before, end, share), np.where(before, high, miss)
    # The first link points from the base to the joint; the second's angle was found in the object's frame.
    first = np.arctan2(-place[:, 0], place[:, 1]) + poses[pose, 2]
    pair = np.stack([wrap_angle(first), wrap_angle(turn + poses[pose, 2] - first)], axis=-1)
    found = Postures(pose, number, pair, pair, body.cells.points[number], body.cells.normals[number])
    return [_with_free_links(hand, finger, body, poses, found, link=1)]


def _by_first_link(hand: HandSpec, finger: FingerSpec, body: Body, poses: Array) -> list[Postures]:
    """Turn the first link about its base and find where it meets and leaves the object."""
    low, high = finger.limits[0]
    # The links beyond do not matter to where the first one is: they stay straight.
    angles = np.arange(max(low, -np.pi), min(high, np.pi) + FIRST_LINK_STEP, FIRST_LINK_STEP)
    postures = np.zeros((len(angles), len(finger.links)))
    postures[:, 0] = angles
    links = link_polygons(hand, finger, postures)[0]
    parts = []
    for piece in body.pieces:
        near, step = np.nonzero(_in_the_way(links, np.array(finger.base), poses, piece))
        gap = np.full((len(poses), len(angles)), np.inf)
        gap[near, step] = separation(links[step], transform(poses[near, None], piece))
        outside = gap > 0
        # Steps that were not near are infinitely far and no crossing; between two steps the gap is taken for linear.
        pose, step = np.nonzero((outside[:, 1:] != outside[:, :-1]) & np.isfinite(gap[:, 1:] + gap[:, :-1]))
        before, after = gap[pose, step], gap[pose, step + 1]
        turn = angles[step] + before / (before - after) * FIRST_LINK_STEP
        if len(pose) > 0:
            parts.append(_first_link_cells(hand, finger, (body, piece), poses, (pose, turn)))
    return [_with_free_links(hand, finger, body, poses, part, link=0) for part in parts]


def _in_the_way(links: Array, base: Array, poses: Array, piece: Array) -> NDArray[np.bool_]:
    """Return at which poses and angles `(P, S)` a piece may be near the first link, of outlines `(S, K, 2)` [m].

    Both are taken for discs of which one turns about the base; a step of the angle is added on either side.
    """
    middle, outlines = piece.mean(axis=0), links.mean(axis=1)
    size = np.linalg.norm(piece - middle, axis=-1).max() + np.linalg.norm(links[0] - outlines[0], axis=-1).max()
    away = np.linalg.norm(transform(poses, middle)[:, None] - outlines, axis=-1)
    step = FIRST_LINK_STEP * float(np.linalg.norm(outlines[0] - base))
    return np.asarray(away < size + step)


def _first_link_cells(
    hand: HandSpec,
    finger: FingerSpec,
    object_: tuple[Body, Array],
    poses: Array,
    found: tuple[NDArray[np.int64], Array],
) -> Postures:
    """Return where the first link touches a piece, once for the nearest cell and once for each beside it.

    The contact is where it is; the cells only say which contacts are neighbours.
    """
    (body, piece), (pose, turn) = object_, found
    joints = np.zeros((len(pose), len(finger.links)))
    joints[:, 0] = turn
    link = link_polygons(hand, finger, joints)[0]
    _, points, normals = contact(link, transform(poses[pose, None], piece))
    points, normals = inverse_transform(poses[pose], points), rotate(-poses[pose, 2], normals)
    cell = body.nearest(points, normals)
    # A contact between two cells is a neighbour of both.
    around = (cell[:, None] + np.array([-1, 0, 1])).ravel() % len(body.cells)
    first = np.repeat(joints[:, :1], 3, axis=0)
    return Postures(
        np.repeat(pose, 3), around, first, first, np.repeat(points, 3, axis=0), np.repeat(normals, 3, axis=0)
    )


def _by_third_link(hand: HandSpec, finger: FingerSpec, body: Body, poses: Array) -> list[Postures]:
    """Reach each place of the third link with the first two, in the least bent posture that is free."""
    joint, angle = (part[:, ::STRIDE] for part in _contacts(finger, hand, 2, body))
    base = inverse_transform(poses, np.array(finger.base))
    first, second = finger.links[:2]
    # Two links that end at the third's joint: the law of cosines bends them one way or the other.
    place = joint - base[:, None, None]
    heading = np.arctan2(-place[..., 0], place[..., 1])
    with np.errstate(invalid="ignore"):
        cosine = ((place**2).sum(-1) - first**2 - second**2) / (2 * first * second)
        bend = np.stack([np.arccos(cosine), -np.arccos(cosine)], axis=-1)
    start = heading[..., None] - np.arctan2(second * np.sin(bend), first + second * np.cos(bend))
    # The least bent posture is tried first, the next one where that is not free.
    last = wrap_angle(angle[None, ..., None] - start - bend)
    cost = np.where(np.isfinite(bend), bend**2 + last**2, np.inf)
    count = len(poses), len(body.numbers), -1
    cost, bend, last = cost.reshape(count), bend.reshape(count), last.reshape(count)
    start = start.reshape(count)
    order = np.argsort(cost, axis=-1)[..., :ROUNDS]
    found: list[Postures] = []
    open_ = np.ones(cost.shape[:2], dtype=bool)
    for k in range(ROUNDS):
        pose, cell = np.nonzero(open_ & np.isfinite(np.take_along_axis(cost, order[..., k : k + 1], -1)[..., 0]))
        which = order[pose, cell, k]
        at = (pose, cell, which)
        joints = np.stack([wrap_angle(start[at] + poses[pose, 2]), bend[at], last[at]], axis=-1)
        number = body.numbers[cell]
        places = body.cells.points[number], body.cells.normals[number]
        part = Postures(pose, number, joints, np.full_like(joints, np.nan), *places)
        free = _is_free(hand, finger, body, poses, part, link=2)
        open_[pose[free], cell[free]] = False
        found.append(part.only(free))
    return found


def _with_free_links(
    hand: HandSpec, finger: FingerSpec, body: Body, poses: Array, found: Postures, *, link: int
) -> Postures:
    """Return postures of the joints up to `link`, which touches, each with a bend of the rest that is free."""
    beyond = len(finger.links) - 1 - link
    zero = np.zeros((len(found.pose), beyond))
    joints = np.concatenate([found.joints, zero], axis=-1)
    found = replace(found, joints=joints, fixed=np.concatenate([found.fixed, zero + np.nan], axis=-1))
    done = [found.only(slice(0))]
    for bend in FREE_BENDS[: len(FREE_BENDS) if beyond else 1]:
        if len(found.pose) == 0:
            break
        found.joints[:, link + 1 : link + 2] = bend
        # Each posture keeps the first bend that is free, and only those without one go on.
        clear = _is_free(hand, finger, body, poses, found, link=link)
        done.append(found.only(clear))
        found = found.only(~clear)
    return joined(done)


def _is_free(
    hand: HandSpec, finger: FingerSpec, body: Body, poses: Array, found: Postures, *, link: int
) -> NDArray[np.bool_]:
    """Return which postures keep the joints' limits and overlap neither object nor palm."""
    free = within_limits(finger, found.joints)
    # The dearer checks only look at what the cheaper ones left.
    at = np.flatnonzero(free)
    joints, angles = joint_positions(finger, found.joints[at]), link_angles(found.joints[at])
    places = np.concatenate([joints[:, :-1], angles[..., None]], axis=-1)
    palm = palm_outline(hand)
    clear = np.ones(len(at), dtype=bool)
    for i in range(len(finger.links)):
        shape = link_outline(hand, finger, i)
        if i > 0:
            # A link that is higher than the palm all along is not compared with it.
            low = joints[:, i : i + 2, 1].min(axis=-1) - _room(shape, finger.links[i]) < palm[:, 1].max()
            left = np.flatnonzero(clear & low)
            clear[left] &= _apart(shape, places[left, i], palm, np.zeros((len(left), 3)))
        # A convex object cannot overlap the link that touches it.
        if i == link and len(body.pieces) == 1 and link > 0:
            continue
        for piece in body.pieces:
            left = np.flatnonzero(clear)
            clear[left] &= _apart(shape, places[left, i], piece, poses[found.pose[at[left]]])
    free[at] = clear
    return free


def _apart(shape: Array, places: Array, other: Array, poses: Array) -> NDArray[np.bool_]:
    """Return whether a link's outline at places `(N, 3)` and another at poses `(N, 3)` keep apart `(N,)`.

    As `separation`, in the frame of the outline whose edges are looked at, where its normals are always the same. The
    other's middle and the circle around it settle most.
    """
    middle = other.mean(axis=0)
    size = float(np.linalg.norm(other - middle, axis=-1).max())
    height = _height(shape, inverse_transform(places, transform(poses, middle))[:, None])
    apart = height > size
    left = np.flatnonzero(~apart & (height > 0))
    # First over the edges of the link, then, for those that this leaves, over the edges of the other.
    apart[left] = _height(shape, inverse_transform(places[left, None], transform(poses[left, None], other))) > -OVERLAP
    left = left[~apart[left]]
    corners = inverse_transform(poses[left, None], transform(places[left, None], shape))
    apart[left] = _height(other, corners) > -OVERLAP
    return np.asarray(apart)


def _height(faces: Array, corners: Array) -> Array:
    """Return the largest height `(N,)` [m] of all corners `(N, M, 2)` over an edge of an outline `(K, 2)`."""
    normals = edge_normals(faces)
    height = normals @ np.swapaxes(corners, -1, -2)
    return np.asarray((height.min(axis=-1) - (normals * faces).sum(axis=-1)).max(axis=-1))


def _room(shape: Array, length: float) -> float:
    """Return how far a link's outline reaches from the line between its joint and the next [m]."""
    along = np.clip(shape[:, 1], 0.0, length)
    return float(np.hypot(shape[:, 0], shape[:, 1] - along).max())
