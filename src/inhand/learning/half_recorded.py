"""How far a recording is that was stopped: enough to go on with the same draws, so that nothing tells that it was."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from inhand.errors import InputError
from inhand.folders import clear, in_place
from inhand.geometry import Array
from inhand.learning.dataset_cards import DatasetHead
from inhand.learning.datasets import begin_dataset, go_on_with
from inhand.learning.kept_starts import arrays_of, starts_from
from inhand.learning.minari_files import Storage
from inhand.learning.starts import Starts
from inhand.sim.names import Engine

STOPPED = "stopped.npz"
"""The file in the folder of a recording that is under way."""


@dataclass(frozen=True, eq=False)
class Begun:
    """A recording that is under way."""

    rng: np.random.Generator
    """Draws starts and noise."""
    ends: list[Array] = field(default_factory=list)
    """How each episode ended, as `inhand.learning.dataset.end_of` tells it."""
    kept: Starts | None = None
    """States on the way of the last episodes, from which others may start."""

    @property
    def before(self) -> tuple[int, int, Starts | None]:
        """How many episodes there are, how many of them lost the object, and the states on the way of the last."""
        return len(self.ends), round(sum(end[1] for end in self.ends)), self.kept


def save_begun(begun: Begun, folder: Path, words: str) -> None:
    """Write how far a recording is into its folder; the words tell it from others."""
    told = {"words": words, "rng": begun.rng.bit_generator.state, "kept": bool(begun.kept)}
    arrays: dict[str, Any] = {"head": np.array(json.dumps(told)), "ends": np.array(begun.ends)}
    if begun.kept:
        arrays |= arrays_of(begun.kept, "kept")
    with in_place(folder / STOPPED) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def go_on(folder: Path, head: DatasetHead, words: str, env_spec: str | None) -> tuple[Begun, Storage]:
    """Return how far the recording in a folder is, and the storage of its episodes; a new one where there is none.

    Args:
        folder: of the recording.
        head: of its dataset.
        words: what tells it from others.
        env_spec: Gymnasium's JSON for the environment of a new dataset.
    """
    begun = _begun(folder, words, head.engine)
    if begun is not None:
        try:
            return begun, go_on_with(folder, head, len(begun.ends))
        except InputError:  # the process was killed while it wrote
            pass
    clear(folder)
    return Begun(np.random.default_rng(head.seed)), begin_dataset(folder, head, env_spec)


def _begun(folder: Path, words: str, engine: Engine) -> Begun | None:
    """Return how far the recording of these words in a folder is; None of another, or where none can be read."""
    try:
        with (folder / STOPPED).open("rb") as file, np.load(file, allow_pickle=False) as data:
            told = json.loads(str(data["head"]))
            if told["words"] != words:
                return None
            rng = np.random.default_rng()
            rng.bit_generator.state = told["rng"]
            return Begun(rng, list(data["ends"]), starts_from(data, "kept", engine) if told["kept"] else None)
    except (OSError, EOFError, ValueError, KeyError, BadZipFile, InputError):
        return None
