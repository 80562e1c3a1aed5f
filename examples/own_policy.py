"""A policy of your own as a controller: a function from observations (B, d) to actions (B, n), or a model."""

import numpy as np

import inhand


def push(observation):
    """Return steps of the joint targets: close a little on whatever the observation says."""
    return np.tile([-0.1, 0.0, 0.1, 0.0], (len(observation), 1))


class Model:
    """Has the `predict` of Stable-Baselines3's models; put `TD3.load("model.zip")` in its place."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return push(observation), state


def make():
    """Return the model as a controller: `inhand asterisk --controller own_policy.py:make` runs it."""
    return inhand.policy(Model(), observation="grip", actions="fine", stop=True)


if __name__ == "__main__":
    policy = inhand.policy(push, observation="grip", actions="steps")
    run = inhand.asterisk(controller=policy, directions="train", trials=1)
    print(run.table()[["direction", "outcome", "distance_mm"]])
    print(inhand.asterisk(controller=make(), directions="Out", trials=1).table()[["outcome", "distance_mm"]])
