"""What chance and a small search make of `inhand/AsteriskEasy-v0`: is there something to learn, from nothing?

Chance: uniform actions in the default setting and in the easy one, how long the object stays held. The search: the
cross-entropy method over linear policies (31 numbers and a constant to four joints), a minute or two a seed, no
demonstration, no gradient; its mean policy is tried from starts of its own.

Bound: chance holds the object for at least 10 times as many decisions as in the default setting, and with every
seed the search carries it at least 15 mm farther than chance does.
Run: python benchmarks/easy.py [GENERATIONS]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.spaces.utils import flatdim

from inhand.environment_ids import IDS
from inhand.geometry import Array
from inhand.learning.environments import AsteriskVectorEnv
from timing import environment, verdict

DIRECTIONS = (90.0, 0.0, -90.0, 180.0)
"""Directions that a policy is tried in [deg]: Out, Right, In and Left."""
POLICIES, BEST, SPREAD = 24, 8, 0.1
"""Policies of a generation, how many of them the next is drawn around, and the standard deviation of the first."""
EASY = "inhand/AsteriskEasy-v0"
"""The setting."""
LEAST = 0.015
"""Way that the search must gain over chance [m]."""
SEEDS = (0, 1, 2)
"""Seeds of the search."""


def made(name: str, count: int) -> AsteriskVectorEnv:
    """Return so many environments of an id."""
    keywords: dict[str, Any] = IDS[name][1] | {"directions": DIRECTIONS}
    return AsteriskVectorEnv(count, **keywords)


def tried(envs: AsteriskVectorEnv, act: Callable[[Array], Array], seed: int) -> tuple[Array, Array, Array]:
    """Return reward, way along [m] and length of one episode of every environment, directions in turn, each `(B,)`."""
    count = envs.num_envs
    seen, _ = envs.reset(seed=seed, options={"direction": np.resize(DIRECTIONS, count)})
    total, along, length = np.zeros((3, count))
    running = np.ones(count, dtype=bool)
    while running.any():
        seen, reward, terminated, truncated, info = envs.step(act(seen))
        total += np.where(running, reward, 0.0)
        length += running
        ends = running & (terminated | truncated)
        if ends.any():
            along[ends] = info["final_info"]["along"][ends]
        running &= ~ends
    return total, along, length


def linear(policies: Array, each: int) -> Callable[[Array], Array]:
    """Return what linear policies `(P, d + 1, n)` do, each in so many environments."""
    weights = np.repeat(policies, each, axis=0)
    return lambda seen: np.einsum("bd,bdn->bn", seen, weights[:, :-1]) + weights[:, -1]


def searched(envs: AsteriskVectorEnv, seed: int, generations: int) -> Array:
    """Return the policy `(1, d + 1, n)` around which the last generation would have been drawn."""
    rng, ways = np.random.default_rng(seed), len(DIRECTIONS)
    shape = (flatdim(envs.single_observation_space) + 1, flatdim(envs.single_action_space))
    middle, spread = np.zeros(shape), np.full(shape, SPREAD)
    for _ in range(generations):
        half = rng.standard_normal((POLICIES // 2, *shape))
        policies = middle + spread * np.concatenate([half, -half])
        total, _, _ = tried(envs, linear(policies, ways), int(rng.integers(1 << 30)))
        best = policies[np.argsort(total.reshape(POLICIES, ways).mean(axis=1))[-BEST:]]
        middle = 0.3 * middle + 0.7 * best.mean(axis=0)
        spread = np.sqrt(0.5 * spread**2 + 0.5 * best.var(axis=0))
    return middle[None]


def chance(name: str) -> tuple[float, float]:
    """Print how long uniform actions hold the object, and return that in decisions and the way along [m]."""
    envs, rng = made(name, 256), np.random.default_rng(0)
    _, along, length = tried(envs, lambda seen: rng.uniform(-1.0, 1.0, (len(seen), 4)), 0)
    held = float(np.median(length))
    print(f"chance, {name}: held for {held:.0f} decisions (median of 256), {1e3 * along.mean():.1f} mm along")
    return held, float(along.mean())


def main() -> None:
    """Try chance and the search, and print what came of them."""
    generations = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    print(environment())
    default, _ = chance("inhand/Asterisk-v0")
    held, way = chance(EASY)
    print(f"{held / default:.0f} times as long: {verdict(held >= 10 * default)}")
    envs, fresh = made(EASY, len(DIRECTIONS) * POLICIES), made(EASY, 64)
    for seed in SEEDS:
        began = time.perf_counter()
        policy = searched(envs, seed, generations)
        took = time.perf_counter() - began
        _, along, length = tried(fresh, linear(policy, 64), 9000 + seed)
        lost = (length < length.max()).sum()
        told = verdict(along.mean() - way >= LEAST)
        print(f"search, seed {seed}: {1e3 * along.mean():.1f} mm along, {lost} of 64 lost, {took:.0f} s: {told}")


if __name__ == "__main__":
    main()
