"""Recorded episodes side by side, and one by one."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.learning.datasets import DatasetEpisode
from inhand.learning.starts import Starts


@dataclass(frozen=True, eq=False)
class Episodes:
    """B recorded episodes of T decisions each; decisions after an episode's end are marked invalid."""

    observations: Array
    """Observations `(T + 1, B, d)`."""
    actions: Array
    """What was done `(T, B, n)`."""
    wanted: Array
    """What the expert wanted `(T, B, n)`."""
    rewards: Array
    """Rewards `(T, B)`."""
    valid: NDArray[np.bool_]
    """Whether the episode was still running `(T, B)`."""
    terminated: NDArray[np.bool_]
    """Whether it ended by losing the object `(B,)`."""
    angle_deg: Array
    """Direction `(B,)` [deg]."""
    distance: Array
    """Way along the direction at its end, of a turn its arc `(B,)` [m]."""
    starts: Starts
    """Where they started, in which direction and how far they were to go."""
    midway: Starts
    """States on the way of them, from which others may start."""

    def apart(self) -> Iterator[DatasetEpisode]:
        """Give the episodes one by one, each up to its end."""
        for world, count in enumerate(self.valid.sum(axis=0)):
            observations, actions, wanted = (
                np.ascontiguousarray(values[:rows, world], dtype=np.float32)
                for values, rows in ((self.observations, count + 1), (self.actions, count), (self.wanted, count))
            )
            space = self.starts.space
            yield DatasetEpisode(
                observations,
                actions,
                wanted,
                self.rewards[:count, world],
                bool(self.terminated[world]),
                not self.terminated[world],
                float(self.angle_deg[world]),
                float(self.distance[world]),
                float(self.starts.distance[world]),
                (self.starts.state.pose if space is None else self.starts.state.object_pose)[world],
                *(() if space is None else (space.along[world], space.about[world], space.gravity[world])),
            )
