"""The command line, called in the process of the tests."""

from typing import Protocol


class Call(Protocol):
    """Runs `inhand` in this process; returns its exit code and what it printed on stdout and stderr."""

    def __call__(self, *words: object) -> tuple[int, str, str]:
        """Run it with the words of a command line."""
