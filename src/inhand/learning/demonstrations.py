"""Demonstrations: an expert carries the object while noise pushes its hands about, so that it shows how to recover.

What the expert wanted is kept beside what was done: imitation copies the first, value learning needs the second.
A part of the episodes starts in the middle of earlier ones with a new direction, so that starts cover the workspace.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.control.catalogue import find_controller
from inhand.control.loop import sense
from inhand.control.user_policy import GraspKind
from inhand.geometry import Array
from inhand.hands.grasp_search import GraspPlan
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.learning.starts import Noise, Starts, expert_task, gripped, joined, reach_of, taken
from inhand.learning.worlds import Interface, ManipulationWorlds
from inhand.records import Config
from inhand.sim.names import MUJOCO, Engine
from inhand.tasks.actions import actions_of

BATCH = 512
"""Episodes recorded side by side."""
CORRELATION = 0.9
"""How much of the noise of one decision is left in the next."""
EARLIEST = 20
"""Decisions after which a state of an episode may start another."""


@dataclass(frozen=True)
class Recipe(Config):
    """How demonstrations are made."""

    episodes: int = 5000
    """Number of episodes (thesis 3.3.4 keeps 5,000 of the expert)."""
    expert: str = "ik"
    """Controller that demonstrates: ik, ik-cautious or thesis-ik."""
    push: float = 0.01
    """Largest standard deviation of the noise added to joint targets [rad]; each episode draws its own up to it."""
    midway: float = 0.25
    """Share of the episodes that start where an earlier one was under way, in a new direction."""
    grasp: GraspKind = "planned"
    """Grip of the starts: planned for each direction, or rough, on the middle of the object's sides (thesis 3.2)."""
    whole: float = 1.0
    """Share of the episodes that go as far as their grip reaches; the others stop somewhere before."""
    grip_spread: float = 0.0
    """Standard deviation of the angle between an episode's direction and the one whose grip it starts with [deg]."""


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
    """Way along the direction at its end `(B,)` [m]."""
    starts: Starts
    """Where they started, in which direction and how far they were to go."""


def demonstrations(
    held: tuple[HandSpec, ObjectSpec],
    plans: dict[float, GraspPlan],
    draw: Callable[[int], Array],
    made: tuple[Recipe, Interface, Noise],
    rng: np.random.Generator,
    *,
    engine: Engine = MUJOCO,
    progress: Callable[[int], None] | None = None,
) -> Iterator[Episodes]:
    """Give recorded episodes a batch at a time until all asked for are there.

    Args:
        held: the hand and the object.
        plans: a grasp for each direction of the grid (`plans_for`).
        draw: draws directions [deg], as many as it is asked for.
        made: how demonstrations are made, what is seen, done and rewarded, and the noise of starts.
        rng: draws noise and starts.
        engine: in which they are recorded.
        progress: told the number of recorded episodes, from time to time.
    """
    recipe, interface, noise = made
    done = 0
    kept: Starts | None = None
    while done < recipe.episodes:
        count = min(BATCH, recipe.episodes - done)
        again = 0 if kept is None else min(round(recipe.midway * count), len(kept))
        angles = draw(count - again)
        gripped_for = angles + recipe.grip_spread * rng.standard_normal(len(angles))
        fresh = replace(gripped(*held, (plans, gripped_for), rng, noise, engine=engine), angle_deg=angles)
        if kept is not None and again:
            fresh = joined([fresh, kept.take(rng.choice(len(kept), again, replace=False), draw(again))])
        reach = reach_of(held, fresh)
        share = np.where(rng.random(count) < recipe.whole, 1.0, rng.random(count))
        episodes, kept = recorded(held, replace(fresh, distance=share * reach), (recipe, interface), rng)
        done += count
        yield episodes
        if progress is not None:
            progress(done)


def route_demonstrations(
    held: tuple[HandSpec, ObjectSpec],
    draw: Callable[[int], Starts],
    made: tuple[Recipe, Interface],
    rng: np.random.Generator,
) -> Iterator[Episodes]:
    """Give recorded episodes along whole routes, a batch at a time; each begins where its route does.

    Args:
        held: the hand and the object.
        draw: draws starts with routes, as many as it is asked for.
        made: how demonstrations are made, and what is seen, done and rewarded.
        rng: draws the pushes.
    """
    for done in range(0, made[0].episodes, BATCH):
        yield recorded(held, draw(min(BATCH, made[0].episodes - done)), made, rng)[0]


def recorded(
    held: tuple[HandSpec, ObjectSpec], starts: Starts, made: tuple[Recipe, Interface], rng: np.random.Generator
) -> tuple[Episodes, Starts]:
    """Return one episode from each of B starts, and a state on the way of each that was under way long enough."""
    recipe, interface = made
    worlds = ManipulationWorlds(held, starts, len(starts), interface, rng)
    seen = [worlds.reset(np.arange(len(starts)))]
    expert = find_controller(recipe.expert).manipulate(expert_task(held, starts))
    expert.begin(sense(worlds.state))
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
            parts.append(taken(worlds.simulator, worlds.state, there, starts.angle_deg[there]))
        targets = expert.act(sense(worlds.state))
        push = CORRELATION * push + np.sqrt(1 - CORRELATION**2) * rng.standard_normal(push.shape)
        wanted, action = (
            actions_of(t, interface.actions, held[0], worlds.state) for t in (targets, targets + strength * push)
        )
        step = worlds.step(action)
        for name, value in zip(rows, (action, wanted, step.reward, running), strict=True):
            rows[name].append(value)
        seen.append(step.successor)
        distance = np.where(running, step.shift[:, 0], distance)
        terminated |= running & step.terminated
        running = running & ~step.terminated
    stacks: dict[str, NDArray[Any]] = {name: np.stack(values) for name, values in rows.items()}
    ends = {"terminated": terminated, "angle_deg": starts.angle_deg, "distance": distance}
    midway = joined(parts) if parts else starts.take(np.arange(0), np.zeros(0))
    return Episodes(np.stack(seen), **stacks, **ends, starts=starts), midway
