"""Trials from the recording of a batch."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from inhand.control.catalogue import ControllerEntry
from inhand.control.loop import Recording
from inhand.control.spatial_catalogue import SpatialEntry
from inhand.control.spatial_trial import SpatialPassport, SpatialTrial
from inhand.control.trial import SHAPES, Passport, Trial
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.hand import SpatialHand, Vector
from inhand.hands.spatial.objects import SolidSpec
from inhand.sim.names import ENGINE
from inhand.sim.scene import SUBSTEPS, SceneSpec
from inhand.versions import versions


def passports(
    hand: HandSpec, spec: ObjectSpec, entry: ControllerEntry, *, seed: int, engine: str = ENGINE
) -> Callable[..., Passport]:
    """Return what makes the passports of a run's trials, given what `Passport` says of one, from `primitive` on."""
    made = partial(Passport, hand, spec, entry.name, reads=entry.reads, seed=seed, engine=engine)
    return partial(made, substeps=SUBSTEPS, timestep=SceneSpec.timestep, versions=versions())


def spatial_passports(
    hand: SpatialHand, spec: SolidSpec, entry: SpatialEntry, *, gravity: Vector, seed: int, engine: str
) -> Callable[..., SpatialPassport]:
    """Return the same of hands in space, given primitive, direction, axis, number and limit of a trial."""

    def made(
        primitive: str, along: Vector | None, about: Vector | None, trial: int, limit: float | None = None
    ) -> SpatialPassport:
        whose, steps = (hand, spec, entry.name, primitive, along, about, gravity, trial, seed), SceneSpec.timestep
        return SpatialPassport(*whose, SUBSTEPS, steps, versions(), engine, limit, entry.reads)

    return made


def cut_trials(recording: Recording, passports: Sequence[Passport], references: Array) -> tuple[Trial, ...]:
    """Return one trial for each world, up to its last state.

    The reference paths `(B, S, 3)` are relative to the start of manipulation.
    """
    parts = zip(passports, references, _cut(recording), strict=True)
    return tuple(Trial(passport=passport, reference=reference, **part) for passport, reference, part in parts)


def cut_spatial_trials(
    recording: Recording, passports: Sequence[SpatialPassport], references: Array
) -> tuple[SpatialTrial, ...]:
    """Return the same of hands in space, whose reference paths are `(B, S, 6)`."""
    parts = zip(passports, references, _cut(recording), strict=True)
    return tuple(SpatialTrial(passport=passport, reference=reference, **part) for passport, reference, part in parts)


def _cut(recording: Recording) -> Iterator[dict[str, Any]]:
    """Give of each world what was measured, up to its last state, and how it ended."""
    measured = [name for name in SHAPES if name not in {"phase", "reference"}]
    stacks = {name: np.stack([getattr(state, name) for state in recording.states]) for name in measured}
    for world, outcome in enumerate(recording.outcomes):
        rows = slice(0, int(recording.last[world]) + 1)
        arrays = {name: np.ascontiguousarray(stack[rows, world]) for name, stack in stacks.items()}
        yield {"outcome": outcome, "phases": recording.phases, "phase": recording.phase[rows]} | arrays
