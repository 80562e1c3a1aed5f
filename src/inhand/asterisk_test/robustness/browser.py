"""The page of a study of robustness for a browser: what is kept, curves, what goes with a loss, objects lost."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from inhand.asterisk_test.browser import lost_replays
from inhand.asterisk_test.cells import kept_lost
from inhand.asterisk_test.robustness import figures
from inhand.asterisk_test.robustness.cases import CASES, curves_of
from inhand.asterisk_test.robustness.config import RobustnessConfig
from inhand.asterisk_test.robustness.summary import Robustness
from inhand.pages import Part
from inhand.plots.intervals import Panel
from inhand.plots.page.charts import Axis, Chart, Charts, Heats, Intervals, Line, heat_of, listing_of, numbers
from inhand.plots.page.document import html_of, settings_of
from inhand.plots.page.views import View


def robustness_page(
    parts: Sequence[Part], config: RobustnessConfig, found: Robustness, told: Mapping[str, pd.DataFrame]
) -> str:
    """Return the page of a study, with what goes with losses by disturbance; its parts are those without figures."""
    title, intro, answer, *rest = parts
    heat = heat_of(figures.kept_map(found), "Share of the undisturbed way that is kept", "An object lost went no way.")
    views = [
        View("heat", Heats((heat,)), "What controllers keep"),
        *_curves(config, found),
        *_sensitivities(told, found),
    ]
    pairs = [(each.name, case.name) for each in found.contenders for case in found.cases if case.row]
    lost = [(f"{name} under {case}", kept_lost(config.out / CASES, name, case)) for name, case in pairs]
    return html_of(
        "A study of robustness",
        [title, intro, answer, *views, *lost_replays(lost), *rest, settings_of(config)],
    )


def _curves(config: RobustnessConfig, found: Robustness) -> list[View]:
    """Return what is kept and lost against the strength of each disturbance that has a curve."""
    views = []
    for curve in curves_of(config):
        at, panels = figures.strengths(config, found, curve)
        axis = Axis(f"strength (1: {curve})", digits=2)
        charts = tuple(_chart(panel, at, axis) for panel in panels)
        views.append(View("charts", Charts(charts, "wider"), f"Against the strength of {curve}", "Bands: 95 %."))
    return views


def _chart(panel: Panel, at: np.ndarray, axis: Axis) -> Chart:
    lines = tuple(
        Line(each.name, numbers(at), numbers(each.middle), k, numbers(each.low), numbers(each.high), dots=True)
        for k, each in enumerate(panel.series)
    )
    return Chart(panel.label, axis, Axis("", 0.0, panel.top), lines)


def _sensitivities(told: Mapping[str, pd.DataFrame], found: Robustness) -> list[View]:
    """Return which quantities go with losing the object under each disturbance."""
    views = []
    for disturb, table in told.items():
        names, estimates = figures.sensitivity_panels(table, found, disturb)
        shown = Intervals(tuple(listing_of(names, each) for each in estimates), -1.0, 1.0)
        text = "Rank correlation with losing the object, 95 % intervals by bootstrap; filled: clear of 0."
        views.append(View("intervals", shown, f"What goes with a loss under {disturb}", text))
    return views
