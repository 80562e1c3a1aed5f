"""Records: dataclasses looked at by their types, and kept as JSON and read back.

The library msgspec does it; this file turns its complaints into ours: the field, what it holds, what is needed.
"""

import math
import re
import reprlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, get_args, get_type_hints

import msgspec

from inhand.errors import InputError, near_matches

R = TypeVar("R")
Kind: TypeAlias = Any
"""A type, or a union of types."""
Held: TypeAlias = Any
"""A value of such a type."""
_WORDS = {
    "int": "a whole number", "float": "a number", "bool": "true or false", "str": "a text",
    "array": "a list", "object": "a table", "null": "null",
}  # fmt: skip


@dataclass(frozen=True)
class Config:
    """A frozen dataclass of settings, whose fields hold what they are said to from the moment it is made.

    Numbers of NumPy, whole numbers where any will do, lists for tuples and texts for paths become what the field says.
    """

    def __post_init__(self) -> None:
        """Look at every field."""
        for name, kind in get_type_hints(type(self)).items():
            object.__setattr__(self, name, checked(name, getattr(self, name), kind))


C = TypeVar("C", bound=Config)


def configured(kind: type[C], settings: dict[str, Any]) -> C:
    """Return settings by keyword as a configuration.

    Raises:
        InputError: an unknown keyword, or a value that cannot be.
    """
    allowed = list(get_type_hints(kind))
    for name in settings:
        if name not in allowed:
            raise InputError(f"unknown keyword {name!r}{near_matches(name, allowed)}; allowed are {', '.join(allowed)}")
    return kind(**settings)


def checked(name: str, held: object, kind: Kind) -> Held:
    """Return what a setting holds as its type.

    Raises:
        InputError: it is of another type, or a number that is not finite; the text names the setting.
    """
    plain = _built_in(held)
    try:
        found = msgspec.convert(plain, kind, dec_hook=_made)
    except msgspec.ValidationError as error:
        message, _, place = str(error).partition(" - at `$")
        told = f"{message} - at `${name}{place.rstrip('`')}"
        raise InputError(_complaint(told, {name: plain}, {name: kind})) from error
    if isinstance(plain, dict) and not isinstance(found, dict):
        unknown = _unknown(plain, msgspec.to_builtins(found, enc_hook=_plain))
        if unknown:
            raise InputError(f"{name}.{unknown} is no setting: leave it out")
    if isinstance(found, float) and not math.isfinite(found):
        raise InputError(f"{name} is {found}; it must be a finite number")
    return found


def text_of(record: object, indent: int = 1) -> str:
    """Return a record as JSON; numbers that are not finite become null, paths texts."""
    return msgspec.json.format(msgspec.json.encode(record, enc_hook=_plain), indent=indent).decode() + "\n"


def compact(record: object) -> str:
    """Return a record as JSON of one line; numbers that are not finite become null, paths texts."""
    return msgspec.json.encode(record, enc_hook=_plain).decode()


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


def read_json_file(file: Path) -> object:
    """Return what a JSON file holds.

    Raises:
        InputError: as `read_json`; the text names the file.
    """
    try:
        return read_json(file.read_bytes())
    except InputError as error:
        raise InputError(f"{file}: {error}") from error


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
        record = msgspec.convert(entry, kind, dec_hook=_made)
        unknown = _unknown(entry, msgspec.to_builtins(record, enc_hook=_plain))
    except msgspec.ValidationError as error:
        raise InputError(_complaint(str(error), entry, kind)) from error
    except RecursionError as error:
        raise InputError("its JSON is nested too deeply") from error
    if unknown:
        raise InputError(f"{unknown} is a field that this version does not know; a later one may")
    return record


def _made(kind: type[object], held: object) -> object:
    """Return the path that JSON has as a text; msgspec knows none."""
    if kind is Path and isinstance(held, str | Path):
        return Path(held)
    raise ValueError(f"Expected `str`, got `{type(held).__name__}`")


def _built_in(held: object) -> object:
    """Return NumPy's numbers and arrays as Python's own, also within a list."""
    if isinstance(held, list | tuple):
        return [_built_in(each) for each in held]
    return held.tolist() if hasattr(held, "tolist") else held


def _allowed(kind: object) -> Iterator[object]:
    """Give the values of a literal type, also where it is one of several types."""
    for each in get_args(kind):
        yield from _allowed(each) if get_args(each) else [each]


def _complaint(error: str, entry: object, kind: Kind) -> str:
    """Return msgspec's complaint as the field, what it holds and what is needed; the kind may be types by name."""
    message, _, place = error.partition(" - at `$")
    field = place.rstrip("`").lstrip(".")
    if message.startswith("Object missing"):
        return f"{field or 'it'} has no field {message.split('`')[1]}"
    steps = re.findall(r"\w+|\[\.\.\.\]", field)
    value = reduce(_inside, steps, entry)
    held = reprlib.repr(value)
    found = re.match(r"Expected `(.+?)`(.*?)(?:, got .*)?$", message)
    if found:
        words = " or ".join(_WORDS.get(name, name) for name in found[1].split(" | "))
        return f"{field} is {held}; it must be {words}{found[2]}"
    if message.startswith("Invalid enum value"):
        wanted = reduce(
            lambda outer, step: (outer if isinstance(outer, dict) else get_type_hints(outer))[step], steps, kind
        )
        allowed = [str(each) for each in _allowed(wanted) if each not in (None, type(None))]
        return f"{field} is {held}; it must be {' or '.join(allowed)}{near_matches(str(value), allowed)}"
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
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        found: object = value.tolist()
        return found
    raise TypeError(f"{type(value).__name__} has no place in JSON")
