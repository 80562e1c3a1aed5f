"""Trials from the recording of a batch."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np

from inhand.control.episode import SHAPES, Source
from inhand.control.loop import Recording
from inhand.geometry import Array
from inhand.sim.scene import SUBSTEPS, SceneSpec
from inhand.versions import versions

T = TypeVar("T")


def passports(kind: Callable[..., T], **told: object) -> Callable[..., T]:
    """Return what makes the passports of a run's trials: what is told is that of all, and each gets the rest."""
    return partial(kind, substeps=SUBSTEPS, timestep=SceneSpec.timestep, versions=versions(), **told)


def cut_trials(
    kind: Callable[..., T], recording: Recording, passports: Sequence[Source], references: Array
) -> tuple[T, ...]:
    """Return one trial of a kind for each world, up to its last state.

    The reference paths `(B, S, 3)`, in space `(B, S, 6)`, are relative to the start of manipulation.
    """
    parts = zip(passports, references, _cut(recording), strict=True)
    return tuple(kind(passport=passport, reference=reference, **part) for passport, reference, part in parts)


def _cut(recording: Recording) -> Iterator[dict[str, Any]]:
    """Give of each world what was measured, up to its last state, and how it ended."""
    measured = [name for name in SHAPES if name not in {"phase", "reference"}]
    stacks = {name: np.stack([getattr(state, name) for state in recording.states]) for name in measured}
    for world, outcome in enumerate(recording.outcomes):
        rows = slice(0, int(recording.last[world]) + 1)
        arrays = {name: np.ascontiguousarray(stack[rows, world]) for name, stack in stacks.items()}
        yield {"outcome": outcome, "phases": recording.phases, "phase": recording.phase[rows]} | arrays
