"""Direction and rotation words of the Asterisk Test, as recorded files spell them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Direction:
    """One of the eight directions of the Asterisk Test."""

    letter: str
    """Label of the recordings up to 2021, `a` to `h`."""
    compass: str
    """Label of the later recordings, `no` to `nw`."""
    name: str
    """Name in the thesis."""
    angle_deg: float
    """Angle counter-clockwise from +x, palm at the bottom [deg]."""


DIRECTIONS = (
    Direction("a", "no", "Out", 90.0),
    Direction("b", "ne", "Out-Right", 45.0),
    Direction("c", "ea", "Right", 0.0),
    Direction("d", "se", "In-Right", -45.0),
    Direction("e", "so", "In", -90.0),
    Direction("f", "sw", "In-Left", -135.0),
    Direction("g", "we", "Left", 180.0),
    Direction("h", "nw", "Out-Left", 135.0),
)
"""Clockwise from Out, the order of the thesis."""

UNSEEN_NAMES = ("Out'", "Out'-Right'", "Right'", "In'-Right'", "In'", "In'-Left'", "Left'", "Out'-Left'")
"""Names of the eight directions between, at 67.5 - 45 i degrees (thesis 3.3)."""

TWISTS_DEG = {"n": 0.0, "x": 0.0, "none": 0.0, "p15": -15.0, "plus15": -15.0, "m15": 15.0, "minus15": 15.0}
"""Rotation held while translating, counter-clockwise [deg]: the recordings count clockwise twists as plus."""

ROTATIONS = {"cw": "cw", "pp": "cw", "ccw": "ccw", "mm": "ccw"}
"""Words of the trials that only rotate, and which way they go seen from above."""

ROTATION_SIGNS = {"cw": -1.0, "ccw": 1.0}
"""Mathematical sign of each way."""


def find_direction(word: str) -> Direction | None:
    """Return the direction that `word` labels (`c` or `ea`, any case), or None."""
    return next((each for each in DIRECTIONS if word.lower() in (each.letter, each.compass)), None)
