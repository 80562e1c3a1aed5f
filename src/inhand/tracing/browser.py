"""The page of a trace for a browser: every trial replayed over its plan, errors along the way, tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from inhand.control.replays import Shown, replays
from inhand.control.spatial_replays import solid_replays
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import Trial
from inhand.pages import Part
from inhand.plots.page.charts import Axis, Chart, Charts, Line, line
from inhand.plots.page.document import html_of, settings_of
from inhand.plots.page.views import View, flat
from inhand.sim.walls import Wall
from inhand.tracing.config import TraceConfig
from inhand.tracing.figures import MOST_COLOURS, plan_line, wall_mm
from inhand.tracing.follow import Followed
from inhand.tracing.trace import Trace, deviations, poses_along, turned_deg

KIND = "A trace"
NOWHERE = np.zeros(3)
"""The origin of the palm frame."""


def trace_page(
    parts: Sequence[Part], config: TraceConfig, found: Sequence[tuple[Followed, Trace]], wall: Wall | None
) -> str:
    """Return the page of a run.

    Args:
        parts: of its page, the figures left out.
        config: of the run.
        found: its trials, and what they reached.
        wall: what stands still, if anything does.
    """
    title, intro, *told = parts
    views = views_of([(config.controller, found)], wall)
    return html_of(KIND, [title, intro, *views, "## Results", *told, settings_of(config)])


Group: TypeAlias = tuple[str, Sequence[tuple[Followed, Trace]]]
"""The name of a run, and its trials with what they reached."""


def views_of(groups: Sequence[Group], wall: Wall | None) -> list[View]:
    """Return what of runs is drawn: a player of all trials, and errors along the way."""
    return [*_replays(groups, wall), _errors(groups)]


def _replays(groups: Sequence[Group], wall: Wall | None) -> list[View]:
    found = [(name, followed, trace) for name, pairs in groups for followed, trace in pairs]
    solid = [
        Shown(each.trial, name, _told(trace)) for name, each, trace in found if isinstance(each.trial, SpatialTrial)
    ]
    flats = [
        Shown(
            each.trial,
            name,
            _told(trace),
            f"{each.plan.name}, trial {trace.trial}",
            plan_line(each.plan, NOWHERE),
        )
        for name, each, trace in found
        if isinstance(each.trial, Trial)
    ]
    walls = [] if wall is None else [flat(wall_mm(wall, NOWHERE[:2]))]
    return [*replays(flats, walls=walls), *solid_replays(solid)]


def _told(trace: Trace) -> str:
    """Return how a trial ended, in a few words."""
    rms = f", RMS {trace.rms_mm:.2f} mm off" if np.isfinite(trace.rms_mm) else ""
    return f"{trace.outcome}, {100 * trace.completion:.1f} % of the way{rms}, in {trace.time_s:.1f} s"


def _errors(groups: Sequence[Group]) -> View:
    """Return how far trials were from their plans along the way, and how far they were turned over time."""
    found = [(f"{run}, " * (len(groups) > 1), *pair) for run, trials in groups for pair in trials]
    few = len(found) <= MOST_COLOURS
    off, turned = [], []
    for number, (run, followed, trace) in enumerate(found):
        rows, name, series = deviations(followed), f"{run}trial {trace.trial}", number if few else min(number, 1)
        faint = not few and number > 0
        off.append(line(name, 1e3 * rows.way, 1e3 * rows.off, series, faint=faint))
        turned.append(_turned(followed, name, series, faint=faint))
    way = Chart("Distance from the plan", Axis("way along the plan [mm]", 0.0), Axis("[mm]", 0.0), tuple(off))
    turn = Chart("Rotation of the object", Axis("time [s]", digits=2), Axis("[deg]"), tuple(turned))
    return View("charts", Charts((way, turn), "wider"), "Along the way")


def _turned(followed: Followed, name: str, series: int, *, faint: bool) -> Line:
    theta = turned_deg(poses_along(followed))
    time = followed.trial.passport.period * np.arange(1.0, len(theta) + 1.0)
    return line(name, time, theta, series, faint=faint)
