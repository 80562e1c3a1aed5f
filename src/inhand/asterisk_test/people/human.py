"""Recorded trials of the Asterisk Test: people's, and the thesis author's controller in the same files.

Millimetres and degrees, the units of the recordings. Three traps that no reader can undo: x and y are written in
the frame of the moving object, so distance along a direction is good to about 3 mm and the lateral part is
uncertain by up to 14 mm; there are no time stamps, so speeds mean nothing; and some paths wander, so follow
`inhand.asterisk_test.people.paths.human_path` instead of single rows.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from inhand.asterisk_test.people.duplicates import leave_out_duplicates
from inhand.asterisk_test.people.human_filter import smooth
from inhand.asterisk_test.people.human_names import HumanName, parse_human_name
from inhand.asterisk_test.people.human_rows import Gaps, read_rows
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.people.human_units import Unit, check_unit, unit_of
from inhand.columns import Columns
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.tasks.directions import ROTATION_SIGNS

ROTATION_ONLY = "n"
"""Direction label of the trials that only rotate."""


@dataclass(frozen=True)
class HumanFolder:
    """The trials of one folder."""

    trials: tuple[HumanTrial, ...]
    """In the order of the file names."""
    notes: tuple[str, ...]
    """What was left out and why, one sentence each."""


def read_human_file(path: Path, gaps: Gaps = "refuse") -> HumanTrial:
    """Return one recorded trial; name and columns tell its unit (docs/metrics.md), which is never guessed.

    Raises:
        InputError: unknown name, unit or row, or a gap that is refused; the text gives file name and line.
    """
    name = parse_human_name(path.name)
    rows, unseen = read_rows(path, gaps)
    unit = unit_of(path.name, name, tuple(rows.columns))
    check_unit(path.name, rows, unit)
    raw_mm = np.column_stack([rows.columns[axis] for axis in "xy"]) * unit.to_mm
    rotation, signed = _rotation(rows, name, unit)
    from_start = raw_mm - raw_mm[0]
    smoothed = _filtered(rows, np.column_stack([from_start, rotation]), unit)
    where = name.direction
    return HumanTrial(
        source=path.name,
        subject=name.subject,
        hand=name.hand,
        direction=where.letter if where else ROTATION_ONLY,
        primitive=where.name if where else str(name.rotation),
        angle_deg=where.angle_deg if where else None,
        twist_deg=name.twist_deg,
        trial=name.trial,
        unit=unit.text,
        frame=rows.columns.get("frame", np.arange(len(raw_mm), dtype=float)),
        start_mm=raw_mm[0],
        path_mm=from_start,
        rotation_deg=rotation,
        rotation_signed=signed,
        rotation_usable=unit.rotation_usable,
        filtered_mm=smoothed[:, :2],
        filtered_rotation_deg=smoothed[:, 2],
        moving=_moving(raw_mm if where else np.column_stack([raw_mm, rotation])),
        unseen=unseen,
    )


def read_human_folder(folder: Path, gaps: Gaps = "refuse") -> HumanFolder:
    """Return every recorded trial of a folder, each recording once.

    A CSV file whose name is none of a recording is left out with a note; a recording that cannot be read is not, for a
    mean without it would be another. A recording that lies there twice under two names, cropped or smoothed
    differently, would count twice in every mean: the shorter copy is left out with a note (`sub1` trial 1 is `josh`
    trial 1).

    Raises:
        InputError: the folder is missing or holds no recording, or one of its recordings cannot be used.
    """
    if not folder.is_dir():
        raise InputError(f"folder {folder} is not there: give the folder that holds the recorded CSV files")
    files = sorted(each for each in folder.iterdir() if each.suffix.lower() == ".csv" and each.is_file())
    if not files:
        inside = sorted({each.parent.name for each in folder.glob("*/*.csv")})
        hint = f"its folders {', '.join(inside)} do: give one of them" if inside else "give one that does"
        raise InputError(f"folder {folder} holds no CSV file; {hint}")
    stray = {each: text for each in files if (text := _stray(each))}
    if len(stray) == len(files):
        raise InputError(f"folder {folder} holds no recording: {next(iter(stray.values()))}")
    notes = tuple(f"{each.name} left out: its name is not that of a recording" for each in stray)
    trials, copies = leave_out_duplicates([read_human_file(each, gaps) for each in files if each not in stray])
    return HumanFolder(trials, notes + copies)


def _stray(path: Path) -> str:
    """Return why a file's name is not that of a recording; empty if it is."""
    try:
        parse_human_name(path.name)
    except InputError as error:
        return str(error)
    return ""


def _rotation(rows: Columns, name: HumanName, unit: Unit) -> tuple[Array, bool]:
    """Return the rotation `(T,)` [deg] and whether its sign is known: the files hold sizes, the label the sign."""
    size = rows.columns["rmag"]
    if not unit.rotation_usable:
        return np.full(len(size), np.nan), False
    if name.rotation is not None:
        return ROTATION_SIGNS[name.rotation] * size, True
    if name.twist_deg:
        return np.copysign(size, name.twist_deg), True
    return size, False


def _filtered(rows: Columns, values: Array, unit: Unit) -> Array:
    """Return position and rotation `(T, 3)` without jitter; made-up paths, which have none, stay as they are."""
    columns = rows.columns
    own = "f_x" in columns and "f_y" in columns
    same = own and np.array_equal(columns["f_x"], columns["x"]) and np.array_equal(columns["f_y"], columns["y"])
    return values if unit.simulated or same else smooth(values)


def _moving(raw: Array) -> tuple[int, int]:
    """Return first row and one past the last row in which anything moves, of raw rows `(T, K)`.

    Positions decide, and the rotation too in a trial that only rotates: its jitter alone is no movement. The last
    of the leading zero rows stays, as the start pose; so does the first of the equal rows at the end.
    """
    moved = np.flatnonzero(np.any(raw != 0.0, axis=1))
    if not len(moved):
        return 0, 1
    start = max(int(moved[0]) - 1, 0)
    changes = np.flatnonzero(np.any(np.diff(raw, axis=0) != 0.0, axis=1))
    return start, int(changes[-1]) + 2 if len(changes) else start + 1
