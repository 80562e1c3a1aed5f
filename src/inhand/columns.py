"""Columns of numbers from a CSV file; every complaint names the file and the line."""

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array


@dataclass(frozen=True)
class Header:
    """What the first line of a CSV file must name."""

    required: tuple[str, ...]
    """Columns that must be there, in any order."""
    optional: tuple[str, ...] | None = None
    """Those that may be there, None for any."""
    unnamed: str = ""
    """What a column without a name is called."""
    may_be_empty: bool = False
    """Whether a row may leave all required columns empty: each of its numbers that is not there is NaN."""


@dataclass(frozen=True, eq=False)
class Columns:
    """The numbers of a CSV file."""

    columns: dict[str, Array]
    """Each column `(N,)` by its name."""
    lines: tuple[int, ...]
    """Line of the file on which each row ends; for a file without rows, that of its header."""


def read_columns(path: Path, what: str, header: Header, most: int | None = None) -> Columns:
    """Return the columns of a CSV file.

    Args:
        path: the file.
        what: what to call it where it cannot be used.
        header: what its first line must name.
        most: how many rows it may have; None for any number.

    Raises:
        InputError: no such file, no text, a column that is missing, unknown or there twice, more rows, or one that is
            cut off or holds something that is no finite number.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            return _columns(file, header, most)
    except FileNotFoundError as error:
        raise InputError(f"{what}: there is no such file; give the path of a .csv file that is there") from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{what} cannot be read as a CSV text file ({error}): export it again") from error
    except InputError as error:
        raise InputError(f"{what}, {error}") from error


def _columns(file: TextIO, header: Header, most: int | None) -> Columns:
    reader = csv.reader(file)
    names = [name.strip() or header.unnamed for name in next(reader, [])]
    _check_names(names, header)
    rows: list[list[float]] = []
    lines = [reader.line_num]
    for row in reader:
        if len(rows) == most:
            raise InputError(f"line {reader.line_num}: more than {most:,} rows; leave out those that hardly differ")
        if row:
            rows.append(_numbers(reader.line_num, names, row, header))
            lines.append(reader.line_num)
    table = np.array(rows).reshape(-1, len(names))
    return Columns({name: table[:, i] for i, name in enumerate(names)}, tuple(lines[1:] or lines))


def _check_names(names: Sequence[str], header: Header) -> None:
    missing = [name for name in header.required if name not in names]
    if missing:
        may = f" and may have {', '.join(header.optional)}" if header.optional else ""
        raise InputError(
            f"line 1: no column {' and '.join(missing)} among {', '.join(names) or '(nothing)'}; it needs the columns"
            f" {', '.join(header.required)}{may}, with commas between: name them in the first line"
        )
    allowed = None if header.optional is None else (*header.required, *header.optional)
    for name in names:
        if allowed is not None and name not in allowed:
            raise InputError(
                f"line 1: unknown column {name!r}{near_matches(name, allowed)}; allowed are {', '.join(allowed)}:"
                " rename or remove it"
            )
        if names.count(name) > 1:
            raise InputError(f"line 1: column {name} is there twice; keep one of them")


def _numbers(line: int, names: Sequence[str], row: Sequence[str], header: Header) -> list[float]:
    """Return the numbers of one row, or complain about it."""
    if len(row) != len(names):
        raise InputError(f"line {line}: {len(row)} cells where the header names {len(names)}; mend or remove the row")
    cells = dict(zip(names, row, strict=True))
    empty = header.may_be_empty and all(cells[name].strip().lower() in {"", "nan"} for name in header.required)
    return [
        math.nan if empty and not cell.strip() else _number(line, name, cell, empty) for name, cell in cells.items()
    ]


def _number(line: int, name: str, cell: str, empty: bool) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.inf
    if not (math.isfinite(value) or (empty and math.isnan(value))):
        raise InputError(f"line {line}: column {name} holds {cell!r}, not a finite number; mend or remove the row")
    return value
