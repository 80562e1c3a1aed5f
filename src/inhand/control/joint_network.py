"""A graph network over the joints of any hand, as one function for NumPy and for JAX.

It sees a layout with slots (`tasks/joint_rows.py`, `tasks/joint_senses.py`): a row of numbers x_j for each joint's
slot, and numbers g of the whole.
The hand is the graph: joints of a finger are neighbours, and all of them are through the object that they hold.

    h_j  = relu(W_0 [x_j, g] + b_0)
    h_j <- relu(W_k [h_j, mean of h over the finger of j, mean of h over the hand] + b_k)      k = 1, 2, ...
    a_j  = tanh(W h_j + b)

Each layer has the same weights for all joints, so the network has no number of joints. Empty slots stay 0 throughout.
GET-Zero (Patel and Song, 2024) lets joints attend to each other by their places in the hand's graph instead; with at
most three joints a finger their means say as much and cost a fifth.
"""

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias

from inhand.errors import InputError
from inhand.tasks.hand_arrays import PER_FINGER, SLOTS

Numbers: TypeAlias = Any
"""Arrays of NumPy or of JAX."""
Library: TypeAlias = Any
"""What computes with them: `numpy` or `jax.numpy`."""
NetworkKind = Literal["plain", "joints"]
"""A network of all numbers in their order, or one over joints."""
SEEN = ("self", "finger", "hand")
"""Of what a round of messages has a joint's numbers each."""


def actions_of_joints(layers: Sequence[tuple[Numbers, Numbers]], observation: Numbers, xp: Library) -> Numbers:
    """Return actions `(..., SLOTS)` of observations `(..., d)`, computed by the library `xp`."""
    (weight, bias), *rounds, last = layers
    width = columns_of(observation.shape[-1], len(weight))
    rows, whole = _split(observation, width, xp)
    there = rows[..., :1]
    found = rows @ weight[:width] + (whole @ weight[width:])[..., None, :] + bias
    found = xp.maximum(found, 0.0) * there
    for weight, bias in rounds:
        size = found.shape[-1]
        fingers = found.reshape((*found.shape[:-2], 2, PER_FINGER, size)).sum(axis=-2) / PER_FINGER
        told = fingers @ weight[size : 2 * size] + (fingers.mean(axis=-2) @ weight[2 * size :] + bias)[..., None, :]
        found = xp.maximum(found @ weight[:size] + xp.repeat(told, PER_FINGER, axis=-2), 0.0) * there
    return xp.tanh((found @ last[0] + last[1]) * there)[..., 0]


def columns_of(observation: int, inputs: int) -> int:
    """Return the numbers of a row, of observations of so many numbers and a first layer of so many inputs."""
    return (observation - inputs) // (SLOTS - 1)


def _split(observation: Numbers, columns: int, xp: Library) -> tuple[Numbers, Numbers]:
    """Return the rows `(..., SLOTS, columns)` and the numbers of the whole `(..., g)`."""
    count = columns * SLOTS
    rows = observation[..., :count].reshape((*observation.shape[:-1], columns, SLOTS))
    return xp.swapaxes(rows, -1, -2), observation[..., count:]


def joint_sizes(observation: int, columns: int, hidden: Sequence[int]) -> list[tuple[int, int]]:
    """Return inputs and outputs of each layer for observations of so many numbers, rows of so many columns first.

    Raises:
        InputError: hidden layers of different sizes.
    """
    if len(set(hidden)) != 1:
        raise InputError(f"hidden layers of {tuple(hidden)} units: a network over joints has one size for all of them")
    width, first = hidden[0], observation - columns * (SLOTS - 1)
    return [(first, width), *[(len(SEEN) * width, width)] * (len(hidden) - 1), (width, 1)]
