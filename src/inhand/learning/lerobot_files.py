"""Files of a LeRobotDataset v3, by pyarrow alone: episodes of numbers written and read back to the last bit.

The layout is that of lerobot 0.4: `meta/info.json` names features, `data/chunk-000/file-000.parquet` has a row for each
frame of many episodes, `meta/episodes/` a row for each episode, `meta/tasks.parquet` the tasks, `meta/stats.json` what
learners scale by. Numbers kept beside an episode are further columns of its row. Quantiles are not written; lerobot
adds them where a policy asks for them.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError, needs_extra
from inhand.records import checked, read_json

VERSION = "v3.0"
INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
DATA, EPISODES = (
    "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
    "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
)
PER_CHUNK, FILE_MB, VIDEO_MB = 1000, 100, 200
"""Files in a folder, and megabytes of a file of numbers and of one of pictures, which we have none of."""
FRAMES = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
"""Columns that every frame has, and their kinds."""
KINDS = ("float32", "float64", "int64", "bool")
"""Kinds of numbers that are written and read."""

Arrays: TypeAlias = Mapping[str, NDArray[Any]]
Column: TypeAlias = Any
"""A column of pyarrow, which has no types."""
Told: TypeAlias = float | bool | str | list[float]
"""What is kept beside an episode."""


@dataclass(frozen=True, eq=False)
class Frames:
    """An episode of T frames."""

    task: str
    """What is done in it, in words."""
    arrays: Arrays
    """Numbers of the frames by the name of their feature, each `(T,)` or `(T, k)`."""
    about: Mapping[str, Told] = field(default_factory=dict)
    """What is kept beside it."""


def check_pyarrow(what: str) -> None:
    """Refuse what needs pyarrow where it is not installed.

    Raises:
        InputError: the text tells how to install it.
    """
    if find_spec("pyarrow") is None:
        raise needs_extra("lerobot", what)


def write_lerobot(
    folder: Path, episodes: Iterable[Frames], fps: int, robot: str, names: Mapping[str, Sequence[str]]
) -> int:
    """Write episodes to an empty folder as they come, and return how many there were.

    Args:
        folder: of the dataset.
        episodes: the episodes, all of the same features.
        fps: frames a second.
        robot: name of the robot.
        names: what the numbers of a feature are, for those that have several.

    Raises:
        InputError: no episode.
    """
    made = _Made(folder, fps)
    for episode in episodes:
        made.add(episode)
    if not made.rows:
        raise InputError("there is no episode to write: give a run or a dataset that has some")
    made.finish(robot, names)
    return len(made.rows)


class _Made:
    """A dataset that is being written."""

    def __init__(self, folder: Path, fps: int) -> None:
        self._folder, self._fps = folder, fps
        self.rows: list[dict[str, Any]] = []
        self._tasks: dict[str, int] = {}
        self._stats: dict[str, list[_Moments]] = {}
        self._features: dict[str, tuple[str, tuple[int, ...]]] = {}
        self._writer: Any = None
        self._bytes, self._file, self._frames = 0, -1, 0

    def add(self, episode: Frames) -> None:
        """Write an episode's frames, and keep what its row says."""
        count = len(next(iter(episode.arrays.values())))
        number, first = len(self.rows), self._frames
        indices = np.arange(count)
        task = self._tasks.setdefault(episode.task, len(self._tasks))
        arrays = dict(episode.arrays) | {
            "timestamp": (indices / self._fps).astype(np.float32),
            "frame_index": indices,
            "episode_index": np.full(count, number),
            "index": first + indices,
            "task_index": np.full(count, task),
        }
        self._write(arrays)
        self._frames += count
        found = {name: _moments(values) for name, values in arrays.items()}
        for name, moments in found.items():
            self._stats.setdefault(name, []).append(moments)
        self.rows.append({
            "episode_index": number, "tasks": [episode.task], "length": count,
            "data/chunk_index": self._file // PER_CHUNK, "data/file_index": self._file % PER_CHUNK,
            "dataset_from_index": first, "dataset_to_index": self._frames,
            "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0,
            **episode.about,
            **{f"stats/{name}/{word}": value for name, each in found.items() for word, value in each.told().items()},
        })  # fmt: skip

    def _write(self, arrays: Arrays) -> None:
        import pyarrow as pa
        from pyarrow import parquet

        table = pa.table({name: _column(values) for name, values in arrays.items()})
        if self._writer is None or self._bytes + table.nbytes > FILE_MB * 2**20:
            self.close()
            self._file, self._bytes = self._file + 1, 0
            path = self._folder / DATA.format(chunk_index=self._file // PER_CHUNK, file_index=self._file % PER_CHUNK)
            path.parent.mkdir(parents=True, exist_ok=True)
            self._writer = parquet.ParquetWriter(path, table.schema, compression="snappy", use_dictionary=True)
        self._writer.write_table(table)
        self._bytes += table.nbytes
        self._features = {name: (values.dtype.name, values.shape[1:] or (1,)) for name, values in arrays.items()}

    def close(self) -> None:
        """End the file of frames that is open."""
        if self._writer is not None:
            self._writer.close()

    def finish(self, robot: str, names: Mapping[str, Sequence[str]]) -> None:
        """Write what is said of the whole."""
        import pandas as pd
        import pyarrow as pa
        from pyarrow import parquet

        self.close()
        place = self._folder / EPISODES.format(chunk_index=0, file_index=0)
        place.parent.mkdir(parents=True)
        parquet.write_table(pa.Table.from_pylist(self.rows), place, compression="snappy")
        tasks = pd.DataFrame({"task_index": list(self._tasks.values())}, index=list(self._tasks))
        tasks.to_parquet(self._folder / TASKS)
        features = {
            name: {"dtype": kind, "shape": list(shape), "names": list(names[name]) if name in names else None}
            for name, (kind, shape) in self._features.items()
        }
        info = {
            "codebase_version": VERSION, "robot_type": robot, "total_episodes": len(self.rows),
            "total_frames": self._frames, "total_tasks": len(self._tasks), "chunks_size": PER_CHUNK,
            "data_files_size_in_mb": FILE_MB, "video_files_size_in_mb": VIDEO_MB, "fps": self._fps,
            "splits": {"train": f"0:{len(self.rows)}"}, "data_path": DATA, "video_path": None, "features": features,
        }  # fmt: skip
        stats = {name: _joined(parts).told() for name, parts in self._stats.items()}
        for name, content in ((INFO, info), (STATS, stats)):
            (self._folder / name).write_text(json.dumps(content, indent=4) + "\n", encoding="utf-8")


def _column(values: NDArray[Any]) -> Column:
    """Return numbers `(T,)` or `(T, k)` as a column, k numbers in each of its cells."""
    import pyarrow as pa

    flat = pa.array(np.ascontiguousarray(values).reshape(-1))
    return flat if values.ndim == 1 else pa.FixedSizeListArray.from_arrays(flat, values.shape[1])


@dataclass(frozen=True, eq=False)
class _Moments:
    """What learners scale by, of one feature."""

    count: int
    low: NDArray[Any]
    high: NDArray[Any]
    mean: NDArray[np.float64]
    square: NDArray[np.float64]
    """Mean of the squares of what is left of the mean."""

    def told(self) -> dict[str, list[Any]]:
        """Return them as lerobot names them."""
        return {
            "min": self.low.tolist(),
            "max": self.high.tolist(),
            "mean": self.mean.tolist(),
            "std": np.sqrt(self.square).tolist(),
            "count": [self.count],
        }


def _moments(values: NDArray[Any]) -> _Moments:
    """Return those of numbers `(T,)` or `(T, k)`."""
    table = values.reshape(len(values), -1)
    return _Moments(
        len(table),
        table.min(axis=0),
        table.max(axis=0),
        table.mean(axis=0, dtype=float),
        table.var(axis=0, dtype=float),
    )


def _joined(parts: Sequence[_Moments]) -> _Moments:
    """Return those of all frames from those of the episodes."""
    counts = np.array([part.count for part in parts])[:, None]
    total, means = int(counts.sum()), np.stack([part.mean for part in parts])
    mean = (counts * means).sum(axis=0) / total
    square = (counts * (np.stack([part.square for part in parts]) + (means - mean) ** 2)).sum(axis=0) / total
    low, high = (np.stack([getattr(part, name) for part in parts]) for name in ("low", "high"))
    return _Moments(total, low.min(axis=0), high.max(axis=0), mean, square)


@dataclass(frozen=True)
class Features:
    """What a dataset says of its frames."""

    fps: float
    kinds: dict[str, tuple[str, int]]
    """Kind and count of the numbers of each feature."""

    def told(self) -> str:
        """Return them in one line."""
        return ", ".join(f"{name} {kind}[{count}]" for name, (kind, count) in self.kinds.items() if name not in FRAMES)


def read_features(folder: Path) -> Features:
    """Return what a dataset says of its frames.

    Raises:
        InputError: no LeRobotDataset, one of another version, or one with features of other than numbers.
    """
    try:
        info = checked("it", read_json((folder / INFO).read_bytes()), dict[str, Any])
        version = checked("codebase_version", info.get("codebase_version"), str)
        fps = checked("fps", info.get("fps"), float)
        told = checked("features", info.get("features"), dict[str, dict[str, Any]])
        kinds = {name: (str(each.get("dtype")), _count(name, each.get("shape"))) for name, each in told.items()}
    except (InputError, OSError) as error:
        raise InputError(f"{folder / INFO}: {error}; give the folder of a LeRobotDataset") from error
    if not version.startswith("v3."):
        told = f"codebase_version is {version!r}; this version reads {VERSION}"
        raise InputError(f"{folder / INFO}: {told}: lerobot has a script that converts older ones")
    return Features(fps, kinds)


def _count(name: str, shape: object) -> int:
    sizes: list[int] = checked(f"features.{name}.shape", shape, list[int])
    return int(np.prod(sizes))


def read_episodes(folder: Path, features: Features) -> Iterator[Frames]:
    """Give a dataset's episodes one by one, from the numbers of their frames.

    Raises:
        InputError: pyarrow is missing, or files that cannot be read or do not hold what the features say.
    """
    check_pyarrow("a LeRobotDataset")
    import pandas as pd
    import pyarrow as pa
    from pyarrow import parquet

    wanted = [name for name, (kind, _) in features.kinds.items() if kind in KINDS]
    try:
        tasks = pd.read_parquet(folder / TASKS)
        words = dict(zip(tasks["task_index"], tasks.index, strict=True))
        rows = [
            row
            for path in sorted((folder / "meta/episodes").glob("*/*.parquet"))
            for row in parquet.read_table(path).to_pylist()
        ]
        about = {row["episode_index"]: row for row in rows}
        for path in sorted((folder / "data").glob("*/*.parquet")):
            table = parquet.read_table(path, columns=wanted)
            arrays = {name: _array(table[name], *features.kinds[name]) for name in wanted}
            for first, last in _runs(arrays["episode_index"]):
                part = {name: values[first:last] for name, values in arrays.items()}
                number = int(part["episode_index"][0])
                kept = {name: value for name, value in about[number].items() if "/" not in name}
                yield Frames(words[int(part["task_index"][0])], part, kept)
    except (OSError, LookupError, TypeError, ValueError, pa.ArrowException) as error:
        raise InputError(f"the files of {folder} cannot be read: {error}") from error


def _array(column: Column, kind: str, count: int) -> NDArray[Any]:
    """Return a column as an array `(T,)` or `(T, k)` of its kind."""
    whole = column.combine_chunks()
    rows = len(whole)
    if hasattr(whole, "flatten") and hasattr(whole.type, "value_type"):
        flat = whole.flatten().to_numpy(zero_copy_only=False)
        return np.asarray(flat.reshape(rows, count), dtype=kind)
    return np.asarray(whole.to_numpy(zero_copy_only=False), dtype=kind)


def _runs(numbers: NDArray[Any]) -> Iterator[tuple[int, int]]:
    """Give first and one past the last row of each episode."""
    edges = np.flatnonzero(np.diff(numbers)) + 1
    bounds = [0, *edges.tolist(), len(numbers)]
    yield from pairwise(bounds)
