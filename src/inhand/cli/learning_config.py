"""Configuration of `inhand train` and `inhand evaluate`; imports nothing heavy, so that `--help` stays fast."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from inhand.records import Config
from inhand.sim.names import MUJOCO, Engine


@dataclass(frozen=True)
class TrainConfig(Config):
    """Train a controller from the expert's demonstrations and its own episodes (DDPGfD; extra `rl`)."""

    preset: Literal["default", "thesis", "smoke"] | None = None
    """Training: default learns best, thesis as its chapter 3.3 has it, smoke shows in seconds that all works. What is
    not given below is the preset's."""
    hand: str | None = None
    """Hand: a name of the laboratory's form (`inhand hands`) or a TOML file."""
    object: str | None = None
    """Object: a name (`inhand objects`), shape_SIZE in mm, or a TOML file."""
    directions: Literal["train", "continuous"] | None = None
    """train: the 8 of the Asterisk Test. continuous: these and the circle between, the 8 unseen ones left out."""
    engine: Engine | None = None
    """Physics engine: mujoco, or bullet as a witness (extra `bullet`; much slower)."""
    seed: int | None = None
    """Seed of everything drawn."""
    episodes: int | None = None
    """Episodes of the agent after which training ends."""
    out: Path = Path("results/train")
    """Folder of the run."""
    resume: bool = False
    """Go on with the run of the folder from its last checkpoint, by its own configuration."""
    overwrite: bool = False
    """Replace the run that the folder holds."""


@dataclass(frozen=True)
class EvaluateConfig(Config):
    """Evaluate a learned policy beside the expert from the same starts, and show what failed and why."""

    run: tyro.conf.Positional[str] = "rl"
    """The folder of a run of `inhand train` (its best policy) or of a policy, or rl, the policy of the package."""
    last: bool = False
    """Evaluate the last policy of the run instead of its best."""
    hand: str | None = None
    """Hand: a name of the laboratory's form or a TOML file; without it the one that the policy was trained with."""
    object: str | None = None
    """Object: a name, shape_SIZE in mm, or a TOML file; without it the one that the policy was trained with."""
    engine: Engine = MUJOCO
    """Physics engine: mujoco, or bullet as a witness (extra `bullet`; much slower)."""
    trials: int = 3
    """Trials for each of the 16 directions, for table and figures; the first of the episodes."""
    episodes: int = 100
    """Episodes in which lost objects are counted, spread evenly over the 16 directions."""
    human: Path | None = None
    """Folder of recorded human trials to set beside both."""
    seed: int = 0
    """Seed of the start noise."""
    noise_mm: float = 1.0
    """Standard deviation of the object's start in x and y [mm]."""
    noise_deg: float = 1.0
    """Standard deviation of the object's start rotation [deg]."""
    out: Path = Path("results/evaluate")
    """Folder to write the evaluation to."""
    overwrite: bool = False
    """Replace the evaluation that the folder holds."""
