"""A dataset of demonstrations as a value: where its episodes ended, by direction, and what they hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import TURN_ARM, Array
from inhand.learning.dataset_cards import CONTINUOUS, DatasetHead
from inhand.learning.datasets import MARK, DatasetEpisode, StoredEpisodes, read_dataset
from inhand.learning.recipe import SEEN
from inhand.learning.space import Space, nearest_of, primitives_of
from inhand.shown import Kept
from inhand.tasks.primitives import TRAIN, primitive_at

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

SECTOR, NEAR = " +-22.5", "near "
"""What stands behind the name of a sector of directions in the plane, and before that of those about one in space."""


@dataclass(frozen=True, eq=False)
class Dataset(Kept):
    """A dataset of E demonstrations in its folder."""

    mark = MARK

    config: DatasetHead
    """Where it comes from."""
    angle_deg: Array
    """Direction of each episode `(E,)` [deg]; 0 in space."""
    lost: NDArray[np.bool_]
    """Whether it lost the object `(E,)`."""
    distance: Array
    """Way along at its end `(E,)` [m], of a turn its arc at `TURN_ARM`."""
    planned: Array
    """Way that the expert meant to go `(E,)` [m]."""
    space: Space | None = None
    """What each was asked in space, and under which gravity; None in the plane."""

    @property
    def title(self) -> str:
        """Its expert, object and hand by their names."""
        head = self.config
        return f"{head.expert} on {head.object.name}, {head.kind.hand.name}"

    @property
    def episodes(self) -> StoredEpisodes:
        """The episodes with their observations, actions and rewards, read as they are asked for."""
        return read_dataset(self.folder)[1]

    @property
    def names(self) -> list[str]:
        """Direction of each episode, in space also its turn, by its name."""
        if self.space is not None:
            return [each.name for each in primitives_of(self.space)]
        return [primitive_at(angle).name for angle in self.angle_deg]

    def table(self) -> DataFrame:
        """Return a row for each episode: its direction, how far it went and was to go, whether the object was lost.

        Turns have angles in place of ways.
        """
        from pandas import DataFrame

        table = DataFrame({"direction": self.names, "angle_deg": self.angle_deg})
        if self.space is None:
            return table.assign(distance_mm=1e3 * self.distance, planned_mm=1e3 * self.planned, lost=self.lost)
        turns = self.space.about.any(axis=-1)
        for name, way in (("distance", self.distance), ("planned", self.planned)):
            table[f"{name}_mm"] = np.where(turns, np.nan, 1e3 * way)
            table[f"{name}_deg"] = np.where(turns, np.rad2deg(way / TURN_ARM), np.nan)
        return table.drop(columns="angle_deg").assign(lost=self.lost)

    def summary(self) -> DataFrame:
        """Return a row for each direction, and one for all.

        Directions anywhere are told by sectors of 45 deg about the training ones, in space by the nearest named one.
        """
        from pandas import concat

        table = self.table()
        table["share"] = np.divide(self.distance, self.planned, out=np.full(len(table), np.nan), where=self.planned > 0)
        table["direction"], order = self._grouped(table["direction"].tolist())
        names = [name for name in order if name in set(table["direction"])]
        names += sorted(set(table["direction"]) - set(names))
        groups = concat([table, table.assign(direction="all")]).groupby("direction")
        means = [name for name in ("distance_mm", "distance_deg", "share") if name in table]
        found = groups.agg(episodes=("lost", "size"), lost=("lost", "sum"), **{name: (name, "mean") for name in means})
        return found.loc[[*names, "all"]]

    def _grouped(self, names: list[str]) -> tuple[list[str], list[str]]:
        """Return under which name each episode is counted, and the order of those names."""
        if self.space is not None:
            known = [each.name for each in SEEN]
            if set(names) <= set(known):
                return names, known
            return [NEAR + each.name for each in nearest_of(self.space, SEEN)], [NEAR + name for name in known]
        if self.config.directions == CONTINUOUS:
            sectors = np.round(self.angle_deg / 45.0) * 45.0 % 360.0
            names = [f"{primitive_at(angle).name}{SECTOR}" for angle in sectors]
        return names, [f"{each.name}{end}" for end in ("", SECTOR) for each in TRAIN]

    def figure(self) -> Figure:
        """Return where the episodes ended."""
        from inhand.learning.dataset_figure import dataset_figure, dataset_figure_in_space

        if self.space is not None:
            return dataset_figure_in_space(self.space, self.distance, self.lost, self.title)
        return dataset_figure(self.angle_deg, self.distance, self.lost, self.title)

    def draw(self, folder: Path) -> None:
        """Draw where the episodes ended into `figures` of a folder."""
        from inhand.plots.save import save_picture

        save_picture(self.figure(), folder, "dataset.png", "")


def load_dataset(folder: Path) -> Dataset:
    """Return the dataset of a folder.

    Raises:
        InputError: there is none of ours, or one that cannot be read.
    """
    head, episodes = read_dataset(folder)
    return dataset_of(folder, head, [end_of(each) for each in episodes])


def end_of(episode: DatasetEpisode) -> Array:
    """Return how an episode ended, and what it was asked, as numbers `(4,)`, in space `(13,)`."""
    asked = [each for each in (episode.along, episode.about, episode.gravity) if each is not None]
    ends = episode.angle_deg, episode.terminated, episode.distance, episode.limit
    return np.concatenate([np.array(ends, dtype=float), *asked])


def dataset_of(folder: Path, head: DatasetHead, ends: Sequence[Array]) -> Dataset:
    """Return the dataset of a folder whose episodes ended so."""
    rows = np.array(ends).reshape(len(ends), -1) if len(ends) else np.zeros((0, 4))
    angle_deg, lost, distance, planned = rows[:, :4].T
    space = Space(rows[:, 4:7], rows[:, 7:10], rows[:, 10:]) if rows.shape[1] > 4 else None
    return Dataset(head, folder, angle_deg, lost.astype(bool), distance, planned, space)
