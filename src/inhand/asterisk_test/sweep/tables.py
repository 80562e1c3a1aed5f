"""The tables of a sweep, for the terminal and the report alike: hands compared, the best of them, what failed."""

import math
from itertools import product
from typing import Any

import pandas as pd

from inhand.asterisk_test.regrasped import TITLE
from inhand.asterisk_test.sweep.summary import CASE, Sweep, compared
from inhand.pages import NOTHING, Table, spread

POOR = 0.5
"""Share of the limit below which a case is listed as poor although nothing was lost."""
BEYOND = 1.02
"""Share of the limit above which a case is listed: start noise explains a little more than 1, not this."""


def hands_table(sweep: Sweep) -> Table:
    """Return one row for each hand over all objects and directions."""
    ran = sweep.cells.reason.isna().groupby(sweep.cells.hand, sort=False).sum()
    found = _records(compared(sweep, ["hand"]).reindex(ran.index).assign(ran=ran))
    rows = [(row["hand"], f"{row['ran']} of {len(sweep.objects)}", *_told(row)) for row in found]
    return Table("Hands, over all objects and directions", ("Hand", "Objects run", *_columns(sweep)), tuple(rows))


def cells_table(sweep: Sweep) -> Table:
    """Return one row for each hand with each object, over all directions."""
    cells = sweep.cells.set_index(CASE[:2])
    found = _records(compared(sweep, CASE[:2]).reindex(cells.index).assign(seconds=cells.seconds))
    rows = [(row["hand"], row["object"], *_told(row), f"{row['seconds']:.1f}") for row in found]
    header = ("Hand", "Object", *_columns(sweep), "Seconds")
    return Table("Every hand with every object, over all directions", header, tuple(rows))


def best_by_direction(sweep: Sweep) -> Table:
    """Return the best hand for each direction, over all objects."""
    return _best(sweep, "direction", sweep.directions, "Best hand for each direction, over all objects")


def best_by_object(sweep: Sweep) -> Table:
    """Return the best hand for each object, over all directions."""
    return _best(sweep, "object", sweep.objects, "Best hand for each object, over all directions")


def best_of_each(sweep: Sweep) -> Table:
    """Return for each direction and object the hand that carries farthest, and the hand that could."""
    cases = sweep.cases.rename(columns={"reached": "distance"})
    rows = []
    for direction, thing in product(sweep.directions, sweep.objects):
        hands = cases[(cases.direction == direction) & (cases.object == thing)]
        rows.append((direction, thing, *_leaders(hands, _unit(sweep, direction), ("distance", "limit"))))
    header = ("Direction", "Object", "Farthest", "Distance [mm]", "Largest limit", "Limit [mm]")
    return Table("Best hand for each direction and object", header, tuple(rows))


def anew_tables(sweep: Sweep) -> list[Table]:
    """Return what fingers that were placed anew reach, by hand, object and direction; none where they may not be."""
    anew = sweep.anew
    if anew is None:
        return []
    tables = []
    for key, names in zip(CASE, (sweep.hands, sweep.objects, sweep.directions), strict=True):
        test, after = (_records(compared(each, [key]).reindex(list(names))) for each in (sweep, anew))
        trials = anew.trials.assign(times=anew.trials.placed_anew > 0).groupby(key)
        counts = trials[["times", "regrasped_lost"]].sum().assign(all=trials.size()).reindex(list(names), fill_value=0)
        rows = [
            (
                name,
                spread(own["distance"]),
                *(shown(own[column]) for column in ("share", "median", "least")),
                *(shown(before[column]) for column in ("share", "median")),
                f"{count['times']} of {count['all']}",
                f"{count['regrasped_lost']}",
            )
            for name, before, own, count in zip(names, test, after, _records(counts), strict=True)
        ]
        header = f"Distance [{sweep.unit}]", "Of limit", "Median", "Least", "In the test", "Its median", "Placed anew"
        tables.append(Table(f"{TITLE}: {key}s", (key.capitalize(), *header, "Lost"), tuple(rows)))
    return tables


def summary(sweep: Sweep) -> list[str]:
    """Return the sweep in a few sentences: how far, how often kept, how fast."""
    cases, cells = sweep.cases, sweep.cells
    ran, kept, unknown = cells.reason.isna().sum(), cases.kept.sum(), cases.share.isna().sum()
    lines = [
        f"Share of the limit that the controller reaches, its skill, over {len(cases)} cases (a hand, an object and a"
        f" direction each): median {shown(cases.share.median())}; mean {shown(cases.share.mean())}."
        + (f" {unknown} of them have a limit of 0 and no share." if unknown else ""),
        f"Contact kept to the counted distance in {kept} of {len(cases)} cases ({_percent(kept, len(cases))}).",
        f"{ran} of {len(cells)} cells (a hand with an object each) ran.",
    ]
    if ran < len(cells):
        every = len(cells) * len(sweep.directions)
        lines[-1] += f" With the others counted as not kept: {kept} of {every} cases ({_percent(kept, every)})."
    anew = sweep.anew
    if anew is not None:
        times = (anew.trials.placed_anew > 0).sum()
        lines.append(
            f"{TITLE}, which forbids to let go: median {shown(anew.cases.share.median())}; mean"
            f" {shown(anew.cases.share.mean())}. Fingers were placed anew in {times} of {len(anew.trials)} trials."
        )
    return [*lines, _speed(cells)]


def failures(sweep: Sweep) -> list[str]:
    """Return a sentence for every cell that could not be run and every case in which the object was not kept."""
    stopped = _records(sweep.cells[sweep.cells.reason.notna()])
    return [
        *(f"{cell['hand']} with {cell['object']} could not be run: {cell['reason']}" for cell in stopped),
        *(
            f"{_named(case)}: {case['why']}, after {case['reached']:.0f} of {_limit(case)}"
            for case in _records(sweep.cases[~sweep.cases.kept])
        ),
    ]


def poor(sweep: Sweep) -> list[str]:
    """Return a sentence for every cell with directions that kept the object but ended below half of the limit."""
    low: dict[str, list[str]] = {}
    for case in _records(sweep.cases[sweep.cases.kept & (sweep.cases.share < POOR)]):
        ways = low.setdefault(f"{case['hand']} with {case['object']}", [])
        ways.append(f"{case['direction']} {shown(case['share'])}")
    return [f"{cell}: {', '.join(ways)}" for cell, ways in low.items()]


def beyond(sweep: Sweep) -> list[str]:
    """Return a sentence for every case that went beyond its limit, which then cannot be the hand's."""
    return [
        f"{_named(case)}: {case['reached']:.0f} against a limit of {_limit(case)} ({shown(case['share'])})"
        for case in _records(sweep.cases[sweep.cases.share > BEYOND])
    ]


def shown(share: float) -> str:
    """Return a share as people read it."""
    return spread(share, digits=2)


def _columns(sweep: Sweep) -> tuple[str, ...]:
    far, limit = f"Distance [{sweep.unit}]", f"Limit [{sweep.unit}]"
    return far, "Distance [L]", limit, "Limit [L]", "Skill", "Median", "Least", "Kept"


def _told(row: dict[str, Any]) -> tuple[str, ...]:
    """Return a row of `compared` under `_columns`."""
    return (
        spread(row["distance"], row["sd"]),
        shown(row["distance_size"]),
        spread(row["limit"]),
        shown(row["limit_size"]),
        spread(row["share"], row["share_sd"], 2),
        shown(row["median"]),
        shown(row["least"]),
        f"{row['kept']:.0f}/{row['cases']:.0f}" if row["cases"] > 0 else NOTHING,
    )


def _best(sweep: Sweep, name: str, among: tuple[str, ...], title: str) -> Table:
    """Return the hands that carry farthest, could carry farthest, and go farthest for their size."""
    found = compared(sweep, ["hand", name]).reset_index()
    kinds = ("distance", "second", "limit", "distance_size")
    rows = [(each, *_leaders(found[found[name] == each], _unit(sweep, each), kinds)) for each in among]
    header = (
        name.capitalize(), "Farthest", "Distance [mm]", "Second", "Its distance", "Largest limit", "Limit [mm]",
        "Farthest for its size", "Distance [L]",
    )  # fmt: skip
    return Table(title, header, tuple(rows))


def _leaders(hands: pd.DataFrame, unit: str, kinds: tuple[str, ...]) -> list[str]:
    """Return for each kind of lead the hand that has it, and by how much."""
    told: list[str] = []
    for kind in kinds:
        column, place = ("distance", 1) if kind == "second" else (kind, 0)
        ranked = _records(hands.dropna(subset=[column]).sort_values(column, ascending=False, kind="stable"))
        if len(ranked) <= place:
            told += [NOTHING, NOTHING]
            continue
        row = ranked[place]
        sized = kind == "distance_size"
        told += [row["hand"], spread(row[column], row["sd"] if column == "distance" else math.nan, 1 + sized) + unit]
    return told


def _speed(cells: pd.DataFrame) -> str:
    ran, clock, cpu = cells.reason.isna().sum(), cells.seconds.sum(), cells.cpu_seconds.sum()
    if not ran or not clock:
        return "No cell ran."
    return (
        f"All cells took one core {clock:.0f} s by the clock, {cpu:.0f} s of its own:"
        f" {60 * ran / clock:.1f} and {60 * ran / max(cpu, 1e-9):.1f} cells a minute."
    )


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    named = table if isinstance(table.index, pd.RangeIndex) or table.index.names == [None] else table.reset_index()
    return [{str(key): value for key, value in row.items()} for row in named.to_dict("records")]


def _percent(part: float, whole: int) -> str:
    return f"{100 * part / whole:.1f} %" if whole else NOTHING


def _unit(sweep: Sweep, direction: str) -> str:
    """Return the unit of a direction that only turns; the heading names that of the others."""
    turns = sweep.unit == "deg" or direction in set(sweep.directions) - set(sweep.alike)
    return " deg" if turns else ""


def _named(case: dict[str, Any]) -> str:
    return f"{case['hand']} with {case['object']}, {case['direction']}"


def _limit(case: dict[str, Any]) -> str:
    return f"{case['limit']:.0f} {'deg' if case['rotates'] else 'mm'}"
