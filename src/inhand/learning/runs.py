"""The folder of a training run: made, checked, gone on from, finished."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from inhand.errors import InputError
from inhand.folders import alone, check_folder, clear, writing
from inhand.hands.files import load_hand, load_object
from inhand.learning.config import PRESETS, Training
from inhand.learning.journal import Evaluation
from inhand.learning.progress import BEST, PAGE
from inhand.learning.recording import Told
from inhand.learning.setup import Ready, load_ready, make_ready, save_ready
from inhand.learning.training import Trainer
from inhand.records import read_json, read_record, text_of
from inhand.sim.engines import check_engine
from inhand.sim.memory import WORLD_BYTES, check_memory
from inhand.tasks.cards import NEW, InterfaceCard, check_same, interface_card
from inhand.tasks.observations import find_layout
from inhand.tasks.rewards import find_reward
from inhand.versions import versions

MARK = "config.json"
"""The file that marks a folder as a training run's."""
FORMAT = 2
"""Version of the folder; see `inhand.tasks.cards.NEW`."""
WORKING = ("checkpoint.npz", "ready.npz", "expert.rows", "agent.rows")
"""What only a run that is not finished needs."""


@dataclass(frozen=True)
class RunCard:
    """What a run's folder says of itself."""

    format: int
    """Version of the folder."""
    version: str
    """Version of this package."""
    interface: InterfaceCard
    """How the controller sees and acts."""
    config: Training
    """What is trained, and how."""
    versions: dict[str, str]
    """Versions of what it runs on."""


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
    with alone(out, out), writing(out):
        clear(out)
        (out / MARK).write_text(text_of(card_of(config)))
        return _go(config, out, told)


def resume(out: Path, told: tuple[Told, Callable[[Evaluation], None]]) -> Path:
    """Go on with the run of a folder from its last checkpoint and return the folder of the best policy.

    Raises:
        InputError: no run there, one that is finished and has its page, one of another version or observation layout,
            or one that another process is busy with.
    """
    config = read_config(out)
    if finished(out) and (out / PAGE).is_file():
        raise InputError(f"the run in {out} is finished; its policy is in {out / BEST}. Train another with --out")
    with alone(out, out), writing(out):
        return out / BEST if finished(out) else _go(config, out, told)


def finished(out: Path) -> bool:
    """Return whether the run of a folder has come to its end."""
    return (out / "finished.json").is_file()


def read_config(out: Path) -> Training:
    """Return the configuration of a run's folder.

    Raises:
        InputError: no run there, or one of another version or observation layout; the text names what differs.
    """
    path = out / MARK
    if not path.is_file():
        raise InputError(f"no training run in {out}: it has no {MARK}; give the --out of a run of `inhand train`")
    try:
        card = read_record(read_json(path.read_bytes()), RunCard, FORMAT, NEW)
        check_same(card.interface, card.config.interface.observation, card.config.interface.actions)
        _check_version(card)
    except InputError as error:
        raise InputError(
            f"the run in {out} cannot be gone on with: {error}. Train anew, or use the version that began it"
        ) from error
    return card.config


def check(config: Training) -> None:
    """Refuse what cannot be trained.

    Raises:
        InputError: the text names the value.
    """
    load_hand(config.hand)
    load_object(config.object)
    find_layout(config.interface.observation)
    find_reward(config.interface.reward)
    check_engine(config.engine)
    check_memory(f"worlds={config.worlds}", config.worlds, WORLD_BYTES[config.engine])
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


def _check_version(card: RunCard) -> None:
    ours = card_of(card.config).version
    if card.version != ours:
        raise InputError(f"it is of version {card.version}, this is {ours}")


def card_of(config: Training) -> RunCard:
    """Return what a run's folder says of itself."""
    found = versions()
    interface = interface_card(find_layout(config.interface.observation), config.interface.actions)
    return RunCard(FORMAT, found["inhand"].partition(" ")[0], interface, config, found)
