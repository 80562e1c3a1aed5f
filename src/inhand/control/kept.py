"""What objects with a memory remember, as arrays by name: to write it down and to go on from it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Remembered = dict[str, NDArray[Any]]
"""Arrays by the place where they belong, as `filmed.past.rows`."""


def remembered(owner: object, own: tuple[type, ...]) -> Remembered:
    """Return copies of the arrays and whole numbers of an object, and of those that it holds of some kinds.

    These may be tuples with names, of which the arrays are kept.
    """
    found: Remembered = {}
    for name, value in _parts(owner).items():
        if isinstance(value, np.ndarray) or _changes(owner, value):
            found[name] = np.array(value)
        elif isinstance(value, own):
            found |= {f"{name}.{place}": array for place, array in remembered(value, own).items()}
    return found


def remember(owner: object, own: tuple[type, ...], kept: Remembered) -> None:
    """Put back what `remembered` has returned of an object that was made alike."""
    for name, value in _parts(owner).items():
        if isinstance(owner, tuple) and isinstance(value, np.ndarray):
            value[...] = kept[name]
        elif isinstance(value, np.ndarray):
            setattr(owner, name, kept[name].astype(value.dtype))
        elif _changes(owner, value):
            setattr(owner, name, int(kept[name]))
        elif isinstance(value, own):
            mine = f"{name}."
            remember(value, own, {place.removeprefix(mine): a for place, a in kept.items() if place.startswith(mine)})


def _parts(owner: object) -> dict[str, Any]:
    names = getattr(owner, "_fields", None)
    return vars(owner) if names is None else {name: getattr(owner, name) for name in names}


def _changes(owner: object, value: object) -> bool:
    """Return whether a value is a whole number that an object changes; tuples do not."""
    return isinstance(value, int) and not isinstance(value, bool) and not isinstance(owner, tuple)
