"""Errors that a user can mend, and the near matches they offer."""

import difflib
from collections.abc import Iterable


class InputError(ValueError):
    """Input that cannot be used: the text says what was given, what is allowed and what to do."""


def near_matches(given: str, allowed: Iterable[str], count: int = 3) -> str:
    """Return `; did you mean A or B?` for the names closest to `given`, or an empty string."""
    names = {name.lower(): name for name in allowed}
    close = difflib.get_close_matches(given.lower(), names, n=count, cutoff=0.5)
    return f"; did you mean {' or '.join(names[name] for name in close)}?" if close else ""


def needs_extra(extra: str, what: str) -> InputError:
    """Return the error to raise where `what` asks for a package that only the extra `extra` installs."""
    return InputError(f"{what} needs the extra `{extra}`: pip install 'inhand[{extra}]'")
