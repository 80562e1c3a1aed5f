"""Which grips a slide connects: pairs of contacts at one pose, and from one pose to the next."""

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array, unit
from inhand.hands.hand import HandSpec
from inhand.hands.polygons import separation
from inhand.hands.reach.fingers import OVERLAP, Postures
from inhand.hands.shapes import link_polygons

SIDES = unit(np.deg2rad(np.arange(0.0, 180.0, 22.5)))
"""Directions in which two links are looked at from the side, before the exact check."""
LARGEST_TURN = 0.3
"""Joint angles of neighbouring postures differ by at most this [rad]; separate branches lie farther apart."""

Grips = NDArray[np.bool_]
"""Which pairs of postures `(L, R)` are grips."""


def neighbours(first: Postures, second: Postures, n_cells: int, hop: int = 1) -> NDArray[np.bool_]:
    """Return which postures of two sets are neighbours `(N, M)`: cells next to each other, joints nearly alike.

    Cells, of `n_cells` round the outline, may differ by `hop`. Where the first link touches, which has no room to
    slide, the cell does not matter: as the object passes by, a contact leaps along a face that comes to lie on the
    link, or round a corner that meets the link's. Two grips that differ by such a leap alone hold, and so does every
    grip between them.
    """
    away = np.abs(first.cell[:, None] - second.cell)
    near = (away <= hop) | (away >= n_cells - hop)
    near |= _by_first_link(first)[:, None] & _by_first_link(second)
    rows, columns = np.nonzero(near)
    turn = np.abs(first.fixed[rows] - second.fixed[columns])
    near[rows, columns] = ~(turn > LARGEST_TURN).any(axis=-1)
    return np.asarray(near)


def _by_first_link(found: Postures) -> NDArray[np.bool_]:
    """Return in which postures the first link touches: its joint alone is fixed."""
    return np.asarray(~np.isnan(found.fixed[:, 0]) & np.isnan(found.fixed[:, 1]))


def closures(friction: float, left: Postures, right: Postures) -> Grips:
    """Return between which contacts the line lies inside both friction cones `(L, R)`.

    As `force_closure`, which also takes pairs that are no table; matrix products make it ten times as fast here.
    """
    square = (left.points**2).sum(-1)[:, None] + (right.points**2).sum(-1) - 2 * left.points @ right.points.T
    least = np.cos(np.arctan(friction)) * np.sqrt(np.maximum(square, 0.0))
    ours = (left.points * left.normals).sum(-1)[:, None] - left.normals @ right.points.T
    theirs = (right.points * right.normals).sum(-1) - left.points @ right.normals.T
    inside = (ours >= least) & (theirs >= least)
    return np.asarray(inside & (square > 1e-18) & (friction > 0))


def connected(grips: Grips, seeds: Grips, slides: tuple[NDArray[np.bool_], NDArray[np.bool_]]) -> Grips:
    """Return the grips `(L, R)` that slides of either contact connect with a seed.

    `slides` tells which postures of the left finger are neighbours `(L, L)`, and of the right `(R, R)`.
    """
    found = seeds.copy()
    rows, columns = np.flatnonzero(grips.any(axis=1)), np.flatnonzero(grips.any(axis=0))
    grips, reached = grips[np.ix_(rows, columns)], seeds[np.ix_(rows, columns)]
    left, right = (
        slide[np.ix_(kept, kept)].astype(np.float32) for slide, kept in zip(slides, (rows, columns), strict=True)
    )
    open_ = grips & ~reached
    edge = reached.astype(np.float32)
    while open_.any():
        some, other = np.flatnonzero(edge.any(axis=1)), np.flatnonzero(edge.any(axis=0))
        fresh = (left[:, some] @ edge[some] + edge[:, other] @ right[other] > 0) & open_
        if not fresh.any():
            break
        open_ &= ~fresh
        edge = fresh.astype(np.float32)
    found[np.ix_(rows, columns)] = grips & ~open_
    return found


def clear_pairs(hand: HandSpec, left: Array, right: Array, asked: Grips) -> Grips:
    """Return which asked pairs `(L, R)` of postures `(L, n)` and `(R, n)` keep the fingers' links apart."""
    rows, columns = np.flatnonzero(asked.any(axis=1)), np.flatnonzero(asked.any(axis=0))
    found = np.zeros_like(asked)
    found[np.ix_(rows, columns)] = _clear(hand, left[rows], right[columns], asked[np.ix_(rows, columns)])
    return found


def _clear(hand: HandSpec, left: Array, right: Array, asked: Grips) -> Grips:
    fingers = (link_polygons(hand, hand.left, left), link_polygons(hand, hand.right, right))
    shadows = [[link @ SIDES.T for link in links] for links in fingers]
    low = [np.stack([shadow.min(axis=-2) for shadow in side]) for side in shadows]
    high = [np.stack([shadow.max(axis=-2) for shadow in side]) for side in shadows]
    clear = asked & _apart(low[0].min(0), high[0].max(0), low[1].min(0), high[1].max(0))
    first, second = np.nonzero(asked & ~clear)
    if len(first) == 0:
        return clear
    free = np.ones(len(first), dtype=bool)
    for i, link in enumerate(fingers[0]):
        for j, other in enumerate(fingers[1]):
            apart = (high[0][i][first] < low[1][j][second]) | (high[1][j][second] < low[0][i][first])
            near = np.flatnonzero(~apart.any(axis=-1) & free)
            if len(near) > 0:
                free[near] = separation(link[first[near]], other[second[near]]) > -OVERLAP
    clear[first, second] = free
    return clear


def _apart(low_left: Array, high_left: Array, low_right: Array, high_right: Array) -> NDArray[np.bool_]:
    """Return whether shadows `(L, D)` and `(R, D)` are apart in some direction `(L, R)`."""
    apart = np.zeros((len(low_left), len(low_right)), dtype=bool)
    for d in range(len(SIDES)):
        apart |= high_left[:, None, d] < low_right[:, d]
        apart |= high_right[:, d] < low_left[:, None, d]
    return apart
