"""What a training run wrote down of itself: its episodes, its losses and its evaluations, from `metrics.jsonl`."""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.tasks.primitives import TRAIN, UNSEEN, primitive_at
from inhand.tasks.spatial.primitives import DIRECTIONS, TURNS

PAGE = "report.md"
"""The page of a training run, written last of all."""
BEST, LAST = "best", "last"
"""Folders of a run's best policy, of its last one,"""
IMITATED = "imitated"
"""and of the one that it had before it learned values."""
JOURNAL = "metrics.jsonl"
"""Name of the file of lines."""
CHECKPOINT, READY, EXPERT, AGENT = "checkpoint.npz", "ready.npz", "expert.rows", "agent.rows"
"""What only a run that is not finished has: its checkpoint, what it began with, and the rows of both buffers."""
COMPILING = "compile ahead"
"""Beginning of the name of the thread in which JAX compiles while a run prepares itself."""
HEADER = ("Direction", "Of limit", "Lost", "Across [mm]", "Turn [deg]", "Return", "Expert's")
"""Columns of `evaluation_rows`."""
NEVER_SHOWN = "never shown"
"""Word for the directions in space, under gravities, that are kept from all that is learned from."""


@dataclass(frozen=True)
class Group:
    """Directions that are told together."""

    word: str
    title: str
    names: tuple[str, ...]

    @property
    def counted(self) -> str:
        """Its title with the number of its directions."""
        return f"{len(self.names)} {self.title}" if len(self.names) > 1 else self.title


IN_PLANE = tuple(
    Group(word, f"{word} directions", tuple(each.name for each in group))
    for word, group in (("trained", TRAIN), ("unseen", UNSEEN))
)
"""Groups of directions in the plane,"""
IN_SPACE = (
    Group("directions", "directions", tuple(each.name for each in DIRECTIONS)),
    Group("turns", "turns", tuple(each.name for each in TURNS)),
    Group(NEVER_SHOWN, "directions and gravities never shown", (NEVER_SHOWN,)),
)
"""and in space."""


@dataclass(frozen=True)
class Reached:
    """What a policy reached in one direction, or in several."""

    fraction: float
    """Mean share of the hand's limit."""
    dropped: int
    """Trials that lost the object."""
    trials: int
    across: float
    """Largest way across [m]."""
    turned: float
    """Largest angle turned [rad]."""
    total: float
    """Mean sum of rewards."""
    expert_total: float
    """The expert's."""
    expert_fraction: float = float("nan")
    """The expert's mean share of the limit; NaN where the run did not write it down."""


@dataclass(frozen=True)
class Evaluated:
    """One evaluation."""

    episode: int
    """Episodes before it."""
    score: float
    """What the best is chosen by."""
    directions: dict[str, Reached]
    """What was reached by the name of the direction, in the order of the test."""

    @property
    def groups(self) -> tuple[Group, ...]:
        """Groups of the directions that were tried."""
        known = IN_SPACE if TURNS[0].name in self.directions or NEVER_SHOWN in self.directions else IN_PLANE
        return tuple(group for group in known if any(name in self.directions for name in group.names))

    def over(self, names: Sequence[str]) -> Reached:
        """Return what was reached over several directions."""
        return joined([self.directions[name] for name in names if name in self.directions])


@dataclass(frozen=True, eq=False)
class Learned:
    """A training run's own record: N episodes, M rounds of updates, and its evaluations."""

    total: Array
    """Sum of the rewards of each episode `(N,)`."""
    last: Array
    """Last reward of each episode `(N,)`."""
    at: Array
    """Episodes before each round of updates `(M,)`."""
    critic_loss: Array
    """Mean loss of the critic in each round `(M,)`."""
    actor_loss: Array
    """Mean loss of the actor in each round `(M,)`."""
    evaluations: tuple[Evaluated, ...]

    @property
    def best(self) -> Evaluated:
        """The evaluation whose policy is kept as the best: the first of the highest score."""
        return max(self.evaluations, key=lambda each: each.score)

    @property
    def groups(self) -> tuple[Group, ...]:
        """Groups of directions that every evaluation has tried."""
        return tuple(group for group in self.best.groups if all(group in each.groups for each in self.evaluations))

    @property
    def names(self) -> list[str]:
        """Directions of the best evaluation, group by group."""
        return [name for group in self.best.groups for name in group.names if name in self.best.directions]


def read_learning(folder: Path) -> Learned:
    """Return what the training run of a folder wrote down; a last line that was cut off does not count.

    Raises:
        InputError: no record there, a line that is none, or no evaluation yet.
    """
    path = folder / JOURNAL
    if not path.is_file():
        raise InputError(f"no record of a training in {folder}: it has no {JOURNAL}; give a run of `inhand train`")
    whole, _, _ = path.read_text(encoding="utf-8").rpartition("\n")
    try:
        lines = [json.loads(line) for line in whole.splitlines()]
        kinds = {kind: [line for line in lines if line["kind"] == kind] for kind in ("episode", "learning")}
        evaluations = tuple(_evaluated(line) for line in lines if line["kind"] == "evaluation")
        found = Learned(
            _column(kinds["episode"], "total"),
            _column(kinds["episode"], "last"),
            _column(kinds["learning"], "step"),
            _column(kinds["learning"], "critic loss"),
            _column(kinds["learning"], "actor loss"),
            evaluations,
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path} is no record of a training: {error!r}; give a run of `inhand train`") from error
    if not evaluations:
        raise InputError(f"the run in {folder} has not been evaluated yet: let it train on")
    return found


def joined(parts: Sequence[Reached]) -> Reached:
    """Return what was reached over several directions: means, sums and worst values."""
    return Reached(
        float(np.mean([part.fraction for part in parts])),
        sum(part.dropped for part in parts),
        sum(part.trials for part in parts),
        max(part.across for part in parts),
        max(part.turned for part in parts),
        float(np.mean([part.total for part in parts])),
        float(np.mean([part.expert_total for part in parts])),
        float(np.mean([part.expert_fraction for part in parts])),
    )


def evaluation_rows(found: Evaluated) -> list[tuple[str, ...]]:
    """Return the rows under `HEADER`: every direction, and groups of several as a whole."""
    rows = []
    for group in found.groups:
        if len(group.names) > 1:
            rows += [_row(name, found.directions[name]) for name in group.names if name in found.directions]
        rows.append(_row(group.title, found.over(group.names)))
    return rows


def _row(name: str, reached: Reached) -> tuple[str, ...]:
    return (
        name,
        f"{reached.fraction:.2f}",
        f"{reached.dropped} of {reached.trials}",
        f"{1e3 * reached.across:.1f}",
        f"{np.rad2deg(reached.turned):.1f}",
        f"{reached.total:.1f}",
        f"{reached.expert_total:.1f}",
    )


def _evaluated(line: dict[str, Any]) -> Evaluated:
    order = {primitive.name: number for number, primitive in enumerate((*TRAIN, *UNSEEN))}
    named = {_name(word): Reached(**entry) for word, entry in line["directions"].items()}
    return Evaluated(
        int(line["step"]),
        float(line["score"]),
        dict(sorted(named.items(), key=lambda item: order.get(item[0], len(order)))),
    )


def _name(word: str) -> str:
    """Return the name of a direction: in the plane it is told by its angle [deg]."""
    return word if re.search("[a-z]", word) else primitive_at(float(word)).name


def _column(lines: Sequence[dict[str, Any]], name: str) -> Array:
    return np.array([float(line[name]) for line in lines])
