"""A family of pairs of a hand and an object: what one policy is for, what it is never shown, and what is outside."""

from dataclasses import dataclass, field, fields, replace

import numpy as np

from inhand.errors import InputError
from inhand.hands.family import SIZES, STEP_MM, HandFamily, Span
from inhand.hands.fit import Held, check_fit
from inhand.hands.hand import FINGER_NAMES, FingerSpec, HandSpec, lab_limits
from inhand.hands.object_family import ObjectFamily
from inhand.hands.objects import polygon

ROUNDING = 2 * STEP_MM / 1e3
"""Lengths that are outside by less are not [m]: links are rounded to whole steps."""
TRIES = 20
"""Draws of a pair of which one is to fit."""


@dataclass(frozen=True)
class Gains:
    """Bounds of what a hand has beside its shape."""

    stiffness: Span = (3.5, 7.0)
    """Of the position servos [N m/rad]."""
    damping: Span = (0.1, 0.2)
    """Of the joints [N m s/rad]."""
    friction: Span = (0.4, 0.6)
    """Of the fingers."""

    def drawn(self, hand: HandSpec, rng: np.random.Generator) -> HandSpec:
        """Return a hand with drawn gains."""
        stiffness, damping, friction = (float(rng.uniform(*getattr(self, each.name))) for each in fields(Gains))
        return replace(hand, stiffness=stiffness, damping=damping, friction=friction)


@dataclass(frozen=True)
class PairFamily:
    """Hands of the laboratory's form, objects for them, and regions of both that are kept for tests."""

    hands: HandFamily = field(default_factory=lambda: HandFamily(limits=("free", "lab")))
    """The hands."""
    objects: ObjectFamily = field(default_factory=ObjectFamily)
    """The objects."""
    gains: Gains = field(default_factory=Gains)
    """The hands' servos and friction."""
    palm_kept: Span = (0.060, 0.066)
    """Palm widths of which no hand is drawn [m]."""
    size_kept: Span = (0.0395, 0.0425)
    """Longer sides of which no object is drawn [m]."""

    def drawn(self, rng: np.random.Generator, number: int) -> Held:
        """Return a hand and an object that it can take in, drawn evenly outside of the regions that are kept.

        Raises:
            InputError: of many pairs none fits.
        """
        why = ""
        for _ in range(TRIES):
            hand, spec = self.hands.drawn(f"drawn {number}", rng), self.objects.drawn(f"drawn {number}", rng)
            held = Held(self.gains.drawn(hand, rng), spec)
            if self.kept(held):
                continue
            try:
                check_fit(*held)
            except InputError as error:
                why = str(error)
                continue
            return held
        raise InputError(f"of {TRIES} hands and objects of the family none fit each other; of the last {why}")

    def kept(self, held: Held) -> bool:
        """Return whether a hand or an object lies in a region that is kept for tests."""
        longer = float(np.ptp(polygon(held.object), axis=0).max())
        return _within(held.hand.palm_width, self.palm_kept) or _within(longer, self.size_kept)

    def outside(self, held: Held) -> str | None:
        """Return which number of a hand or an object lies outside, with the family's bounds; None where none does."""
        why = self.hand_outside(held.hand)
        if why is not None:
            return f"hand {held.hand.name!r} is outside of the policy's family: {why}"
        why = self.objects.outside(held.object)
        return None if why is None else f"object {held.object.name!r} is outside of the policy's family: {why}"

    def hand_outside(self, hand: HandSpec) -> str | None:
        """Return which number of a hand lies outside; None where none does.

        The mirror image of a form is inside, though none is drawn: a finger of 2v3 on the other side.
        """
        form = "v".join(str(len(finger.links)) for finger in hand.fingers)
        if not {form, form[::-1]} & set(self.hands.forms):
            return f"its links are {form}, the family's {', '.join(self.hands.forms)} and what these are in a mirror"
        if hand.palm is not None or any(finger.outlines for finger in hand.fingers):
            return "its links or its palm have outlines of their own, the family's hands the laboratory's form"
        for side, finger in zip(FINGER_NAMES, hand.fingers, strict=True):
            why = self._finger_outside(side, finger)
            if why is not None:
                return why
        for what in SIZES:
            bounds, value = getattr(self.hands, what), getattr(hand, what)
            if not _within(value, bounds, ROUNDING):
                return f"its {what.replace('_', ' ')} is {_mm(value)} mm, the family's {_mm(*bounds)} mm"
        for each in fields(Gains):
            bounds, value = getattr(self.gains, each.name), getattr(hand, each.name)
            if not _within(value, bounds, 1e-9):
                return f"its {each.name} is {value:g}, the family's {bounds[0]:g} to {bounds[1]:g}"
        return self._limits_outside(hand)

    def _finger_outside(self, side: str, finger: FingerSpec) -> str | None:
        if not _within(finger.length, self.hands.finger, ROUNDING):
            return f"its {side} finger is {_mm(finger.length)} mm long, the family's {_mm(*self.hands.finger)} mm"
        for number, link in enumerate(finger.links):
            share = link / finger.length
            if not _within(share, self.hands.share, ROUNDING / finger.length):
                low, high = self.hands.share
                return (
                    f"link {number} of its {side} finger has a share of {share:.2f}, the family's {low:g} to {high:g}"
                )
        return None

    def _limits_outside(self, hand: HandSpec) -> str | None:
        known = {"free": np.full(hand.limits.shape, np.pi) * (-1.0, 1.0), "lab": lab_limits(hand).limits}
        if any(np.allclose(hand.limits, known[name]) for name in self.hands.limits):
            return None
        given = ", ".join(f"{low:.0f} to {high:.0f}" for low, high in np.rad2deg(hand.limits))
        return f"its joint limits are {given} deg, the family's {' or '.join(self.hands.limits)} (the laboratory's)"


def _within(value: float, bounds: Span, room: float = 0.0) -> bool:
    return bounds[0] - room <= value <= bounds[1] + room


def _mm(*lengths: float) -> str:
    return " to ".join(f"{1e3 * length:.4g}" for length in lengths)


HELD_OUT_HANDS = (
    "2v2_50.50_50.50_1.1_53",
    "2v2_50.50_50.50_1.1_53:lab-limits",
    "2v2_65.35_65.35_1.1_63",
    "2v2_35.65_50.50_1.1_63",
    "2v2_70.30_50.50_0.9.1_53",
    "2v2_50.50_50.50_0.8.1_63",
    "2v2_40.60_45.55_0.9.0.9_64:lab-limits",
    "2v3_25.75_25.35.40_1.1_53",
    "2v3_50.50_40.30.30_1.1_63",
    "2v3_60.40_35.35.30_0.9.1_65:lab-limits",
    "3v3_25.40.35_40.35.25_1.1_63",
    "3v3_40.30.30_40.30.30_1.1_53",
)
"""Hands that a policy of the family is tested with: by name, and seven of them of a palm of which none is drawn."""
HELD_OUT_OBJECTS = (
    "cube_39",
    "rectangle_33x22",
    "cylinder_40",
    "ellipse_42x30",
    "box_30x41",
    "triangle",
    "teardrop",
    "pentagon",
    "trapezoid",
    "hourglass",
)
"""Objects that it is tested with: three forms that are never drawn, and four of a size of which none is drawn."""
