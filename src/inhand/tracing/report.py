"""The report of a trace: its figure, a replay and a Markdown page."""

from __future__ import annotations

import shlex
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from inhand.control.scenes import scene_at
from inhand.control.trial import write_json, write_trials
from inhand.pages import Picture, again_lines, listed_lines, options, picture_lines, table_lines
from inhand.plots.replay import write_replay
from inhand.plots.save import save_figure
from inhand.shown import Shown, frame
from inhand.tracing.config import TraceConfig
from inhand.tracing.figures import MOST_PANELS, one_plan, plan_line, trace_figure, wall_mm
from inhand.tracing.follow import Followed
from inhand.tracing.run import TraceSetup
from inhand.tracing.table import faults, trace_entry, trace_rows, what_was_done
from inhand.tracing.trace import Trace
from inhand.versions import versions

FRAME_STEPS = 2
"""Rows of a trial from one frame of the replay to the next (25 frames a second at 0.02 s a row),"""
MOST_FRAMES = 300
"""and more where it would have more frames than this."""


FAULTLESS = "Every trial followed its plan to the end without a failure."
MARK = "trace.json"
"""The file that marks a folder as one of a trace."""


@dataclass(frozen=True, eq=False)
class TraceRun(Shown):
    """A finished run."""

    mark = MARK

    config: TraceConfig
    """What was run."""
    setup: TraceSetup
    """Its plans and surroundings."""
    followed: tuple[Followed, ...]
    """What its trials left."""
    traces: tuple[Trace, ...]
    """What they reached, in the same order."""
    notes: tuple[str, ...]
    """What a reader should know, a sentence each."""

    def table(self) -> pd.DataFrame:
        """Return a row for each trial: how far it came, how far off it was, how it ended."""
        return frame([{k: v for k, v in entry.items() if k != "events"} for entry in self._entries()])

    def figure(self) -> Figure:
        """Return the paths of the object over its plan."""
        config, count = self.config, len(self.traces)
        part = f"the first {MOST_PANELS} of " if count > MOST_PANELS and not one_plan(self.followed) else ""
        subtitle = f"{config.object}, {config.hand}; {part}{count} trial{'s' if count > 1 else ''}"
        return trace_figure(self.setup, self.followed, self.traces, what_was_done(self.setup), subtitle)

    def write(self, folder: Path) -> None:
        """Write everything into a folder that is there."""
        write_trials([each.trial for each in self.followed], folder)
        write_trace(self, folder)
        content = {
            "trials": self._entries(),
            "size_mm": None if self.setup.size is None else 1e3 * self.setup.size,
            "config": asdict(self.config),
            "versions": versions(),
            "seed": self.config.seed,
        }
        write_json(content, folder / MARK)

    def _entries(self) -> list[dict[str, Any]]:
        pairs, origin = zip(self.followed, self.traces, strict=True), self.setup.hand.start_pose
        return [trace_entry(each, trace, origin) for each, trace in pairs]


def write_trace(run: TraceRun, folder: Path) -> None:
    """Write figures, replay and `report.md` of a run into its folder."""
    figures = folder / "figures"
    save_figure(run.figure(), figures / "trace.png")
    pictures = [Picture("Paths of the object over its plan, and how far off they were", "figures/trace.png")]
    if len(run.followed[0].trial.time):
        pictures.append(_replay(run, figures))
    (folder / "report.md").write_text("\n".join(_page(run, pictures)), encoding="utf-8")


def _replay(run: TraceRun, figures: Path) -> Picture:
    """Draw the first trial; a long one faster than it was."""
    followed, wall, origin = run.followed[0], run.setup.wall, run.setup.hand.start_pose[:2]
    trial = followed.trial
    step = max(FRAME_STEPS, -(-len(trial.time) // MOST_FRAMES))
    rows = list(range(0, len(trial.time), step))
    speed = f", {step / FRAME_STEPS:g} x as fast" if step > FRAME_STEPS else ""
    write_replay(
        [scene_at(trial, row, origin) for row in rows],
        1e3 * (trial.object_pose[rows, :2] - origin),
        figures / "replay.gif",
        title=f"{followed.plan.name}, trial {trial.passport.trial}{speed}",
        target_path_mm=plan_line(followed.plan, origin),
        contact=trial.touching[rows],
        frame_s=step * trial.passport.period,
        wall_mm=None if wall is None else wall_mm(wall, origin),
        texts=[_told(followed, row) for row in rows],
    )
    return Picture(f"Replay of trial {trial.passport.trial}{speed}", "figures/replay.gif")


def _told(followed: Followed, row: int) -> str:
    """Return what is done in a row of a trial."""
    trial, count = followed.trial, len(followed.plan.legs)
    number = row - trial.manipulation.start
    if number < 0 or number >= len(followed.legs):
        return trial.phases[int(trial.phase[row])]
    return f"primitive {min(int(followed.legs[number]) + 1, count)} of {count}"


def _page(run: TraceRun, pictures: list[Picture]) -> list[str]:
    """Return the page: what was run, the table, what failed and why, the figures, and how to run it again."""
    config, setup, plan = run.config, run.setup, run.setup.plans[0]
    words, noise = (
        shlex.join(["inhand", "trace", *options(config)]),
        f"{config.noise_mm:g} mm and {config.noise_deg:g} deg",
    )
    way = 1e3 * float(np.mean([each.measured().way[-1] for each in setup.plans]))
    sentences = faults(setup, run.followed, run.traces)
    return [
        f"# {what_was_done(setup)}: {config.object} with {config.hand}",
        "",
        f"{config.trials} trial(s) of {len(plan.legs)} primitives, {plan.approach} of them an approach, then"
        f" {way:.0f} mm of way; start noise {noise} (standard deviations), seed"
        f" {config.seed}.",
        "",
        "Done is the share of the way that was come after the approach. RMS, Max and Fréchet are distances of the"
        " object's path from the plan, Turn its largest angle from it, all after the approach; Time counts from there."
        " Failures are primitives that failed and were tried again, or not.",
        *([" Pushed is the longest time against the wall, held by both fingers."] if setup.wall else []),
        "",
        *table_lines(*trace_rows(run.traces)),
        "",
        *(listed_lines("What failed", sentences) or [FAULTLESS, ""]),
        *[f"* {note}" for note in run.notes],
        "",
        "## Figures",
        "",
        *picture_lines(pictures),
        *again_lines(words),
    ]
