"""Which of the quantities that are drawn for a world goes with losing the object."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from inhand.asterisk_test.robustness.summary import DRAWS, SPREAD, Robustness
from inhand.geometry import Array
from inhand.sim.disturbance import FACTORS
from inhand.sim.disturbance_files import NONE

FEWEST = 5
"""Objects lost, and kept, from which something can be told."""


def _number(name: str) -> Callable[[pd.DataFrame], Array]:
    """Return what gives a drawn number of each trial."""
    return lambda trials: trials[f"drawn.{name}"].to_numpy(dtype=float)


def _off(name: str) -> Callable[[pd.DataFrame], Array]:
    """Return what gives how far a drawn vector is from 0."""
    return lambda trials: np.linalg.norm(np.stack(trials[f"drawn.{name}"].to_list()), axis=1)


def _start(part: int) -> Callable[[pd.DataFrame], Array]:
    """Return what gives how far a drawn start is moved (0) or turned (1): x, y and an angle, or in space three each."""

    def off(trials: pd.DataFrame) -> Array:
        drawn = np.stack(trials["drawn.start"].to_list())
        return np.asarray(np.linalg.norm(np.split(drawn, [2 if drawn.shape[1] == 3 else 3], axis=1)[part], axis=1))

    return off


QUANTITIES: dict[str, Callable[[pd.DataFrame], Array]] = {
    **{name: _number(name) for name in FACTORS},
    "centre of mass off": _off("centre"),
    "joints' zeros off": _off("zero"),
    "start off": _start(0),
    "start turned": _start(1),
    "joints late": _number("encoder_s"),
    "frames late": _number("camera_s"),
    "commands late": _number("command_s"),
}
"""What differs between worlds and may go with a loss; noise and pushes differ within a world."""


def sensitivity(found: Robustness, disturb: str, seed: int) -> pd.DataFrame:
    """Return how much each drawn quantity goes with losing the object under a disturbance.

    It is the rank correlation (Spearman 1904) of the quantity with being lost, -1 to 1, over all trials, with a 95 %
    interval by bootstrap over them. The draws of a world do not depend on each other, so none stands in for another.
    Quantities that do not differ are left out, and so are controllers that lost, or kept, fewer than `FEWEST`.

    Returns:
        `controller`, `quantity`, `correlation`, `low` and `high`; empty where nothing can be told.
    """
    rows = []
    for contender in found.contenders:
        trials = found.trials[(found.trials.controller == contender.name) & (found.trials.disturb == disturb)]
        lost = trials.lost.to_numpy(dtype=float)
        if disturb == NONE or min(lost.sum(), (1 - lost).sum()) < FEWEST:
            continue
        values = {name: give(trials) for name, give in QUANTITIES.items()}
        differ = {name: each for name, each in values.items() if np.ptp(each) > 0}
        found_of = _correlations(np.array(list(differ.values())).reshape(-1, len(lost)).T, lost, seed)
        rows += [(contender.name, name, *ends) for name, ends in zip(differ, found_of, strict=True)]
    return pd.DataFrame(rows, columns=["controller", "quantity", "correlation", "low", "high"])


def _correlations(values: Array, lost: Array, seed: int) -> list[list[float]]:
    """Return the correlation of the ranks of each quantity `(N, Q)` with `lost` `(N,)`, and its interval."""
    ranks, count = pd.DataFrame(values).rank().to_numpy(), len(lost)
    drawn = np.random.default_rng(seed).multinomial(count, np.full(count, 1 / count), size=DRAWS)
    weights = np.concatenate([np.ones((1, count)), drawn]) / count
    x, y = ranks - ranks.mean(axis=0), lost - lost.mean()
    across = weights @ (x * y[:, None]) - (weights @ x) * (weights @ y)[:, None]
    spread = (weights @ x**2 - (weights @ x) ** 2) * (weights @ y**2 - (weights @ y) ** 2)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        found = across / np.sqrt(spread)
    ends = np.nanquantile(found[1:], SPREAD, axis=0)
    told: list[list[float]] = np.stack([found[0], *ends], axis=1).tolist()
    return told
