"""What objects with a memory remember, as arrays by name: to write it down and to go on from it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Remembered = dict[str, NDArray[Any]]
"""Arrays by the place where they belong, as `filmed.past.rows`."""


def remembered(owner: object, own: tuple[type, ...]) -> Remembered:
    """Return copies of the arrays and whole numbers of an object, and of those that it holds of some kinds."""
    found: Remembered = {}
    for name, value in vars(owner).items():
        if isinstance(value, np.ndarray | int) and not isinstance(value, bool):
            found[name] = np.array(value)
        elif isinstance(value, own):
            found |= {f"{name}.{place}": array for place, array in remembered(value, own).items()}
    return found


def remember(owner: object, own: tuple[type, ...], kept: Remembered) -> None:
    """Put back what `remembered` has returned of an object that was made alike."""
    for name, value in vars(owner).items():
        if isinstance(value, int) and not isinstance(value, bool):
            setattr(owner, name, int(kept[name]))
        elif isinstance(value, np.ndarray):
            setattr(owner, name, kept[name].astype(value.dtype))
        elif isinstance(value, own):
            mine = f"{name}."
            remember(value, own, {place.removeprefix(mine): a for place, a in kept.items() if place.startswith(mine)})
