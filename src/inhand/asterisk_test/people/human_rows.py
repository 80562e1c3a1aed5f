"""Rows of a recorded file as columns of numbers; every complaint names the file and the line."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array

REQUIRED = ("x", "y", "rmag")


@dataclass(frozen=True, eq=False)
class Rows:
    """The numbers of one recorded file."""

    columns: dict[str, Array]
    """Each column `(T,)` by its name; the first column of the 2020 files has no name and is called `frame`."""
    lines: tuple[int, ...]
    """Line of the file on which each row ends."""


def read_rows(path: Path) -> Rows:
    """Return the columns of a recorded CSV file, whatever their order.

    Raises:
        InputError: the file cannot be read as text, is empty, lacks a column, or has a row that is cut off, not
            numeric or not finite; the text gives the file name and the line.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            return _parse(path.name, file)
    except FileNotFoundError as error:
        raise InputError(f"{path} is not there: give the path of a recorded CSV file") from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path.name} cannot be read as a CSV text file ({error}): export it again") from error


def _parse(name: str, file: TextIO) -> Rows:
    reader = csv.reader(file)
    header = _header(name, next(reader, []))
    values: list[list[float]] = []
    lines: list[int] = []
    for row in reader:
        if row:
            values.append(_numbers(f"{name}, line {reader.line_num}", header, row))
            lines.append(reader.line_num)
    if not values:
        raise InputError(f"{name} holds a header but no rows: record the trial again, or remove the file")
    table = np.array(values)
    return Rows({column: table[:, i] for i, column in enumerate(header)}, tuple(lines))


def _header(name: str, row: list[str]) -> list[str]:
    """Return the column names, or complain about the first line."""
    if not row:
        raise InputError(f"{name} is empty: record the trial again, or remove the file")
    header = [column.strip() or "frame" for column in row]
    missing = [column for column in REQUIRED if column not in header]
    if missing:
        raise InputError(
            f"{name}, line 1: no column {' and '.join(missing)} among {', '.join(header)}; a recorded trial needs"
            f" the columns {', '.join(REQUIRED)}"
        )
    twice = sorted({column for column in header if header.count(column) > 1})
    if twice:
        raise InputError(f"{name}, line 1: column {', '.join(twice)} is named twice; keep one of them")
    return header


def _numbers(where: str, header: list[str], row: list[str]) -> list[float]:
    """Return the numbers of one row, or complain about it."""
    if len(row) != len(header):
        raise InputError(
            f"{where}: {len(row)} cells where the header names {len(header)}; the row is cut off or damaged,"
            " mend or remove it"
        )
    return [_number(where, column, cell) for column, cell in zip(header, row, strict=True)]


def _number(where: str, column: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: column {column} holds {cell!r}, not a finite number; mend or remove the row")
    return value
