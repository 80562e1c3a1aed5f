"""Motion primitives in space, and the words people name them by; the planar ones are the special case.

Out, In, Left and Right mean what they mean in the plane (+y, -y, -x, +x of the palm frame); Up is out of the palm (+z).
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.hands.spatial.hand import Vector
from inhand.tasks.primitives import Primitive, parse_directions, twisted_name

SIDES = (("Out", "In"), ("Right", "Left"), ("Up", "Down"))
"""Names of the two ways along y, x and z, in the order in which a name has them."""
ALONG = (1, 0, 2)
"""Which of x, y and z each pair of `SIDES` goes along."""
TURN = math.radians(270.0)
"""How far primitives that only rotate aim [rad], farther than any hand turns in space."""
SHORTEST = 1e-9
"""A vector shorter than this has no direction."""
SAME = 1e-9
"""Directions whose parts differ by less are one."""
LARGEST_HOLD = 90.0
"""A rotation that a translation holds is less than this [deg]."""


@dataclass(frozen=True)
class SpatialPrimitive:
    """One motion of the object in the hand."""

    name: str
    """`Out-Right-Up`, `1:2:0` for another direction, `turn+x` or `turn@1:1:0`; at its end a held rotation `@+x@15`."""
    direction: Vector | None
    """Unit vector in the palm frame along which the object moves; None: only rotate."""
    rotation: Vector = (0.0, 0.0, 0.0)
    """Rotation vector in the palm frame, turned first and then held, or to reach where there is no direction [rad]."""
    path: tuple[tuple[float, float, float], ...] | None = None
    """Planar poses of a user's path, as of `Primitive`."""

    @property
    def axis(self) -> Array:
        """Unit vector `(3,)` about which it turns, zero where it turns nowhere."""
        turn = np.array(self.rotation)
        return np.asarray(turn / max(float(np.linalg.norm(turn)), SHORTEST))

    @property
    def angle(self) -> float:
        """How far it turns about its axis [rad]."""
        return float(np.linalg.norm(self.rotation))


def _named_directions() -> tuple[SpatialPrimitive, ...]:
    """Return the 26 directions to faces, edges and corners of a cube, those of fewest parts first."""
    signs = [each for each in product((1, -1, 0), repeat=3) if any(each)]
    return tuple(_along(sign) for sign in sorted(signs, key=lambda sign: sum(map(abs, sign))))


def _along(parts: Sequence[float], name: str | None = None) -> SpatialPrimitive:
    """Return the primitive along a vector by its parts in the order of `SIDES`."""
    vector = np.zeros(3)
    vector[list(ALONG)] = parts
    x, y, z = (vector / np.linalg.norm(vector)).tolist()
    words = [sides[0] if part > 0 else sides[1] for sides, part in zip(SIDES, parts, strict=True) if part]
    return SpatialPrimitive(name or "-".join(words), (x, y, z))


DIRECTIONS = _named_directions()
"""6 axes, 12 edges and 8 corners."""
TURNS = tuple(
    SpatialPrimitive(f"turn{'+' if size > 0 else '-'}{axis}", None, vector)
    for size in (TURN, -TURN)
    for axis, vector in (("x", (size, 0.0, 0.0)), ("y", (0.0, size, 0.0)), ("z", (0.0, 0.0, size)))
)
"""The six primitives that rotate about an axis of the palm frame; `ccw` and `cw` are those about z."""


def _map_directions() -> tuple[SpatialPrimitive, ...]:
    """Return 98 directions: the lattice points of a cube's surface, 5 x 5 a side; the 26 named ones among them."""
    steps = (0, 1, -1, 2, -2)
    return tuple(along(np.array(each)) for each in product(steps, repeat=3) if max(map(abs, each)) == 2)


def along(vector: Array) -> SpatialPrimitive:
    """Return the primitive along a vector `(3,)` of the palm frame; a named direction gets its name.

    Raises:
        InputError: it is not finite, or of no length.
    """
    x, y, z = unit_vector("direction", vector)
    for known in DIRECTIONS:
        if np.abs(np.subtract(known.direction or (0.0, 0.0, 0.0), (x, y, z))).max() < SAME:
            return known
    return SpatialPrimitive(":".join(f"{part:.6g}" for part in vector), (x, y, z))


def lifted(primitive: Primitive) -> SpatialPrimitive:
    """Return a planar primitive in space: along x and y, about z."""
    turn = math.radians(primitive.rotation_deg)
    if primitive.angle_deg is None:
        return SpatialPrimitive(primitive.name, None, (0.0, 0.0, math.copysign(TURN, turn)), primitive.path)
    angle = math.radians(primitive.angle_deg)
    known = along(np.array([math.cos(angle), math.sin(angle), 0.0]))
    return replace(known, name=primitive.name, rotation=(0.0, 0.0, turn), path=primitive.path)


def about(vector: Array, angle: float = TURN) -> SpatialPrimitive:
    """Return the primitive that rotates about a vector `(3,)` of the palm frame by an angle [rad].

    Raises:
        InputError: the vector is not finite or of no length, or the angle is not positive and finite.
    """
    if not 0 < angle < math.inf:
        raise InputError(f"rotation by {angle:g} rad: give a positive angle, and an axis that says which way")
    axis = unit_vector("axis", vector)
    for known in TURNS:
        if np.abs(known.axis - axis).max() < SAME:
            return replace(known, rotation=_scaled(axis, angle))
    return SpatialPrimitive(f"turn@{':'.join(f'{part:.6g}' for part in vector)}", None, _scaled(axis, angle))


def holding(primitive: SpatialPrimitive, axis: Array, degrees: float) -> SpatialPrimitive:
    """Return a translation that first turns about an axis `(3,)` by an angle [deg] and then holds that.

    Raises:
        InputError: the primitive only rotates, the axis has no length, or the angle is not between 0 and 90 deg.
    """
    if primitive.direction is None:
        raise InputError(f"primitive {primitive.name} only rotates: give one that translates to hold a rotation")
    if not 0 < degrees < LARGEST_HOLD:
        raise InputError(f"{primitive.name} holds {degrees:g} deg: give more than 0 and less than {LARGEST_HOLD:g} deg")
    unit = unit_vector("axis", axis)
    word = next((f"{sign}{name}" for name, sign, known in _axes() if np.abs(known - unit).max() < SAME), None)
    word = word or ":".join(f"{part:.6g}" for part in axis)
    name = f"{primitive.name}@{word}@{degrees:g}"
    return replace(primitive, name=name, rotation=_scaled(unit, math.radians(degrees)))


def unit_vector(what: str, vector: Iterable[float]) -> Vector:
    """Return a vector as long as 1.

    Raises:
        InputError: it is no three finite numbers, or has no length or one too large to compute with.
    """
    numbers = [float(part) for part in vector]
    shown = ":".join(f"{part:g}" for part in numbers)
    if len(numbers) != 3 or not math.isfinite(sum(part * part for part in numbers)):
        raise InputError(f"{what} {shown}: give three finite numbers x:y:z in the palm frame")
    length = float(np.linalg.norm(numbers))
    if length < SHORTEST:
        raise InputError(f"{what} {shown} has no length, so it points nowhere: give one part that is not 0")
    x, y, z = (part / length for part in numbers)
    return (x, y, z)


MAP = _map_directions()
"""98 directions, enough for a map of the direction sphere."""
GROUPS = {
    "axes": DIRECTIONS[:6],
    "edges": DIRECTIONS[6:18],
    "corners": DIRECTIONS[18:],
    "all": DIRECTIONS,
    "turns": TURNS,
    "map": MAP,
}
"""Words that stand for several primitives in space."""
PLANAR = ("train", "unseen", "twist")
"""Words of the plane that mean in space what they mean there."""


def parse_spatial_directions(text: str | Sequence[str], twist_deg: float = 0.0) -> tuple[SpatialPrimitive, ...]:
    """Return the primitives that words name, each once, in the order given.

    Args:
        text: Words separated by commas or spaces, or a sequence of such texts: the groups `axes`, `edges`, `corners`,
            `all` (26), `turns` (6) and `map` (98); names in any case and order of parts (`Out-Right-Up`, `up-out`);
            vectors `1:2:0`; rotations `turn+x`, `turn@1:1:0`; a translation that holds a rotation `Up@+x@15`; and all
            words of the plane, which mean what they mean there (`train`, `30`, `cw`).
        twist_deg: twist about z to hold, each way [deg]; 0 for none.

    Raises:
        InputError: no word, an unknown word (the text offers the nearest), or a direction or axis of no length.
    """
    pieces = [text] if isinstance(text, str) else list(text)
    words = [word for word in re.split(r"[,;\s]+", ",".join(pieces)) if word]
    if not words:
        raise InputError(f"no direction given. {_allowed()}")
    each_once: dict[object, SpatialPrimitive] = {}
    for primitive in (each for word in words for each in _meant_by(word)):
        each_once.setdefault(_motion(primitive), primitive)
    found = tuple(each_once.values())
    if not twist_deg:
        return found
    held = [
        (each, turn, holding(each, np.array([0, 0, turn]), abs(turn)))
        for turn in (-twist_deg, twist_deg)
        for each in found
    ]
    return tuple(replace(made, name=twisted_name(each.name, turn)) for each, turn, made in held)


def _motion(primitive: SpatialPrimitive) -> object:
    """Return what two primitives of different names but one motion have in common."""
    parts = (*(primitive.direction or ()), *primitive.rotation)
    return primitive.direction is None, tuple(round(part / SAME) for part in parts), primitive.path


def _meant_by(word: str) -> tuple[SpatialPrimitive, ...]:
    lower = word.lower()
    if lower in GROUPS:
        return GROUPS[lower]
    direction, *held = word.split("@")
    if direction.lower() == "turn" and len(held) == 1:
        return (about(_axis(word, held[0])),)
    if len(held) == 2:
        axis, degrees = _axis(word, held[0]), _number(word, held[1])
        return tuple(holding(each, axis, degrees) for each in _meant_by(direction))
    known = _named().get(frozenset(lower.split("-"))) or next((each for each in TURNS if each.name == lower), None)
    if known is not None:
        return (known,)
    if word.count(":") == 2:
        return (along(np.array([_number(word, part) for part in word.split(":")])),)
    try:
        return tuple(lifted(each) for each in parse_directions(word))
    except InputError as error:
        names = [each.name for each in (*DIRECTIONS, *TURNS)]
        raise InputError(
            f"unknown direction {word!r}{near_matches(word, [*names, *GROUPS, *PLANAR]) or '.'} {_allowed()}"
        ) from error


def _named() -> dict[frozenset[str], SpatialPrimitive]:
    return {frozenset(each.name.lower().split("-")): each for each in DIRECTIONS}


def _axes() -> list[tuple[str, str, Array]]:
    return [(name, sign, (1 if sign == "+" else -1) * np.eye(3)[k]) for k, name in enumerate("xyz") for sign in "+-"]


def _axis(word: str, text: str) -> Array:
    """Return the axis of `+x` or of `1:1:0`."""
    for name, sign, vector in _axes():
        if text.lower() in {sign + name, name if sign == "+" else ""}:
            return vector
    parts = text.split(":")
    if len(parts) != 3:
        raise InputError(f"{word!r}: axis {text!r}; give +x, -x, +y, -y, +z, -z or three numbers such as 1:1:0")
    return np.array([_number(word, part) for part in parts])


def _number(word: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f"{word!r}: {text!r} is no number; a direction has three such as 1:2:0") from error


def _scaled(unit: Vector, angle: float) -> Vector:
    x, y, z = unit
    return (angle * x, angle * y, angle * z)


def _allowed() -> str:
    return (
        f"Use {', '.join((*GROUPS, *PLANAR))}, names of Out, In, Right, Left, Up and Down joined by hyphens"
        " (Out-Right-Up), vectors x:y:z (1:2:0), turn+x to turn-z, turn@1:1:0, Up@+x@15 to hold 15 deg about x, or"
        " angles in the plane, separated by commas or spaces"
    )
