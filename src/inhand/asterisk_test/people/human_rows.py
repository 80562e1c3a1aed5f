"""Rows of a recorded file, and what becomes of those in which the camera did not see the object."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inhand.columns import Columns, Header, read_columns
from inhand.errors import InputError
from inhand.geometry import interpolate, longest_run

REQUIRED = ("x", "y", "rmag")
FRAME = "frame"
"""Name of the column that numbers the frames; in the files of 2020 and of the camera it has none."""
MOST_ROWS = 2000
"""Rows of the longest recording; the longest known has 690."""
Gaps = Literal["refuse", "drop", "fill"]
"""What becomes of empty rows: the file is refused, they are left out, or a line is drawn over them."""


@dataclass(frozen=True)
class Unseen:
    """Frames in which the camera did not see the object."""

    frames: int = 0
    longest: int = 0
    """The longest run of them."""
    gaps: Gaps = "refuse"
    """What became of them."""

    def __str__(self) -> str:
        """Say it in a few words; empty where the object was always seen."""
        done = "left out" if self.gaps == "drop" else "filled"
        return f"{self.frames} {done}, longest {self.longest}" if self.frames else ""


ALL_SEEN = Unseen()
"""Of a recording without gaps, and of a simulation."""


def read_rows(path: Path, gaps: Gaps = "refuse") -> tuple[Columns, Unseen]:
    """Return the columns of a recorded CSV file, whatever their order, and how often the object was not seen.

    A row without x, y and rmag is a frame in which the marker was not seen. Filled ones lie on the line between their
    neighbours; before the first row that was seen and after the last there is nothing to draw a line to, so these are
    always left out.

    Raises:
        InputError: the file cannot be read as text, is empty, lacks a column, or has a row that is cut off, not
            numeric, not finite or, with `refuse`, empty; the text gives the file name and the line.
    """
    found = read_columns(path, path.name, Header(REQUIRED, unnamed=FRAME, may_be_empty=True))
    if not len(found.columns["x"]):
        raise InputError(f"{path.name} holds a header but no rows: record the trial again, or remove the file")
    if len(found.lines) > MOST_ROWS:
        raise InputError(
            f"{path.name} has {len(found.lines)} rows; a trial has at most {MOST_ROWS}, more than a minute: cut the"
            " recording into trials"
        )
    seen = ~np.isnan(found.columns["x"])
    unseen = Unseen(int((~seen).sum()), longest_run(~seen), gaps)
    if not unseen.frames:
        return found, unseen
    where = f"{path.name}, line {found.lines[int(np.argmin(seen))]}"
    if gaps == "refuse":
        raise InputError(
            f"{where}: x, y and rmag are empty, as in {unseen.frames} of {len(seen)} rows: the marker was not seen"
            f" (longest run {unseen.longest}). Leave them out with `inhand metrics --gaps drop`, or draw a line over"
            " them with --gaps fill"
        )
    if not seen.any():
        raise InputError(f"{where}: the marker was never seen; record the trial again")
    return _mended(found, seen, fill=gaps == "fill"), unseen


def _mended(found: Columns, seen: NDArray[np.bool_], *, fill: bool) -> Columns:
    """Return the rows that were seen and, to fill, those between them on the line over their frames."""
    rows = np.flatnonzero(seen)
    kept = np.arange(rows[0], rows[-1] + 1) if fill else rows
    columns = {name: values[kept] for name, values in found.columns.items()}
    if fill:
        number = np.arange(float(len(seen)))
        frame = found.columns.get(FRAME, number)
        frame = frame if (np.diff(frame) > 0).all() else number
        table = np.column_stack([values[rows] for values in found.columns.values()])
        filled = interpolate(frame[kept], frame[rows], table)
        columns = dict(zip(found.columns, filled.T, strict=True))
    return Columns(columns, tuple(found.lines[row] for row in kept))
