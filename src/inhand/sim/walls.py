"""Walls: fixed boxes that fingers and object run against, as frozen specs in the palm frame."""

from dataclasses import dataclass

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array, perpendicular, transform, unit
from inhand.hands.objects import ObjectSpec, polygon

THINNEST = 0.001
"""Least thickness of a wall [m]: the corner of an object that a hand presses on gets half a millimetre into it."""


@dataclass(frozen=True)
class Wall:
    """A fixed upright box; its face is the side that looks towards the object."""

    middle: tuple[float, float]
    """Middle of the face in the palm frame [m]."""
    normal_deg: float
    """Direction in which the face looks: its outward normal, counter-clockwise from +x [deg]."""
    length: float = 0.10
    """Length of the face [m]."""
    thickness: float = 0.01
    """How far the box reaches behind the face [m]."""
    friction: float = 0.5
    """Friction coefficient; a contact has the product of both bodies' coefficients."""

    def __post_init__(self) -> None:
        """Refuse walls that are nowhere, look nowhere or have no size."""
        if len(self.middle) != 2 or not np.isfinite(self.middle).all():
            given = ", ".join(f"{1e3 * value:g}" for value in self.middle)
            raise InputError(f"wall: middle [{given}] mm; the middle of its face needs two finite numbers, x and y")
        if not np.isfinite(self.normal_deg):
            raise InputError(f"wall: normal_deg {self.normal_deg:g}; the direction of its face must be a finite angle")
        if not (np.isfinite(self.length) and self.length > 0):
            raise InputError(f"wall: length {1e3 * self.length:g} mm; it must be a positive length")
        if not (np.isfinite(self.thickness) and self.thickness >= THINNEST):
            raise InputError(
                f"wall: thickness {1e3 * self.thickness:g} mm; it must be at least {1e3 * THINNEST:g} mm, or corners of"
                " objects go through it"
            )
        if not (np.isfinite(self.friction) and self.friction >= 0):
            raise InputError(f"wall: friction {self.friction:g}; friction must be 0 or more")

    @property
    def normal(self) -> Array:
        """Unit vector in which the face looks `(2,)`."""
        return unit(np.deg2rad(self.normal_deg))

    @property
    def outline(self) -> Array:
        """Corners of the box in the palm frame `(4, 2)` [m], counter-clockwise, the face first."""
        out, along = self.normal, perpendicular(self.normal) * self.length / 2
        face, back = np.array(self.middle), np.array(self.middle) - self.thickness * out
        return np.stack([face - along, face + along, back + along, back - along])


def clearance(wall: Wall, spec: ObjectSpec, pose: Array) -> Array:
    """Return how far an object at poses `(B, 3)` is in front of a wall's face `(B,)` [m], negative where it overlaps.

    It is the distance of the outline's nearest point from the plane of the face, however long the face is.
    """
    if spec.shape == "cylinder":
        return np.asarray((pose[..., :2] - wall.middle) @ wall.normal - spec.size[0] / 2)
    corners = transform(pose[..., None, :], polygon(spec))
    return np.asarray(((corners - wall.middle) @ wall.normal).min(axis=-1))
