"""Checkpoints: everything a run needs to go on byte for byte, in one file that is moved into place."""

import json
from pathlib import Path
from typing import Any

import jax
import numpy as np

from inhand.folders import in_place
from inhand.learning.ddpgfd import Learner

FORMAT = 1
"""Version of the file."""


def save_checkpoint(path: Path, learner: Learner, arrays: dict[str, Any], told: dict[str, Any]) -> None:
    """Write a checkpoint.

    Args:
        path: the file.
        learner: networks, moments and key.
        arrays: arrays by name, and states of random generators, which are dictionaries.
        told: counters, anything JSON can hold.
    """
    leaves = jax.tree.leaves(learner._replace(key=jax.random.key_data(learner.key)))
    generators = {name: value for name, value in arrays.items() if isinstance(value, dict)}
    plain = {name: value for name, value in arrays.items() if name not in generators}
    head = json.dumps({"format": FORMAT, "generators": generators, "told": told})
    with in_place(path) as temporary, temporary.open("wb") as file:
        named = {f"learner.{number}": np.asarray(leaf) for number, leaf in enumerate(leaves)}
        np.savez(file, allow_pickle=False, head=np.array(head), **named, **plain)


def load_checkpoint(path: Path, like: Learner) -> tuple[Learner, dict[str, Any], dict[str, Any]]:
    """Return the learner, arrays and counters of a checkpoint; `like` is a learner of the same shape."""
    with np.load(path, allow_pickle=False) as data:
        head = json.loads(str(data["head"]))
        arrays = {name: data[name] for name in data.files if name != "head" and not name.startswith("learner.")}
        old, structure = jax.tree.flatten(like._replace(key=jax.random.key_data(like.key)))
        leaves = [jax.numpy.asarray(data[f"learner.{number}"]) for number in range(len(old))]
    learner: Learner = jax.tree.unflatten(structure, leaves)
    return learner._replace(key=jax.random.wrap_key_data(learner.key)), arrays | head["generators"], head["told"]
