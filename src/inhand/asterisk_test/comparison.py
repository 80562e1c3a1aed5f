"""A learned policy and the expert from the same starts: what both do, and one table for both."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.results import Result, as_entry, averaged, result_of_human, tidy
from inhand.asterisk_test.run import Setup
from inhand.asterisk_test.spatial.run import SpatialSetup
from inhand.control.draws import check_count
from inhand.control.trial import LOST
from inhand.errors import InputError
from inhand.pages import spread
from inhand.tasks.primitives import TRAIN, UNSEEN, Primitive
from inhand.tasks.spatial.primitives import SpatialPrimitive

if TYPE_CHECKING:
    from pandas import DataFrame

S = TypeVar("S", bound=Setup | SpatialSetup)
AnyPrimitive: TypeAlias = Primitive | SpatialPrimitive
GROUPS = (("Trained directions", TRAIN), ("Unseen directions", UNSEEN))
"""The directions that training may see, and the eight that it never sees (thesis 3.3)."""
HEADER = (
    "Direction", "Limit [mm]", "Of limit", "Distance [mm]", "Human [mm]", "Lateral [mm]", "Turn [deg]", "Contact",
    "Lost",
)  # fmt: skip
"""Columns of `rows`; all but limit and human hold the policy's value and the expert's."""


@dataclass(frozen=True, eq=False)
class ControllerTrials:
    """Every trial of one controller."""

    name: str
    trials: tuple[Any, ...]
    """In the plane or in space."""
    results: tuple[Result, ...]
    """Their results, in the same order."""
    shown: int
    """Trials of each direction that the table's distances and the figures show; the others only count losses."""

    @property
    def first(self) -> tuple[tuple[Any, ...], tuple[Result, ...]]:
        """Trials that are shown, and their results."""
        rows = [i for i, result in enumerate(self.results) if result.trial <= self.shown]
        return tuple(self.trials[i] for i in rows), tuple(self.results[i] for i in rows)

    @property
    def shown_or_failed(self) -> tuple[tuple[Any, ...], tuple[Result, ...]]:
        """Trials that are shown and those that failed, and their results."""
        rows = [i for i, result in enumerate(self.results) if result.trial <= self.shown or not result.kept]
        return tuple(self.trials[i] for i in rows), tuple(self.results[i] for i in rows)

    @property
    def failed(self) -> list[tuple[Any, Result]]:
        """Trials that did not come to their end with the object in the hand, and their results."""
        pairs = zip(self.trials, self.results, strict=True)
        return [(trial, result) for trial, result in pairs if not result.kept]


def with_more(setup: S, episodes: int) -> S:
    """Return a setup with more trials, spread evenly over its directions, until there are as many as asked for.

    The first trials start as they do without the others.

    Raises:
        InputError: fewer than one episode, or more than a run can hold.
    """
    if episodes < 1:
        raise InputError(f"--episodes {episodes}: give at least one episode")
    check_count(episodes, f"--episodes {episodes}")
    every: tuple[Any, ...] = setup.assignments
    done, lacking = max(each.trial for each in every), max(episodes - len(every), 0)
    ways = {each.primitive: each for each in every}.values()
    more = [replace(way, trial=done + k) for k in range(1, 2 + lacking // len(ways)) for way in ways]
    changed: dict[str, Any] = {"assignments": (*every, *more[:lacking])}
    return replace(setup, **changed)


def lost(results: Sequence[Result]) -> int:
    """Return in how many trials the object was lost, or never held."""
    return sum(result.lost for result in results)


def rows(
    policy: ControllerTrials, expert: ControllerTrials, people: Sequence[HumanTrial], group: Sequence[AnyPrimitive]
) -> list[tuple[str, ...]]:
    """Return a row for each of some directions that was run, and one for all: the policy's values beside the expert's.

    Distances are means over the trials that are shown, with their SD in a direction's row; lateral, turn and contact
    are the worst trial's; losses count over all episodes.
    """
    both = [tidy(map(as_entry, found.results)) for found in (policy, expert)]
    human = tidy(as_entry(result) for result in map(result_of_human, people) if averaged(result))
    names = [primitive.name for primitive in group if primitive.name in set(both[0].direction)]
    every = [(name, [name]) for name in names] + [(f"all {len(names)}", names)]
    return [_row(name, [each[each.direction.isin(of)] for each in (*both, human)], policy.shown) for name, of in every]


def _row(name: str, found: Sequence[DataFrame], count: int) -> tuple[str, ...]:
    """Return a row of the policy's trials, the expert's and people's, of whose first so many distances are shown."""
    shown = [each[each.trial <= count] for each in found[:2]]

    def both(told: Callable[[DataFrame], str], of: Sequence[DataFrame] = shown) -> str:
        return " | ".join(told(each) for each in of)

    return (
        name,
        spread(shown[0].drop_duplicates("direction").limit.mean()),
        both(lambda trials: spread(trials.fraction_of_limit.mean(), digits=2)),
        both(_distance),
        _distance(found[2]),
        both(lambda trials: spread(trials.lateral_max_mm.max())),
        both(lambda trials: spread(trials.rotation_max_deg.max())),
        both(lambda trials: spread(trials.contact_fraction.min(), digits=3)),
        both(lambda trials: f"{trials.outcome.isin(LOST).sum()} of {len(trials)}", found[:2]),
    )


def _distance(trials: DataFrame) -> str:
    """Return the mean distance, and its SD where all are of one direction."""
    return spread(trials.reached.mean(), trials.reached.std() if len(set(trials.direction)) == 1 else math.nan)
