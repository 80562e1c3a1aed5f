"""Write a figure to a file: whole or not at all, and the same bytes every time."""

import zlib
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from inhand.errors import InputError
from inhand.folders import in_place
from inhand.pages import Picture
from inhand.plots.paper import paper

PNG_DPI = 160
"""Resolution of PNG files [dots/in]: sharp on a page at 9 pt, small enough for a repository."""

WRITTEN: dict[str, dict[str, Any]] = {
    ".png": {"metadata": {"Software": None}, "pil_kwargs": {"compress_type": zlib.Z_RLE}},
    ".pdf": {"metadata": {"CreationDate": None, "ModDate": None, "Creator": None, "Producer": None}},
    ".svg": {"metadata": {"Date": None, "Creator": None}},
}
"""Suffixes that `save_figure` writes, and how: without dates and versions, which would change the bytes. Lines on white
are runs of equal pixels: to look for more in them is a fifth of the time that a figure takes."""


def save_figure(figure: Figure, path: Path | str) -> Path:
    """Write a figure as PNG (160 dpi), PDF or SVG, chosen by the suffix, and return the path.

    The file appears whole under its name or not at all; missing folders are made; equal figures give equal bytes.

    Raises:
        InputError: the suffix is none of .png, .pdf and .svg.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in WRITTEN:
        raise InputError(f"cannot write a figure as {path.name!r}: the suffix must be .png, .pdf or .svg; rename it")
    # These two have no argument in savefig: identifiers in SVG files are random without a salt, and journals
    # refuse PDF files with Type 3 fonts. The context puts the caller's settings back.
    with in_place(path) as part, mpl.rc_context({"svg.hashsalt": "inhand", "pdf.fonttype": 42}):
        figure.savefig(part, format=suffix[1:], dpi=PNG_DPI, facecolor="white", **WRITTEN[suffix])
    return path


def save_picture(figure: Figure, folder: Path, name: str, text: str) -> Picture:
    """Write a figure into `figures` of a run's folder and return it as a part of the run's page.

    What is drawn for decides the suffix of its name.
    """
    name = Path(name).with_suffix(paper().suffix).as_posix()
    save_figure(figure, folder / "figures" / name)
    return Picture(text, f"figures/{name}")
