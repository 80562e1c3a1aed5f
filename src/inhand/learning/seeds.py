"""A training with several seeds: each a run of its own in one folder, on cores or a cluster, and a table over all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from inhand.asterisk_test.clusters import check_spread, spread
from inhand.errors import InputError
from inhand.folders import place_of, writing
from inhand.learning.commands import TrainConfig
from inhand.learning.config import Training
from inhand.learning.progress import PAGE, read_learning
from inhand.learning.run_cards import MARK, check, read_config
from inhand.learning.train import asked, begin, check_installed, go_on
from inhand.repeats import NAME, write_repeat

if TYPE_CHECKING:
    from pandas import DataFrame

TABLE = "seeds.csv"
"""The table of all seeds in their folder."""
HEADER = ("Seed", "Trained", "Unseen", "Lost", "Across [mm]", "Turn [deg]")
"""Columns of `rows`: shares of the limit, objects lost, and the largest ways across and turns."""


@dataclass(frozen=True)
class Job:
    """One training."""

    config: Training
    out: Path
    """Its folder."""


def planned(config: TrainConfig) -> tuple[Job, ...]:
    """Return the training of each seed and its folder, in the order of the seeds.

    Raises:
        InputError: a seed twice or beside --seed or --resume, what cannot be trained or spread, or a folder that holds
            something else, or runs of other settings and `overwrite` is off.
    """
    check_installed()
    check_spread(config)
    for name in ("seed", "resume"):
        if getattr(config, name) not in {None, False}:
            raise InputError(f"--{name} beside --seeds: leave it out; --seeds goes on with what its folder holds")
    if len(set(config.seeds)) < len(config.seeds):
        raise InputError(f"--seeds {' '.join(map(str, config.seeds))}: give each seed once")
    one = asked(replace(config, seeds=(), jobs=0, backend="loky", address=None))
    jobs = tuple(Job(replace(one, seed=seed), config.out / f"seed-{seed}") for seed in config.seeds)
    for job in jobs:
        check(job.config)
    _check_folder(config, jobs)
    return jobs


def _check_folder(config: TrainConfig, jobs: Sequence[Job]) -> None:
    place = place_of(config.out)
    there = [] if not place.exists() else [place] if place.is_file() else list(place.iterdir())
    other = [each.name for each in there if not (each.name.startswith("seed-") or each.name in {TABLE, NAME})]
    if other:
        raise InputError(f"--out {config.out} holds {other[0]}, which --seeds has not made; give another folder")
    for job in jobs:
        if (job.out / MARK).is_file() and not config.overwrite and read_config(job.out) != job.config:
            raise InputError(
                f"--out {config.out} holds a training of other settings in {job.out.name}: give another folder, or"
                " --overwrite to train it again"
            )


def computed(jobs: Sequence[Job], config: TrainConfig) -> Iterator[Job]:
    """Train, or go on with what was stopped, and give each job as it ends.

    Raises:
        InputError: workers died too often, no such cluster, or a folder that cannot be written.
    """
    with writing(config.out):
        config.out.mkdir(parents=True, exist_ok=True)
    yield from spread(one, jobs, config)


def one(job: Job) -> Job:
    """Train one, or go on with it, unless it is finished."""
    mine = (job.out / MARK).is_file() and read_config(job.out) == job.config
    if not mine:
        begin(job.config, job.out, overwrite=True)
    elif not (job.out / PAGE).is_file():
        go_on(job.out)
    return job


def finish(jobs: Sequence[Job], config: TrainConfig) -> DataFrame:
    """Write the table of all seeds and the file that repeats them; return the table."""
    from pandas import DataFrame

    table = DataFrame([_row(job) for job in jobs])
    table.to_csv(config.out / TABLE, index=False)
    write_repeat(config.out, "train", config)
    return table


def _row(job: Job) -> dict[str, float]:
    """Return what the best policy of a seed reached: shares of the limit, counts, the worst across and turned."""
    best = read_learning(job.out).best
    *seen, last = best.groups  # in space directions and turns, and those never shown
    trained, unseen = best.over([name for group in seen or [last] for name in group.names]), best.over(last.names)
    return {
        "seed": job.config.seed,
        "trained": trained.fraction,
        "unseen": unseen.fraction,
        "lost": trained.dropped + unseen.dropped,
        "trials": trained.trials + unseen.trials,
        "across_mm": 1e3 * max(trained.across, unseen.across),
        "turned_deg": float(np.rad2deg(max(trained.turned, unseen.turned))),
    }


def rows(table: DataFrame) -> list[tuple[str, ...]]:
    """Return the rows under `HEADER`: each seed, then means with standard deviations over the seeds."""
    found = [
        (
            f"{row.seed}",
            f"{row.trained:.3f}",
            f"{row.unseen:.3f}",
            f"{row.lost} of {row.trials}",
            f"{row.across_mm:.1f}",
            f"{row.turned_deg:.1f}",
        )
        for row in table.itertuples()
    ]

    def over(name: str, digits: int) -> str:
        spread_of = f" ± {table[name].std():.{digits}f}" if len(table) > 1 else ""
        return f"{table[name].mean():.{digits}f}{spread_of}"

    lost = f"{table.lost.sum():.0f} of {table.trials.sum():.0f}"
    return [*found, ("mean", over("trained", 3), over("unseen", 3), lost, over("across_mm", 1), over("turned_deg", 1))]
