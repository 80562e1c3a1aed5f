"""Training as a function: what to train and how in, a finished run in its folder out."""

from __future__ import annotations

import importlib.util
import os
import shlex
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from inhand.control.loop import Told
from inhand.control.policy import Policy, load_policy
from inhand.errors import InputError, near_matches, needs_extra
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import hand_name, object_name
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.learning.commands import TrainConfig
from inhand.learning.config import Training
from inhand.learning.presets import preset as preset_named
from inhand.learning.progress import BEST, CHECKPOINT, READY, Learned, read_learning
from inhand.learning.run_cards import MARK, check, read_config
from inhand.records import configured
from inhand.repeats import write_repeat
from inhand.shown import HTML, Kept, path_of
from inhand.sim.disturbance import disturbance_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from inhand.learning.journal import Evaluation

PACKAGES = ("jax", "optax", "tensorboardX", "threadpoolctl")
"""What the extra `rl` brings and training cannot do without."""
CHOSEN = ("hand", "object", "directions", "engine", "disturb", "demonstrations", "seed", "episodes")
"""Settings of the command line that take the place of the preset's."""
Telling = tuple[Told, "Callable[[Evaluation], None]"]
"""Told how far the preparations are, and every evaluation."""
SILENT: Telling = (lambda *_: None, lambda _: None)
"""Tells nobody."""


@dataclass(frozen=True, eq=False)
class Trained(Kept):
    """A training run in its folder."""

    mark = MARK

    config: Training
    """What was trained, and how."""
    learned: Learned
    """Its record: every episode, every round of updates, every evaluation."""

    @property
    def title(self) -> str:
        """What was trained, in one line."""
        config = self.config
        return f"{config.preset} training, {_names(config)}, seed {config.seed}"

    @property
    def best(self) -> Path:
        """The folder of the best policy."""
        return self.folder / BEST

    @property
    def policy(self) -> Policy:
        """The best policy: gives actions `(B, n)` for observations `(B, d)`."""
        return load_policy(self.best)

    def table(self) -> DataFrame:
        """Return a row for each direction: what the best policy reached in its evaluation, and the expert."""
        from pandas import DataFrame

        found = self.learned.best
        return DataFrame([{"direction": name} | asdict(each) for name, each in found.directions.items()])

    def html(self) -> str:
        """Return its page for a browser."""
        from inhand.learning.browser import training_page
        from inhand.learning.report import training_parts
        from inhand.plots.page.document import settings_of

        parts = training_parts(self.learned, self.folder.resolve().name, self.title, _line_of(self))
        return training_page(parts, self.learned, settings_of(self.config))

    def figure(self) -> Figure:
        """Return rewards and losses over the episodes."""
        from inhand.learning.figures import learning_figure

        return learning_figure(self.learned, self.folder.resolve().name, self.title)

    def draw(self, folder: Path) -> None:
        """Draw the learning curves into `figures` of a folder."""
        from inhand.learning.report import curve_pictures

        curve_pictures(self.learned, folder, self.folder.resolve().name, self.title)


def train(
    hand: str | Path | HandSpec | SpatialHand | None = None,
    object: str | Path | ObjectSpec | SolidSpec | None = None,
    preset: str = "default",
    *,
    episodes: int | None = None,
    seed: int | None = None,
    demonstrations: str | os.PathLike[str] | None = None,
    out: str | Path | None = None,
    overwrite: bool = False,
    resume: bool = False,
    **settings: Any,
) -> Trained:
    """Train a controller from an expert's demonstrations and its own episodes, and return the run.

    Args:
        hand: a name, a TOML file or a spec; None for the preset's.
        object: the same.
        preset: one of `inhand.learning.presets.PRESETS`, such as default, on real senses, or smoke, of seconds.
        episodes: episodes of the agent after which training ends.
        seed: of everything drawn.
        demonstrations: a dataset of `inhand.record` or its folder to learn from; None records by the preset.
        out: folder of the run; None for a temporary one.
        overwrite: whether a run that the folder holds may be replaced.
        resume: whether to go on with the run of the folder, by its own configuration.
        settings: other fields of `Training` or of its parts, such as imitate, hidden, batch, push and reward.

    Raises:
        InputError: anything that cannot be trained; the text says what, and what is allowed.
    """
    check_installed()
    folder = Path(tempfile.mkdtemp(prefix="inhand-train-")) if out is None else Path(path_of("out", out))
    shown = None if demonstrations is None else path_of("demonstrations", demonstrations)
    named: dict[str, Any] = {"hand": hand and hand_name(hand), "object": object and object_name(object)}
    named |= {"episodes": episodes, "seed": seed, "demonstrations": shown} | settings | disturbance_of(settings)
    given = {name: value for name, value in named.items() if value is not None}
    if resume:
        refuse_changes(given, folder)
        return go_on(folder)
    return begin(changed(preset_named(preset, given.get("hand")), given), folder, overwrite=overwrite)


def run_train(config: TrainConfig, told: Telling = SILENT) -> Trained:
    """Train by the words of the command line, or go on, and return the run with its page.

    Raises:
        InputError: anything in the configuration that cannot be trained, or a folder that may not be written.
    """
    check_installed()
    if (config.jobs, config.backend, config.address) != (0, "loky", None):
        raise InputError("--jobs, --backend and --address are for several trainings: give --seeds, or leave them out")
    given = _given(config)
    if config.resume:
        preset, overwrite = {"preset": config.preset} if config.preset else {}, {"overwrite": ""}
        refuse_changes(preset | given | (overwrite if config.overwrite else {}), config.out)
        return go_on(config.out, told)
    return begin(asked(config), config.out, told, overwrite=config.overwrite)


def asked(config: TrainConfig) -> Training:
    """Return the training that words of the command line ask for.

    Raises:
        InputError: a value that it cannot have.
    """
    return changed(preset_named(config.preset or "default", config.hand), _given(config))


def _given(config: TrainConfig) -> dict[str, Any]:
    given = {name: value for name in CHOSEN if (value := getattr(config, name)) is not None}
    return given | ({"demonstrations": str(given["demonstrations"])} if "demonstrations" in given else {})


def begin(config: Training, out: Path, told: Telling = SILENT, *, overwrite: bool = False) -> Trained:
    """Train in a new folder and write the run's page.

    Raises:
        InputError: as `inhand.learning.runs.train`.
    """
    check(config)  # before JAX is imported
    from inhand.learning import runs

    runs.train(config, out, told, overwrite=overwrite)
    return _told(out)


def go_on(out: Path, told: Telling = SILENT) -> Trained:
    """Go on with the run of a folder and write its page.

    Raises:
        InputError: as `inhand.learning.runs.resume`.
    """
    read_config(out)  # refuses what is no run before JAX is imported
    from inhand.learning import runs

    runs.resume(out, told)
    return _told(out)


def load_training(folder: Path) -> Trained:
    """Return the training run of a folder.

    Raises:
        InputError: there is none, or one that has not been evaluated yet.
    """
    return Trained(read_config(folder), folder, read_learning(folder))


def check_installed() -> None:
    """Refuse where the extra is missing.

    Raises:
        InputError: the text tells how to install it.
    """
    if any(importlib.util.find_spec(name) is None for name in PACKAGES):
        raise needs_extra("rl", "`inhand train`")


def changed(config: Training, given: dict[str, Any]) -> Training:
    """Return a training with other values of its fields, or of the fields of its parts.

    Raises:
        InputError: a name that neither has.
    """
    own = [field.name for field in fields(config)]
    parts = {name: part for name in own if is_dataclass(part := getattr(config, name))}
    homes = {field.name: name for name, part in parts.items() for field in fields(part)} | dict.fromkeys(own, "")
    for name, value in given.items():
        if name not in homes:
            allowed = ", ".join(homes)
            raise InputError(f"unknown keyword {name!r}{near_matches(name, homes)}; allowed are {allowed}")
        home = homes[name]
        config = replace(config, **{home: replace(getattr(config, home), **{name: value})} if home else {name: value})
    return config


def command_of(config: Training, out: Path) -> TrainConfig | None:
    """Return the words of the command line that train so; None for what only Python can say."""
    given = {name: value for name in CHOSEN if (value := getattr(config, name)) != ""}
    try:
        words = configured(TrainConfig, given | {"preset": config.preset, "out": out})
        same = changed(preset_named(config.preset, config.hand), given) == config
    except InputError:
        return None
    return words if same else None


def _line_of(found: Trained) -> str:
    """Return the command line that trains so; an empty text for what only Python can say."""
    from inhand.asterisk_test.study import command

    words = command_of(found.config, found.folder)
    return "" if words is None else command("train", words)


def refuse_changes(given: dict[str, Any], out: Path) -> None:
    """Refuse settings beside --resume, which goes on with the run's own.

    Raises:
        InputError: the text names them.
    """
    if given:
        names = ", ".join(f"--{name}" for name in given)
        raise InputError(
            f"--resume goes on with the configuration of the run in {out}: leave out {names}, or train anew with"
            " another --out"
        )


def kept(out: Path) -> tuple[str, str]:
    """Return what a run that was stopped has kept, and how to go on with it."""
    again = f"Go on with: {shlex.join(['inhand', 'train', '--out', str(out), '--resume'])}"
    if (out / CHECKPOINT).is_file():
        episode = read_learning(out).evaluations[-1].episode
        return f"Stopped. Kept: the run up to episode {episode}, and its best policy in {out / BEST}.", again
    if (out / READY).is_file():
        return "Stopped before the first checkpoint. Kept: grasps and demonstrations.", again
    if out.is_dir():
        return "Stopped before all demonstrations were there; they will be recorded anew.", again
    return "Stopped before anything was written.", "Begin with the same command again."


def _names(config: Training) -> str:
    """Return the names of object and hand, not their files' paths, unless the files have gone."""
    try:
        hand, thing = config.held
    except InputError:
        return f"{config.object} with {config.hand}"
    return f"{thing.name} with {hand.name}"


def _told(out: Path) -> Trained:
    from inhand.learning.report import write_training

    found = load_training(out)
    write_training(found.learned, out, found.title, _line_of(found))
    (out / HTML).write_text(found.html(), encoding="utf-8")
    words = command_of(found.config, out)
    if words is not None:
        write_repeat(out, "train", words)
    found.table().to_csv(out / "directions.csv", index=False)
    return found
