"""Demonstrations as a Minari dataset: written while they are recorded, read back, checked before they are learned from.

A dataset is a folder with Minari's own folder `data` in it, so that `minari.load_dataset` finds it by its id where the
folder's path ends in that id below MINARI_DATASETS_PATH, and `minari.MinariDataset(folder / "data")` anywhere.

Minari's public `create_dataset_from_buffers` wants all episodes at once and writes below MINARI_DATASETS_PATH alone;
its storage class takes a block after the other, in any folder, and `minari_files.add_episodes` writes its files.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inhand.archives import check_shapes
from inhand.errors import InputError, needs_extra
from inhand.geometry import Array
from inhand.hands.spatial.hand import SpatialHand
from inhand.learning.dataset_cards import OURS, DatasetHead, DatasetKind, PlanarHead, SpatialHead
from inhand.learning.minari_files import (
    Entry,
    Storage,
    add_episodes,
    cut_episodes,
    new_storage,
    open_storage,
    reading,
)
from inhand.records import read_json, read_record, table_of
from inhand.tasks.cards import NEW

Floats = NDArray[np.float32]

DATA, METADATA = "data", "metadata.json"
"""Minari's folder in a dataset's, and its file in there."""
MARK = f"{DATA}/{METADATA}"
"""The file that marks a folder as a dataset's."""
FORMAT = 2
"""Version of that part; see `inhand.tasks.cards.NEW`."""
PACKAGES = ("minari", "h5py")
"""What of the extra `rl` a dataset needs."""
ABOUT: dict[str, tuple[int, ...]] = {"angle_deg": (), "distance": (), "limit": (), "start": (3,)}
"""What is kept beside an episode, and its shape,"""
IN_SPACE = {"along": (3,), "about": (3,), "gravity": (3,), "distance": (), "limit": (), "start": (7,)}
"""and with a hand in space."""
BLOCK = 256
"""Episodes written at a time."""


@dataclass(frozen=True)
class _Entry:
    format: int
    head: PlanarHead


@dataclass(frozen=True)
class _SpatialEntry:
    format: int
    head: SpatialHead


@dataclass(frozen=True, eq=False)
class DatasetEpisode:
    """One demonstration of T decisions."""

    observations: Floats
    """Observations `(T + 1, d)`, the last one of the state the episode ended in."""
    actions: Floats
    """What was done `(T, n)`."""
    wanted: Floats
    """What the expert wanted before noise pushed its hands `(T, n)`."""
    rewards: Array
    """Rewards `(T,)`."""
    terminated: bool
    """Whether the object was lost in the last decision."""
    truncated: bool
    """Whether the horizon cut the episode off."""
    angle_deg: float
    """Direction, counter-clockwise from +x [deg]; 0 in space."""
    distance: float
    """Way along the direction at the end, of a turn its arc at `TURN_ARM` [m]."""
    limit: float
    """Way at which the expert meant to stop [m]."""
    start: Array
    """Pose of the object at the start, in the palm frame `(3,)` [m, m, rad], in space `(7,)` (position, quaternion)."""
    along: Array | None = None
    """In space the unit vector to move along `(3,)`, 0 of a turn,"""
    about: Array | None = None
    """that to turn about `(3,)`, 0 of a move,"""
    gravity: Array | None = None
    """and gravity in the palm frame `(3,)` [m/s^2]; None in the plane."""


def about_of(kind: DatasetKind) -> dict[str, tuple[int, ...]]:
    """Return the names of what is kept beside an episode of a kind, with their shapes."""
    return IN_SPACE if isinstance(kind.hand, SpatialHand) else ABOUT


def episode_from(arrays: Mapping[str, Any], about: Mapping[str, Any], ends: tuple[bool, bool]) -> DatasetEpisode:
    """Return an episode of its arrays, of what is kept beside it, and of whether it terminated and was truncated."""
    terminated, truncated = ends
    kept = {name: np.asarray(value, float) for name, value in about.items()}
    told: dict[str, Any] = {name: value if value.ndim else float(value) for name, value in kept.items()}
    return DatasetEpisode(**arrays, terminated=terminated, truncated=truncated, **({"angle_deg": 0.0} | told))


def write_dataset(
    folder: Path, episodes: Iterable[DatasetEpisode], head: DatasetHead, env_spec: str | None = None
) -> None:
    """Write episodes, a block at a time, to a folder that holds no dataset; half a dataset is never left there.

    Args:
        folder: folder of the dataset; Minari's `data` comes into place in it once all episodes are written.
        episodes: the episodes, which may be recorded while they are written.
        head: where they come from.
        env_spec: Gymnasium's JSON for the environment that Minari's `recover_environment` makes.

    Raises:
        InputError: the extra is missing, or there is a dataset in the folder.
    """
    storage = begin_dataset(folder, head, env_spec)
    try:
        add_to(storage, episodes, head.kind)
    except BaseException:
        shutil.rmtree(_part(folder), ignore_errors=True)
        raise
    end_dataset(folder)


def begin_dataset(folder: Path, head: DatasetHead, env_spec: str | None = None) -> Storage:
    """Return the storage of a dataset without episodes, under another name until `end_dataset`.

    Raises:
        InputError: the extra is missing, or there is a dataset in the folder.
    """
    check_installed("a dataset")
    if (folder / DATA).exists():
        raise InputError(f"{folder} holds a dataset; give another folder, or remove it first")
    part = _part(folder)
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    storage = new_storage(part, _sizes(head.kind))
    storage.update_metadata(_metadata(head) | ({} if env_spec is None else {"env_spec": env_spec}))
    return storage


def go_on_with(folder: Path, head: DatasetHead, count: int) -> Storage:
    """Return the storage of a dataset that was begun and not ended, with its first `count` episodes alone.

    Raises:
        InputError: there are none that can be read, or fewer.
    """
    with reading(folder):
        storage = open_storage(_part(folder), _sizes(head.kind))
        cut_episodes(storage, count)
        return storage


def add_to(storage: Storage, episodes: Iterable[DatasetEpisode], kind: DatasetKind) -> None:
    """Write episodes of a kind behind those of a storage, a block at a time."""
    coming = iter(episodes)
    while block := list(islice(coming, BLOCK)):
        add_episodes(storage, [_entry(episode, kind) for episode in block])


def end_dataset(folder: Path) -> None:
    """Put a dataset that was begun into its place."""
    _part(folder).replace(folder / DATA)


def _part(folder: Path) -> Path:
    return folder.resolve() / f"{DATA}.part"  # Minari doubles a path that is not absolute


def read_dataset(folder: Path) -> tuple[DatasetHead, StoredEpisodes]:
    """Return a dataset's head and its episodes.

    Raises:
        InputError: the extra is missing, there is no dataset of ours, or one that cannot be read or of another format.
    """
    check_installed("a dataset")
    head = read_head(folder)
    with reading(folder):
        return head, StoredEpisodes(folder, head.kind, open_storage(folder / DATA, _sizes(head.kind)))


def read_head(folder: Path) -> DatasetHead:
    """Return a dataset's head alone, which needs no extra.

    Raises:
        InputError: there is no dataset of ours, or one of another format.
    """
    path = folder / DATA / METADATA
    if not path.is_file():
        raise InputError(f"no dataset in {folder}: give the folder that `inhand record` wrote, the one with {DATA}/")
    try:
        metadata = read_json(path.read_bytes())
        ours = metadata.get(OURS) if isinstance(metadata, dict) else None
        return read_told(ours)
    except InputError as error:
        raise InputError(
            f"{folder} is no dataset of `inhand record`: {error}; record it again, or read it with Minari"
        ) from error


@dataclass(frozen=True, eq=False)
class StoredEpisodes:
    """The episodes of a dataset, read from the disk as they are asked for."""

    folder: Path
    kind: DatasetKind
    storage: Storage

    def __len__(self) -> int:
        """Return how many there are."""
        return int(self.storage.total_episodes)

    def __iter__(self) -> Iterator[DatasetEpisode]:
        """Give one after the other."""
        return _episodes(self.folder, self.kind, self.storage)


def told_head(head: DatasetHead) -> dict[str, Any]:
    """Return what a dataset says of itself as JSON's table, with the version of that form."""
    return table_of({"format": FORMAT, "head": head})


def read_told(entry: object) -> DatasetHead:
    """Return what `told_head` has told.

    Raises:
        InputError: another version, or something else.
    """
    told = entry.get("head") if isinstance(entry, dict) else None
    space = isinstance(told, dict) and "gravity" in told
    if space:
        return read_record(entry, _SpatialEntry, FORMAT, NEW).head
    return read_record(entry, _Entry, FORMAT, NEW).head


def env_spec_of(folder: Path) -> str | None:
    """Return Gymnasium's JSON for the environment of a dataset of ours, where it has one."""
    metadata = read_json((folder / DATA / METADATA).read_bytes())
    spec = metadata.get("env_spec") if isinstance(metadata, dict) else None
    return spec if isinstance(spec, str) else None


def check_installed(what: str) -> None:
    """Refuse `what` where the extra is missing.

    Raises:
        InputError: the text tells how to install it.
    """
    if any(find_spec(name) is None for name in PACKAGES):
        raise needs_extra("rl", what)


def _sizes(kind: DatasetKind) -> tuple[int, int]:
    return kind.size, kind.hand.n_joints


def _metadata(head: DatasetHead) -> dict[str, Any]:
    import minari

    kind = head.kind
    return {
        "dataset_id": head.dataset_id,
        "minari_version": minari.__version__,
        "algorithm_name": head.expert,
        "author": {OURS},
        "description": f"{head.expert} moves {head.object.name} in the hand {kind.hand.name} along directions"
        f" ({head.directions}); observations {kind.interface.layout}, actions {kind.actions}, reward {head.reward};"
        " infos hold what the expert wanted before noise pushed its hands",
        "requirements": [f"{OURS}=={head.versions[OURS]}"] if OURS in head.versions else [],
        OURS: told_head(head),
    }


def _entry(episode: DatasetEpisode, kind: DatasetKind) -> Entry:
    last = np.arange(len(episode.rewards)) == len(episode.rewards) - 1
    arrays = {name: getattr(episode, name) for name in ("observations", "actions", "rewards")}
    arrays |= {"terminations": last & episode.terminated, "truncations": last & episode.truncated}
    return arrays, {"wanted": episode.wanted}, {name: getattr(episode, name) for name in about_of(kind)}


def _episodes(folder: Path, kind: DatasetKind, storage: Storage) -> Iterator[DatasetEpisode]:
    with reading(folder):
        every = range(storage.total_episodes)
        for found, about in zip(storage.get_episodes(every), storage.get_episode_metadata(every), strict=True):
            arrays = {name: found[name] for name in ("observations", "actions", "rewards")}
            arrays |= {"wanted": found["infos"]["wanted"]}
            beside = {name: np.asarray(about[name]) for name in about_of(kind)}
            _check_episode(arrays | beside, kind)
            ends = bool(found["terminations"][-1]), bool(found["truncations"][-1])
            yield episode_from(arrays, beside, ends)


def _check_episode(arrays: dict[str, NDArray[Any]], kind: DatasetKind) -> None:
    """Refuse arrays of an episode that hold anything but finite numbers, or do not fit together."""
    for name, array in arrays.items():
        if array.dtype.kind != "f" or not np.isfinite(array).all():
            raise InputError(f"{name} holds {array.dtype}, not finite throughout; it must hold finite numbers")
    steps = len(arrays["rewards"])
    shapes: dict[str, tuple[str | int, ...]] = {
        "observations": (steps + 1, "d"),
        "actions": (steps, "n"),
        "wanted": (steps, "n"),
        "rewards": (steps,),
    }
    shapes |= about_of(kind)
    check_shapes(arrays, shapes, {"d": kind.size, "n": kind.hand.n_joints})
