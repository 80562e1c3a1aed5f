"""What every hand is, in the plane and in space: fingers of joints, in order finger by finger."""

from collections.abc import Iterable
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any, Protocol

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array, fixed


class Fingered(Protocol):
    """What has a name, and fingers with links, limits and a length each."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def fingers(self) -> tuple[Any, ...]:
        """Its fingers, in the order that every array has them in."""


class Jointed:
    """A hand's joints as arrays have them."""

    @cached_property
    def n_joints(self: Fingered) -> int:
        """Number of joints of all fingers."""
        return sum(len(finger.links) for finger in self.fingers)

    @cached_property
    def slices(self: Fingered) -> tuple[slice, ...]:
        """Places of each finger's joints in an array of all joints."""
        ends = list(accumulate((len(finger.links) for finger in self.fingers), initial=0))
        return tuple(slice(*pair) for pair in pairwise(ends))

    @cached_property
    def finger_length(self: Fingered) -> float:
        """Mean length of the straight fingers [m]."""
        return float(sum(finger.length for finger in self.fingers) / len(self.fingers))

    @cached_property
    def limits(self: Fingered) -> Array:
        """Lowest and highest joint angles `(n_joints, 2)` [rad]."""
        return fixed(np.concatenate([finger.limits for finger in self.fingers]))

    def check_numbers(self: Fingered, positive: Iterable[str], not_negative: Iterable[str]) -> None:
        """Refuse fields that are not positive, or below zero, or not finite.

        Raises:
            InputError: the text names the field.
        """
        zero_too = set(not_negative)
        for name in (*positive, *zero_too):
            value = getattr(self, name)
            if not (np.isfinite(value) and (value > 0 or (value == 0 and name in zero_too))):
                zero = " or zero" if name in zero_too else ""
                raise InputError(f"hand {self.name!r}: {name} is {value:g}; it must be positive{zero} (SI units)")
