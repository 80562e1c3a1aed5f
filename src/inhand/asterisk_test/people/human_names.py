"""File names of recorded trials: who moved which hand in which direction, and from which year the form is."""

from dataclasses import dataclass
from typing import Literal

from inhand.asterisk_test.people.hand_sizes import HAND_SIZES_MM
from inhand.errors import InputError
from inhand.tasks.directions import DIRECTIONS, ROTATIONS, TWISTS_DEG, Direction, find_direction

Year = Literal["2020", "2021", "2022", "thesis IK"]

FORMS = (
    "filt_SUBJECT_HAND_DIRECTION_TWIST_TRIAL.csv (2020), SUBJECT_HAND_DIRECTION_TWIST_TRIAL.csv (2021),"
    " HAND_DIRECTION_TWIST_SUBJECT_TRIAL.csv (2022) or controllerhuman…_2v2_DIRECTION_n_1.csv (the thesis's"
    " controller)"
)
WORDS = (
    f"DIRECTION is one of {' '.join(each.letter for each in DIRECTIONS)} or"
    f" {' '.join(each.compass for each in DIRECTIONS)}, TWIST one of {' '.join(TWISTS_DEG)}; a trial that only"
    f" rotates has DIRECTION n and TWIST one of {' '.join(ROTATIONS)} (2020: DIRECTION cw or ccw and TWIST none)"
)


@dataclass(frozen=True)
class HumanName:
    """What the name of a recorded file says."""

    year: Year
    """The form of the name, which tells the unit of the file."""
    subject: str
    """The person, or the controller."""
    hand: str
    """Name of the hand, lower case."""
    direction: Direction | None
    """Where to, or None for a trial that only rotates."""
    rotation: str | None
    """`cw` or `ccw` for a trial that only rotates, otherwise None."""
    twist_deg: float
    """Rotation to hold while translating, counter-clockwise [deg]: 0, -15 (p15) or 15 (m15)."""
    trial: int


def parse_human_name(file_name: str) -> HumanName:
    """Return what the name of a recorded file says, with or without its suffix `.csv`.

    Raises:
        InputError: the name has none of the known forms, so the unit of the file is unknown.
    """
    parts = file_name.removesuffix(".csv").removesuffix(".CSV").split("_")
    readings = [each for each in _readings(parts) if each is not None]
    if len(readings) > 1:
        readings = [each for each in readings if each.hand in HAND_SIZES_MM]
    if len(readings) != 1:
        raise InputError(
            f"{file_name}: the unit of this file is unknown, because its name has not exactly one reading among"
            f" {FORMS}. {WORDS}. Rename the file to the form of the year it was recorded in"
        )
    return readings[0]


def _readings(parts: list[str]) -> list[HumanName | None]:
    """Return one reading, or None, for each form that fits the number of parts."""
    match parts:
        case ["filt", subject, hand, direction, twist, trial]:
            return [_read("2020", subject, hand, (direction, twist), trial)]
        case [first, second, third, fourth, trial]:
            controller = first.lower().startswith("controllerhuman")
            return [
                _read("thesis IK" if controller else "2021", first, second, (third, fourth), trial),
                _read("2022", fourth, first, (second, third), trial),
            ]
        case _:
            return []


def _read(year: Year, subject: str, hand: str, words: tuple[str, str], trial: str) -> HumanName | None:
    """Return the reading of one form, or None where a word does not fit it."""
    if not (trial.isascii() and trial.isdigit() and subject and hand):
        return None
    where, turn = words[0].lower(), words[1].lower()
    direction = find_direction(where)
    if direction is not None and turn in TWISTS_DEG:
        return HumanName(year, subject, hand.lower(), direction, None, TWISTS_DEG[turn], int(trial))
    if where in TWISTS_DEG and TWISTS_DEG[where] == 0.0 and turn in ROTATIONS:
        return HumanName(year, subject, hand.lower(), None, ROTATIONS[turn], 0.0, int(trial))
    if year == "2020" and where in ROTATIONS and turn in TWISTS_DEG:
        return HumanName(year, subject, hand.lower(), None, ROTATIONS[where], 0.0, int(trial))
    return None
