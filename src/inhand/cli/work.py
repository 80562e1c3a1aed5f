"""The function of each command."""

from collections.abc import Callable
from importlib import import_module

from inhand.cli.answer import Answer
from inhand.cli.commands import MODULES
from inhand.records import Config


def worker(command: str) -> Callable[[Config], Answer]:
    """Return the function that does a command's work; its module is imported now."""
    module = import_module(f"inhand.cli.{MODULES.get(command, command)}")
    function: Callable[[Config], Answer] = getattr(module, f"run_{command}")
    return function
