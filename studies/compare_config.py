"""Configuration of the study; imports nothing heavy, so that `--help` stays fast."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from inhand.control.run_config import SpreadConfig


@dataclass(frozen=True)
class CompareConfig(SpreadConfig):
    """Compare primitives in sequence with training end to end; a study that was stopped goes on where it was."""

    tasks: tuple[str, ...] = ("square:60", "place", "key")
    """Tasks to train on end to end, each by itself: of `inhand trace`, or a drawing with its size in mm."""
    others: tuple[str, ...] = ("star:70", "pose")
    """Tasks that no controller trains on."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """Seeds of the trainings."""
    episodes: int = 50
    """Episodes of every controller on every task."""
    budget: float = 0.5
    """Environment steps of every training, as a share of those of the preset `privileged`."""
    disturb: tuple[str, ...] = ("none", "field")
    """What disturbs the episodes, one after another: none, bench, field, hard, or a TOML file."""
    adaptation: tuple[int, ...] = (4, 16, 64, 256)
    """Numbers of demonstrations with which training end to end on a new task is tried; none leaves that part out."""
    hand: str = "2v2_50.50_50.50_1.1_53"
    """Hand: a name of the laboratory's form (`inhand hands`) or a TOML file."""
    object: str = "cube_39"
    """Object: a name (`inhand objects`), shape_SIZE in mm, or a TOML file."""
    out: Path = Path("results/compare")
    """Folder of the study; what it holds of the same settings is not computed again."""
