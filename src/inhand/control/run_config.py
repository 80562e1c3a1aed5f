"""Settings that commands share; imports nothing heavy, so that `--help` stays fast."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from inhand.records import Config
from inhand.sim.names import ENGINE, Engine


@dataclass(frozen=True)
class HeldConfig(Config):
    """Which object is in which hand."""

    hand: str = "2v2_50.50_50.50_1.1_53"
    """Hand: a name of the laboratory's form (`inhand hands`) or a TOML file."""
    object: str = "cube_39"
    """Object: a name (`inhand objects`), shape_SIZE in mm, a TOML file, or an outline in a CSV, SVG or DXF file with
    its unit and mass, as part.dxf:unit=mm:mass_kg=0.05."""


@dataclass(frozen=True)
class GravityConfig(Config):
    """How a hand in space is held."""

    gravity: str | None = None
    """Gravity of a hand in space (3f_60.60_40_10) by where its palm looks, up, down or sideways, or three numbers in
    the palm frame along which it pulls (0,-1,-1); without it up. Hands in the plane lie on a floor."""


@dataclass(frozen=True)
class SpreadConfig(Config):
    """Over what the pieces of a study are spread, and where its folder is."""

    jobs: int = 0
    """Pieces computed at a time, one on each core; 0 takes every core."""
    backend: Literal["loky", "ray", "dask", "slurm"] = "loky"
    """What computes them: processes of this machine (loky), a Ray or Dask cluster (extras `ray`, `dask`), or an array
    of SLURM's jobs (extra `slurm`); past one machine all must see the folder (docs/commands.md)."""
    address: str | None = None
    """Address of a running Ray or Dask cluster (auto: Ray's of this machine); without it one of this machine alone."""
    out: Path = Path("results/study")
    """Folder of the study."""


@dataclass(frozen=True)
class DrawConfig(Config):
    """In what is simulated, and how starts are drawn."""

    engine: Engine = ENGINE
    """Physics engine: planar (MuJoCo's contact law in the plane), mujoco (in three dimensions, several times as slow;
    hands in space run in it whatever is the default), or bullet as a witness (extra `bullet`; slower, no walls)."""
    seed: int = 0
    """Seed of everything drawn: the start noise, and what tasks draw."""
    noise_mm: float = 1.0
    """Standard deviation of the object's start in x and y [mm]."""
    noise_deg: float = 1.0
    """Standard deviation of the object's start rotation [deg]."""


@dataclass(frozen=True)
class RunConfig(DrawConfig):
    """What every run is simulated in, and what is drawn in it."""

    disturb: str = "none"
    """What disturbs worlds, senses and commands, unknown to the controller: none, bench, field, hard, one quantity such
    as friction-0.6, or a TOML file (docs/disturbances.md); field@0.5 is half as strong."""


@dataclass(frozen=True)
class TrialsConfig(RunConfig):
    """What runs of trials have besides."""

    controller: str = "ik"
    """Controller: ik, ik-cautious, ik-sliding (whose contacts may slide), thesis-ik, ik-sensed (on encoders and a
    camera alone), rl (policies that were learned on these, for any hand and object of a family), rl-privileged (one
    that knows all), rl-family-privileged, or the folder of a run of `inhand train`."""
    trials: int = 3
    """Trials for each direction or drawing, each with its own start noise, and of a task its own draw."""
