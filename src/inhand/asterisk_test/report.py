"""The report of a run: figures, a replay and a Markdown page, from its trials and results."""

import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from inhand.aside import Aside, here
from inhand.asterisk_test import regrasped
from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.results import Result, by_direction, result_of_human
from inhand.asterisk_test.scenes import (
    compatible_curve,
    direction_curves,
    human_curves,
    radar_series,
    target_of,
    trial_path,
    turn_series,
)
from inhand.asterisk_test.table import endings, failures, metric_faults, shown_columns, with_beside
from inhand.asterisk_test.tested import FRAME_STEPS, Tested, farthest_trial
from inhand.control.scenes import scene_at, start_scene
from inhand.control.trial import Trial, file_name
from inhand.pages import Part, Picture, again, counted, listed, options, table_of
from inhand.plots.asterisk import asterisk_figure
from inhand.plots.donut import donut_figure
from inhand.plots.panels import Panel, panels_figure
from inhand.plots.path import path_figure
from inhand.plots.radar import radar_figure
from inhand.plots.replay import write_replay
from inhand.plots.save import save_picture
from inhand.tasks.primitives import twisted_name

COMPATIBLE = "averages by the rule of the Asterisk Test software; its lines end at half the span or depth"
FIRST = "first trial of every direction"
COUNTED = "numbers and ends of lines: mean distance at the first loss of contact, or at the end"
ASIDE = 0.8
"""Share of the paths that is drawn aside: replay, asterisks, radar and the others take as long."""


@dataclass(frozen=True, eq=False)
class Run(Tested):
    """A finished run of a hand in the plane."""

    trials: tuple[Trial, ...]

    def figure(self) -> Figure:
        """Return the asterisk of the mean paths, or the donut where everything only rotates."""
        straight = _by_twist(self)
        if not straight:
            return _turns(self)
        part = straight[0]
        outline = start_scene(part.trials[0])
        return asterisk_figure(
            direction_curves(part.trials, part.results), outline=outline, title=_title(part), subtitle=_subtitle(part)
        )

    def pictures(self, folder: Path, aside: Aside = here) -> list[Part]:
        """Draw figures and a replay into `figures` of a folder, some aside, and return their parts of the page."""
        return _drawn(self, folder, aside)

    @cached_property
    def apart(self) -> list[dict[str, Any]]:
        """What each trial reached that is no part of the test, where fingers may be placed anew."""
        return regrasped.apart(self.trials) if self.config.regrasp else []

    @cached_property
    def apart_rows(self) -> list[tuple[str, ...]]:
        """The same as people read it, a direction each."""
        return regrasped.rows_of(self.apart, self.results) if self.config.regrasp else []

    def html(self) -> str:
        """Return its page for a browser."""
        from inhand.asterisk_test.browser import run_page

        own = Beside(self.name, self.trials, self.results, f"{self.config.paths} paths")
        return run_page(self.parts(), [*self.beside, own], self.people, self.config)

    def parts(self, pictures: Sequence[Part] = ()) -> list[Part]:
        """Return the parts of its page: what was run, the table, what failed, the figures, how to run it again."""
        return _parts(self, pictures)


def _drawn(run: Run, folder: Path, aside: Aside) -> list[Part]:
    first = [i for i, result in enumerate(run.results) if result.trial == 1 and result.angle_deg is not None]
    cut = round(ASIDE * len(first))
    before, after = ([(run.trials[i], run.results[i]) for i in part] for part in (first[:cut], first[cut:]))
    paths = aside(_paths, before, folder)
    pictures: list[Part] = []
    for part in _by_twist(run):
        pictures += [*_asterisks(part, folder), *_panels(part, folder)]
        text = "Mean distance [mm] and mean efficiency by direction"
        pictures.append(save_picture(both_radars(part), folder, _named(part, "radar"), text))
    if any(result.angle_deg is None for result in run.results):
        text = "Angle reached each way, and the hand's limit [deg]"
        pictures.append(save_picture(_turns(run), folder, "donut.png", text))
    pictures.append(_replay(run, folder))
    own = _paths(after, folder)
    return [*pictures, "## First trial of every direction", *paths(), *own]


def _parts(run: Run, pictures: Sequence[Part]) -> list[Part]:
    config, table = run.config, shown_columns(run.rows)
    passport = run.trials[0].passport
    return [
        f"# Asterisk Test: {run.subject}",
        f"{counted(config.trials, 'trial')} for each direction along {config.paths} paths, start noise"
        f" {config.noise_mm:g} mm and {config.noise_deg:g} deg (standard deviations), seed {config.seed}. The"
        f" controller reads what is {passport.reads}.",
        "Distance is the progress along the direction up to the first loss of contact, mean ± SD over the trials."
        " Lateral (largest distance from the line, mm), Off path (the same from a path that is not straight),"
        " Turn (largest rotation, deg), Contact (share of steps with every finger touching), Gap (longest time"
        " without), Force (largest of a finger on the object, N) and Overlap (deepest of a link and the object, mm) are"
        " the worst trial's; Eff. is the mean efficiency. Outcome is the worst, and how many trials had it.",
        table_of(*with_beside(*table, run.name, run.beside)),
        table_of(regrasped.HEADER, run.apart_rows, regrasped.TITLE) if run.apart_rows else "",
        beside_told(run.beside),
        endings(run.results),
        listed([*failures(run.results), *metric_faults(run.results)], "What failed"),
        people_told(run.people),
        listed(run.notes),
        *pictures,
        again(command(config)),
    ]


def beside_told(beside: Sequence[Beside]) -> Part:
    """Return what was run in each run that stands beside one."""
    return listed([f"{other.name}: {other.told_settings}." for other in beside], "Set beside it")


def command(config: AsteriskConfig) -> str:
    """Return the command line that repeats a run, quoted for a shell."""
    return shlex.join(["inhand", "asterisk", *options(config)])


def people_told(people: Sequence[HumanTrial]) -> str:
    """Return what a reader must know of people's trials."""
    if not people:
        return ""
    units = sorted({trial.unit for trial in people})
    return (
        f"People: {len(people)} recorded trials ({'; '.join(units)}). Their x and y are written in the moving object's"
        " frame: distances along a direction compare well (about 3 mm), lateral ones do not (up to 14 mm)."
    )


def _by_twist(run: Run) -> list[Run]:
    """Return the translations of a run, apart by the twist that they hold."""
    twists = dict.fromkeys(t.passport.rotation_deg for t in run.trials if t.passport.angle_deg is not None)
    return [_holding(run, twist) for twist in twists]


def _holding(run: Run, twist: float) -> Run:
    """Return the part of a run, of its people and of the runs beside it that translates and holds a twist [deg]."""
    return only(
        run,
        lambda trial: trial.passport.angle_deg is not None and trial.passport.rotation_deg == twist,
        lambda human: human.angle_deg is not None and human.twist_deg == twist,
    )


def only(run: Run, wanted: Callable[[Trial], bool], wanted_of_people: Callable[[HumanTrial], bool]) -> Run:
    """Return a run, its people and the runs beside it with some of their trials."""
    rows = [i for i, trial in enumerate(run.trials) if wanted(trial)]
    return replace(
        run,
        trials=tuple(run.trials[i] for i in rows),
        results=tuple(run.results[i] for i in rows),
        people=tuple(t for t in run.people if wanted_of_people(t)),
        beside=tuple(part for other in run.beside if (part := other.only(wanted)).trials),
    )


def _twist(run: Run) -> float:
    return run.trials[0].passport.rotation_deg


def _named(run: Run, stem: str) -> str:
    """Return the name of a figure, with the twist that its trials hold."""
    return f"{twisted_name(stem, _twist(run)).replace(' ', '_')}.png"


def _title(run: Run) -> str:
    twist = _twist(run)
    return f"{run.trials[0].passport.controller}, {run.config.paths} paths" + (
        f", holding {abs(twist):g} deg {'clockwise' if twist < 0 else 'counter-clockwise'}" if twist else ""
    )


def _subtitle(run: Run) -> str:
    count = len({result.trial for result in run.results})
    passport = run.trials[0].passport
    return f"{passport.hand.name}, {passport.object.name}; mean of {counted(count, 'trial')} a direction"


def _asterisks(run: Run, folder: Path) -> list[Picture]:
    """Draw the mean of all trials and, where there are several, the first trial alone."""
    drawn = [("asterisk", direction_curves(run.trials, run.results), _subtitle(run), f"mean object paths, {COUNTED}")]
    if run.config.compatible and run.results[0].labels is not None:
        drawn.append(
            ("asterisk_compatible", direction_curves(run.trials, run.results, compatible_curve), COMPATIBLE, COMPATIBLE)
        )
    first = [i for i, result in enumerate(run.results) if result.trial == 1]
    if len(first) < len(run.results):
        single = replace(run, trials=tuple(run.trials[i] for i in first), results=tuple(run.results[i] for i in first))
        drawn.append(("asterisk_single", direction_curves(single.trials, single.results), FIRST, f"the {FIRST}"))
    pictures, scene = [], start_scene(run.trials[0])
    for stem, curves, subtitle, text in drawn:
        figure = asterisk_figure(curves, outline=scene, title=_title(run), subtitle=subtitle)
        pictures.append(save_picture(figure, folder, _named(run, stem), f"Asterisk: {text} [mm]"))
    return pictures


def _panels(run: Run, folder: Path) -> list[Picture]:
    """Draw people, earlier runs and this one side by side, where there are others."""
    if not (run.people or run.beside):
        return []
    text = "People, earlier runs and this one on one scale"
    return [save_picture(side_by_side(run, "Side by side"), folder, _named(run, "panels"), text)]


def side_by_side(run: Run, title: str) -> Figure:
    """Return the figure of people, of the runs beside a run, and of the run itself, on one scale."""
    curves = direction_curves(run.trials, run.results)
    panels = [Panel(run.name, f"{run.config.paths} paths", tuple(curves), start_scene(run.trials[0]))]
    for other in reversed(run.beside):
        others, scene = tuple(direction_curves(other.trials, other.results)), start_scene(other.trials[0])
        panels.insert(0, Panel(other.name, other.told, others, scene))
    if run.people:
        people = human_curves(run.people, [curve.name for curve in curves])
        panels.insert(0, Panel("Human", counted(len(run.people), "recorded trial"), tuple(people)))
    return panels_figure(panels, title)


def _turns(run: Run) -> Figure:
    series = [turn_series(run.name, run.results)]
    people = [result_of_human(trial) for trial in run.people if trial.angle_deg is None]
    if people:
        series.insert(0, turn_series("human", people))
    return donut_figure(series, "Rotation in the hand", _subtitle(run))


def both_radars(run: Run) -> Figure:
    """Return the figure of distance and efficiency by direction, of people, of the runs beside a run, and of itself."""
    directions = {r.direction: r.angle_deg for r in run.results if r.angle_deg is not None}
    names = list(directions)
    series = [radar_series(other.name, by_direction(other.results), names) for other in run.beside]
    series.append(radar_series(run.name, by_direction(run.results), names))
    if run.people:
        people = [result_of_human(t) for t in run.people]
        series.insert(0, radar_series("human", by_direction(people), names))
    return radar_figure(list(directions.items()), series, "Distance and efficiency")


def _replay(run: Run, folder: Path) -> Picture:
    trial, result, rows, first = farthest_trial(run)
    origin = trial.object_pose[first, :2]
    write_replay(
        [scene_at(trial, row, origin) for row in rows],
        1e3 * (trial.object_pose[rows, :2] - origin),
        folder / "figures" / "replay.gif",
        title=f"{result.direction}, trial {result.trial}",
        target_angle_deg=trial.passport.angle_deg,
        target_path_mm=target_of(trial, result),
        contact=trial.touching[rows],
        frame_s=FRAME_STEPS * trial.passport.period,
    )
    return Picture(f"Replay of {result.direction}, trial {result.trial}", "figures/replay.gif")


def _paths(firsts: Sequence[tuple[Trial, Result]], folder: Path) -> list[Picture]:
    pictures = []
    figure = None
    for trial, result in firsts:
        told, subtitle = trial_path(trial, result), f"{trial.passport.controller}, trial 1, {result.outcome}"
        figure = path_figure(told, outline=start_scene(trial), title=result.direction, subtitle=subtitle, again=figure)
        text = f"{result.direction}: {result.outcome} at {result.metrics.distance_mm:.1f} mm"
        pictures.append(save_picture(figure, folder, f"paths/{file_name(result.direction)}.png", text))
    return pictures
