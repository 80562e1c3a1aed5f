"""Stable-Baselines3, whose learners know nothing of ours, takes the environments as they are."""

import runpy
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from inhand.environment_ids import IDS

pytest.importorskip("stable_baselines3", reason="it brings torch, so no lock has it: pip install 'inhand[sb3]'")

EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "learn_with_sb3.py"
QUICK: dict[str, Any] = {"directions": [0, 90], "starts": 8, "threads": 1, "horizon": 40}
SMALL: dict[str, Any] = {"policy_kwargs": {"net_arch": [32, 32]}, "batch_size": 32, "seed": 0, "device": "cpu"}


@pytest.mark.parametrize("name", [name for name in IDS if "Spatial" not in name])
@pytest.mark.parametrize("keywords", [{}, {"observation": "grip", "actions": "steps", "reward": None}])
def test_its_checker_finds_nothing_wrong(name: str, keywords: dict[str, Any]) -> None:
    from stable_baselines3.common.env_checker import check_env

    reward = {"reward": "dense" if "Goal" in name else "progress"} if "reward" in keywords else {}
    check_env(gymnasium.make(name, **QUICK | keywords | reward).unwrapped)


def test_td3_trains_on_the_environment() -> None:
    from stable_baselines3 import TD3

    env = gymnasium.make("inhand/Asterisk-v0", **QUICK)
    model = TD3("MlpPolicy", env, learning_starts=100, **SMALL).learn(400)
    assert model.num_timesteps == 400
    assert model.replay_buffer.size() == 400
    rewards = model.replay_buffer.rewards[:400]
    assert np.isfinite(rewards).all()
    seen, _ = env.reset(seed=0)
    action, _ = model.predict(seen, deterministic=True)
    assert action in env.action_space


@pytest.mark.parametrize("lost", ["terminated", "truncated"])
def test_ddpg_with_hindsight_trains_on_the_goals(lost: str) -> None:
    from stable_baselines3 import DDPG, HerReplayBuffer

    env = gymnasium.make("inhand/AsteriskGoal-v0", actions="steps", lost=lost, **QUICK)
    how = {"n_sampled_goal": 4, "goal_selection_strategy": "future"}
    model = DDPG(
        "MultiInputPolicy",
        env,
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs=how,
        learning_starts=100,
        **SMALL,
    ).learn(400)
    found = model.replay_buffer.sample(500)
    rewards = found.rewards.numpy().ravel()
    assert set(np.unique(rewards)) == {-1.0, 0.0}  # hindsight reaches what chance has not
    goals = found.next_observations["achieved_goal"].numpy(), found.observations["desired_goal"].numpy()
    unwrapped: Any = env.unwrapped
    np.testing.assert_array_equal(rewards, unwrapped.compute_reward(*goals, {}))
    assert (found.dones.numpy().any()) == (lost == "terminated")


@pytest.mark.parametrize("name", ["td3", "her"])
def test_the_example_runs(name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    steps = {"td3": 150, "her": 620}[name]  # four episodes and a few updates
    monkeypatch.setattr(sys, "argv", [str(EXAMPLE), name, str(steps)])
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    assert ("success_rate" in capsys.readouterr().out) == (name == "her")
