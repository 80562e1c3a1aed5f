"""The table of a run: one row for each direction, for the terminal and the report alike."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.results import Result, as_entry, averaged, by_direction, mean_fraction, result_of_human, tidy
from inhand.control.trial import DIVERGED, GRIP_END, LOST_CONTACT, NO_GRASP, NO_MOVEMENT, REACHED, STOPPED, TIME_OUT
from inhand.pages import NO_VERDICT, NOTHING, spread

if TYPE_CHECKING:
    from pandas import DataFrame

HEADER = (
    "Direction", "Distance [mm]", "Limit [mm]", "Of limit", "Human [mm]", "Lateral", "Off path", "Turn", "Eff.",
    "Contact", "Gap [s]", "Force", "Overlap", "Outcome",
)  # fmt: skip
WORST_FIRST = (DIVERGED, NO_GRASP, LOST_CONTACT, NO_MOVEMENT, STOPPED, TIME_OUT, GRIP_END, REACHED)
"""Outcomes in the order in which the table names one for several trials."""


def table_rows(results: Sequence[Result], people: Sequence[HumanTrial]) -> list[tuple[str, ...]]:
    """Return the rows under `HEADER`; distances are mean ± SD over trials, the other values the worst trial's."""
    human = by_direction([result for result in map(result_of_human, people) if averaged(result)])
    trials = tidy(as_entry(result) for result in results)
    return [
        _row(name, group, trials[(trials.direction == name).to_numpy()], human.get(name, []))
        for name, group in by_direction(results).items()
    ]


def shown_columns(rows: Sequence[tuple[str, ...]]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return `HEADER` and rows without the columns that say nothing, such as people's where there are none."""
    full = [i for i in range(len(HEADER)) if any(row[i] != NOTHING for row in rows)]
    return tuple(HEADER[i] for i in full), [tuple(row[i] for i in full) for row in rows]


def with_beside(
    header: tuple[str, ...], rows: Sequence[tuple[str, ...]], name: str, beside: Sequence[Beside]
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return header and rows with a column of distances, after that of the run of a name, for every run beside it."""
    if not beside:
        return header, list(rows)
    groups = [by_direction(run.results) for run in beside]
    widened = [(*row[:2], *(reached(group.get(row[0], [])) for group in groups), *row[2:]) for row in rows]
    return (header[0], *(f"{each} [mm]" for each in (name, *(run.name for run in beside))), *header[2:]), widened


def failures(results: Sequence[Result]) -> list[str]:
    """Return one sentence for every direction in which a trial did not end well: how often, which finger, where."""
    sentences = []
    for name, group in by_direction(results).items():
        bad = [result for result in group if not result.kept]
        if not bad:
            continue
        fingers = sorted({result.first_lost for result in bad if result.first_lost})
        why = "; ".join(sorted({result.outcome for result in bad}))
        held = "" if all(result.outcome == NO_GRASP for result in bad) else _where(bad)
        advice = f" {NO_VERDICT}" if any(result.outcome == DIVERGED for result in bad) else ""
        finger = f", first by {' or '.join(fingers)}" if fingers else ""
        sentences.append(f"{name}: {why} in {len(bad)} of {len(group)} trials{held}{finger}.{advice}")
    return sentences


def metric_faults(results: Sequence[Result]) -> list[str]:
    """Return one sentence for every metric of the user's that gave no number for a trial: for how many, and why."""
    sentences = []
    for name in dict.fromkeys(name for result in results for name in result.wrong):
        bad = [result for result in results if name in result.wrong]
        first = f"{bad[0].direction}, trial {bad[0].trial}: {bad[0].wrong[name]}"
        sentences.append(
            f"Metric {name} gave no number for {len(bad)} of {len(results)} trials ({first}). Mend it; inhand.load of"
            " the run's folder measures the trials again."
        )
    return sentences


def _where(bad: Sequence[Result]) -> str:
    """Return how far trials of one direction went, beside what the hand could do or the thesis would have counted."""
    limit, unit = bad[0].limit, _unit(bad) or " mm"
    counted = ", ".join(str(round(result.reached)) for result in bad)
    if all(result.outcome == NO_MOVEMENT for result in bad) and limit is not None:
        return f" after {counted} of {limit:.0f}{unit}"
    if bad[0].turns:
        return f" after {counted}{unit}"
    carried = ", ".join(str(round(result.carried_mm)) for result in bad)
    return f" after {counted} mm ({carried} mm with lost and regained contacts allowed)"


def endings(results: Sequence[Result]) -> str:
    """Return how the trials that kept their object ended, and how far that is from what the hand could do."""
    kept = [result for result in results if result.kept]
    if not kept:
        return "No trial carried the object to the end of its path or of its grip."
    whole = f"All {len(kept)} trials" if len(kept) > 1 else "The trial"
    if len(kept) < len(results):
        whole = f"{len(kept)} of {len(results)} trials"
    path, grip = (sum(result.outcome == outcome for result in kept) for outcome in (REACHED, GRIP_END))
    where = [f"{path} came to the end of their path"] * (path > 0)
    where += [f"{grip} stopped where the grip was predicted to end"] * (grip > 0)
    known = [result for result in kept if result.fraction is not None]
    told = ""
    if known:
        least = min(known, key=lambda result: result.fraction or 0.0)
        told = (
            f" They came {mean_fraction(known):.2f} of the hand's limit on average, at least {least.fraction:.2f}"
            f" ({least.direction}, {least.reached:.0f} of {least.limit:.0f}{_unit([least]) or ' mm'})."
        )
    return f"{whole} kept the object: {' and '.join(where)}.{told}"


def _row(name: str, group: list[Result], trials: DataFrame, human: list[Result]) -> tuple[str, ...]:
    """Return the row of a direction: of a group of results, which are the rows of a table too, and of people's."""
    outcomes = [result.outcome for result in group]
    worst = min(outcomes, key=WORST_FIRST.index)
    off = trials.path_max_mm[[result.bent for result in group]]
    return (
        name,
        reached(group),
        *(spread(value) + (_unit(group) if np.isfinite(value) else "") for value in trials.limit[:1]),
        spread(trials.fraction_of_limit.mean(), digits=2),
        reached(human),
        spread(trials.lateral_max_mm.max()),
        spread(off.max()),
        spread(trials.rotation_max_deg.max()),
        spread(trials.efficiency.mean(), digits=2),
        spread(trials.contact_fraction.min(), digits=3),
        spread(trials.longest_gap_s.max(), digits=2),
        spread(trials.force_max_n.max(), digits=2),
        spread(trials.penetration_max_mm.max(), digits=2),
        f"{outcomes.count(worst)}/{len(group)} {worst}",
    )


def reached(group: Sequence[Result]) -> str:
    """Return the distance of a translation, or the angle of a rotation, as mean ± SD."""
    from pandas import Series

    values = Series([result.reached for result in group], dtype=float)
    return spread(values.mean(), values.std()) + _unit(group)


def _unit(group: Sequence[Result]) -> str:
    """Return the unit of a group that only rotates; the heading names that of the others."""
    return " deg" if group and group[0].turns else ""
