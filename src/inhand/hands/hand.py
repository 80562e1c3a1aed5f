"""Hands: two planar fingers on a palm, as frozen specs in the palm frame.

Palm frame: origin on the palm's mid-line at the proximal joints, +x right, +y away from the palm, +z up.
Joint angles [rad] are counter-clockwise about +z and zero where a finger points straight along +y, so a right
finger bends inwards with positive distal angles and a left finger with negative ones. Joints are ordered
left finger first, each from the palm outwards (thesis 3.3.2).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array, cross, fixed
from inhand.hands.jointed import Jointed
from inhand.hands.sizes import check_length, check_mass

FINGER_NAMES = ("left", "right")

Corners = tuple[tuple[float, float], ...]
"""Corners of a convex outline, counter-clockwise [m]."""

_POSITIVE = ("palm_width", "palm_depth", "link_width", "thickness", "tip_length", "link_mass", "stiffness", "torque")
_SIDES = ("palm_width", "palm_depth", "link_width", "thickness")
_NOT_NEGATIVE = ("joint_gap", "friction", "damping", "armature")


@dataclass(frozen=True)
class FingerSpec:
    """One finger: a chain of straight links in the plane."""

    base: tuple[float, float]
    """Proximal joint in the palm frame [m]."""
    links: tuple[float, ...]
    """Link lengths from joint to joint, the last to the fingertip [m]."""
    limits: tuple[tuple[float, float], ...]
    """Lowest and highest angle of each joint [rad]."""
    bend: int
    """Sign of the distal angles that bend this finger inwards: -1 left, +1 right."""
    outlines: tuple[Corners, ...] | None = None
    """Outline of each link in its own frame: joint at the origin, +y to the next joint or the fingertip. None stands
    for the shape that the hand's link width, joint gap and tip length describe."""
    masses: tuple[float, ...] | None = None
    """Mass of each link [kg]; None stands for the hand's `link_mass`."""

    @cached_property
    def length(self) -> float:
        """Length of the straight finger [m]."""
        return sum(self.links)


@dataclass(frozen=True)
class HandSpec(Jointed):
    """A two-finger hand. The numbers are the laboratory's public hand models unless marked guessed."""

    name: str
    """The name it was asked for by."""
    left: FingerSpec
    """Left finger."""
    right: FingerSpec
    """Right finger."""
    palm_width: float
    """Distance between the proximal joints [m]."""
    palm_depth: float = 0.053
    """Depth of the palm's box, which lies between y = -depth and 0 [m]."""
    link_width: float = 0.022
    """Width of the links in the plane [m]."""
    thickness: float = 0.032
    """Thickness of links and palm along z [m]."""
    joint_gap: float = 0.005
    """Length at the start of each link that carries no collision body [m]."""
    tip_length: float = 0.0075
    """Length of the fingertip's cap, half an ellipse across the link [m]."""
    link_mass: float = 0.036
    """Mass of each link [kg]."""
    friction: float = 0.5
    """Friction coefficient of the fingers; a contact has the product of both bodies' coefficients."""
    stiffness: float = 5.0
    """Gain of the position servos [N m/rad], guessed: 0.07 rad of error reach the torque limit."""
    damping: float = 0.15
    """Damping of each geared joint [N m s/rad], guessed: near critical."""
    armature: float = 1e-3
    """Rotor inertia seen through the gears at each joint [kg m^2], guessed (a small geared servo)."""
    torque: float = 0.35
    """Largest torque of each motor [N m]."""
    palm: Corners | None = None
    """Outline of the palm in the palm frame; None stands for the box of width and depth."""

    def __post_init__(self) -> None:
        """Refuse numbers that no hand has, and links shorter than their joint gap and cap."""
        self.check_numbers(_POSITIVE, _NOT_NEGATIVE)
        for name in _SIDES:
            check_length(f"hand {self.name!r}: {name}", getattr(self, name))
        check_mass(f"hand {self.name!r}: link_mass", self.link_mass)
        for side, finger in zip(self.finger_names, self.fingers, strict=True):
            _check_parts(self.name, side, finger)
            for i, length in enumerate(finger.links):
                dead = self.joint_gap + (self.tip_length if i == len(finger.links) - 1 else 0.0)
                if length <= dead and finger.outlines is None:
                    raise InputError(
                        f"hand {self.name!r}: link {i} of the {side} finger is {1e3 * length:g} mm long; it must be"
                        f" longer than {1e3 * dead:g} mm, its joint gap and its cap together"
                    )
        if self.palm is not None:
            _check_outline(self.name, "the palm", self.palm)

    def mass(self, finger: FingerSpec, link: int) -> float:
        """Return the mass of a finger's link [kg]."""
        return self.link_mass if finger.masses is None else finger.masses[link]

    @cached_property
    def fingers(self) -> tuple[FingerSpec, ...]:
        """The fingers, left and right, in the order that every array has them in."""
        return (self.left, self.right)

    @cached_property
    def finger_names(self) -> tuple[str, ...]:
        """Their names."""
        return FINGER_NAMES

    @cached_property
    def start_position(self) -> tuple[float, float]:
        """Origin of the task frame, where the object starts: 0.65 of the finger length (thesis 3.1) [m]."""
        return (0.0, 0.65 * self.finger_length)

    @cached_property
    def start_pose(self) -> Array:
        """Pose `(3,)` in which the object starts: at `start_position`, not turned [m, m, rad]."""
        return fixed([*self.start_position, 0.0])


def build_hand(
    name: str, left_links: tuple[float, ...], right_links: tuple[float, ...], palm_width: float, **numbers: Any
) -> HandSpec:
    """Return a hand with free joints (limits of +-pi, so that bodies are the only limit).

    Its fingers have links of some lengths [m], its palm a width between the proximal joints [m]; `numbers` are other
    fields of `HandSpec`.

    Raises:
        InputError: a length is not a positive finite number, or a finger has not two or three links.
    """
    for side, links in zip(FINGER_NAMES, (left_links, right_links), strict=True):
        if len(links) not in {2, 3}:
            raise InputError(f"hand {name!r}: the {side} finger has {len(links)} links; a finger has 2 or 3 links")
        for length in links:
            _check_positive(name, f"a link of the {side} finger", length)
    _check_positive(name, "the palm width", palm_width)
    fingers = [
        FingerSpec((sign * palm_width / 2, 0.0), links, ((-np.pi, np.pi),) * len(links), sign)
        for sign, links in ((-1, left_links), (1, right_links))
    ]
    return HandSpec(name, fingers[0], fingers[1], palm_width, **numbers)


def lab_limits(hand: HandSpec) -> HandSpec:
    """Return the hand with the laboratory's later joint limits, elbows outward, mirrored on the left finger.

    Proximal joints keep to +-1.57 rad, the others to 0 ... 2.09 rad of inward bend.
    """

    def limited(finger: FingerSpec) -> FingerSpec:
        bent = (0.0, 2.09) if finger.bend > 0 else (-2.09, 0.0)
        return replace(finger, limits=((-1.57, 1.57), *(bent,) * (len(finger.links) - 1)))

    return replace(hand, left=limited(hand.left), right=limited(hand.right))


def _check_positive(name: str, what: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"hand {name!r}: {what} is {1e3 * value:g} mm; it must be a positive length")
    check_length(f"hand {name!r}: {what}", value)


def _check_parts(name: str, side: str, finger: FingerSpec) -> None:
    """Refuse a finger without links, and limits, outlines and masses of another number or that no link has."""
    for what, parts in (("limits", finger.limits), ("outlines", finger.outlines), ("masses", finger.masses)):
        if parts is not None and len(parts) != len(finger.links):
            raise InputError(
                f"hand {name!r}: {len(parts)} {what} for the {len(finger.links)} links of the {side} finger; give one"
                f" for each link{', or None' if what != 'limits' else ''}"
            )
    if not finger.links or finger.bend not in {-1, 1}:
        raise InputError(
            f"hand {name!r}: the {side} finger has {len(finger.links)} links and bend {finger.bend}; give it a link or"
            " more, and bend -1 or 1"
        )
    for i, corners in enumerate(finger.outlines or ()):
        _check_outline(name, f"link {i} of the {side} finger", corners)
    for i, mass in enumerate(finger.masses or ()):
        if not (np.isfinite(mass) and mass > 0):
            raise InputError(
                f"hand {name!r}: link {i} of the {side} finger has a mass of {mass:g} kg; it must be positive"
            )
        check_mass(f"hand {name!r}: the mass of link {i} of the {side} finger", mass)


def _check_outline(name: str, what: str, corners: Corners) -> None:
    points = np.array(corners, dtype=float).reshape(-1, 2)
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    if not (len(points) > 2 and np.isfinite(points).all() and (cross(before, after) > 0).all()):
        raise InputError(
            f"hand {name!r}: the outline of {what} is not convex and counter-clockwise; give it three corners or more,"
            f" in that order [m], not {points.tolist()}"
        )
