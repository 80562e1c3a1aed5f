"""`run.toml`: the settings of a command in a file; every run's folder has the one that repeats it."""

import json
import tomllib
from pathlib import Path
from typing import Any, get_type_hints

from inhand.errors import InputError, near_matches
from inhand.folders import in_place
from inhand.records import Config, checked

NAME = "run.toml"
"""The file's name in a run's folder."""
COMMAND = "command"
"""The key that names the command; the others are its options, with `_` for `-`."""
UNKEPT = ("overwrite", "resume")
"""Options that say what becomes of a folder, not what is run."""


def write_repeat(folder: Path, command: str, config: Config) -> None:
    """Write the file that repeats a run by a command into its folder."""
    lines = [f"# inhand {command} --config {NAME} --out ANOTHER_FOLDER", f"{COMMAND} = {_text_of(command)}"]
    for name in get_type_hints(type(config)):
        value = getattr(config, name)
        if name not in UNKEPT and value is not None:
            lines.append(f"{name} = {_text_of(value)}")
    with in_place(folder / NAME) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _text_of(value: object) -> str:
    """Return a value as TOML; of JSON's texts TOML reads all but the character DEL."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_text_of, value))}]"
    text = str(value) if isinstance(value, Path) else value
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def read_repeat(file: Path) -> dict[str, Any]:
    """Return the settings that a file holds, with the command that it is for where it names one.

    Raises:
        InputError: no such file, or no TOML.
    """
    try:
        return tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except FileNotFoundError as error:
        raise InputError(f"there is no file {file}: give a TOML file, such as {NAME} in the folder of a run") from error
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{file} is no TOML file: {error}") from error


def settings_in(file: Path, command: str, kind: type[Config]) -> dict[str, Any]:
    """Return the settings of a command that a file holds, each as its option's type.

    Raises:
        InputError: no such file, no TOML, settings of another command, an unknown one, or a value that cannot be.
    """
    found = read_repeat(file)
    other = found.pop(COMMAND, command)
    if other != command:
        raise InputError(f"{file} has the settings of `inhand {other}`, not of `inhand {command}`")
    hints = get_type_hints(kind)
    for name in found:
        if name not in hints:
            raise InputError(
                f"{file}: unknown setting {name!r}{near_matches(name, hints)}; `inhand {command}` has"
                f" {', '.join(hints)}"
            )
    try:
        return {name: checked(name, value, hints[name]) for name, value in found.items()}
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
