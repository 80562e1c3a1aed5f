"""Demonstrations: an expert carries the object while noise pushes its hands about, so that it shows how to recover.

What the expert wanted is kept beside what was done: imitation copies the first, value learning needs the second.
A part of the episodes starts in the middle of earlier ones with a new direction, so that starts cover the workspace.
Datasets and training record by the same lines; one writes episodes to a folder, the other rows to learn from.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from inhand.control.catalogue import direction_plans
from inhand.control.loop import Told
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.fit import Held
from inhand.learning import space_pools
from inhand.learning.episodes import Episodes
from inhand.learning.experts import TEACHERS, expert_of, taught_reach
from inhand.learning.legs import around, drawn_legs
from inhand.learning.recipe import AnyRecording, Recording, SpatialRecording
from inhand.learning.starts import (
    Grips,
    Noise,
    Plans,
    Starts,
    grid_of,
    gripped,
    grips_along,
    joined,
    reach_of,
    straight_poses,
    taken,
    varied_plans,
)
from inhand.learning.worlds import ManipulationWorlds
from inhand.sim.disturbance import Disturbance
from inhand.sim.names import ENGINE, Engine
from inhand.tasks.decisions import largest_step
from inhand.tasks.paths import path_of, stacked
from inhand.tasks.primitives import TURNS
from inhand.tasks.routes import Routes, routes_of
from inhand.tracing.tasks import find_task

SIDES = tuple(each.name for each in TURNS)
"""Words for the grasps of turns to either side,"""
AROUND = "around"
"""and for those of episodes in which primitive follows primitive."""
RoutePool = tuple[Routes, Sequence[Grips]]
"""Routes of a whole task, and what each is gripped by."""
Given: TypeAlias = Plans | RoutePool | space_pools.Planned
"""A grasp for each direction of the grid, routes of a task, or in space primitives with their grasps."""
PLANNED_AT_ONCE = 8
"""Directions whose grasps are planned between two reports of progress."""
MOST_EPISODES = 100_000
"""Demonstrations at most: about ten minutes of two cores, and 9 GB of rows to learn from."""
EPISODE_MB, EPISODE_S = 0.09, 0.006
"""What one of 200 decisions takes of disk [MB], and of two cores [s] (docs/benchmarks.md)."""
BATCH = 512
"""Episodes recorded side by side."""
CORRELATION = 0.9
"""How much of the noise of one decision is left in the next."""
MOST_EMPTY = 10
"""Batches in a row whose starts all failed."""
EARLIEST = 20
"""Decisions after which a state of an episode may start another."""


def check_episodes(count: int, given: str) -> None:
    """Refuse a number of demonstrations that cannot be recorded.

    Args:
        count: the number.
        given: what was given, as the text is to say it.

    Raises:
        InputError: the text tells what they would take.
    """
    if count < 1:
        raise InputError(f"{given}: give at least 1")
    if count > MOST_EPISODES:
        raise InputError(
            f"{given}: they would take about {count * EPISODE_MB / 1e3:.0f} GB of disk and"
            f" {count * EPISODE_S / 3600:.0f} hours of two cores; at most {MOST_EPISODES} are recorded at a time"
        )


def demonstrations(
    recording: AnyRecording,
    given: Given,
    rng: np.random.Generator,
    told: Told = lambda *_: None,
    before: tuple[int, int, Starts | None] = (0, 0, None),
) -> Iterator[Episodes]:
    """Give recorded episodes a batch at a time until all asked for are there.

    Args:
        recording: what is to be recorded.
        given: a grasp for each direction of the grid (`plans_of`), or the routes of the task (`route_pool`).
        rng: draws noise and starts.
        told: told how many are recorded, and how many of them lost the object.
        before: how many were recorded before and lost the object, and the states on the way of the last of them.

    Raises:
        InputError: in ten batches no start could be held.
    """
    (done, lost, kept), total, empty = before, recording.recipe.episodes, 0
    told("recording demonstrations", done, total)
    while done < total:
        starts = starts_of(recording, given, min(BATCH, total - done), rng, kept)
        empty = 0 if len(starts) else empty + 1
        if empty == MOST_EMPTY:
            held = recording.held
            raise InputError(
                f"no grasp holds {held.object.name!r} in {held.hand.name!r} at the start, in {empty} batches in a row:"
                " use less start noise, another object or another hand"
            )
        if empty:
            continue
        episodes = recorded(recording, starts, rng)
        kept = episodes.midway
        done, lost = done + len(starts), lost + int(episodes.terminated.sum())
        yield episodes
        told(f"recording demonstrations{f', {lost} lost' if lost else ''}", done, total)


def starts_of(
    recording: AnyRecording, given: Given, count: int, rng: np.random.Generator, kept: Starts | None = None
) -> Starts:
    """Return where `count` episodes start and how far they are to go, some of them from states of earlier ones.

    In space those whose grip fails are left out.
    """
    if isinstance(recording, SpatialRecording):
        return space_pools.starts_in_space(recording, cast("space_pools.Planned", given), count, rng, kept)
    given, (held, recipe) = cast("Plans | RoutePool", given), (recording.held, recording.recipe)
    if isinstance(given, tuple):
        return route_starts(
            held, given, count, rng, recording.noise, engine=recording.engine, disturb=recording.disturb
        )
    turning, walking = round(recipe.turns * count), round(recipe.legs * count)
    parts = [_directed(recording, given, count - turning - walking, rng, kept)]
    if turning:
        parts.append(_turning(recording, given, turning, rng))
    if walking:
        parts.append(_walking(recording, given, walking, rng))
    return joined(parts) if len(parts) > 1 else parts[0]


def _directed(recording: Recording, given: Plans, count: int, rng: np.random.Generator, kept: Starts | None) -> Starts:
    """Return starts that are to move along drawn directions, some of them from states of earlier episodes."""
    held, recipe = recording.held, recording.recipe
    again = 0 if kept is None else min(round(recipe.midway * count), len(kept))
    angles = recording.draw(rng, count - again)
    gripped_for = angles + recipe.grip_spread * rng.standard_normal(len(angles))
    grips, disturb = (given, gripped_for), recording.disturb
    found = gripped(*held, grips, rng, recording.noise, engine=recording.engine, disturb=disturb)
    fresh = replace(found, angle_deg=angles)
    if kept is not None and again:
        rows = rng.choice(len(kept), again, replace=False)
        fresh = joined([fresh, kept.take(rows, recording.draw(rng, again))])
    return _told(recording, fresh, rng)


def _turning(recording: Recording, given: Plans, count: int, rng: np.random.Generator) -> Starts:
    """Return starts that are to turn on the spot, half of them to each side."""
    parts = []
    for word, side, some in zip(SIDES, (-1.0, 1.0), (count // 2, count - count // 2), strict=True):
        fresh = _gripped_by(recording, given[word], some, rng)
        parts.append(replace(fresh, turn=np.full(some, side)))
    return _told(recording, joined(parts), rng)


def _walking(recording: Recording, given: Plans, count: int, rng: np.random.Generator) -> Starts:
    """Return starts that are to go from place to place, and to turn on the way."""
    fresh = _gripped_by(recording, given[AROUND], count, rng)
    legs = drawn_legs(recording.held, count, rng)
    first = fresh.state.pose + drawn_legs(recording.held, count, rng)[:, 0] * (1, 1, 0) - (*recording.held.start[:2], 0)
    way = (first - fresh.state.pose)[:, :2]
    distance = np.linalg.norm(way, axis=-1)
    return replace(fresh, angle_deg=np.rad2deg(np.arctan2(way[:, 1], way[:, 0])), distance=distance, legs=legs)


def _gripped_by(recording: Recording, plans: Grips, count: int, rng: np.random.Generator) -> Starts:
    """Return starts held by grasps that no direction tells apart."""
    grips = {0.0: plans}, np.zeros(count)
    return gripped(*recording.held, grips, rng, recording.noise, engine=recording.engine, disturb=recording.disturb)


def _told(recording: Recording, starts: Starts, rng: np.random.Generator) -> Starts:
    """Return starts with the way that they are told to go: as far as their grip reaches, or somewhere before."""
    reach = told_reach(recording, starts, rng)
    return replace(starts, distance=recording.recipe.shares(len(starts), rng) * reach)


def told_reach(recording: Recording, starts: Starts, rng: np.random.Generator) -> Array:
    """Return how far starts `(N,)` [m] are told to go at most: as far as their expert is predicted to carry them."""
    if recording.recipe.expert in TEACHERS and starts.disturbed is not None:
        return taught_reach(recording.held, starts, rng, recording.recipe.expert)
    return reach_of(recording.held, starts)


def plans_of(recording: Recording, also_deg: Sequence[float] = (), told: Told = lambda *_: None) -> Plans:
    """Return the grasps of the grid and of other directions, planned a few at a time, which changes none of them."""
    grid, recipe = grid_of(np.array([*recording.grid, *also_deg])), recording.recipe
    along = partial(grips_along, recording.held, grasp=recipe.grasp, engine=recording.engine)
    plans: dict[Any, Grips] = {}
    for first in range(0, len(grid), PLANNED_AT_ONCE):
        told("planning grasps", first, len(grid))
        angles = grid[first : first + PLANNED_AT_ONCE]
        plans |= zip(angles, along(straight_poses(recording.hand, angles)), strict=True)
    if recipe.turns:
        turns = np.stack([recording.hand.start_pose + path_of(turn).poses for turn in TURNS])
        plans |= zip(SIDES, along(turns), strict=True)
    if recipe.legs:
        plans[AROUND] = along(around(recording.held)[None])[0]
    return plans


@lru_cache(maxsize=16)
def route_pool(
    held: Held, task: str, count: int, seed: tuple[int, int], engine: Engine = ENGINE, *, varied: bool = False
) -> RoutePool:
    """Return drawn routes of a task, each once, and the grasp of each.

    Args:
        held: the hand and the object.
        task: what `inhand.tracing.tasks.find_task` takes.
        count: number of draws; a task that draws nothing has one route.
        seed: of the draws; those of one seed are planned once.
        engine: in which the grasps are tried out.
        varied: whether grasps are not tried out, but all that go to the end with some share of the friction.
    """
    rng, found = np.random.default_rng(seed), find_task(task)
    if found.wall is not None:
        raise InputError(f"task {task!r} needs a wall, and training worlds have none: train on another task")
    paths = [found.plan(held, rng).path.poses for _ in range(count)]
    kept = [path for k, path in enumerate(paths) if not any(np.array_equal(path, other) for other in paths[:k])]
    poses = stacked(kept)
    return routes_of(kept), varied_plans(held, poses, 1.0) if varied else direction_plans(*held, poses, engine)


def route_starts(
    held: Held,
    pool: RoutePool,
    count: int,
    rng: np.random.Generator,
    noise: Noise,
    *,
    engine: Engine = ENGINE,
    disturb: Disturbance | None = None,
) -> Starts:
    """Return starts with all fingers on the object, each with a route drawn from a pool."""
    routes, plans = pool
    rows = rng.integers(len(routes), size=count)
    grips = [plans[row] for row in rows], np.zeros(count)
    fresh = gripped(*held, grips, rng, noise, engine=engine, disturb=disturb)
    return replace(fresh, routes=Routes(routes.poses[rows]))


def recorded(
    recording: AnyRecording, starts: Starts, rng: np.random.Generator, actor: Callable[[Array], Array] | None = None
) -> Episodes:
    """Return one episode from each of B starts, with a state on the way of each that was under way long enough.

    With an `actor` the expert tells at each of its decisions what it would do, and steers some episodes itself.
    """
    held, recipe, interface = recording.held, recording.recipe, recording.interface
    worlds = ManipulationWorlds(held, starts, len(starts), interface, rng)
    seen = [worlds.reset(np.arange(len(starts)))]
    asked = worlds.aim
    expert, size = expert_of(recipe.expert, held, starts, worlds), worlds.layout.size(held.hand)
    does = _doing(recording, actor, len(starts), rng)
    push = np.zeros(worlds.state.targets.shape)
    strength = recipe.push * rng.random((len(starts), 1))
    pick = rng.integers(EARLIEST, max(interface.horizon, EARLIEST + 1), size=len(starts))
    running = np.ones(len(starts), dtype=bool)
    terminated, distance = np.zeros(len(starts), dtype=bool), np.zeros(len(starts))
    rows: dict[str, list[NDArray[Any]]] = {name: [] for name in ("actions", "wanted", "rewards", "valid")}
    parts = []
    for number in range(interface.horizon):
        there = np.flatnonzero((pick == number) & running & worlds.state.touching.all(axis=-1))
        if len(there):
            parts.append(taken(worlds.simulator, worlds.state, there, starts.angle_deg[there], of=starts))
        targets = expert()
        push = CORRELATION * push + np.sqrt(1 - CORRELATION**2) * rng.standard_normal(push.shape)
        wanted, action = (worlds.actions_of(t) for t in (targets, targets + strength * push))
        action = does(action, seen[-1][:, :size], worlds.widened(strength * push))
        step = worlds.step(action)
        for name, value in zip(rows, (action, wanted, step.reward, running), strict=True):
            rows[name].append(value)
        seen.append(step.successor)
        distance = np.where(running, asked.come(step.shift), distance)
        terminated |= running & step.terminated
        running = running & ~step.terminated
    stacks: dict[str, NDArray[Any]] = {name: np.stack(values) for name, values in rows.items()}
    ends = {"terminated": terminated, "angle_deg": starts.angle_deg, "distance": distance}
    midway = joined(parts) if parts else starts.take(np.arange(0), np.zeros(0))
    return Episodes(np.stack(seen), starts=starts, midway=midway, **stacks, **ends)


def _doing(
    recording: AnyRecording, actor: Callable[[Array], Array] | None, count: int, rng: np.random.Generator
) -> Callable[[Array, Array, Array], Array]:
    """Return what is done where an expert acts so, so much is seen and a push comes: that, or what an actor does."""
    if actor is None:
        return lambda expert, _seen, _push: expert
    steered, largest = rng.random((count, 1)) < recording.recipe.steered, largest_step(recording.interface.actions)

    def does(expert: Array, seen: Array, push: Array) -> Array:
        return np.where(steered, expert, np.clip(actor(seen) + push / largest, -1.0, 1.0))

    return does
