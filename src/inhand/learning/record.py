"""Recording as a function: what is to be shown in, a dataset of demonstrations out."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from inhand.control.catalogue import find_controller
from inhand.control.draws import check_draws
from inhand.control.loop import Told
from inhand.control.user_policy import GraspKind
from inhand.errors import InputError
from inhand.folders import run_folder
from inhand.geometry import Array
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import check_fit
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import hand_name, object_name
from inhand.learning.commands import RecordConfig
from inhand.learning.dataset_cards import CONTINUOUS, DatasetHead, kind_of
from inhand.learning.datasets import MARK, DatasetEpisode, StoredEpisodes, check_installed, read_dataset, write_dataset
from inhand.learning.demonstrations import Episodes, check_episodes, demonstrations, plans_of
from inhand.learning.environment_config import angles_of
from inhand.learning.recipe import Recipe, Recording
from inhand.learning.starts import Noise
from inhand.learning.worlds import Interface
from inhand.records import configured
from inhand.repeats import write_repeat
from inhand.shown import Kept, listed, path_of
from inhand.sim.disturbance import disturbance_of
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.engines import check_engine
from inhand.tasks.decisions import find_reward
from inhand.tasks.layouts import find_layout
from inhand.tasks.primitives import TRAIN, primitive_at
from inhand.versions import versions

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

DEFAULT = RecordConfig()
"""What is recorded where nothing else is asked for."""
DATASETS = Path("results/datasets")
"""Where the command leaves datasets, each to its id: a folder for MINARI_DATASETS_PATH."""


@dataclass(frozen=True, eq=False)
class Dataset(Kept):
    """A dataset of E demonstrations in its folder."""

    mark = MARK

    config: DatasetHead
    """Where it comes from."""
    angle_deg: Array
    """Direction of each episode `(E,)` [deg]."""
    lost: NDArray[np.bool_]
    """Whether it lost the object `(E,)`."""
    distance: Array
    """Way along at its end `(E,)` [m]."""
    planned: Array
    """Way that the expert meant to go `(E,)` [m]."""

    @property
    def title(self) -> str:
        """Its expert, object and hand by their names."""
        head = self.config
        return f"{head.expert} on {head.object.name}, {head.kind.hand.name}"

    @property
    def episodes(self) -> StoredEpisodes:
        """The episodes with their observations, actions and rewards, read as they are asked for."""
        return read_dataset(self.folder)[1]

    def table(self) -> DataFrame:
        """Return a row for each episode: its direction, how far it went and was to go, whether the object was lost."""
        from pandas import DataFrame

        return DataFrame(
            {
                "direction": [primitive_at(angle).name for angle in self.angle_deg],
                "angle_deg": self.angle_deg,
                "distance_mm": 1e3 * self.distance,
                "planned_mm": 1e3 * self.planned,
                "lost": self.lost,
            }
        )

    def summary(self) -> DataFrame:
        """Return a row for each direction, or for each sector of 45 deg about the training ones, and one for all."""
        from pandas import concat

        table = self.table()
        if self.config.directions == CONTINUOUS:
            sectors = np.round(table["angle_deg"] / 45.0) * 45.0 % 360.0
            table["direction"] = [f"{primitive_at(angle).name} +-22.5" for angle in sectors]
        order = [f"{each.name}{end}" for end in ("", " +-22.5") for each in TRAIN]
        names = [name for name in order if name in set(table["direction"])]
        names += sorted(set(table["direction"]) - set(names))
        table["share"] = (table["distance_mm"] / table["planned_mm"]).where(table["planned_mm"] > 0)
        groups = concat([table, table.assign(direction="all")]).groupby("direction")
        lost, distance, share = ("lost", "sum"), ("distance_mm", "mean"), ("share", "mean")
        found = groups.agg(episodes=("lost", "size"), lost=lost, distance_mm=distance, share=share)
        return found.loc[[*names, "all"]]

    def figure(self) -> Figure:
        """Return where the episodes ended."""
        from inhand.learning.dataset_figure import dataset_figure

        return dataset_figure(self.angle_deg, self.distance, self.lost, self.title)

    def draw(self, folder: Path) -> None:
        """Draw where the episodes ended into `figures` of a folder."""
        from inhand.plots.save import save_picture

        save_picture(self.figure(), folder, "dataset.png", "")


def record(
    hand: str | Path | HandSpec = DEFAULT.hand,
    object: str | Path | ObjectSpec = DEFAULT.object,
    *,
    directions: str | Sequence[str | float] = DEFAULT.directions,
    episodes: int = DEFAULT.episodes,
    seed: int = DEFAULT.seed,
    out: str | Path | None = None,
    **settings: Any,
) -> Dataset:
    """Record an expert's demonstrations and return them as a dataset.

    Args:
        hand: a name, a TOML file or a spec.
        object: a name, a TOML file or a spec.
        directions: words of the command line, names, or degrees counter-clockwise from +x; or continuous.
        episodes: how many.
        seed: of everything drawn.
        out: folder of the dataset; None for a temporary one.
        settings: other fields of `RecordConfig`, such as expert, observation, reward, push and engine.

    Raises:
        InputError: anything that cannot be recorded; the text says what, and what is allowed.
    """
    settings |= {"directions": listed(directions), "episodes": episodes, "seed": seed}
    settings |= {"hand": hand_name(hand), "object": object_name(object)}
    settings |= disturbance_of(settings)
    settings["out"] = Path(tempfile.mkdtemp(prefix="inhand-record-")) if out is None else Path(path_of("out", out))
    return run_record(configured(RecordConfig, settings))


def run_record(config: RecordConfig, told: Told = lambda *_: None) -> Dataset:
    """Return the dataset of a configuration; `told` is told how far it is.

    Raises:
        InputError: anything in the configuration that cannot be recorded, or a folder that may not be written.
    """
    check_installed("`inhand record`")
    recording = recording_of(config)
    head = head_of(recording, config.directions)
    out = config.out or DATASETS / head.dataset_id
    spec = environment_spec(recording, config)
    ends: list[tuple[float, bool, float, float]] = []
    with run_folder(out, overwrite=config.overwrite, mark=MARK) as folder:
        rng = np.random.default_rng(config.seed)
        batches = demonstrations(recording, plans_of(recording, told=told), rng, told)
        write_dataset(folder, _noted(batches, ends), head, spec)
        write_repeat(folder, "record", replace(config, out=out))
    return _dataset(out, head, ends)


def load_dataset(folder: Path) -> Dataset:
    """Return the dataset of a folder.

    Raises:
        InputError: there is none of ours, or one that cannot be read.
    """
    head, episodes = read_dataset(folder)
    return _dataset(folder, head, [_end(each) for each in episodes])


def recording_of(config: RecordConfig) -> Recording:
    """Return what is to be recorded.

    Raises:
        InputError: anything in the configuration that cannot be recorded.
    """
    check_episodes(config.episodes, f"--episodes {config.episodes}")
    if config.horizon < 1:
        raise InputError(f"--horizon {config.horizon}: give at least 1")
    check_draws(config)
    for name in ("push", "grip_spread"):
        if getattr(config, name) < 0:
            raise InputError(f"--{name.replace('_', '-')} {getattr(config, name):g}: give 0 or more")
    for name in ("midway", "whole"):
        if not 0 <= getattr(config, name) <= 1:
            raise InputError(f"--{name} {getattr(config, name):g}: a share is from 0 to 1")
    if find_layout(config.observation).columns:
        raise InputError(
            f"--observation {config.observation} has slots for joints that a hand has not, which no dataset has: take"
            " grip; inhand train --preset family records its own demonstrations"
        )
    find_reward(config.reward)
    find_controller(config.expert)
    hand, thing = load_hand(config.hand), load_object(config.object)
    check_fit(hand, thing)
    check_engine(config.engine)
    grasp: GraspKind = "rough" if config.expert == "thesis-ik" else "planned"
    return Recording(
        hand,
        thing,
        angles_of("train" if config.directions == CONTINUOUS else config.directions),
        Recipe(config.episodes, config.expert, config.push, config.midway, grasp, config.whole, config.grip_spread),
        Interface(config.observation, config.actions, config.reward, config.horizon),
        Noise(config.noise_mm / 1e3, float(np.deg2rad(config.noise_deg))),
        config.seed,
        config.engine,
        continuous=config.directions == CONTINUOUS,
        disturb=load_disturbance(config.disturb),
    )


def head_of(recording: Recording, directions: str) -> DatasetHead:
    """Return the head of a recording's dataset; `directions` are the words that they were asked for by."""
    recipe, noise = recording.recipe, recording.noise
    return DatasetHead(
        kind_of(recording.hand, recording.interface),
        recording.object,
        recipe.expert,
        recipe.grasp,
        recording.interface.reward,
        directions,
        (noise.position, noise.rotation),
        recipe.push,
        recipe.midway,
        recipe.whole,
        recipe.grip_spread,
        recording.seed,
        versions(),
        recording.engine,
        recording.disturb,
    )


def environment_spec(recording: Recording, config: RecordConfig) -> str:
    """Return the JSON of the environment in which the demonstrations are a controller's episodes."""
    import gymnasium

    same = ("hand", "object", "observation", "actions", "reward", "horizon", "noise_mm", "noise_deg", "engine")
    spec = deepcopy(gymnasium.spec("inhand/Asterisk-v0"))
    spec.kwargs = {name: getattr(config, name) for name in same} | {
        "directions": "all" if recording.continuous else config.directions,
        **({} if recording.disturb is None else {"disturb": config.disturb}),
        "stop": True,
        "grasp": recording.recipe.grasp,
    }
    return str(spec.to_json())


def _noted(batches: Iterable[Episodes], ends: list[tuple[float, bool, float, float]]) -> Iterator[DatasetEpisode]:
    """Give the episodes of batches one by one and note how they ended."""
    for batch in batches:
        for episode in batch.apart():
            ends.append(_end(episode))
            yield episode


def _end(episode: DatasetEpisode) -> tuple[float, bool, float, float]:
    return episode.angle_deg, episode.terminated, episode.distance, episode.limit


def _dataset(folder: Path, head: DatasetHead, ends: Sequence[tuple[float, bool, float, float]]) -> Dataset:
    angle_deg, lost, distance, planned = np.array(ends).reshape(-1, 4).T
    return Dataset(head, folder, angle_deg, lost.astype(bool), distance, planned)
