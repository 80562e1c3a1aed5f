"""Names of one kind of thing: what the package brings, and what users add from their own files and packages.

The tables of names are the one thing that a process shares: a name must mean the same wherever it is asked for.
"""

import importlib.util
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import Generic, TypeVar

from inhand.errors import InputError, near_matches

GROUP = "inhand"
"""Group of the entry points whose modules register something when they are imported."""
IN_FILE = re.compile(r"(?P<file>.+\.py):(?P<name>\w+)")
"""The form of a name in a user's own file: `my_file.py:MyController`."""

T = TypeVar("T")


class Registry(Mapping[str, T], Generic[T]):
    """Things of one kind by name; a name is taken once."""

    def __init__(self, kind: str, own: Mapping[str, T], made: Callable[[str, object], T]) -> None:
        """Begin with what the package brings.

        Args:
            kind: what a thing is called in texts.
            own: the package's own things.
            made: returns the thing that a user's name and object are, or refuses them with an `InputError`.
        """
        self.kind = kind
        self._own, self._made = dict(own), made
        self._added: dict[str, T] = {}
        self._given: dict[str, object] = {}

    def __getitem__(self, name: str) -> T:
        """Return the thing of a name that is known already."""
        return self._own[name] if name in self._own else self._added[name]

    def __iter__(self) -> Iterator[str]:
        """Give every name that is known already, the package's first."""
        return iter((*self._own, *self._added))

    def __len__(self) -> int:
        """Return how many names are known already."""
        return len(self._own) + len(self._added)

    def add(self, name: str, given: object, taken: Iterable[str] = (), source: object = None) -> None:
        """Take a user's thing up under a name.

        Args:
            name: what it is to be called.
            given: the thing.
            taken: other names that it cannot have.
            source: the user's function or class, where the thing was made of one.

        Raises:
            InputError: no usable name, one that is taken, or not such a thing.
        """
        if not re.fullmatch(r"[A-Za-z_][\w.' -]*", name):
            raise InputError(f"{self.kind} {name!r}: give a name that starts with a letter, without commas or slashes")
        own, source = name in self._own or name in taken, given if source is None else source
        if own or (name in self._added and not _again(source, self._given[name])):
            raise InputError(f"the name {name!r} is taken by another {self.kind}: give yours another name")
        self._added[name], self._given[name] = self._made(name, given), source

    def name_of(self, given: object) -> str:
        """Return the name of what a call was given: a text as it is, and a thing itself is taken up under its own.

        Raises:
            InputError: the thing has no name, one of the package's own, or is not of this kind.
        """
        if isinstance(given, str | os.PathLike):
            return os.fspath(given)
        name = str(getattr(given, "name", None) or getattr(given, "__name__", None) or type(given).__name__)
        if name in self._own:
            raise InputError(f"the name {name!r} is taken by another {self.kind}: give yours another name")
        if name not in self._added or self._given[name] is not given:
            self._added[name], self._given[name] = self._made(name, given), given
        return name

    def find(self, name: str) -> T | None:
        """Return the thing of a name, of `FILE.py:NAME`, or of an installed package's entry point; None without one.

        Raises:
            InputError: a file that cannot be read or has no such name, or a package that cannot be loaded.
        """
        if name in self:
            return self[name]
        place = IN_FILE.fullmatch(name)
        if place is None:
            load_packages()
            return self.get(name)
        module, word = load_file(Path(place["file"]).resolve()), place["name"]
        if word in self:
            return self[word]
        if not hasattr(module, word):
            mine = [
                known for known, given in self._given.items() if getattr(given, "__module__", "") == module.__name__
            ]
            told = f"; it registers {', '.join(mine)}" if mine else ""
            raise InputError(f"{place['file']} has no {word!r} and registers no {self.kind} of that name{told}")
        return self._made(word, getattr(module, word))

    def known(self, name: str) -> T:
        """Return the same, and refuse a name without one.

        Raises:
            InputError: the text offers near matches.
        """
        found = self.find(name)
        if found is None:
            allowed = f"allowed are {', '.join(self)} and" if self else "there is none of yours yet; give"
            raise InputError(f"unknown {self.kind} {name!r}{near_matches(name, self)}; {allowed} FILE.py:NAME")
        return found


@cache
def load_packages() -> None:
    """Import what installed packages name in the group `inhand` of their entry points; once is enough.

    Raises:
        InputError: one of them cannot be imported.
    """
    for each in entry_points(group=GROUP):
        try:
            each.load()
        except Exception as error:
            raise InputError(
                f"the entry point {each.name} = {each.value} of an installed package cannot be loaded: {error}; mend"
                " or remove the package"
            ) from error


@cache
def load_file(path: Path) -> ModuleType:
    """Return a user's file as a module, imported once.

    Raises:
        InputError: there is no such file, or it fails.
    """
    if not path.is_file():
        raise InputError(f"no file {path}: give FILE.py:NAME of a file of yours")
    spec = importlib.util.spec_from_file_location(f"inhand_user_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{path} cannot be imported: {type(error).__name__}: {error}; mend the file") from error
    return module


def _again(given: object, before: object) -> bool:
    """Return whether a function or class was registered before and is now defined anew, as in a notebook."""
    places = [(getattr(each, "__module__", None), getattr(each, "__qualname__", None)) for each in (given, before)]
    return given is before or (places[0] == places[1] and None not in places[0])


def describe(given: object) -> str:
    """Return what was given, for a text that refuses it."""
    return f"{type(given).__name__} {given!r}" if not isinstance(given, type) else f"the class {given.__name__}"
