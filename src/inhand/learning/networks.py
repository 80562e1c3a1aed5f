"""Networks: layers of weights and biases as plain arrays, so that a trained actor runs without JAX."""

from itertools import pairwise
from typing import NamedTuple

import jax
import jax.numpy as jnp


class Layer(NamedTuple):
    """One linear layer."""

    weight: jax.Array
    """`(inputs, outputs)`, or with a leading axis for an ensemble."""
    bias: jax.Array
    """`(outputs,)`, or with that axis."""


Network = tuple[Layer, ...]


def new_network(key: jax.Array, sizes: tuple[int, ...], last: float = 0.01) -> Network:
    """Return a network with uniform weights of variance 1 / (3 inputs) and a last layer smaller by `last`."""
    layers = []
    for number, (inputs, outputs) in enumerate(pairwise(sizes)):
        key, drawn = jax.random.split(key)
        bound = inputs**-0.5 * (last if number == len(sizes) - 2 else 1.0)
        layers.append(
            Layer(jax.random.uniform(drawn, (inputs, outputs), minval=-bound, maxval=bound), jnp.zeros(outputs))
        )
    return tuple(layers)


def forward(network: Network, inputs: jax.Array) -> jax.Array:
    """Return what a network gives for inputs `(..., inputs)`; rectified units between layers."""
    for weight, bias in network[:-1]:
        inputs = jax.nn.relu(inputs @ weight + bias)
    weight, bias = network[-1]
    return inputs @ weight + bias


def act(actor: Network, observation: jax.Array) -> jax.Array:
    """Return actions `(..., n)` within [-1, 1]."""
    return jnp.tanh(forward(actor, observation))


def values(critics: Network, observation: jax.Array, action: jax.Array) -> jax.Array:
    """Return what each critic of an ensemble of C expects of actions: `(C, batch)`."""
    both = jnp.concatenate([observation, action], axis=-1)
    return jax.vmap(forward, in_axes=(0, None))(critics, both)[..., 0]
