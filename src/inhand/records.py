"""Records: dataclasses and plain tables kept as JSON, and read back by their types.

The library msgspec does both; this file turns its complaints into ours: the field, what it holds, what is needed.
"""

from __future__ import annotations

import re
import reprlib
from functools import reduce
from pathlib import Path
from typing import Any, TypeVar, get_args, get_type_hints

import msgspec
import numpy as np

from inhand.errors import InputError

R = TypeVar("R")
_WORDS = {
    "int": "a whole number", "float": "a number", "bool": "true or false", "str": "a text",
    "array": "a list", "object": "a table", "null": "null",
}  # fmt: skip


def text_of(record: object, indent: int = 1) -> str:
    """Return a record as JSON; numbers that are not finite become null, paths texts."""
    return msgspec.json.format(msgspec.json.encode(record, enc_hook=_plain), indent=indent).decode() + "\n"


def table_of(record: object) -> dict[str, Any]:
    """Return a record as the table that JSON would give back."""
    return msgspec.json.decode(msgspec.json.encode(record, enc_hook=_plain), type=dict[str, Any])


def read_json(text: str | bytes) -> object:
    """Return what JSON holds.

    Raises:
        InputError: it is no JSON, or nested too deeply.
    """
    try:
        found: object = msgspec.json.decode(text)
    except (msgspec.DecodeError, UnicodeError) as error:
        raise InputError(f"it is no JSON ({error})") from error
    except RecursionError as error:
        raise InputError("its JSON is nested too deeply") from error
    return found


def read_record(entry: object, kind: type[R], form: int | None = None, new: str = "") -> R:
    """Return what JSON has held as a record.

    Args:
        entry: what `read_json` has returned, or a part of it.
        kind: the dataclass.
        form: the number that its field `format` must hold, None where it has no such field.
        new: what that format has that the one before had not.

    Raises:
        InputError: another format, a field that is missing, unknown, or holds what it cannot.
    """
    if not isinstance(entry, dict):
        raise InputError(f"it is {reprlib.repr(entry)}; it must be a table")
    if form is not None and entry.get("format") != form:
        told = f"this version reads {form}{', which has ' + new if new else ''}"
        raise InputError(f"it has format {reprlib.repr(entry.get('format'))}; {told}")
    try:
        record = msgspec.convert(entry, kind)
        unknown = _unknown(entry, msgspec.to_builtins(record))
    except msgspec.ValidationError as error:
        raise InputError(_complaint(str(error), entry, kind)) from error
    except RecursionError as error:
        raise InputError("its JSON is nested too deeply") from error
    if unknown:
        raise InputError(f"{unknown} is a field that this version does not know; a later one may")
    return record


def _complaint(error: str, entry: object, kind: object) -> str:
    """Return msgspec's complaint as the field, what it holds and what is needed."""
    message, _, place = error.partition(" - at `$")
    field = place.rstrip("`").lstrip(".")
    if message.startswith("Object missing"):
        return f"{field or 'it'} has no field {message.split('`')[1]}"
    steps = re.findall(r"\w+|\[\.\.\.\]", field)
    held = reprlib.repr(reduce(_inside, steps, entry))
    found = re.match(r"Expected `(.+?)`(.*?)(?:, got .*)?$", message)
    if found:
        words = " or ".join(_WORDS.get(name, name) for name in found[1].split(" | "))
        return f"{field} is {held}; it must be {words}{found[2]}"
    if message.startswith("Invalid enum value"):
        allowed = get_args(reduce(lambda outer, step: get_type_hints(outer)[step], steps, kind))
        return f"{field} is {held}; it must be {' or '.join(map(str, allowed))}"
    return f"{field}: {message}" if field else message


def _inside(outer: object, step: str) -> object:
    """Return what lies a step of msgspec's path inside; it hides the keys of tables, which then stand as they are."""
    if isinstance(outer, list):
        return outer[int(step)]
    return outer.get(step, outer) if isinstance(outer, dict) else outer


def _unknown(given: object, kept: object, place: str = "") -> str:
    """Return the place of the first key that reading has not kept; empty if all are."""
    if isinstance(given, dict) and isinstance(kept, dict):
        for key, value in given.items():
            found = _unknown(value, kept[key], f"{place}{key}.") if key in kept else f"{place}{key}"
            if found:
                return found
    elif isinstance(given, list) and isinstance(kept, list | tuple):
        return next(filter(None, (_unknown(*pair, place) for pair in zip(given, kept, strict=False))), "")
    return ""


def _plain(value: object) -> object:
    """Return what JSON has no word for: NumPy's numbers as numbers, paths as texts."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{type(value).__name__} has no place in JSON")
