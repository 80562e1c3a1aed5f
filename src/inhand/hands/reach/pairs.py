"""Which grips a slide connects: pairs of contacts at one pose, and from one pose to the next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inhand.hands.reach.parts import BITS, REACHED, Beside, Chain, Flags, Grips, Pairs, Postures, Sides, Stances, Step


def neighbours(first: Postures, second: Postures, n_cells: int, hop: int = 1) -> Flags:
    """Return which postures of two sets are neighbours `(N, M)`.

    Cells, of `n_cells` round the outline, may differ by `hop`, and joints that contacts fix by 0.3 rad.
    """
    from inhand.hands.reach.flood import find_beside

    beside = _beside(len(first.cell), len(second.cell), n_cells)
    # columns of an array would have all compiled once more
    one, other = (each._replace(cell=np.ascontiguousarray(each.cell)) for each in (first, second))
    find_beside(one, other, (hop, n_cells), beside)
    table = np.zeros((len(first.cell), len(second.cell)), dtype=bool)
    table[np.repeat(np.arange(len(table)), np.diff(beside.start)), beside.neighbours[: beside.start[-1]]] = True
    return table


def room_for_pairs(sides: Sides, size: int, n_cells: int) -> Pairs:
    """Return room for pairs of so many postures of each finger, which are like some, on an outline of so many cells."""
    held, marked, leads = (np.empty((size, -(-size // BITS)), dtype=np.uint64) for _ in range(3))
    one, other, third, fourth = (_beside(size, size, n_cells) for _ in range(4))
    left, right = (_stances(size, side.joints.shape[1]) for side in sides)
    known, stack = np.empty((size, size), dtype=np.uint8), np.empty(size * size, dtype=np.int64)
    return Pairs(known, (left, right), (one, other), (third, fourth), held, marked, leads, stack)


def grips_of(
    pairs: Pairs,
    sides: Sides,
    fingers: tuple[Chain, Chain],
    step: Step,
    before: Grips | None,
    *,
    seen: Sides | None = None,
) -> Grips | None:
    """Return the grips that others lead to, and those that slides of one contact connect with them; None without any.

    Args:
        pairs: room for the pairs.
        sides: the postures of both fingers at a pose.
        fingers: both fingers.
        step: how grips lead to others.
        before: grips at a pose beside it; None asks for all pairs.
        seen: the postures with the cells as grips before number them; None if that is alike.
    """
    from inhand.hands.reach.flood import flood

    start = before or Grips(sides, np.empty((0, 0), dtype=bool))
    if not flood(pairs, sides, seen or sides, fingers, (start, step if before else step._replace(hop=-1))):
        return None
    held = pairs.known[: len(sides[0].cell), : len(sides[1].cell)] == REACHED
    left, right = np.flatnonzero(held.any(axis=1)), np.flatnonzero(held.any(axis=0))
    return Grips((sides[0].only(left), sides[1].only(right)), held[left[:, None], right])


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


def _beside(count: int, others: int, n_cells: int) -> Beside:
    """Return room for the neighbours that each posture of a set has in another."""
    rooms = [np.empty(size, dtype=np.int64) for size in (count + 1, count * others, n_cells + 2, others)]
    return Beside(*rooms)


def _stances(count: int, n: int) -> Stances:
    """Return room for what postures of n joints come to."""
    from inhand.hands.reach.flood import SIDES

    low, high = (np.empty((count, n + 1, len(SIDES))) for _ in range(2))
    return Stances(np.empty((count, n, 4)), low, high, np.empty(count))
