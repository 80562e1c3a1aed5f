"""The pages of learning for a browser: the curves of a training, and a policy beside the expert."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inhand.geometry import Array
from inhand.learning.figures import WIDE, Curve, colour_of, curves_of, shown_range, smoothed, thinned
from inhand.learning.progress import Evaluated, Learned
from inhand.pages import Part
from inhand.plots.page.charts import Axis, Chart, Charts, Level, Line, line, numbers
from inhand.plots.page.document import Settings, html_of, settings_of
from inhand.plots.page.views import View


def training_page(parts: Sequence[Part], found: Learned, config: Settings) -> str:
    """Return the page of a training."""
    title, intro, *told = parts
    return html_of("A training", [title, intro, *training_views(found), "## The best policy", *told, config])


def evaluation_page(parts: Sequence[Part], drawn: Sequence[View], learned: Learned | None, config: object) -> str:
    """Return the page of an evaluation.

    Args:
        parts: of its page, the figures left out.
        drawn: what is drawn of its trials.
        learned: the record of the policy's training where it is there.
        config: of the evaluation.
    """
    title, intro, *told = parts
    curves = [] if learned is None else training_views(learned)
    return html_of(
        "An evaluation", [title, intro, *drawn, "## Results", *told[:-1], *curves, told[-1], settings_of(config)]
    )


def training_views(found: Learned, whose: str = "") -> list[View]:
    """Return the curves of a training: what evaluations reached, by direction too, rewards and losses.

    What tells `whose` they are follows their titles.
    """
    told = "Dashed: the expert from the same starts, or the hand's limit."
    return [
        View("charts", Charts(tuple(_progress(found))), f"What evaluations reached{whose}", told),
        View("charts", Charts(tuple(map(_curve, curves_of(found))), "wider"), f"Rewards and losses{whose}"),
        View("charts", Charts(tuple(_directions(found)), "small"), f"Share of the hand's limit, by direction{whose}"),
    ]


def _progress(found: Learned) -> list[Chart]:
    """Return what groups of directions reached in each evaluation."""
    at = np.array([each.episode for each in found.evaluations], dtype=float)
    axis = Axis("episode", 0.0, digits=0)
    known = [
        (number, group.title, _reached(found.evaluations, group.names)) for number, group in enumerate(found.groups)
    ]
    lines = [
        tuple(Line(name, numbers(at), numbers(reached[k]), number, dots=True) for number, name, reached in known)
        for k in range(3)
    ]
    levels = [
        tuple(Level(float(reached[k][-1]), number) for number, _, reached in known if np.isfinite(reached[k][-1]))
        for k in (3, 4)
    ]
    return [
        Chart("Return", axis, Axis("mean sum of rewards", 0.0), lines[0], levels[0]),
        Chart("Distance", axis, Axis("share of the limit", 0.0, 1.05), lines[1], (*levels[1], Level(1.0))),
        Chart("Lost objects", axis, Axis("trials lost [%]", 0.0, 10.0), lines[2], digits=1),
    ]


def _reached(evaluations: Sequence[Evaluated], names: Sequence[str]) -> Array:
    """Return return, share, losses [%], the expert's return and share of some directions `(5, N)`."""
    over = [each.over(names) for each in evaluations]
    rows = [(o.total, o.fraction, 100.0 * o.dropped / o.trials, o.expert_total, o.expert_fraction) for o in over]
    return np.array(rows, dtype=float).T


def _curve(curve: Curve) -> Chart:
    """Return a quantity as recorded, faintly, and smoothed; outliers lie outside."""
    finite = np.isfinite(curve.numbers)
    at, values = curve.episodes[finite], curve.numbers[finite]
    axis = Axis("episode", 0.0, curve.end, digits=0)
    if not len(values):
        return Chart(curve.title, axis, Axis(curve.unit), ())
    places, means = thinned(at, values)
    smooth = smoothed(means)
    log = curve.wide and values.min() > 0 and values.max() > WIDE * values.min()
    low, high = shown_range(values, smooth)
    inside = np.where(log | ((values >= low) & (values <= high)), values, np.nan)
    raw = line("as recorded", at, inside, faint=True)
    ends = Axis(curve.unit, log=log) if log else Axis(curve.unit, low, high, 0.0)
    return Chart(curve.title, axis, ends, (raw, line("smoothed", places, smooth)), digits=3)


def _directions(found: Learned) -> list[Chart]:
    """Return the share of the limit over the episodes, one small chart for each direction."""
    at = numbers(each.episode for each in found.evaluations)
    charts = []
    for name in found.names:
        reached = [each.directions[name] for each in found.evaluations]
        shares = numbers(each.fraction for each in reached)
        drawn = Line("share of the limit", at, shares, dots=True, colour=colour_of(name))
        expert = reached[-1].expert_fraction
        levels = (Level(1.0), *([Level(expert, 0)] if np.isfinite(expert) else []))
        axis = Axis("episode", 0.0, digits=0)
        charts.append(Chart(name, axis, Axis("", 0.0, 1.1), (drawn,), levels, height=150))
    return charts
