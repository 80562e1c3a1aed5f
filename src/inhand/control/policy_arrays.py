"""The weights of a policy's file: layers that fit together, and to what it sees."""

from collections.abc import Mapping

import numpy as np

from inhand.archives import check_shapes
from inhand.control.joint_network import NetworkKind, joint_sizes
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.spatial.hand import SpatialHand
from inhand.tasks.cards import InterfaceCard
from inhand.tasks.hand_arrays import SLOTS
from inhand.tasks.layouts import find_layout

ACTOR = "actor.safetensors"
"""Name of the weights' file."""
PARTS = ("weight", "bias")
"""Arrays of a layer."""
Layers = tuple[tuple[Array, ...], tuple[Array, ...]]
"""Weights and biases, a layer each."""


def layers_of(
    arrays: Mapping[str, Array],
    count: int,
    seen: tuple[str, InterfaceCard],
    network: NetworkKind,
    hand: HandSpec | SpatialHand | None,
) -> Layers:
    """Return weights and biases that fit together.

    Args:
        arrays: the file's arrays by name.
        count: number of layers.
        seen: layout of the observations, and what the file says of it.
        network: form of the network.
        hand: that of the policy's contract; None without one.

    Raises:
        InputError: arrays that are not there, of another shape or not finite; the text names them.
    """
    if count < 1 or 2 * count != len(arrays):
        raise InputError(f"layers is {count}, and {ACTOR} has {len(arrays)} arrays; it must have two for each layer")
    names = [f"{k}.{part}" for k in range(count) for part in PARTS]
    for name in names:
        if name not in arrays:
            raise InputError(f"{ACTOR} has no array {name}")
        if arrays[name].dtype.kind != "f" or not np.isfinite(arrays[name]).all():
            raise InputError(f"{name} holds {arrays[name].dtype}, not finite throughout; it must hold finite numbers")
    layout, interface = seen
    columns = find_layout(layout).columns
    slotted = columns > 0
    if network == "joints":
        _check_joints(arrays, count, interface, columns)
    else:
        fingers = 0 if hand is None else len(hand.fingers)
        _check_plain(arrays, count, (interface, fingers), joints=SLOTS if slotted else None)
        outputs = len(arrays[f"{count - 1}.bias"])
        if hand is not None and not slotted and hand.n_joints != outputs:
            raise InputError(f"it has {outputs} outputs, and the hand of its contract {hand.n_joints} joints")
    weights, biases = (tuple(arrays[f"{k}.{part}"].astype(float) for k in range(count)) for part in PARTS)
    return weights, biases


def plain_shapes(count: int) -> dict[str, tuple[str | int, ...]]:
    """Return the sizes of the arrays of so many layers, each of which takes what the one before gives, by letters."""
    shapes: dict[str, tuple[str | int, ...]] = {}
    for k in range(count):
        shapes |= {f"{k}.weight": (f"{k}", f"{k + 1}"), f"{k}.bias": (f"{k + 1}",)}
    return shapes


def _check_plain(
    arrays: Mapping[str, Array], count: int, seen: tuple[InterfaceCard, int], *, joints: int | None
) -> None:
    interface, fingers = seen
    check_shapes(arrays, plain_shapes(count), {} if joints is None else {f"{count}": joints})
    inputs, outputs = len(arrays["0.weight"]), len(arrays[f"{count - 1}.bias"])
    needed = interface.size(outputs, fingers)
    if needed != inputs:
        raise InputError(
            f"it has {inputs} inputs and {outputs} outputs; layout {interface.layout} has {needed} numbers with a"
            f" hand of {outputs} joints"
        )


def _check_joints(arrays: Mapping[str, Array], count: int, interface: InterfaceCard, columns: int) -> None:
    if columns == 0 or count < 2:
        raise InputError(
            f"a network over joints has two layers or more and sees a layout with slots for joints; this has {count}"
            f" and sees {interface.layout}"
        )
    sizes = joint_sizes(interface.size(0), columns, [len(arrays["0.bias"])] * (count - 1))
    shapes: dict[str, tuple[str | int, ...]] = {}
    for k, (inputs, outputs) in enumerate(sizes):
        shapes |= {f"{k}.weight": (inputs, outputs), f"{k}.bias": (outputs,)}
    check_shapes(arrays, shapes, {})
