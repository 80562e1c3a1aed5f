"""Tracing as a function: what to draw or do in, a finished run out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from inhand.control.catalogue import CONTROLLERS, notes_of
from inhand.hands.files import HANDS, OBJECTS
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.tracing.config import TraceConfig
from inhand.tracing.follow import Followed
from inhand.tracing.report import TraceRun
from inhand.tracing.run import TraceSetup, prepare_trace, simulate_trace
from inhand.tracing.trace import Trace

DEFAULT = TraceConfig()
"""What is traced where nothing else is asked for."""
Simulate = Callable[[TraceConfig, TraceSetup], tuple[tuple[Followed, ...], tuple[Trace, ...]]]
"""Runs a setup; the command line shows how far it is."""


def trace(
    path: str | Path = DEFAULT.path,
    hand: str | Path | HandSpec = DEFAULT.hand,
    object: str | Path | ObjectSpec = DEFAULT.object,
    controller: object = DEFAULT.controller,
    *,
    size: float | None = None,
    scale: bool = False,
    trials: int = DEFAULT.trials,
    seed: int = DEFAULT.seed,
    noise_mm: float = DEFAULT.noise_mm,
    noise_deg: float = DEFAULT.noise_deg,
) -> TraceRun:
    """Trace a drawing or do a task and return its trials, table and figure; nothing is written before `save`.

    Args:
        path: a shape, a letter, an SVG or CSV file, or a task.
        hand: a name, a TOML file or a spec.
        object: a name, a TOML file or a spec.
        controller: a name, the folder of a training, `FILE.py:NAME`, or a class of yours.
        size: larger side of the drawing [mm]; None as `inhand trace` chooses it.
        scale: whether a drawing that is too large is scaled down.
        trials: how many.
        seed: of the start noise and of what tasks draw.
        noise_mm: standard deviation of the object's start in x and y [mm].
        noise_deg: standard deviation of its rotation [deg].

    Raises:
        InputError: anything that cannot be run; the text says what, and what is allowed.
    """
    config = TraceConfig(
        path=str(path),
        size=size,
        scale=scale,
        controller=CONTROLLERS.name_of(controller),
        hand=HANDS.name_of(hand),
        object=OBJECTS.name_of(object),
        trials=trials,
        seed=seed,
        noise_mm=noise_mm,
        noise_deg=noise_deg,
    )
    return run_trace(config)


def run_trace(
    config: TraceConfig,
    prepare: Callable[[TraceConfig], TraceSetup] = prepare_trace,
    run: Simulate = simulate_trace,
    check: Callable[[], None] | None = None,
) -> TraceRun:
    """Return the finished run of a configuration.

    Args:
        config: what to run.
        prepare: returns its setup.
        run: runs the checked setup.
        check: looks at what else must be right before anything is simulated, such as the folder to write to.

    Raises:
        InputError: anything in the configuration that cannot be run.
    """
    setup = prepare(config)
    if check is not None:
        check()
    followed, traces = run(config, setup)
    notes = (*setup.notes, *notes_of(setup.controller, config.hand, config.object))
    return TraceRun(config, setup, followed, traces, notes)
