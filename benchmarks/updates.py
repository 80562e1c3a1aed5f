"""Updates per second of the learner against the same networks and losses in PyTorch, on one machine in one run.

Both hold an actor and one critic of 128x128 units with batch 64, one-step and n-step losses, Adam, L2 and slow copies.
Ours runs 500 updates in one `jax.lax.scan`; PyTorch runs them one after another, as its users do. PyTorch is not in
the lock: `pip install torch==2.13.0` into an environment of its own that has inhand[rl] too.

Bound: at least 4 times PyTorch.
Run: python benchmarks/updates.py
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from inhand.learning.config import Learning
from inhand.learning.ddpgfd import new_learner, update_many
from inhand.learning.replay_buffer import Columns
from timing import best_times, environment, verdict

UPDATES, COLUMNS = 500, Columns(31, 4)
LEARNING = Learning(hidden=(128, 128), batch=64)
Torch = Any
"""Something of PyTorch's, which is not installed where types are checked."""
BOUND = 4.0
"""Least ratio to PyTorch."""


def ours(rows: np.ndarray) -> Callable[[], None]:
    """Return a function that makes all updates in JAX."""
    learner = new_learner(LEARNING, COLUMNS, 0)
    weights = np.ones(rows.shape[:2], dtype=np.float32)

    def run() -> None:
        after, _ = update_many(learner, rows, weights, LEARNING, COLUMNS, strength=1.0)
        after.updates.block_until_ready()

    run()
    return run


def torchs(rows: np.ndarray) -> Callable[[], None]:
    """Return a function that makes the same updates in PyTorch, on as many threads as are fastest here: one."""
    import torch
    from torch import nn

    torch.set_num_threads(1)

    def network(inputs: int, outputs: int) -> Torch:
        return nn.Sequential(nn.Linear(inputs, 128), nn.ReLU(), nn.Linear(128, 128), nn.ReLU(), nn.Linear(128, outputs))

    actor, slow_actor = network(COLUMNS.d, COLUMNS.n), network(COLUMNS.d, COLUMNS.n)
    critic, slow_critic = (network(COLUMNS.d + COLUMNS.n, 1) for _ in range(2))
    optimisers = [torch.optim.Adam(net.parameters(), lr=1e-4, weight_decay=1e-4) for net in (actor, critic)]
    parts, data = COLUMNS.parts(), torch.from_numpy(rows)

    def value(net: Torch, observation: Torch, action: Torch) -> Torch:
        return net(torch.cat([observation, action], dim=-1))

    def run() -> None:
        for batch in data:
            row = {name: batch[:, columns] for name, columns in parts.items()}
            with torch.no_grad():
                targets = [
                    row[r] + row[g] * value(slow_critic, row[s], torch.tanh(slow_actor(row[s])))
                    for s, r, g in (("successor", "reward", "discount"), ("later", "reward_n", "discount_n"))
                ]
            found = value(critic, row["observation"], row["action"])
            loss = sum(((found - target) ** 2).mean() for target in targets)
            optimisers[1].zero_grad()
            loss.backward()
            optimisers[1].step()
            loss = -value(critic, row["observation"], torch.tanh(actor(row["observation"]))).mean()
            optimisers[0].zero_grad()
            loss.backward()
            optimisers[0].step()
            with torch.no_grad():
                for net, slow in ((actor, slow_actor), (critic, slow_critic)):
                    for new, old in zip(net.parameters(), slow.parameters(), strict=True):
                        old.lerp_(new, LEARNING.follow)

    run()
    return run


def main() -> None:
    """Time both in turns and print the ratio."""
    rows = np.random.default_rng(0).normal(size=(UPDATES, LEARNING.batch, COLUMNS.width)).astype(np.float32)
    best = best_times({"ours": ours(rows), "torch": torchs(rows)}, time.perf_counter, repeats=6, calls=1)
    rate = {name: UPDATES / seconds for name, seconds in best.items()}
    ratio = rate["ours"] / rate["torch"]
    print(environment())
    print(f"inhand, JAX, 128x128, batch 64    {rate['ours']:8,.0f} updates/s")
    print(f"PyTorch, the same                 {rate['torch']:8,.0f} updates/s")
    print(f"inhand / PyTorch  {ratio:5.2f}  (at least {BOUND}: {verdict(ratio >= BOUND)})")


if __name__ == "__main__":
    main()
