"""Tables of TOML files of hands and objects: read, and refused by file and key."""

import re
import sys
import tomllib
from pathlib import Path
from typing import Any

from inhand.errors import InputError, near_matches

_KEYED = re.compile(r"(?P<stem>.+?)(?P<pairs>(?::\w+=[^:]*)*)", re.DOTALL)
WEIGHED = ("mass_kg", "friction")
"""What may be said of any object after its name."""


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """Return the table of a file of a hand or an object, `what` it is.

    Raises:
        InputError: no such file, or none that is TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError as error:
        raise InputError(f"no {what} file {path}: give the path of a TOML file, or a name without slashes") from error
    except RecursionError as error:
        raise InputError(f"{path} is not a TOML file of a {what}: its tables lie too deep in each other") from error
    except (OSError, ValueError) as error:
        raise InputError(f"{path} is not a TOML file: {error}; mend the file") from error


def keyed(given: str) -> tuple[str, dict[str, Any]]:
    """Return a name or a path, and the table that stands after it, as in `part.dxf:unit=mm:mass_kg=0.05`."""
    found = _KEYED.fullmatch(given)
    if found is None:  # an empty text
        return given, {}
    pairs = (pair.split("=", 1) for pair in found["pairs"].split(":")[1:])
    return found["stem"], {key: _value(word) for key, word in pairs}


def _value(word: str) -> float | bool | str:
    """Return a number or a truth value of the command line as one, and anything else as it is."""
    if word in {"true", "false"}:
        return word == "true"
    try:
        return float(word)
    except ValueError:
        return word


def check_keys(table: dict[str, Any], allowed: tuple[str, ...], required: tuple[str, ...], where: str) -> None:
    """Refuse a table with other keys than those allowed, or without one that is required.

    Raises:
        InputError: the text says which key, and `where` it stands.
    """
    for key in table:
        if key not in allowed:
            raise InputError(
                f"{where}: unknown key {key!r}{near_matches(key, allowed)}; allowed are {', '.join(allowed)}"
            )
    for key in required:
        if key not in table:
            raise InputError(f"{where}: no {key!r}; it must give {', '.join(required)}")


def number_in(table: dict[str, Any], key: str, where: str) -> float:
    """Return the finite number of a key.

    Raises:
        InputError: it is none.
    """
    value = table[key]
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= sys.float_info.max:
        raise InputError(f"{where}: {key} = {value!r}; it must be a finite number")
    return float(value)


def text_in(table: dict[str, Any], key: str, where: str) -> str:
    """Return the text of a key.

    Raises:
        InputError: it is none, or empty.
    """
    value = table[key]
    if not isinstance(value, str) or not value:
        raise InputError(f"{where}: {key} = {value!r}; it must be a text in quotes")
    return value


def numbers_in(table: dict[str, Any], key: str, where: str) -> tuple[float, ...]:
    """Return the finite numbers of a key.

    Raises:
        InputError: it is no list of them, or an empty one.
    """
    value = table[key]
    if not isinstance(value, list) or not value:
        raise InputError(f"{where}: {key} = {value!r}; it must be a list of numbers")
    return tuple(number_in({key: item}, key, where) for item in value)
