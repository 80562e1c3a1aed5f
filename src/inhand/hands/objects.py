"""Objects: upright prisms over any outline, as frozen specs.

Object frame: origin at the centre of the outline's bounding box, axes along its sides, z up.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal, get_args

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.hands.convex import convex_parts, is_convex
from inhand.hands.object_forms import FORMS
from inhand.hands.outlines import Corners, centroid, clean_outline, points_along, stretched
from inhand.hands.polygons import with_corners
from inhand.hands.sizes import check_body, check_length, check_outline_size

Shape = Literal["box", "cylinder", "ellipse", "polygon"]
SHAPES: tuple[str, ...] = get_args(Shape)


@dataclass(frozen=True)
class ObjectSpec:
    """An object that stands on the plane."""

    name: str
    """The name it was asked for by."""
    shape: Shape
    """Outline: box, cylinder, ellipse or polygon."""
    size: tuple[float, float, float]
    """Full extent along x, y and z [m]."""
    mass: float = 0.03
    """Mass [kg]; the laboratory's objects weigh 15 to 45 g."""
    friction: float = 1.0
    """Friction coefficient; a contact has the product of both bodies' coefficients."""
    corners: Corners = ()
    """Outline of a polygon [m]: counter-clockwise, around the middle of its bounding box, stretched to `size`."""
    centre: tuple[float, float] = (0.0, 0.0)
    """Centre of mass from where an even object of this outline has it [m]; moments of inertia about it stay."""

    def __post_init__(self) -> None:
        """Refuse shapes, sizes, masses, frictions and outlines that no object has; bring corners into order."""
        self._check_shape()
        check_body(f"object {self.name!r}", self.mass, self.friction)
        if len(self.centre) != 2 or not np.isfinite(self.centre).all():
            raise InputError(
                f"object {self.name!r}: centre {self.centre}; its centre of mass needs x and y, finite [m]"
            )
        if self.shape == "polygon":
            object.__setattr__(self, "corners", stretched(clean_outline(self.name, self.corners), self.size))
        elif self.corners:
            raise InputError(
                f"object {self.name!r}: corners of a {self.shape}; only shape 'polygon' has corners: leave one out"
            )

    def _check_shape(self) -> None:
        if self.shape not in SHAPES:
            raise InputError(
                f"object {self.name!r}: unknown shape {self.shape!r}; allowed are {', '.join(SHAPES)}"
                f"{near_matches(str(self.shape), SHAPES)}"
            )
        if len(self.size) != 3 or not all(np.isfinite(s) and s > 0 for s in self.size):
            given = ", ".join(f"{1e3 * s:g}" for s in self.size)
            raise InputError(
                f"object {self.name!r}: size [{given}] mm; size needs three positive lengths, x, y and height"
            )
        check_outline_size(self.name, self.size[:2])
        for axis, length in zip(("x", "y", "height"), self.size, strict=True):
            check_length(f"object {self.name!r}: its size, {axis},", length)
        if self.shape == "cylinder" and not np.isclose(self.size[0], self.size[1]):
            raise InputError(
                f"object {self.name!r}: a cylinder of {1e3 * self.size[0]:g} x {1e3 * self.size[1]:g} mm; give"
                " both diameters alike, or shape = 'ellipse'"
            )

    @property
    def height(self) -> float:
        """Height above the plane [m]."""
        return self.size[2]


def polygon_object(name: str, corners: Sequence[Sequence[float]], height: float = 0.1) -> ObjectSpec:
    """Return the object over any simple outline (x, y) [m] in either order, of the default mass and friction.

    Raises:
        InputError: the outline has under three corners, meets itself, or has no area.
    """
    outline = clean_outline(name, corners)
    width, depth = np.ptp(np.array(outline), axis=0)
    return ObjectSpec(name, "polygon", (float(width), float(depth), height), corners=outline)


def outline(spec: ObjectSpec, step: float = 0.001) -> tuple[Array, Array]:
    """Return points `(K, 2)` [m] and outward unit normals `(K, 2)` on the outline, counter-clockwise, by a step [m].

    Boxes and polygons give points on their faces and none on their corners, where the normal is not defined; a round
    outline is sampled evenly in its parameter.
    """
    a, b = spec.size[0] / 2, spec.size[1] / 2
    if spec.shape == "box":
        return _box_outline(a, b, step)
    if spec.shape == "polygon":
        return points_along(polygon(spec), step)
    count = max(24, int(np.ceil(2 * np.pi * max(a, b) / step)))
    angle = np.arange(count) * 2 * np.pi / count
    points = np.stack([a * np.cos(angle), b * np.sin(angle)], axis=-1)
    normals = np.stack([b * np.cos(angle), a * np.sin(angle)], axis=-1)
    return points, normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def polygon(spec: ObjectSpec, count: int = 48) -> Array:
    """Return the outline as a polygon `(K, 2)` [m], counter-clockwise; round outlines have `count` corners.

    It may have inward corners: `convex_pieces` has none.
    """
    if spec.shape == "polygon":
        return np.array(spec.corners)
    a, b = spec.size[0] / 2, spec.size[1] / 2
    if spec.shape == "box":
        return np.array([(-a, -b), (a, -b), (a, b), (-a, b)])
    angle = (np.arange(count) + 0.5) * 2 * np.pi / count
    return np.stack([a * np.cos(angle), b * np.sin(angle)], axis=-1)


def centre_of_mass(spec: ObjectSpec) -> Array:
    """Return an object's centre of mass in its own frame `(2,)` [m]."""
    return np.array(spec.centre) + (centroid(polygon(spec)) if spec.shape == "polygon" else 0.0)


def convex_pieces(spec: ObjectSpec) -> tuple[Array, ...]:
    """Return convex polygons `(K, 2)` [m], counter-clockwise, that together are the object; one if it is convex.

    Raises:
        InputError: the outline's corners are too near to each other to be cut apart.
    """
    return _parts(spec.corners) if spec.shape == "polygon" else (polygon(spec),)


def stacked_pieces(specs: Sequence[ObjectSpec]) -> tuple[Array, ...]:
    """Return the pieces of B objects side by side, each an array `(B, K, 2)` [m].

    An object of fewer pieces than others has its last one again, a piece of fewer corners more of them on an edge.
    """
    each = [convex_pieces(spec) for spec in specs]
    rows = [[pieces[min(k, len(pieces) - 1)] for pieces in each] for k in range(max(map(len, each)))]
    return tuple(np.stack([with_corners(piece, max(map(len, row))) for piece in row]) for row in rows)


@cache
def _parts(corners: Corners) -> tuple[Array, ...]:
    """Return the pieces of an outline, cut once for all worlds and therefore read-only."""
    outline = np.array(corners)
    parts = (outline,) if is_convex(outline) else convex_parts(outline)
    for part in parts:
        part.setflags(write=False)
    return parts


def _box_outline(a: float, b: float, step: float) -> tuple[Array, Array]:
    points, normals = [], []
    for normal, half, offset in (((1, 0), b, a), ((0, 1), a, b), ((-1, 0), b, a), ((0, -1), a, b)):
        count = max(3, int(np.ceil(2 * half / step)))
        along = (np.arange(count) + 0.5) / count * 2 * half - half
        n = np.array(normal, dtype=float)
        points.append(along[:, None] * np.array([-n[1], n[0]]) + offset * n)
        normals.append(np.tile(n, (count, 1)))
    return np.concatenate(points), np.concatenate(normals)


def _formed(name: str, word: str, x: float, y: float) -> ObjectSpec:
    """Return an object whose outline has a word of its own, such as triangle; sizes in mm."""
    size = (x / 1e3, y / 1e3, 0.1)
    if not (x > 0 and y > 0):
        return ObjectSpec(name, "box", size)  # which says what a size must be
    return ObjectSpec(name, "polygon", size, corners=FORMS[word](size[0], size[1]))


CATALOGUE: dict[str, ObjectSpec] = {
    spec.name: spec
    for spec in (
        ObjectSpec("cube_39", "box", (0.039, 0.039, 0.1)),
        ObjectSpec("cube_35", "box", (0.035, 0.035, 0.1)),
        ObjectSpec("cube_43", "box", (0.043, 0.043, 0.1)),
        ObjectSpec("cube_42", "box", (0.042, 0.042, 0.1)),
        ObjectSpec("square_36", "box", (0.036, 0.036, 0.1)),
        ObjectSpec("square_40", "box", (0.040, 0.040, 0.1)),
        ObjectSpec("square_44", "box", (0.044, 0.044, 0.1)),
        ObjectSpec("rectangle_33x22", "box", (0.0327, 0.0218, 0.1)),
        ObjectSpec("rectangle_38x19", "box", (0.0378, 0.0189, 0.1)),
        ObjectSpec("rectangle_42x17", "box", (0.0422, 0.0169, 0.1)),
        ObjectSpec("rectangle_46x15", "box", (0.0462, 0.0154, 0.1)),
        ObjectSpec("cylinder_40", "cylinder", (0.040, 0.040, 0.1)),
        ObjectSpec("cylinder_51", "cylinder", (0.0508, 0.0508, 0.1)),
        ObjectSpec("ellipse_40x25", "ellipse", (0.040, 0.025, 0.1)),
        ObjectSpec("ellipse_25x40", "ellipse", (0.025, 0.040, 0.1)),
        _formed("triangle", "triangle", 31.6, 35.6),
        _formed("teardrop", "teardrop", 45.0, 38.5),
        _formed("pentagon", "pentagon", 45.0, 42.8),
        _formed("trapezoid", "trapezoid", 45.0, 20.0),
        _formed("hourglass", "hourglass", 40.0, 40.0),
        _formed("concave_square", "concave_square", 40.0, 40.0),
    )
}
"""Objects of the laboratory (height 100 mm, 30 g); the x axis lies across the hand.

The rectangles have one area and the aspects 1.5, 2, 2.5 and 3; the laboratory gives the first and the last size.
"""

WORDS: tuple[str, ...] = ("cube", "square", "box", "rectangle", "cylinder", "ellipse", *FORMS)
"""What an object's name can start with."""
_FORM = re.compile(rf"({'|'.join(WORDS)})_(\d+(?:\.\d+)?)(?:x(\d+(?:\.\d+)?))?")


def parse_object_name(name: str) -> ObjectSpec:
    """Return the object of a catalogue name, or of any `shape_SIZE` or `shape_XxY` in mm, such as `box_30x45`.

    Raises:
        InputError: the name is neither; the text offers near matches.
    """
    if name in CATALOGUE:
        return CATALOGUE[name]
    found = _FORM.fullmatch(name)
    if found is None:
        size = name.rpartition("_")[2]
        words = [f"{word}_{size}" for word in WORDS if _FORM.fullmatch(f"{word}_{size}")]
        near = near_matches(name, (*CATALOGUE, *words))
        raise InputError(
            f"unknown object {name!r}{near}; allowed are a name that `inhand objects` lists,"
            " shape_SIZE or shape_XxY in mm (box_30x45, cylinder_40, ellipse_40x25), or a TOML file, after it as"
            " wanted :mass_kg=0.05 and :friction=0.8"
        )
    word, x, y = found.groups()
    if word in FORMS:
        return _formed(name, word, float(x), float(y or x))
    shape: Shape = "cylinder" if word == "cylinder" else "ellipse" if word == "ellipse" else "box"
    return ObjectSpec(name, shape, (float(x) / 1e3, float(y or x) / 1e3, 0.1))
