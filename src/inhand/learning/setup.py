"""What training needs before it starts: grasps, demonstrations, starts and what to measure against."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from inhand.control.loop import Told
from inhand.folders import in_place
from inhand.geometry import Array
from inhand.hands.spatial.pair import AnyPair, SpatialPair
from inhand.learning import space_pools
from inhand.learning.config import Training
from inhand.learning.datasets import DatasetEpisode, read_dataset
from inhand.learning.demonstrations import (
    BATCH,
    RoutePool,
    demonstrations,
    plans_of,
    recorded,
    route_pool,
    route_starts,
    starts_of,
    told_reach,
)
from inhand.learning.kept_starts import arrays_of, starts_from
from inhand.learning.pair_pools import by_form, midway, planned_pairs, pools_of, tests_of
from inhand.learning.progress import EXPERT, NEVER_SHOWN
from inhand.learning.recipe import SpatialRecording
from inhand.learning.replay_buffer import Columns, ReplayBuffer, rows_of
from inhand.learning.starts import Plans, Starts, gripped, joined
from inhand.learning.worlds import size_of
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import AnyHand
from inhand.tasks.primitives import TRAIN, UNSEEN
from inhand.tasks.reach import limits
from inhand.tasks.routes import Routes

TEST_SEED = 9000
"""Added to a run's seed for the starts that it is measured from."""
ROUTES = 64
"""Draws of a task that training end to end knows, and as many others that it is measured on."""

Pools = tuple[list[Starts], list[Starts], Callable[[Starts, int, np.random.Generator], Starts]]
"""Starts to learn from and to be tested with, and what makes some of states on the way of episodes."""
_NUMBERS = ("limit", "expert_total", "expert_fraction", "expert_rows")


@dataclass(frozen=True, eq=False)
class Ready:
    """What a training run starts with."""

    held: AnyPair
    """The hand and the object."""
    columns: Columns
    """Layout of a replay's rows."""
    starts: tuple[Starts, ...]
    """Where the agent's episodes start: where the demonstrations started. Each form of hand has a pool of its own."""
    tests: tuple[Starts, ...]
    """Where evaluations start: `trials` for each of the 16 directions, or what is tested in space."""
    limit: Array
    """How far the hand could carry the object in each test start's direction, whatever its grip `(N,)` [m]."""
    expert_total: Array
    """Sum of the rewards of the expert from each test start `(N,)`."""
    expert_fraction: Array
    """Share of `limit` that the expert reached from each test start `(N,)`."""
    expert_rows: int

    @property
    def angle_deg(self) -> Array:
        """Direction of each test start `(N,)` [deg]."""
        return np.concatenate([tests.angle_deg for tests in self.tests])

    @property
    def names(self) -> list[str]:
        """Direction of each test start: in the plane its angle [deg], in space its name or that it is never shown."""
        spaces = [tests.space for tests in self.tests if tests.space is not None]
        if not spaces:
            return [f"{angle:g}" for angle in self.angle_deg]
        return [name for space in spaces for name in space_pools.names_of(space)]

    @property
    def unit(self) -> str:
        """What stands behind a name."""
        return " deg" if all(tests.space is None for tests in self.tests) else ""

    @property
    def trained(self) -> Array:
        """Which test starts are of directions to learn, the 8 of training in the plane `(N,)`."""
        if not self.unit:
            return np.array([name != NEVER_SHOWN for name in self.names])
        return np.asarray(np.isclose(self.angle_deg % 45.0, 0.0))


def make_ready(config: Training, folder: Path, told: Told) -> Ready:
    """Plan grasps, write the rows of the demonstrations into a folder, and measure the expert."""
    if config.pairs or isinstance(config.held, SpatialPair):
        return _ready_of_pools(config, folder, told)
    recording, test_rng = config.recording, np.random.default_rng(config.seed + TEST_SEED)
    given, tests, limit = (_of_task if config.task else _of_primitives)(config, test_rng, told)
    held, columns = recording.held, columns_of(config, recording.hand)
    replay, starts = _demonstrated(config, given, folder / EXPERT, told)
    told("measuring the expert", 0, len(tests))
    shown = recorded(replace(recording, recipe=replace(config.recipe, push=0.0)), tests, test_rng)
    total = (shown.rewards * shown.valid).sum(axis=0)
    return Ready(held, columns, (starts,), (tests,), limit, total, shown.distance / limit, replay.written)


def _ready_of_pools(config: Training, folder: Path, told: Told) -> Ready:
    """Return the same of a family, or of a hand in space: starts are made before, in pools of one form of hand.

    The limit of a test start is how far its own grip is predicted to carry.
    """
    shows, rng = config.shows, np.random.default_rng(config.seed)
    pools, tests, begun_midway = (_of_pairs if config.pairs else _of_space)(config, rng, told)
    columns, total = columns_of(config, shows.held.hand), sum(map(len, pools))
    most = (total + round(config.recipe.midway * config.recipe.episodes)) * config.interface.horizon
    if config.demonstrations:
        replay, starts = _read(config, columns, folder / EXPERT, told), pools
    else:
        replay, starts = ReplayBuffer(folder / EXPERT, columns, most, 0), []
    for pool in () if config.demonstrations else pools:
        told("recording demonstrations", sum(map(len, starts)), most // config.interface.horizon)
        episodes = recorded(shows, pool, rng)
        _add(config, columns, replay, episodes.apart())
        again = begun_midway(episodes.midway, round(config.recipe.midway * len(pool)), rng)
        starts += [pool, again]
        if len(again):
            _add(config, columns, replay, recorded(shows, again, rng).apart())
    replay.flush()
    quiet = replace(config, recipe=replace(config.recipe, push=0.0)).shows
    told("measuring the expert", 0, sum(map(len, tests)))
    shown = [recorded(quiet, each, rng) for each in tests]
    reward = np.concatenate([(each.rewards * each.valid).sum(axis=0) for each in shown])
    limit, came = (np.concatenate([each.distance for each in group]) for group in (tests, shown))
    agent = tuple(by_form(starts) if config.pairs else [joined(starts)])
    return Ready(shows.held, columns, agent, tuple(tests), limit, reward, came / limit, replay.written)


def _of_pairs(config: Training, rng: np.random.Generator, told: Told) -> Pools:
    """Return the pools of a family: to learn from, to be tested with, and what makes starts of states on the way."""
    learned, tested = planned_pairs(config, told)
    pools = pools_of(config, learned, rng, told)
    tests = tests_of(config, tested, np.random.default_rng(config.seed + TEST_SEED))
    return pools, tests, partial(midway, config.recording)


def _of_space(config: Training, rng: np.random.Generator, told: Told) -> Pools:
    """Return the same of a hand in space."""
    shows = config.shows
    if not isinstance(shows, SpatialRecording):
        raise TypeError(f"hand {shows.hand.name!r} is of the plane")
    plans = space_pools.planned(shows, told)
    told("gripping objects", 0, 1)
    count = BATCH if config.demonstrations else config.recipe.episodes
    pool = space_pools.pool_of(shows, plans, count, rng)
    tests = space_pools.tests_of(shows, config.trials, told)
    return [pool], [tests], partial(space_pools.midway, shows)


def _of_primitives(config: Training, rng: np.random.Generator, told: Told) -> tuple[Plans, Starts, Array]:
    """Return the grasps of all directions, where evaluations start, and the hand's limit there `(N,)` [m]."""
    recording = config.recording
    reach = {each.primitive.angle_deg: each.distance for each in limits(*recording.held, (*TRAIN, *UNSEEN))}
    every = [angle for angle in reach if angle is not None]
    plans = plans_of(recording, every, told)
    directions = np.repeat(every, config.trials)
    tests = gripped(
        *recording.held, (plans, directions), rng, config.noise, engine=config.engine, disturb=recording.disturb
    )
    tests = replace(tests, distance=told_reach(recording, tests, rng))
    return plans, tests, np.array([reach[angle] for angle in tests.angle_deg])


def _of_task(config: Training, rng: np.random.Generator, told: Told) -> tuple[RoutePool, Starts, Array]:
    """Return the same of a whole task: its routes in the place of directions, their ways in that of the limit."""
    held, varied = config.recording.held, config.recipe.grasp == "sensed"
    told("planning grasps", 0, 1)
    pool, test_pool = (
        route_pool(held, config.task, ROUTES, (config.seed + add, 3), config.engine, varied=varied)
        for add in (0, TEST_SEED)
    )
    count, disturb = 16 * config.trials, config.recording.disturb
    tests = route_starts(held, test_pool, count, rng, config.noise, engine=config.engine, disturb=disturb)
    return pool, tests, routes_in(tests).length


def _demonstrated(config: Training, given: Plans | RoutePool, path: Path, told: Told) -> tuple[ReplayBuffer, Starts]:
    """Return the rows of demonstrations, recorded now or read from a dataset, and where the agent starts."""
    recording, rng = config.recording, np.random.default_rng(config.seed)
    columns = columns_of(config, recording.hand)
    if config.demonstrations:
        replay = _read(config, columns, path, told)
        starts = starts_of(recording, given, BATCH, rng)
    else:
        replay = ReplayBuffer(path, columns, config.recipe.episodes * config.interface.horizon, 0)
        parts = []
        for batch in demonstrations(recording, given, rng, told):
            _add(config, columns, replay, batch.apart())
            parts.append(batch.starts)
        starts = joined(parts)
    replay.flush()
    return replay, starts


def _read(config: Training, columns: Columns, path: Path, told: Told) -> ReplayBuffer:
    """Return the rows of a dataset's demonstrations."""
    _, episodes = read_dataset(Path(config.demonstrations))
    replay = ReplayBuffer(path, columns, len(episodes) * config.interface.horizon, 0)
    for number, episode in enumerate(episodes, start=1):
        _add(config, columns, replay, [episode])
        if number % BATCH == 0 or number == len(episodes):
            told("reading demonstrations", number, len(episodes))
    return replay


def _add(config: Training, columns: Columns, replay: ReplayBuffer, shown: Iterable[DatasetEpisode]) -> None:
    """Write the rows of episodes."""
    looking = (config.learning.discount, config.learning.look_ahead)
    for each in shown:
        episode = each.observations, each.actions, each.wanted, each.rewards
        replay.add(rows_of(columns, episode, looking, terminated=each.terminated))


def columns_of(config: Training, hand: AnyHand) -> Columns:
    """Return the layout of a replay's rows."""
    layout = find_layout(config.interface.observation)
    seen = layout.size(hand)
    return Columns(seen, layout.actions(hand), size_of(config.interface, hand) - seen, layout.columns)


def routes_in(starts: Starts) -> Routes:
    """Return the routes of starts that have some.

    Raises:
        ValueError: they have directions.
    """
    if starts.routes is None:
        raise ValueError("starts of primitives have no routes")
    return starts.routes


def _named(ready: Ready) -> Iterator[tuple[str, Starts]]:
    """Give the pools of starts and tests with their names in a file."""
    for name, pools in (("starts", ready.starts), ("tests", ready.tests)):
        for number, pool in enumerate(pools):
            yield f"{name}.{number}", pool


def save_ready(ready: Ready, path: Path) -> None:
    """Write everything but the rows to a `.npz` file, moved into place once it is complete."""
    arrays = {name: np.asarray(getattr(ready, name)) for name in _NUMBERS}
    arrays["pools"] = np.array([len(ready.starts), len(ready.tests)])
    for name, starts in _named(ready):
        arrays |= arrays_of(starts, name)
    with in_place(path) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load_ready(config: Training, path: Path) -> Ready:
    """Return what `save_ready` wrote."""
    held = config.held
    with np.load(path, allow_pickle=False) as data:
        starts, tests = (
            tuple(starts_from(data, f"{name}.{k}", config.engine) for k in range(count))
            for name, count in zip(("starts", "tests"), data["pools"].tolist(), strict=True)
        )
        limit, total, fraction = (data[name] for name in _NUMBERS[:-1])
        columns = columns_of(config, held.hand)
        return Ready(held, columns, starts, tests, limit, total, fraction, int(data["expert_rows"]))
