"""What a command line asks for: its words and the file of its `--config` as a configuration."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import tyro

from inhand.cli.commands import COMMANDS, Printing
from inhand.cli.texts import texts_of
from inhand.errors import InputError
from inhand.records import Config
from inhand.repeats import settings_in

ABOUT = "Structured in-hand manipulation: the Asterisk Test in simulation, beside people."
HELP = {"-h", "--help"}
MARKS = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.OmitArgPrefixes)


@dataclass(frozen=True)
class Asked:
    """What a command line asks for."""

    command: str
    config: Config
    printing: Printing


def asked(words: Sequence[str]) -> Asked:
    """Return what the words of a command line ask for.

    Raises:
        InputError: a value that its option cannot have; of words that mean nothing tyro tells, and exits.
    """
    command = words[0] if words else ""
    if command not in COMMANDS:
        told(words)
        raise InputError(f"{command} is no command; `inhand help` lists them")
    kind = COMMANDS[command]
    form = _form(kind, (Printing, kind) if HELP & set(words) else ())
    known = form(**_known(_config_file(words[1:]), command, kind))
    given = dict(vars(tyro.cli(form, prog=f"inhand {command}", args=words[1:], default=known, config=MARKS)))
    own = get_type_hints(Printing)
    try:
        printing = Printing(**{name: given.pop(name) for name in own})
        return Asked(command, kind(**given), printing)
    except InputError as error:
        name, _, rest = str(error).partition(" ")
        raise InputError(f"--{name.replace('_', '-')} {rest}") from error


def told(words: Sequence[str]) -> None:
    """Let tyro tell about all commands: help, a shell's completion, or a word that is no command."""
    kinds: dict[str, Callable[..., Config]] = {name: _form(kind) for name, kind in COMMANDS.items()}
    tyro.extras.subcommand_cli_from_dict(kinds, args=words, prog="inhand", description=ABOUT, config=MARKS)


def _form(kind: type[Config], told: Iterable[type] = ()) -> type[Config]:
    """Return a command's options for tyro, with those that all commands have.

    It looks at no value: what a configuration refuses, tyro would tell in a form of its own. Of the classes `told` each
    text is one paragraph; tyro by itself breaks it where its source does.
    """
    body: dict[str, Any] = {"__doc__": kind.__doc__, "__post_init__": lambda _: None, "__module__": kind.__module__}
    body["__annotations__"] = {
        name: Annotated[get_type_hints(each, include_extras=True)[name], tyro.conf.arg(help=text)]
        for each in told
        for name, (_, text) in texts_of(each).items()
    }
    form: type[Config] = dataclass(frozen=True)(type(kind.__name__, (Printing, kind), body))
    return form


def _config_file(words: Sequence[str]) -> Path | None:
    """Return the file that words name as settings, before the words themselves are looked at."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    parser.add_argument("--config", nargs="?", type=Path)
    file: Path | None = parser.parse_known_args(words)[0].config
    return file


def _known(file: Path | None, command: str, kind: type[Config]) -> dict[str, Any]:
    """Return what a file sets of a command's options, and what must be given for it."""
    needed = [field.name for field in fields(kind) if field.default is MISSING]
    return dict.fromkeys(needed, tyro.MISSING) | ({} if file is None else settings_in(file, command, kind))
