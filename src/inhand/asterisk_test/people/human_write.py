"""Simulated trials as recordings: CSV files of the Asterisk Test's own form, which its software and our reader read.

The form is that of 2021: SUBJECT_HAND_DIRECTION_TWIST_TRIAL.csv with the columns frame, x, y (mm) and rmag (degrees,
a size). The subject is the controller. x and y are in the palm's axes from the first row; those of people are in the
axes of the moving object, which for an object that is held upright are the same.
"""

import csv
import re
from pathlib import Path

import numpy as np

from inhand.asterisk_test.people.human_rows import FRAME, MOST_ROWS, REQUIRED
from inhand.asterisk_test.people.human_units import SMALLEST_MM
from inhand.control.trial import Trial
from inhand.errors import InputError
from inhand.folders import in_place
from inhand.tasks.directions import DIRECTIONS, ROTATIONS, TWISTS_DEG

WORDS = {angle: word for word, angle in reversed(TWISTS_DEG.items())}
"""The shortest word of each twist that recordings know."""


def recording_name(trial: Trial) -> str:
    """Return the name of a trial's file.

    Raises:
        InputError: a direction or a twist that recordings have no word for.
    """
    passport = trial.passport
    hand = "v".join(str(len(finger.links)) for finger in passport.hand.fingers)
    subject = re.sub(r"[^0-9A-Za-z]+", "-", passport.controller).strip("-") or "controller"
    if passport.angle_deg is None and passport.primitive in ROTATIONS:
        return f"{subject}_{hand}_n_{passport.primitive}_{passport.trial}.csv"
    letter = next((each.letter for each in DIRECTIONS if each.angle_deg == passport.angle_deg), None)
    word = WORDS.get(passport.rotation_deg)
    if letter is None or word is None:
        known = f"{', '.join(each.name for each in DIRECTIONS)}, held at 0, -15 or 15 deg, and cw and ccw"
        raise InputError(f"recordings of the Asterisk Test have no word for {passport.primitive}; they know {known}")
    return f"{subject}_{hand}_{letter}_{word}_{passport.trial}.csv"


def write_recording(trial: Trial, folder: Path) -> Path:
    """Write the manipulation of a trial as a recording into a folder, and return its file.

    Every row of the trial is a frame, so that frames are 20 ms apart where a camera's are nominally 33; numbers have
    all their digits.

    Raises:
        InputError: a direction that recordings have no word for, or a trial that is too long for one or moves too
            little for its unit to be told.
    """
    name = recording_name(trial)
    path, rotation, _ = trial.manipulated_path()
    which = f"{trial.passport.primitive}, trial {trial.passport.trial}"
    if len(path) > MOST_ROWS:
        raise InputError(f"{which}, has {len(path)} rows; a recording has at most {MOST_ROWS}")
    if 0.0 < np.abs(path).max() < SMALLEST_MM:
        raise InputError(
            f"{which}, moves {np.abs(path).max():.2g} mm: of a recording that never leaves {SMALLEST_MM:g} mm nobody"
            " could tell the unit"
        )
    rows = zip(*path.T.tolist(), np.abs(rotation).tolist(), strict=True)
    with in_place(folder / name) as part, part.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow((FRAME, *REQUIRED))
        table.writerows((number, *map(repr, row)) for number, row in enumerate(rows))
    return folder / name
