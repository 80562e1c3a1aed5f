"""Units of recorded files: what each form of name and columns means, and what is impossible in it."""

from dataclasses import dataclass

import numpy as np

from inhand.asterisk_test.people.hand_sizes import hand_size_mm
from inhand.asterisk_test.people.human_names import HumanName
from inhand.columns import Columns
from inhand.errors import InputError
from inhand.geometry import Array

CAMERA_COLUMNS = frozenset({"pitch", "roll", "tmag", "yaw", "z"})
"""Columns that raw camera files have beside `frame`, `x`, `y` and `rmag`."""
LARGEST_MM = 400.0
"""No hand of the test moves an object further [mm]; guessed, twice the widest fingers' reach."""
LARGEST_DEG = 360.0
"""No person turns an object in the hand by more than a full turn [deg]."""
SMALLEST_MM = 1.0
"""Jitter of the camera [mm]: a recording in mm that moved, but never this far, is in another unit."""


@dataclass(frozen=True, eq=False)
class Unit:
    """The unit of one file."""

    text: str
    """The assumption in words."""
    to_mm: Array
    """Factors `(2,)` from the file's x and y to mm."""
    rotation_usable: bool = True
    """Whether the rotation column holds degrees."""
    simulated: bool = False
    """Whether a simulator wrote the file, which has no jitter."""


def unit_of(file_name: str, name: HumanName, columns: tuple[str, ...]) -> Unit:
    """Return the unit of a file from the form of its name and its columns.

    Raises:
        InputError: a hand of 2020 without a known size, or some but not all columns of a camera file.
    """
    camera = CAMERA_COLUMNS.intersection(columns)
    if name.year == "thesis IK":
        return Unit("metres, rotation column unusable", np.full(2, 1000.0), rotation_usable=False, simulated=True)
    if name.year == "2020":
        try:
            size = hand_size_mm(name.hand)
        except InputError as error:
            raise InputError(f"{file_name}: recordings of 2020 are divided by the hand's size, and {error}") from error
        return Unit(f"normalised by {size[0]:g} x {size[1]:g} mm, degrees", np.array(size))
    if camera and camera != CAMERA_COLUMNS:
        raise InputError(
            f"{file_name}, line 1: the unit of this file is unknown: it has the camera column"
            f" {', '.join(sorted(camera))} but not {', '.join(sorted(CAMERA_COLUMNS - camera))}; a raw camera file"
            " (metres) has all of them, a converted file (mm) none"
        )
    return Unit("metres, degrees", np.full(2, 1000.0)) if camera else Unit("mm, degrees", np.ones(2))


def check_unit(file_name: str, rows: Columns, unit: Unit) -> None:
    """Refuse values that cannot be in the unit assumed.

    Raises:
        InputError: a position or rotation too large for any hand, a negative size of rotation, or a path in mm
            that never leaves the jitter.
    """
    with np.errstate(over="ignore"):  # what overflows is refused below
        place = np.max(np.abs(np.column_stack([rows.columns["x"], rows.columns["y"]]) * unit.to_mm), axis=1)
    _refuse_above(file_name, rows, place, LARGEST_MM, f"mm from the start, read as {unit.text}")
    if unit.rotation_usable:
        turn = np.abs(rows.columns["rmag"])
        _refuse_above(file_name, rows, turn, LARGEST_DEG, f"degrees of rotation, read as {unit.text}")
        if rows.columns["rmag"].min() < 0.0:
            line = rows.lines[int(np.argmin(rows.columns["rmag"]))]
            raise InputError(
                f"{file_name}, line {line}: column rmag is negative, but recordings hold the size of the rotation"
                " and the label its sign; write sizes into rmag"
            )
    if unit.text.startswith("mm") and 0.0 < place.max() < SMALLEST_MM:
        raise InputError(
            f"{file_name}: the unit of this file is unknown: its name says mm, but the object never moves further"
            f" than {place.max():.3g}; if the values are divided by the hand's size, name the file"
            " filt_SUBJECT_HAND_DIRECTION_TWIST_TRIAL.csv, if they are metres, convert them to mm"
        )


def _refuse_above(file_name: str, rows: Columns, values: Array, largest: float, what: str) -> None:
    worst = int(np.argmax(values))
    if values[worst] > largest:
        raise InputError(
            f"{file_name}, line {rows.lines[worst]}: {values[worst]:.4g} {what}; at most {largest:g} is plausible."
            " Check the unit of the file against the form of its name"
        )
