"""The folder of a sweep: `sweep.json`, the heat maps and the Markdown page."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from inhand.asterisk_test.sweep import tables
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.asterisk_test.sweep.summary import Case, Sweep, kept_share, mean_fraction, median_fraction
from inhand.control.trial import write_json
from inhand.geometry import Array
from inhand.plots.heatmap import HeatMap, heatmap_figure
from inhand.plots.save import save_figure
from inhand.versions import versions

PICTURES = {
    "objects.png": "Hands and objects: mean fraction of the limit over the directions",
    "directions.png": "Hands and directions: mean fraction of the limit over the objects",
}
"""Figures of a sweep with what they show."""


def write_sweep(config: SweepConfig, sweep: Sweep, wall_s: float) -> None:
    """Write numbers, heat maps and page of a sweep into its folder.

    Args:
        config: what was asked for.
        sweep: what was found.
        wall_s: how long this call took [s].
    """
    figures = config.out / "figures"
    for name, heat in zip(PICTURES, heat_maps(sweep), strict=True):
        subtitle = f"{config.controller}, {_trials(config)}; lost: not kept to the end"
        save_figure(heatmap_figure(heat, "Fraction of the limit", PICTURES[name], subtitle), figures / name)
    write_json(_content(config, sweep, wall_s), config.out / "sweep.json")
    part = config.out / "report.md.part"
    part.write_text(page(config, sweep, wall_s), encoding="utf-8")
    part.replace(config.out / "report.md")


def heat_maps(sweep: Sweep) -> tuple[HeatMap, HeatMap]:
    """Return the heat maps of hands and objects and of hands and directions."""
    stopped = {(cell.hand, cell.object) for cell in sweep.cells if cell.reason}
    objects = [
        [[case for case in sweep.cases if (case.hand, case.object) == (hand, thing)] for thing in sweep.objects]
        for hand in sweep.hands
    ]
    directions = [
        [[case for case in sweep.cases if (case.hand, case.direction) == (hand, way)] for way in sweep.directions]
        for hand in sweep.hands
    ]
    notes = [
        [
            "cannot run" if (hand, thing) in stopped else _lost(cases)
            for thing, cases in zip(sweep.objects, row, strict=True)
        ]
        for hand, row in zip(sweep.hands, objects, strict=True)
    ]
    rows = tuple(f"{hand}  {number}" for number, hand in enumerate(sweep.hands, start=1))
    return (
        HeatMap(rows, sweep.objects, _fractions(objects), notes),
        HeatMap(
            rows, sweep.directions, _fractions(directions), [[_lost(cases) for cases in row] for row in directions]
        ),
    )


def page(config: SweepConfig, sweep: Sweep, wall_s: float) -> str:
    """Return the page: what was asked, the answer in sentences, heat maps, tables, failures, how to run it again."""
    lines = [
        f"# Sweep: {len(sweep.hands)} hands x {len(sweep.objects)} objects x {len(sweep.directions)} directions",
        "",
        f"Controller {config.controller}, {_trials(config)}, start noise"
        f" {config.noise_mm:g} mm and {config.noise_deg:g} deg (standard deviations), seed {config.seed}.",
        "",
        *[f"* {sentence}" for sentence in tables.summary(sweep)],
        f"* This call took {wall_s / 60:.1f} minutes.",
        "",
        "Distance is the progress along the direction up to the first loss of contact; the limit is how far the hand"
        " itself could carry the object that way by geometry and friction. In means of distances, what could not be run"
        " counts as 0 mm; in means of fractions it does not count.",
        "",
    ]
    for name, text in PICTURES.items():
        lines += [f"![{text}](figures/{name})", "", f"*{text}*", ""]
    found = (tables.hands_table, tables.best_by_direction, tables.best_by_object, tables.best_of_each)
    for table in (make(sweep) for make in found):
        lines += _markdown(table)
    lines += _listed("What failed", tables.failures(sweep), "Every case kept the object to its end.")
    lines += _listed("Kept, but below half of the limit", tables.poor(sweep), "None.")
    lines += _listed("Beyond the limit", tables.beyond(sweep), "None.")
    lines += _markdown(tables.cells_table(sweep))
    found_versions = ", ".join(f"{name} {version}" for name, version in versions().items())
    lines += ["## Run it again", "", f"    {command(config)}", "", f"Versions: {found_versions}.", ""]
    return "\n".join(lines)


def command(config: SweepConfig) -> str:
    """Return the command line that repeats a sweep, quoted for a shell; what is as by default is left out."""
    words = ["inhand", "sweep"]
    plain = SweepConfig()
    for field in fields(config):
        value = getattr(config, field.name)
        if value == getattr(plain, field.name) or field.name == "overwrite":
            continue
        words += ["--" + field.name.replace("_", "-"), *map(str, value if isinstance(value, tuple) else (value,))]
    return shlex.join(words)


def _trials(config: SweepConfig) -> str:
    return f"{config.trials} trial{'' if config.trials == 1 else 's'} for each direction"


def _fractions(grid: Sequence[Sequence[Sequence[Case]]]) -> Array:
    return np.array([[mean_fraction(cases) for cases in row] for row in grid])


def _lost(cases: Sequence[Case]) -> str:
    """Return how many cases lost the object, for a cell of a heat map."""
    count = sum(not case.kept for case in cases)
    return f"{count} lost" if count else ""


def _content(config: SweepConfig, sweep: Sweep, wall_s: float) -> dict[str, Any]:
    return {
        "median_fraction": median_fraction(sweep.cases),
        "kept_share": kept_share(sweep.cases),
        "wall_s": wall_s,
        "hands": sweep.hands,
        "objects": sweep.objects,
        "directions": sweep.directions,
        "cells": [
            asdict(cell) | {"cases": [asdict(case) | {"fraction": case.fraction} for case in cell.cases]}
            for cell in sweep.cells
        ],
        "best": {
            "by_direction": _entries(tables.best_by_direction(sweep)),
            "by_object": _entries(tables.best_by_object(sweep)),
        },
        "failures": tables.failures(sweep),
        "config": asdict(config),
        "versions": versions(),
    }


def _entries(table: tables.Table) -> list[dict[str, str]]:
    return [dict(zip(table.header, row, strict=True)) for row in table.rows]


def _markdown(table: tables.Table) -> list[str]:
    shown = (table.header, tuple("---" for _ in table.header), *table.rows)
    return [f"## {table.title}", "", *["| " + " | ".join(row) + " |" for row in shown], ""]


def _listed(title: str, sentences: Sequence[str], none: str) -> list[str]:
    return [f"## {title}", "", *([f"* {sentence}" for sentence in sentences] or [none]), ""]
