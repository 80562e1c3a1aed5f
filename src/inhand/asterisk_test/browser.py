"""The page of a run for a browser: asterisks, replays, tables, what was asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.report import Run, by_twist, direction_curves, parts, title_of
from inhand.asterisk_test.results import Result, by_direction, mean_fraction, result_of_human
from inhand.asterisk_test.scenes import human_curves, mean_distance
from inhand.control.replays import Shown, player_of
from inhand.control.scenes import start_scene
from inhand.control.trial import Trial
from inhand.pages import counted, spread
from inhand.plots.curves import PathCurve
from inhand.plots.page.document import html_of, settings_of
from inhand.plots.page.views import Panel, Star, View, panels_of

KIND = "A run of the Asterisk Test"
HINT = "Point at a direction for its numbers; click to replay it below."
EXPLAINED = (
    "Mean object paths and mean distances at the first loss of contact, or at the end [mm]. Thin outline: how far the"
    " hand could carry the object, whatever controls it. Bands: SD of the lateral part."
)
REPLAYED = (
    "Drawn from what was recorded, every 0.02 s. Filled dots touch; where manipulation begins the time is 0. Space or k"
    " plays, comma and full stop go a step."
)


def run_page(run: Run) -> str:
    """Return the page of a run."""
    title, intro, *rest = parts(run, [])
    *told, last = rest
    return html_of(KIND, [title, intro, *views(run), "## Results", *told, last, settings_of(run.config)])


def views(run: Run) -> list[View]:
    """Return what of a run is drawn: asterisks, apart by the twist that they hold, and a player of its trials."""
    found, own = [], None
    for part in by_twist(run):
        stars = stars_of(part)
        found.append(View("asterisks", panels_of(stars, HINT), f"Asterisk: {title_of(part)}", EXPLAINED))
        own = own or stars[-1]
    return [*found, replays(run, None if own is None else picker_of(own))]


def replays(run: Run, picker: Panel | None) -> View:
    """Return the player of a run and of those beside it."""
    groups = [(run.name, run.trials, run.results), *((each.name, each.trials, each.results) for each in run.beside)]
    shown = [
        Shown(trial, name, told_of(result))
        for name, trials, results in groups
        for trial, result in zip(trials, results, strict=True)
    ]
    return View("player", player_of(shown, picker=picker), "Replay", REPLAYED)


def picker_of(star: Star) -> Panel:
    """Return an asterisk that only serves to pick a direction."""
    (panel,) = panels_of([star], "").panels
    return replace(panel, plain=True)


def stars_of(run: Run) -> list[Star]:
    """Return the asterisks of people, of the runs beside a run, and of the run itself."""
    curves = direction_curves(run)
    stars = [_star(run.name, f"{run.config.paths} paths", curves, run.results, run.trials)]
    for other in reversed(run.beside):
        stars.insert(0, _beside(other))
    if run.people:
        stars.insert(0, _people(run.people, [curve.name for curve in curves]))
    return stars


def _beside(other: Beside) -> Star:
    return _star(other.name, other.told, direction_curves(other), other.results, other.trials)


def _star(
    name: str, subtitle: str, curves: Sequence[PathCurve], results: Sequence[Result], trials: Sequence[Trial]
) -> Star:
    groups = by_direction(results)
    told = [_told_of_all(groups[curve.name]) for curve in curves]
    return Star(name, subtitle, curves, told, start_scene(trials[0]))


def _people(people: Sequence[HumanTrial], names: Sequence[str]) -> Star:
    groups = by_direction([result_of_human(trial) for trial in people])
    curves = human_curves(people, names)
    return Star(
        "Human", counted(len(people), "recorded trial"), curves, [_told_of_all(groups[curve.name]) for curve in curves]
    )


def _told_of_all(group: Sequence[Result]) -> list[str]:
    """Return a direction's trials in a few lines."""
    reached = [result.metrics.distance_mm for result in group]
    limit, share = group[0].limit, mean_fraction(group)
    of = "" if limit is None or share is None else f", {share:.2f} of the limit {limit:.1f} mm"
    outcomes = [result.outcome for result in group]
    several = len(set(outcomes)) > 1
    ends = ", ".join(f"{outcomes.count(each)} {each}" if several else each for each in dict.fromkeys(outcomes))
    sd = float(np.std(reached, ddof=1)) if len(reached) > 1 else np.nan
    return [f"{spread(mean_distance(group), sd)} mm{of}", f"{counted(len(group), 'trial')}: {ends}"]


def told_of(result: Result) -> str:
    """Return how a trial ended, in a few words."""
    unit = "deg" if result.angle_deg is None else "mm"
    of = "" if result.limit is None else f" of {result.limit:.1f}"
    who = f", {result.first_lost} let go first" if result.lost and result.first_lost else ""
    return f"{result.outcome}, {result.reached:.1f}{of} {unit}{who}"
