"""What training needs before it starts: grasps, demonstrations, starts and what to measure against."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from inhand.control.catalogue import direction_plans
from inhand.errors import InputError
from inhand.folders import in_place
from inhand.geometry import Array
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.hands.grasp_search import GraspPlan
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.learning.config import Training
from inhand.learning.demonstrations import Episodes, demonstrations, recorded, route_demonstrations
from inhand.learning.recording import Told
from inhand.learning.replay import Columns, Replay, rows_of
from inhand.learning.starts import Noise, Starts, grid_of, gripped, joined, plans_for, reach_of
from inhand.sim.names import MUJOCO, Engine
from inhand.sim.snapshot import Snapshot
from inhand.sim.state import State
from inhand.tasks.observations import find_layout
from inhand.tasks.paths import stacked
from inhand.tasks.primitives import TRAIN, UNSEEN, Primitive
from inhand.tasks.reach import limits
from inhand.tasks.routes import Routes, routes_of
from inhand.tracing.tasks import find_task

TEST_SEED = 9000
"""Added to a run's seed for the starts that it is measured from."""
ROUTES = 64
"""Draws of a task that training end to end knows, and as many others that it is measured on."""

_NUMBERS = ("limit", "expert_total", "expert_fraction", "expert_rows")


@dataclass(frozen=True, eq=False)
class Ready:
    """What a training run starts with."""

    held: tuple[HandSpec, ObjectSpec]
    """The hand and the object."""
    columns: Columns
    """Layout of a replay's rows."""
    starts: Starts
    """Where the agent's episodes start: where the demonstrations started."""
    tests: Starts
    """Where evaluations start: `trials` for each of the 16 directions."""
    limit: Array
    """How far the hand could carry the object in each test start's direction, whatever its grip `(N,)` [m]."""
    expert_total: Array
    """Sum of the rewards of the expert from each test start `(N,)`."""
    expert_fraction: Array
    """Share of `limit` that the expert reached from each test start `(N,)`."""
    expert_rows: int
    """Rows of the demonstrations."""

    @property
    def trained(self) -> Array:
        """Which test starts are of the 8 training directions `(N,)`."""
        return np.asarray(np.isclose(self.tests.angle_deg % 45.0, 0.0))


def angles_of(primitives: Sequence[Primitive]) -> Array:
    """Return the directions of primitives that translate [deg]."""
    return np.array([primitive.angle_deg for primitive in primitives if primitive.angle_deg is not None])


def draw_directions(config: Training, rng: np.random.Generator, count: int) -> Array:
    """Return drawn directions [deg]."""
    named = rng.choice(angles_of(TRAIN), count)
    if config.directions == "train":
        return np.asarray(named)
    unseen = angles_of(UNSEEN)
    anywhere = 360.0 * rng.random((20, count))
    away = np.abs((anywhere[..., None] - unseen + 180.0) % 360.0 - 180.0).min(axis=-1)
    allowed = away >= config.held_out
    first = allowed.argmax(axis=0)
    found = np.where(allowed.any(axis=0), anywhere[first, np.arange(count)], named)
    return np.where(rng.random(count) < 0.5, named, found)


def make_ready(config: Training, folder: Path, told: Told) -> Ready:
    """Plan grasps, record the demonstrations into `folder/expert.rows` and measure the expert."""
    if config.task:
        return _ready_for_task(config, folder, told)
    rng = np.random.default_rng(config.seed)
    held = load_hand(config.hand), load_object(config.object)
    every = angles_of((*TRAIN, *UNSEEN))
    wide = config.directions == "continuous" or config.recipe.grip_spread > 0
    grid = grid_of(np.arange(0.0, 360.0, 1.0) if wide else every)
    told("grasps", 0, len(grid))
    plans = plans_for(*held, grid, config.recipe.grasp, config.engine)
    columns = Columns(find_layout(config.interface.observation).size(held[0]), held[0].n_joints)
    room = config.recipe.episodes * config.interface.horizon
    replay = Replay(folder / "expert.rows", columns, room, 0)
    parts = []
    made = config.recipe, config.interface, config.noise
    draw = partial(draw_directions, config, rng)
    for batch in demonstrations(held, plans, draw, made, rng, engine=config.engine):
        add_demonstrations(replay, columns, batch, (config.learning.discount, config.learning.look_ahead))
        parts.append(batch.starts)
        told("demonstrations", sum(len(part) for part in parts), config.recipe.episodes)
    replay.flush()
    test_rng = np.random.default_rng(config.seed + TEST_SEED)
    tests = gripped(*held, (plans, np.repeat(every, config.trials)), test_rng, config.noise, engine=config.engine)
    tests = replace(tests, distance=reach_of(held, tests))
    told("expert", 0, len(tests))
    shown, _ = recorded(held, tests, (replace(config.recipe, push=0.0), config.interface), test_rng)
    reach = {each.primitive.angle_deg: each.distance for each in limits(*held, (*TRAIN, *UNSEEN))}
    limit = np.array([reach[angle] for angle in tests.angle_deg])
    return Ready(held, columns, joined(parts), tests, limit, *_expert(shown, limit), replay.written)


def _expert(shown: Episodes, limit: Array) -> tuple[Array, Array]:
    """Return the sum of rewards and the share of the limit of the expert's episodes, each `(N,)`."""
    return (shown.rewards * shown.valid).sum(axis=0), shown.distance / limit


def _ready_for_task(config: Training, folder: Path, told: Told) -> Ready:
    """Return what training end to end on a whole task starts with: its routes in the place of directions."""
    rng = np.random.default_rng(config.seed)
    held = load_hand(config.hand), load_object(config.object)
    told("grasps", 0, 1)
    pool, test_pool = (
        route_pool(held, config.task, ROUTES, (config.seed + add, 3), config.engine) for add in (0, TEST_SEED)
    )
    columns = Columns(find_layout(config.interface.observation).size(held[0]), held[0].n_joints)
    replay = Replay(folder / "expert.rows", columns, config.recipe.episodes * config.interface.horizon, 0)
    parts = []
    made = config.recipe, config.interface

    def draw(count: int) -> Starts:
        return route_starts(held, pool, count, rng, config.noise, engine=config.engine)

    for batch in route_demonstrations(held, draw, made, rng):
        add_demonstrations(replay, columns, batch, (config.learning.discount, config.learning.look_ahead))
        parts.append(batch.starts)
        told("demonstrations", sum(len(part) for part in parts), config.recipe.episodes)
    replay.flush()
    test_rng = np.random.default_rng(config.seed + TEST_SEED)
    tests = route_starts(held, test_pool, 16 * config.trials, test_rng, config.noise, engine=config.engine)
    told("expert", 0, len(tests))
    shown, _ = recorded(held, tests, (replace(config.recipe, push=0.0), config.interface), test_rng)
    limit = routes_in(tests).length
    return Ready(held, columns, joined(parts), tests, limit, *_expert(shown, limit), replay.written)


@lru_cache(maxsize=16)
def route_pool(
    held: tuple[HandSpec, ObjectSpec], task: str, count: int, seed: tuple[int, int], engine: Engine = MUJOCO
) -> tuple[Routes, list[GraspPlan]]:
    """Return drawn routes of a task, each once, and the grasp of each.

    Args:
        held: the hand and the object.
        task: what `inhand.tracing.tasks.find_task` takes.
        count: number of draws; a task that draws nothing has one route.
        seed: of the draws; those of one seed are planned once.
        engine: in which the grasps are tried out.
    """
    rng, found = np.random.default_rng(seed), find_task(task)
    if found.wall is not None:
        raise InputError(f"task {task!r} needs a wall, and training worlds have none: train on another task")
    paths = [found.plan(Held(*held), rng).path.poses for _ in range(count)]
    kept = [path for k, path in enumerate(paths) if not any(np.array_equal(path, other) for other in paths[:k])]
    return routes_of(kept), direction_plans(*held, stacked(kept), engine)


def route_starts(
    held: tuple[HandSpec, ObjectSpec],
    pool: tuple[Routes, list[GraspPlan]],
    count: int,
    rng: np.random.Generator,
    noise: Noise,
    *,
    engine: Engine = MUJOCO,
) -> Starts:
    """Return starts with both fingers on the object, each with a route drawn from a pool."""
    routes, plans = pool
    rows = rng.integers(len(routes), size=count)
    fresh = gripped(*held, ([plans[row] for row in rows], np.zeros(count)), rng, noise, engine=engine)
    return replace(fresh, routes=Routes(routes.poses[rows]))


def routes_in(starts: Starts) -> Routes:
    """Return the routes of starts that have some.

    Raises:
        ValueError: they have directions.
    """
    if starts.routes is None:
        raise ValueError("starts of primitives have no routes")
    return starts.routes


def add_demonstrations(replay: Replay, columns: Columns, batch: Episodes, looking: tuple[float, int]) -> None:
    """Write the rows of recorded episodes to a replay."""
    for world, count in enumerate(batch.valid.sum(axis=0)):
        episode = (
            batch.observations[: count + 1, world],
            batch.actions[:count, world],
            batch.wanted[:count, world],
            batch.rewards[:count, world],
        )
        replay.add(rows_of(columns, episode, looking, terminated=bool(batch.terminated[world])))


def save_ready(ready: Ready, path: Path) -> None:
    """Write everything but the rows to a `.npz` file, moved into place once it is complete."""
    arrays = {name: np.asarray(getattr(ready, name)) for name in _NUMBERS}
    for name, starts in (("starts", ready.starts), ("tests", ready.tests)):
        arrays |= {f"{name}.angle_deg": starts.angle_deg, f"{name}.distance": starts.distance}
        if starts.routes is not None:
            arrays[f"{name}.routes"] = starts.routes.poses
        for part, kind in ((starts.snapshot, Snapshot), (starts.state, State)):
            arrays |= {f"{name}.{kind.__name__}.{f.name}": getattr(part, f.name) for f in fields(kind)}
    with in_place(path) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load_ready(config: Training, path: Path) -> Ready:
    """Return what `save_ready` wrote."""
    held = load_hand(config.hand), load_object(config.object)
    with np.load(path, allow_pickle=False) as data:

        def starts(name: str) -> Starts:
            snapshot = Snapshot(**{f.name: data[f"{name}.Snapshot.{f.name}"] for f in fields(Snapshot)})
            state = State(**{f.name: data[f"{name}.State.{f.name}"] for f in fields(State)})
            routes = Routes(data[f"{name}.routes"]) if f"{name}.routes" in data else None
            angle_deg, distance = data[f"{name}.angle_deg"], data[f"{name}.distance"]
            return Starts(snapshot, state, angle_deg, distance, routes, config.engine)

        columns = Columns(find_layout(config.interface.observation).size(held[0]), held[0].n_joints)
        return Ready(
            held,
            columns,
            starts("starts"),
            starts("tests"),
            data["limit"],
            data["expert_total"],
            data["expert_fraction"],
            int(data["expert_rows"]),
        )
