"""The commands and what each is configured with; imports nothing heavy, so that `--help` stays fast."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from inhand.asterisk_test.config import AsteriskConfig, ReachCommand
from inhand.asterisk_test.design.config import DesignConfig
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.learning.commands import EvaluateConfig, RecordConfig, TrainConfig
from inhand.records import Config
from inhand.tracing.config import TraceConfig


@dataclass(frozen=True, kw_only=True)
class Printing(Config):
    """What every command has besides: where its settings come from, and what it prints."""

    config: Path | None = None
    """TOML file of settings, such as the `run.toml` of a run's folder; what is given here comes before what it says."""
    quiet: bool = False
    """Print nothing but errors, and with --json that."""
    json: bool = False
    """Print the result as JSON, alone on stdout; how far it is goes to stderr."""


@dataclass(frozen=True)
class MetricsConfig(Config):
    """Measure recorded trials (.npz of a run) or human files (.csv) alone."""

    files: tyro.conf.Positional[tuple[Path, ...]]
    """Trial files, human files, folders of runs or of their trials, or folders of human files."""
    out: Path | None = None
    """Write the numbers to this JSON file too; it holds the same `trials` list as a run's metrics.json."""
    gaps: Literal["refuse", "drop", "fill"] = "refuse"
    """Frames in which the camera did not see the object have empty rows: refuse the recording, drop them, or fill them
    with a line between their neighbours. The table says how many they were."""


@dataclass(frozen=True)
class EvaluateCommand(EvaluateConfig):
    """Evaluate a learned policy beside the expert from the same starts, and show what failed and why."""

    run: tyro.conf.Positional[str] = EvaluateConfig.run
    """The folder of a run of `inhand train` (its best policy) or of a policy, or rl, the policy of the package."""


@dataclass(frozen=True)
class ExportConfig(Config):
    """Write a policy as an ONNX model or a folder with a model card, or trials and demonstrations for others."""

    run: tyro.conf.Positional[str]
    """A policy: the folder of a run of `inhand train` (its best) or of a policy, rl or rl-family. Or data: the folder
    of a run of asterisk, trace or evaluate, one of `inhand record`, or a trial's .npz file."""
    form: Annotated[Literal["onnx", "policy", "csv", "minari", "lerobot"], tyro.conf.arg(name="as")] = "onnx"
    """onnx (a model with its contract, extra `onnx`), policy (a folder with its card); csv (recordings in the form of
    the Asterisk Test), minari (extra `rl`), lerobot (LeRobotDataset v3, extra `lerobot`)."""
    hand: str | None = None
    """For a policy, the hand that it is to drive: rl is what --controller rl is with it. Without it that of the
    standard hand of the plane."""
    object: str | None = None
    """For a policy, the object that it is to move, likewise."""
    results: Path | None = None
    """For the card of a policy: the folder of its `inhand evaluate`."""
    out: Path | None = None
    """The file or the folder to write; without it policy.onnx, or results/export and the run's name in there."""
    overwrite: bool = False
    """Replace what is there of an earlier export."""


@dataclass(frozen=True)
class ImportConfig(Config):
    """Make a dataset to learn from of demonstrations in a LeRobotDataset v3 or in Minari's form."""

    dataset: tyro.conf.Positional[Path]
    """Its folder."""
    like: Path | None = None
    """A dataset of `inhand record` whose hand, object, observations and actions it has, where it does not say."""
    out: Path = Path("results/datasets/imported")
    """Folder of the new dataset."""
    overwrite: bool = False
    """Replace the dataset that the folder holds."""


@dataclass(frozen=True)
class ReportConfig(Config):
    """Make the page of a run for a browser from its folder, old ones too, or set runs side by side on one page."""

    runs: tyro.conf.Positional[tuple[Path, ...]]
    """Folders of runs; several of them are compared. A trial's .npz file is a run of its own."""
    out: Path | None = None
    """The file to write; without it report.html in the run's folder, or comparison.html here for several runs."""
    open: bool = False
    """Open the page in a browser."""
    overwrite: bool = False
    """Replace a file of that name."""


@dataclass(frozen=True)
class ViewConfig(Config):
    """Show a trial in MuJoCo's viewer, or in a browser where there is no display or no extra `viewer`."""

    trial: tyro.conf.Positional[Path]
    """A .npz file from the `trials` folder of a run."""
    speed: float = 1.0
    """Speed of the replay in the viewer; 1 is real time. A browser's page has a choice of its own."""
    browser: bool = False
    """Show it in a browser in any case."""
    rerun: bool = False
    """Write it as a recording for Rerun's viewer, with contacts, forces and signals (extra `rerun`), and show it there
    if there is a display."""
    out: Path | None = None
    """File for the page of the browser, or for Rerun's recording (.rrd); without it one in a temporary folder."""


@dataclass(frozen=True)
class FiguresConfig(Config):
    """Draw a run's figures again, for a paper, or those of one of its trials, with its replay."""

    run: tyro.conf.Positional[Path]
    """The folder of a run, or a .npz file from its `trials`."""
    format: Literal["pdf", "svg", "png"] = "pdf"
    """Form of the files."""
    width_mm: float | None = None
    """Width of every figure [mm], such as a column's 85: texts of 7 pt, legends below, no heading. Without it figures
    are as large as they need."""
    out: Path | None = None
    """Folder to write to; without it results/figures and the run's name in there."""
    overwrite: bool = False
    """Replace the figures that the folder holds."""


@dataclass(frozen=True)
class AgainConfig(Config):
    """Run again what a folder holds, by its run.toml, and tell whether all numbers are the same."""

    run: tyro.conf.Positional[Path]
    """The folder of a run."""
    out: Path | None = None
    """Folder to write the new run to; without it the folder's name and `-again`."""
    overwrite: bool = False
    """Replace the run that the new folder holds."""


@dataclass(frozen=True)
class HandsConfig(Config):
    """List the hands of the catalogue and the form of a hand's name."""


@dataclass(frozen=True)
class ObjectsConfig(Config):
    """List the objects of the catalogue and the form of an object's name."""


@dataclass(frozen=True)
class DoctorConfig(Config):
    """Tell what this installation has and lacks: versions, cores, engines, extras, pictures, caches."""


@dataclass(frozen=True)
class CompletionConfig(Config):
    """Print what makes a shell complete the words of `inhand`, as in: eval "$(inhand completion bash)"."""

    shell: tyro.conf.Positional[Literal["bash", "zsh", "tcsh"]]
    """The shell."""


COMMANDS: dict[str, type[Config]] = {
    "asterisk": AsteriskConfig,
    "trace": TraceConfig,
    "reach": ReachCommand,
    "sweep": SweepConfig,
    "design": DesignConfig,
    "robustness": RobustnessConfig,
    "record": RecordConfig,
    "train": TrainConfig,
    "evaluate": EvaluateCommand,
    "export": ExportConfig,
    "import": ImportConfig,
    "metrics": MetricsConfig,
    "view": ViewConfig,
    "figures": FiguresConfig,
    "report": ReportConfig,
    "again": AgainConfig,
    "hands": HandsConfig,
    "objects": ObjectsConfig,
    "doctor": DoctorConfig,
    "completion": CompletionConfig,
}
"""What each command is configured with."""
MODULES = {"hands": "lists", "objects": "lists", "import": "imports"}
"""The module of a command in `inhand.cli`, where it has not its name."""
