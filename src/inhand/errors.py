"""Errors that a user can mend, and the near matches they offer."""

import difflib
import re
from collections.abc import Iterable

LONGEST = 200
"""Letters of a word that a text shows whole."""


class InputError(ValueError):
    """Input that cannot be used: the text says what was given, what is allowed and what to do."""


def near_matches(given: str, allowed: Iterable[str], count: int = 3) -> str:
    """Return `; did you mean A or B?` for the names closest to `given`, or an empty string."""
    names = {name.lower(): name for name in allowed}
    close = difflib.get_close_matches(given.lower(), names, n=count, cutoff=0.5)
    return f"; did you mean {' or '.join(names[name] for name in close)}?" if close else ""


def shortened(text: str) -> str:
    """Return a text whose words of more than `LONGEST` letters, as names can be, lack their middles."""
    return re.sub(rf"\S{{{LONGEST + 1},}}", lambda word: f"{word[0][:100]}[...]{word[0][-50:]}", text)


def needs_extra(extra: str, what: str) -> InputError:
    """Return the error to raise where `what` asks for a package that only the extra `extra` installs."""
    return InputError(f"{what} needs the extra `{extra}`: pip install 'inhand[{extra}]'")
