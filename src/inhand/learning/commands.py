"""Configurations of `inhand record`, `train` and `evaluate`; imports nothing heavy, so that `--help` stays fast."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from inhand.control.run_config import GravityConfig, HeldConfig, RunConfig, SpreadConfig
from inhand.sim.names import Engine

EXPERT = "ik"
"""The controller that a policy is set beside; its trials lie in a folder of that name."""


@dataclass(frozen=True)
class RecordConfig(RunConfig, HeldConfig):
    """Record an expert's demonstrations as a Minari dataset (extra `rl`)."""

    directions: str | None = None
    """train, unseen, all, thesis names, letters a-h or angles in degrees; or continuous: half of the draws the 8 of the
    Asterisk Test, half anywhere on the circle but within 5 deg of the 8 unseen ones. Without it train. Of a hand in
    space the words of `inhand asterisk`, all,turns without it, or continuous: these, and 96 directions and 48 axes
    drawn on the sphere."""
    gravity: str | None = None
    """Gravity of a hand in space by where its palm looks, up, down or sideways, three numbers in the palm frame along
    which it pulls (0,-1,-1), or sphere: every start its own; without it sphere."""
    expert: Literal["ik", "ik-cautious", "thesis-ik", "teacher"] = "ik"
    """Controller that demonstrates; thesis-ik holds the object on the middle of its sides, the teacher knows every
    world as it was drawn. Of a hand in space ik or teacher."""
    episodes: int = 5000
    """Number of episodes."""
    observation: str | None = None
    """Layout of observations: grip, grip-open, senses or thesis (table 3.1), in space space, space-senses or
    space-thesis; without it grip or space."""
    actions: Literal["steps", "fine", "angles"] = "steps"
    """steps (how far joint targets move on), fine steps, or angles (joint targets over their ranges, thesis 3.3.2)."""
    reward: str = "progress"
    """Reward: progress, gain or thesis (3.3.3)."""
    horizon: int | None = None
    """Decisions after which an episode is cut off; one takes 20 ms. Without it 200, in space 180."""
    push: float = 0.01
    """Largest standard deviation of the noise on the expert's joint targets [rad]; each episode draws its own."""
    midway: float = 0.25
    """Share of the episodes that start where an earlier one was under way, in a new direction."""
    whole: float = 1.0
    """Share of the episodes that go as far as their grip reaches; the others stop somewhere before."""
    grip_spread: float = 0.0
    """Standard deviation of the angle between an episode's direction and the one whose grip it starts with [deg]."""
    out: Path | None = None
    """Folder of the dataset; without it results/datasets and the dataset's id in there."""
    overwrite: bool = False
    """Replace the dataset that the folder holds."""


@dataclass(frozen=True)
class TrainConfig(SpreadConfig):
    """Train a controller from the expert's demonstrations and its own episodes (DDPGfD; extra `rl`)."""

    preset: Literal[
        "default",
        "privileged",
        "family",
        "family-privileged",
        "from-family",
        "spatial",
        "spatial-privileged",
        "thesis",
        "smoke",
        None,
    ] = None  # not `| None`: tyro would list them in any order
    """Training: default on encoders and a camera in worlds that differ, privileged on perfect knowledge, family with
    hands and objects that differ, from-family fits its policy to one hand and object, spatial with a hand in space,
    spatial-privileged the same on perfect knowledge, thesis is as its chapter 3.3 has it, smoke shows in seconds that
    all works. With a hand in space default and privileged are spatial and spatial-privileged, and thesis has its
    chapter 3.3 as far as that has a meaning there. What is not given below is the preset's."""
    hand: str | None = None
    """Hand: a name of the laboratory's form (`inhand hands`) or a TOML file."""
    object: str | None = None
    """Object: a name (`inhand objects`), shape_SIZE in mm, a TOML file, or an outline in a CSV, SVG or DXF file with
    its unit and mass, as part.dxf:unit=mm:mass_kg=0.05."""
    directions: Literal["train", "continuous", None] = None
    """train: the 8 of the Asterisk Test. continuous: these and the circle between, the 8 unseen ones left out."""
    engine: Literal[Engine, None] = None
    """Physics engine: planar (MuJoCo's contact law in the plane), mujoco (in three dimensions, several times as slow),
    or bullet as a witness (extra `bullet`; much slower)."""
    disturb: str | None = None
    """What disturbs worlds, senses and commands: none, bench, field, hard, or a TOML file (docs/disturbances.md)."""
    demonstrations: Path | None = None
    """Learn from the demonstrations of this dataset (`inhand record`) instead of recording some."""
    seed: int | None = None
    """Seed of everything drawn."""
    seeds: tuple[int, ...] = ()
    """Train once with each of these seeds, in folders seed-0, seed-1, ... side by side, and tell the spread. The same
    command goes on where it was stopped."""
    episodes: int | None = None
    """Episodes of the agent after which training ends."""
    out: Path = Path("results/train")
    """Folder of the run, or of the runs of --seeds."""
    resume: bool = False
    """Go on with the run of the folder from its last checkpoint, by its own configuration."""
    overwrite: bool = False
    """Replace the run that the folder holds."""


@dataclass(frozen=True)
class EvaluateConfig(RunConfig, GravityConfig):
    """Evaluate a learned policy beside the expert from the same starts, and show what failed and why."""

    run: str = "rl"
    """The folder of a run of `inhand train` (its best policy) or of a policy, or rl, the policy of the package."""
    last: bool = False
    """Evaluate the last policy of the run instead of its best."""
    hand: str | None = None
    """Hand: a name of the laboratory's form or a TOML file; without it the one that the policy was trained with."""
    object: str | None = None
    """Object: a name, shape_SIZE in mm, a TOML file or an outline, as part.dxf:unit=mm:mass_kg=0.05; without it the one
    that the policy was trained with."""
    trials: int = 3
    """Trials for each of the 16 directions, for table and figures; the first of the episodes. With a hand in space for
    each of 26 directions, 6 turns and 24 directions that training never shows."""
    episodes: int = 100
    """Episodes in which lost objects are counted, spread evenly over all of these."""
    human: Path | None = None
    """Folder of recorded human trials to set beside both."""
    out: Path = Path("results/evaluate")
    """Folder to write the evaluation to."""
    overwrite: bool = False
    """Replace the evaluation that the folder holds."""
