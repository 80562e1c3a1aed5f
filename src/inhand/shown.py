"""What a function of the front door returns shows itself in a notebook: its table and its figure."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


class Shown:
    """Gives a notebook the table and the figure of a value that has both."""

    def table(self) -> DataFrame:
        """Return its numbers."""
        raise NotImplementedError

    def figure(self) -> Figure:
        """Return its figure."""
        raise NotImplementedError

    def _repr_html_(self) -> str:
        """Return the table as a notebook shows it."""
        return str(self.table().to_html(index=False, float_format="{:.2f}".format))

    def _repr_png_(self) -> bytes:
        """Return the figure as a notebook shows it."""
        with io.BytesIO() as file:
            self.figure().savefig(file, format="png")
            return file.getvalue()


def frame(entries: Sequence[dict[str, Any]]) -> DataFrame:
    """Return entries of a JSON as a table, dicts in them as columns of their own; heavy parts are imported now."""
    import pandas as pd

    return pd.json_normalize([dict(entry) for entry in entries])


def listed(words: str | Sequence[str | float]) -> str:
    """Return words, names or angles as the one text that a command line has."""
    return words if isinstance(words, str) else ",".join(str(word) for word in words)
