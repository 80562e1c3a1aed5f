"""Configuration of a sweep; imports nothing heavy, so that `--help` stays fast."""

from dataclasses import dataclass
from pathlib import Path

from inhand.control.run_config import GravityConfig, SpreadConfig, TrialsConfig

HANDS = (
    "2v2_50.50_50.50_1.1_53",
    "2v2_50.50_50.50_1.1_53:lab-limits",
    "2v2_65.35_65.35_1.1_53",
    "2v2_35.65_35.65_1.1_53",
    "2v2_35.65_50.50_1.1_63",
    "2v2_70.30_50.50_0.9.1_53",
    "2v2_50.50_50.50_0.8.1_63",
    "2v2_50.50_50.50_1.1_80",
    "2v3_25.75_25.35.40_1.1_53",
    "2v3_50.50_40.30.30_1.1_63",
    "3v3_25.40.35_40.35.25_1.1_63",
    "3v3_40.30.30_40.30.30_1.1_53",
)
"""A range of hands: links even and uneven, fingers alike and not, narrow and wide palms, two joints and three."""
OBJECTS = (
    "cube_39",
    "rectangle_33x22",
    "rectangle_46x15",
    "cylinder_40",
    "ellipse_40x25",
    "triangle",
    "teardrop",
    "pentagon",
    "trapezoid",
    "hourglass",
)
"""A range of objects: flat and round, shallow and deep, slanted, pointed and concave."""


@dataclass(frozen=True)
class SweepConfig(SpreadConfig, TrialsConfig, GravityConfig):
    """Run the Asterisk Test with every hand on every object; a sweep that was stopped goes on where it was."""

    hands: tuple[str, ...] = HANDS
    """Hands: names (`inhand hands`) or TOML files."""
    objects: tuple[str, ...] = OBJECTS
    """Objects: names (`inhand objects`), TOML files, or outlines in CSV, SVG or DXF files with their unit and mass, as
    part.dxf:unit=mm:mass_kg=0.05."""
    directions: str = "all"
    """train, unseen, all, twist (cw and ccw), thesis names, letters a-h or angles in degrees, separated by commas; of
    hands in space the words of `inhand asterisk`."""
    trials: int = 1
    """Trials for each direction, each with its own start noise."""
    regrasp: bool = False
    """Let fingers be placed anew, as in `inhand asterisk`; what that reaches has tables and heat maps of its own."""
    jobs: int = 0
    """Hands and objects computed at a time, one on each core; 0 takes every core."""
    out: Path = Path("results/sweep")
    """Folder of the sweep; what it holds of the same settings is not computed again."""
    overwrite: bool = False
    """Compute again what the folder holds of other settings."""
