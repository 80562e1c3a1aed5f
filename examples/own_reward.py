"""A reward term and a part of the observation of your own, in an environment."""

import numpy as np

import inhand


@inhand.register.reward_term("effort", weight=-0.1)
def effort(decision):
    """Return the mean square of the actions (B,)."""
    return (decision.action**2).mean(axis=-1)


@inhand.register.observation_part("height", half=0.1, middle=0.1, fixed=1)
def height(state, aim, scene):
    """Return how far the object is from the palm (B, 1) [m]."""
    return state.pose[:, 1:2]


if __name__ == "__main__":
    words = {"observation": "grip,height", "reward": "progress,effort", "actions": "steps"}
    env = inhand.make("asterisk", directions="Out", starts=4, **words)
    seen, _ = env.reset(seed=0)
    _, reward, _, _, info = env.step(np.zeros(env.action_space.shape))
    print(len(seen), reward, info["terms"])
