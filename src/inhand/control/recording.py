"""Trials from the recording of a batch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from inhand.control.controller import SUBSTEPS
from inhand.control.loop import Recording
from inhand.control.trial import Passport, Trial
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.model import SceneSpec
from inhand.sim.names import MUJOCO, Engine
from inhand.versions import versions

_STATE_FIELDS = (
    "time",
    "object_pose",
    "joint_angles",
    "targets",
    "gaps",
    "contact_links",
    "finger_points",
    "object_points",
    "forces",
    "penetration",
)


def passports(
    hand: HandSpec, spec: ObjectSpec, controller: str, *, seed: int, engine: Engine = MUJOCO
) -> Callable[..., Passport]:
    """Return what makes the passports of a run's trials, given what `Passport` says of one, from `primitive` on.

    Args:
        hand: the hand.
        spec: the object.
        controller: name of the controller.
        seed: of the run.
        engine: the physics engine.
    """
    made = partial(Passport, hand, spec, controller, seed=seed, engine=engine)
    return partial(made, substeps=SUBSTEPS, timestep=SceneSpec.timestep, versions=versions())


def cut_trials(recording: Recording, passports: Sequence[Passport], references: Array) -> tuple[Trial, ...]:
    """Return one trial for each world, up to its last state.

    Args:
        recording: what the loop left.
        passports: where each world's trial comes from.
        references: reference paths `(B, S, 3)` relative to the start of manipulation.
    """
    stacks = {name: np.stack([getattr(state, name) for state in recording.states]) for name in _STATE_FIELDS}
    trials = []
    for world, passport in enumerate(passports):
        rows = slice(0, int(recording.last[world]) + 1)
        arrays = {name: np.ascontiguousarray(stack[rows, world]) for name, stack in stacks.items()}
        trials.append(
            Trial(
                passport=passport,
                outcome=recording.outcomes[world],
                phases=recording.phases,
                phase=recording.phase[rows],
                reference=references[world],
                **arrays,
            )
        )
    return tuple(trials)
