"""Reports of learning: the page of a training with its curves, and that of a policy's evaluation."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.comparison import GROUPS, Evaluation, lost, rows
from inhand.asterisk_test.comparison import HEADER as BOTH
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.page import people_lines
from inhand.asterisk_test.people.human_trial import HumanTrial
from inhand.asterisk_test.report import Run, both_radars, only, side_by_side
from inhand.asterisk_test.results import as_entry, summary_of
from inhand.asterisk_test.table import failures
from inhand.control.trial import write_json, write_trials
from inhand.learning.commands import EvaluateConfig
from inhand.learning.failures import MOST_FAILURES, failure_of, failures_figure
from inhand.learning.figures import SMOOTHING, directions_figure, learning_figure, progress_figure
from inhand.learning.progress import HEADER, Learned, evaluation_rows, read_learning
from inhand.pages import Picture, again_lines, options, picture_lines, table_lines
from inhand.plots.save import save_figure
from inhand.shown import Shown, frame
from inhand.tasks.primitives import Primitive
from inhand.versions import versions

EXPERT = "ik"
"""The controller that a policy is set beside; its trials lie in a folder of that name."""
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
    """What was asked for."""
    test: AsteriskConfig
    """What was run, as a run of the Asterisk Test has it."""
    policy: Evaluation
    """The policy's trials."""
    expert: Evaluation
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

    def figure(self) -> Figure:
        """Return people, expert and policy side by side."""
        return side_by_side(self.run, f"{self.policy.name} and {self.expert.name}")

    def write(self, folder: Path) -> None:
        """Write the same into a folder that is there."""
        both = {"policy": self.policy, "expert": self.expert}
        write_trials(self.policy.trials, folder)
        write_trials(self.expert.trials, folder / EXPERT)
        write_evaluation(self, folder)
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
            "config": asdict(self.config),
            "versions": versions(),
            "seed": self.config.seed,
        }
        write_json(content, folder / "metrics.json")

    @property
    def run(self) -> Run:
        """The policy's shown trials as a run of the Asterisk Test, the expert's beside it."""
        trials, results = self.policy.first
        others = Beside(self.expert.name, *self.expert.first, told="from the same starts")
        return Run(self.test, trials, results, self.people, self.notes, (others,))


def write_training(folder: Path, what: str) -> None:
    """Write the learning curves and `report.md` of a training run into its folder.

    Args:
        folder: the run's folder.
        what: what was trained, in one line.

    Raises:
        InputError: the folder holds no record of a training.
    """
    found = read_learning(folder)
    lines = [
        f"# Training: {folder.resolve().name}",
        "",
        f"{what[:1].upper()}{what[1:]}. {len(found.total)} episodes of the agent, {len(found.evaluations)} evaluations;"
        f" the best policy is that at episode {found.best.episode}.",
        "",
        "Of limit is the mean share of the hand's own limit, Across and Turn are the worst trial's; returns are sums of"
        " rewards, the expert's from the same starts.",
        "",
        *table_lines(HEADER, evaluation_rows(found.best)),
        "",
        *picture_lines(curve_pictures(found, folder, folder.resolve().name, what)),
    ]
    (folder / "report.md").write_text("\n".join(lines), encoding="utf-8")


def curve_pictures(found: Learned, folder: Path, title: str, subtitle: str) -> list[Picture]:
    """Draw the curves of a training into `figures` of a folder."""
    pictures = []
    for name, draw, text in CURVES:
        save_figure(draw(found, title, subtitle), folder / "figures" / name)
        pictures.append(Picture(text, f"figures/{name}"))
    return pictures


def write_evaluation(found: Compared, folder: Path) -> None:
    """Write figures and `report.md` of an evaluation into its folder."""
    pictures = [*_asterisks(found, folder), *_failed(found, folder)]
    if found.learned is not None:
        pictures += curve_pictures(found.learned, folder, f"Training of {found.policy.name}", "")
    (folder / "report.md").write_text("\n".join(_page(found, pictures)), encoding="utf-8")


def summary(found: Compared) -> str:
    """Return in one sentence how often the policy and the expert lost the object."""
    told = [f"{e.name} {lost(e.results)}" for e in (found.policy, found.expert)]
    return f"Objects lost in {len(found.policy.results)} episodes: {', '.join(told)}."


def _page(found: Compared, pictures: Sequence[Picture]) -> list[str]:
    config, policy = found.test, found.policy
    passport = policy.trials[0].passport
    tables = []
    for title, group in GROUPS:
        shown = rows(policy, found.expert, found.people, group)
        tables += [f"## {title}", "", *table_lines(BOTH, [_escaped(row) for row in shown]), ""]
    return [
        f"# Evaluation: {policy.name} on {passport.object.name} with {passport.hand.name}",
        "",
        f"{policy.shown} trial(s) for each direction, start noise {config.noise_mm:g} mm and {config.noise_deg:g} deg"
        f" (standard deviations), seed {config.seed}; {policy.name} and the expert {found.expert.name} start from the"
        f" same places. Lost objects are counted over {len(policy.results)} episodes.",
        "",
        "Distance is the progress up to the first loss of contact, mean ± SD. Lateral, Turn and Contact (share of steps"
        f" with both fingers touching) are the worst trial's. Cells hold {policy.name}'s value, then"
        f" {found.expert.name}'s.",
        "",
        *tables,
        summary(found),
        "",
        *_sentences(found),
        *people_lines(found.people),
        *[f"* {note}" for note in found.notes],
        "",
        "## Figures",
        "",
        *picture_lines(pictures),
        *again_lines(shlex.join(["inhand", "evaluate", found.config.run, *options(found.config, without=("run",))])),
    ]


def _escaped(cells: Sequence[str]) -> tuple[str, ...]:
    """Return cells whose bars do not end them in Markdown."""
    return tuple(cell.replace("|", "\\|") for cell in cells)


def _sentences(found: Compared) -> list[str]:
    """Return what failed in each direction."""
    lines = ["## What failed", ""]
    for each in (found.policy, found.expert):
        sentences = failures(each.results)
        lines += [f"* {each.name}, {sentence}" for sentence in sentences]
        if not sentences:
            lines.append(f"* {each.name}: no trial failed.")
    return [*lines, ""]


def _asterisks(found: Compared, folder: Path) -> list[Picture]:
    """Draw people, expert and policy side by side, trained and unseen directions apart, and one radar."""
    run, pictures = found.run, []
    for title, group in GROUPS:
        stem = title.lower().replace(" ", "_")
        part = _some(run, group)
        save_figure(side_by_side(part, title), folder / "figures" / f"{stem}.png")
        text = f"{title}: mean object paths up to the first loss of contact [mm]"
        pictures.append(Picture(text, f"figures/{stem}.png"))
    save_figure(both_radars(run), folder / "figures" / "radar.png")
    return [*pictures, Picture("Farthest progress [mm] and efficiency by direction", "figures/radar.png")]


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
        name = f"failures_{number}.png"
        save_figure(
            failures_figure(part, f"{found.policy.name}: trials that failed", subtitle), folder / "figures" / name
        )
        pictures.append(Picture("Trials that failed: the path, and where and why it ended", f"figures/{name}"))
    return pictures
