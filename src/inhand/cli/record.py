"""`inhand record`: an expert's demonstrations, recorded and written as a Minari dataset."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from inhand.cli.terminal import print_table, progress, say
from inhand.errors import InputError
from inhand.folders import run_folder
from inhand.geometry import Array
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import check_fit
from inhand.learning.datasets import MARK, DatasetEpisode, check_installed, write_dataset
from inhand.learning.demonstrations import Episodes, Recipe
from inhand.learning.environment_config import angles_of
from inhand.learning.record_config import RecordConfig
from inhand.learning.recording import Recording, dataset_episodes, environment_spec, record
from inhand.learning.starts import Noise
from inhand.learning.worlds import Interface
from inhand.sim.engines import check_engine
from inhand.tasks.observations import find_layout
from inhand.tasks.primitives import TRAIN, primitive_at
from inhand.tasks.rewards import find_reward
from inhand.versions import versions

CONTINUOUS = "continuous"
"""The word for any direction."""
DATASETS = Path("results/datasets")
"""Where datasets go, each to its id: a folder for MINARI_DATASETS_PATH."""
WORDS = {"grasps": "planning grasps", "episodes": "recording"}
"""What the parts of a recording are called on the screen."""
HEADER = ("Episodes", "Lost", "Distance [mm]", "Of the plan")
"""Columns of the table after the direction."""


@dataclass
class Tally:
    """What has been recorded so far."""

    angle_deg: list[Array] = field(default_factory=list)
    """Directions `(B,)` of each batch [deg]."""
    lost: list[Any] = field(default_factory=list)
    """Whether the object was lost `(B,)`."""
    distance: list[Array] = field(default_factory=list)
    """Way along `(B,)` [m]."""
    limit: list[Array] = field(default_factory=list)
    """Way that the expert planned `(B,)` [m]."""

    @property
    def episodes(self) -> int:
        """Number of episodes."""
        return sum(len(each) for each in self.angle_deg)

    @property
    def drops(self) -> int:
        """Number of those in which the object was lost."""
        return sum(int(each.sum()) for each in self.lost)

    def words(self, what: str) -> str:
        """Return what a part of the recording is called, with what has been lost so far."""
        return WORDS[what] + (f", {self.drops} lost" if self.drops else "")

    def counted(self, batches: Iterable[Episodes]) -> Iterator[DatasetEpisode]:
        """Give the episodes of batches one by one, and keep count."""
        for batch in batches:
            self.angle_deg.append(batch.angle_deg)
            self.lost.append(batch.terminated)
            self.distance.append(batch.distance)
            self.limit.append(batch.starts.distance)
            yield from dataset_episodes(batch)


def run_record(config: RecordConfig) -> None:
    """Check everything, record and write, and put the finished dataset in its place."""
    check_installed("`inhand record`")
    recording = prepared(config)
    head = recording.head(config.directions, versions())
    out = config.out or DATASETS / head.dataset_id
    spec = environment_spec(recording, (config.hand, config.object, config.directions))
    tally = Tally()
    try:
        with run_folder(out, overwrite=config.overwrite, mark=MARK) as folder, progress(spoken=True) as tell:
            told = record(recording, lambda what, done, total: tell(tally.words(what), done, total))
            write_dataset(folder, tally.counted(told), head, spec)
    except KeyboardInterrupt:
        say(f"Stopped after {tally.episodes} episodes; none of them is kept, half a dataset is no dataset")
        raise
    title = f"{config.expert} on {config.object}, {config.hand}: {tally.episodes} episodes"
    print_table(title, ("Direction", *HEADER), rows_of(tally, sectors=recording.angles_deg is None))
    say(f"Dataset {head.dataset_id}: {out}")
    say(f'Read it: minari.MinariDataset("{(out / "data").as_posix()}"), or inhand.learning.datasets.read_dataset')


def prepared(config: RecordConfig) -> Recording:
    """Return what is to be recorded.

    Raises:
        InputError: anything in the configuration that cannot be recorded.
    """
    for name in ("episodes", "horizon"):
        if getattr(config, name) < 1:
            raise InputError(f"--{name} {getattr(config, name)}: give at least 1")
    for name in ("noise_mm", "noise_deg", "push", "grip_spread", "seed"):
        if getattr(config, name) < 0:
            raise InputError(f"--{name.replace('_', '-')} {getattr(config, name):g}: give 0 or more")
    for name in ("midway", "whole"):
        if not 0 <= getattr(config, name) <= 1:
            raise InputError(f"--{name} {getattr(config, name):g}: a share is from 0 to 1")
    find_layout(config.observation)
    find_reward(config.reward)
    hand, thing = load_hand(config.hand), load_object(config.object)
    check_fit(hand, thing)
    check_engine(config.engine)
    return Recording(
        hand,
        thing,
        None if config.directions == CONTINUOUS else angles_of(config.directions),
        Recipe(
            episodes=config.episodes,
            expert=config.expert,
            push=config.push,
            midway=config.midway,
            grasp="rough" if config.expert == "thesis-ik" else "planned",
            whole=config.whole,
            grip_spread=config.grip_spread,
        ),
        Interface(config.observation, config.actions, config.reward, config.horizon),
        Noise(config.noise_mm / 1e3, float(np.deg2rad(config.noise_deg))),
        config.seed,
        config.engine,
    )


def rows_of(tally: Tally, *, sectors: bool) -> list[Sequence[str]]:
    """Return the table's rows, one for each direction, or for each sector of 45 deg about the training directions."""
    angle = np.concatenate(tally.angle_deg)
    lost, distance, limit = (np.concatenate(each) for each in (tally.lost, tally.distance, tally.limit))
    if sectors:
        middles = np.array([np.rad2deg(each.angle) for each in TRAIN])
        away = np.abs((angle[:, None] - middles + 180.0) % 360.0 - 180.0)
        names = np.array([f"{each.name} +-22.5" for each in TRAIN])[away.argmin(axis=-1)]
    else:
        names = np.array([primitive_at(each).name for each in angle])
    order = [*(f"{each.name} +-22.5" if sectors else each.name for each in TRAIN), *sorted(set(names))]
    groups = [(name, names == name) for name in dict.fromkeys(order)] + [("all", np.ones(len(names), dtype=bool))]
    return [(name, *_cells(lost[mine], distance[mine], limit[mine])) for name, mine in groups if mine.any()]


def _cells(lost: Array, distance: Array, limit: Array) -> tuple[str, ...]:
    asked = limit > 0
    share = f"{np.mean(distance[asked] / limit[asked]):.3f}" if asked.any() else "-"
    return str(len(lost)), str(int(lost.sum())), f"{1e3 * distance.mean():.1f}", share
