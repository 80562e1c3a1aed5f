"""Minari's storage of a dataset: made, and opened again without trust in what its files say."""

import json
import reprlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inhand.errors import InputError

STORED, FILE = "hdf5", "main_data.hdf5"
"""Minari's word for the form of its files, and its name of the one that has the episodes."""
MOST_EPISODES = 10**9
"""More than any disk holds."""
Storage: TypeAlias = Any
"""Minari's storage, which has no types."""
Arrays: TypeAlias = Mapping[str, NDArray[Any]]
Entry: TypeAlias = tuple[Arrays, Arrays, Mapping[str, ArrayLike]]
"""An episode's arrays by name, `rewards` among them `(T,)`, those of its infos, and numbers that are kept beside."""


def new_storage(folder: Path, sizes: tuple[int, int], bound: float = 1.0) -> Storage:
    """Return an empty storage for observations and actions of so many numbers within a bound, either way.

    Minari's own reader makes its spaces, so that Gymnasium stays elsewhere.
    """
    from minari.dataset.minari_storage import MinariStorage
    from minari.serialization import deserialize_space

    spaces = map(deserialize_space, _spaces(sizes, bound).values())
    return MinariStorage.new(folder, *spaces, data_format=STORED)


def add_episodes(storage: Storage, episodes: Sequence[Entry]) -> None:
    """Write episodes behind those that a storage holds.

    The file is as Minari writes it, by the low-level calls of h5py: its own take three times as long, nearly all of it
    Python's.
    """
    import h5py
    from h5py import h5g, h5p

    in_order = h5p.create(h5p.GROUP_CREATE)
    in_order.set_link_creation_order(h5p.CRT_ORDER_TRACKED | h5p.CRT_ORDER_INDEXED)
    done, steps = storage.total_episodes, storage.total_steps
    with h5py.File(storage.data_path / FILE, "a", track_order=True) as file:
        for number, (arrays, infos, about) in enumerate(episodes, start=done):
            count = len(arrays["rewards"])
            group = h5g.create(file.id, f"episode_{number}".encode(), gcpl=in_order)
            for name, value in {"id": number, "total_steps": count, **about}.items():
                _write_number(group, name, value)
            _write_arrays(group, arrays)
            _write_arrays(h5g.create(group, b"infos", gcpl=in_order), infos)
            steps += count
    told = {"total_steps": steps, "total_episodes": done + len(episodes), "dataset_size": storage.get_size()}
    storage.update_metadata(told)


def cut_episodes(storage: Storage, count: int) -> None:
    """Leave the first `count` episodes of a storage alone, whose last writing may have been cut off.

    Raises:
        LookupError: it has fewer.
        OSError: the file cannot be read.
    """
    import h5py

    with h5py.File(storage.data_path / FILE, "a") as file:
        kept = [f"episode_{number}" for number in range(count)]
        steps = sum(int(file[name].attrs["total_steps"]) for name in kept)
        for name in [each for each in file if each not in set(kept)]:
            del file[name]
    told = {"total_steps": steps, "total_episodes": count, "dataset_size": storage.get_size()}
    storage.update_metadata(told)


def _write_number(group: Storage, name: str, value: ArrayLike) -> None:
    from h5py import h5a, h5s, h5t

    array = np.asarray(value)
    space = h5s.create_simple(array.shape) if array.ndim else h5s.create(h5s.SCALAR)
    h5a.create(group, name.encode(), h5t.py_create(array.dtype), space).write(array)


def _write_arrays(group: Storage, arrays: Arrays) -> None:
    """Write arrays that may grow along their first axis, each in one piece."""
    from h5py import h5d, h5p, h5s, h5t

    for name, array in arrays.items():
        whole = h5p.create(h5p.DATASET_CREATE)
        whole.set_chunk(array.shape)
        space = h5s.create_simple(array.shape, (h5s.UNLIMITED, *array.shape[1:]))
        kind = h5t.py_create(array.dtype, logical=True)
        h5d.create(group, name.encode(), kind, space, whole).write(h5s.ALL, h5s.ALL, np.ascontiguousarray(array))


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


def _spaces(sizes: tuple[int, int], bound: float = 1.0) -> dict[str, str]:
    return {
        name: json.dumps({"type": "Box", "dtype": "float32", "shape": [n], "low": [-bound] * n, "high": [bound] * n})
        for name, n in zip(("observation_space", "action_space"), sizes, strict=True)
    }
