"""DDPGfD on one page: deep deterministic policy gradient from demonstrations (thesis 3.3.4; Vecerik et al., 2017).

With critic Q, actor pi, their slowly following copies Q' and pi', and rows that hold one decision each:

    y_1 = r + g Q'(s', pi'(s'))                  y_n = R_n + g_n Q'(s_n, pi'(s_n))
    critic loss = mean w ((Q(s, a) - y_1)^2 + lambda_n (Q(s, a) - y_n)^2)
    actor loss  = -q mean Q(s, pi(s)) / mean |Q| + c mean |pi(s) - a_expert|^2 over rows that an expert showed

g is 0 where the object was lost, so a terminated end has no value after it and a truncated one has. Both networks carry
L2 regularisation. Where the actor sees what is sensed, critics may see the truth of its world: s is then another view
in Q than in pi (Pinto et al., 2018). Options of `default`: several critics whose smallest counts, smoothing noise on
the next action, the imitation term (c), and a scaled value term (q). `thesis` has one critic, c = 0 and an unscaled
value term.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from numpy.typing import NDArray

from inhand.learning.config import Learning
from inhand.learning.networks import Actor, Network, act, new_actor, new_network, values
from inhand.learning.replay_buffer import TRUTH, Columns

Batches = jax.Array | NDArray[np.float32]
"""Arrays of the host or of the device."""
Imitator = tuple[Actor, optax.OptState]
"""An actor and the moments of its optimiser."""


class Learner(NamedTuple):
    """Everything that training changes."""

    actor: Actor
    critics: Network
    target_actor: Actor
    target_critics: Network
    actor_moments: optax.OptState
    critic_moments: optax.OptState
    key: jax.Array
    updates: jax.Array


class Report(NamedTuple):
    """What an update tells."""

    critic_loss: jax.Array
    actor_loss: jax.Array
    value: jax.Array
    priority: jax.Array
    """Squared error plus squared action gradient of each row: the paper's priority, before its constants."""


def new_learner(learning: Learning, columns: Columns, seed: int) -> Learner:
    """Return fresh networks."""
    key, actor_key, critic_key = jax.random.split(jax.random.key(seed), 3)
    actor = new_actor(actor_key, learning.network, columns, learning.hidden)
    make = partial(new_network, sizes=((columns.c or columns.d) + columns.n, *learning.hidden, 1))
    critics = jax.vmap(make)(jax.random.split(critic_key, learning.critics))
    moments = (
        _optimiser(learning, learning.actor_rate).init(actor),
        _optimiser(learning, learning.critic_rate).init(critics),
    )
    return Learner(actor, critics, actor, critics, *moments, key, jnp.zeros((), jnp.int32))


def _optimiser(learning: Learning, rate: float) -> optax.GradientTransformation:
    return optax.chain(optax.add_decayed_weights(learning.weight_decay), optax.adam(rate))


@partial(jax.jit, static_argnames=("learning", "columns"))
def update_many(
    learner: Learner, rows: Batches, weights: Batches, learning: Learning, columns: Columns, *, strength: float
) -> tuple[Learner, Report]:
    """Return the learner after one update for each batch of rows `(U, batch, width)`, and the reports `(U, ...)`.

    Rows have importance weights `(U, batch)`; `strength` is the factor of the value term in the actor's loss: 0
    imitates only.
    """

    def one(state: Learner, given: tuple[jax.Array, jax.Array]) -> tuple[Learner, Report]:
        row = {name: given[0][:, place] for name, place in columns.parts().items()}
        if columns.c == 0:
            row |= {true: row[name] for true, name in zip(TRUTH, ("observation", "successor", "later"), strict=True)}
        return _update(state, row, given[1], learning, strength)

    return jax.lax.scan(one, learner, (jnp.asarray(rows), jnp.asarray(weights)))


@partial(jax.jit, static_argnames=("columns", "total", "rate"))
def imitate_many(
    actor: Actor, moments: optax.OptState | None, rows: Batches, columns: Columns, total: int, *, rate: float
) -> tuple[Actor, optax.OptState, jax.Array]:
    """Return the actor after a step towards the least mean |pi(s) - a_expert| for each batch `(U, batch, d + n)`.

    With it come the optimiser's moments, None at first, and the loss. The `rate` falls over `total` steps.
    """
    optimiser = optax.adam(optax.cosine_decay_schedule(rate, total, 0.05))

    def loss(network: Actor, batch: jax.Array) -> jax.Array:
        return jnp.abs(act(network, batch[:, : columns.d]) - batch[:, columns.d :]).mean()

    def one(state: Imitator, batch: jax.Array) -> tuple[Imitator, jax.Array]:
        value, slope = jax.value_and_grad(loss)(state[0], batch)
        step, after = optimiser.update(slope, state[1])
        return (optax.apply_updates(state[0], step), after), value

    start: Imitator = actor, optimiser.init(actor) if moments is None else moments
    end, losses = jax.lax.scan(one, start, jnp.asarray(rows))
    return *end, losses.mean()


def _update(
    state: Learner, row: dict[str, jax.Array], weight: jax.Array, learning: Learning, strength: jax.Array | float
) -> tuple[Learner, Report]:
    key, noise_key = jax.random.split(state.key)
    targets = _targets(state, row, learning, noise_key)
    (critic_loss, error), gradient = jax.value_and_grad(_critic_loss, has_aux=True)(
        state.critics, row, targets, weight, learning
    )
    change, critic_moments = _optimiser(learning, learning.critic_rate).update(
        gradient, state.critic_moments, state.critics
    )
    critics = optax.apply_updates(state.critics, change)

    def improved(_: None) -> tuple[Actor, optax.OptState, jax.Array, jax.Array]:
        (loss, value), slope = jax.value_and_grad(_actor_loss, has_aux=True)(
            state.actor, critics, row, learning, strength
        )
        step, moments = _optimiser(learning, learning.actor_rate).update(slope, state.actor_moments, state.actor)
        return optax.apply_updates(state.actor, step), moments, loss, value

    def kept(_: None) -> tuple[Actor, optax.OptState, jax.Array, jax.Array]:
        return state.actor, state.actor_moments, jnp.full((), jnp.nan), jnp.full((), jnp.nan)

    now = state.updates % learning.actor_every == 0
    actor, actor_moments, actor_loss, value = jax.lax.cond(now, improved, kept, None)
    slow = partial(optax.incremental_update, step_size=learning.follow)
    after = Learner(
        actor,
        critics,
        slow(actor, state.target_actor),
        slow(critics, state.target_critics),
        actor_moments,
        critic_moments,
        key,
        state.updates + 1,
    )
    priority = error + _action_slope(critics, row) if learning.prioritised else error
    return after, Report(critic_loss, actor_loss, value, priority)


def _targets(state: Learner, row: dict[str, jax.Array], learning: Learning, key: jax.Array) -> tuple[jax.Array, ...]:
    """Return y_1 and y_n `(batch,)`."""
    found = []
    for later, reward, discount in (("successor", "reward", "discount"), ("later", "reward_n", "discount_n")):
        key, drawn = jax.random.split(key)
        action = act(state.target_actor, row[later])
        if learning.smoothing:
            noise = learning.smoothing * jnp.clip(jax.random.normal(drawn, action.shape), -2.0, 2.0)
            action = jnp.clip(action + noise, -1.0, 1.0)
        value = values(state.target_critics, row[f"true_{later}"], action).min(axis=0)
        found.append(learning.reward_scale * row[reward][:, 0] + row[discount][:, 0] * value)
    return tuple(found)


def _critic_loss(
    critics: Network, row: dict[str, jax.Array], targets: tuple[jax.Array, ...], weight: jax.Array, learning: Learning
) -> tuple[jax.Array, jax.Array]:
    value = values(critics, row["truth"], row["action"])
    one, many = ((value - target) ** 2 for target in targets)
    return (weight * (one + learning.n_step_weight * many)).mean(axis=-1).sum(), one.mean(axis=0)


def _actor_loss(
    actor: Actor, critics: Network, row: dict[str, jax.Array], learning: Learning, strength: jax.Array | float
) -> tuple[jax.Array, jax.Array]:
    action = act(actor, row["observation"])
    value = values(critics, row["truth"], action)[0]
    size = jax.lax.stop_gradient(jnp.abs(value).mean()) + 1e-6
    factor = learning.value_weight / size if learning.value_weight else 1.0
    away = ((action - row["expert_action"]) ** 2).mean(axis=-1) * row["is_demo"][:, 0]
    imitation = away.sum() / jnp.maximum(row["is_demo"].sum(), 1.0)
    return -strength * factor * value.mean() + learning.imitation * imitation, value.mean()


def _action_slope(critics: Network, row: dict[str, jax.Array]) -> jax.Array:
    """Return the squared gradient of the value with respect to the action `(batch,)`, part of the paper's priority."""
    slope = jax.grad(lambda action: values(critics, row["truth"], action)[0].sum())(row["action"])
    return jnp.sum(slope**2, axis=-1)
