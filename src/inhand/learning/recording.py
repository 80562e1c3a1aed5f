"""Demonstrations to datasets and back: a recording prepared, run, and turned into episodes and arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from copy import deepcopy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.grasp_search import GraspPlan
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.learning.datasets import DatasetEpisode, DatasetHead, DatasetKind, Floats
from inhand.learning.demonstrations import Episodes, Recipe, demonstrations
from inhand.learning.starts import Noise, grid_of, plans_for
from inhand.learning.worlds import Interface
from inhand.sim.names import MUJOCO, Engine
from inhand.tasks.cards import interface_card
from inhand.tasks.observations import find_layout

PLANNED_AT_ONCE = 8
"""Directions whose grasps are planned between two reports of progress."""
Told = Callable[[str, int, int], None]
"""Told what is being done, how far it is and how far it has to go."""


@dataclass(frozen=True)
class Recording:
    """What is to be recorded."""

    hand: HandSpec
    """The hand."""
    object: ObjectSpec
    """The object."""
    angles_deg: tuple[float, ...] | None
    """Directions [deg], drawn evenly; None draws anywhere on the circle."""
    recipe: Recipe
    """How demonstrations are made."""
    interface: Interface
    """What is seen, done and rewarded."""
    noise: Noise
    """Noise of the starts."""
    seed: int
    """Seed of everything drawn."""
    engine: Engine = MUJOCO
    """Physics engine."""

    @property
    def grid(self) -> tuple[float, ...]:
        """Directions that grasps are planned for [deg]."""
        anywhere = self.angles_deg is None or self.recipe.grip_spread > 0
        return grid_of(np.arange(0.0, 360.0) if anywhere else np.array(self.angles_deg))

    def head(self, directions: str, versions: dict[str, str]) -> DatasetHead:
        """Return the head of the dataset.

        Args:
            directions: the words that the directions were asked for by.
            versions: of this package and of what it ran on.
        """
        recipe, noise = self.recipe, (self.noise.position, self.noise.rotation)
        return DatasetHead(
            kind_of(self.hand, self.interface),
            self.object,
            recipe.expert,
            recipe.grasp,
            self.interface.reward,
            directions,
            noise,
            recipe.push,
            recipe.midway,
            recipe.whole,
            recipe.grip_spread,
            self.seed,
            versions,
            self.engine,
        )


@dataclass(frozen=True, eq=False)
class Transitions:
    """N decisions of many episodes, one after the other."""

    observations: Floats
    """What was seen `(N, d)`."""
    actions: Floats
    """What was done `(N, n)`."""
    wanted: Floats
    """What the expert wanted `(N, n)`."""
    rewards: Array
    """Rewards `(N,)`."""
    successors: Floats
    """What was seen after it `(N, d)`."""
    terminated: NDArray[np.bool_]
    """Whether the object was lost `(N,)`."""
    last: NDArray[np.bool_]
    """Whether the episode ended, by a loss or by the horizon `(N,)`."""


def kind_of(hand: HandSpec, interface: Interface) -> DatasetKind:
    """Return the kind of dataset that a controller with a hand and an interface can learn from."""
    card = interface_card(find_layout(interface.observation), interface.actions)
    return DatasetKind(hand, card, interface.actions, interface.horizon)


def environment_spec(recording: Recording, asked: tuple[str, str, str]) -> str:
    """Return the JSON of the environment in which the demonstrations are a controller's episodes.

    Args:
        recording: what is recorded.
        asked: the words that hand, object and directions were asked for by.
    """
    import gymnasium

    interface, noise = recording.interface, recording.noise
    hand, thing, directions = asked
    spec = deepcopy(gymnasium.spec("inhand/Asterisk-v0"))
    spec.kwargs = {
        "hand": hand,
        "object": thing,
        "directions": "all" if recording.angles_deg is None else directions,
        "observation": interface.observation,
        "actions": interface.actions,
        "reward": interface.reward,
        "horizon": interface.horizon,
        "noise_mm": 1e3 * noise.position,
        "noise_deg": float(np.rad2deg(noise.rotation)),
        "stop": True,
        "grasp": recording.recipe.grasp,
        "engine": recording.engine,
    }
    return str(spec.to_json())


def record(recording: Recording, told: Told) -> Iterator[Episodes]:
    """Plan the grasps, then give recorded episodes a batch at a time.

    Args:
        recording: what is to be recorded.
        told: told of `grasps` (directions planned) and `episodes`.
    """
    rng = np.random.default_rng(recording.seed)
    held, count = (recording.hand, recording.object), recording.recipe.episodes
    plans = _plans(recording, told)
    told("episodes", 0, count)

    def draw(number: int) -> Array:
        if recording.angles_deg is None:
            return 360.0 * rng.random(number)
        return np.asarray(rng.choice(np.array(recording.angles_deg), number))

    made = recording.recipe, recording.interface, recording.noise

    def recorded(done: int) -> None:
        told("episodes", done, count)

    yield from demonstrations(held, plans, draw, made, rng, engine=recording.engine, progress=recorded)


def dataset_episodes(batch: Episodes) -> Iterator[DatasetEpisode]:
    """Give the episodes of a batch one by one, each up to its end."""
    starts = batch.starts.state.pose
    for world, count in enumerate(batch.valid.sum(axis=0)):
        observations, actions, wanted = (
            np.ascontiguousarray(values[:rows, world], dtype=np.float32)
            for values, rows in ((batch.observations, count + 1), (batch.actions, count), (batch.wanted, count))
        )
        yield DatasetEpisode(
            observations,
            actions,
            wanted,
            batch.rewards[:count, world],
            bool(batch.terminated[world]),
            not batch.terminated[world],
            float(batch.angle_deg[world]),
            float(batch.distance[world]),
            float(batch.starts.distance[world]),
            starts[world],
        )


def transitions(episodes: Iterable[DatasetEpisode]) -> Transitions:
    """Return the decisions of at least one episode as arrays to learn from."""
    every = list(episodes)
    last = [np.arange(len(each.rewards)) == len(each.rewards) - 1 for each in every]
    return Transitions(
        np.concatenate([each.observations[:-1] for each in every]),
        np.concatenate([each.actions for each in every]),
        np.concatenate([each.wanted for each in every]),
        np.concatenate([each.rewards for each in every]),
        np.concatenate([each.observations[1:] for each in every]),
        np.concatenate([ends & each.terminated for ends, each in zip(last, every, strict=True)]),
        np.concatenate(last),
    )


def _plans(recording: Recording, told: Told) -> dict[float, GraspPlan]:
    """Return the grasps of the grid, planned a few directions at a time, which changes none of them."""
    grid, recipe = recording.grid, recording.recipe
    plans: dict[float, GraspPlan] = {}
    for first in range(0, len(grid), PLANNED_AT_ONCE):
        told("grasps", first, len(grid))
        angles = grid[first : first + PLANNED_AT_ONCE]
        plans |= plans_for(recording.hand, recording.object, angles, recipe.grasp, recording.engine)
    return plans
