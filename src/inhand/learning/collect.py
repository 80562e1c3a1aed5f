"""Experience: worlds under the actor of the moment, whose finished episodes become rows."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from inhand.geometry import Array
from inhand.learning.replay_buffer import Columns, Rows, rows_of
from inhand.learning.worlds import ManipulationWorlds

CORRELATION = 0.8
"""How much of the exploration noise of one decision is left in the next."""
_KEPT = ("observations", "actions", "rewards", "at", "noise", "observation")
"""What a collector goes on from."""


@dataclass(frozen=True)
class Finished:
    """One finished episode."""

    total: float
    """Sum of its rewards."""
    last: float
    """Its last reward, which the thesis plots (figure 4.7)."""
    decisions: int
    """Its length."""
    dropped: bool
    """Whether it ended by losing the object."""


class Collector:
    """Steps worlds and cuts what they do into episodes."""

    def __init__(self, worlds: ManipulationWorlds, columns: Columns, looking: tuple[float, int]) -> None:
        """Collect from worlds; `looking` is the discount and the number of steps that rows look ahead."""
        self._worlds, self._columns, self._looking = worlds, columns, looking
        count, longest = worlds.count, worlds.interface.horizon
        self._observations = np.zeros((count, longest + 1, columns.d + columns.c), dtype=np.float32)
        self._actions = np.zeros((count, longest, columns.n), dtype=np.float32)
        self._rewards = np.zeros((count, longest))
        self._at = np.zeros(count, dtype=np.int64)
        self._noise = np.zeros((count, columns.n))
        self._observation = worlds.reset()
        worlds.stagger()
        self._observations[:, 0] = self._observation

    def collect(
        self, actor: Callable[[Array], Array], decisions: int, spread: float, rng: np.random.Generator
    ) -> tuple[list[Rows], list[Finished]]:
        """Return the rows and the episodes that came to their end within some decisions of every world.

        Args:
            actor: gives actions for observations.
            decisions: decisions of every world.
            spread: standard deviation of the exploration noise, correlated in time.
            rng: draws it.
        """
        rows: list[Rows] = []
        ends: list[Finished] = []
        every = np.arange(self._worlds.count)
        for _ in range(decisions):
            fresh = rng.standard_normal(self._noise.shape)
            self._noise = CORRELATION * self._noise + np.sqrt(1 - CORRELATION**2) * fresh
            action = np.clip(actor(self._observation[:, : self._columns.d]) + spread * self._noise, -1.0, 1.0)
            step = self._worlds.step(action)
            self._actions[every, self._at] = action
            self._rewards[every, self._at] = step.reward
            self._at += 1
            self._observations[every, self._at] = step.successor
            for world in np.flatnonzero(step.terminated | step.truncated).tolist():
                rows.append(self._cut(world, terminated=bool(step.terminated[world])))
                ends.append(self._told(world, dropped=bool(step.terminated[world])))
                self._at[world] = 0
                self._noise[world] = 0.0
                self._observations[world, 0] = step.observation[world]
            self._observation = step.observation
        return rows, ends

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs: arrays and the worlds' own."""
        own = {f"collect.{name}": getattr(self, f"_{name}") for name in _KEPT}
        return own | self._worlds.state_dict()

    def load_state_dict(self, kept: dict[str, Any]) -> None:
        """Go on from what `state_dict` returned, byte for byte."""
        for name in _KEPT:
            setattr(self, f"_{name}", kept[f"collect.{name}"])
        self._worlds.load_state_dict(kept)

    def _cut(self, world: int, *, terminated: bool) -> Rows:
        count = self._at[world]
        seen, rewards = self._observations[world, : count + 1], self._rewards[world, :count]
        episode = seen, self._actions[world, :count], None, rewards
        return rows_of(self._columns, episode, self._looking, terminated=terminated)

    def _told(self, world: int, *, dropped: bool) -> Finished:
        rewards = self._rewards[world, : self._at[world]]
        return Finished(float(rewards.sum()), float(rewards[-1]), len(rewards), dropped)
