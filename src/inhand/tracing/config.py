"""Configuration of `inhand trace`; imports nothing heavy, so that `--help` stays fast."""

from dataclasses import dataclass
from pathlib import Path

from inhand.control.run_config import GravityConfig, HeldConfig, TrialsConfig

MARK = "trace.json"
"""The file that marks a folder as one of a trace."""


@dataclass(frozen=True)
class TraceConfig(TrialsConfig, GravityConfig, HeldConfig):
    """Trace a drawing with the object, or do a task, as a sequence of motion primitives."""

    path: str = "square"
    """square, triangle, circle, figure-eight, star, a letter A to Z, an SVG or DXF file, a CSV file of way-points
    (x_mm, y_mm, theta_deg), or a task: pose, place, tour, wall or key. Of a hand in space also helix, each in a plane
    of the palm frame (A@xy, A@xz, A@yz) and joined by + (A@xy+B@xz); its tasks are pose, place and reorient."""
    size: float | None = None
    """Larger side of the drawing [mm]; without it 60 % of the reachable size, or the size that a file gives."""
    scale: bool = False
    """Scale a drawing that is too large down to the largest that fits, instead of refusing it."""
    out: Path = Path("results/trace")
    """Folder to write the run to."""
    overwrite: bool = False
    """Replace the run that the folder holds."""
