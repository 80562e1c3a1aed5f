"""Objects in space: boxes, cylinders, spheres, ellipsoids and convex meshes, as frozen specs, and their names.

Object frame: origin at the centre of mass of the even body, axes along its sides; a cylinder stands along z.
"""

import re
from dataclasses import dataclass, replace
from typing import Literal, cast, get_args

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.hands.sizes import check_body, check_length
from inhand.hands.spatial.hand import Vector

Solid = Literal["box", "cylinder", "sphere", "ellipsoid", "mesh"]
SOLIDS: tuple[str, ...] = get_args(Solid)
CATALOGUE = ("cube_50", "cube_40", "sphere_50", "sphere_35", "cylinder_50x60", "ellipsoid_60x50x40")
"""Objects that `inhand objects` lists; any other name of the form is an object too."""
FORM = (
    "cube_SIDE, box_XxYxZ, sphere_DIAMETER, cylinder_DIAMETERxHEIGHT or ellipsoid_XxYxZ in mm (cylinder_50x60), after"
    " it as wanted :mass_kg=0.05 and :friction=1, or a TOML, STL or OBJ file"
)


@dataclass(frozen=True)
class Mesh:
    """The surface of a convex solid about its centre of mass."""

    corners: tuple[Vector, ...]
    """Corners [m]."""
    triangles: tuple[tuple[int, int, int], ...]
    """Corners of each triangle, counter-clockwise seen from outside."""
    inertia: tuple[float, float, float, float, float, float]
    """Moments xx, yy, zz, xy, xz, yz of one kilogram of it [m^2]."""


@dataclass(frozen=True)
class SolidSpec:
    """An object that nothing but fingers holds."""

    name: str
    """The name it was asked for by."""
    shape: Solid
    """Box, cylinder, sphere, ellipsoid or mesh."""
    size: Vector
    """Full extent along x, y and z [m]."""
    mass: float = 0.05
    """Mass, spread evenly [kg]."""
    friction: float = 1.0
    """Friction coefficient; a contact has the product of both bodies' coefficients."""
    mesh: Mesh | None = None
    """Surface of a mesh."""
    centre: Vector = (0.0, 0.0, 0.0)
    """Centre of mass in the object frame [m]; the moments of inertia about it are those of the even body."""

    def __post_init__(self) -> None:
        """Refuse shapes, sizes, masses and frictions that no object has."""
        what = f"object {self.name!r}"
        if self.shape not in SOLIDS:
            near = near_matches(str(self.shape), SOLIDS)
            raise InputError(f"{what}: unknown shape {self.shape!r}; allowed are {', '.join(SOLIDS)}{near}")
        if len(self.size) != 3 or not all(np.isfinite(s) and s > 0 for s in self.size):
            given = ", ".join(f"{1e3 * s:g}" for s in self.size)
            raise InputError(f"{what}: size [{given}] mm; size needs three positive lengths, x, y and z")
        for axis, length in zip("xyz", self.size, strict=True):
            check_length(f"{what}: its size, {axis},", length)
        x, y, z = self.size
        if (self.shape == "cylinder" and not np.isclose(x, y)) or (
            self.shape == "sphere" and not np.allclose((x, y), z)
        ):
            alike = "all three diameters alike, or shape 'ellipsoid'" if self.shape == "sphere" else "x and y alike"
            raise InputError(f"{what}: a {self.shape} of {1e3 * x:g} x {1e3 * y:g} x {1e3 * z:g} mm; give {alike}")
        check_body(what, self.mass, self.friction)
        if (self.shape == "mesh") != (self.mesh is not None):
            raise InputError(f"{what}: shape {self.shape!r}; a mesh and only a mesh has a surface of triangles")
        if len(self.centre) != 3 or not np.isfinite(self.centre).all():
            raise InputError(f"{what}: centre {self.centre}; its centre of mass needs x, y and z, finite [m]")

    @property
    def half(self) -> Vector:
        """Half of its extent along x, y and z [m]."""
        x, y, z = self.size
        return (x / 2, y / 2, z / 2)


def resized(spec: SolidSpec, factor: float) -> SolidSpec:
    """Return an object of the same shape, each of its lengths changed by a factor, and of the same mass."""
    x, y, z = spec.size
    mesh = spec.mesh
    if mesh is not None:
        corners = tuple((factor * a, factor * b, factor * c) for a, b, c in mesh.corners)
        xx, yy, zz, xy, xz, yz = (factor**2 * moment for moment in mesh.inertia)
        mesh = replace(mesh, corners=corners, inertia=(xx, yy, zz, xy, xz, yz))
    return replace(spec, size=(factor * x, factor * y, factor * z), mesh=mesh)


def inertia_of(spec: SolidSpec) -> Array:
    """Return the moments of inertia `(3, 3)` about the centre of mass, along the object's axes [kg m^2]."""
    a, b, c = spec.half
    if spec.mesh is not None:
        xx, yy, zz, xy, xz, yz = spec.mesh.inertia
        return spec.mass * np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if spec.shape == "cylinder":
        across = a * a / 4 + c * c / 3
        return spec.mass * np.diag([across, across, a * a / 2])
    share = 1 / 3 if spec.shape == "box" else 1 / 5
    return spec.mass * share * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])


WORDS = ("cube", "box", "sphere", "cylinder", "ellipsoid")
"""What an object's name can start with."""
_COUNTS = {"cube": 1, "box": 3, "sphere": 1, "cylinder": 2, "ellipsoid": 3}
_LENGTH = r"[0-9]+(?:\.[0-9]+)?"
_NAME = re.compile(rf"({'|'.join(WORDS)})_({_LENGTH}(?:x{_LENGTH})*)")


def parse_solid_name(name: str) -> SolidSpec:
    """Return the object in space that a name describes.

    Raises:
        InputError: the name is none; the text says which part is wrong.
    """
    found = _NAME.fullmatch(name)
    if found is None:
        raise InputError(
            f"unknown object {name!r} for a hand in space{near_matches(name, CATALOGUE)}; allowed are {FORM}"
        )
    word, sizes = found[1], [float(size) / 1e3 for size in found[2].split("x")]
    if len(sizes) != _COUNTS[word]:
        raise InputError(
            f"object {name!r} gives {len(sizes)} lengths, and a {word} in space has {_COUNTS[word]}; the form is {FORM}"
        )
    x, y, z = {1: sizes * 3, 2: [sizes[0], *sizes], 3: sizes}[len(sizes)]
    shape = cast("Solid", "box" if word == "cube" else word)
    return SolidSpec(name, shape, (x, y, z))
