"""What a comparison found, as numbers: means with bootstrap intervals, and the steps that adaptation takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare_study import ENOUGH
from inhand.control.trial import LOST, REACHED
from inhand.geometry import Array

DRAWS = 2000
"""Samples of a bootstrap."""


@dataclass(frozen=True)
class Interval:
    """A mean and its 95 % interval."""

    mean: float
    """The mean."""
    low: float
    """Where the interval begins"""
    high: float
    """and ends."""


@dataclass(frozen=True)
class Score:
    """What the controllers of one name reached on one task, over seeds and episodes."""

    name: str
    """The controllers' name."""
    task: str
    """The task."""
    disturb: str
    """What disturbed it."""
    trained: bool
    """Whether they were trained on it."""
    completion: Interval
    """Share of the task's way."""
    done: Interval
    """Share of the episodes in which all of it was done."""
    error: Interval
    """Root mean square distance from the task's path, of the episodes that kept the object; NaN where none did [mm]."""
    dropped: int
    """Episodes that lost the object"""
    episodes: int
    """of so many."""


@dataclass(frozen=True)
class Adaptation:
    """What training end to end on a new task needs."""

    name: str
    """The controllers' name."""
    task: str
    """The task."""
    steps: tuple[int | None, ...]
    """Environment steps of the smallest number of demonstrations that was enough, of each seed; None: none was."""
    most: int
    """Environment steps of the largest number that was tried."""


def bootstrap(values: Sequence[Array], seed: int = 0) -> Interval:
    """Return the mean over groups of values and its 95 % interval.

    Groups (the seeds of a training) are drawn with replacement, and within each its values (the episodes), so that the
    interval tells what another training would give, not only another episode.

    Args:
        values: the values of each group, `(N_k,)`; values that are not finite are left out.
        seed: of the draws.
    """
    kept = [group[np.isfinite(group)] for group in values]
    kept = [group for group in kept if len(group)]
    if not kept:
        return Interval(np.nan, np.nan, np.nan)
    rng = np.random.default_rng(seed)
    means = np.empty(DRAWS)
    for k in range(DRAWS):
        groups = rng.integers(len(kept), size=len(kept))
        means[k] = np.mean([rng.choice(kept[g], len(kept[g])).mean() for g in groups])
    low, high = np.quantile(means, [0.025, 0.975])
    return Interval(float(np.mean([group.mean() for group in kept])), float(low), float(high))


def scores(found: Sequence[dict[str, Any]]) -> list[Score]:
    """Return the scores of every name on every task and disturbance, in their order in `evaluated`'s entries."""
    groups: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for entry in found:
        groups.setdefault((name_of(entry["contestant"]), entry["task"], entry["disturb"]), []).append(entry)
    return [_score(which, entries) for which, entries in groups.items()]


def name_of(contestant: dict[str, Any]) -> str:
    """Return the name of a contestant's entry, without its seed."""
    return f"{contestant['kind']}, {contestant['task']}" if contestant["task"] else str(contestant["kind"])


def adaptations(found: Sequence[dict[str, Any]], seeds: Sequence[int]) -> list[Adaptation]:
    """Return what adapting took, by name and task, from `adapted`'s entries."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for entry in found:
        groups.setdefault((name_of(entry["contestant"]), entry["contestant"]["task"]), []).append(entry)
    told = []
    for (name, task), entries in groups.items():
        steps = []
        for seed in seeds:
            mine = [e for e in entries if e["contestant"]["seed"] == seed and e["completion"] >= ENOUGH]
            steps.append(min((e["steps"] for e in mine), default=None))
        told.append(Adaptation(name, task, tuple(steps), max(entry["steps"] for entry in entries)))
    return told


def _score(which: tuple[str, str, str], entries: Sequence[dict[str, Any]]) -> Score:
    def values(of: str) -> list[Array]:
        return [np.array([_number(episode[of]) for episode in entry["episodes"]]) for entry in entries]

    outcomes = [[episode["outcome"] for episode in entry["episodes"]] for entry in entries]
    lost = [np.isin(each, LOST) for each in outcomes]
    done = [np.array([o == REACHED for o in each], dtype=float) for each in outcomes]
    error = [np.where(gone, np.nan, rms) for gone, rms in zip(lost, values("rms_mm"), strict=True)]
    return Score(
        *which,
        entries[0]["contestant"]["task"] == entries[0]["task"],
        bootstrap(values("completion")),
        bootstrap(done),
        bootstrap(error),
        int(sum(each.sum() for each in lost)),
        sum(len(each) for each in outcomes),
    )


def _number(value: float | None) -> float:
    return np.nan if value is None else value
