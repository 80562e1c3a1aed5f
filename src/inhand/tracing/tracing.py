"""Tracing as a function: what to draw or do in, a finished run out; what reports is imported once all is run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from inhand.control.catalogue import CONTROLLERS, ControllerEntry
from inhand.control.draws import disturbance_notes
from inhand.control.notes import notes_of
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import hand_name, object_name
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.records import configured
from inhand.sim.disturbance import disturbance_of
from inhand.tracing.config import TraceConfig
from inhand.tracing.follow import Followed
from inhand.tracing.run import TraceSetup, prepare_trace, simulate_trace
from inhand.tracing.trace import Trace

if TYPE_CHECKING:
    from inhand.tracing.report import TraceRun

DEFAULT = TraceConfig()
"""What is traced where nothing else is asked for."""
Simulate = Callable[[TraceConfig, TraceSetup], tuple[tuple[Followed, ...], tuple[Trace, ...]]]
"""Runs a setup; the command line shows how far it is."""


def trace(
    path: str | Path = DEFAULT.path,
    hand: str | Path | HandSpec | SpatialHand = DEFAULT.hand,
    object: str | Path | ObjectSpec | SolidSpec = DEFAULT.object,
    controller: object = DEFAULT.controller,
    *,
    size: float | None = None,
    trials: int = DEFAULT.trials,
    seed: int = DEFAULT.seed,
    **settings: Any,
) -> TraceRun:
    """Trace a drawing or do a task and return its trials, table and figure; nothing is written before `save`.

    Args:
        path: a shape, a letter, an SVG or CSV file, or a task.
        hand: a name, a TOML file or a spec.
        object: a name, a TOML file, an outline (`part.dxf:unit=mm:mass_kg=0.05`) or a spec.
        controller: a name, the folder of a training, `FILE.py:NAME`, or a class of yours.
        size: larger side of the drawing [mm]; None as `inhand trace` chooses it.
        trials: how many.
        seed: of the start noise and of what tasks draw.
        settings: other fields of `TraceConfig`, such as scale and noise_mm.

    Raises:
        InputError: anything that cannot be run; the text says what, and what is allowed.
    """
    settings |= {"path": str(path), "size": size, "trials": trials, "seed": seed}
    settings |= {"hand": hand_name(hand), "object": object_name(object)}
    settings["controller"] = CONTROLLERS.name_of(controller)
    settings |= disturbance_of(settings)
    return run_trace(configured(TraceConfig, settings))


def run_trace(
    config: TraceConfig, prepare: Callable[[TraceConfig], TraceSetup] = prepare_trace, run: Simulate = simulate_trace
) -> TraceRun:
    """Return the finished run of a configuration, prepared and simulated as the command line shows it or silently.

    Raises:
        InputError: anything in the configuration that cannot be run.
    """
    setup = prepare(config)
    from inhand.tracing.report import TraceRun

    entry = setup.controller
    notes = setup.notes
    if isinstance(entry, ControllerEntry):
        notes += notes_of(entry, config.hand, config.object)
        notes += disturbance_notes(config, entry.reads, entry.contract)
    else:
        notes += disturbance_notes(config, entry.reads, space=True)
    followed, traces = run(config, setup)
    return TraceRun(config, setup, followed, traces, notes)
