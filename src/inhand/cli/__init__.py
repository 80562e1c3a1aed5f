"""The command line: `inhand` and a command.

The commands: asterisk, trace, reach, sweep, robustness, design, record, train, evaluate, export, metrics, view, hands
and objects.
`inhand help` and `inhand help trace` are other words for `--help`; `inhand --version` tells the version.
Each command's configuration is light; what it runs is imported only when it is run, so that `--help` stays fast.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Literal

import tyro

from inhand import __version__
from inhand.asterisk_test.config import AsteriskConfig, ReachCommand
from inhand.asterisk_test.design.config import DesignConfig
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.errors import InputError
from inhand.learning.commands import EvaluateConfig, RecordConfig, TrainConfig
from inhand.records import Config
from inhand.tracing.config import TraceConfig


@dataclass(frozen=True)
class MetricsConfig(Config):
    """Measure recorded trials (.npz of a run) or human files (.csv) alone."""

    files: tyro.conf.Positional[tuple[Path, ...]]
    """Trial files, human files, folders of runs, or folders of human files."""
    json: Path | None = None
    """Write the numbers to this file too; it holds the same `trials` list as a run's metrics.json."""
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
    """Write a learned policy as an ONNX model, with its contract in the metadata (extra `onnx`)."""

    policy: tyro.conf.Positional[str]
    """The folder of a run of `inhand train` (its best policy) or of a policy, or rl, the policy of the package."""
    out: Path = Path("policy.onnx")
    """The file to write."""
    overwrite: bool = False
    """Replace a file of that name."""


@dataclass(frozen=True)
class ViewConfig(Config):
    """Show a trial in MuJoCo's viewer; needs a display and the extra `viewer`."""

    trial: tyro.conf.Positional[Path]
    """A .npz file from the `trials` folder of a run."""
    speed: float = 1.0
    """Speed of the replay; 1 is real time."""


@dataclass(frozen=True)
class HandsConfig(Config):
    """List the hands of the catalogue and the form of a hand's name."""


@dataclass(frozen=True)
class ObjectsConfig(Config):
    """List the objects of the catalogue and the form of an object's name."""


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
    "metrics": MetricsConfig,
    "view": ViewConfig,
    "hands": HandsConfig,
    "objects": ObjectsConfig,
}
"""What each command is configured with."""


def main() -> None:
    """Run the console command `inhand`; bad input ends with its text and exit code 2, Ctrl-C with 130."""
    words = sys.argv[1:]
    if words[:1] in (["--version"], ["-V"]):
        sys.stdout.write(f"inhand {__version__}\n")
        return
    if words[:1] == ["help"]:
        words = [*words[1:], "--help"]
    try:
        _run(configuration(words))
    except InputError as error:
        sys.stderr.write(f"inhand: {error}\n")
        sys.exit(2)
    except KeyboardInterrupt:
        sys.stderr.write("inhand: stopped; nothing was overwritten\n")
        sys.exit(130)


def _unchecked(kind: type[Config]) -> type[Config]:
    """Return a configuration that looks at no field: what it refuses, tyro would tell in a form of its own."""
    return type(kind.__name__, (kind,), {"__doc__": kind.__doc__, "__post_init__": lambda _: None})


def configuration(words: Sequence[str]) -> Config:
    """Return the configuration that a command and its options give.

    Raises:
        InputError: a value that its option cannot have; of words that mean nothing tyro tells, and exits.
    """
    unchecked: Config = tyro.extras.subcommand_cli_from_dict(
        {name: _unchecked(kind) for name, kind in COMMANDS.items()},
        args=words,
        prog="inhand",
        description="Structured in-hand manipulation: the Asterisk Test in simulation, beside people.",
        config=(tyro.conf.OmitSubcommandPrefixes, tyro.conf.OmitArgPrefixes),
    )
    kind: type[Config] = type(unchecked).__mro__[1]
    try:
        return kind(**vars(unchecked))
    except InputError as error:
        name, _, told = str(error).partition(" ")
        raise InputError(f"--{name.replace('_', '-')} {told}") from error


RUNS = {
    AsteriskConfig: "asterisk",
    TraceConfig: "trace",
    ReachCommand: "reach",
    SweepConfig: "sweep",
    DesignConfig: "design",
    RobustnessConfig: "robustness",
    RecordConfig: "record",
    TrainConfig: "train",
    EvaluateCommand: "evaluate",
}
"""The module of each command that runs something; its function is `run_` and the same name."""


def _run(config: object) -> None:
    name = RUNS.get(type(config))
    if name is not None:
        getattr(import_module(f"inhand.cli.{name}"), f"run_{name}")(config)
    elif isinstance(config, MetricsConfig):
        from inhand.cli.metrics import run_metrics

        run_metrics(config.files, config.json, config.gaps)
    elif isinstance(config, ExportConfig):
        from inhand.cli.export import run_export

        run_export(config.policy, config.out, overwrite=config.overwrite)
    elif isinstance(config, ViewConfig):
        from inhand.cli.view import run_view

        run_view(config.trial, config.speed)
    else:
        from inhand.cli.lists import list_hands, list_objects

        (list_hands if isinstance(config, HandsConfig) else list_objects)()
