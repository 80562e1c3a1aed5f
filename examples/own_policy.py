"""A policy of your own as a controller: a function from observations (B, d) to actions (B, n), or a model."""

import numpy as np

import inhand


def push(observation):
    """Return steps of the joint targets: close a little on whatever the observation says."""
    return np.tile([-0.1, 0.0, 0.1, 0.0], (len(observation), 1))


if __name__ == "__main__":
    policy = inhand.policy(push, observation="grip", actions="steps")
    run = inhand.asterisk(controller=policy, directions="train", trials=1)
    print(run.table()[["direction", "outcome", "distance_mm"]])
