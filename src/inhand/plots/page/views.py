"""What a page shows that moves or tells values under the pointer, as the scripts beside this take it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from inhand.geometry import Array
from inhand.plots.curves import PathCurve, band_polygons, curves_extent, limit_outline, target_length
from inhand.plots.page.packed import Packed
from inhand.plots.shapes import Extent, SceneOutline, joined
from inhand.plots.style import direction_colour

Flat: TypeAlias = tuple[float, ...]
"""Points x, y, x, y, ... [mm]."""
DIGITS = 2
"""Digits of a coordinate behind the point [mm]."""


@dataclass(frozen=True)
class View:
    """A part of a page that a script draws."""

    kind: Literal["asterisks", "player", "charts", "heat", "intervals", "bars", "maps"]
    content: Any
    """What it draws, a record."""
    title: str = ""
    """Stands above it; may be empty."""
    told: str = ""
    """A paragraph below the title."""


@dataclass(frozen=True)
class Curve:
    """A line of an asterisk."""

    name: str
    angle: float
    """The direction [deg]."""
    colour: str
    points: Flat
    label: float
    """Written at its tip [mm]."""
    limit: float | None
    """How far the hand could reach [mm]."""
    target: Flat | None
    """A reference path that is not straight."""
    bands: tuple[Flat, ...]
    """Outlines of its spread."""
    failed: bool
    told: tuple[str, ...]
    """What stands beside the pointer, a line each."""


@dataclass(frozen=True)
class Shape:
    """An outline of a scene."""

    kind: Literal["palm", "link", "object"]
    points: Flat


@dataclass(frozen=True)
class Panel:
    """An asterisk."""

    title: str
    subtitle: str
    hint: str
    """Stands below it while nothing is pointed at."""
    extent: Extent
    """What it shows [mm]."""
    curves: tuple[Curve, ...]
    limit: Flat
    """The outline through the limits."""
    scene: tuple[Shape, ...]
    plain: bool = False
    """Whether it only serves to pick a direction."""


@dataclass(frozen=True)
class Panels:
    """Asterisks side by side on one scale."""

    panels: tuple[Panel, ...]


@dataclass(frozen=True)
class Finger:
    """A finger that moves."""

    name: str
    base: tuple[float, float]
    """Where it begins, in the palm frame [mm]."""
    first: int
    """Place of its first joint among all of the hand."""
    lengths: tuple[float, ...]
    """Lengths of its links [mm]."""
    outlines: tuple[Flat, ...]
    """Outlines of its links in their own frames: the joint at the origin, along +y."""


@dataclass(frozen=True)
class Hand:
    """A hand that moves."""

    palm: Flat
    fingers: tuple[Finger, ...]


@dataclass(frozen=True)
class Body:
    """An object that moves."""

    outline: Flat
    """In its own frame [mm]."""
    nose: float
    """Length of the line that shows where it is turned to [mm]."""


@dataclass(frozen=True, kw_only=True)
class Replayed:
    """A trial that can be replayed, in the plane or in space."""

    name: str
    group: str
    """Whose it is: a controller, or a run."""
    direction: str
    hand: int
    """Number of its hand,"""
    object: int
    """and of its object."""
    rows: int
    start: int
    """The row at which manipulation begins."""
    period: float
    """Time between two rows [s]."""
    phases: tuple[tuple[int, str], ...]
    """First row and name of each phase."""
    outcome: str
    failed: bool
    told: str
    """How it ended, in a few words."""
    target: Flat
    """The path it was to take, in the palm frame [mm]."""
    packed: Packed
    """Joint angles [rad] and place [mm] of the object; how it is turned and what fingers do follow."""
    contact: str
    """Whether each finger touches, a bit each."""


@dataclass(frozen=True, kw_only=True)
class Motion(Replayed):
    """A trial in the plane; packed are also the object's angle [rad], fingers' nearest points [mm] and forces [N]."""

    angle: float | None
    """The direction [deg]; None where it has none."""
    colour: str


@dataclass(frozen=True)
class Player:
    """Trials to replay."""

    hands: tuple[Hand, ...]
    objects: tuple[Body, ...]
    trials: tuple[Motion, ...]
    extent: Extent
    """What the stage shows, in the palm frame [mm]."""
    walls: tuple[Flat, ...] = ()
    picker: Panel | None = None
    """An asterisk to pick a direction in."""


def flat(points: Array) -> Flat:
    """Return points `(N, 2)` [mm] as a flat list, those that are not finite left out."""
    known = points[np.isfinite(points).all(axis=1)]
    return tuple((np.round(known, DIGITS) + 0.0).ravel().tolist())


def colour_of(angle_deg: float | None) -> str:
    """Return the colour of a direction [deg]; that of the text where there is none."""
    return "currentColor" if angle_deg is None else direction_colour(angle_deg)


def curve_of(curve: PathCurve, told: Iterable[str] = ()) -> Curve:
    """Return a curve as the page takes it, with what stands beside the pointer."""
    return Curve(
        curve.name,
        curve.angle_deg,
        direction_colour(curve.angle_deg),
        flat(curve.points_mm),
        round(curve.label_mm, DIGITS),
        curve.limit_mm,
        None if curve.target_mm is None else flat(curve.target_mm),
        tuple(flat(corners) for corners in band_polygons(curve)),
        curve.failed,
        tuple(told),
    )


def shapes_of(scene: SceneOutline | None) -> tuple[Shape, ...]:
    """Return the outlines of a scene [mm], origin at the object's start, back to front."""
    if scene is None:
        return ()
    parts: list[tuple[Literal["palm", "link", "object"], Array]] = [("palm", scene.palm)]
    parts += [("link", link) for link in scene.links] + [("object", scene.object)]
    return tuple(Shape(kind, flat(points - scene.origin_mm)) for kind, points in parts)


@dataclass(frozen=True, eq=False)
class Star:
    """An asterisk to be set beside others."""

    title: str
    subtitle: str
    curves: Sequence[PathCurve]
    told: Sequence[Sequence[str]]
    """What stands beside the pointer, for each curve."""
    scene: SceneOutline | None = None


def panels_of(stars: Sequence[Star], hint: str) -> Panels:
    """Return asterisks on one scale."""
    every = [curve for star in stars for curve in star.curves]
    extent = joined([curves_extent(star.curves, star.scene, target_length(every)) for star in stars])
    return Panels(tuple(_panel(star, hint, extent) for star in stars))


def _panel(star: Star, hint: str, extent: Extent) -> Panel:
    curves = tuple(curve_of(*each) for each in zip(star.curves, star.told, strict=True))
    return Panel(
        star.title, star.subtitle, hint, extent, curves, flat(limit_outline(star.curves)), shapes_of(star.scene)
    )
