"""The folder of a training run: made, checked, gone on from, finished."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from inhand.control.policy import both_layouts
from inhand.errors import InputError
from inhand.folders import check_folder
from inhand.hands.files import load_hand, load_object
from inhand.learning.config import PRESETS, Learning, Training
from inhand.learning.journal import Evaluation
from inhand.learning.recording import Told
from inhand.learning.setup import Ready, load_ready, make_ready, save_ready
from inhand.learning.training import Trainer
from inhand.tasks.observations import find_layout
from inhand.versions import versions

MARK = "config.json"
"""The file that marks a folder as a training run's."""
FORMAT = 1
"""Version of the folder."""
WORKING = ("checkpoint.npz", "ready.npz", "expert.rows", "agent.rows")
"""What only a run that is not finished needs."""


def train(
    config: Training,
    out: Path,
    told: tuple[Told, Callable[[Evaluation], None]],
    *,
    overwrite: bool = False,
) -> Path:
    """Train in a new folder and return the folder of the best policy.

    Args:
        config: what to train.
        out: the run's folder.
        told: told how far the preparations are, and every evaluation.
        overwrite: whether a run that the folder holds may be replaced.

    Raises:
        InputError: a configuration that cannot be trained or a folder that may not be written.
    """
    check(config)
    check_folder(out, overwrite=overwrite, mark=MARK)
    if out.exists():
        shutil.rmtree(out)
    out.mkdir(parents=True)
    (out / MARK).write_text(json.dumps(card_of(config), indent=1) + "\n")
    return _go(config, out, told)


def resume(out: Path, told: tuple[Told, Callable[[Evaluation], None]]) -> Path:
    """Go on with the run of a folder from its last checkpoint and return the folder of the best policy.

    Raises:
        InputError: no run there, one that is finished, or one of another version or observation layout.
    """
    config = read_config(out)
    if finished(out):
        raise InputError(f"the run in {out} is finished; its policy is in {out / 'best'}. Train another with --out")
    return _go(config, out, told)


def finished(out: Path) -> bool:
    """Return whether the run of a folder has come to its end."""
    return (out / "finished.json").is_file()


def read_config(out: Path) -> Training:
    """Return the configuration of a run's folder.

    Raises:
        InputError: no run there, or one of another version or observation layout; the text shows both layouts.
    """
    path = out / MARK
    if not path.is_file():
        raise InputError(f"no training run in {out}: it has no {MARK}; give the --out of a run of `inhand train`")
    try:
        card = json.loads(path.read_text())
        config = _config(card["config"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path} is not a training run's configuration: {error}; train anew") from error
    ours = card_of(config)
    for what in ("format", "version"):
        if card[what] != ours[what]:
            raise InputError(
                f"the run in {out} is of {what} {card[what]}, this is {ours[what]}: a run goes on only with the same;"
                " train anew, or use the version that began it"
            )
    if card["layout"] != ours["layout"]:
        raise InputError(
            f"the run in {out} learned from other observations than this version gives: train anew\n"
            + both_layouts(card["layout"], ours["layout"])
        )
    return config


def check(config: Training) -> None:
    """Refuse what cannot be trained.

    Raises:
        InputError: the text names the value.
    """
    load_hand(config.hand)
    load_object(config.object)
    find_layout(config.interface.observation)
    least = {
        "episodes": config.episodes,
        "demonstrations": config.recipe.episodes,
        "worlds": config.worlds,
        "batch": config.learning.batch,
        "look_ahead": config.learning.look_ahead,
        "horizon": config.interface.horizon,
    }
    for name, value in least.items():
        if value < 1:
            raise InputError(f"{name} {value}: give at least 1")
    if config.seed < 0:
        raise InputError(f"--seed {config.seed}: a seed is 0 or more")
    if not 0 < config.learning.discount <= 1:
        raise InputError(f"discount {config.learning.discount:g}: give a number above 0, at most 1")


def preset(name: str) -> Training:
    """Return a preset by name.

    Raises:
        InputError: there is none of that name.
    """
    if name not in PRESETS:
        raise InputError(f"unknown preset {name!r}; allowed are {', '.join(PRESETS)}")
    return PRESETS[name]()


def _go(config: Training, out: Path, told: tuple[Told, Callable[[Evaluation], None]]) -> Path:
    began = time.perf_counter()
    ready = _ready(config, out, told[0])
    trainer = Trainer(config, ready, out, told[1], told[0])
    best = trainer.run()
    sitting = {"last_sitting_s": time.perf_counter() - began}
    (out / "finished.json").write_text(json.dumps(vars(trainer.counters) | sitting) + "\n")
    for name in WORKING:
        (out / name).unlink(missing_ok=True)
    return best


def _ready(config: Training, out: Path, told: Told) -> Ready:
    path = out / "ready.npz"
    if path.is_file():
        return load_ready(config, path)
    for name in WORKING:
        (out / name).unlink(missing_ok=True)
    ready = make_ready(config, out, told)
    save_ready(ready, path)
    return ready


def card_of(config: Training) -> dict[str, Any]:
    """Return what a run's folder says of itself."""
    layout = find_layout(config.interface.observation)
    found = versions()
    return {
        "format": FORMAT,
        "version": found["inhand"].partition(" ")[0],
        "layout": [layout.name, layout.card()],
        "config": asdict(config),
        "versions": found,
    }


def _config(entry: dict[str, Any]) -> Training:
    default = Training("")
    parts: dict[str, Any] = {
        name: type(getattr(default, name))(**entry[name]) for name in ("interface", "recipe", "noise")
    }
    learning = entry["learning"]
    parts["learning"] = Learning(**(learning | {"hidden": tuple(learning["hidden"])}))
    return Training(**(entry | parts))
