"""Which hands and objects laws of both are tried with."""

from collections.abc import Mapping, Sequence

import pytest

from inhand.hands.names import CATALOGUE
from inhand.hands.objects import CATALOGUE as OBJECTS
from inhand.hands.objects import ObjectSpec


def third(hands: Sequence[str], objects: Mapping[str, ObjectSpec]) -> list[tuple[str, str]]:
    """Return a third of all pairs: every hand with every third object, every object with two hands or three."""
    return [(hand, name) for i, hand in enumerate(hands) for j, name in enumerate(objects) if (i + j) % 3 == 0]


every_third_pair = pytest.mark.parametrize(
    ("hand_name", "spec"),
    [pytest.param(hand, OBJECTS[name], id=f"{hand}-{name}") for hand, name in third(CATALOGUE, OBJECTS)],
)
"""All hands and all objects of the catalogues, a third of their pairs."""
