"""The table, the picture and the page of a comparison."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from compare_config import CompareConfig
from compare_figure import Bar, compare_figure
from compare_stats import Adaptation, Interval, Score, adaptations, scores
from compare_study import ENOUGH, contestants, horizon_of, training_of
from inhand.control.trial import write_json
from inhand.pages import again, options, page_of, table_of
from inhand.plots.save import save_figure
from inhand.sim.disturbance_files import NONE, disturbance_name
from inhand.versions import versions

HEADER = (
    "controller",
    "task",
    "disturbed by",
    "trained on it",
    "completion [%]",
    "all done [%]",
    "RMS error [mm]",
    "lost",
)
"""Columns of the table."""
EXPLAINED = (
    "`expert`: the expert `ik`, sequenced. `structured`: one policy trained on the 8 directions and on turns on real"
    " senses, sequenced. `structured-privileged`: on perfect knowledge and the directions alone; its twists are the"
    " expert's. `guided-sensed`, `guided`: trained end to end on one task; see what the policy on senses and the"
    " privileged one see, their aim moved along the task's path at every decision. `unguided`: trained end to end on"
    " one task; sees how far it has come and where the task ends, not its path."
)
"""What the controllers' names mean."""


def write_compare(config: CompareConfig, found: Sequence[dict[str, Any]], few: Sequence[dict[str, Any]]) -> list[Score]:
    """Write `compare.json`, the figure and `report.md` of a study to its folder; return the scores."""
    every, adapting = scores(found), adaptations(few, config.seeds)
    subtitle = f"{len(config.seeds)} seeds, {config.episodes} episodes each; {config.object} with {config.hand}"
    for level in map(disturbance_name, config.disturb):
        how = "undisturbed" if level == NONE else f"disturbed by {level}"
        title = f"Primitives in sequence against training end to end, {how}"
        figure = compare_figure(*_bars([score for score in every if score.disturb == level]), title, subtitle)
        save_figure(figure, config.out / f"compare_{level}.png")
    content = {
        "scores": [asdict(score) for score in every],
        "adaptation": [asdict(each) for each in adapting],
        "budgets": budgets(config),
        "config": asdict(config),
        "versions": versions(),
    }
    write_json(content, config.out / "compare.json")
    (config.out / "report.md").write_text(_page(config, every, adapting), encoding="utf-8")
    return every


def table_rows(every: Sequence[Score]) -> list[tuple[str, ...]]:
    """Return the rows under `HEADER`."""
    return [
        (
            score.name,
            score.task,
            score.disturb,
            "yes" if score.trained else "no",
            _with_interval(score.completion, 100.0, 0),
            _with_interval(score.done, 100.0, 0),
            _with_interval(score.error, 1.0, 2),
            f"{score.dropped} of {score.episodes}",
        )
        for score in every
    ]


def budgets(config: CompareConfig) -> dict[str, dict[str, int]]:
    """Return the environment steps of every training: demonstrated, relabelled by the expert, and of the agent."""
    found = {}
    for who in contestants(config):
        if who.kind != "expert" and who.name not in found:
            made = training_of(config, who)
            horizon = made.interface.horizon
            parts = (made.recipe.episodes, made.rounds * made.relabelled, made.episodes)
            found[who.name] = dict(
                zip(("demonstrated", "relabelled", "agent"), (horizon * n for n in parts), strict=True)
            )
    return found


def adaptation_rows(adapting: Sequence[Adaptation], every: Sequence[Score]) -> list[tuple[str, ...]]:
    """Return what each way of training needs to complete a task that is new to it."""
    rows: list[tuple[str, ...]] = [
        (score.name, score.task, "0" if score.completion.mean >= ENOUGH else f"not with {100 * ENOUGH:.0f} %")
        for score in every
        if score.name == "structured" and score.disturb == every[0].disturb
    ]
    for each in adapting:
        steps = [f"{count:,}" if count is not None else f"more than {each.most:,}" for count in each.steps]
        rows.append((each.name, each.task, ", ".join(steps)))
    return rows


def _bars(every: Sequence[Score]) -> tuple[list[str], list[str], dict[tuple[str, str], Bar]]:
    """Return the figure's controllers, tasks and bars."""
    bars = {
        (s.name, s.task): Bar(s.completion.mean, s.completion.low, s.completion.high, s.dropped / s.episodes, s.trained)
        for s in every
    }
    return list(dict.fromkeys(s.name for s in every)), list(dict.fromkeys(s.task for s in every)), bars


def _page(config: CompareConfig, every: Sequence[Score], adapting: Sequence[Adaptation]) -> str:
    steps = [(name, *(f"{count:,}" for count in parts.values())) for name, parts in budgets(config).items()]
    horizons = ", ".join(f"{task} {horizon_of(config, task)}" for task in config.tasks)
    return page_of(
        "# Primitives in sequence against training end to end",
        EXPLAINED,
        f"{len(config.seeds)} seeds of every training, {config.episodes} episodes of every controller on every task;"
        f" {config.object} with {config.hand}. Intervals are 95 %, by bootstrap over seeds and episodes.",
        table_of(HEADER, table_rows(every)),
        *(
            f"![Completion of every task, disturbed by {level}](compare_{level}.png)"
            for level in map(disturbance_name, config.disturb)
        ),
        table_of(
            ("controller", "demonstrated", "relabelled", "of the agent"), steps, "Environment steps of each training"
        ),
        f"An episode takes at most so many decisions: primitives 180 on senses and 200 else, {horizons}.",
        f"## Environment steps to complete {100 * ENOUGH:.0f} % of a new task",
        "Structured: none where its completion is enough as it is. End to end: the smallest of"
        f" {', '.join(map(str, config.adaptation))} demonstrations that were enough to imitate, for each seed.",
        table_of(("controller", "task", "steps"), adaptation_rows(adapting, every)),
        again(shlex.join(["python", "studies/compare.py", *options(config)])),
    )


def _with_interval(value: Interval, unit: float, digits: int) -> str:
    if not np.isfinite(value.mean):
        return "-"
    mean, low, high = (unit * number for number in (value.mean, value.low, value.high))
    return f"{mean:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"
