"""Which grips a slide connects: pairs of contacts at one pose, and from one pose to the next."""

from __future__ import annotations

import numpy as np

from inhand.hands.reach.parts import ASKED, REACHED, UNKNOWN, Beside, Chain, Flags, Pairs, Postures, Sources, Stances


def neighbours(first: Postures, second: Postures, n_cells: int, hop: int = 1) -> Flags:
    """Return which postures of two sets are neighbours `(N, M)`.

    Cells, of `n_cells` round the outline, may differ by `hop`, and joints that contacts fix by 0.3 rad.
    """
    beside = beside_of(first, second, n_cells, hop)
    table = np.zeros((len(first.cell), len(second.cell)), dtype=bool)
    table[np.repeat(np.arange(len(table)), np.diff(beside.start)), beside.neighbours[: beside.start[-1]]] = True
    return table


def beside_of(first: Postures, second: Postures, n_cells: int, hop: int = 1) -> Beside:
    """Return the neighbours that each posture of a set has in another; see `neighbours`."""
    from inhand.hands.reach.flood import find_beside

    count, others = len(first.cell), len(second.cell)
    beside = Beside(np.empty(count + 1, dtype=np.int64), np.empty(count * others, dtype=np.int64))
    by_cell = np.empty(n_cells + 2, dtype=np.int64), np.empty(others, dtype=np.int64)
    find_beside(first, second, hop, by_cell, beside)
    return beside


def pairs_of(fingers: tuple[Chain, Chain], left: Postures, right: Postures, n_cells: int) -> Pairs:
    """Return all pairs of two fingers' postures at one pose, of which nothing is known yet."""
    sides = left, right
    stances = _stances(fingers[0], left), _stances(fingers[1], right)
    slides = beside_of(left, left, n_cells), beside_of(right, right, n_cells)
    return Pairs(sides, stances, slides, np.full((len(left.cell), len(right.cell)), UNKNOWN, dtype=np.uint8))


def sources_of(before: Pairs, sides: tuple[Postures, Postures], n_cells: int, hop: int) -> Sources:
    """Return the grips that were reached at a pose, and which postures at one beside it are neighbours of theirs."""
    left, right = (beside_of(*each, n_cells, hop) for each in zip(before.sides, sides, strict=True))
    return Sources(left, right, before.known == REACHED)


def reach_from(fingers: tuple[Chain, Chain], pairs: Pairs, cone: float, sources: Sources | None) -> bool:
    """Find the grips that slides connect with sources; return whether there are any that were not known.

    Args:
        fingers: both fingers.
        pairs: pairs at a pose; what is known of them is written here.
        cone: cosine of the friction cones' half angle.
        sources: grips at a pose beside it; None asks for all grips.
    """
    from inhand.hands.reach.flood import ask, spread

    if sources is None:
        pairs.known[:] = ASKED
        return spread(pairs, fingers, cone, np.arange(pairs.known.size), pairs.known.size) > 0
    stack = np.empty(pairs.known.size, dtype=np.int64)
    marked = np.empty((len(pairs.known), sources.held.shape[1]), dtype=bool)
    return spread(pairs, fingers, cone, stack, ask(pairs, sources, marked, stack)) > 0


def _stances(finger: Chain, found: Postures) -> Stances:
    from inhand.hands.reach.flood import SIDES, stand

    shape = found.joints.shape
    frames, depth = np.empty((*shape, 4)), np.empty(len(found.cell))
    low, high = (np.empty((shape[0], shape[1] + 1, len(SIDES))) for _ in range(2))
    stances = Stances(frames, low, high, depth)
    stand(found, finger, stances)
    return stances
