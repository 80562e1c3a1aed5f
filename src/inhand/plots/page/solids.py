"""Trials in space as the page's scripts take them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from inhand.plots.page.views import Flat, Replayed

Point: TypeAlias = tuple[float, float, float]
"""A point [mm] or a direction."""
Rod: TypeAlias = tuple[float, ...]
"""A capsule: both ends and the radius [mm]."""


@dataclass(frozen=True)
class SolidLink:
    """A hinge and the capsules that it moves."""

    origin: Point
    """The hinge in the frame of the link before [mm]."""
    turn: tuple[float, float, float, float]
    """The link's frame in that one, where the joint angle is 0 (w, x, y, z)."""
    axis: Point
    rods: tuple[Rod, ...]


@dataclass(frozen=True)
class SolidFinger:
    """A finger that moves."""

    name: str
    first: int
    """Place of its first joint among all of the hand."""
    links: tuple[SolidLink, ...]
    tip: Point
    """Centre of its tip in the last link's frame [mm]."""
    radius: float
    """Radius of its tip [mm]."""


@dataclass(frozen=True)
class SolidHand:
    """A hand that moves."""

    palm: tuple[Flat, ...]
    """Faces of its palm, corner by corner x, y, z [mm]."""
    fingers: tuple[SolidFinger, ...]


@dataclass(frozen=True)
class Solid:
    """An object that moves."""

    faces: tuple[Flat, ...]
    """Its faces in its own frame, counter-clockwise from outside [mm]."""


@dataclass(frozen=True, kw_only=True)
class SolidMotion(Replayed):
    """A trial in space; packed are also the object's quaternion and the force of each finger [N]."""

    along: Point | None
    """Its direction; None where it only turns."""


@dataclass(frozen=True)
class Extent3:
    """The ball that the stage shows."""

    middle: Point
    radius: float
    """[mm]"""


@dataclass(frozen=True)
class Solids:
    """Trials in space to replay."""

    hands: tuple[SolidHand, ...]
    objects: tuple[Solid, ...]
    trials: tuple[SolidMotion, ...]
    extent: Extent3
    picker: None = None
    space: bool = True


@dataclass(frozen=True)
class Way:
    """How far a direction was gone."""

    name: str
    label: float
    limit: float | None
    colour: str = "var(--series-0)"


@dataclass(frozen=True)
class Ways:
    """Directions as bars."""

    title: str
    curves: tuple[Way, ...]
    group: str = ""
    """Whose they are: of it the first trial of a direction that is picked is replayed."""


@dataclass(frozen=True)
class Bars:
    """Lists of bars side by side."""

    lists: tuple[Ways, ...]


@dataclass(frozen=True)
class Dot:
    """A direction on a map."""

    name: str
    x: float
    y: float
    """Where it lies, the rim being a circle of radius 1."""
    label: float
    """Distance [mm]."""
    colour: str
    failed: bool
    told: tuple[str, ...]
    """What stands beside the pointer, a line each."""


@dataclass(frozen=True)
class Disc:
    """A map of half of all directions."""

    title: str
    group: str
    rim: tuple[str, str, str, str]
    """What is at its left, right, lower and upper end."""
    dots: tuple[Dot, ...]


@dataclass(frozen=True)
class Maps:
    """Maps side by side."""

    discs: tuple[Disc, ...]
