"""Hands in space: serial fingers of hinges on a palm, each ending in a spherical tip, as frozen specs.

Palm frame: origin on the palm's surface at the middle of the fingers' bases, +z out of the palm, +x right, +y up the
palm (where the planar hands have Out). A link's frame has its origin on the link's hinge. Joints are ordered finger by
finger, each from the palm outwards.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array, fixed
from inhand.hands.jointed import Jointed
from inhand.hands.sizes import check_length, check_mass

Vector: TypeAlias = tuple[float, float, float]
"""A point [m] or a direction."""
Quaternion: TypeAlias = tuple[float, float, float, float]
"""A unit quaternion w, x, y, z."""
Inertia: TypeAlias = tuple[float, float, float, float, float, float]
"""Moments of inertia xx, yy, zz, xy, xz, yz about the centre of mass [kg m^2]."""

UNTURNED: Quaternion = (1.0, 0.0, 0.0, 0.0)
UNIT = 1e-6
"""How far an axis or a quaternion may be from length 1."""


@dataclass(frozen=True)
class Capsule:
    """What a link touches with: all points within a radius of a line."""

    start: Vector
    """One end of the line in the link's frame [m]."""
    end: Vector
    """The other end [m]."""
    radius: float
    """Radius [m]."""


@dataclass(frozen=True)
class Link:
    """A hinge and the rigid part that it moves."""

    origin: Vector
    """The hinge in the frame of the link before, of the first link in the palm frame [m]."""
    axis: Vector
    """Unit vector of the hinge in the link's frame; positive angles turn counter-clockwise about it."""
    limits: tuple[float, float]
    """Lowest and highest joint angle [rad]."""
    turn: Quaternion = UNTURNED
    """The link's frame in that of the link before (the palm frame) where the joint angle is zero."""
    capsules: tuple[Capsule, ...] = ()
    """What it touches with besides a fingertip; none of a hinge that only carries the next."""
    mass: float = 0.025
    """Mass [kg]."""
    centre: Vector = (0.0, 0.0, 0.0)
    """Centre of mass in the link's frame [m]."""
    inertia: Inertia = (2e-6, 2e-6, 2e-6, 0.0, 0.0, 0.0)
    """Moments of inertia about the centre of mass along the link's axes [kg m^2]."""


@dataclass(frozen=True)
class SpatialFinger:
    """A serial chain of hinges that ends in a spherical tip."""

    name: str
    """What it is called."""
    links: tuple[Link, ...]
    """Its links from the palm outwards."""
    tip: Vector
    """Centre of the fingertip in the last link's frame [m]."""
    tip_radius: float
    """Radius of the fingertip [m]."""

    @cached_property
    def length(self) -> float:
        """Length of the straight finger from its first hinge to the tip's centre [m]."""
        offsets = [*(link.origin for link in self.links[1:]), self.tip]
        return float(sum(np.linalg.norm(offset) for offset in offsets))

    @cached_property
    def limits(self) -> Array:
        """Lowest and highest joint angles `(n, 2)` [rad]."""
        return fixed([link.limits for link in self.links])


@dataclass(frozen=True)
class Box:
    """A box along the palm frame's axes."""

    centre: Vector
    """Its middle [m]."""
    half: Vector
    """Half of its extent along x, y and z [m]."""

    @property
    def top(self) -> float:
        """Height of its upper face [m]."""
        return self.centre[2] + self.half[2]


@dataclass(frozen=True)
class SpatialHand(Jointed):
    """A hand of N fingers on a still palm; its links' weight is carried by their motors (none falls at rest)."""

    name: str
    """The name it was asked for by."""
    fingers: tuple[SpatialFinger, ...]
    """Its fingers, in the order that every array has them in."""
    palm: Box
    """What the object must not touch: links may."""
    start_position: Vector
    """Where the object starts in the palm frame [m]."""
    friction: float = 0.9
    """Friction coefficient of the fingers; a contact has the product of both bodies' coefficients."""
    stiffness: float = 5.0
    """Gain of the position servos [N m/rad], guessed as of the planar hands."""
    damping: float = 0.15
    """Damping of each geared joint [N m s/rad], guessed: near critical."""
    armature: float = 1e-3
    """Rotor inertia seen through the gears at each joint [kg m^2], guessed (a small geared servo)."""
    torque: float = 0.6
    """Largest torque of each motor [N m], guessed: a small geared servo."""

    def __post_init__(self) -> None:
        """Refuse numbers that no hand has."""
        if len(self.fingers) < 2:
            raise InputError(f"hand {self.name!r} has {len(self.fingers)} fingers; give two or more")
        if len(set(self.finger_names)) < len(self.fingers):
            raise InputError(f"hand {self.name!r} has two fingers of one name: {', '.join(self.finger_names)}")
        starts = {tuple(np.round(finger.links[0].origin, 6)) if finger.links else () for finger in self.fingers}
        if len(starts) == 1:
            raise InputError(f"hand {self.name!r}: its fingers all begin at one place: give each its own")
        self.check_numbers(("stiffness", "torque"), ("friction", "damping", "armature"))
        for finger in self.fingers:
            _check_finger(f"hand {self.name!r}: finger {finger.name!r}", finger)
        _check_finite(f"hand {self.name!r}: start_position", self.start_position)

    @cached_property
    def finger_names(self) -> tuple[str, ...]:
        """Names of the fingers."""
        return tuple(finger.name for finger in self.fingers)

    @cached_property
    def start_pose(self) -> Array:
        """Pose `(7,)` in which the object starts: at `start_position`, not turned."""
        return fixed([*self.start_position, *UNTURNED])


def rod(length: float, radius: float, mass: float, tip: tuple[float, float] = (0.0, 0.0)) -> Link:
    """Return the body of a straight link along +z, with a hinge of no limits at its origin, for `replace`.

    Args:
        length: from hinge to hinge, or to the tip's centre [m]; the link has no capsule where it is zero.
        radius: of its capsule [m].
        mass: of the capsule [kg].
        tip: radius [m] and mass [kg] of a sphere at its end, where it carries the fingertip.

    The capsule's moments are those of a cylinder and two half spheres, the sphere's are added by Steiner's rule.
    """
    ends = ((0.0, 0.0, 0.0), (0.0, 0.0, length))
    capsules = (Capsule(*ends, radius),) if length > 0 else ()
    tip_radius, tip_mass = tip
    whole = mass + tip_mass
    middle = (mass * length / 2 + tip_mass * length) / whole
    volume = np.pi * radius**2 * (length + 4 / 3 * radius)
    straight = mass * np.pi * radius**2 * length / volume
    caps = mass - straight
    along = straight * radius**2 / 2 + caps * 0.4 * radius**2 + 0.4 * tip_mass * tip_radius**2
    across = straight * (length**2 / 12 + radius**2 / 4)
    across += caps * (0.4 * radius**2 + length**2 / 4 + 3 / 8 * length * radius)
    across += mass * (middle - length / 2) ** 2
    across += tip_mass * (0.4 * tip_radius**2 + (length - middle) ** 2)
    inertia = (across, across, along, 0.0, 0.0, 0.0)
    return Link(
        (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-np.pi, np.pi), UNTURNED, capsules, whole, (0.0, 0.0, middle), inertia
    )


def _check_finite(what: str, numbers: Iterable[float]) -> None:
    given = list(numbers)
    if not np.isfinite(given).all():
        raise InputError(f"{what} is {given}; its numbers must be finite (SI units)")


def _check_finger(what: str, finger: SpatialFinger) -> None:
    if not finger.links:
        raise InputError(f"{what} has no links: give it a hinge or more")
    check_length(f"{what}: its tip's radius", finger.tip_radius)
    _check_finite(f"{what}: its tip", finger.tip)
    for k, link in enumerate(finger.links):
        part = f"{what}, link {k}"
        _check_finite(part, (*link.origin, *link.axis, *link.turn, *link.limits, *link.centre, *link.inertia))
        for name, numbers in (("axis", link.axis), ("turn", link.turn)):
            if abs(np.linalg.norm(numbers) - 1) > UNIT:
                raise InputError(f"{part}: {name} {tuple(numbers)} is not of length 1: scale it")
        if not link.limits[0] < link.limits[1]:
            raise InputError(f"{part}: limits {link.limits}; give the lower angle first [rad]")
        check_mass(f"{part}: its mass", link.mass)
        for capsule in link.capsules:
            check_length(f"{part}: a capsule's radius", capsule.radius)
