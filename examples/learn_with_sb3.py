"""Learn with Stable-Baselines3: `td3` on `inhand/AsteriskEasy-v0`, or `her`, hindsight on `inhand/AsteriskGoal-v0`.

A learner that knows nothing of this toolkit, from no demonstrations: a check of the environments, and a start for your
own. For results, `inhand train` learns from the expert. Needs the extra `sb3`: pip install 'inhand[sb3]'.

Run: python examples/learn_with_sb3.py td3|her [STEPS]
"""

import sys

import gymnasium
import numpy as np
from stable_baselines3 import DDPG, TD3, HerReplayBuffer
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import NormalActionNoise

NOISE = NormalActionNoise(np.zeros(4), 0.1 * np.ones(4))


def td3(steps: int) -> BaseAlgorithm:
    """Reward: a centimetre along one of eight directions. `inhand.policy(model, ...)` makes a controller of it."""
    env = gymnasium.make("inhand.learning.environments:inhand/AsteriskEasy-v0")
    return TD3("MlpPolicy", env, action_noise=NOISE, seed=0, verbose=1).learn(steps)


def her(steps: int) -> BaseAlgorithm:
    """Look at `success_rate`. A lost object only cuts episodes off: losing it is no way out of rewards of -1."""
    kept = {"lost": "truncated", "horizon": 150, "actions": "fine", "observation": "grip"}
    env = gymnasium.make("inhand.learning.environments:inhand/AsteriskGoal-v0", **kept)
    learning = {"learning_starts": 200, "gamma": 0.98, "seed": 0, "verbose": 1}
    replay = {"replay_buffer_class": HerReplayBuffer, "action_noise": NOISE}
    return DDPG("MultiInputPolicy", env, **replay, **learning).learn(steps)


if __name__ == "__main__":
    {"td3": td3, "her": her}[sys.argv[1]](int(sys.argv[2]) if len(sys.argv) > 2 else 20_000)
