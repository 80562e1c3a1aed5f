"""What a study of robustness found, as frames: a row for each trial, and for each controller under a disturbance."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from inhand.asterisk_test.cells import CellFile
from inhand.asterisk_test.results import tidy, turning
from inhand.asterisk_test.robustness.cases import Case, Contender
from inhand.control.trial import LOST
from inhand.geometry import Array
from inhand.sim.disturbance_files import NONE

DRAWS = 1000
"""Samples of a bootstrap."""
SPREAD = (0.025, 0.975)
"""Quantiles that end a 95 % interval."""
WORST = {
    "penetration_max_mm": "max", "penetration_mean_mm": "mean", "penetration_share": "mean", "force_max_n": "max",
    "torque_max_nmm": "max",
}  # fmt: skip
"""What is told of all trials: the largest, or the mean over them."""


@dataclass(frozen=True, eq=False)
class Robustness:
    """All cells of a study."""

    contenders: tuple[Contender, ...]
    cases: tuple[Case, ...]
    """Disturbances, undisturbed first."""
    trials: pd.DataFrame
    """A row for each trial: `controller`, `disturb`, `lost`, `way` (share of the limit, 0 where the object was lost,
    NaN where no limit is known), and what `as_entry` gives; numbers drawn for its world begin with `drawn.`."""
    rows: pd.DataFrame
    """A row for each controller under each disturbance, as `_row` gives it, and how long it took one core [s]."""
    stopped: tuple[str, ...]
    """What could not be run, a sentence each."""

    def row(self, controller: str, disturb: str) -> dict[str, Any] | None:
        """Return the row of a controller under a disturbance; None where it could not be run."""
        found = self.rows[(self.rows.controller == controller) & (self.rows.disturb == disturb)]
        return {str(key): value for key, value in found.iloc[0].items()} if len(found) else None


def robustness_of(
    cells: Iterable[CellFile], contenders: Sequence[Contender], cases: Sequence[Case], seed: int
) -> Robustness:
    """Return the study that cells make up, case by case and within a case controller by controller.

    The `seed` is that of the bootstraps.
    """
    whole: dict[str, pd.DataFrame] = {}
    trials, rows, stopped = [], [], []
    for number, cell in enumerate(cells):
        case, contender = cases[number // len(contenders)], contenders[number % len(contenders)]
        if cell.reason is not None:
            stopped.append(f"{contender.name} under {case.name} could not be run: {cell.reason}")
            continue
        found = _trials(cell, contender.name, case.name)
        trials.append(found)
        if case.name == NONE:
            whole[contender.name] = found
        plain = whole.get(contender.name, found.iloc[:0])
        took = {"seconds": cell.seconds, "cpu_seconds": cell.cpu_seconds}
        rows.append({"controller": contender.name, "disturb": case.name, **_row(found, plain, seed), **took})
    every = pd.concat(trials, ignore_index=True) if trials else pd.DataFrame()
    table = pd.DataFrame(rows, columns=None if rows else ["controller", "disturb"])
    return Robustness(tuple(contenders), tuple(cases), every, table, tuple(stopped))


def wilson(count: int, total: int) -> tuple[float, float]:
    """Return the 95 % interval of a share, by Wilson (1927)."""
    z = 1.96
    middle, width = count + z * z / 2, z * np.sqrt(count * (1 - count / total) + z * z / 4)
    return float((middle - width) / (total + z * z)), float((middle + width) / (total + z * z))


def retention(way: Array, whole: Array, seed: int) -> tuple[float, float, float]:
    """Return which share of undisturbed ways `(N,)` is kept, and its 95 % interval by bootstrap over the pairs.

    It is mean over mean; NaN where nothing is gone undisturbed.
    """
    known = np.isfinite(way) & np.isfinite(whole)
    if not known.any() or not whole[known].mean() > 0:
        return np.nan, np.nan, np.nan
    drawn = np.random.default_rng(seed).integers(known.sum(), size=(DRAWS, known.sum()))
    kept, base = way[known][drawn].mean(axis=1), whole[known][drawn].mean(axis=1)
    low, high = np.quantile(kept[base > 0] / base[base > 0], SPREAD)
    return float(way[known].mean() / whole[known].mean()), float(low), float(high)


def over_seeds(found: Robustness) -> pd.DataFrame:
    """Return the range over seeds of training: a row for each group of controllers and each disturbance.

    A group are controllers that were trained alike but for their seed. Columns: `group`, `disturb`, `seeds`, and least,
    mean and most of `retention` and of the share `lost`.
    """
    groups: list[list[Contender]] = []
    for contender in found.contenders:
        same = [group for group in groups if contender.kin is not None and group[0].kin == contender.kin]
        if same:
            same[0].append(contender)
        else:
            groups.append([contender])
    rows = []
    for group in (each for each in groups if len(each) > 1):
        names = [each.name for each in group]
        mine = found.rows[found.rows.controller.isin(names)].assign(lost=lambda rows: rows.lost / rows.trials)
        of = mine.groupby("disturb", sort=False)[["retention", "lost"]].agg(["min", "mean", "max"])
        of.columns = ["_".join(pair) for pair in of.columns]
        rows.append(of.reset_index().assign(group=", ".join(names), seeds=len(names)))
    return pd.concat(rows, ignore_index=True) if rows else pd.DataFrame()


def _trials(cell: CellFile, controller: str, disturb: str) -> pd.DataFrame:
    table = tidy(cell.trials).assign(controller=controller, disturb=disturb)
    table["lost"] = table.outcome.isin(LOST)
    share = table.reached / table.limit.replace(0.0, np.nan)
    table["way"] = share.where(~table.lost, 0.0 * share)
    return table


def _row(found: pd.DataFrame, plain: pd.DataFrame, seed: int) -> dict[str, Any]:
    """Return what is told of trials under a disturbance, beside the same trials undisturbed."""
    keys = ["direction", "trial"]
    whole = plain.set_index(keys).way.reindex(pd.MultiIndex.from_frame(found[keys])).to_numpy()
    lost, kept = int(found.lost.sum()), found[~found.lost]
    straight = kept[~turning(kept)]
    way = found.way.to_numpy()
    mean = {f"retention{end}": value for end, value in zip(ENDS, retention(way, whole, seed), strict=True)}
    mean |= {f"share{end}": value for end, value in zip(ENDS, retention(way, np.ones(len(way)), seed), strict=True)}
    by = found.groupby("direction", sort=False).way.mean()
    return {
        "trials": len(found),
        "lost": lost,
        **dict(zip(("lost_low", "lost_high"), wilson(lost, len(found)), strict=True)),
        **mean,
        "least": by.min(),
        "least_direction": by.idxmin() if by.notna().any() else "",
        **{f"lateral_{name}_mm": kept.lateral_max_mm.quantile(at) for name, at in QUANTILES.items()},
        **{f"turn_{name}_deg": straight.rotation_max_deg.quantile(at) for name, at in QUANTILES.items()},
        **{name: found[name].agg(how) for name, how in WORST.items()},
    }


ENDS = ("", "_low", "_high")
"""Ends of the names of an estimate and of its interval's ends."""
QUANTILES = {"median": 0.5, "95": 0.95}
"""What is told of lateral distance and turn of objects that were kept."""
