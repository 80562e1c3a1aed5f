"""Replay: n-step returns in closed form, rows that belong together, the ring, and priorities."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from inhand.learning.replay_buffer import Columns, Priorities, ReplayBuffer, n_step, rows_of

COLUMNS = Columns(3, 2)


@given(
    st.lists(st.floats(-5, 5), min_size=1, max_size=12),
    st.floats(0.1, 1.0),
    st.integers(1, 6),
    st.booleans(),
)
def test_n_step_returns_are_the_sums_written_out(rewards: list[float], discount: float, n: int, ended: bool) -> None:
    total, weight, index = n_step(np.array(rewards), discount, n, terminated=ended)
    for t in range(len(rewards)):
        last = min(t + n, len(rewards))
        written_out = sum(discount ** (k - t) * rewards[k] for k in range(t, last))
        value = 0.0 if ended and last == len(rewards) else discount ** (last - t)
        assert total[t] == pytest.approx(written_out)
        assert weight[t] == pytest.approx(value)
        assert index[t] == last


def test_constant_rewards_give_the_geometric_series() -> None:
    total, weight, _ = n_step(np.ones(10), 0.5, 3, terminated=False)
    np.testing.assert_allclose(total[:8], 1.75)
    np.testing.assert_allclose(total[8:], [1.5, 1.0])
    np.testing.assert_allclose(weight[7:], [0.125, 0.25, 0.5])


def test_a_cut_off_end_keeps_the_value_of_its_last_state_and_a_terminated_one_does_not() -> None:
    _, cut, _ = n_step(np.ones(3), 0.9, 5, terminated=False)
    _, ended, _ = n_step(np.ones(3), 0.9, 5, terminated=True)
    np.testing.assert_allclose(cut, [0.729, 0.81, 0.9])
    np.testing.assert_array_equal(ended, 0.0)


def _episode(length: int, first: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return an episode in which every number tells its decision."""
    t = first + np.arange(length + 1.0)
    observations = np.stack([t, t + 0.1, t + 0.2], axis=-1)
    actions = np.stack([t[:-1], -t[:-1]], axis=-1)
    return observations, actions, 2.0 * actions, t[:-1]


def test_every_part_of_a_row_belongs_to_one_decision() -> None:
    rows = rows_of(COLUMNS, _episode(6, 100.0), (0.9, 3), terminated=True)
    part = {name: rows[:, columns] for name, columns in COLUMNS.parts().items()}
    t = 100.0 + np.arange(6)
    np.testing.assert_allclose(part["observation"][:, 0], t)
    np.testing.assert_allclose(part["successor"][:, 0], t + 1)
    np.testing.assert_allclose(part["later"][:, 0], np.minimum(t + 3, 106))
    np.testing.assert_allclose(part["action"][:, 0], t)
    np.testing.assert_allclose(part["expert_action"][:, 0], 2 * t)
    np.testing.assert_allclose(part["reward"][:, 0], t)
    np.testing.assert_allclose(part["discount"][:, 0], [0.9] * 5 + [0.0], rtol=1e-6)
    np.testing.assert_array_equal(part["is_demo"], 1.0)


def test_rows_of_the_agent_are_not_shown_by_an_expert() -> None:
    observations, actions, _, rewards = _episode(4, 0.0)
    rows = rows_of(COLUMNS, (observations, actions, None, rewards), (0.9, 3), terminated=False)
    parts = COLUMNS.parts()
    np.testing.assert_array_equal(rows[:, parts["is_demo"]], 0.0)
    np.testing.assert_array_equal(rows[:, parts["expert_action"]], rows[:, parts["action"]])


def _numbered(first: int, count: int) -> np.ndarray:
    return np.repeat(np.arange(first, first + count, dtype=np.float32)[:, None], COLUMNS.width, axis=1)


def test_the_oldest_rows_fall_out(tmp_path: Path) -> None:
    replay = ReplayBuffer(tmp_path / "rows", COLUMNS, capacity=10, spare=5)
    for first in range(0, 40, 4):
        replay.add(_numbered(first, 4))
    drawn = replay.at(replay.draw(np.random.default_rng(0), 500))
    assert set(np.unique(drawn[:, 0])) == set(range(30, 40))
    assert (drawn == drawn[:, :1]).all()


def test_what_is_written_after_a_checkpoint_leaves_its_rows_alone(tmp_path: Path) -> None:
    replay = ReplayBuffer(tmp_path / "rows", COLUMNS, capacity=10, spare=6)
    replay.add(_numbered(0, 23))
    at_checkpoint, written = replay.at(np.arange(13, 23)), replay.written
    replay.add(_numbered(500, 6))
    again = ReplayBuffer(tmp_path / "rows", COLUMNS, capacity=10, spare=6, written=written)
    np.testing.assert_array_equal(again.at(np.arange(13, 23)), at_checkpoint)


def test_rows_are_drawn_in_proportion_to_their_priority(tmp_path: Path) -> None:
    replay = ReplayBuffer(tmp_path / "rows", COLUMNS, capacity=4, spare=0)
    replay.add(_numbered(0, 4))
    priorities = Priorities(replay, exponent=1.0, correction=1.0)
    priorities.draw(np.random.default_rng(0), 1)
    priorities.learn(np.arange(4), np.array([1.0, 2.0, 3.0, 4.0]))
    numbers, weights = priorities.draw(np.random.default_rng(0), 40000)
    np.testing.assert_allclose(np.bincount(numbers) / 40000, [0.1, 0.2, 0.3, 0.4], atol=0.01)
    # Importance weights undo it: the weighted mean over draws is the plain mean over rows.
    assert (weights * numbers).sum() / weights.sum() == pytest.approx(1.5, abs=0.02)


def test_new_rows_start_with_the_largest_priority(tmp_path: Path) -> None:
    replay = ReplayBuffer(tmp_path / "rows", COLUMNS, capacity=3, spare=0)
    replay.add(_numbered(0, 2))
    priorities = Priorities(replay, exponent=1.0, correction=0.0)
    priorities.draw(np.random.default_rng(0), 1)
    priorities.learn(np.arange(2), np.array([0.0, 9.0]))
    replay.add(_numbered(2, 1))
    numbers, _ = priorities.draw(np.random.default_rng(0), 10000)
    np.testing.assert_allclose(np.bincount(numbers) / 10000, [0.0, 0.5, 0.5], atol=0.02)
