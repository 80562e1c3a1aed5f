"""Configuration of a study of robustness; imports nothing heavy, so that `--help` stays fast."""

from dataclasses import dataclass
from pathlib import Path

from inhand.control.run_config import DrawConfig, GravityConfig, HeldConfig, SpreadConfig


@dataclass(frozen=True)
class RobustnessConfig(SpreadConfig, DrawConfig, GravityConfig, HeldConfig):
    """Run the Asterisk Test with every controller under every disturbance; what was stopped goes on where it was."""

    controllers: tuple[str, ...] = ("ik", "ik-sensed", "rl")
    """Controllers: names, or folders of runs of `inhand train`; of several seeds of one training the range is told."""
    disturbances: tuple[str, ...] = ("levels", "singles")
    """What the tables tell: levels (bench, field, hard), singles (one quantity each), names or TOML files
    (docs/disturbances.md); field@0.5 is half as strong as field."""
    curves: tuple[str, ...] = ("field",)
    """The same, each at all `strengths`, to draw what is kept against the strength; none for no curve."""
    strengths: tuple[float, ...] = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5)
    """How strong the curves' disturbances are: 0 is nothing, which is always run, 1 what they say, at most 10."""
    directions: str = "all"
    """train, unseen, all, twist (cw and ccw), thesis names, letters a-h or angles in degrees, separated by commas; of a
    hand in space the words of `inhand asterisk`."""
    trials: int = 6
    """Trials for each direction, each with its own start noise and its own world."""
    jobs: int = 0
    """Controllers under disturbances computed at a time, one on each core; 0 takes every core."""
    out: Path = Path("results/robustness")
    """Folder of the study; what it holds of the same settings is not computed again."""
    overwrite: bool = False
    """Compute again what the folder holds of other settings."""
