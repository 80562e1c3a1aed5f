"""Configuration of the study; imports nothing heavy, so that `--help` stays fast."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from inhand.hands.pair_family import HELD_OUT_HANDS, HELD_OUT_OBJECTS

STANDARD = "2v2_50.50_50.50_1.1_53"
"""The hand that `rl-privileged` was trained with."""


@dataclass(frozen=True)
class FamilyConfig:
    """Try a policy of the family with hands and objects that it never saw; a study that was stopped goes on."""

    policy: str = "rl-family"
    """The policy: rl-family, or the folder of a run of `inhand train --preset family`."""
    hands: tuple[str, ...] = HELD_OUT_HANDS
    """Hands: names of the laboratory's form or TOML files."""
    objects: tuple[str, ...] = HELD_OUT_OBJECTS
    """Objects: names, shape_SIZE in mm, or TOML files."""
    directions: str = "all,twist"
    """train, unseen, all, twist (cw and ccw), names or degrees, separated by commas."""
    sample: int = 1
    """Tries one of so many pairs, other objects with each hand; 1 tries all."""
    disturb: str = "none"
    """What disturbs worlds, senses and commands: none, bench, field, hard, or a TOML file."""
    seed: int = 0
    """Seed of the start noise."""
    new: tuple[str, ...] = (STANDARD, "2v3_25.75_25.35.40_1.1_53", "3v3_25.40.35_40.35.25_1.1_63")
    """Hands that the policy is fitted to from a few demonstrations; none leaves that part out."""
    demonstrations: tuple[int, ...] = (1, 10, 100)
    """Numbers of demonstrations of a new hand."""
    new_object: str = "cube_39"
    """Object that they are of."""
    jobs: int = 0
    """Hands and objects computed at a time, one on each core; 0 takes every core."""
    out: Path = Path("results/family")
    """Folder of the study; what it holds of the same settings is not computed again."""
