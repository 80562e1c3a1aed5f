"""The reach of two-link fingers with a box, found slowly and plainly: a second opinion on `inhand.hands.reach`.

Nothing of `inhand.sim` is used but the numbers of a `HandSpec`. The box stays upright (rotation 0). At every pose of a
straight path every place on the box is tried with every place on a link, both on a grid: either the link's angle is
taken from the grid and the place from a quadratic equation, or the place from the grid and the angle from the cosine
rule. Two fingers hold where the line between the contacts lies in both friction cones and no two links overlap. A grip
counts where steps no longer than a few grid lengths lead to it from a grip at the start.

Contacts are a corner of a link on a face, a face of a link on a corner, a face on a face (anywhere along both), and a
corner on a corner (with every normal that both have). The first link does not collide with the palm, nor a finger with
itself, as in the simulators.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from brute_contacts import Array, Finger, Grid, Mask, overlapping, palm_corners, placed_links
from inhand.hands.hand import HandSpec

BLOCK = 16
"""Poses whose contacts are found at a time."""


def near(first: Array, second: Array, steps: Array) -> Mask:
    """Return which places `(N, 6)` and `(M, 6)` are at most one small step apart.

    The first link has no room to slide. As the box passes it, its contact leaps along a face that lies flat on the link
    for an instant, or round a corner that meets a corner. Where the other finger holds before and after, it holds in
    between as well: the lines and normals there lie between those of the two ends. So only its joints count.
    """
    ours, theirs = first.T.copy(), second.T.copy()
    mask = np.abs(ours[0][:, None] - theirs[0]) <= steps[0]
    i, j = np.nonzero(mask)
    for column in range(1, 5):
        away = np.abs(ours[column][i] - theirs[column][j])
        kept = (np.minimum(away, 2 * np.pi - away) if column == 4 else away) <= steps[column]
        if column > 1:
            kept |= (ours[5][i] == 0) & (theirs[5][j] == 0)
        i, j = i[kept], j[kept]
    mask[:] = False
    mask[i, j] = True
    return np.asarray(mask)


def closed(friction: float, left: Array, right: Array) -> Mask:
    """Return between which places `(L, 6)` and `(R, 6)` the line lies in both friction cones."""
    x, y = (right[:, c] - left[:, c, None] for c in (2, 3))
    least = np.cos(np.arctan(friction)) * np.hypot(x, y)
    ours = -(x * np.cos(left[:, 4, None]) + y * np.sin(left[:, 4, None]))
    theirs = x * np.cos(right[:, 4]) + y * np.sin(right[:, 4])
    return np.asarray((ours >= least) & (theirs >= least) & (least > 0))


def meeting(hand: HandSpec, left: Array, right: Array, asked: Mask) -> Mask:
    """Return which of the asked pairs of places `(L, 6)` and `(R, 6)` have a link of one finger in one of the other."""
    i, j = np.nonzero(asked)
    mask = np.zeros_like(asked)
    ours, theirs = placed_links(hand, hand.left, left[:, :2]), placed_links(hand, hand.right, right[:, :2])
    for link in ours:
        for other in theirs:
            near = _boxed(link, other, i, j)
            met = near[overlapping(link[i[near]], other[j[near]])]
            mask[i[met], j[met]] = True
            i, j = np.delete(i, met), np.delete(j, met)
    return mask


def _boxed(first: Array, second: Array, i: NDArray[np.int64], j: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return which pairs of polygons `(L, K, 2)` and `(R, M, 2)` lie in upright boxes that overlap, as they must to."""
    low, high, others_low, others_high = first.min(axis=1), first.max(axis=1), second.min(axis=1), second.max(axis=1)
    met = np.ones(len(i), dtype=bool)
    for c in (0, 1):
        met &= (low[i, c] < others_high[j, c]) & (others_low[j, c] < high[i, c])
    return np.flatnonzero(met)


def spread(mask: Mask, seeds: Mask, slides: tuple[Mask, Mask]) -> Mask:
    """Return the grips that slides of one contact at a time lead to from seeds."""
    ours, theirs = (slide.astype(np.float32) for slide in slides)
    while True:
        now = seeds.astype(np.float32)
        more = (ours @ now + now @ theirs > 0) & mask
        if (more == seeds).all():
            return seeds
        seeds = more


@dataclass(frozen=True)
class Held:
    """Grips at one pose."""

    left: Array
    """Places of the left finger `(L, 6)`."""
    right: Array
    """Places of the right finger `(R, 6)`."""
    mask: Mask
    """Which pairs are grips `(L, R)`."""


def brute_reach(hand: HandSpec, width: float, friction: float, way: Array, grid: Grid) -> float:
    """Return how far an upright square box can be carried along a unit vector `way` `(2,)` from the start [m].

    Returns:
        The way of the last pose reached, -1 where no grip holds the box at the start.
    """
    fingers = _fingers(hand, width, grid)
    held: Held | None = None
    end = -1.0
    for step, count in ((grid.step, 400), (grid.last_step, round(grid.step / grid.last_step))):
        ways = max(end + step, 0.0) + step * np.arange(count)
        for place, sides in zip(ways, _sides(hand, fingers, ways[:, None] * way), strict=True):
            found = _step(hand, friction, sides, held, grid)
            if found is None:
                break
            end, held = float(place), found
        if held is None:
            break
    return end


@lru_cache(maxsize=2)
def _fingers(hand: HandSpec, width: float, grid: Grid) -> tuple[Finger, Finger]:
    """Return both fingers with their tables for an upright square box."""
    box = width / 2 * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    return Finger(hand, hand.left, box, grid), Finger(hand, hand.right, box, grid)


def _sides(hand: HandSpec, fingers: tuple[Finger, Finger], moved: Array) -> Iterator[tuple[Array, Array]]:
    """Give the places `(N, 6)` that both fingers can touch at each pose; none where the box is in the palm."""
    for block in range(0, len(moved), BLOCK):
        positions = hand.start_position + moved[block : block + BLOCK]
        corners = fingers[0].box + positions[:, None]
        blocked = overlapping(corners, np.broadcast_to(palm_corners(hand), corners.shape))
        found = [finger.touches(positions) for finger in fingers]
        for k in range(len(positions)):
            left, right = (each.place[(each.pose == k) & ~blocked[k]] for each in found)
            yield left, right


def _step(hand: HandSpec, friction: float, sides: tuple[Array, Array], before: Held | None, grid: Grid) -> Held | None:
    """Return the grips that are reached at a pose from those before it, all of them at the start; None for none."""
    mask = closed(friction, *sides)
    some = mask.any(axis=1), mask.any(axis=0)
    left, right, mask = sides[0][some[0]], sides[1][some[1]], mask[np.ix_(*some)]
    if before is None:
        mask &= ~meeting(hand, left, right, mask)
        return Held(left, right, mask) if mask.any() else None
    ours, theirs = near(before.left, left, grid.near), near(before.right, right, grid.near)
    seeds = (ours.T.astype(np.float32) @ before.mask.astype(np.float32) @ theirs.astype(np.float32) > 0) & mask
    slides = near(left, left, grid.near), near(right, right, grid.near)
    while seeds.any():
        reached = spread(mask, seeds, slides)
        met = meeting(hand, left, right, reached)
        if not met.any():
            return Held(left, right, reached)
        mask, seeds = mask & ~met, seeds & ~met
    return None
