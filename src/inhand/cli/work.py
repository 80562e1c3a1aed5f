"""The function of each command, and the names that are looked at before it is imported."""

from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

from inhand.cli.answer import Answer
from inhand.cli.commands import MODULES
from inhand.records import Config

Names = tuple[str, ...]


def check_names(config: Config) -> None:
    """Look at what a run in the plane names, before the half second or so that its command's imports take.

    Files and hands in space are left to the command.

    Raises:
        InputError: a hand, an object, directions, a controller or a drawing that means nothing.
    """
    from inhand.hands.spatial.names import is_spatial

    hands, preset = _given(config, "hand"), getattr(config, "preset", None)
    known = hands or not hasattr(config, "run")  # a policy has a hand of its own where none is named
    if not known or str(preset).startswith("spatial") or any(_is_file(hand) or is_spatial(hand) for hand in hands):
        return
    for check, words in _looked_at(config, hands):
        for word in words:
            check(word)


def _looked_at(config: Config, hands: Names) -> Iterator[tuple[Callable[[str], object], Names]]:
    """Give names of a kind and what looks them up, which is imported as its turn comes."""
    from inhand.hands.files import load_hand, load_object

    yield load_hand, hands
    yield load_object, _named(config, "object")
    if controllers := _named(config, "controller"):
        from inhand.control.names import check_controller

        yield check_controller, controllers
    if directions := tuple(word for word in _named(config, "direction") if word != "continuous"):
        from inhand.tasks.primitives import parse_directions

        yield parse_directions, directions
    path = getattr(config, "path", None)
    if isinstance(path, str) and not Path(path).exists():
        from inhand.tracing.named import check_path

        yield check_path, (path,)


def _named(config: Config, what: str) -> Names:
    """Return the names of a kind that a configuration has, without files."""
    return tuple(word for word in _given(config, what) if not _is_file(word))


def _given(config: Config, what: str) -> Names:
    """Return the words that a configuration has in its field for one thing of a kind, or for several."""
    given = getattr(config, what, None) or getattr(config, f"{what}s", None) or ()
    found = (given,) if isinstance(given, str) else given if isinstance(given, tuple) else ()
    return tuple(word for word in found if isinstance(word, str))


def _is_file(word: str) -> bool:
    """Return whether a word is a file's: names have numbers behind their dots."""
    path = Path(word)
    return path.suffix[1:2].isalpha() or len(path.parts) > 1


def worker(command: str) -> Callable[[Config], Answer]:
    """Return the function that does a command's work; its module is imported now."""
    module = import_module(f"inhand.cli.{MODULES.get(command, command)}")
    function: Callable[[Config], Answer] = getattr(module, f"run_{command}")
    return function
