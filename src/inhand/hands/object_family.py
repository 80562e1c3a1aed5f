"""A family of objects: boxes, ellipses, polygons and the laboratory's forms whose numbers lie between bounds."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array, unit
from inhand.hands.family import Span
from inhand.hands.object_forms import FORMS
from inhand.hands.objects import ObjectSpec, polygon, polygon_object

Drawable: TypeAlias = Literal["box", "ellipse", "polygon", "triangle", "pentagon", "concave_square"]
"""Shapes that are drawn: the laboratory's other forms are kept for tests."""

HEIGHT = 0.1
"""Height of drawn objects, that of the laboratory's [m]."""
EVEN = 0.6
"""How far a corner of a drawn polygon stands from its even place at most, against half the way to the next."""
ROUNDING = 1e-4
"""Lengths are whole numbers of it, and those that are outside by less are not [m]."""


@dataclass(frozen=True)
class ObjectFamily:
    """Bounds of objects, whatever their shape."""

    shapes: tuple[Drawable, ...] = ("box", "ellipse", "polygon", "triangle", "pentagon", "concave_square")
    """Shapes that are drawn."""
    size: Span = (0.022, 0.055)
    """The longer side seen from above [m]."""
    aspect: Span = (0.32, 1.0)
    """The shorter side against the longer."""
    corners: tuple[int, int] = (3, 8)
    """Numbers of corners of drawn polygons."""
    friction: Span = (0.7, 1.4)
    """Friction coefficient; a contact has its product with the finger's."""
    mass: Span = (0.02, 0.05)
    """Mass [kg]."""

    def __post_init__(self) -> None:
        """Refuse bounds between which there is no object."""
        for name in ("size", "aspect", "corners", "friction", "mass"):
            low, high = getattr(self, name)
            if not 0 < low <= high:
                raise InputError(
                    f"{name} of a family of objects is {low:g} to {high:g}: give a lowest value above 0, and a highest"
                    " that is no lower"
                )
        if not self.shapes or self.aspect[1] > 1 or self.corners[0] < 3:
            raise InputError(
                "a family of objects needs at least one shape, aspects of 1 at most and polygons of 3 corners or more"
            )

    def drawn(self, name: str, rng: np.random.Generator) -> ObjectSpec:
        """Return an object drawn evenly between the bounds."""
        shape = self.shapes[rng.integers(len(self.shapes))]
        longer = rng.uniform(*self.size)
        sides = np.array([longer, longer * rng.uniform(*self.aspect)])
        x, y = (round(float(side) / ROUNDING) * ROUNDING for side in (sides[::-1] if rng.random() < 0.5 else sides))
        if shape in {"box", "ellipse"}:
            spec = ObjectSpec(name, "box" if shape == "box" else "ellipse", (x, y, HEIGHT))
        else:
            corners = _corners(rng, self.corners) if shape == "polygon" else np.array(_form(shape)(x, y))
            low, wide = corners.min(axis=0), np.ptp(corners, axis=0)
            placed = ((corners - low) / wide - 0.5) * (x, y)
            spec = polygon_object(name, [(float(a), float(b)) for a, b in placed], HEIGHT)
        return replace(spec, friction=float(rng.uniform(*self.friction)), mass=float(rng.uniform(*self.mass)))

    def outside(self, spec: ObjectSpec) -> str | None:
        """Return which number of an object lies outside of the family, and its bounds; None where all are within."""
        sides = np.ptp(polygon(spec), axis=0)
        longer, aspect = float(sides.max()), float(sides.min() / sides.max())
        if not self.size[0] - ROUNDING < longer < self.size[1] + ROUNDING:
            return f"its longer side is {1e3 * longer:.1f} mm, the family's {_told(self.size, 1e3)} mm"
        for what, value, bounds in (
            ("shorter side is", aspect, self.aspect),
            ("friction is", spec.friction, self.friction),
            ("mass is", spec.mass, self.mass),
        ):
            if not bounds[0] - 5e-3 * bounds[0] <= value <= bounds[1] + 5e-3 * bounds[1]:
                unit_of = {"shorter side is": " of the longer", "mass is": " kg"}.get(what, "")
                return f"its {what} {value:.3g}{unit_of}, the family's {_told(bounds)}{unit_of}"
        return None


def _told(bounds: Span, scale: float = 1.0) -> str:
    return f"{scale * bounds[0]:.4g} to {scale * bounds[1]:.4g}"


def _form(word: str) -> Callable[[float, float], tuple[tuple[float, float], ...]]:
    return FORMS[word]


def _corners(rng: np.random.Generator, counts: tuple[int, int]) -> Array:
    """Return the corners of a convex polygon on the unit circle `(K, 2)`, unevenly spread round it."""
    count = int(rng.integers(counts[0], counts[1] + 1))
    places = np.arange(count) + 0.5 * EVEN * rng.uniform(-1.0, 1.0, count)
    return unit((places / count + rng.random()) * 2 * np.pi)
