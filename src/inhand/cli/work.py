"""The function of each command, and the names that are looked at before it is imported."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from inhand.cli.answer import Answer
from inhand.cli.commands import MODULES
from inhand.records import Config


def check_names(config: Config) -> None:
    """Look at the names of a hand and an object in the plane, before the second or so that a command's imports take.

    Files and hands in space are left to the command.

    Raises:
        InputError: a name that means nothing.
    """
    hand, thing = getattr(config, "hand", None), getattr(config, "object", None)
    if not isinstance(hand, str) or _is_file(hand):
        return
    from inhand.hands.files import load_hand, load_object
    from inhand.hands.spatial.names import is_spatial

    if is_spatial(hand):
        return
    load_hand(hand)
    if isinstance(thing, str) and not _is_file(thing):
        load_object(thing)


def _is_file(word: str) -> bool:
    """Return whether a word is a file's: names have numbers behind their dots."""
    path = Path(word)
    return path.suffix[1:2].isalpha() or len(path.parts) > 1


def worker(command: str) -> Callable[[Config], Answer]:
    """Return the function that does a command's work; its module is imported now."""
    module = import_module(f"inhand.cli.{MODULES.get(command, command)}")
    function: Callable[[Config], Answer] = getattr(module, f"run_{command}")
    return function
