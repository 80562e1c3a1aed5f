"""Stable-Baselines3 on the same task: TD3, and DDPG with hindsight goals, for as many environment steps as `default`.

Neither sees a demonstration. Both see layout `grip`, act in `steps` and train on the 8 directions, as `default on 8
directions` does: TD3 for reward `progress` with the predicted end to stop at, hindsight for sparse goals on the way. 16
environments step for each 4 updates, networks are 128x128, the batch is 128. Tested from 7 noisy starts in each of 16
directions, 4 s each; a goal-conditioned policy is asked for the predicted end of its grip.

Needs the extra `sb3` (torch) in an environment of its own. Run: python benchmarks/baselines.py td3|her [STEPS] [SEED]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np

from inhand.geometry import Array
from inhand.learning.environment_config import GoalConfig
from inhand.learning.starts import Noise, Starts, grid_of, gripped, plans_for, reach_of
from inhand.learning.worlds import Interface, ManipulationWorlds
from inhand.tasks.primitives import TRAIN, UNSEEN
from inhand.tasks.reach import limits
from timing import environment

INTERFACE = Interface("grip", "steps", "progress", horizon=200)
TRIALS, ENVIRONMENTS, UPDATES = 7, 16, 4
Actor = Callable[[Array, Array, Array], Array]
"""Actions for observations, achieved and desired goals."""


def learned(name: str, steps: int, seed: int) -> Actor:
    """Train and return what acts."""
    import torch
    from stable_baselines3 import DDPG, TD3, HerReplayBuffer
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.noise import NormalActionNoise

    torch.set_num_threads(1)  # small networks are slower on two threads
    noise = NormalActionNoise(np.zeros(4), 0.1 * np.ones(4))
    common: dict[str, Any] = {
        "action_noise": noise,
        "batch_size": 128,
        "gamma": 0.99,
        "train_freq": 1,
        "gradient_steps": UPDATES,
        "policy_kwargs": {"net_arch": [128, 128]},
        "seed": seed,
        "device": "cpu",
    }
    told: dict[str, Any] = {"observation": "grip", "actions": "steps", "horizon": 200, "starts": 256, "threads": 1}
    if name == "td3":
        envs = make_vec_env(
            lambda: gymnasium.make("inhand/Asterisk-v0", reward="progress", stop=True, **told), ENVIRONMENTS, seed=seed
        )
        model: Any = TD3("MlpPolicy", envs, **common).learn(steps)
        return lambda seen, *_: model.predict(seen.astype(np.float32), deterministic=True)[0]
    envs = make_vec_env(
        lambda: gymnasium.make("inhand/AsteriskGoal-v0", lost="truncated", **told), ENVIRONMENTS, seed=seed
    )
    common |= {"learning_starts": 4000, "replay_buffer_class": HerReplayBuffer}
    model = DDPG("MultiInputPolicy", envs, **common).learn(steps)

    def act(seen: Array, achieved: Array, desired: Array) -> Array:
        given = {"observation": seen, "achieved_goal": achieved, "desired_goal": desired}
        return np.asarray(model.predict({k: v.astype(np.float32) for k, v in given.items()}, deterministic=True)[0])

    return act


def tests() -> tuple[Starts, Array]:
    """Return starts in 16 directions with the ways that their grips reach, and the hand's limits [m]."""
    held, primitives = GoalConfig().held, (*TRAIN, *UNSEEN)
    angles = np.array([primitive.angle_deg for primitive in primitives], dtype=float)
    starts = gripped(
        *held, (plans_for(*held, grid_of(angles)), np.repeat(angles, TRIALS)), np.random.default_rng(100), Noise()
    )
    limit = np.repeat([each.distance for each in limits(*held, primitives)], TRIALS)
    return replace(starts, distance=reach_of(held, starts)), limit


def main() -> None:
    """Train, test and print one row."""
    name, steps, seed = sys.argv[1], *(int(word) for word in [*sys.argv[2:], "128000", "0"][:2])
    began = time.perf_counter()
    actor = learned(name, steps, seed)
    seconds = time.perf_counter() - began
    starts, limit = tests()
    held = GoalConfig().held
    worlds = ManipulationWorlds(held, starts, len(starts), INTERFACE, np.random.default_rng(0))
    seen, origin = worlds.reset(np.arange(len(starts))), held[0].start_pose
    desired, pose = worlds.aim.goal(starts.distance) - origin, worlds.state.pose
    running = np.ones(len(starts), dtype=bool)
    shift, worst = np.zeros((2, len(starts), 3))
    for _ in range(INTERFACE.horizon):
        step = worlds.step(actor(seen, pose - origin, desired))
        running = running & ~step.terminated
        shift = np.where(running[:, None], step.shift, shift)
        worst = np.maximum(worst, np.abs(shift))
        seen, pose = step.observation, step.after.pose
    share, half = shift[:, 0] / limit, len(starts) // 2
    means = share.reshape(-1, TRIALS).mean(axis=1)
    kept = np.asarray(running.reshape(-1, TRIALS).all(axis=1))
    print(environment())
    dropped = f"{(~running).sum()} of {len(running)}"
    print(
        f"| {name} | {seed} | {share[:half].mean():.3f} | {means[:8].min():.3f} | {kept[:8].sum()} |"
        f" {share[half:].mean():.3f} | {means[8:].min():.3f} | {kept[8:].sum()} | {dropped} |"
        f" {1e3 * worst[:, 1].max():.1f} | {np.rad2deg(worst[:, 2].max()):.1f} | - | {seconds:.0f} | - | - |"
    )


if __name__ == "__main__":
    main()
