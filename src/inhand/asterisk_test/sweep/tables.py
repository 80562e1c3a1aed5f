"""The tables of a sweep, for the terminal and the report alike: hands compared, the best of them, what failed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from inhand.asterisk_test.sweep.summary import (
    Case,
    Cell,
    Sweep,
    comparable,
    grouped,
    kept_share,
    least_fraction,
    mean_fraction,
    mean_reached,
    median_fraction,
)

NOTHING = "-"
"""A value that is not known."""
POOR = 0.5
"""Share of the limit below which a case is listed as poor although nothing was lost."""

BEYOND = 1.02
"""Share of the limit above which a case is listed: start noise explains a little more than 1, not this."""


@dataclass(frozen=True)
class Table:
    """A table of texts."""

    title: str
    """What it shows."""
    header: tuple[str, ...]
    """Names of its columns."""
    rows: tuple[tuple[str, ...], ...]
    """Its rows."""


def hands_table(sweep: Sweep) -> Table:
    """Return one row for each hand over all objects and directions."""
    header = (
        "Hand", "No.", "Objects run", "Mean distance [mm]", "Median of limit", "Mean of limit", "Least", "Kept",
    )  # fmt: skip
    groups = grouped(sweep.cases, lambda case: case.hand)
    rows = []
    for number, hand in enumerate(sweep.hands, start=1):
        cases = groups.get(hand, [])
        ran = sum(cell.reason is None for cell in sweep.cells if cell.hand == hand)
        objects = f"{ran} of {len(sweep.objects)}"
        rows.append(
            (hand, str(number), objects, _reached(sweep, cases), shown(median_fraction(cases)), *_shares(cases))
        )
    return Table("Hands, over all objects and directions", header, tuple(rows))


def cells_table(sweep: Sweep) -> Table:
    """Return one row for each hand with each object, over all directions."""
    header = ("Hand", "Object", "Mean distance [mm]", "Mean of limit", "Least", "Kept", "Seconds")
    rows = []
    for cell in sweep.cells:
        cases = comparable(cell.cases)
        distance = f"{np.mean([case.reached for case in cases]):.1f}" if cases else NOTHING
        rows.append((cell.hand, cell.object, distance, *_shares(cell.cases), f"{cell.seconds:.1f}"))
    return Table("Every hand with every object, over all directions", header, tuple(rows))


def best_by_direction(sweep: Sweep) -> Table:
    """Return the best hand for each direction, over all objects."""
    count = len(sweep.objects)
    rows = [_best_row(sweep, name, lambda case: case.direction, count) for name in sweep.directions]
    return Table("Best hand for each direction, over all objects", ("Direction", *_BEST), tuple(rows))


def best_by_object(sweep: Sweep) -> Table:
    """Return the best hand for each object, over all directions."""
    count = len(sweep.directions)
    rows = [_best_row(sweep, name, lambda case: case.object, count) for name in sweep.objects]
    return Table("Best hand for each object, over all directions", ("Object", *_BEST), tuple(rows))


def best_of_each(sweep: Sweep) -> Table:
    """Return for each direction and object the number of the hand that carries farthest, and how far."""
    found = {
        key: max(cases, key=lambda case: case.reached)
        for key, cases in grouped(sweep.cases, lambda case: f"{case.direction}\n{case.object}").items()
    }
    rows = []
    for direction in sweep.directions:
        cases = [found.get(f"{direction}\n{thing}") for thing in sweep.objects]
        texts = (f"{sweep.hands.index(case.hand) + 1}: {case.reached:.0f}" if case else NOTHING for case in cases)
        rows.append((direction, *texts))
    title = "Best hand for each direction and object: its number, and mm (deg for rotations) reached"
    return Table(title, ("Direction", *sweep.objects), tuple(rows))


def summary(sweep: Sweep) -> list[str]:
    """Return the sweep in a few sentences: how far, how often kept, how fast."""
    cases, ran = sweep.cases, sum(cell.reason is None for cell in sweep.cells)
    kept = sum(case.kept for case in cases)
    unknown = sum(not np.isfinite(case.fraction) for case in cases)
    lines = [
        f"Median fraction of the limit over {len(cases)} cases (a hand, an object and a direction each):"
        f" {shown(median_fraction(cases))}; mean {shown(mean_fraction(cases))}."
        + (f" {unknown} of them have a limit of 0 and no fraction." if unknown else ""),
        f"Contact kept to the counted distance in {kept} of {len(cases)} cases ({_percent(kept_share(cases))}).",
        f"{ran} of {len(sweep.cells)} cells (a hand with an object each) ran.",
    ]
    if ran < len(sweep.cells):
        every = len(sweep.cells) * len(sweep.directions)
        lines[-1] += f" With the others counted as not kept: {kept} of {every} cases ({_percent(kept / every)})."
    return [*lines, _speed(sweep)]


def failures(sweep: Sweep) -> list[str]:
    """Return a sentence for every cell that could not be run and every case in which the object was not kept."""
    stopped = [f"{cell.hand} with {cell.object} could not be run: {cell.reason}" for cell in sweep.cells if cell.reason]
    lost = []
    for case in sweep.cases:
        if case.failures:
            why = "; ".join(dict.fromkeys(case.failures))
            unit = "deg" if case.rotates else "mm"
            lost.append(
                f"{case.hand} with {case.object}, {case.direction}: {why}, after {case.reached:.0f} of"
                f" {case.limit:.0f} {unit}"
            )
    return stopped + lost


def poor(sweep: Sweep) -> list[str]:
    """Return a sentence for every cell with directions that kept the object but ended below half of the limit."""
    sentences = []
    for cell in sweep.cells:
        low = [f"{case.direction} {shown(case.fraction)}" for case in cell.cases if case.kept and case.fraction < POOR]
        if low:
            sentences.append(f"{cell.hand} with {cell.object}: {', '.join(low)}")
    return sentences


def beyond(sweep: Sweep) -> list[str]:
    """Return a sentence for every case that went beyond its limit, which then cannot be the hand's."""
    return [
        f"{case.hand} with {case.object}, {case.direction}: {case.reached:.0f} against a limit of {case.limit:.0f}"
        f" {'deg' if case.rotates else 'mm'} ({shown(case.fraction)})"
        for case in sweep.cases
        if case.fraction > BEYOND
    ]


def shown(fraction: float) -> str:
    """Return a fraction as people read it."""
    return f"{fraction:z.2f}" if np.isfinite(fraction) else NOTHING


_BEST = ("Farthest", "Mean [mm]", "Second", "Its mean", "Nearest to its limit", "Mean of limit")


def _best_row(sweep: Sweep, name: str, key: Callable[[Case], str], count: int) -> tuple[str, ...]:
    """Return the hands that carry farthest and nearest to their limit among the cases of a name."""
    hands = grouped((case for case in sweep.cases if key(case) == name), lambda case: case.hand)
    if not hands:
        return (name, *[NOTHING] * len(_BEST))
    reached, unit = {}, ""
    for hand, cases in hands.items():
        alike = comparable(cases)
        reached[hand] = mean_reached(alike, count - len(cases) + len(alike))
        unit = " deg" if alike[0].rotates else ""
    first, second = (*sorted(reached, key=reached.__getitem__, reverse=True)[:2], None)[:2]
    fractions = {hand: mean_fraction(cases) for hand, cases in hands.items()}
    nearest = max(fractions, key=lambda hand: np.nan_to_num(fractions[hand], nan=-1.0))
    runner_up = (NOTHING, NOTHING) if second is None else (second, f"{reached[second]:.1f}{unit}")
    return (name, str(first), f"{reached[str(first)]:.1f}{unit}", *runner_up, nearest, shown(fractions[nearest]))


def _reached(sweep: Sweep, cases: Sequence[Case]) -> str:
    """Return a hand's mean distance over all objects and directions, what could not be run counting as nothing."""
    alike = comparable(cases)
    directions = len({case.direction for case in alike})
    return f"{mean_reached(alike, directions * len(sweep.objects)):.1f}" if alike else NOTHING


def _shares(cases: Sequence[Case]) -> tuple[str, str, str]:
    kept = f"{sum(case.kept for case in cases)}/{len(cases)}" if cases else NOTHING
    return shown(mean_fraction(cases)), shown(least_fraction(cases)), kept


def _speed(sweep: Sweep) -> str:
    cells: Sequence[Cell] = [cell for cell in sweep.cells if cell.reason is None]
    clock, cpu = sum(cell.seconds for cell in sweep.cells), sum(cell.cpu_seconds for cell in sweep.cells)
    if not cells or not clock:
        return "No cell ran."
    return (
        f"Speed of one core: {60 * len(cells) / clock:.2f} cells a minute by the clock,"
        f" {60 * len(cells) / max(cpu, 1e-9):.2f} by processor time; all cells took {clock / 60:.1f} core minutes."
    )


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %" if np.isfinite(share) else NOTHING
