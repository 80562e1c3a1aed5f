"""A hand in space and an object, whichever way gravity pulls; the pair of two names, in the plane or in space."""

from pathlib import Path
from typing import NamedTuple, TypeAlias

from inhand.geometry import Array
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.hands.spatial.files import is_spatial_hand, load_solid, load_spatial_hand
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec


class SpatialPair(NamedTuple):
    """Which object is in which hand in space."""

    hand: SpatialHand
    object: SolidSpec

    @property
    def start(self) -> Array:
        """Pose in which the object starts `(7,)`."""
        return self.hand.start_pose


AnyPair: TypeAlias = Held | SpatialPair
"""An object in a hand, in the plane or in space."""


def load_held(hand: str | Path, thing: str | Path) -> AnyPair:
    """Return the hand and the object of two names or files; the hand's says whether they are in space.

    Raises:
        InputError: no such hand or object.
    """
    if is_spatial_hand(hand):
        return SpatialPair(load_spatial_hand(hand), load_solid(thing))
    return Held(load_hand(hand), load_object(thing))
