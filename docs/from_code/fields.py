"""What is written in docstrings."""

import inspect
from collections.abc import Callable
from typing import Any


def first_paragraph(given: Callable[..., Any]) -> str:
    """Return the first paragraph of a docstring on one line."""
    return " ".join((inspect.getdoc(given) or "").partition("\n\n")[0].split())
