"""A hand in space and an object, whichever way gravity pulls."""

from typing import NamedTuple, TypeAlias

from inhand.geometry import Array
from inhand.hands.fit import Held
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
