"""Runs set side by side on one page: of the Asterisk Test and evaluations, of trainings, of traces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from inhand.asterisk_test.beside import Beside, names_of
from inhand.asterisk_test.browser import views
from inhand.asterisk_test.report import Run
from inhand.asterisk_test.results import by_direction, mean_fraction
from inhand.asterisk_test.spatial.browser import spatial_views
from inhand.asterisk_test.spatial.report import SpatialRun
from inhand.asterisk_test.table import endings, failures, reached
from inhand.errors import InputError
from inhand.learning.browser import training_views
from inhand.learning.progress import HEADER, evaluation_rows
from inhand.learning.report import Compared
from inhand.learning.spatial_report import SpatialCompared
from inhand.learning.train import Trained
from inhand.pages import NOTHING, Part, counted, listed, spread, table_of
from inhand.plots.page.document import WebPart, html_of
from inhand.shown import Shown
from inhand.sim.disturbance_files import NONE
from inhand.tracing.browser import views_of
from inhand.tracing.report import TraceRun
from inhand.tracing.table import faults, trace_rows, what_was_done

MOST = 6
"""Runs that a page compares: as many as it has colours."""


def compared(runs: Sequence[tuple[Path, Shown]]) -> str:
    """Return a page that sets runs of one kind side by side.

    Raises:
        InputError: fewer than two or more than `MOST`, one twice, or kinds that have nothing to set side by side.
    """
    if not 2 <= len(runs) <= MOST:
        raise InputError(f"{len(runs)} runs to compare: give 2 to {MOST}")
    places = [folder.resolve() for folder, _ in runs]
    for (folder, _), place in zip(runs, places, strict=True):
        if places.count(place) > 1:
            raise InputError(f"{folder} is given twice: give each run once")
    own = [_own(run) for _, run in runs]
    for kind, compare in KINDS:
        if all(isinstance(run, kind) for run in own):
            return compare([folder for folder, _ in runs], own)
    told = ", ".join(f"{folder} is {TOLD.get(type(run).__name__, 'another')}" for folder, run in runs)
    raise InputError(
        f"these runs cannot be compared: {told}; give runs of `inhand asterisk` and `inhand evaluate`, all in the plane"
        " or all in space, or trainings, or traces"
    )


def _own(run: Shown) -> Shown:
    """Return what is compared of a run: of an evaluation the policy's shown trials as a run of the Asterisk Test."""
    if isinstance(run, SpatialCompared):
        return run.tested(run.policy)
    return run.run if isinstance(run, Compared) else run


def _tests(folders: Sequence[Path], own: Sequence[Any]) -> str:
    """Return the page of runs of the Asterisk Test, all in the plane or in space, and of evaluations' policies."""
    settings = [run.trials[0].passport.settings for run in own]
    names = names_of(settings, folders)
    groups = [
        Beside(name, run.trials, run.results, ", ".join(word for word in told if word != NONE))
        for name, run, told in zip(names, own, settings, strict=True)
    ]
    people = next((run.people for run in own if run.people), ())
    told = listed(f"{each.name}: {each.told_settings}; {counted(len(each.trials), 'trial')}." for each in groups)
    shown = spatial_views(groups, groups) if isinstance(own[0], SpatialRun) else views(groups, people, groups[::-1])
    ends = listed(f"{each.name}: {endings(each.results)}" for each in groups)
    failed = [f"{each.name}, {sentence}" for each in groups for sentence in failures(each.results)]
    parts: list[WebPart] = [
        told,
        *shown,
        _distances(groups),
        ends,
        listed(failed, "What failed"),
    ]
    return html_of("A comparison", [*_head(names, folders), *parts])


def _distances(groups: Sequence[Beside]) -> Part:
    """Return distances and shares of the limit by direction, a column each for every run."""
    found = [by_direction(group.results) for group in groups]
    rows = []
    for direction in dict.fromkeys(name for each in found for name in each):
        mine = [each.get(direction, []) for each in found]
        shares = [mean_fraction(group) if group else None for group in mine]
        told = [NOTHING if share is None else spread(share, digits=2) for share in shares]
        rows.append((direction, *(reached(group) if group else NOTHING for group in mine), *told))
    names = [group.name for group in groups]
    header = ("Direction", *(f"{name} [mm]" for name in names), *(f"{name}, of limit" for name in names))
    return table_of(header, rows, "Results")


def _trainings(folders: Sequence[Path], runs: Sequence[Trained]) -> str:
    """Return the page of trainings: what the best policy of each reached, and the curves of all."""
    names = _names(folders)
    pairs = list(zip(names, runs, strict=True))
    told = listed(f"{name}: {run.title}." for name, run in pairs)
    rows = [(name, *row) for name, run in pairs for row in evaluation_rows(run.learned.best)]
    curves = [part for name, run in pairs for part in training_views(run.learned, f", {name}")]
    table = table_of(("Run", *HEADER), rows, "The best policies")
    return html_of("A comparison", [*_head(names, folders), told, table, *curves])


def _traces(folders: Sequence[Path], runs: Sequence[TraceRun]) -> str:
    """Return the page of traces: all trials replayed over each other, errors, and one table."""
    names = _names(folders)
    pairs = list(zip(names, runs, strict=True))
    told = listed(f"{name}: {what_was_done(r.setup)}, {r.setup.object.name}, {r.setup.hand.name}." for name, r in pairs)
    groups = [(name, list(zip(run.followed, run.traces, strict=True))) for name, run in pairs]
    header, every = trace_rows([trace for run in runs for trace in run.traces])
    whose = [name for name, run in pairs for _ in run.traces]
    table = table_of(("Run", *header), [(name, *row) for name, row in zip(whose, every, strict=True)], "Results")
    failed = [f"{name}, {text}" for name, run in pairs for text in faults(run.setup, run.followed, run.traces)]
    wall = next((run.setup.wall for run in runs if run.setup.wall is not None), None)
    parts: list[WebPart] = [told, *views_of(groups, wall), table, listed(failed, "What failed")]
    return html_of("A comparison", [*_head(names, folders), *parts])


def _head(names: Sequence[str], folders: Sequence[Path]) -> list[Part]:
    return [f"# {counted(len(names), 'run')} compared: {', '.join(names)}", f"From {', '.join(map(str, folders))}."]


def _names(folders: Sequence[Path]) -> list[str]:
    """Return the shortest ends of paths that tell folders apart."""
    return names_of([()] * len(folders), folders)


KINDS: tuple[tuple[type[Shown], Callable[[Sequence[Path], Sequence[Any]], str]], ...] = (
    (Run, _tests),
    (SpatialRun, _tests),
    (Trained, _trainings),
    (TraceRun, _traces),
)
"""Which kinds of runs can be set side by side, and what does it."""
TOLD = {
    "Run": "a run of the Asterisk Test",
    "SpatialRun": "a run of the Asterisk Test in space",
    "Compared": "an evaluation",
    "SpatialCompared": "an evaluation in space",
    "TraceRun": "a trace",
    "Trained": "a training",
    "Reach": "a reach",
    "SpatialReach": "a reach in space",
    "SweepRun": "a sweep",
    "RobustnessRun": "a study of robustness",
    "DesignRun": "a design study",
    "Dataset": "a dataset",
}
"""What kinds of runs are called."""
