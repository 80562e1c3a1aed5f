"""What tells a policy that it is about to lose its object: a small network beside its own, in plain NumPy."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from inhand.archives import check_shapes
from inhand.control.policy_arrays import plain_shapes
from inhand.errors import InputError
from inhand.folders import in_place
from inhand.geometry import Array

RISK = "risk.safetensors"
"""Name of the network's file, in the folder of the policy that it is for."""


@dataclass(frozen=True, eq=False)
class Risk:
    """The chance that an object is soon lost, turned or off its line."""

    layers: tuple[tuple[Array, Array], ...]
    """Weights `(inputs, outputs)` and biases `(outputs,)`, a layer each; the last has one output."""
    middle: Array
    """What becomes 0 of what is felt `(d,)`,"""
    half: Array
    """and how far from it becomes 1 `(d,)`."""

    def __call__(self, felt: Array) -> Array:
        """Return it `(B,)` for what is felt `(B, d)`."""
        found = (felt - self.middle) / self.half
        for number, (weight, bias) in enumerate(self.layers):
            found = np.maximum(found, 0.0) if number else found
            found = found @ weight + bias
        return np.asarray(1 / (1 + np.exp(-found[:, 0])))


def save_risk(risk: Risk, digest: str, folder: Path) -> None:
    """Write the network that was learned with a policy of that digest into its folder."""
    arrays = {"middle": risk.middle, "half": risk.half}
    for number, (weight, bias) in enumerate(risk.layers):
        arrays |= {f"{number}.weight": weight, f"{number}.bias": bias}
    with in_place(folder / RISK) as part:
        part.write_bytes(save({name: array.astype(np.float32) for name, array in arrays.items()}, {"policy": digest}))


def load_risk(digest: str, folder: Path) -> Risk:
    """Return the network of the folder of a policy of that digest.

    Raises:
        InputError: none there, one of another policy, or arrays that do not fit together.
    """
    try:
        with safe_open(folder / RISK, "numpy") as file:
            names = file.keys()
            learned_with, arrays = file.metadata()["policy"], {name: file.get_tensor(name) for name in names}
        count = (len(arrays) - 2) // 2
        check_shapes(arrays, {"middle": ("0",), "half": ("0",)} | plain_shapes(count), {f"{count}": 1})
    except (InputError, OSError, KeyError, TypeError, ValueError, SafetensorError) as error:
        raise InputError(f"what tells the risk, {folder / RISK}, cannot be used: {error}") from error
    if learned_with != digest:
        raise InputError(
            f"{folder / RISK} was learned with policy {learned_with}, and {digest} lies beside it: remove it, and the"
            " policy ends where it was planned to"
        )
    arrays = {name: array.astype(float) for name, array in arrays.items()}
    layers = tuple((arrays[f"{k}.weight"], arrays[f"{k}.bias"]) for k in range(count))
    return Risk(layers, arrays["middle"], arrays["half"])
