"""The folder of a sweep: `sweep.json`, `trials.csv`, the heat maps and the Markdown page."""

from collections.abc import Sequence
from dataclasses import asdict
from math import isfinite, nan
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from inhand.asterisk_test.regrasped import TITLE
from inhand.asterisk_test.study import command, place_told, write_texts
from inhand.asterisk_test.sweep import tables
from inhand.asterisk_test.sweep.browser import sweep_page
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.asterisk_test.sweep.summary import Sweep, compared
from inhand.asterisk_test.sweep.sweep import CELLS
from inhand.control.trial import write_json
from inhand.pages import Part, again, counted, listed, page_of
from inhand.plots.heatmap import HeatMap, heatmap_figure
from inhand.plots.save import save_picture
from inhand.shown import HTML
from inhand.versions import versions

OVER = {"object": "directions", "direction": "objects"}
"""What the columns of a heat map are, and what its numbers are means over."""
KINDS = {
    "distance": "How far the hand carried the object",
    "limit": "How far the hand could carry it, whatever controls it",
    "share": "Skill of the controller: the share of the limit that it reaches",
}
"""What a heat map shows: a column of `compared`."""
ANEW = "regrasped"
"""The share of the limit with fingers placed anew, which has heat maps of its own."""
FOUND = (tables.hands_table, tables.best_by_direction, tables.best_by_object, tables.best_of_each)
"""The tables that say which hand is best."""


def write_sweep(config: SweepConfig, sweep: Sweep, wall_s: float, notes: Sequence[str] = ()) -> None:
    """Write numbers, heat maps and page of a sweep, which took `wall_s` [s], into its folder, with notes on it."""
    pictures = heat_maps(config, sweep)
    content = {
        "median_share": sweep.cases.share.median(),
        "kept_share": sweep.cases.kept.mean(),
        "wall_s": wall_s,
        "notes": notes,
        **{name: getattr(sweep, name) for name in ("hands", "objects", "directions")},
        **{name: getattr(sweep, name).to_dict("records") for name in ("cells", "cases")},
        "failures": tables.failures(sweep),
        "config": asdict(config),
        "versions": versions(),
    }
    write_json(content, config.out / "sweep.json")
    told = page_of(*parts(config, sweep, wall_s, pictures, notes))
    pages = {"report.md": told, HTML: page_for_browser(config, sweep, wall_s, notes)}
    write_texts({"trials.csv": sweep.trials.to_csv(index=False)} | pages, config.out)


def heat_maps(config: SweepConfig, sweep: Sweep) -> list[Part]:
    """Draw the heat maps of a sweep into `figures` of its folder, and return them as parts of the page."""
    pictures: list[Part] = []
    for kind, text in kinds_of(sweep).items():
        for column, over in OVER.items():
            figure, told = figure_of(config, sweep, kind, column), f"{text}: hands and {column}s, means over the {over}"
            pictures.append(save_picture(figure, config.out, f"{column}s_{kind}.png", told))
    return pictures


def kinds_of(sweep: Sweep) -> dict[str, str]:
    """Return what the heat maps of a sweep show."""
    return KINDS | ({} if sweep.anew is None else {ANEW: f"{KINDS['share']}, {TITLE[:1].lower()}{TITLE[1:]}"})


def figure_of(config: SweepConfig, sweep: Sweep, kind: str, column: str) -> Figure:
    """Return the heat map of hands and one of `KINDS` in the columns object or direction."""
    scale = "Share of the limit" if kind in {"share", ANEW} else f"{kind.capitalize()} [{sweep.unit}]"
    return heatmap_figure(
        map_of(sweep, kind, column), scale, kinds_of(sweep)[kind], told_of(config, sweep, kind, column)
    )


def map_of(sweep: Sweep, kind: str, column: str) -> HeatMap:
    """Return the numbers of the heat map of hands and one of `KINDS` in the columns object or direction.

    Of the directions it has those whose distances have a common unit.
    """
    anew = sweep.anew if kind == ANEW else None
    if anew is not None:
        sweep, kind = anew, "share"
    names = sweep.objects if column == "object" else sweep.directions if kind == "share" else sweep.alike
    grid = pd.MultiIndex.from_product([sweep.hands, names])
    found = compared(sweep, ["hand", column]).reindex(grid)
    shape = len(sweep.hands), len(names)
    notes = np.array([_note(row, kind) for row in found.to_dict("records")], dtype=object)
    if column == "object":
        ran = sweep.cells.set_index(["hand", "object"]).reason.reindex(grid).isna().to_numpy()
        notes = np.where(ran, notes, "cannot run")
    farthest = float(np.fmax(found.distance.max(), found.limit.max()))
    top = farthest if farthest > 0.0 and kind != "share" else float(np.fmax(found.share.max(), 1.0)) if anew else 1.0
    return HeatMap(sweep.hands, names, found[kind].to_numpy().reshape(shape), notes.reshape(shape).tolist(), top)


def told_of(config: SweepConfig, sweep: Sweep, kind: str, column: str) -> str:
    """Return what a reader must know of a heat map."""
    told = [f"mean over the {OVER[column]}"]
    if kind != "limit":
        told = [config.controller, f"{told[0]}, {_trials(config)}", *["± SD over the trials"] * (config.trials > 1)]
    told += ["L: finger length"] * (kind not in {"share", ANEW} and sweep.unit == "mm")
    return "; ".join(told)


def page_for_browser(config: SweepConfig, sweep: Sweep, wall_s: float, notes: Sequence[str] = ()) -> str:
    """Return the page for a browser."""
    maps = [
        (map_of(sweep, kind, column), f"{text}, by {column}", told_of(config, sweep, kind, column))
        for kind, text in kinds_of(sweep).items()
        for column in OVER
    ]
    return sweep_page(parts(config, sweep, wall_s, [], notes), maps, sweep, config, config.out / CELLS)


def parts(
    config: SweepConfig, sweep: Sweep, wall_s: float, pictures: Sequence[Part], notes: Sequence[str] = ()
) -> list[Part]:
    """Return the parts of the page: what was asked, the answer, heat maps, tables, failures, how to run it again."""
    return [
        f"# Sweep: {counted(len(sweep.hands), 'hand')} x {counted(len(sweep.objects), 'object')} x"
        f" {counted(len(sweep.directions), 'direction')}",
        f"Controller {config.controller}, {_trials(config)}, start noise"
        f" {config.noise_mm:g} mm and {config.noise_deg:g} deg (standard deviations), seed {config.seed},"
        f" {place_told(config.hands[0], config.engine, config.gravity)}."
        + (" Fingers may be placed anew, once or twice; what that reaches is told apart." if config.regrasp else ""),
        listed([*tables.summary(sweep), *notes, f"This call took {wall_s / 60:.1f} minutes."]),
        "The limit and the distance say which hand is best. The limit is how far the hand itself could carry the"
        " object by geometry and friction, whatever controls it; the distance is the progress along the direction up"
        " to the first loss of contact. [L] is in finger lengths, so that small hands compare with large ones. `Skill`"
        " is the distance's share of the limit and tells of the controller, not of the hand. In means of"
        " distances and limits what could not be run counts as 0; in means of shares it does not count."
        + (" Values after ± are SDs of such a mean over the trials." if config.trials > 1 else ""),
        *pictures,
        *(make(sweep) for make in FOUND),
        *tables.anew_tables(sweep),
        listed(tables.failures(sweep), "What failed", "Every case kept the object to its end."),
        listed(tables.poor(sweep), "Kept, but below half of the limit", "None."),
        listed(tables.beyond(sweep), "Beyond the limit", "None."),
        tables.cells_table(sweep),
        again(command("sweep", config)),
    ]


def _trials(config: SweepConfig) -> str:
    if config.trials == 1:
        return "n = 1 trial for each direction, so no spread is known"
    return f"n = {config.trials} trials for each direction"


def _note(row: dict[Any, float], kind: str) -> str:
    """Return what stands below the number of a cell: its spread, its size in finger lengths, how many cases failed."""
    sd = {"distance": row["sd"], "share": row["share_sd"]}.get(kind, nan)
    size, failed = row.get(f"{kind}_size", nan), row["cases"] - row["kept"]
    lines = [f"± {sd:.{2 if kind == 'share' else 1}f}"] if isfinite(sd) else []
    lines += [f"{size:.2f} L"] if isfinite(size) else []
    lines += [f"{failed:.0f} failed"] if failed > 0 and kind != "limit" else []
    return "\n".join(lines)
