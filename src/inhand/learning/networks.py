"""Networks: layers of weights and biases as plain arrays, so that a trained actor runs without JAX."""

from itertools import pairwise
from typing import NamedTuple

import jax
import jax.numpy as jnp

from inhand.control.joint_network import NetworkKind, actions_of_joints, joint_sizes
from inhand.learning.replay_buffer import Columns


class Layer(NamedTuple):
    """One linear layer."""

    weight: jax.Array
    """`(inputs, outputs)`, or with a leading axis for an ensemble."""
    bias: jax.Array
    """`(outputs,)`, or with that axis."""


Network = tuple[Layer, ...]


class JointNetwork(NamedTuple):
    """A network over the joints of any hand (`control/joint_network.py`)."""

    layers: Network


Actor = Network | JointNetwork
"""What decides."""


def new_actor(key: jax.Array, kind: NetworkKind, columns: Columns, hidden: tuple[int, ...]) -> Actor:
    """Return a fresh actor for observations and actions of some columns."""
    if kind == "plain":
        return new_network(key, (columns.d, *hidden, columns.n))
    sizes = joint_sizes(columns.d, columns.slot, hidden)
    keys = jax.random.split(key, len(sizes))
    scales = (*[1.0] * (len(sizes) - 1), 0.01)
    drawn = zip(keys, sizes, scales, strict=True)
    return JointNetwork(tuple(new_network(one, size, last=scale)[0] for one, size, scale in drawn))


def layers_of(actor: Actor) -> Network:
    """Return the layers of an actor in their order."""
    return actor.layers if isinstance(actor, JointNetwork) else actor


def actor_of(kind: NetworkKind, layers: Network) -> Actor:
    """Return the actor of some layers."""
    return layers if kind == "plain" else JointNetwork(layers)


def new_network(key: jax.Array, sizes: tuple[int, ...], last: float = 0.01) -> Network:
    """Return a network with uniform weights of variance 1 / (3 inputs) and a last layer smaller by `last`."""
    layers = []
    for number, (inputs, outputs) in enumerate(pairwise(sizes)):
        key, drawn = jax.random.split(key)
        bound = inputs**-0.5 * (last if number == len(sizes) - 2 else 1.0)
        layers.append(Layer(_uniform(drawn, (inputs, outputs), bound), jnp.zeros(outputs)))
    return tuple(layers)


def _uniform(key: jax.Array, shape: tuple[int, int], bound: float) -> jax.Array:
    """Return what `jax.random.uniform` draws, without a program for each shape: each takes 0.3 s to compile."""
    count = shape[0] * shape[1]
    room = max(1 << 15, 1 << (count - 1).bit_length())
    return jax.random.uniform(key, (room,), minval=-bound, maxval=bound)[:count].reshape(shape)


def forward(network: Network, inputs: jax.Array) -> jax.Array:
    """Return what a network gives for inputs `(..., inputs)`; rectified units between layers."""
    for weight, bias in network[:-1]:
        inputs = jax.nn.relu(inputs @ weight + bias)
    weight, bias = network[-1]
    return inputs @ weight + bias


def act(actor: Actor, observation: jax.Array) -> jax.Array:
    """Return actions `(..., n)` within [-1, 1]."""
    if isinstance(actor, JointNetwork):
        found: jax.Array = actions_of_joints(actor.layers, observation, jnp)
        return found
    return jnp.tanh(forward(actor, observation))


def values(critics: Network, observation: jax.Array, action: jax.Array) -> jax.Array:
    """Return what each critic of an ensemble of C expects of actions: `(C, batch)`."""
    both = jnp.concatenate([observation, action], axis=-1)
    return jax.vmap(forward, in_axes=(0, None))(critics, both)[..., 0]
