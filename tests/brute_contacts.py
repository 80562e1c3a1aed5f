"""Where a two-link finger can touch an upright box, found slowly and plainly; see `brute_reach`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.polygons import contact

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
DEEPEST = 1e-5
"""Overlap that still counts as touching [m]."""


@dataclass(frozen=True)
class Grid:
    """How fine the search is, and how near its points are that count as one small step apart."""

    step: float = 0.001
    """Step of the object along the path [m]."""
    last_step: float = 0.00025
    """Step with which the end is approached again [m]."""
    slide: float = 0.001
    """Step along faces [m]."""
    turn: float = np.deg2rad(1.0)
    """Step of a link's angle [rad]."""
    free_turn: float = np.deg2rad(6.0)
    """Step of the second link's angle where only the first touches [rad]."""

    @property
    def near(self) -> Array:
        """Largest steps `(5,)` of two joints [rad], the contact's x and y [m] and the normal's angle [rad]."""
        joint = 4 * self.turn
        return np.array([joint, max(joint, 1.5 * self.free_turn), 2.5 * self.slide, 2.5 * self.slide, 3 * self.turn])


@dataclass(frozen=True)
class Family:
    """A line of contacts: place t of the box, p + t u, on place t of a link, s + t v, for a range of link angles."""

    p: Array
    u: Array
    s: Array
    v: Array
    length: float
    low: float
    """Smallest angle of the link [rad]."""
    span: float
    """Range of its angle [rad]."""
    normal: float
    """Angle of the box's outward normal [rad], when the link's angle is 0 if `turns`."""
    turns: bool
    """Whether the normal is the link's and turns with it."""


@dataclass(frozen=True)
class Touches:
    """Contacts of one finger, N of them at several poses."""

    pose: NDArray[np.int64]
    """Which pose `(N,)`."""
    place: Array
    """Two joint angles [rad], the contact in the box's frame [m], the angle of the box's normal [rad] and the link,
    0 or 1 `(N, 6)`."""

    def only(self, chosen: Mask | NDArray[np.int64]) -> Touches:
        """Return the chosen ones."""
        return Touches(self.pose[chosen], self.place[chosen])


def turned(angle: Array | float, vector: Array) -> Array:
    """Return vectors `(..., 2)` turned by angles `(...)`."""
    c, s, x, y = np.cos(angle), np.sin(angle), vector[..., 0], vector[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def wrapped(angle: Array) -> Array:
    """Return angles between -pi and pi."""
    return np.asarray(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


def link_corners(hand: HandSpec, finger: FingerSpec, link: int) -> Array:
    """Return a link's corners `(K, 2)`, counter-clockwise from the lower left: a box, the last with a round end."""
    half, bottom, top = hand.link_width / 2, hand.joint_gap, finger.links[link]
    if link == 0:
        return np.array([(-half, bottom), (half, bottom), (half, top), (-half, top)])
    cap = [(half * np.cos(k * np.pi / 16), top - hand.tip_length * (1 - np.sin(k * np.pi / 16))) for k in range(17)]
    return np.array([(-half, bottom), (half, bottom), *cap])


def placed_links(hand: HandSpec, finger: FingerSpec, joints: Array) -> tuple[Array, Array]:
    """Return the corners `(N, K, 2)` of both links in the palm frame at joint angles `(N, 2)`."""
    first, both = joints[:, :1], joints.sum(axis=1)[:, None]
    base = np.array(finger.base)
    elbow = base + turned(first, np.array([0.0, finger.links[0]]))
    return (
        base + turned(first, link_corners(hand, finger, 0)),
        elbow + turned(both, link_corners(hand, finger, 1)),
    )


def overlapping(first: Array, second: Array) -> Mask:
    """Return which convex polygons `(N, K, 2)` and `(N, M, 2)` overlap: no edge of either has the other outside."""
    sides = [np.ascontiguousarray(np.moveaxis(polygon, 0, -1)) for polygon in (first, second)]  # (K, 2, N)
    low, high = ([bound(side, axis=0) for side in sides] for bound in (np.min, np.max))
    found = np.flatnonzero(((low[0] < high[1]) & (low[1] < high[0])).all(axis=0))
    sides = [side[..., found] for side in sides]
    for one, other in ((0, 1), (1, 0)):
        for k in range(len(sides[one])):
            corner = sides[one][k]
            edge = sides[one][(k + 1) % len(sides[one])] - corner
            away = sides[other] - corner
            height = (edge[1] * away[:, 0] - edge[0] * away[:, 1]).min(axis=0) / np.hypot(*edge)
            inside = height < -DEEPEST
            found = found[inside]
            sides = [side[..., inside] for side in sides]
    mask = np.zeros(len(first), dtype=bool)
    mask[found] = True
    return mask


def _edges(corners: Array) -> tuple[Array, Array, Array, Array]:
    """Return each edge's direction and length, its normal's angle and the normal's turn at the corner before it."""
    edge = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(edge, axis=1)
    angle = np.arctan2(-edge[:, 0], edge[:, 1])
    return edge / length[:, None], length, angle, np.remainder(angle - np.roll(angle, 1), 2 * np.pi)


def families(box: Array, link: Array, normal_step: float) -> list[Family]:
    """Return all contacts of two convex polygons but those face on face: corner on face, face on corner, corners."""
    u, box_length, a, box_turn = _edges(box)
    v, link_length, b, link_turn = _edges(link)
    zero, found = np.zeros(2), []
    for k in range(len(box)):
        for j in range(len(link)):
            start = np.pi - b[j - 1] - link_turn[j]
            found.append(
                Family(box[k], u[k], link[j], zero, box_length[k], a[k] + start, link_turn[j], a[k], turns=False)
            )
            low = a[k - 1] + np.pi - b[j]
            found.append(
                Family(box[k], zero, link[j], v[j], link_length[j], low, box_turn[k], b[j] - np.pi, turns=True)
            )
            normals = a[k - 1] + np.arange(normal_step, box_turn[k] - 1e-9, normal_step)
            found += [
                Family(box[k], zero, link[j], zero, 0.0, n + start, link_turn[j], n, turns=False) for n in normals
            ]
    return found


class Finger:
    """One finger and a box: tables of what can touch, and the solutions for the box's poses."""

    def __init__(self, hand: HandSpec, finger: FingerSpec, box: Array, grid: Grid) -> None:
        """Lay the grids."""
        self.hand, self.finger, self.box, self.grid = hand, finger, box, grid
        self.first = families(box, link_corners(hand, finger, 0), grid.turn)
        self.lines = families(box, link_corners(hand, finger, 1), grid.turn)
        self.by_angle = self._by_angle()
        self.by_place = self._by_place()
        self.flat = self._flat()

    def touches(self, positions: Array) -> Touches:
        """Return every contact at box positions `(P, 2)`, sorted by position."""
        base = np.array(self.finger.base) - positions
        parts = [*self._second_link(base), self._first_link(base)]
        pose = np.concatenate([part.pose for part in parts])
        found = Touches(pose, np.concatenate([part.place for part in parts]))
        low, high = np.array(self.finger.limits).T
        joints = found.place[:, :2]
        found = found.only(((joints >= low) & (joints <= high)).all(axis=1))
        links = placed_links(self.hand, self.finger, found.place[:, :2])
        placed = self.box + positions[found.pose][:, None]
        palm = np.broadcast_to(palm_corners(self.hand), (len(placed), 4, 2))
        free = ~overlapping(links[0], placed) & ~overlapping(links[1], placed) & ~overlapping(links[1], palm)
        found = found.only(free)
        return found.only(np.argsort(found.pose, kind="stable"))

    def _by_angle(self) -> tuple[Array, ...]:
        """Return rows of every line of contacts with link angles from the grid: joint = c + t d, and the rest."""
        rows: list[list[Array]] = []
        for line in self.lines:
            if line.length == 0:
                continue
            angle = line.low + np.linspace(0, line.span, int(np.ceil(line.span / self.grid.turn)) + 1)
            one = np.ones((len(angle), 1))
            joint, along = line.p - turned(angle, line.s), line.u - turned(angle, line.v)
            normal = line.normal + (angle if line.turns else 0 * angle)
            rows.append([joint, along, line.length * one[:, 0], angle, normal, line.p * one, line.u * one])
        return tuple(np.concatenate([row[i] for row in rows]) for i in range(7))

    def _flat(self) -> tuple[Array, ...]:
        """Return rows of the second link's faces on the box's, for points of the box's face from the grid."""
        u, box_length, a, _ = _edges(self.box)
        link = link_corners(self.hand, self.finger, 1)
        _, link_length, b, _ = _edges(link)
        rows: list[list[Array]] = []
        for k in range(len(self.box)):
            for j in range(len(link)):
                where = np.linspace(0, box_length[k], int(np.ceil(box_length[k] / self.grid.slide)) + 1)
                one, angle = np.ones((len(where), 1)), a[k] + np.pi - b[j]
                joint = self.box[k] - turned(angle, link[j])
                numbers = (link_length[j] * one[:, 0], angle * one[:, 0], a[k] * one[:, 0])
                rows.append([joint * one, u[k] * one, *numbers, self.box[k] + where[:, None] * u[k], where])
        return tuple(np.concatenate([row[i] for row in rows]) for i in range(7))

    def _by_place(self) -> tuple[Array, ...]:
        """Return rows of every line of contacts with places from the grid: box and link place, and the rest."""
        rows: list[list[Array]] = []
        for line in self.lines:
            t = np.linspace(0, line.length, int(np.ceil(line.length / self.grid.slide)) + 1)[:, None]
            numbers = np.array([line.low, line.span, line.normal, line.turns]) * np.ones_like(t)
            rows.append([line.p + t * line.u, line.s + t * line.v, numbers])
        return tuple(np.concatenate([row[i] for row in rows]) for i in range(3))

    def _second_link(self, base: Array) -> Iterator[Touches]:
        """Give contacts of the second link whose joint is one first link away from bases `(P, 2)`."""
        first = self.finger.links[0]
        for table, flat in ((self.by_angle, False), (self.flat, True)):
            joint, along, length, angle, normal, p, u = table
            gap = joint - base[:, None]
            middle = -(gap * along).sum(-1)
            square = middle**2 - (gap**2).sum(-1) + first**2
            for sign in (-1, 1):
                t = middle + sign * np.sqrt(np.maximum(square, 0))
                where = (t - length <= u) & (u <= t) if flat else (t >= 0) & (t <= length)
                pose, row = np.nonzero((square >= 0) & where)
                place = t[pose, row][:, None]
                point = p[row] if flat else p[row] + place * u[row]
                yield self._solved(base, pose, joint[row] + place * along[row], angle[row], (point, normal[row]))
        p, s, numbers = self.by_place
        gap, size = p - base[:, None], np.linalg.norm(s, axis=-1)
        far = np.linalg.norm(gap, axis=-1)
        cosine = (far**2 + size**2 - first**2) / (2 * far * size)
        low, span, normal, turns = numbers.T
        for sign in (-1, 1):
            angle = np.arctan2(gap[..., 1], gap[..., 0]) - np.arctan2(s[:, 1], s[:, 0])
            angle = angle + sign * np.arccos(np.clip(cosine, -1, 1))
            fits = (abs(cosine) <= 1) & (np.remainder(angle - low + 1e-9, 2 * np.pi) <= span + 2e-9)
            pose, row = np.nonzero(fits)
            chosen = angle[pose, row]
            yield self._solved(
                base, pose, p[row] - turned(chosen, s[row]), chosen, (p[row], normal[row] + turns[row] * chosen)
            )

    def _solved(
        self, base: Array, pose: NDArray[np.int64], joint: Array, angle: Array, contact: tuple[Array, Array]
    ) -> Touches:
        """Return contacts with the joint angles that bring the second link to its joint and angle."""
        first = np.arctan2(base[pose, 0] - joint[:, 0], joint[:, 1] - base[pose, 1])
        point, normal = contact
        place = np.column_stack([first, wrapped(angle - first), point, wrapped(normal), np.ones(len(pose))])
        return Touches(pose, place)

    def _first_link(self, base: Array) -> Touches:
        """Return contacts of the first link, which turns about bases `(P, 2)`, with every angle of the second."""
        low, high = self.finger.limits[1]
        free = np.linspace(low, high, int(np.ceil((high - low) / self.grid.free_turn)) + 1)
        poses, places = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 6))]
        for line in (line for line in self.first if line.length > 0):
            # Corner s on a face: n . (R s - gap) = 0. A face of normal m on a corner: m . (R' gap - s) = 0.
            gap = line.p - base
            still, moving = (gap, line.s[None]) if not line.turns else (line.s[None], gap)
            n = np.array([np.cos(line.normal + np.pi * line.turns), np.sin(line.normal + np.pi * line.turns)])
            size = np.linalg.norm(moving, axis=-1)
            cosine = (still @ n) / size
            middle = np.arctan2(n[1], n[0]) - np.arctan2(moving[:, 1], moving[:, 0])
            for sign in (-1, 1):
                angle = middle + sign * np.arccos(np.clip(cosine, -1, 1))
                angle = -angle if line.turns else angle
                t = (turned(angle, line.s) - gap) @ line.u + (turned(-angle, gap) - line.s) @ line.v
                fits = (np.remainder(angle - line.low, 2 * np.pi) <= line.span) & (abs(cosine) <= 1)
                pose = np.flatnonzero(fits & (t >= 0) & (t <= line.length))
                first = wrapped(angle[pose])[:, None]
                point = line.p + t[pose][:, None] * line.u
                normal = wrapped(line.normal + line.turns * first)
                row = np.repeat(np.concatenate([first, first, point, normal, 0 * first], axis=1), len(free), axis=0)
                row[:, 1] = np.tile(free, len(pose))
                poses.append(np.repeat(pose, len(free)))
                places.append(row)
        return Touches(np.concatenate(poses), np.concatenate(places))


def palm_corners(hand: HandSpec) -> Array:
    """Return the palm's corners `(4, 2)`."""
    half = (hand.palm_width + hand.link_width) / 2
    return np.array([(-half, -hand.palm_depth), (half, -hand.palm_depth), (half, 0.0), (-half, 0.0)])


def nearest_contact(first: Array, pieces: Sequence[Array]) -> tuple[Array, Array, Array]:
    """Return `contact` of a convex polygon with that of several convex pieces from which it is least separated."""
    if len(pieces) == 1:
        return contact(first, pieces[0])
    gaps, points, normals = (np.stack(part) for part in zip(*(contact(first, p) for p in pieces), strict=True))
    nearest = gaps.argmin(axis=0)[None]
    gap = np.take_along_axis(gaps, nearest, axis=0)[0]
    point, normal = (np.take_along_axis(part, nearest[..., None], axis=0)[0] for part in (points, normals))
    return gap, point, normal
