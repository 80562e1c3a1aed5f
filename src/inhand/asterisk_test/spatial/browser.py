"""The page of a run in space for a browser: distances, a replay that turns under the pointer, tables."""

from collections.abc import Sequence

from inhand.asterisk_test.browser import told_of
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.results import Result
from inhand.control.replays import Shown
from inhand.control.spatial_replays import solid_replays
from inhand.control.spatial_trial import SpatialTrial
from inhand.pages import Part
from inhand.plots.page.document import html_of, settings_of
from inhand.plots.page.solids import Bars, Way, Ways
from inhand.plots.page.views import View
from inhand.plots.spatial_asterisk import SpatialCurve, Turned

KIND = "A run of the Asterisk Test in space"
TURNS = "var(--series-1)"
"""Colour of angles."""


def spatial_page(
    parts: Sequence[Part],
    found: tuple[Sequence[SpatialTrial], Sequence[Result]],
    drawn: tuple[Sequence[SpatialCurve], Sequence[Turned]],
    config: AsteriskConfig,
) -> str:
    """Return the page of a run.

    Args:
        parts: of its page, the figures left out.
        found: its trials and their results.
        drawn: mean paths of its directions, and mean angles of its turns.
        config: of the run.
    """
    title, intro, *told = parts
    shown = [Shown(trial, trial.passport.controller, told_of(result)) for trial, result in zip(*found, strict=True)]
    views = [*_distances(*drawn), *solid_replays(shown)]
    return html_of(
        "A run of the Asterisk Test in space", [title, intro, *views, "## Results", *told, settings_of(config)]
    )


def _distances(curves: Sequence[SpatialCurve], turns: Sequence[Turned]) -> list[View]:
    lists = [
        Ways("Distance [mm]", tuple(Way(each.name, each.distance_mm, each.limit_mm) for each in curves)),
        Ways("Angle [deg]", tuple(Way(each.name, each.mean_deg, each.limit_deg, TURNS) for each in turns)),
    ]
    there = tuple(each for each in lists if each.curves)
    told = "Means up to the first loss of contact, of the hand's limit where it is known; click one to replay it below."
    return [View("bars", Bars(there), "Distances", told)] if there else []
