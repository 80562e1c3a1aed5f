"""`inhand again`: a run repeated from its folder, and whether the numbers are the same."""

from contextlib import chdir, nullcontext
from pathlib import Path

from inhand.cli.answer import Answer
from inhand.cli.commands import COMMANDS, AgainConfig
from inhand.cli.work import worker
from inhand.errors import InputError
from inhand.folders import place_of
from inhand.repeats import COMMAND, NAME, read_repeat, settings_in


def run_again(config: AgainConfig) -> Answer:
    """Run what a folder's `run.toml` says, to another folder, and tell what differs.

    Raises:
        InputError: no such file, one of no command that runs, a folder in the run's own, or what its command refuses.
    """
    file = config.run / NAME
    if not file.is_file():
        raise InputError(
            f"{config.run} holds no {NAME}: give the folder of a finished run; where it is older than that file, or was"
            " run in Python with more than a command can say, its report tells how to run it again"
        )
    command = read_repeat(file).get(COMMAND)
    runs = [name for name, each in COMMANDS.items() if hasattr(each, "overwrite") and each is not AgainConfig]
    if command not in runs:
        raise InputError(f"{file}: {COMMAND} is {command!r}; it must be a command, {', '.join(runs)}")
    place = config.run.resolve()
    out = config.out or place.with_name(f"{place.name}-again")
    if place in (place_of(out), *place_of(out).parents):
        raise InputError(f"--out {out} is in the run's own folder: give another, so that both can be compared")
    kind = COMMANDS[command]
    settings = settings_in(file, command, kind)
    given_in = _given_in(place, settings.get("out"))
    here = given_in is None or given_in == Path.cwd()
    settings |= {"out": out if here else out.resolve(), "overwrite": config.overwrite}
    try:
        with nullcontext() if here else chdir(given_in or place):
            done = worker(command)(kind(**settings))
    except InputError as error:
        hint = f" (files that {file} names are looked for from here, {Path.cwd()})" if given_in is None else ""
        raise InputError(f"{error}{hint}") from error
    from inhand.sameness import compared

    found = compared(config.run, out)
    sentences = (*done.sentences, *found.sentences(config.run))
    return Answer(done.tables, sentences, done.entries, out, failed=bool(found.differ))


def _given_in(place: Path, out: Path | None) -> Path | None:
    """Return the folder that a run's command was given in, of the run's place and its `--out`; None if they don't tell.

    Files that the command named are looked for from there.
    """
    parts = () if out is None or out.is_absolute() or ".." in out.parts else out.parts
    return place.parents[len(parts) - 1] if parts and place.parts[-len(parts) :] == parts else None
