"""Controllers that know MuJoCo alone, in PyBullet: what they keep, and how far they carry it, direction by direction.

The Asterisk Test with the standard hand and cube, 30 trials in each of 16 directions, in MuJoCo and in PyBullet from
the same noisy starts: ten seeds of three trials. A dropped object counts as no way; drops have Wilson 95 % intervals.
Grasps are rehearsed, and ways planned, in the engine that runs, or with `--planned ENGINE` in one for both: then all
is made without PyBullet, grasps too. With `--keep FOLDER` a run that was ended goes on where it was.

Bounds for each controller: an object kept in 16 of 16 directions, at least 0.90 of MuJoCo's way, drops at most 1 %.
Run: python benchmarks/gap.py [CONTROLLER ...] [--seeds N] [--planned ENGINE] [--keep FOLDER] [--out FIGURE.png]
     (five minutes a controller on one core if planned in the plane; to rehearse in PyBullet takes ten more of `ik` and
     `rl-privileged`, and of `ik-sensed` a quarter of an hour once)
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import numpy as np
import pandas as pd

import inhand
from inhand import register
from inhand.asterisk_test.robustness.summary import wilson
from inhand.control.catalogue import find_controller
from inhand.control.phases import Grasp
from inhand.control.trial import LOST
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.plots.save import save_figure
from inhand.plots.sheet import sheet
from inhand.plots.style import MUTED, TICK_POINTS, series_look
from inhand.sim.names import Engine
from timing import environment, verdict

CONTROLLERS = ("ik", "ik-sensed", "rl-privileged")
ENGINES: tuple[Engine, Engine] = ("mujoco", "bullet")
TRIALS, SEEDS = 3, 10
LEAST, MOST_DROPS = 0.90, 0.01


@dataclass(frozen=True)
class Gap:
    """What a controller did in both engines, a row for each trial."""

    controller: str
    mujoco: pd.DataFrame
    bullet: pd.DataFrame

    def by_direction(self) -> pd.DataFrame:
        """Return of each direction the mean ways [mm], their ratio, its least and most trial, and the drops."""
        rows = {}
        for direction in self.mujoco.direction.unique():
            here, there = (each[each.direction == direction] for each in (self.mujoco, self.bullet))
            with np.errstate(divide="ignore", invalid="ignore"):  # of what goes no way in MuJoCo
                ratio = there.way.to_numpy() / here.way.to_numpy()
            drops = int(here.lost.sum()), int(there.lost.sum())
            ways = here.way.mean(), there.way.mean()
            rows[direction] = (*ways, ratio.mean(), ratio.min(), ratio.max(), *drops)
        names = ["MuJoCo [mm]", "PyBullet [mm]", "ratio", "least", "most", "drops in MuJoCo", "in PyBullet"]
        return pd.DataFrame.from_dict(rows, orient="index", columns=names)


def planned_in(engine: Engine, controller: str) -> str:
    """Return the name of a controller whose grasps and ways are planned in an engine, whatever engine runs."""
    entry = find_controller(controller)

    def grasp(hand: HandSpec, spec: ObjectSpec, poses: Array, starts: Array | None = None, **_: str) -> Grasp:
        return entry.grasp(hand, spec, poses, starts, engine=engine)

    name = f"{Path(controller).name}-{engine}"
    register.controller(name)(replace(entry, name=name, grasp=grasp))
    return name


def tried(controller: str, engine: Engine, seeds: int, kept: Path | None) -> pd.DataFrame:
    """Return the trials of a controller in an engine; what is kept of a seed is not run again."""
    tables = []
    for seed in range(seeds):
        file = None if kept is None else kept / f"{Path(controller).name}-{engine}-{seed}.csv"
        if file is None or not file.exists():
            table = inhand.asterisk(controller=controller, trials=TRIALS, seed=seed, engine=engine).table()
            table = table[["direction", "trial", "outcome", "distance_mm"]]
            if file is not None:
                file.parent.mkdir(parents=True, exist_ok=True)
                table.to_csv(file, index=False)
        tables.append(table if file is None else pd.read_csv(file))
    found = pd.concat(tables, ignore_index=True)
    lost = found.outcome.isin(LOST)
    return found.assign(lost=lost, way=np.where(lost, 0.0, found.distance_mm))


def told(gap: Gap) -> str:
    """Return the lines that say how a controller did."""
    table, lost, trials = gap.by_direction(), int(gap.bullet.lost.sum()), len(gap.bullet)
    low, high = wilson(lost, trials)
    kept, ratio = int((table["PyBullet [mm]"] > 0).sum()), gap.bullet.way.mean() / gap.mujoco.way.mean()
    lines = [
        f"## {gap.controller}",
        f"{kept} of {len(table)} directions kept: {verdict(kept == len(table))}",
        f"{ratio:.3f} of MuJoCo's way: {verdict(ratio >= LEAST)}",
        f"{lost} of {trials} lost, {100 * low:.1f} to {100 * high:.1f} %: {verdict(lost <= MOST_DROPS * trials)}",
        f"| direction | {' | '.join(table.columns)} |",
        "|---" * (1 + len(table.columns)) + "|",
    ]
    for direction, row in table.iterrows():
        numbers = [*(f"{each:.1f}" for each in row[:2]), *(f"{each:.3f}" for each in row[2:5])]
        cells = [*numbers, *(f"{each:g}" for each in row[5:])]
        lines.append(f"| {direction} | {' | '.join(cells)} |")
    return "\n".join(lines)


def draw(gaps: list[Gap], file: Path) -> None:
    """Draw every controller's ratio in each direction, with its trials' least and most."""
    names = [str(direction) for direction in gaps[0].by_direction().index]
    note = "PyBullet's way over MuJoCo's in the same trials: mean of each direction, least and most of its trials"
    with sheet([[(7.0, 2.6)]], "What carries over to PyBullet", note) as (figure, (ax,)):
        for number, gap in enumerate(gaps):
            table, look = gap.by_direction(), series_look(number)
            at = np.arange(len(names)) + 0.22 * (number - (len(gaps) - 1) / 2)
            ax.vlines(at, table["least"], table["most"], color=look.colour, linewidth=1.6, alpha=0.5)
            ax.plot(at, table["ratio"], look.marker, color=look.colour, label=gap.controller, markersize=4.5)
        ax.axhline(LEAST, color=MUTED, linewidth=0.8, linestyle=":")
        ax.set_xticks(range(len(names)), names, rotation=45, ha="right", rotation_mode="anchor", fontsize=TICK_POINTS)
        ax.set(
            ylabel="PyBullet / MuJoCo", ylim=(min(LEAST - 0.05, *(g.by_direction()["least"].min() for g in gaps)), None)
        )
        ax.legend(loc="lower left", ncols=len(gaps))
    save_figure(figure, file)


def main() -> None:
    """Run, print the tables and draw the figure."""
    parser = argparse.ArgumentParser()
    parser.add_argument("controllers", nargs="*", default=CONTROLLERS)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--planned", choices=get_args(Engine))
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    print(environment(), flush=True)
    gaps = []
    for controller in given.controllers:
        name = planned_in(given.planned, controller) if given.planned else controller
        both = (tried(name, engine, given.seeds, given.keep) for engine in ENGINES)
        gaps.append(Gap(Path(name).name, *both))
        print(told(gaps[-1]), flush=True)
    if given.out is not None:
        draw(gaps, given.out)


if __name__ == "__main__":
    main()
