"""Reports of learning: the page of a training with its curves, and that of a policy's evaluation."""

import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.browser import views
from inhand.asterisk_test.comparison import GROUPS, AnyPrimitive, ControllerTrials, lost, rows
from inhand.asterisk_test.comparison import HEADER as BOTH
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.failures import MOST_FAILURES, failure_of, failures_figure
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.report import Run, both_radars, only, people_told, side_by_side
from inhand.asterisk_test.results import as_entry, summary_of
from inhand.asterisk_test.table import failures
from inhand.control.trial import write_json, write_trials
from inhand.learning.commands import EXPERT, EvaluateConfig
from inhand.learning.figures import SMOOTHING, directions_figure, learning_figure, progress_figure
from inhand.learning.progress import HEADER, Learned, evaluation_rows
from inhand.pages import Part, Picture, again, counted, listed, options, page_of, table_of
from inhand.plots.page.views import View
from inhand.plots.save import save_picture
from inhand.repeats import write_repeat
from inhand.shown import HTML, Shown, frame
from inhand.tasks.primitives import Primitive
from inhand.versions import versions

CURVES = (
    ("learning.png", learning_figure, f"Rewards and losses over the episodes, smoothed by {SMOOTHING:g}"),
    ("progress.png", progress_figure, "What evaluations reached, against the expert"),
    ("directions.png", directions_figure, "Share of the hand's limit in every direction"),
)
"""Figures of a training: file, what draws it, what it shows."""


@dataclass(frozen=True, eq=False)
class Compared(Shown):
    """A policy's evaluation beside the expert."""

    config: EvaluateConfig
    test: AsteriskConfig
    """What was run, as a run of the Asterisk Test has it."""
    policy: ControllerTrials
    expert: ControllerTrials
    """The expert's, from the same starts."""
    trained: dict[str, Any]
    """What the policy says of its training."""
    people: tuple[HumanTrial, ...] = ()
    """Human trials to set beside them."""
    notes: tuple[str, ...] = ()
    """What a reader should know, a sentence each."""
    learned: Learned | None = None
    """The record of the policy's training, if it is there."""

    def table(self) -> pd.DataFrame:
        """Return a row for each trial of both: controller, direction, outcome, every metric."""
        both = (self.policy, self.expert)
        return frame([{"controller": each.name} | as_entry(result) for each in both for result in each.results])

    @property
    def groups(self) -> Sequence[tuple[str, Sequence[AnyPrimitive]]]:
        """What the tables tell apart, each with its title."""
        return GROUPS

    @property
    def tables(self) -> list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
        """Title, heading and rows of a table for each group."""
        return [(title, BOTH, rows(self.policy, self.expert, self.people, group)) for title, group in self.groups]

    def figure(self) -> Figure:
        """Return people, expert and policy side by side."""
        return side_by_side(self.run, f"{self.policy.name} and {self.expert.name}")

    def write(self, folder: Path) -> None:
        """Write the same into a folder that is there."""
        both = {"policy": self.policy, "expert": self.expert}
        write_trials(self.policy.trials, folder)
        write_trials(self.expert.trials, folder / EXPERT)
        write_evaluation(self, folder)
        (folder / HTML).write_text(self.html(), encoding="utf-8")
        content = {
            "trials": [as_entry(result) for result in self.policy.results],
            "directions": summary_of(self.policy.first[1]),
            "expert": {
                "controller": self.expert.name,
                "trials": [as_entry(result) for result in self.expert.results],
                "directions": summary_of(self.expert.first[1]),
            },
            "failed": {name: [f"{r.direction} {r.trial}" for _, r in each.failed] for name, each in both.items()},
            "policy": self.trained,
            "notes": self.notes,
            "config": asdict(self.config),
            "versions": versions(),
            "seed": self.config.seed,
        }
        write_json(content, folder / "metrics.json")
        self.table().to_csv(folder / "trials.csv", index=False)
        write_repeat(folder, "evaluate", self.config)

    def draw(self, folder: Path) -> None:
        """Draw the figures into `figures` of a folder."""
        write_evaluation(self, folder)

    def html(self) -> str:
        """Return its page for a browser."""
        from inhand.learning.browser import evaluation_page

        both = [(self.expert, "from the same starts"), (self.policy, "the policy")]
        shown = [Beside(each.name, *each.first, told=text) for each, text in both]
        replayed = [Beside(each.name, *each.shown_or_failed) for each, _ in both]
        return evaluation_page(parts(self, []), self.views(shown, replayed), self.learned, self.config)

    def views(self, shown: Sequence[Beside], replayed: Sequence[Beside]) -> list[View]:
        """Return what a page for a browser draws of means, and the player of trials."""
        return views(shown, [human for human in self.people if human.twist_deg == 0], replayed)

    def pictures(self, folder: Path) -> list[Picture]:
        """Draw the figures of the trials into `figures` of a folder."""
        return [*_asterisks(self, folder), *_failed(self, folder)]

    @property
    def run(self) -> Run:
        """The policy's shown trials as a run of the Asterisk Test, the expert's beside it."""
        trials, results = self.policy.first
        others = Beside(self.expert.name, *self.expert.first, told="from the same starts")
        return Run(self.test, trials, results, self.people, self.notes, (others,))


def write_training(found: Learned, folder: Path, what: str, words: str) -> None:
    """Write the learning curves and `report.md` of a training run into its folder.

    Args:
        found: the record of the training.
        folder: the run's folder.
        what: what was trained, in one line.
        words: the command that trains so; none where Python alone can say it.
    """
    name = folder.resolve().name
    parts = training_parts(found, name, what, words, curve_pictures(found, folder, name, what))
    (folder / "report.md").write_text(page_of(*parts), encoding="utf-8")


def training_parts(found: Learned, name: str, what: str, words: str, pictures: Sequence[Picture] = ()) -> list[Part]:
    """Return the parts of the page of a training, the figures before how to run it again."""
    return [
        f"# Training: {name}",
        f"{what[:1].upper()}{what[1:]}. {len(found.total)} episodes of the agent, {len(found.evaluations)} evaluations;"
        f" the best policy is that at episode {found.best.episode}.",
        "Of limit is the mean share of the hand's own limit, Across and Turn are the worst trial's; returns are sums of"
        " rewards, the expert's from the same starts.",
        table_of(HEADER, evaluation_rows(found.best)),
        *pictures,
        again(words) if words else "",
    ]


def curve_pictures(found: Learned, folder: Path, title: str, subtitle: str) -> list[Picture]:
    """Draw the curves of a training into `figures` of a folder."""
    return [save_picture(draw(found, title, subtitle), folder, name, text) for name, draw, text in CURVES]


def write_evaluation(found: Compared, folder: Path) -> None:
    """Write figures and `report.md` of an evaluation into its folder."""
    pictures = found.pictures(folder)
    if found.learned is not None:
        pictures += curve_pictures(found.learned, folder, f"Training of {found.policy.name}", "")
    (folder / "report.md").write_text(page_of(*parts(found, ["## Figures", *pictures])), encoding="utf-8")


def summary(found: Compared) -> str:
    """Return in one sentence how often the policy and the expert lost the object."""
    told = [f"{e.name} {lost(e.results)}" for e in (found.policy, found.expert)]
    return f"Objects lost in {len(found.policy.results)} episodes: {', '.join(told)}."


def parts(found: Compared, pictures: Sequence[Part]) -> list[Part]:
    """Return the parts of the page of an evaluation, the figures before the last."""
    config, policy, passport = found.test, found.policy, found.policy.trials[0].passport
    failed = [
        f"{each.name}{told}"
        for each in (policy, found.expert)
        for told in ([f", {sentence}" for sentence in failures(each.results)] or [": no trial failed."])
    ]
    return [
        f"# Evaluation: {policy.name} on {passport.object.name} with {passport.hand.name}",
        f"{counted(policy.shown, 'trial')} for each direction, start noise {config.noise_mm:g} mm and"
        f" {config.noise_deg:g} deg (standard deviations), seed {config.seed}; {policy.name} and the expert"
        f" {found.expert.name} start from the same places. Lost objects are counted over {len(policy.results)}"
        " episodes.",
        "Distance is the progress up to the first loss of contact, mean ± SD. Lateral, Turn and Contact (share of steps"
        f" with all fingers touching) are the worst trial's. Cells hold {policy.name}'s value, then"
        f" {found.expert.name}'s.",
        *(table_of(header, cells, title) for title, header, cells in found.tables),
        summary(found),
        listed(failed, "What failed"),
        people_told(found.people),
        listed(found.notes),
        *pictures,
        again(shlex.join(["inhand", "evaluate", found.config.run, *options(found.config, without=("run",))])),
    ]


def _asterisks(found: Compared, folder: Path) -> list[Picture]:
    """Draw people, expert and policy side by side, trained and unseen directions apart, and one radar."""
    run = found.run
    pictures: list[Picture] = []
    for title, group in GROUPS:
        figure, name = side_by_side(_some(run, group), title), f"{title.lower().replace(' ', '_')}.png"
        text = f"{title}: mean object paths up to the first loss of contact [mm]"
        pictures.append(save_picture(figure, folder, name, text))
    text = "Farthest progress [mm] and efficiency by direction"
    return [*pictures, save_picture(both_radars(run), folder, "radar.png", text)]


def _some(run: Run, group: Sequence[Primitive]) -> Run:
    names = {primitive.name for primitive in group}
    return only(
        replace(run, people=tuple(t for t in run.people if t.twist_deg == 0)),
        lambda trial: trial.passport.primitive in names,
        lambda human: human.primitive in names,
    )


def _failed(found: Compared, folder: Path) -> list[Picture]:
    """Draw every trial that the policy did not bring to its end; nothing where there is none."""
    every = [failure_of(trial, result) for trial, result in found.policy.failed]
    pictures = []
    for number, first in enumerate(range(0, len(every), MOST_FAILURES), start=1):
        part = every[first : first + MOST_FAILURES]
        count = f"{len(every)} of {len(found.policy.results)} episodes"
        subtitle = f"{count}; hand and object where contact was lost, or at the end"
        figure = failures_figure(part, f"{found.policy.name}: trials that failed", subtitle)
        text = "Trials that failed: the path, and where and why it ended"
        pictures.append(save_picture(figure, folder, f"failures_{number}.png", text))
    return pictures
