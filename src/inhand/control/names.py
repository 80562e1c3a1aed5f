"""Names of the toolkit's controllers, without what they run; imports nothing heavy."""

from collections.abc import Iterable
from importlib.metadata import entry_points
from pathlib import Path

from inhand.errors import InputError, near_matches
from inhand.registry import GROUP, IN_FILE

EXPERTS = ("ik", "ik-cautious", "thesis-ik", "ik-sliding", "ik-sensed")
"""Controllers of hands in the plane that are no policies."""
LEARNED, FAMILY = "rl", "rl-family"
"""The policy of the package on real senses for one hand and one object, and that for hands and objects that differ."""
SHIPPED = {
    LEARNED: "default",
    "rl-privileged": "privileged",
    FAMILY: "family",
    f"{FAMILY}-privileged": "family-privileged",
}
"""Policies that come with the package by name, each with the preset that trained it, which is its folder."""


def check_controller(name: str) -> None:
    """Refuse what can be no controller of a hand in the plane, before anything that controls is imported.

    Raises:
        InputError: no name of the toolkit's, no folder, not `FILE.py:NAME`, and no package is installed that adds any.
    """
    known = (*EXPERTS, *SHIPPED)
    if name not in known and not Path(name).is_dir() and not IN_FILE.fullmatch(name) and not entry_points(group=GROUP):
        raise unknown_controller(name, known)


def unknown_controller(name: str, known: Iterable[str]) -> InputError:
    """Return the refusal of a name that no controller has, with near matches among those that are known."""
    known = tuple(known)
    if name == "rl-sensed":
        return InputError("controller 'rl-sensed' is called rl now, and what was rl is called rl-privileged")
    return InputError(
        f"unknown controller {name!r}{near_matches(name, known)}; allowed are {', '.join(known)}, the folder of a"
        " run of `inhand train` and FILE.py:NAME"
    )
