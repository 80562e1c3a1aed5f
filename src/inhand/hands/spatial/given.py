"""What calls were given as hands and objects, by name: specs of the plane and of space are taken up under their own."""

from pathlib import Path

from inhand.hands.files import HANDS, OBJECTS
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import HANDS as SPATIAL_HANDS
from inhand.hands.spatial.files import SOLIDS
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec


def name_of(given: str | Path | HandSpec | ObjectSpec | SpatialHand | SolidSpec) -> str:
    """Return the name of a hand or an object; a spec is taken up under its own."""
    if isinstance(given, SpatialHand):
        return SPATIAL_HANDS.name_of(given)
    if isinstance(given, SolidSpec):
        return SOLIDS.name_of(given)
    return OBJECTS.name_of(given) if isinstance(given, ObjectSpec) else HANDS.name_of(given)
