"""Configuration of a design study; imports nothing heavy, so that `--help` stays fast."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from inhand.records import Config
from inhand.sim.names import ENGINE, Engine

Span: TypeAlias = tuple[float, float]
"""Lowest and highest value."""
MARK = "design.json"
"""The file that marks a folder as one of a design study."""


@dataclass(frozen=True)
class BoundsConfig(Config):
    """Between which hands a study chooses."""

    forms: tuple[Literal["2v2", "2v3", "3v2", "3v3"], ...] = ("2v2", "2v3", "3v3")
    """Numbers of links of each finger: 2v2, 2v3, 3v2, 3v3."""
    finger_mm: Span = (115.2, 144.0)
    """Bounds of each finger's length [mm]; as one value twice, it is given."""
    share: Span = (0.2, 0.75)
    """Bounds of every link's share in the length of its finger, its split."""
    palm_mm: Span = (40.0, 80.0)
    """Bounds of the palm's width, the distance between the proximal joints [mm]."""
    link_width_mm: Span = (14.0, 26.0)
    """Bounds of the links' width [mm]."""
    tip_mm: Span = (4.0, 11.0)
    """Bounds of the length of the fingertip's cap [mm]."""
    limits: tuple[Literal["free", "lab"], ...] = ("free",)
    """Joint limits: free (bodies alone stop the joints), lab (the laboratory's), or both to choose from."""
    alike: bool = False
    """Fingers are mirror images of each other."""


@dataclass(frozen=True)
class DesignConfig(BoundsConfig):
    """Search the hand that suits a job: by reach between bounds, the best few then in simulation."""

    objects: tuple[str, ...] = ("cube_39", "cylinder_40", "triangle")
    """Objects that the hand is for: names, TOML files or outlines, as of `inhand sweep`."""
    object_weights: tuple[float, ...] = ()
    """What each object counts, in their order; all alike where none is given."""
    directions: str = "all"
    """Directions that it is for: train, unseen, all, twist (cw and ccw), thesis names, letters a-h, angles in degrees,
    or paths of yours (docs/extend.md), separated by commas."""
    direction_weights: tuple[float, ...] = ()
    """What each direction counts, in the order in which they are told; all alike where none is given."""
    aims: tuple[str, ...] = ("mean", "length")
    """What is wanted, the foremost first: mean (mean reach), least (reach of the worst object and direction), length
    (total length of the fingers, short), tolerance (mean reach of the worst of hands a little off)."""
    hands: int = 200
    """Hands to look at; a study that is done goes on with a larger number."""
    sampler: Literal["tpe", "nsga2"] = "tpe"
    """Optuna's sampler that proposes hands: tree-structured Parzen estimators, or NSGA-II."""
    finalists: int = 4
    """Hands of the front, the best by the first aim, to confirm in simulation."""
    controllers: tuple[str, ...] = ("ik", "rl-privileged")
    """Controllers that confirm them, each where it runs on the hand; the first one's distance names the winner."""
    seeds: int = 3
    """Trials for each direction in simulation, each of another seed."""
    engine: Engine = ENGINE
    """Physics engine of the simulation."""
    seed: int = 0
    """Seed of the search, and the first one of the simulation."""
    jobs: int = 0
    """Hands computed at a time, one on each core; 0 takes every core."""
    out: Path = Path("results/design")
    """Folder of the study; what it holds of the same study is not computed again."""
    overwrite: bool = False
    """Replace another study that the folder holds."""
