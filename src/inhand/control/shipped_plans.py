"""Grasp plans that come with the package, of the standard hand and object, so that no first run waits for them.

They are looked up by all that is told of a plan: hand, object, path, who carries, engine and the numbers of planning.
`studies/plans.py` makes them.
"""

from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from pathlib import Path

import numpy as np

from inhand.caches import Arrays, keep, key_of, look_up, name_of

PLACE = "plans"
"""Folder of the plans, beside the policies."""


def plans_of(
    kind: str,
    keys: Sequence[str],
    module: str,
    planned: Callable[[list[int]], Mapping[str, np.ndarray]],
    *,
    at_once: int,
) -> dict[str, np.ndarray]:
    """Return plans of paths, `(P, ...)` by name: those that ship, that are kept on disk, or that are made and kept now.

    Args:
        kind: what they are called on disk.
        keys: what each is looked up by.
        module: that makes them; see `inhand.caches.cached`.
        planned: makes those of some paths, told by their numbers.
        at_once: paths that are planned at a time, which bounds memory.
    """
    known, files = shipped(), [key_of(kind, key, module) for key in keys]
    plans = [known.get(key) or look_up(file) or {} for key, file in zip(keys, files, strict=True)]
    waiting = [k for k, plan in enumerate(plans) if not plan]
    for rows in (waiting[first : first + at_once] for first in range(0, len(waiting), at_once)):
        found = planned(rows)
        for k, row in enumerate(rows):
            plans[row] = {name: array[k] for name, array in found.items()}
            keep(files[row], plans[row])
    return {name: np.stack([each[name] for each in plans]) for name in plans[0]}


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
