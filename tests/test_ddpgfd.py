"""The learner: its targets, its losses, and toys that it must solve in seconds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("jax", reason="learning needs the extra `rl`: pip install 'inhand[rl]'")

import jax
import jax.numpy as jnp
import optax

from inhand.learning.config import Learning
from inhand.learning.ddpgfd import Learner, imitate_many, new_learner, update_many
from inhand.learning.networks import Layer, act, values
from inhand.learning.replay_buffer import Columns, ReplayBuffer, rows_of

COLUMNS = Columns(1, 1)
SMALL = Learning(
    hidden=(32, 32),
    actor_rate=1e-3,
    critic_rate=3e-3,
    weight_decay=0.0,
    batch=64,
    look_ahead=3,
    discount=0.9,
    imitation=1.0,  # where no expert shows anything it does nothing
)


TWO = Columns(2, 1)
HAND_MADE = Learning(
    hidden=(),
    critics=2,
    actor_rate=1e-3,
    critic_rate=3e-3,
    weight_decay=0.01,
    reward_scale=2.0,
    n_step_weight=0.4,
    follow=0.2,
    imitation=1.5,
    value_weight=0.3,
)


def _points(rng: np.random.Generator, episodes: int, expert: bool) -> np.ndarray:
    """Return rows of a point that is pushed about on a line and rewarded for being near 0.3."""
    blocks = []
    for _ in range(episodes):
        x, seen, done, rewards = rng.uniform(-1, 1), [], [], []
        for _ in range(10):
            seen.append([x])
            action = np.clip(5.0 * (0.3 - x), -1, 1) if expert else rng.uniform(-1, 1)
            x = np.clip(x + 0.2 * action, -1, 1)
            done.append([action])
            rewards.append(-((x - 0.3) ** 2))
        actions = np.array(done)
        episode = np.array([*seen, [x]]), actions, actions if expert else None, np.array(rewards)
        blocks.append(rows_of(COLUMNS, episode, (SMALL.discount, SMALL.look_ahead), terminated=False))
    return np.concatenate(blocks)


@dataclass(frozen=True)
class _Linear:
    """Networks of one layer: pi(s) = tanh(W s + b), and of each critic Q(s, a) = u s + v a + k."""

    actor: tuple[np.ndarray, np.ndarray]
    """Weights `(2, 1)` and bias `(1,)`."""
    critics: tuple[np.ndarray, np.ndarray]
    """Weights of both critics `(2, 3, 1)` and biases `(2, 1)`."""

    def act(self, seen: np.ndarray) -> np.ndarray:
        """Return actions `(B, 1)`."""
        return np.asarray(np.tanh(seen @ self.actor[0] + self.actor[1]))

    def values(self, seen: np.ndarray, action: np.ndarray) -> np.ndarray:
        """Return values `(2, B)`."""
        both = np.concatenate([seen, action], axis=1)
        return np.asarray((both @ self.critics[0])[..., 0] + self.critics[1])

    def layers(self) -> tuple[tuple[Layer], tuple[Layer]]:
        """Return actor and critics as the learner holds them."""
        actor, critics = (Layer(*(jnp.asarray(part) for part in each)) for each in (self.actor, self.critics))
        return (actor,), (critics,)


def _drawn(seed: int) -> _Linear:
    rng = np.random.default_rng(seed)
    shapes = ((2, 1), (1,)), ((2, 3, 1), (2, 1))
    actor, critics = (tuple(rng.uniform(-1, 1, shape) for shape in pair) for pair in shapes)
    return _Linear((actor[0], actor[1]), (critics[0], critics[1]))


def _six_rows() -> np.ndarray:
    """Return three rows of an expert and three of the agent, whose own actions stand where an expert's would."""
    rng = np.random.default_rng(7)
    rows = np.asarray(rng.uniform(-1, 1, (6, TWO.width)))
    part = {name: rows[:, columns] for name, columns in TWO.parts().items()}
    part["expert_action"][3:] = part["action"][3:]
    part["is_demo"][:, 0] = (1, 1, 1, 0, 0, 0)
    part["discount"][:, 0] = (0.9, 0.9, 0.0, 0.9, 0.9, 0.0)
    part["discount_n"][:, 0] = (0.7, 0.0, 0.0, 0.7, 0.0, 0.0)
    return rows


def test_smoothing_noise_moves_the_next_action_within_what_it_may_be() -> None:
    losses = {}
    for smoothing in (0.0, 1e6, 1e7):
        learning = replace(HAND_MADE, smoothing=smoothing)
        _, report = update_many(
            new_learner(learning, TWO, 0), _six_rows()[None], np.ones((1, 6)), learning, TWO, strength=0.6
        )
        losses[smoothing] = float(report.critic_loss[0])
    assert losses[0.0] != losses[1e6]
    assert losses[1e6] == losses[1e7]  # the action is cut to -1 or 1


def test_one_update_is_the_one_that_is_written_out_by_hand() -> None:
    """Targets, both losses, their gradients, the optimisers' first step and the target networks, in NumPy."""
    fast, slow, rows, weight = _drawn(1), _drawn(6), _six_rows(), np.array([1.0, 0.5, 0.8, 1.0, 0.3, 0.9])
    row = {name: rows[:, columns] for name, columns in TWO.parts().items()}
    (actor, critics), (target_actor, target_critics) = fast.layers(), slow.layers()
    fresh = new_learner(HAND_MADE, TWO, 0)
    learner = fresh._replace(actor=actor, critics=critics, target_actor=target_actor, target_critics=target_critics)
    after, report = update_many(learner, rows[None], weight[None], HAND_MADE, TWO, strength=0.6)

    seen, action, count = row["observation"], row["action"], len(rows)
    each = {later: slow.values(row[later], slow.act(row[later])) for later in ("successor", "later")}
    assert all(len(set(value.argmin(axis=0))) == 2 for value in each.values())
    one = 2.0 * row["reward"][:, 0] + row["discount"][:, 0] * each["successor"].min(axis=0)
    many = 2.0 * row["reward_n"][:, 0] + row["discount_n"][:, 0] * each["later"].min(axis=0)
    value = fast.values(seen, action)
    loss = (weight * ((value - one) ** 2 + 0.4 * (value - many) ** 2)).mean(axis=1).sum()
    assert float(report.critic_loss[0]) == pytest.approx(loss, rel=1e-5)
    np.testing.assert_allclose(report.priority[0], ((value - one) ** 2).mean(axis=0), rtol=1e-4)
    slope = 2 / count * weight * ((value - one) + 0.4 * (value - many))
    both = np.concatenate([seen, action], axis=1)
    gradient = (both.T @ slope.T).T[..., None], slope.sum(axis=1, keepdims=True)
    better = _stepped(after.critics[0], after.critic_moments, fast.critics, gradient, HAND_MADE.critic_rate)

    now = replace(fast, critics=better)
    chosen, shown = fast.act(seen), row["is_demo"][:, 0]
    first = now.values(seen, chosen)[0]
    factor = 0.3 / (np.abs(first).mean() + 1e-6)
    away = ((chosen - row["expert_action"])[:, 0] * shown, shown.sum())
    assert float(report.actor_loss[0]) == pytest.approx(
        -0.6 * factor * first.mean() + 1.5 * (away[0] ** 2).sum() / away[1], rel=1e-4
    )
    pull = -0.6 * factor * better[0][0, 2, 0] / count + 1.5 * 2 * away[0] / away[1]
    pull = pull[:, None] * (1 - chosen**2)
    moved = _stepped(after.actor[0], after.actor_moments, fast.actor, (seen.T @ pull, pull.sum(axis=0)), 1e-3)
    for old, new, found in (
        (slow.actor, moved, after.target_actor[0]),
        (slow.critics, better, after.target_critics[0]),
    ):
        for a, b, c in zip(old, new, found, strict=True):
            np.testing.assert_allclose(c, a + 0.2 * (b - a), atol=1e-6)


def _stepped(
    found: Layer,
    moments: optax.OptState,
    before: tuple[np.ndarray, np.ndarray],
    gradient: tuple[np.ndarray, np.ndarray],
    rate: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return parameters after Adam's first step with weight decay, having found them and its first moment so."""
    decayed = [g + HAND_MADE.weight_decay * p for g, p in zip(gradient, before, strict=True)]
    for slope, moment in zip(decayed, jax.tree.leaves(moments)[1:3], strict=True):
        np.testing.assert_allclose(np.asarray(moment) / 0.1, slope, rtol=1e-4, atol=1e-6)
    weights, bias = (p - rate * g / (np.abs(g) + 1e-8) for g, p in zip(decayed, before, strict=True))
    np.testing.assert_allclose(found.weight, weights, atol=1e-6)
    np.testing.assert_allclose(found.bias, bias, atol=1e-6)
    return weights, bias


def _learned(rows: np.ndarray, learning: Learning, updates: int, strength: float = 1.0) -> Learner:
    learner, rng = new_learner(learning, COLUMNS, 0), np.random.default_rng(0)
    for _ in range(updates // 500):
        drawn = rows[rng.integers(len(rows), size=(500, learning.batch))]
        weights = np.ones((500, learning.batch), dtype=np.float32)
        learner, report = update_many(learner, drawn, weights, learning, COLUMNS, strength=strength)
        assert np.isfinite(np.asarray(report.critic_loss)).all()
    return learner


def _end(learner: Learner) -> np.ndarray:
    """Return where points are after 10 decisions of the actor."""
    x = np.linspace(-1, 1, 21)[:, None]
    for _ in range(10):
        x = np.clip(x + 0.2 * np.asarray(act(learner.actor, jnp.asarray(x))), -1, 1)
    return x[:, 0]


def test_the_learner_brings_a_point_to_its_place_from_random_tries() -> None:
    rows = _points(np.random.default_rng(1), 200, expert=False)
    learning = replace(SMALL, critics=2)
    before = np.abs(_end(new_learner(learning, COLUMNS, 0)) - 0.3).mean()
    after = np.abs(_end(_learned(rows, learning, 1500)) - 0.3).mean()
    assert before > 0.4
    assert after < 0.06


def test_values_of_demonstrations_are_their_returns() -> None:
    rows = _points(np.random.default_rng(2), 200, expert=True)
    learner = _learned(rows, SMALL, 2000, strength=0.0)
    x = np.linspace(-0.8, 0.8, 9)
    expected = []
    for place in x:
        total, now = 0.0, place
        for step in range(200):
            now = np.clip(now + 0.2 * np.clip(5.0 * (0.3 - now), -1, 1), -1, 1)
            total -= 0.9**step * (now - 0.3) ** 2
        expected.append(total)
    action = jnp.asarray(np.clip(5.0 * (0.3 - x), -1, 1)[:, None])
    found = np.asarray(values(learner.critics, jnp.asarray(x[:, None]), action))[0]
    np.testing.assert_allclose(found, expected, atol=0.08)


def test_imitation_alone_copies_what_was_wanted() -> None:
    rows = _points(np.random.default_rng(3), 100, expert=True)
    learner, rng = new_learner(SMALL, COLUMNS, 0), np.random.default_rng(0)
    actor, moments, parts = learner.actor, None, COLUMNS.parts()
    shown = np.concatenate([rows[:, parts["observation"]], rows[:, parts["expert_action"]]], axis=-1)
    for _ in range(3):
        drawn = shown[rng.integers(len(shown), size=(500, 64))]
        actor, moments, loss = imitate_many(actor, moments, drawn, COLUMNS, 1500, rate=1e-3)
    assert float(loss) < 0.05
    x = np.array([[-0.5], [0.28], [0.9]])
    np.testing.assert_allclose(np.asarray(act(actor, jnp.asarray(x))), np.clip(5 * (0.3 - x), -1, 1), atol=0.15)


def test_without_strength_and_imitation_the_actor_stays_as_it_is() -> None:
    rows = _points(np.random.default_rng(4), 20, expert=False)
    learner = _learned(rows, SMALL, 500, strength=0.0)
    for old, new in zip(
        jax.tree.leaves(new_learner(SMALL, COLUMNS, 0).actor), jax.tree.leaves(learner.actor), strict=True
    ):
        np.testing.assert_allclose(old, new, atol=1e-7)


def test_weight_decay_makes_networks_smaller() -> None:
    rows = _points(np.random.default_rng(5), 20, expert=False)
    plain = _learned(rows, SMALL, 1000)
    decayed = _learned(rows, replace(SMALL, weight_decay=0.05), 1000)
    size = [sum(float((leaf**2).sum()) for leaf in jax.tree.leaves(each.critics)) for each in (plain, decayed)]
    assert size[1] < 0.7 * size[0]


def test_terminated_rows_have_no_value_after_them() -> None:
    episode = np.zeros((2, 1)), np.zeros((1, 1)), None, np.array([-1.0])
    ended = rows_of(COLUMNS, episode, (0.9, 3), terminated=True)
    learner = _learned(ended, SMALL, 1000, strength=0.0)
    assert float(values(learner.critics, jnp.zeros((1, 1)), jnp.zeros((1, 1)))[0, 0]) == pytest.approx(-1.0, abs=0.01)


def test_one_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    rows = _points(np.random.default_rng(6), 50, expert=False)
    replay = ReplayBuffer(tmp_path / "rows", COLUMNS, len(rows), 0)
    replay.add(rows)
    first, second = (_learned(replay.at(np.arange(len(rows))), SMALL, 500) for _ in range(2))
    for one, other in zip(jax.tree.leaves(first.actor), jax.tree.leaves(second.actor), strict=True):
        assert np.asarray(one).tobytes() == np.asarray(other).tobytes()
