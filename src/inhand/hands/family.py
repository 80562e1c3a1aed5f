"""A family of hands: all of the laboratory's form whose numbers lie between bounds."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Literal, TypeAlias

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import FINGER_NAMES, HandSpec, build_hand, lab_limits
from inhand.hands.names import FINGER_LENGTH

Span: TypeAlias = tuple[float, float]
"""Lowest and highest value."""
Form: TypeAlias = Literal["2v2", "2v3", "3v2", "3v3"]
"""Numbers of links of the left and the right finger."""
Limits: TypeAlias = Literal["free", "lab"]
"""Joint limits: none but bodies, or the laboratory's."""

SIZES = ("palm_width", "link_width", "tip_length")
DIMENSIONS = (*(f"{side}_{what}" for side in FINGER_NAMES for what in ("length", "first", "second")), *SIZES)
"""What hands of one form and kind of limits differ in: length of each finger, shares of its first and second link."""
STEP_MM = 0.1
"""Lengths are whole numbers of it, as a drawing for a workshop has them."""
SPARE = 0.002
"""What a last link has besides joint gap and cap, at least [m]."""
SAME = 1e-6
"""Hands whose lengths differ by less are one [m]."""


@dataclass(frozen=True)
class HandFamily:
    """Bounds of hands; the defaults are the laboratory's range, link width and tip length about its one value."""

    forms: tuple[Form, ...] = ("2v2", "2v3", "3v3")
    """Numbers of links."""
    finger: Span = (0.8 * FINGER_LENGTH, FINGER_LENGTH)
    """Length of each finger [m]."""
    share: Span = (0.2, 0.75)
    """Share of every link in the length of its finger."""
    palm_width: Span = (0.04, 0.08)
    """Distance between the proximal joints [m]."""
    link_width: Span = (0.014, 0.026)
    """Width of the links in the plane [m]."""
    tip_length: Span = (0.004, 0.011)
    """Length of the fingertip's cap [m]."""
    limits: tuple[Limits, ...] = ("free",)
    """Joint limits."""
    alike: bool = False
    """Whether both fingers are mirror images; forms of unlike fingers then have none."""

    def __post_init__(self) -> None:
        """Refuse bounds between which there is no hand."""
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in {"forms", "limits"} and not value:
                raise InputError(f"{field.name} of a family of hands names none: give at least one")
            if field.type is Span and not 0 < value[0] <= value[1]:
                raise InputError(
                    f"{field.name} of a family of hands is {value[0]:g} to {value[1]:g}: give a lowest value above 0,"
                    " and a highest that is no lower"
                )
        for form in self.forms:
            for side, links in zip(FINGER_NAMES, _links(form), strict=True):
                if not links * self.share[0] <= 1 + SAME or not links * self.share[1] >= 1 - SAME:
                    raise InputError(
                        f"no {links} links of the {side} finger of {form} have shares of {self.share[0]:g} to"
                        f" {self.share[1]:g} that sum to 1: the lowest is at most {1 / links:.3f}, the highest at least"
                    )
            if self.alike and len(set(_links(form))) > 1:
                raise InputError(f"fingers of {form} cannot be alike: leave the form out, or let them differ")

        shortest, least = self.share[0] * self.finger[0], HandSpec.joint_gap + self.tip_length[1] + SPARE
        if shortest < least:
            raise InputError(
                f"a link may be {1e3 * shortest:.1f} mm long, a share of {self.share[0]:g} of a finger of"
                f" {1e3 * self.finger[0]:g} mm; a last link needs {1e3 * least:.1f} mm for its joint gap and its cap"
            )

    def dimensions(self) -> tuple[str, ...]:
        """Return the `DIMENSIONS` in which its hands can differ."""
        three = [3 in links for links in zip(*map(_links, self.forms), strict=True)]
        unused = {f"{side}_second" for side, used in zip(FINGER_NAMES, three, strict=True) if not used}
        if self.alike:
            unused |= {name for name in DIMENSIONS if name.startswith(FINGER_NAMES[1])}
        if self.finger[0] == self.finger[1]:
            unused |= {f"{side}_length" for side in FINGER_NAMES}
        unused |= {name for name in SIZES if getattr(self, name)[0] == getattr(self, name)[1]}
        return tuple(name for name in DIMENSIONS if name not in unused)

    def hand(self, name: str, form: Form, limits: Limits, places: Mapping[str, float]) -> HandSpec:
        """Return a hand.

        Args:
            name: what to call it.
            form: its numbers of links.
            limits: its joint limits.
            places: for each of `dimensions`, where it stands between its bounds, 0 to 1; the lowest where not given.
        """
        fingers = []
        for side, links in zip(FINGER_NAMES, _links(form), strict=True):
            own = FINGER_NAMES[0] if self.alike else side
            length = _between(self.finger, places.get(f"{own}_length", 0.0))
            fingers.append(self._links_of(length, links, [places.get(f"{own}_{k}", 0.0) for k in ("first", "second")]))
        sizes = {what: _rounded(_between(getattr(self, what), places.get(what, 0.0))) for what in SIZES}
        hand = build_hand(name, fingers[0], fingers[1], **sizes)
        return lab_limits(hand) if limits == "lab" else hand

    def drawn(self, name: str, rng: np.random.Generator) -> HandSpec:
        """Return a hand drawn evenly between the bounds."""
        form = self.forms[rng.integers(len(self.forms))]
        limits = self.limits[rng.integers(len(self.limits))]
        return self.hand(name, form, limits, dict(zip(DIMENSIONS, rng.random(len(DIMENSIONS)).tolist(), strict=True)))

    def places(self, hand: HandSpec) -> tuple[Form, Limits, dict[str, float]] | None:
        """Return what `hand` makes a hand's equal of; None where the family has none."""
        form, limits = next((f for f in self.forms if _links(f) == _counts(hand)), None), _limits_of(hand)
        if form is None or limits not in self.limits:
            return None
        found = {what: _place(getattr(self, what), getattr(hand, what)) for what in SIZES}
        for side, finger in zip(FINGER_NAMES, hand.fingers, strict=True):
            found[f"{side}_length"] = _place(self.finger, finger.length)
            for k, what in enumerate(("first", "second")[: len(finger.links) - 1]):
                span = self._shares(len(finger.links) - k, sum(finger.links[:k]) / finger.length)
                found[f"{side}_{what}"] = _place(span, finger.links[k] / finger.length)
        made = self.hand(hand.name, form, limits, {name: min(max(at, 0.0), 1.0) for name, at in found.items()})
        return (form, limits, {name: found.get(name, 0.5) for name in self.dimensions()}) if _same(made, hand) else None

    def _links_of(self, length: float, links: int, places: list[float]) -> tuple[float, ...]:
        """Return the link lengths of a finger [m]: the last has what the others leave."""
        found: list[float] = []
        total, taken = _rounded(length), 0.0
        for k in range(links - 1):
            share = _between(self._shares(links - k, taken), places[k])
            taken += share
            found.append(_rounded(share * total))
        return (*found, _rounded(total - sum(found)))

    def _shares(self, left: int, taken: float) -> Span:
        """Return the bounds of a link's share where so many links are left, and shares are taken by those before."""
        low, high = self.share
        return max(low, 1 - taken - (left - 1) * high), min(high, 1 - taken - (left - 1) * low)


def _links(form: str) -> tuple[int, ...]:
    return tuple(map(int, form.split("v")))


def _counts(hand: HandSpec) -> tuple[int, ...]:
    return tuple(len(finger.links) for finger in hand.fingers)


def _limits_of(hand: HandSpec) -> Limits:
    """Return which limits a hand's are nearer to; `places` compares them."""
    return "free" if (np.abs(hand.limits) == np.pi).all() else "lab"


def _between(span: Span, place: float) -> float:
    return span[0] + place * (span[1] - span[0])


def _place(span: Span, value: float) -> float:
    """Return where a value stands between bounds, 0 to 1 if it does."""
    wide = span[1] - span[0]
    return float(np.clip((value - span[0]) / wide, -1.0, 2.0)) if wide > SAME else 0.0


def _rounded(length: float) -> float:
    """Return a length in whole steps [m], the very number that a file in mm gives."""
    return round(round(1e3 * length / STEP_MM) * STEP_MM, 1) / 1e3


def _numbers(hand: HandSpec) -> Array:
    return np.concatenate([*(f.links for f in hand.fingers), [getattr(hand, what) for what in SIZES]])


def _same(one: HandSpec, other: HandSpec) -> bool:
    return np.abs(_numbers(one) - _numbers(other)).max() < 1.5 * STEP_MM / 1e3 and np.array_equal(
        one.limits, other.limits
    )
