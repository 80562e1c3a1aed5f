"""Disturbances by name or from TOML files, at a strength where one is given."""

import tomllib
from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, get_type_hints

from inhand.errors import InputError, near_matches
from inhand.records import checked
from inhand.registry import IN_FILE
from inhand.sim.disturbance import DISTURBANCES, PARTS, SINGLES, Disturbance
from inhand.sim.strengths import scaled

NONE = "none"
"""The word for undisturbed worlds."""


def load_disturbance(name_or_file: str) -> Disturbance | None:
    """Return the disturbance of a name, a TOML file or `FILE.py:NAME`, or of one of these `@STRENGTH`.

    It is None where nothing is disturbed: for the word none and at strength 0.

    Raises:
        InputError: there is none of that name, a file that says what cannot be, or no such strength.
    """
    base, strength = parted(name_or_file)
    spec = None if base == NONE else _of_a_name(base)
    found = None if spec is None else scaled(spec, strength)
    return None if strength == 0 else found


def parted(text: str) -> tuple[str, float]:
    """Return name or file of a disturbance, and the strength that stands behind an @, 1 without.

    Raises:
        InputError: what stands there is no number.
    """
    base, at, word = text.rpartition("@")
    if not at or Path(text).suffix.lower() == ".toml" or IN_FILE.fullmatch(text):
        return text, 1.0
    try:
        return base, float(word)
    except ValueError as error:
        raise InputError(
            f"strength {word!r} of disturbance {base!r} is no number: give one, as in field@0.5"
        ) from error


def _of_a_name(name_or_file: str) -> Disturbance:
    path = Path(name_or_file)
    if path.suffix.lower() == ".toml":
        return _from_file(path)
    found = DISTURBANCES.find(name_or_file)
    if found is None:
        first = ", ".join(name for name in (NONE, *DISTURBANCES) if name not in {each.name for each in SINGLES})
        raise InputError(
            f"unknown disturbance {name_or_file!r}{near_matches(name_or_file, (NONE, *DISTURBANCES))}; allowed are"
            f" {first}, those of one quantity such as {SINGLES[0].name} (docs/disturbances.md), a TOML file and"
            " FILE.py:NAME"
        )
    return found


def disturbance_name(name_or_file: str) -> str:
    """Return what runs call the disturbance of a name or a file; none where there is none."""
    spec = load_disturbance(name_or_file)
    return NONE if spec is None else spec.name


def _from_file(path: Path) -> Disturbance:
    try:
        now = path.stat()
    except FileNotFoundError as error:
        raise InputError(f"no disturbance file {path}: give the path of a TOML file, or a name") from error
    except (OSError, ValueError) as error:
        raise InputError(f"{path} is not a TOML file: {error}; mend the file") from error
    return _read(path, now.st_ino, now.st_mtime_ns, now.st_size)


@lru_cache(maxsize=8)
def _read(path: Path, *_written: int) -> Disturbance:
    """Return what a file says, which a run asks for several times: read once, until it is written again."""
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path} is not a TOML file: {error}; mend the file") from error
    try:
        return _from_table(table, path.stem)
    except InputError as error:
        raise InputError(f"disturbance file {path}: {error}") from error


def _from_table(table: dict[str, Any], name: str) -> Disturbance:
    """Return a disturbance: a level, or nothing, with what tables change."""
    kinds = get_type_hints(Disturbance)
    known = {part: {each.name for each in fields(kinds[part])} for part in PARTS}
    level = checked("level", table.get("level", NONE), str)
    spec = replace(load_disturbance(level) or Disturbance(), name=checked("name", table.get("name", name), str))
    for part, given in table.items():
        if part in {"level", "name"}:
            continue
        if part not in PARTS:
            homes = {quantity: home for home, names in known.items() for quantity in names}
            home = f"; {part} belongs in the table [{homes[part]}]" if part in homes else near_matches(part, PARTS)
            raise InputError(f"unknown table {part!r}{home}; allowed are level, name and the tables {', '.join(PARTS)}")
        values = checked(part, given, dict[str, Any])
        for quantity in values:
            if quantity not in known[part]:
                near = near_matches(quantity, known[part])
                allowed = ", ".join(sorted(known[part]))
                raise InputError(f"unknown quantity {quantity!r} in [{part}]{near}; allowed are {allowed}")
        own = getattr(spec, part)
        pairs = {
            q: (v, v) if isinstance(getattr(own, q), tuple) and not isinstance(v, list) else v
            for q, v in values.items()
        }
        spec = replace(spec, **{part: replace(own, **pairs)})
    return spec
