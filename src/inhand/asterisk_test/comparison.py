"""A learned policy and the expert from the same starts: what both do, and one table for both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.results import Result, averaged, by_direction, mean_fraction, result_of_human
from inhand.asterisk_test.run import Assignment, Setup
from inhand.control.draws import check_count
from inhand.control.trial import Trial
from inhand.errors import InputError
from inhand.pages import NOTHING
from inhand.tasks.primitives import TRAIN, UNSEEN, Primitive

GROUPS = (("Trained directions", TRAIN), ("Unseen directions", UNSEEN))
"""The directions that training may see, and the eight that it never sees (thesis 3.3)."""


HEADER = (
    "Direction", "Limit [mm]", "Of limit", "Distance [mm]", "Human [mm]", "Lateral [mm]", "Turn [deg]", "Contact",
    "Lost",
)  # fmt: skip
"""Columns of `rows`; all but limit and human hold the policy's value and the expert's."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Every trial of one controller."""

    name: str
    """The controller."""
    trials: tuple[Trial, ...]
    """Its trials."""
    results: tuple[Result, ...]
    """Their results, in the same order."""
    shown: int
    """Trials of each direction that the table's distances and the figures show; the others only count losses."""

    @property
    def first(self) -> tuple[tuple[Trial, ...], tuple[Result, ...]]:
        """Trials that are shown, and their results."""
        rows = [i for i, result in enumerate(self.results) if result.trial <= self.shown]
        return tuple(self.trials[i] for i in rows), tuple(self.results[i] for i in rows)

    @property
    def failed(self) -> list[tuple[Trial, Result]]:
        """Trials that did not come to their end with the object in the hand, and their results."""
        pairs = zip(self.trials, self.results, strict=True)
        return [(trial, result) for trial, result in pairs if not result.kept]


def with_more(setup: Setup, episodes: int) -> Setup:
    """Return a setup with more trials, spread evenly over its directions, until there are as many as asked for.

    The first trials start as they do without the others.

    Raises:
        InputError: fewer than one episode, or more than a run can hold.
    """
    if episodes < 1:
        raise InputError(f"--episodes {episodes}: give at least one episode")
    check_count(episodes, f"--episodes {episodes}")
    ways = {each.primitive: each for each in setup.assignments}
    done = max(each.trial for each in setup.assignments)
    more: list[Assignment] = []
    while len(setup.assignments) + len(more) < episodes:
        number = len(more)
        way = list(ways.values())[number % len(ways)]
        more.append(replace(way, trial=done + 1 + number // len(ways)))
    return replace(setup, assignments=(*setup.assignments, *more))


def lost(results: Sequence[Result]) -> int:
    """Return in how many trials the object was lost, or never held."""
    return sum(result.lost for result in results)


def rows(
    policy: Evaluation, expert: Evaluation, people: Sequence[HumanTrial], group: Sequence[Primitive]
) -> list[tuple[str, ...]]:
    """Return a row for each of some directions that was run, and one for all: the policy's values beside the expert's.

    Distances are means over the trials that are shown, with their SD in a direction's row; lateral, turn and contact
    are the worst trial's; losses count over all episodes.
    """
    human = by_direction([result for result in map(result_of_human, people) if averaged(result)])
    run = {result.direction for result in policy.results}
    names = [primitive.name for primitive in group if primitive.name in run]
    lines = [_row(name, _of(policy, [name]), _of(expert, [name]), human.get(name, [])) for name in names]
    every = [result for name in names for result in human.get(name, [])]
    return [*lines, _row(f"all {len(names)}", _of(policy, names), _of(expert, names), every)]


Both = tuple[list[Result], list[Result]]


def _of(found: Evaluation, names: Sequence[str]) -> Both:
    """Return the shown and all results of some directions."""
    every = [result for result in found.results if result.direction in names]
    return [result for result in every if result.trial <= found.shown], every


def _row(name: str, policy: Both, expert: Both, human: Sequence[Result]) -> tuple[str, ...]:
    limits = {result.direction: result.limit for result in policy[0] if result.limit is not None}

    def both(told: Callable[[list[Result]], str], *, every: bool = False) -> str:
        return " | ".join(told(found[every]) for found in (policy, expert))

    return (
        name,
        f"{np.mean(list(limits.values())):.1f}" if limits else NOTHING,
        both(_fraction),
        both(_distance),
        _distance(human),
        both(lambda found: f"{max(r.metrics.lateral_max_mm for r in found):.1f}"),
        both(lambda found: f"{max(r.metrics.rotation_max_deg for r in found):.1f}"),
        both(_contact),
        both(lambda found: f"{lost(found)} of {len(found)}", every=True),
    )


def _fraction(found: Sequence[Result]) -> str:
    share = mean_fraction(found)
    return NOTHING if share is None else f"{share:.2f}"


def _distance(found: Sequence[Result]) -> str:
    """Return the mean distance, and its SD where all are of one direction."""
    if not found:
        return NOTHING
    reached = [result.reached for result in found]
    several = len(found) > 1 and len({result.direction for result in found}) == 1
    return f"{np.mean(reached):.1f}" + (f" ± {np.std(reached, ddof=1):.1f}" if several else "")


def _contact(found: Sequence[Result]) -> str:
    contact = [r.metrics.contact_fraction for r in found if r.metrics.contact_fraction is not None]
    return f"{min(contact):.3f}" if contact else NOTHING
