"""The report of a trace: its figure, a replay and a Markdown page."""

import shlex
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from inhand.aside import Aside, here
from inhand.control.catalogue import find_controller
from inhand.control.scenes import scene_at
from inhand.control.spatial_catalogue import find_spatial_controller
from inhand.control.spatial_scenes import solid_frames
from inhand.control.spatial_trial import SpatialPassport, SpatialTrial
from inhand.control.trial import AnyTrial, load_all, write_json, write_trials
from inhand.errors import InputError
from inhand.hands.fit import Held
from inhand.hands.spatial.fit import SpatialHeld
from inhand.hands.spatial.gravity import USUAL_PALM
from inhand.hands.spatial.objects import SolidSpec
from inhand.pages import Part, Picture, again, counted, listed, options, page_of, table_of
from inhand.plots.replay import write_replay
from inhand.plots.save import save_picture
from inhand.plots.spatial_replay import write_spatial_replay
from inhand.records import read_record
from inhand.repeats import write_repeat
from inhand.shown import HTML, Shown, frame, saved
from inhand.sim.names import UNTOLD
from inhand.tracing.config import MARK, TraceConfig
from inhand.tracing.figures import MOST_PANELS, one_plan, plan_line, trace_figure, wall_mm
from inhand.tracing.fit import AnyHeld
from inhand.tracing.follow import Followed
from inhand.tracing.plan import Plan
from inhand.tracing.run import TraceSetup
from inhand.tracing.spatial_figures import spatial_trace_figure
from inhand.tracing.spatial_tasks import SPATIAL_TASKS
from inhand.tracing.table import faults, trace_entry, trace_rows, what_was_done
from inhand.tracing.tasks import TASKS
from inhand.tracing.trace import Trace, trace_of
from inhand.tracing.walk import Event
from inhand.versions import versions

FRAME_STEPS = 2
"""Rows of a trial from one frame of the replay to the next (25 frames a second at 0.02 s a row),"""
MOST_FRAMES = 250
"""and more where it would have more frames than this."""
FAULTLESS = "Every trial followed its plan to the end without a failure."


@dataclass(frozen=True, eq=False)
class TraceRun(Shown):
    """A finished run."""

    mark = MARK

    config: TraceConfig
    setup: TraceSetup
    followed: tuple[Followed, ...]
    traces: tuple[Trace, ...]
    """What they reached, in the same order."""
    notes: tuple[str, ...]
    """What a reader should know, a sentence each."""

    def table(self) -> pd.DataFrame:
        """Return a row for each trial: how far it came, how far off it was, how it ended."""
        return frame([{k: v for k, v in entry.items() if k != "events"} for entry in self._entries()])

    def figure(self) -> Figure:
        """Return the paths of the object over its plan."""
        count = len(self.traces)
        part = f"the first {MOST_PANELS} of " if count > MOST_PANELS and not one_plan(self.followed) else ""
        subtitle = f"{self.setup.object.name}, {self.setup.hand.name}; {part}{counted(count, 'trial')}"
        spec = self.setup.object
        if isinstance(spec, SolidSpec):
            whole = f"{spec.name}, {self.setup.hand.name}, gravity {self.config.gravity or USUAL_PALM}"
            told = f"{whole}; {counted(count, 'trial')}"
            return spatial_trace_figure(spec, self.followed, self.traces, what_was_done(self.setup), told)
        return trace_figure(self.setup, self.followed, self.traces, what_was_done(self.setup), subtitle)

    def write(self, folder: Path, aside: Aside = here) -> None:
        """Write everything into a folder that is there; the replay may be drawn aside."""
        write_trials([each.trial for each in self.followed], folder)
        write_trace(self, folder, aside)
        (folder / HTML).write_text(self.html(), encoding="utf-8")
        content = {
            "trials": self._entries(),
            "size_mm": None if self.setup.size is None else 1e3 * self.setup.size,
            "followed": [_left(each) for each in self.followed],
            "notes": self.notes,
            "config": asdict(self.config),
            "versions": versions(),
            "seed": self.config.seed,
        }
        write_json(content, folder / MARK)
        self.table().to_csv(folder / "trials.csv", index=False)
        write_repeat(folder, "trace", self.config)

    def draw(self, folder: Path) -> None:
        """Draw figure and replay into `figures` of a folder."""
        write_trace(self, folder)

    def html(self) -> str:
        """Return its page for a browser."""
        from inhand.tracing.browser import trace_page

        found = list(zip(self.followed, self.traces, strict=True))
        return trace_page(parts(self, []), self.config, found, self.setup.wall)

    def _entries(self) -> list[dict[str, Any]]:
        pairs, origin = zip(self.followed, self.traces, strict=True), self.setup.hand.start_pose
        return [trace_entry(each, trace, origin) for each, trace in pairs]


@dataclass(frozen=True)
class _Left:
    """What a world left beside its trial, as the JSON has it."""

    plan: Plan
    legs: tuple[tuple[int, int], ...]
    """The primitives of the rows of manipulation: the number of each, and of how many rows."""
    events: tuple[Event, ...]
    come: float


def _left(followed: Followed) -> _Left:
    legs = followed.legs
    starts = np.flatnonzero(np.diff(legs, prepend=-1))
    counts = np.diff(np.append(starts, len(legs)))
    pairs = zip(legs[starts].tolist(), counts.tolist(), strict=True)
    return _Left(followed.plan, tuple(pairs), followed.events, followed.come)


def _followed(trial: AnyTrial, left: _Left) -> Followed:
    numbers, counts = np.array(left.legs, dtype=np.int64).reshape(-1, 2).T
    return Followed(left.plan, trial, np.repeat(numbers, counts), left.events, left.come)


def load_trace(folder: Path) -> TraceRun:
    """Return the run of a folder, measured again from its trials and plans.

    Raises:
        InputError: there is none that can be read.
    """
    config, content = saved(folder, MARK, TraceConfig, engine=UNTOLD)
    trials = sorted(load_all(folder), key=lambda trial: trial.passport.trial)
    try:
        whole = read_record({name: content.get(name) for name in ("followed", "size_mm", "notes")}, _Whole)
    except InputError as error:
        raise InputError(f"{folder / MARK}: {error}; run it again") from error
    if len(whole.followed) != len(trials):
        told = f"it tells of {counted(len(whole.followed), 'trial')}, and {len(trials)} are there"
        raise InputError(f"{folder / MARK}: {told}; run it again")
    followed = tuple(map(_followed, trials, whole.followed))
    held, size = _held(trials[0]), whole.size_mm
    tasks = TASKS if isinstance(held, Held) else SPATIAL_TASKS
    setup = TraceSetup(
        held,
        find_controller(config.controller, held)
        if isinstance(held, Held)
        else find_spatial_controller(config.controller),
        tuple(each.plan for each in followed),
        tasks.get(config.path) or tasks.get(config.path.rpartition(":")[2]),
        None if size is None else size / 1e3,
        whole.notes,
    )
    return TraceRun(config, setup, followed, tuple(trace_of(each, setup.wall) for each in followed), whole.notes)


def _held(trial: AnyTrial) -> AnyHeld:
    passport = trial.passport
    if isinstance(passport, SpatialPassport):
        return SpatialHeld(passport.hand, passport.object, passport.gravity)
    return Held(passport.hand, passport.object)


@dataclass(frozen=True)
class _Whole:
    followed: tuple[_Left, ...]
    size_mm: float | None
    notes: tuple[str, ...]


def write_trace(run: TraceRun, folder: Path, aside: Aside = here) -> None:
    """Write figures, replay and `report.md` of a run into its folder; the replay may be drawn aside."""
    text = "Paths of the object over its plan, and how far off they were"
    replay = _replay(run, folder, aside) if len(run.followed[0].trial.time) else None
    pictures = [save_picture(run.figure(), folder, "trace.png", text), *([replay()] if replay else [])]
    (folder / "report.md").write_text(page_of(*parts(run, ["## Figures", *pictures])), encoding="utf-8")


def _replay(run: TraceRun, folder: Path, aside: Aside) -> Callable[[], Picture]:
    """Draw the first trial aside, a long one faster than it was; return what waits for its part of the page."""
    followed = run.followed[0]
    trial, origin = followed.trial, run.setup.hand.start_pose
    step = max(FRAME_STEPS, -(-len(trial.time) // MOST_FRAMES))
    rows = list(range(0, len(trial.time), step))
    speed = f", {step / FRAME_STEPS:g} x as fast" if step > FRAME_STEPS else ""
    name = f"trial {trial.passport.trial}{speed}"
    same: dict[str, Any] = {
        "title": f"{followed.plan.name}, {name}",
        "contact": trial.touching[rows],
        "frame_s": step * trial.passport.period,
        "texts": [_told(followed, row) for row in rows],
    }
    out, plan = folder / "figures" / "replay.gif", plan_line(followed.plan, origin)
    if isinstance(trial, SpatialTrial):
        frames, trail = solid_frames(trial, rows, origin[:3]), 1e3 * (trial.object_pose[rows, :3] - origin[:3])
        drawn = aside(
            write_spatial_replay, frames, trail, out, target_mm=plan, fingers=trial.passport.hand.finger_names, **same
        )
    else:
        wall, trail = run.setup.wall, 1e3 * (trial.object_pose[rows, :2] - origin[:2])
        barrier = None if wall is None else wall_mm(wall, origin[:2])
        scenes = [scene_at(trial, row, origin[:2]) for row in rows]
        drawn = aside(write_replay, scenes, trail, out, target_path_mm=plan, wall_mm=barrier, **same)

    def waited() -> Picture:
        drawn()
        return Picture(f"Replay of {name}", "figures/replay.gif")

    return waited


def _told(followed: Followed, row: int) -> str:
    trial, count = followed.trial, len(followed.plan.legs)
    number = row - trial.manipulation.start
    if number < 0 or number >= len(followed.legs):
        return trial.phases[int(trial.phase[row])]
    return f"primitive {min(int(followed.legs[number]) + 1, count)} of {count}"


def _pulled(run: TraceRun) -> str:
    """Return how gravity pulls, of a hand in space."""
    if not isinstance(run.setup.held, SpatialHeld):
        return ""
    x, y, z = run.setup.held.gravity
    return f" Gravity {run.config.gravity or USUAL_PALM} ({x:.2f}, {y:.2f}, {z:.2f} m/s² in the palm frame)."


def parts(run: TraceRun, pictures: Sequence[Part]) -> list[Part]:
    """Return the parts of the page: what was run, the table, what failed and why, the figures, how to run it again."""
    config, setup, plan = run.config, run.setup, run.setup.plans[0]
    way = 1e3 * float(np.mean([each.measured().way[-1] for each in setup.plans]))
    pushed = " Pushed is the longest time against the wall, held by all fingers." if setup.wall else ""
    return [
        f"# {what_was_done(setup)}: {setup.object.name} with {setup.hand.name}",
        f"{counted(config.trials, 'trial')} of {counted(len(plan.legs), 'primitive')}, {plan.approach} of them an"
        f" approach, then {way:.0f} mm of way; start noise {config.noise_mm:g} mm and {config.noise_deg:g} deg"
        f" (standard deviations), seed {config.seed}.{_pulled(run)}",
        "Done is the share of the way that was come after the approach. RMS, Max and Fréchet are distances of the"
        " object's path from the plan, Turn its largest angle from it, all after the approach; Time counts from there."
        f" Failures are primitives that failed and were tried again, or not.{pushed}",
        table_of(*trace_rows(run.traces)),
        listed(faults(setup, run.followed, run.traces), "What failed") or FAULTLESS,
        listed(run.notes),
        *pictures,
        again(shlex.join(["inhand", "trace", *options(config)])),
    ]
