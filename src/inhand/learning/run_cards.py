"""What the folder of a training run says of itself, and what of a configuration cannot be trained."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from inhand.control.catalogue import find_controller
from inhand.control.policy import Policy
from inhand.control.spatial_weight import check_carried
from inhand.errors import InputError
from inhand.hands.fit import Held
from inhand.hands.spatial.pair import AnyPair, SpatialPair
from inhand.learning.config import Training
from inhand.learning.dataset_cards import CONTINUOUS, DatasetHead, SpatialHead, check_fits, kind_of
from inhand.learning.datasets import check_installed, read_head
from inhand.learning.demonstrations import check_episodes
from inhand.learning.environment_config import angles_of
from inhand.learning.experts import SHOWN_IN_SPACE, TEACHERS
from inhand.learning.recipe import from_unseen
from inhand.learning.space_pools import shown_unseen
from inhand.records import read_json, read_record
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.engines import check_engine
from inhand.sim.memory import WORLD_BYTES, check_memory
from inhand.sim.names import UNTOLD
from inhand.tasks.cards import NEW, InterfaceCard, check_same, interface_card
from inhand.tasks.decisions import find_reward
from inhand.tasks.layouts import find_layout
from inhand.tasks.primitives import primitive_at
from inhand.versions import versions

MARK = "config.json"
"""The file that marks a folder as a training run's."""
FORMAT = 2
"""Version of the folder; see `inhand.tasks.cards.NEW`."""


@dataclass(frozen=True)
class RunCard:
    """What a run's folder says of itself."""

    format: int
    version: str
    interface: InterfaceCard
    """How the controller sees and acts."""
    config: Training
    """What is trained, and how."""
    versions: dict[str, str]
    """Versions of what it runs on."""


def card_of(config: Training) -> RunCard:
    """Return what a run's folder says of itself."""
    found = versions()
    interface = interface_card(find_layout(config.interface.observation), config.interface.actions)
    return RunCard(FORMAT, found["inhand"].partition(" ")[0], interface, config, found)


def read_config(out: Path) -> Training:
    """Return the configuration of a run's folder.

    Raises:
        InputError: no run there, or one of another version or observation layout; the text names what differs.
    """
    path = out / MARK
    if not path.is_file():
        raise InputError(f"no training run in {out}: it has no {MARK}; give the --out of a run of `inhand train`")
    try:
        entry = read_json(path.read_bytes())
        if isinstance(entry, dict) and isinstance(entry.get("config"), dict):
            entry["config"] = {"engine": UNTOLD} | entry["config"]
        card = read_record(entry, RunCard, FORMAT, NEW)
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
    held = config.held
    if isinstance(held, SpatialPair):
        _check_space(config, held)
    else:
        _check_plane(config)
    if config.recipe.expert not in TEACHERS and (config.recipe.turns or config.recipe.legs):
        raise InputError(f"expert {config.recipe.expert!r} shows straight primitives: leave turns and legs at 0")
    find_reward(config.interface.reward)
    check_engine(config.engine)
    load_disturbance(config.disturb)
    check_memory(f"worlds={config.worlds}", config.worlds, WORLD_BYTES[config.engine])
    check_episodes(config.recipe.episodes, f"demonstrations {config.recipe.episodes}")
    least = {
        "episodes": (config.episodes, 0 if config.imitate else 1),
        "worlds": (config.worlds, 1),
        "batch": (config.learning.batch, 1),
        "look_ahead": (config.learning.look_ahead, 1),
        "horizon": (config.interface.horizon, 1),
    }
    for name, (value, lowest) in least.items():
        if value < lowest:
            raise InputError(f"{name} {value}: give at least {lowest}")
    _check_pairs(config)
    if config.seed < 0:
        raise InputError(f"--seed {config.seed}: a seed is 0 or more")
    if not 0 < config.learning.discount <= 1:
        raise InputError(f"discount {config.learning.discount:g}: give a number above 0, at most 1")
    if config.demonstrations:
        _check_dataset(config, held)


def _check_plane(config: Training) -> None:
    """Refuse layouts that training with a hand in the plane has no meaning for."""
    layout = find_layout(config.interface.observation)
    if layout.space:
        raise InputError(
            f"layout {config.interface.observation!r} is of hands in space, and {config.hand} is in the plane: take a"
            " hand in space (3f_60.60_40_10), or another preset"
        )
    if layout.sensed and layout.columns and config.task:
        raise InputError(
            f"layout {config.interface.observation!r} knows primitives: leave task out, or take layout senses or grip"
        )


def _check_space(config: Training, held: SpatialPair) -> None:
    """Refuse what training with a hand in space has no meaning for yet.

    Raises:
        InputError: the text names what; or an object that the hand cannot hold.
    """
    shown_by = ("teacher",) if config.rounds else SHOWN_IN_SPACE
    asked = {
        f"task {config.task}": bool(config.task),
        "pairs": bool(config.pairs),
        f"start {config.start}": bool(config.start),
        f"layout {config.interface.observation}": not find_layout(config.interface.observation).space,
        f"expert {config.recipe.expert}": config.recipe.expert not in shown_by,
    }
    wrong = [words for words, given in asked.items() if given]
    if wrong:
        raise InputError(
            f"{' and '.join(wrong)} with {config.hand}, a hand in space: its training has layout space-senses, space or"
            f" space-thesis, and shows episodes of {' or '.join(shown_by)}; take preset default, privileged or thesis,"
            " and leave these out"
        )
    check_carried(*held, config.engine)


def policy_to_start(name: str) -> Policy:
    """Return the policy that a training is to start from.

    Raises:
        InputError: there is none of that name.
    """
    policy = find_controller(name).policy
    if policy is None:
        raise InputError(f"start {name!r} is no learned policy: give rl-family or the folder of a run")
    return policy


def _check_pairs(config: Training) -> None:
    """Refuse a family or a start that training cannot have.

    Raises:
        InputError: the text names what does not go together.
    """
    slotted, network = find_layout(config.interface.observation).columns, config.learning.network
    if config.pairs < 0:
        raise InputError(f"pairs {config.pairs}: give a number of hands and objects, or 0 for one pair")
    if network == "joints" and not slotted:
        raise InputError(
            f"a network over joints sees layout joints or joint-senses, not {config.interface.observation}"
        )
    recipe = config.recipe
    taught = recipe.expert in TEACHERS and recipe.grasp != "rough" and not (recipe.turns or recipe.legs or config.task)
    if config.pairs and not (slotted and taught and not config.demonstrations):
        raise InputError(
            "a family is learned with layout joints or joint-senses, a teacher and planned grasps, on primitives, with"
            " turns and legs at 0 and without a dataset: take preset family"
        )
    usual = Training("family")
    if config.pairs and (config.hand, config.object) != (usual.hand, usual.object):
        raise InputError(
            f"{config.hand} and {config.object} with a family, whose hands and objects are drawn: leave hand and object"
            " out, or take preset from-family, which fits one hand and object"
        )
    if config.start:
        policy = policy_to_start(config.start)
        if policy.family is not None:
            held = config.held
            why = policy.family.outside(held) if isinstance(held, Held) else None
            if why is not None:
                raise InputError(f"{why}: train without start")


def _check_dataset(config: Training, held: AnyPair) -> None:
    """Refuse a dataset that the controller cannot learn from, or whose directions it may not see."""
    folder = Path(config.demonstrations)
    if config.task:
        raise InputError(f"the dataset in {folder} shows directions: leave demonstrations out to train on a whole task")
    if config.interface.truth:
        raise InputError(
            f"layout {config.interface.observation} has critics that see the truth, which no dataset holds: leave"
            f" demonstrations out, or take a preset on perfect knowledge such as"
            f" {'spatial-privileged' if isinstance(held, SpatialPair) else 'privileged'}"
        )
    check_installed("a dataset")
    head = read_head(folder)
    world = held.object, config.engine, config.interface.reward
    check_fits(head, kind_of(held.hand, config.interface), world)
    shown = shown_unseen(head) if isinstance(head, SpatialHead) else _unseen_in(head)
    if shown:
        usual = "all,turns" if isinstance(head, SpatialHead) else "train"
        raise InputError(
            f"the dataset in {folder} shows {', '.join(shown)}, which evaluations count as unseen: record one without,"
            f" with --directions {usual} or continuous"
        )


def _unseen_in(head: DatasetHead) -> list[str]:
    """Return the directions in the plane of a dataset that evaluations count as unseen."""
    angles = np.array([] if head.directions == CONTINUOUS else angles_of(head.directions))
    return [primitive_at(angle).name for angle in angles[from_unseen(angles) < 1.0]]


def _check_version(card: RunCard) -> None:
    ours = card_of(card.config).version
    if card.version != ours:
        raise InputError(f"it is of version {card.version}, this is {ours}")
