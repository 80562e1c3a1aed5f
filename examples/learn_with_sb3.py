"""Learn with Stable-Baselines3: `td3` on `inhand/AsteriskEasy-v0`, or `her`, hindsight on `inhand/AsteriskGoal-v0`.

A learner that knows nothing of this toolkit, from no demonstrations: a check of the environments, and a start for your
own. For results, `inhand train` learns from the expert. Needs the extra `sb3`: pip install 'inhand[sb3]'.

Run: python examples/learn_with_sb3.py td3|her [STEPS]
"""

from __future__ import annotations

import sys

import gymnasium
import numpy as np
from stable_baselines3 import DDPG, TD3, HerReplayBuffer
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import NormalActionNoise

MODULE = "inhand.learning.environments"
"""Gymnasium imports it, which registers the environments."""
KEYWORDS = {"actions": "fine", "observation": "grip"}
"""Fine steps of the joint targets start from the grip that holds; random joint angles would let go at once."""


def td3(steps: int) -> BaseAlgorithm:
    """Move the object as far along one of eight directions as it goes, for a reward of a centimetre each.

    `inhand.policy(model, "grip", "fine", stop=True)` is what came of it as a controller of the Asterisk Test.
    """
    env = gymnasium.make(f"{MODULE}:inhand/AsteriskEasy-v0")
    model = TD3("MlpPolicy", env, action_noise=NormalActionNoise(np.zeros(4), 0.1 * np.ones(4)), seed=0, verbose=1)
    return model.learn(steps)


def her(steps: int) -> BaseAlgorithm:
    """Move the object to a goal on one of eight directions; look at `success_rate`.

    A lost object cuts episodes off instead of ending them, so that losing it is no way out of rewards of -1.
    """
    env = gymnasium.make(f"{MODULE}:inhand/AsteriskGoal-v0", lost="truncated", horizon=150, **KEYWORDS)
    model = DDPG(
        "MultiInputPolicy",
        env,
        replay_buffer_class=HerReplayBuffer,
        action_noise=NormalActionNoise(np.zeros(4), 0.1 * np.ones(4)),
        learning_starts=200,
        gamma=0.98,
        seed=0,
        verbose=1,
    )
    return model.learn(steps)


if __name__ == "__main__":
    {"td3": td3, "her": her}[sys.argv[1]](int(sys.argv[2]) if len(sys.argv) > 2 else 20_000)
