"""What a policy asks of a hand that runs it: the contract that its folder carries, and what is refused by it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias, get_type_hints

from inhand.errors import InputError
from inhand.hands.hand import HandSpec
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.pair import SpatialPair
from inhand.sim.disturbance import Camera, Commands, Disturbance, Encoders, told_value
from inhand.sim.scene import DECISION_S
from inhand.tasks.observations import by_rank

ANGLES = (
    "radians, counter-clockwise about +z (seen from above, palm at the bottom); 0 where a link points straight on from"
    " the one before it, of a first link straight away from the palm"
)
"""Zero and sense of rotation of every joint, encoders and commands alike (docs/frames.md)."""
SENSES = ("encoders", "camera", "commands")
"""Parts of a disturbance that a hand has too: how it senses, and how late commands are."""
ALIKE = 0.02
"""Rates that differ by a smaller share are the same: 29.97 frames a second are 30."""


@dataclass(frozen=True)
class Contract:
    """Hand, joints, rate and senses that a policy was trained with."""

    hand: HandSpec
    """The hand, with all its measures."""
    joints: tuple[str, ...]
    """Its joints in the order of encoders, targets and actions: the finger, and the number from the palm outwards."""
    observed: tuple[str, ...]
    """The same in the order in which parts of an observation that have a number for each joint tell them."""
    rate_hz: float
    """Decisions a second."""
    encoders: Encoders
    camera: Camera
    """Senses that it learned with, each delay as the range it was drawn from; a rate of 0 is one frame a decision."""
    commands: Commands
    """How late its commands arrived."""
    angles: str = ANGLES
    """Zero, sense of rotation and unit of every joint."""

    def __post_init__(self) -> None:
        """Refuse joints that its hand has not, and a rate that nothing has."""
        _check_own(self.hand, self.joints, self.rate_hz)


@dataclass(frozen=True)
class SpatialContract:
    """Hand in space, object, joints, rate and senses that a policy was trained with."""

    hand: SpatialHand
    """The hand, with all its measures."""
    object: SolidSpec
    """What it held."""
    joints: tuple[str, ...]
    """Its joints in the order of targets and actions: the finger, and the number from the palm outwards."""
    rate_hz: float
    """Decisions a second."""
    observed: tuple[str, ...] = ()
    """The same in the order in which parts of an observation with a history tell them; empty where none has one."""
    encoders: Encoders = field(default_factory=Encoders)
    camera: Camera = field(default_factory=Camera)
    """Senses that it learned with, as in `Contract`; exact where it learned on the true state of the worlds."""
    commands: Commands = field(default_factory=Commands)
    """How late its commands arrived."""

    def __post_init__(self) -> None:
        """Refuse joints that its hand has not, and a rate that nothing has."""
        _check_own(self.hand, self.joints, self.rate_hz)


AnyContract: TypeAlias = Contract | SpatialContract
"""What a policy asks of a hand, in the plane or in space."""


def _check_own(hand: HandSpec | SpatialHand, joints: tuple[str, ...], rate_hz: float) -> None:
    if joints != joint_names(hand):
        raise InputError(f"joints are {', '.join(joints)}; hand {hand.name!r} has others")
    if not 0.0 < rate_hz < float("inf"):
        raise InputError(f"rate_hz is {rate_hz:g}; it must be a positive number of decisions a second")


def joint_names(hand: HandSpec | SpatialHand) -> tuple[str, ...]:
    """Return the joints of a hand in the order of every array: `left 0`, `left 1` and so on."""
    named = zip(hand.finger_names, hand.slices, strict=True)
    return tuple(f"{name} {number}" for name, place in named for number in range(place.stop - place.start))


def contract_in_space(held: SpatialPair, disturb: Disturbance | None = None) -> SpatialContract:
    """Return the contract of what is trained with a hand in space, in worlds that something may disturb."""
    names, senses = joint_names(held.hand), senses_of(disturb or Disturbance())
    observed = () if disturb is None else tuple(names[joint] for joint in by_rank(held.hand))
    return SpatialContract(held.hand, held.object, names, rate_of(DECISION_S), observed, *senses)


def contract_of(hand: HandSpec, disturb: Disturbance | None) -> Contract:
    """Return the contract of what is trained with a hand, in worlds that something disturbs or nothing does."""
    names, seen = joint_names(hand), disturb or Disturbance()
    observed = tuple(names[joint] for joint in by_rank(hand))
    return Contract(hand, names, observed, rate_of(DECISION_S), *senses_of(seen))


def senses_of(disturb: Disturbance) -> tuple[Encoders, Camera, Commands]:
    """Return the senses of a disturbance, and how late its commands are."""
    return disturb.encoders, disturb.camera, disturb.commands


def rate_of(period: float) -> float:
    """Return the decisions in a second that are a period [s] apart, without the last digits of the division."""
    return round(1.0 / period, 6)


def check_rate(contract: Contract, period: float) -> None:
    """Refuse to decide at another rate than was learned with.

    Raises:
        InputError: the text has both rates.
    """
    rate = rate_of(period)
    if abs(rate - contract.rate_hz) > ALIKE * contract.rate_hz:
        raise InputError(
            f"the policy was trained with {contract.rate_hz:g} decisions a second and here would make {rate:g}: run it"
            " at its own rate, or train one at this"
        )


def check_senses(contract: Contract, senses: Disturbance) -> None:
    """Refuse a hand that senses, or obeys, worse than a policy has learned to stand.

    Raises:
        InputError: the text names every quantity, with what was trained and what is here.
    """
    found = list(other_senses(contract, senses))
    if found:
        raise InputError(
            f"the policy was trained with other senses than {senses.name!r} has: {'; '.join(found)}. Train one with"
            " this hand's senses (inhand train --disturb FILE.toml), or mend the hand's"
        )


def other_senses(contract: AnyContract, senses: Disturbance) -> Iterator[str]:
    """Give what a policy has not learned to stand of senses, each quantity with both values.

    Delays are to lie within the range that was trained, rates to be the same; all else may not be worse.
    """
    for part, here in zip(SENSES, senses_of(senses), strict=True):
        there = getattr(contract, part)
        for name in get_type_hints(type(here)):
            old, new = (getattr(each, name) for each in (there, here))
            if name == "rate_hz":
                old, new = (rate or contract.rate_hz for rate in (old, new))
                fine = abs(new - old) <= ALIKE * old
            elif name == "missing_run":
                fine = not senses.camera.missing or new[1] <= old[1]
            elif isinstance(old, tuple):
                fine = old[0] <= new[0] and new[1] <= old[1]
            else:
                fine = new <= old
            if not fine:
                yield f"{part}.{name} {told_value(old)} there, {told_value(new)} here"
