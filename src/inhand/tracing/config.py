"""Configuration of `inhand trace`; imports nothing heavy, so that `--help` stays fast."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from inhand.sim.names import MUJOCO, Engine


@dataclass(frozen=True)
class TraceConfig:
    """Trace a drawing with the object, or do a task, as a sequence of motion primitives."""

    path: str = "square"
    """square, triangle, circle, figure-eight, star, a letter A to Z, an SVG or DXF file, a CSV file of way-points
    (x_mm, y_mm, theta_deg), or a task: pose, place, tour, wall or key."""
    size: float | None = None
    """Larger side of the drawing [mm]; without it 60 % of the reachable size, or the size that a file gives."""
    scale: bool = False
    """Scale a drawing that is too large down to the largest that fits, instead of refusing it."""
    controller: str = "ik"
    """Low-level controller: ik, ik-cautious, thesis-ik, rl (a learned policy), or the folder of a run of
    `inhand train`."""
    hand: str = "2v2_50.50_50.50_1.1_53"
    """Hand: a name of the laboratory's form (`inhand hands`) or a TOML file."""
    object: str = "cube_39"
    """Object: a name (`inhand objects`), shape_SIZE in mm, a TOML file, or an outline in a CSV, SVG or DXF file with
    its unit and mass, as part.dxf:unit=mm:mass_kg=0.05."""
    engine: Engine = MUJOCO
    """Physics engine: mujoco, or bullet as a witness (extra `bullet`; much slower, no walls)."""
    trials: int = 3
    """Number of trials, each with its own start noise, and of a task its own draw."""
    seed: int = 0
    """Seed of the start noise and of what tasks draw."""
    noise_mm: float = 1.0
    """Standard deviation of the object's start in x and y [mm]."""
    noise_deg: float = 1.0
    """Standard deviation of the object's start rotation [deg]."""
    out: Path = Path("results/trace")
    """Folder to write the run to."""
    overwrite: bool = False
    """Replace the run that the folder holds."""
