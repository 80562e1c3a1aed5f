"""The tables of a study of robustness, for the terminal and the report alike."""

from typing import Any

import pandas as pd

from inhand.asterisk_test.robustness.cases import Contender
from inhand.asterisk_test.robustness.summary import Robustness, over_seeds
from inhand.pages import NOTHING, Table
from inhand.pages import spread as shown
from inhand.sim.disturbance import LEVELS
from inhand.sim.disturbance_files import NONE

HEADER = (
    "Disturbance", "Trials", "Lost", "95 % [%]", "Share", "95 %", "Least", "Retention", "95 %", "Lateral [mm]",
    "Turn [deg]", "Overlap [mm]", "Deep [%]", "Force [N]", "Torque [N mm]",
)  # fmt: skip


def kept_table(found: Robustness) -> Table:
    """Return what every controller keeps of its way and how many objects it loses, a row for each disturbance."""
    names = [each.name for each in found.contenders]
    rows = [(case.name, *(_kept(found.row(name, case.name)) for name in names)) for case in found.cases if case.row]
    return Table("Share of the undisturbed way, and objects lost", ("Disturbance", *names), tuple(rows))


def controller_table(found: Robustness, contender: Contender) -> Table:
    """Return all that is reported of a controller, a row for each disturbance."""
    cases = [(case.name, found.row(contender.name, case.name)) for case in found.cases]
    rows = [(name, *([NOTHING] * (len(HEADER) - 1) if row is None else _told(row))) for name, row in cases]
    return Table(contender.name, HEADER, tuple(rows))


def contenders_table(found: Robustness) -> Table:
    """Return what each controller reads and what making it took."""
    rows = [(each.name, each.reads, each.cost) for each in found.contenders]
    return Table("Controllers", ("Controller", "Reads", "Training"), tuple(rows))


def seeds_table(found: Robustness) -> Table | None:
    """Return the range over seeds of training; None where no two controllers differ in their seed alone."""
    seeds = over_seeds(found)
    if not len(seeds):
        return None
    rows = [
        (str(row["group"]), str(row["disturb"]), _range(row, "retention", 1.0, 3), _range(row, "lost", 100.0, 1))
        for row in seeds.to_dict("records")
    ]
    header = ("Controllers", "Disturbance", "Retention: mean, least to most", "Lost [%]: mean, least to most")
    return Table("Range over seeds of training", header, tuple(rows))


def sensitivity_table(tables: dict[str, pd.DataFrame]) -> Table:
    """Return which quantities go with losing the object under each disturbance, those whose interval is clear of 0."""
    rows = []
    for disturb, table in tables.items():
        for controller, own in table.groupby("controller", sort=False):
            clear = own[(own.low > 0) | (own.high < 0)].sort_values("correlation", key=abs, ascending=False)
            told = [f"{row.quantity} {row.correlation:+.2f}" for row in clear.itertuples()]
            rows.append((disturb, str(controller), ", ".join(told) or "none"))
    header = ("Disturbance", "Controller", "Rank correlation with a loss")
    return Table("What goes with a loss", header, tuple(rows))


def summary(found: Robustness) -> list[str]:
    """Return the study in a few sentences: how far each controller goes, what it keeps at each level, how fast."""
    sentences = []
    for contender in found.contenders:
        plain = found.row(contender.name, NONE)
        if plain is None:
            continue
        levels = {each.name: found.row(contender.name, each.name) for each in LEVELS}
        told = [
            f"{name} {shown(row['retention'], digits=3)} ({_ends(row, 'retention')}) with {row['lost']} of"
            f" {row['trials']} objects lost ({_percent(row)})"
            for name, row in levels.items()
            if row is not None
        ]
        kept = f" It keeps of that way under {'; '.join(told)}." if told else ""
        sentences.append(
            f"{contender.name} goes {shown(plain['share'], digits=3)} of the hand's limit undisturbed and loses"
            f" {plain['lost']} of {plain['trials']} objects.{kept}"
        )
    disturbed = found.rows[found.rows.disturb != NONE]
    if len(disturbed):
        count, clock, cpu = disturbed[["trials", "seconds", "cpu_seconds"]].sum()
        took = f"took one core {clock:.0f} s by the clock, {cpu:.0f} s of its own"
        sentences.append(f"{count:,.0f} disturbed trials {took}.")
    return sentences


def _told(row: dict[str, Any]) -> tuple[str, ...]:
    """Return a row under `HEADER`, its name left out."""
    return (
        str(row["trials"]),
        str(row["lost"]),
        _percent(row).removesuffix(" %"),
        shown(row["share"], digits=3),
        _ends(row, "share"),
        shown(row["least"], digits=2) + (f" ({row['least_direction']})" if row["least_direction"] else ""),
        shown(row["retention"], digits=3),
        _ends(row, "retention"),
        _pair(row["lateral_median_mm"], row["lateral_95_mm"], 1),
        _pair(row["turn_median_deg"], row["turn_95_deg"], 1),
        _pair(row["penetration_mean_mm"], row["penetration_max_mm"], 2),
        shown(100 * row["penetration_share"]),
        shown(row["force_max_n"]),
        shown(row["torque_max_nmm"], digits=0),
    )


def _kept(row: dict[str, Any] | None) -> str:
    return NOTHING if row is None else f"{shown(row['retention'], digits=2)}, {row['lost']}/{row['trials']}"


def _percent(row: dict[str, Any]) -> str:
    return f"{100 * row['lost_low']:.1f} to {100 * row['lost_high']:.1f} %"


def _ends(row: dict[str, Any], name: str) -> str:
    low, high = row[f"{name}_low"], row[f"{name}_high"]
    return NOTHING if pd.isna(low) else f"{low:.3f} to {high:.3f}"


def _pair(first: float, second: float, digits: int) -> str:
    return f"{shown(first, digits=digits)}, {shown(second, digits=digits)}"


def _range(row: dict[Any, Any], name: str, scale: float, digits: int) -> str:
    mean, low, high = (scale * row[f"{name}_{each}"] for each in ("mean", "min", "max"))
    return f"{mean:.{digits}f}, {low:.{digits}f} to {high:.{digits}f}"
