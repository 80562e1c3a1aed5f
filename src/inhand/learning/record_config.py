"""Configuration of `inhand record`; imports nothing heavy, so that `--help` stays fast."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from inhand.records import Config
from inhand.sim.names import MUJOCO, Engine


@dataclass(frozen=True)
class RecordConfig(Config):
    """Record an expert's demonstrations as a Minari dataset (extra `rl`)."""

    hand: str = "2v2_50.50_50.50_1.1_53"
    """Hand: a name of the laboratory's form (`inhand hands`) or a TOML file."""
    object: str = "cube_39"
    """Object: a name (`inhand objects`), shape_SIZE in mm, or a TOML file."""
    directions: str = "train"
    """train, unseen, all, thesis names, letters a-h or angles in degrees; or continuous, anywhere on the circle."""
    expert: Literal["ik", "ik-cautious", "thesis-ik"] = "ik"
    """Controller that demonstrates; thesis-ik holds the object on the middle of its sides."""
    episodes: int = 5000
    """Number of episodes."""
    observation: str = "grip"
    """Layout of observations: grip, grip-open or thesis (table 3.1)."""
    actions: Literal["steps", "fine", "angles"] = "steps"
    """steps (how far joint targets move on), fine steps, or angles (joint targets over their ranges, thesis 3.3.2)."""
    reward: str = "progress"
    """Reward: progress, gain or thesis (3.3.3)."""
    horizon: int = 200
    """Decisions after which an episode is cut off; one takes 20 ms."""
    noise_mm: float = 1.0
    """Standard deviation of the object's start in x and y [mm]."""
    noise_deg: float = 1.0
    """Standard deviation of the object's start rotation [deg]."""
    push: float = 0.01
    """Largest standard deviation of the noise on the expert's joint targets [rad]; each episode draws its own."""
    midway: float = 0.25
    """Share of the episodes that start where an earlier one was under way, in a new direction."""
    whole: float = 1.0
    """Share of the episodes that go as far as their grip reaches; the others stop somewhere before."""
    grip_spread: float = 0.0
    """Standard deviation of the angle between an episode's direction and the one whose grip it starts with [deg]."""
    engine: Engine = MUJOCO
    """Physics engine: mujoco, or bullet as a witness (extra `bullet`; much slower)."""
    seed: int = 0
    """Seed of everything drawn."""
    out: Path | None = None
    """Folder of the dataset; without it results/datasets and the dataset's id in there."""
    overwrite: bool = False
    """Replace the dataset that the folder holds."""
