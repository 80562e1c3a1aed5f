"""Which hands and objects laws of both are tried with."""

import pytest

from inhand.hands.names import CATALOGUE
from inhand.hands.objects import CATALOGUE as OBJECTS

every_fourth_pair = pytest.mark.parametrize(
    ("hand_name", "spec"),
    [
        pytest.param(hand, spec, id=f"{hand}-{spec.name}")
        for i, hand in enumerate(CATALOGUE)
        for j, spec in enumerate(OBJECTS.values())
        if (i + j) % 4 == 0
    ],
)
"""A fourth of all pairs of the catalogues: every hand with every fourth object, every object with some hand."""
