"""Which contacts of all fingers go together at the start: apart from each other, with forces that can balance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.forces import BALANCED, GripRules
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.rolling import Margins, Starts, roll
from inhand.hands.spatial.start_contacts import balancing_of, contacts_at, stack_of

if TYPE_CHECKING:
    from inhand.hands.spatial.tuples import Balancing, Stack

ROUNDS = 40
"""Most rounds in which forces of first contacts are looked for: few tuples that can grip need more."""
MOST_TUPLES = 4_000_000
"""Combinations of contacts that are looked at; the lattice is made coarser until there are no more (guessed)."""
COARSER = 1.15
"""By how much at a time."""
SPARSE = 0.012
"""Where contacts are farther apart for that [m] each has one posture: more contacts go farther than more postures."""
COARSEST = 0.03
"""A lattice is never coarser [m]."""
FEW = 4000
"""Tuples that are looked at together at first, then twice as many each time (guessed)."""


class Ranked(NamedTuple):
    """Tuples that hold the object at its start, those first that can be worth most."""

    rows: NDArray[np.int64]
    """Their numbers among all tuples `(T,)`."""
    lengths: NDArray[np.int64]
    """How many poses all fingers of each follow, each on its own `(T,)`."""
    bounds: Array
    """What each can be worth at most `(T,)` [m]."""

    def some(self, which: NDArray[np.bool_] | NDArray[np.int64] | slice) -> Ranked:
        """Return some of them, in their order."""
        return Ranked(self.rows[which], self.lengths[which], self.bounds[which])

    def joined(self, more: Ranked) -> Ranked:
        """Return these and more behind them."""
        rows, lengths = (np.concatenate(pair) for pair in zip(self[:2], more[:2], strict=True))
        return Ranked(rows, lengths, np.concatenate([self.bounds, more.bounds]))


@dataclass(frozen=True, eq=False)
class Together:
    """Contacts of all fingers at the start. Which of them go together is found out where it is asked, and kept.

    A tuple of contacts has a row: its number among all there are, where the last finger's contact counts first.
    """

    starts: tuple[Starts, ...]
    """Where each finger can touch."""
    apart: dict[tuple[int, int], NDArray[np.bool_]]
    """Which contacts of two fingers leave their bodies apart `(K, K)`."""
    how: tuple[Stack, Balancing]
    """Contacts side by side, and how forces are looked for."""
    known: NDArray[np.int8]
    """Of each row, whether forces balance: 1 or -1, and 0 where nobody has asked."""
    used: Array
    """Of each row that does, the share of their friction cones that forces use to grip, without weight."""

    @property
    def counts(self) -> tuple[int, ...]:
        """Contacts of each finger."""
        return tuple(len(each.joints) for each in self.starts)

    def numbers(self, rows: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the contact of each finger `(T, N)` of rows `(T,)`."""
        return np.stack(np.unravel_index(rows, self.counts), axis=-1)

    def rows(self, which: Sequence[NDArray[np.bool_]] | None = None) -> NDArray[np.int64]:
        """Return the rows `(T,)` of all contacts, or of `which` of each finger `(K,)`, whose bodies are apart."""
        which = [np.ones(count, dtype=bool) for count in self.counts] if which is None else which
        picked = [np.flatnonzero(each) for each in which]
        good = np.ones([len(each) for each in picked], dtype=bool)
        for (i, j), apart in self.apart.items():
            pair = apart[np.ix_(picked[j], picked[i])]
            good &= pair.reshape([len(each) if f in (i, j) else 1 for f, each in enumerate(picked)])
        if not good.any():
            return np.empty(0, dtype=np.int64)
        places = tuple(each[at] for each, at in zip(picked, np.nonzero(good), strict=True))
        return np.asarray(np.ravel_multi_index(places, self.counts), dtype=np.int64)

    def holding(self, rows: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return those of some rows whose forces balance."""
        from inhand.hands.spatial.tuples import Asked, hold_starts

        new = rows[self.known[rows] == 0]
        if len(new):
            lengths, used = np.ones(len(new), dtype=np.int64), np.ones(len(new))
            asked = Asked(self.numbers(new), lengths, np.zeros((1, 1, 1, 3)), used, 1, BALANCED)
            hold_starts(self.how[0], asked, self.how[1])
            self.known[new], self.used[new] = np.where(lengths > 0, 1, -1), used
        return rows[self.known[rows] > 0]

    def ranked(self, lengths: Sequence[NDArray[np.int64]], way: Array, cost: float) -> Iterator[Ranked]:
        """Give tuples that hold, those first that can be worth most: the way that fingers follow, less cones used.

        Args:
            lengths: how many poses each finger follows from each contact `(K,)`.
            way: way to each pose `(S,)` [m].
            cost: of cones that are used whole [m].
        """
        none = np.empty(0, dtype=np.int64)
        found, before = Ranked(none, none, np.empty(0)), len(way) + 1
        for least, longer in _levels(lengths):
            rows = self.rows([each >= least for each in lengths])
            rows = self.holding(rows[followed(lengths, self.numbers(rows)) < before])
            poses = followed(lengths, self.numbers(rows))
            found, before = found.joined(Ranked(rows, poses, way[poses - 1] - cost * self.used[rows])), least
            found = found.some(np.lexsort((found.rows, -found.bounds)))
            sure = found.bounds > (way[longer - 1] if longer else -np.inf)
            yield found.some(sure)
            found = found.some(~sure)


def followed(lengths: Sequence[NDArray[np.int64]], numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many poses all fingers follow `(T,)`, each as many as `lengths` say of its contact `(T, N)`."""
    each = [some[contacts] for some, contacts in zip(lengths, numbers.T, strict=True)]
    return np.asarray(np.stack(each).min(axis=0))


def _levels(lengths: Sequence[NDArray[np.int64]]) -> Iterator[tuple[int, int]]:
    """Give how many poses are followed at least, fewer each time, and the most that is fewer, 0 where nothing is."""
    most = min(int(each.max(initial=0)) for each in lengths)
    levels = [each for each in np.unique(np.concatenate(lengths))[::-1].tolist() if 0 < each <= most]
    sizes = [float(np.prod([(each >= level).sum() for each in lengths])) for level in levels]
    wanted = float(FEW)
    for number, (level, size) in enumerate(zip(levels, sizes, strict=True)):
        last = number == len(levels) - 1
        if last or size >= wanted:
            yield level, 0 if last else levels[number + 1]
            wanted = 2 * size


def _one_posture(starts: Starts) -> Starts:
    """Return each contact once, with the first of its postures."""
    first = np.sort(np.unique(starts.points, axis=0, return_index=True)[1])
    return Starts(starts.points[first], starts.normals[first], starts.joints[first])


def held_together(
    held: tuple[SpatialHand, SolidSpec], pose: Array, spacing: float, margins: Margins, rules: GripRules
) -> Together:
    """Return the contacts at a pose `(7,)` that are apart and can grip the object, without weight.

    The lattice of contacts is as fine as `spacing` [m], coarser where that would be more than `MOST_TUPLES`.
    """
    from inhand.hands.spatial.tuples import pairs_apart

    starts = contacts_at(held, pose, spacing, margins)
    while spacing < COARSEST and np.prod([float(len(each.joints)) for each in starts]) > MOST_TUPLES:
        spacing *= COARSER
        starts = contacts_at(held, pose, spacing, margins)
        if spacing > SPARSE:
            starts = tuple(_one_posture(each) for each in starts)
    rows = kinematics.rows_of(pose)[None, None]
    stack = stack_of(held[0], [roll(held, f, each, rows, margins) for f, each in enumerate(starts)], margins)
    counts = [len(each.joints) for each in starts]
    apart = {}
    for i in range(len(counts)):
        for j in range(i):
            pairs_apart(stack, i, j, found := np.zeros((counts[i], counts[j]), dtype=bool))
            apart[i, j] = found.T
    every = int(np.prod(counts))
    how = stack, balancing_of(len(counts), replace(rules, rounds=min(rules.rounds, ROUNDS)))
    return Together(starts, apart, how, np.zeros(every, dtype=np.int8), np.zeros(every))
