"""Hands and objects for programs: what a name or a file says, in the plane or in space."""

from pathlib import Path
from typing import Any, TypeAlias, TypeVar, overload

from inhand.hands import files
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import is_spatial_hand, load_solid, load_spatial_hand
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec

S = TypeVar("S", HandSpec, SpatialHand, ObjectSpec, SolidSpec)
Spec: TypeAlias = Any
"""Of a hand a `HandSpec` or, in space, a `SpatialHand`; of an object an `ObjectSpec` or a `SolidSpec`."""


@overload
def hand(given: S) -> S: ...
@overload
def hand(given: str | Path) -> Spec: ...
def hand(given: Any) -> Spec:
    """Return the hand of a name, a TOML file or `FILE.py:NAME`, in the plane or in space; a spec stays as it is.

    Raises:
        InputError: neither a hand's name nor a readable file.
    """
    return (load_spatial_hand if is_spatial_hand(given) else files.load_hand)(given)


@overload
def object(given: S, hand: str | Path | HandSpec | SpatialHand | None = None) -> S: ...
@overload
def object(given: str | Path, hand: str | Path | HandSpec | SpatialHand | None = None) -> Spec: ...
def object(given: Any, hand: str | Path | HandSpec | SpatialHand | None = None) -> Spec:
    """Return the object of a name or a file; a spec stays as it is.

    Args:
        given: a name, the path of a TOML file or of an outline (CSV, SVG, DXF), in space of a mesh (STL, OBJ), or
            `FILE.py:NAME`. After any of them `:mass_kg=` and `:friction=` may stand.
        hand: which is to hold it, since `cube_50` is a prism on a plane to one hand and a cube in space to another;
            without one, a hand in the plane.

    Raises:
        InputError: neither an object's name nor a readable file.
    """
    in_space = isinstance(given, SolidSpec) or (hand is not None and is_spatial_hand(hand))
    return (load_solid if in_space else files.load_object)(given)
