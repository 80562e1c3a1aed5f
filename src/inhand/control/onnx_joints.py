"""The operators of a network over joints (`control/joint_network.py`) in an ONNX model.

Means over a finger and over the hand, and what fingers tell their joints, are products with matrices of ones.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inhand.control.policy import Policy
from inhand.tasks.hand_arrays import PER_FINGER, SLOTS
from inhand.tasks.layouts import find_layout

Numbers = NDArray[Any]


class Node(NamedTuple):
    """An operator, the names of what it takes, the name of what it gives, and its settings."""

    kind: str
    takes: tuple[str, ...]
    gives: str
    settings: Mapping[str, Any] = MappingProxyType({})


def joint_nodes(policy: Policy, seen: str, acts: str) -> tuple[list[Node], dict[str, Numbers]]:
    """Return the operators from scaled observations to actions in their order, and their numbers by name."""
    arrays = _constants(policy)
    nodes = [
        Node("Gather", (seen, "rows.at"), "columns", {"axis": 1}),
        Node("Reshape", ("columns", "rows.shape"), "shaped"),
        Node("Transpose", ("shaped",), "rows", {"perm": [0, 2, 1]}),
        Node("Gather", ("rows", "first"), "there", {"axis": 2}),
        Node("Gather", (seen, "whole.at"), "whole", {"axis": 1}),
        Node("MatMul", ("rows", "0.rows"), "0.product"),
        Node("MatMul", ("whole", "0.whole"), "0.told"),
        Node("Unsqueeze", ("0.told", "middle.axis"), "0.all"),
        Node("Add", ("0.product", "0.all"), "0.both"),
        Node("Add", ("0.both", "0.bias"), "0.sum"),
        *_kept("0"),
    ]
    last = len(policy.weights) - 1
    for k in range(1, last):
        rounds, more = _round(k, policy.weights[k], policy.biases[k])
        nodes += rounds
        arrays |= more
    arrays |= {"last.weight": policy.weights[last], "last.bias": policy.biases[last]}
    nodes += [
        Node("MatMul", (f"{last - 1}.kept", "last.weight"), "last.product"),
        Node("Add", ("last.product", "last.bias"), "last.sum"),
        Node("Mul", ("last.sum", "there"), "last.kept"),
        Node("Tanh", ("last.kept",), "last.acts"),
        Node("Squeeze", ("last.acts", "last.axis"), acts),
    ]
    return nodes, arrays


def _constants(policy: Policy) -> dict[str, Numbers]:
    """Return what the operators before the rounds take by name: places, shapes, means and the first layer."""
    width, fingers, size = find_layout(policy.observation).columns, SLOTS // PER_FINGER, len(policy.weights[0])
    one = np.kron(np.eye(fingers), np.ones((1, PER_FINGER)))
    return {
        "rows.at": np.arange(width * SLOTS),
        "whole.at": np.arange(width * SLOTS, width * (SLOTS - 1) + size),
        "rows.shape": np.array([0, width, SLOTS]),
        "first": np.array([0]),
        "middle.axis": np.array([1]),
        "last.axis": np.array([2]),
        "finger.mean": one / PER_FINGER,
        "hand.mean": np.full((1, SLOTS), 1 / SLOTS),
        "finger.joints": one.T,
        "0.rows": policy.weights[0][:width],
        "0.whole": policy.weights[0][width:],
        "0.bias": policy.biases[0],
    }


def _kept(name: str) -> list[Node]:
    """Return what rectifies a layer's sums and keeps empty slots at 0."""
    return [Node("Relu", (f"{name}.sum",), f"{name}.relu"), Node("Mul", (f"{name}.relu", "there"), f"{name}.kept")]


def _round(k: int, weight: Numbers, bias: Numbers) -> tuple[list[Node], dict[str, Numbers]]:
    """Return a round of messages: each joint's own numbers, its finger's mean and the hand's."""
    size, before = len(weight) // 3, f"{k - 1}.kept"
    arrays = {f"{k}.self": weight[:size], f"{k}.finger": weight[size : 2 * size], f"{k}.hand": weight[2 * size :]}
    nodes = [
        Node("MatMul", (before, f"{k}.self"), f"{k}.own"),
        Node("MatMul", ("finger.mean", before), f"{k}.fingers"),
        Node("MatMul", (f"{k}.fingers", f"{k}.finger"), f"{k}.of finger"),
        Node("MatMul", ("finger.joints", f"{k}.of finger"), f"{k}.from finger"),
        Node("MatMul", ("hand.mean", before), f"{k}.whole"),
        Node("MatMul", (f"{k}.whole", f"{k}.hand"), f"{k}.from hand"),
        Node("Add", (f"{k}.own", f"{k}.from finger"), f"{k}.two"),
        Node("Add", (f"{k}.two", f"{k}.from hand"), f"{k}.three"),
        Node("Add", (f"{k}.three", f"{k}.bias"), f"{k}.sum"),
        *_kept(str(k)),
    ]
    return nodes, arrays | {f"{k}.bias": bias}
