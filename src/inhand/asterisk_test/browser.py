"""The page of a run for a browser: asterisks, replays, tables, what was asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.results import Result, by_direction, mean_fraction, result_of_human, result_of_trial
from inhand.asterisk_test.scenes import direction_curves, human_curves, mean_distance
from inhand.control.replays import Shown, replays
from inhand.control.scenes import start_scene
from inhand.control.spatial_replays import solid_replays
from inhand.control.spatial_trial import SpatialTrial
from inhand.control.trial import NO_GRASP, Trial, load_any
from inhand.pages import Part, counted, spread
from inhand.plots.page.document import html_of, settings_of
from inhand.plots.page.views import Star, View, panels_of

KIND = "A run of the Asterisk Test"
HINT = "Point at a direction for its numbers; click to replay it below."
EXPLAINED = (
    "Mean object paths and mean distances at the first loss of contact, or at the end [mm]. Thin outline: how far the"
    " hand could carry the object, whatever controls it. Bands: SD of the lateral part."
)
LOST_SHOWN = 24
"""Trials of a study that lost their object and that its page replays."""


def run_page(
    parts: Sequence[Part], groups: Sequence[Beside], people: Sequence[HumanTrial], config: AsteriskConfig
) -> str:
    """Return the page of a run.

    Args:
        parts: of its page, the figures left out.
        groups: the trials of runs beside it, and last its own.
        people: human trials to set beside them.
        config: of the run.
    """
    title, intro, *told = parts
    return html_of(KIND, [title, intro, *views(groups, people), "## Results", *told, settings_of(config)])


def views(groups: Sequence[Beside], people: Sequence[HumanTrial] = (), replayed: Sequence[Beside] = ()) -> list[View]:
    """Return what of groups of trials is drawn: asterisks, apart by the twist that they hold, and a player.

    Others may be replayed than those whose means are drawn; the last of these is the first to be shown.
    """
    own = groups[-1].trials
    twists = dict.fromkeys(t.passport.rotation_deg for t in own if t.passport.angle_deg is not None)
    found = []
    for twist in twists:
        told = f", holding {abs(twist):g} deg {'clockwise' if twist < 0 else 'counter-clockwise'}" if twist else ""
        stars = _stars(groups, people, twist)
        found.append(View("asterisks", panels_of(stars, HINT), f"Asterisk{told}", EXPLAINED))
    played = replayed or groups
    picker = _stars(played[-1:], (), next(iter(twists))) if twists else None
    return [*found, *_replays(played, picker or None)]


def _replays(groups: Sequence[Beside], picker: Sequence[Star] | None) -> list[View]:
    """Return the player of groups of trials, with an asterisk to pick directions in."""
    last = [*groups[-1:], *groups[:-1]]  # a run's own first
    shown = [
        Shown(trial, group.name, told_of(result))
        for group in last
        for trial, result in zip(group.trials, group.results, strict=True)
    ]
    chosen = None if picker is None else replace(panels_of(picker, "").panels[0], plain=True)
    return replays(shown, picker=chosen)


def lost_replays(lost: Sequence[tuple[str, Sequence[Path]]]) -> list[View]:
    """Return the player of some trials that lost their object, files of which are named by group; some of each."""
    longest = max((len(files) for _, files in lost), default=0)
    chosen = [(group, files[k]) for k in range(longest) for group, files in lost if k < len(files)][:LOST_SHOWN]
    trials = [(load_any(path), group) for group, path in sorted(chosen)]
    told = [(trial, group, told_of(result_of_trial(trial))) for trial, group in trials]
    solid = [Shown(trial, group, text) for trial, group, text in told if isinstance(trial, SpatialTrial)]
    flat = [Shown(trial, group, text) for trial, group, text in told if isinstance(trial, Trial)]
    return solid_replays(solid) if solid else replays(flat)


def _stars(groups: Sequence[Beside], people: Sequence[HumanTrial], twist: float) -> list[Star]:
    """Return the asterisks of people and of groups of trials, of what translates and holds a twist [deg]."""
    parts = [
        group.only(lambda trial: trial.passport.angle_deg is not None and trial.passport.rotation_deg == twist)
        for group in groups
    ]
    stars = [_star(part) for part in parts if part.trials]
    persons = [human for human in people if human.angle_deg is not None and human.twist_deg == twist]
    if persons:
        stars.insert(0, _people(persons, [curve.name for curve in stars[-1].curves]))
    return stars


def _star(group: Beside) -> Star:
    curves, results = direction_curves(group.trials, group.results), by_direction(group.results)
    told = [told_of_all(results[curve.name]) for curve in curves]
    return Star(group.name, group.told, curves, told, start_scene(group.trials[0]))


def _people(people: Sequence[HumanTrial], names: Sequence[str]) -> Star:
    groups = by_direction([result_of_human(trial) for trial in people])
    curves = human_curves(people, names)
    return Star(
        "Human", counted(len(people), "recorded trial"), curves, [told_of_all(groups[curve.name]) for curve in curves]
    )


def told_of_all(group: Sequence[Result]) -> list[str]:
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
    if result.outcome == NO_GRASP:
        return "no grasp: once the fingers had closed, not all of them held the object"
    unit = "deg" if result.turns else "mm"
    of = "" if result.limit is None else f" of {result.limit:.1f}"
    who = f", {result.first_lost} let go first" if result.lost and result.first_lost else ""
    return f"{result.outcome}, {result.reached:.1f}{of} {unit}{who}"
