"""Which grips a slide connects: pairs of contacts at one pose, and from one pose to the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from inhand.hands.reach.parts import BITS, REACHED, UNKNOWN, Beside, Chain, Flags, Grips, Pairs, Postures, Stances

Sides: TypeAlias = tuple[Postures, Postures]
"""Postures of the left finger and of the right."""


def neighbours(first: Postures, second: Postures, n_cells: int, hop: int = 1) -> Flags:
    """Return which postures of two sets are neighbours `(N, M)`.

    Cells, of `n_cells` round the outline, may differ by `hop`, and joints that contacts fix by 0.3 rad.
    """
    from inhand.hands.reach.flood import find_beside

    beside = _beside(first, second, n_cells)
    find_beside(first, second, hop, beside)
    table = np.zeros((len(first.cell), len(second.cell)), dtype=bool)
    table[np.repeat(np.arange(len(table)), np.diff(beside.start)), beside.neighbours[: beside.start[-1]]] = True
    return table


def pairs_of(sides: Sides, before: Grips | None, n_cells: int, seen: tuple[Sides, int] | None = None) -> Pairs:
    """Return all pairs of two fingers' postures at one pose, of which nothing is known yet.

    Args:
        sides: the postures.
        before: grips that may lead to them.
        n_cells: cells of the outline.
        seen: the postures with the cells as grips before number them, and the number of those; None if alike.
    """
    (left, right), ((seen_left, seen_right), others) = sides, seen or (sides, n_cells)
    one, other = before.sides if before else sides
    shape = len(left.cell), len(right.cell)
    held, marked, leads = (
        np.empty((count, -(-len(other.cell) // BITS)), dtype=np.uint64) for count in (len(one.cell), *shape)
    )
    return Pairs(
        sides,
        np.full(shape, UNKNOWN, dtype=np.uint8),
        (_stances(left), _stances(right)),
        (_beside(left, left, n_cells), _beside(right, right, n_cells)),
        (seen_left, seen_right),
        (_beside(one, seen_left, others), _beside(other, seen_right, others)),
        held,
        marked,
        leads,
        np.empty(shape[0] * shape[1], dtype=np.int64),
    )


def grips_of(
    pairs: Pairs, fingers: tuple[Chain, Chain], cone: float, before: Grips | None, hop: int = 1
) -> Grips | None:
    """Return the pairs that are grips and that others lead to, by slides of one contact among them; None without any.

    Args:
        pairs: the pairs, of which nothing is known.
        fingers: both fingers.
        cone: cosine of the friction cones' half angle.
        before: grips at a pose beside it; None asks for all pairs.
        hop: by how many cells contacts may differ from theirs.
    """
    from inhand.hands.reach.flood import flood

    start = before or Grips(pairs.sides, np.empty((0, 0), dtype=bool))
    if not flood(pairs, fingers, cone, start, hop if before else -1):
        return None
    held = pairs.known == REACHED
    left, right = np.flatnonzero(held.any(axis=1)), np.flatnonzero(held.any(axis=0))
    return Grips((pairs.sides[0].only(left), pairs.sides[1].only(right)), held[left[:, None], right])


def merged(several: Sequence[Grips]) -> Grips:
    """Return grips at several poses as if they were at one."""
    if len(several) == 1:
        return several[0]
    sides = tuple(
        Postures(*map(np.concatenate, zip(*(each.sides[k] for each in several), strict=True))) for k in range(2)
    )
    rows, columns = ([0, *np.cumsum([each.held.shape[k] for each in several])] for k in range(2))
    held = np.zeros((rows[-1], columns[-1]), dtype=bool)
    for k, each in enumerate(several):
        held[rows[k] : rows[k + 1], columns[k] : columns[k + 1]] = each.held
    return Grips((sides[0], sides[1]), held)


def _beside(first: Postures, second: Postures, n_cells: int) -> Beside:
    """Return room for the neighbours that each posture of a set has in another."""
    count, others = len(first.cell), len(second.cell)
    rooms = [np.empty(size, dtype=np.int64) for size in (count + 1, count * others, n_cells + 2, others)]
    return Beside(*rooms)


def _stances(found: Postures) -> Stances:
    """Return room for what postures come to."""
    from inhand.hands.reach.flood import SIDES

    count, n = found.joints.shape
    low, high = (np.empty((count, n + 1, len(SIDES))) for _ in range(2))
    return Stances(np.empty((count, n, 4)), low, high, np.empty(count))
