"""Replay: whole episodes come in, one row for each decision goes out, with its one-step and its n-step return.

A row holds everything that a decision's losses need, so that one index draws all of it. Rows live in a file that is
written on and on in a ring with room to spare: a checkpoint notes how far it had come, and what is written after it
falls on rows that it does not hold, so that a run that is killed goes on from its checkpoint without a copy of them.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.float32]
TRUTH = ("truth", "true_successor", "true_later")
"""Columns of what only critics see, now and later, as `observation`, `successor` and `later` are of the actor."""


@dataclass(frozen=True)
class Columns:
    """Where a row holds what, for observations of d and actions of n numbers."""

    d: int
    """Size of an observation."""
    n: int
    """Size of an action."""
    c: int = 0
    """Size of what only critics see; 0 where they see what the actor does."""
    slot: int = 0
    """Numbers of each joint's slot, with which an observation begins; 0 where it has no slots."""

    @property
    def width(self) -> int:
        """Length of a row."""
        return 3 * (self.d + self.c) + 2 * self.n + 5

    def parts(self) -> dict[str, slice]:
        """Return the columns of every part."""
        sizes = {
            "observation": self.d,
            "successor": self.d,
            "later": self.d,
            "action": self.n,
            "expert_action": self.n,
            "is_demo": 1,
            "reward": 1,
            "discount": 1,
            "reward_n": 1,
            "discount_n": 1,
            **dict.fromkeys(TRUTH, self.c),
        }
        ends = np.cumsum(list(sizes.values()))
        return {name: slice(int(end - size), int(end)) for (name, size), end in zip(sizes.items(), ends, strict=True)}


def n_step(rewards: NDArray[Any], discount: float, n: int, *, terminated: bool) -> tuple[Any, Any, NDArray[np.int64]]:
    """Return of every decision of an episode the n-step return, the weight of the value after it, and that state.

    R_t = sum over k < m of discount^k r_{t+k}, with m = min(n, T - t): sums stop at the episode's end. The value of
    state t + m counts discount^m, and nothing where the episode terminated there; where it was cut off it counts. All
    are `(T,)`, the states as indices, T being the last one.
    """
    count = len(rewards)
    ahead = np.minimum(n, count - np.arange(count))
    padded = np.concatenate([rewards, np.zeros(n)])
    total = sum(discount**k * padded[k : k + count] for k in range(n))
    index = np.arange(count) + ahead
    weight = discount**ahead * np.where((index == count) & terminated, 0.0, 1.0)
    return total, weight, index


def rows_of(
    columns: Columns,
    episode: tuple[NDArray[Any], NDArray[Any], NDArray[Any] | None, NDArray[Any]],
    looking: tuple[float, int],
    *,
    terminated: bool,
) -> Rows:
    """Return the rows of one episode, which ended by itself where it `terminated`.

    It is observations `(T + 1, d + c)`, actions `(T, n)`, what an expert wanted `(T, n)` or None, and rewards `(T,)`;
    `looking` is the discount and the number of steps to look ahead.
    """
    observations, actions, wanted, rewards = episode
    rows = np.zeros((len(rewards), columns.width), dtype=np.float32)
    later, weight, index = n_step(rewards, *looking, terminated=terminated)
    _, weight_one, _ = n_step(rewards, looking[0], 1, terminated=terminated)
    filled = {
        "observation": observations[:-1, : columns.d],
        "successor": observations[1:, : columns.d],
        "later": observations[index, : columns.d],
        "action": actions,
        "expert_action": actions if wanted is None else wanted,
        "is_demo": np.full((len(rewards), 1), float(wanted is not None)),
        "reward": rewards[:, None],
        "discount": weight_one[:, None],
        "reward_n": later[:, None],
        "discount_n": weight[:, None],
        "truth": observations[:-1, columns.d :],
        "true_successor": observations[1:, columns.d :],
        "true_later": observations[index, columns.d :],
    }
    for name, part in columns.parts().items():
        rows[:, part] = filled[name]
    return rows


class ReplayBuffer:
    """The last `capacity` rows of those written, in a file of `capacity + spare` rows."""

    def __init__(self, path: Path, columns: Columns, capacity: int, spare: int, written: int = 0) -> None:
        """Open a replay of bare float32 rows, or make one where the file is not there.

        Of those written so far `capacity` can be drawn; `spare` rows may be written between two checkpoints without
        touching what the earlier one holds.
        """
        self.capacity, self.written = capacity, written
        self._room = capacity + spare
        shape = self._room, columns.width
        self._rows = np.memmap(path, np.float32, "r+" if path.exists() else "w+", shape=shape)

    def __len__(self) -> int:
        """Return the number of rows that can be drawn."""
        return min(self.written, self.capacity)

    def add(self, rows: Rows) -> None:
        """Write rows; the oldest fall out."""
        self._rows[(self.written + np.arange(len(rows))) % self._room] = rows
        self.written += len(rows)

    def draw(self, rng: np.random.Generator, count: int | tuple[int, ...]) -> NDArray[np.int64]:
        """Return the numbers of `count` rows, or of an array of that shape, each drawn evenly from those held."""
        return self.written - len(self) + rng.integers(len(self), size=count)

    def at(self, numbers: NDArray[np.int64]) -> Rows:
        """Return rows by their numbers `(..., width)`, counted from the first ever written."""
        return np.asarray(self._rows[numbers % self._room])

    def shown(self, numbers: NDArray[np.int64], columns: Columns) -> Rows:
        """Return what was seen and what an expert wanted in rows, by their numbers `(..., d + n)`."""
        places, parts = numbers % self._room, columns.parts()
        return np.concatenate([self._rows[:, parts[n]][places] for n in ("observation", "expert_action")], axis=-1)

    def flush(self) -> None:
        """Bring everything written to the disk."""
        self._rows.flush()


class Priorities:
    """Priorities of the rows of a replay, which draws rows in their proportion (DDPGfD, prioritised replay)."""

    def __init__(self, replay: ReplayBuffer, exponent: float, correction: float) -> None:
        """Give every row the largest priority seen so far until it is told its own.

        Rows are drawn in proportion to priority to the power `exponent`; importance weights to the power `correction`
        make up for it.
        """
        self._replay, self._exponent, self._correction = replay, exponent, correction
        self.values = np.ones(replay.capacity)
        self.largest = 1.0
        self._known = 0

    def draw(self, rng: np.random.Generator, count: int) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Return the numbers of drawn rows and their importance weights, the largest of which is 1."""
        self._welcome()
        held = len(self._replay)
        first = self._replay.written - held
        weight = self.values[(first + np.arange(held)) % len(self.values)] ** self._exponent
        edges = np.cumsum(weight)
        picked = np.minimum(np.searchsorted(edges, rng.random(count) * edges[-1], side="right"), held - 1)
        corrected = (held * weight[picked] / edges[-1]) ** -self._correction
        return first + picked, (corrected / corrected.max()).astype(np.float32)

    def learn(self, numbers: NDArray[np.int64], priorities: NDArray[Any]) -> None:
        """Set the priorities of rows."""
        self.values[numbers.ravel() % len(self.values)] = priorities.ravel()
        self.largest = max(self.largest, float(priorities.max()))

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs."""
        return {"values": self.values, "scalars": np.array([self.largest, self._known])}

    def load_state_dict(self, kept: dict[str, Any]) -> None:
        """Go on from what `state_dict` returned; from nothing, start anew."""
        if kept:
            self.values = kept["values"]
            self.largest, self._known = float(kept["scalars"][0]), int(kept["scalars"][1])

    def _welcome(self) -> None:
        new = np.arange(max(self._known, self._replay.written - len(self.values)), self._replay.written)
        self.values[new % len(self.values)] = self.largest
        self._known = self._replay.written
