"""Configuration of a run of the Asterisk Test; imports nothing heavy, so that `--help` stays fast."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from inhand.control.run_config import GravityConfig, HeldConfig, TrialsConfig


@dataclass(frozen=True)
class ReachCommand(GravityConfig, HeldConfig):
    """Compute how far a hand could carry an object in each direction, whatever controls it."""

    directions: str = "all,twist"
    """train, unseen, all, twist (cw and ccw), thesis names, letters a-h or angles in degrees, separated by commas."""
    twist: float = 0.0
    """Twist to hold in translations [deg], each way: turned first, clockwise (p) and counter-clockwise (m)."""
    friction: float | None = None
    """Coefficient of friction between finger and object; without it the product of both bodies'."""
    rotation_deg: float = 0.0
    """Largest rotation of the object away from the straight path's own [deg]."""
    resolution_mm: float = 2.0
    """Step along the path and along the object's outline [mm]; in space contacts are three steps apart."""
    out: Path = Path("results/reach")
    """Folder to write reach.json and the figures to."""
    overwrite: bool = False
    """Replace the reach that the folder holds."""


@dataclass(frozen=True)
class AsteriskConfig(TrialsConfig, GravityConfig, HeldConfig):
    """Run the Asterisk Test in simulation and report it beside human trials."""

    paths: Literal["straight", "human"] = "straight"
    """Reference paths: straight lines, or paths extracted from the human trials of --human."""
    human: Path | None = None
    """Folder of recorded human trials, to follow with --paths human and to draw beside the simulation."""
    beside: tuple[Path, ...] = ()
    """Folders of earlier runs (at most 2) to set beside this one in table, panels and radar."""
    label: tuple[str, ...] = ()
    """Names of this run and of those of --beside, in that order, instead of what differs between them."""
    directions: str = "all"
    """train, unseen, all, twist (cw and ccw), thesis names, letters a-h or angles in degrees, separated by commas. Of a
    hand in space also turns, axes, edges, corners, map, names as Out-Right-Up and vectors as 1:2:0."""
    twist: float = 0.0
    """Twist to hold in translations [deg], each way: turned first, clockwise (p) and counter-clockwise (m)."""
    metrics: tuple[str, ...] = ()
    """Metrics of yours to measure too: registered names, or FILE.py:NAME (docs/extend.md)."""
    one_grasp: bool = False
    """One grasp of a hand in space for all directions and turns, instead of one for each."""
    regrasp: bool = False
    """Let fingers be placed anew while the object rests on the floor (ik alone, undisturbed, in the plane); what that
    reaches stands in a table of its own, as the test forbids to let go."""
    phases: tuple[str, ...] = ()
    """Phases of yours between grip and manipulation, in their order: registered names, or FILE.py:NAME."""
    out: Path = Path("results/asterisk")
    """Folder to write the run to."""
    compatible: bool = False
    """Also compute the metrics and averages of the Asterisk Test software (slower)."""
    overwrite: bool = False
    """Replace the run that the folder holds."""
