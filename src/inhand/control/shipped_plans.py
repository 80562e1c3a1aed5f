"""Grasp plans that come with the package, of the standard hand and object, so that no first run waits for them.

They are looked up by all that is told of a plan: hand, object, path, who carries, engine and the numbers of planning.
`studies/plans.py` makes them.
"""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from importlib import resources
from pathlib import Path
from pickle import PicklingError

import numpy as np

from inhand.caches import Arrays, keep, key_of, look_up, name_of
from inhand.cores import on_cores, usable
from inhand.errors import InputError

LOG = logging.getLogger("inhand")
PLACE = "plans"
"""Folder of the plans, beside the policies."""
FEWEST = 2
"""Paths that are worth a process of their own, which takes two seconds to begin."""
ELSEWHERE = (ImportError, InputError, PicklingError)
"""What other processes end with that were killed, or do not know what a notebook or a file of one's own has added."""
Planned = Callable[[list[int]], Mapping[str, np.ndarray]]
"""Makes the plans of some paths, told by their numbers: `(P, ...)` by name."""


def plans_of(
    kind: str,
    keys: Sequence[str],
    module: str,
    planned: Planned,
    *,
    at_once: int,
) -> dict[str, np.ndarray]:
    """Return plans of paths, `(P, ...)` by name: those that ship, that are kept on disk, or that are made and kept now.

    They are made on every core that may be used, some paths on each: the same, however they are shared out. What other
    processes cannot begin is done here; a fault of what plans is raised as it is.

    Args:
        kind: what they are called on disk.
        keys: what each is looked up by.
        module: that makes them; see `inhand.caches.cached`.
        planned: makes those of some paths, told by their numbers; what it holds is sent to other processes.
        at_once: paths that are planned at a time, which bounds memory.
    """
    known, files = shipped(), [key_of(kind, key, module) for key in keys]
    plans = [known.get(key) or look_up(file) or {} for key, file in zip(keys, files, strict=True)]
    waiting = [k for k, plan in enumerate(plans) if not plan]
    total, done = len(waiting), 0
    if waiting:
        LOG.info("planning %d paths, once: seconds to a minute of a core for each", total)
    for rows, found in _made(waiting, planned, at_once):
        for k, row in enumerate(rows):
            plans[row] = {name: array[k] for name, array in found.items()}
            keep(files[row], plans[row])
        done += len(rows)
        LOG.info("planned %d of %d paths, which are kept", done, total)
    return {name: np.stack([each[name] for each in plans]) for name in plans[0]}


def _made(waiting: list[int], planned: Planned, at_once: int) -> Iterator[tuple[list[int], Mapping[str, np.ndarray]]]:
    """Give numbers of paths and their plans, as they are made."""
    size = min(at_once, max(FEWEST, -(-len(waiting) // usable())))
    left = {first: waiting[first : first + size] for first in range(0, len(waiting), size)}
    count = min(len(left), usable())  # as many processes begin, whether there is a part for each or not
    if count > 1:
        with suppress(*ELSEWHERE):
            for number, found in on_cores(partial(_numbered, planned), list(left.items()), count):
                yield left.pop(number), found
    for rows in left.values():
        yield rows, planned(rows)


def _numbered(planned: Planned, part: tuple[int, list[int]]) -> tuple[int, Mapping[str, np.ndarray]]:
    return part[0], planned(part[1])


def path_keys(told: object, paths: np.ndarray) -> list[str]:
    """Return what plans of paths `(P, S, n)` are looked up by, which follows from all that is told of them.

    The last bits of a path do not count, nor does how often its last pose is repeated.
    """
    keys = []
    for path in paths:
        moving = np.flatnonzero((path != path[-1]).any(axis=-1))
        keys.append(name_of((told, np.round(path[: moving.max(initial=0) + 2], DIGITS) + 0.0)))
    return keys


def shipped() -> dict[str, Arrays]:
    """Return the plans that come with the package, each of one path, by key."""
    found: dict[str, Arrays] = {}
    with resources.as_file(resources.files("inhand") / "policies" / PLACE) as folder:
        for file in sorted(folder.glob("*.npz")):
            with np.load(file, allow_pickle=False) as data:
                rows = {name: data[name] for name in data.files if name != "keys"}
                found |= {
                    key: {name: array[k] for name, array in rows.items()} for k, key in enumerate(data["keys"].tolist())
                }
    return found


def ship(path: Path, keys: Sequence[str], plans: Mapping[str, np.ndarray]) -> None:
    """Write plans of paths, `(P, ...)` by name, with their keys."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, allow_pickle=False, keys=np.array(keys), **plans)


DIGITS = 9
"""Digits of a pose that count."""
