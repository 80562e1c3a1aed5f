"""What files say of how a controller sees and acts: enough to refuse one that learned otherwise, and to say why."""

from dataclasses import dataclass, fields

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import HandSpec, build_hand, lab_limits
from inhand.tasks.decisions import Actions, largest_step
from inhand.tasks.layouts import find_layout
from inhand.tasks.observations import Layout, OfHand, numbers_for

NEW = "the scales of observations and the largest step of actions"
"""What format 2 of policies, datasets and runs has that format 1 had not."""
LARGEST_PART = 1000
"""Numbers of a part of an observation that no layout has."""
DIGITS = 9
"""Digits of a scale: what differs by less comes from the processor."""


@dataclass(frozen=True)
class PartCard:
    """What a file says of a part of an observation."""

    name: str
    """What its numbers are, and their unit before they are scaled."""
    fixed: int
    """How many they are with every hand, in the plane of as many fingers as `yardstick`,"""
    for_joint: int
    """how many more for each joint,"""
    scale: tuple[float, ...]
    """How far from the middle becomes 1, with the hand of `yardstick`."""
    middle: tuple[float, ...]
    """What becomes 0 with it."""
    for_finger: int = 0
    """And how many more they are for each finger of a hand in space, which may have any number."""

    def __post_init__(self) -> None:
        """Refuse a size that no part has, before anything of that size is made."""
        if not all(0 <= count <= LARGEST_PART for count in (self.fixed, self.for_joint, self.for_finger)):
            raise InputError(
                f"{self.name!r} has {self.fixed} numbers, {self.for_joint} for each joint and {self.for_finger} for"
                " each finger"
            )


@dataclass(frozen=True)
class InterfaceCard:
    """What a file says of how a learned controller sees and acts."""

    layout: str
    """Name of the layout of its observations, with its version."""
    parts: tuple[PartCard, ...]
    """Their parts in their order."""
    largest_step: float
    """What an action of 1 moves a joint target where actions are steps [rad]."""

    def size(self, n_joints: int, n_fingers: int = 0) -> int:
        """Return how many numbers an observation has with a hand of so many joints, and in space of so many fingers."""
        return sum(part.fixed + part.for_joint * n_joints + part.for_finger * n_fingers for part in self.parts)


def yardstick() -> HandSpec:
    """Return a made-up hand whose fingers all differ: scales that depend on a hand in another way differ with it."""
    return lab_limits(build_hand("yardstick", (0.045, 0.035), (0.055, 0.04), 0.062))


def interface_card(layout: Layout, actions: Actions = "steps") -> InterfaceCard:
    """Return the card of a controller that sees a layout and acts so."""
    hand = yardstick()

    def shown(given: OfHand) -> tuple[float, ...]:
        numbers: Array = np.atleast_1d(numbers_for(given, hand))
        return tuple(float(f"{number:.{DIGITS}g}") for number in numbers)

    count = 0 if layout.space else len(hand.fingers)
    parts = (
        PartCard(
            part.name,
            part.fixed + part.for_finger * count,
            part.for_joint,
            shown(part.half),
            shown(part.middle),
            part.for_finger if layout.space else 0,
        )
        for part in layout.parts
    )
    return InterfaceCard(layout.name, tuple(parts), largest_step(actions))


def differences(there: InterfaceCard, here: InterfaceCard) -> list[str]:
    """Return what differs between two cards, a text each; none where they are the same."""
    pairs = (("layout", there.layout, here.layout), ("largest step", there.largest_step, here.largest_step))
    found = [f"{name}: {one} there, {other} here" for name, one, other in pairs if one != other]
    old, new = ({part.name: part for part in card.parts} for card in (there, here))
    for name in {**old, **new}:
        if name in old and name in new:
            found += [f"{name}: {each}" for each in _changed(old[name], new[name])]
        else:
            found.append(f"{name}: {'there' if name in old else 'here'} alone")
    return found or ([] if there == here else ["the order of the observation's parts"])


def check_same(there: InterfaceCard, observation: str, actions: Actions) -> None:
    """Refuse what learned with another interface than this version's with observations and actions of those names.

    Raises:
        InputError: the text names what differs.
    """
    found = differences(there, interface_card(find_layout(observation), actions))
    if found:
        raise InputError(f"it learned with another interface than this version has: {'; '.join(found)}")


def _changed(there: PartCard, here: PartCard) -> list[str]:
    pairs = ((field.name, getattr(there, field.name), getattr(here, field.name)) for field in fields(PartCard))
    return [f"{name.replace('_', ' ')} {_shown(a)} there, {_shown(b)} here" for name, a, b in pairs if a != b]


def _shown(value: int | tuple[float, ...]) -> str:
    return str(value) if isinstance(value, int) else " ".join(f"{number:g}" for number in value)
