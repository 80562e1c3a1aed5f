"""The table of a trace, what went wrong in sentences, and its entries in the JSON."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from inhand.control.trial import DIVERGED, NO_GRASP, REACHED
from inhand.geometry import Array
from inhand.pages import NO_VERDICT, NOTHING
from inhand.tracing.follow import Followed
from inhand.tracing.poses import place
from inhand.tracing.run import TraceSetup
from inhand.tracing.trace import PUSHED, Trace
from inhand.tracing.walk import Event

MOST_FAILURES = 2
"""Failures of one trial that its sentence tells."""
ENDS = ("gave up", "grip ends")
"""Events that end a plan before its end."""


def _number(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else NOTHING


COLUMNS: dict[str, Callable[[Trace], str]] = {
    "Trial": lambda trace: str(trace.trial),
    "Outcome": lambda trace: trace.outcome,
    "Done [%]": lambda trace: f"{100 * trace.completion:.1f}",
    "RMS [mm]": lambda trace: _number(trace.rms_mm),
    "Max [mm]": lambda trace: _number(trace.max_mm),
    "Fréchet [mm]": lambda trace: _number(trace.frechet_mm),
    "Turn [deg]": lambda trace: f"{trace.turn_deg:.1f}",
    "Time [s]": lambda trace: f"{trace.time_s:.1f}",
    "Failures": lambda trace: str(trace.failures),
    "Force [N]": lambda trace: f"{trace.force_max_n:.2f}",
    "Overlap [mm]": lambda trace: f"{trace.penetration_max_mm:.2f}",
    "Pushed [s]": lambda trace: NOTHING if trace.pushed_s is None else f"{trace.pushed_s:.1f}",
}
"""The table's columns, the last for pushes alone."""


def trace_rows(traces: Sequence[Trace]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return header and a row for each trial; the column of the push only where there is a wall."""
    shown = list(COLUMNS)[: None if any(trace.pushed_s is not None for trace in traces) else -1]
    return tuple(shown), [tuple(COLUMNS[name](trace) for name in shown) for trace in traces]


def what_was_done(setup: TraceSetup) -> str:
    """Return what a run traced or did, at which size and by which controller."""
    name, by = setup.plans[0].name, setup.controller.name
    if setup.size is None:
        return f"Task {name} by {by}"
    return f"{name[:1].upper()}{name[1:]} of {1e3 * setup.size:.0f} mm by {by}"


def faults(setup: TraceSetup, followed: Sequence[Followed], traces: Sequence[Trace]) -> list[str]:
    """Return one sentence for every trial that left its path or did not do what was asked: where, when and why."""
    origin = setup.hand.start_pose
    told = [(_fault(each, trace, origin), trace) for each, trace in zip(followed, traces, strict=True)]
    return [f"Trial {trace.trial}, {trace.outcome}: {text}" for text, trace in told if text]


def trace_entry(followed: Followed, trace: Trace, origin: Array) -> dict[str, Any]:
    """Return a trial as one entry of the JSON's `trials` list; places are relative to the object's start pose."""
    plan = followed.plan
    events = [
        {
            "time_s": event.time,
            "leg": event.leg,
            "kind": plan.legs[event.leg].kind,
            "place_mm": _place(event.place, origin),
            "off_mm": 1e3 * event.off,
            "what": event.what,
        }
        for event in followed.events
    ]
    whole = {"legs": len(plan.legs), "approach_legs": plan.approach, "way_mm": 1e3 * plan.measured().way[-1]}
    return {**asdict(trace), "done": trace.done, **whole, "events": events}


def _fault(followed: Followed, trace: Trace, origin: Array) -> str:
    """Return what went wrong in one trial, nothing where it did what was asked without a failure."""
    if trace.outcome == NO_GRASP:
        return "the fingers did not hold the object at the start."
    failures = [event for event in followed.events if event.what not in ENDS]
    parts = [_told(event, followed, origin) for event in failures[:MOST_FAILURES]]
    if len(failures) > MOST_FAILURES:
        parts.append(f"{len(failures) - MOST_FAILURES} more")
    if trace.outcome != REACHED:
        last_place = followed.trial.object_pose[-1, : len(place(followed.plan.legs[0].start))]
        last = followed.events[-1].what if followed.events and followed.events[-1].what in ENDS else "ended"
        parts.append(f"{last} at {_shown(last_place, origin)} mm after {100 * trace.completion:.1f} % of the way")
    elif parts:
        parts.append("then went on to the end")
    if trace.pushed_s is not None and trace.pushed_s < PUSHED:
        parts.append(f"pushed against the wall for {trace.pushed_s:.1f} s instead of {PUSHED:g} s")
    if trace.outcome == DIVERGED:
        parts.append(NO_VERDICT[:1].lower() + NO_VERDICT[1:-1])
    return "; ".join(parts) + "." if parts else ""


def _told(event: Event, followed: Followed, origin: Array) -> str:
    legs = followed.plan.legs
    return (
        f"{event.what} at {_shown(event.place, origin)} mm after {event.time:.1f} s, {1e3 * event.off:.1f} mm and"
        f" {np.rad2deg(event.turned):.1f} deg off, in primitive {event.leg + 1} of {len(legs)}"
        f" ({legs[event.leg].kind})"
    )


def _shown(where: Sequence[float] | Array, origin: Array) -> str:
    return f"({', '.join(f'{value:.1f}' for value in _place(where, origin))})"


def _place(where: Sequence[float] | Array, origin: Array) -> list[float]:
    """Return a position `(2,)`, in space `(3,)`, from the object's start [mm]."""
    return [float(1e3 * (value - begin)) for value, begin in zip(where, origin[: len(where)], strict=True)]
