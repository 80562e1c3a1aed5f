"""Configuration of a run of the Asterisk Test; imports nothing heavy, so that `--help` stays fast."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from inhand.sim.names import MUJOCO, Engine


@dataclass(frozen=True)
class ReachCommand:
    """Compute how far a hand could carry an object in each direction, whatever controls it."""

    hand: str = "2v2_50.50_50.50_1.1_53"
    """Hand: a name of the laboratory's form (`inhand hands`) or a TOML file."""
    object: str = "cube_39"
    """Object: a name (`inhand objects`), shape_SIZE in mm, a TOML file, or an outline in a CSV, SVG or DXF file with
    its unit and mass, as part.dxf:unit=mm:mass_kg=0.05."""
    directions: str = "all,twist"
    """train, unseen, all, twist (cw and ccw), thesis names, letters a-h or angles in degrees, separated by commas."""
    twist: float = 0.0
    """Twist to hold in translations [deg], each way: turned first, clockwise (p) and counter-clockwise (m)."""
    friction: float | None = None
    """Coefficient of friction between finger and object; without it the product of both bodies'."""
    rotation_deg: float = 0.0
    """Largest rotation of the object away from the straight path's own [deg]."""
    resolution_mm: float = 2.0
    """Step along the path and along the object's outline [mm]."""
    out: Path = Path("results/reach")
    """Folder to write reach.json and the figures to."""
    overwrite: bool = False
    """Replace the reach that the folder holds."""


@dataclass(frozen=True)
class AsteriskConfig:
    """Run the Asterisk Test in simulation and report it beside human trials."""

    hand: str = "2v2_50.50_50.50_1.1_53"
    """Hand: a name of the laboratory's form (`inhand hands`) or a TOML file."""
    object: str = "cube_39"
    """Object: a name (`inhand objects`), shape_SIZE in mm, a TOML file, or an outline in a CSV, SVG or DXF file with
    its unit and mass, as part.dxf:unit=mm:mass_kg=0.05."""
    controller: str = "ik"
    """Controller: ik, ik-cautious, thesis-ik, rl (a learned policy), or the folder of a run of `inhand train`."""
    engine: Engine = MUJOCO
    """Physics engine: MuJoCo, or PyBullet as a witness (extra `bullet`; much slower)."""
    paths: Literal["straight", "human"] = "straight"
    """Reference paths: straight lines, or paths extracted from the human trials of --human."""
    human: Path | None = None
    """Folder of recorded human trials, to follow with --paths human and to draw beside the simulation."""
    beside: tuple[Path, ...] = ()
    """Folders of earlier runs (at most 2) to set beside this one in table, panels and radar."""
    directions: str = "all"
    """train, unseen, all, twist (cw and ccw), thesis names, letters a-h or angles in degrees, separated by commas."""
    twist: float = 0.0
    """Twist to hold in translations [deg], each way: turned first, clockwise (p) and counter-clockwise (m)."""
    trials: int = 3
    """Trials for each direction, each with its own start noise."""
    seed: int = 0
    """Seed of the start noise: with the direction and the trial's number it gives where an object starts."""
    noise_mm: float = 1.0
    """Standard deviation of the object's start in x and y [mm]."""
    noise_deg: float = 1.0
    """Standard deviation of the object's start rotation [deg]."""
    metrics: tuple[str, ...] = ()
    """Metrics of yours to measure too: registered names, or FILE.py:NAME (docs/extend.md)."""
    out: Path = Path("results/asterisk")
    """Folder to write the run to."""
    compatible: bool = False
    """Also compute the metrics and averages of the Asterisk Test software (slower)."""
    overwrite: bool = False
    """Replace the run that the folder holds."""
