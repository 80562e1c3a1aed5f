"""Whether a hand in space can hold an object at all: its size, its weight, and an engine that has three dimensions."""

from inhand.control.spatial_ik import SpatialIkConfig
from inhand.errors import InputError
from inhand.hands.spatial.fit import check_solid_fit
from inhand.hands.spatial.gravity import GRAVITY
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.sim.engines import engine_in_space

LEVER = 0.5
"""Share of the fingers' length at which a grip acts at least, guessed."""


def check_carried(hand: SpatialHand, spec: SolidSpec, engine: str) -> None:
    """Refuse an engine without a third dimension, and an object that the hand cannot hold.

    Raises:
        InputError: the text names the engine, or the measure or weight and the most that there may be.
    """
    engine_in_space(engine)
    check_solid_fit(hand, spec)
    check_weight(hand, spec)


def check_weight(hand: SpatialHand, spec: SolidSpec) -> None:
    """Refuse an object that needs a grip which the motors cannot give on half of the fingers' length.

    Raises:
        InputError: the text gives the most that they can hold.
    """
    config = SpatialIkConfig()
    strongest = hand.torque / (LEVER * hand.finger_length)
    most = (config.weight + (strongest - config.grip) / config.growth) / GRAVITY
    if spec.mass > most:
        raise InputError(
            f"object {spec.name!r} weighs {1e3 * spec.mass:g} g; the motors of {hand.name!r}, {hand.torque:g} N m, hold"
            f" at most {1e3 * max(most, 0.0):.0f} g: use a lighter object or stronger motors"
        )
