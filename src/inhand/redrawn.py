"""The figures of a saved run drawn again: for a paper, or of another of its trials."""

import shutil
import tempfile
from pathlib import Path
from typing import Literal

from inhand.errors import InputError
from inhand.folders import run_folder
from inhand.plots.paper import MM_PER_IN, Paper, drawn_for
from inhand.repeats import NAME

NARROWEST_MM, WIDEST_MM = 40.0, 400.0
"""Widths between which figures are drawn [mm]: guessed, half a narrow column to a large poster's."""


def redraw(
    place: Path,
    out: Path,
    form: Literal["pdf", "svg", "png"] = "pdf",
    *,
    width_mm: float | None = None,
    overwrite: bool = False,
) -> list[Path]:
    """Draw the figures of a run's folder, or of one trial's `.npz` file, into a folder, and return their files.

    A trial's replay is among them.

    Args:
        place: the folder or the file.
        out: where to.
        form: of the files.
        width_mm: of every figure [mm], without its heading; None for as large as it needs, with its heading.
        overwrite: whether figures that the folder holds may be replaced.

    Raises:
        InputError: no run there, a width that no figure has, or a folder that may not be written.
    """
    if width_mm is not None and not NARROWEST_MM <= width_mm <= WIDEST_MM:
        raise InputError(
            f"--width-mm {width_mm:g}: give {NARROWEST_MM:g} to {WIDEST_MM:g} mm, such as 85 for one column or 178"
            " for two"
        )
    if not place.exists():
        raise InputError(f"{place} is not there: give the folder of a run, or a trial's .npz file")
    from inhand.loading import load

    run = load(place)
    wide = None if width_mm is None else width_mm / MM_PER_IN
    with run_folder(out, overwrite=overwrite, mark=NAME) as folder, tempfile.TemporaryDirectory() as scratch:
        with drawn_for(Paper(f".{form}", wide)):
            run.draw(Path(scratch))
        shutil.copytree(Path(scratch) / "figures", folder, dirs_exist_ok=True)
    return sorted(path for path in out.rglob("*") if path.is_file())
