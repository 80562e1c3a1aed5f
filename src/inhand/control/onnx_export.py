"""A learned policy as an ONNX model: its network, the scaling of what it sees in front, its contract in the metadata.

The model takes numbers as they are measured, in SI units and radians, and gives actions; what an action does to the
joint targets, and in which order and unit every number comes, stands in the metadata. An observation's memory of
earlier decisions, where its layout has one, is put together outside.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from inhand.control.contract import Contract, SpatialContract
from inhand.control.onnx_joints import Node, joint_nodes
from inhand.control.policy import Policy
from inhand.control.spatial_catalogue import learned_entry
from inhand.errors import InputError, needs_extra
from inhand.folders import in_place, writing
from inhand.geometry import Array
from inhand.records import text_of
from inhand.tasks.decisions import Actions, largest_step
from inhand.tasks.hand_arrays import SLOTS
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import numbers_for
from inhand.tasks.past import LAGS

if TYPE_CHECKING:
    import onnx

OPSET, IR = 17, 8
"""Versions of the operators and of the file, both of 2022: runtimes since then read them."""
CARD = "inhand"
"""Key of the metadata under which the card stands."""
NAMES = ("observation", "action")
"""The model's input `(N, d)` and output `(N, n)`, numbers of 32 bits."""


@dataclass(frozen=True)
class InputCard:
    """Neighbouring numbers of a model's input."""

    name: str
    """What they are, and their unit."""
    first: int
    """Place of the first."""
    count: int
    middle: tuple[float, ...]
    """What becomes 0 inside of the model,"""
    half: tuple[float, ...]
    """and how far from it becomes 1; what lies beyond -1 and 1 is cut."""


@dataclass(frozen=True)
class ModelCard:
    """What a model says of itself."""

    layout: str
    """Name of the layout of its observations, with its version (`tasks/observations.py`)."""
    inputs: tuple[InputCard, ...]
    """All numbers of an observation, in their order."""
    lags: tuple[int, ...]
    """Decisions back of which a layout with a memory tells, the present one first; its parts stand lag by lag, which is
    put together outside (docs/real-hand.md). Empty where a layout has none."""
    actions: Actions
    """What actions mean: steps of the joint targets, or angles over the joints' ranges; cut to the hand's limits."""
    largest_step: float
    """What an action of 1 moves a joint target in a decision, where they are steps [rad]."""
    contract: Contract | None
    """Hand, joints, rate and senses,"""
    trained: dict[str, Any]
    """and what it was trained with."""
    space: SpatialContract | None = None
    """The contract of a hand in space, in the place of the other."""


def export(
    policy: str | Path | Policy,
    out: str | Path,
    *,
    hand: str | Path | None = None,
    object: str | Path | None = None,
    overwrite: bool = False,
) -> Path:
    """Write a learned policy as an ONNX model, and return its place.

    Args:
        policy: the folder of a training run or of a policy, `rl` for the package's, or a `Policy`.
        out: the file, which ends with .onnx.
        hand: the hand that it is to drive, which says what `rl` is; None with a `Policy`.
        object: the object that it is to move, likewise.
        overwrite: whether a file may be replaced.

    Raises:
        InputError: no policy, one without a contract, one that does not know the hand and the object, a file that is
            there or of another ending, or no extra `onnx`.
    """
    place = Path(out)
    if place.suffix.lower() != ".onnx":
        raise InputError(f"--out {place} does not end with .onnx: give the name of an ONNX file")
    if place.exists() and not overwrite:
        raise InputError(f"--out {place} exists; give another name, or --overwrite to replace it")
    if not isinstance(policy, Policy):
        _, policy = learned_entry(str(policy), hand, object)
    elif hand is not None or object is not None:
        raise InputError("hand and object say which policy a name is: leave them out with a Policy")
    content = model_of(policy).SerializeToString()
    with writing(place), in_place(place) as temporary:
        temporary.write_bytes(content)
    return place


def model_of(policy: Policy) -> "onnx.ModelProto":
    """Return a policy as an ONNX model.

    Raises:
        InputError: it has no contract, or the extra `onnx` is missing.
    """
    card = card_of(policy)
    try:
        from onnx import TensorProto, checker, helper, numpy_helper
    except ImportError as error:
        raise needs_extra("onnx", "an ONNX model") from error
    size = sum(part.count for part in card.inputs)
    joints = SLOTS if policy.network == "joints" else len(policy.biases[-1])
    nodes, arrays = _parts(policy, card)
    ends = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["N", count])
        for name, count in zip(NAMES, (size, joints), strict=True)
    ]
    kinds = {"i": np.int64, "f": np.float32}
    constants = [numpy_helper.from_array(a.astype(kinds[a.dtype.kind]), name) for name, a in arrays.items()]
    steps = [helper.make_node(each.kind, list(each.takes), [each.gives], **each.settings) for each in nodes]
    graph = helper.make_graph(steps, "policy", ends[:1], ends[1:], constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR, producer_name=CARD)
    helper.set_model_props(model, {CARD: text_of(card)})
    checker.check_model(model)
    return model


def card_of(policy: Policy) -> ModelCard:
    """Return what a policy's model says of itself.

    Raises:
        InputError: it has no contract.
    """
    contract = policy.contract or policy.space
    if contract is None:
        raise InputError("the policy has no contract, so that nobody knows what its numbers are: train it again")
    layout, hand = find_layout(policy.observation), contract.hand
    inputs, first = [], 0
    for part in layout.parts:
        count = part.size(hand)
        middle, half = (
            tuple(np.broadcast_to(numbers_for(given, hand), count).tolist()) for given in (part.middle, part.half)
        )
        inputs.append(InputCard(part.name, first, count, middle, half))
        first += count
    step = largest_step(policy.actions)
    does = policy.actions, step, policy.contract, policy.trained, policy.space
    return ModelCard(layout.name, tuple(inputs), LAGS if layout.sensed else (), *does)


def _parts(policy: Policy, card: ModelCard) -> tuple[list[Node], dict[str, Array]]:
    """Return the operators of a model in their order, and its numbers by name."""
    arrays = {
        "middle": np.concatenate([part.middle for part in card.inputs]),
        "half": np.concatenate([part.half for part in card.inputs]),
        "least": np.array(-1.0),
        "most": np.array(1.0),
    }
    nodes = [
        Node("Sub", (NAMES[0], "middle"), "shifted"),
        Node("Div", ("shifted", "half"), "scaled"),
        Node("Clip", ("scaled", "least", "most"), "0"),
    ]
    if policy.network == "joints":
        steps, numbers = joint_nodes(policy, "0", NAMES[1])
        return [*nodes, *steps], arrays | numbers
    last = len(policy.weights) - 1
    for k, (weight, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        arrays |= {f"{k}.weight": weight, f"{k}.bias": bias}
        made = ("Tanh", NAMES[1]) if k == last else ("Relu", f"{k + 1}")
        nodes += [
            Node("MatMul", (f"{k}", f"{k}.weight"), f"{k}.product"),
            Node("Add", (f"{k}.product", f"{k}.bias"), f"{k}.sum"),
            Node(made[0], (f"{k}.sum",), made[1]),
        ]
    return nodes, arrays
