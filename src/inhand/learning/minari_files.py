"""Minari's storage of a dataset: made, and opened again without trust in what its files say."""

import json
import reprlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

from inhand.errors import InputError

STORED = "hdf5"
"""Minari's word for the form of its files."""
MOST_EPISODES = 10**9
"""More than any disk holds."""
Storage: TypeAlias = Any
"""Minari's storage, which has no types."""


def new_storage(folder: Path, sizes: tuple[int, int]) -> Storage:
    """Return an empty storage for observations and actions of so many numbers within [-1, 1].

    Minari's own reader makes its spaces, so that Gymnasium stays elsewhere.
    """
    from minari.dataset.minari_storage import MinariStorage
    from minari.serialization import deserialize_space

    spaces = map(deserialize_space, _spaces(sizes).values())
    return MinariStorage.new(folder, *spaces, data_format=STORED)


def open_storage(data: Path, sizes: tuple[int, int]) -> Storage:
    """Return the storage of a folder; without spaces in its metadata Minari would run an environment that they name.

    Raises:
        InputError: its metadata are not those of observations and actions of these sizes.
    """
    from minari.dataset.minari_storage import MinariStorage

    metadata = MinariStorage.read_raw_metadata(data)
    for name, wanted in {**_spaces(sizes), "data_format": STORED}.items():
        if metadata.get(name) != wanted:
            raise InputError(f"{name} is {reprlib.repr(metadata.get(name))}; it must be {wanted}")
    count = metadata.get("total_episodes")
    if type(count) is not int or not 0 <= count <= MOST_EPISODES:
        raise InputError(f"total_episodes is {reprlib.repr(count)}; it must be a whole number up to {MOST_EPISODES}")
    return MinariStorage.read(data)


@contextmanager
def reading(folder: Path) -> Iterator[None]:
    """Turn what Minari and h5py raise, which check little, into an error for the user."""
    try:
        yield
    except (LookupError, TypeError, ValueError, OSError, AssertionError, AttributeError, RuntimeError) as error:
        raise InputError(f"the episodes in {folder} cannot be read: {error}; record them again") from error


def _spaces(sizes: tuple[int, int]) -> dict[str, str]:
    return {
        name: json.dumps({"type": "Box", "dtype": "float32", "shape": [n], "low": [-1.0] * n, "high": [1.0] * n})
        for name, n in zip(("observation_space", "action_space"), sizes, strict=True)
    }
