"""What surrounds hand and object in every engine: the physics step, the floor, gravity and walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inhand.errors import InputError
from inhand.sim.walls import Wall


def scene_of_each(objects: Sequence[object], scenes: SceneSpec | Sequence[SceneSpec] | None) -> list[SceneSpec]:
    """Return what surrounds each object: the standard scene, one scene for all, or one for each.

    Raises:
        InputError: no objects, another number of scenes, or scenes of different timesteps.
    """
    if not objects:
        raise InputError("no objects given; a simulator needs one object for each world")
    scene = SceneSpec() if scenes is None else scenes
    found = [scene] * len(objects) if isinstance(scene, SceneSpec) else list(scene)
    if len(found) != len(objects):
        raise InputError(f"{len(found)} scenes for {len(objects)} objects; give one for all or one each")
    if len({each.timestep for each in found}) > 1:
        raise InputError("scenes of a different timestep in one simulator; use one simulator for each")
    return found


SUBSTEPS = 5
"""Physics steps for one decision: 0.02 s, guessed (the thesis's physics steps take 4 ms)."""
PALM_UP = (0.0, 0.0, -9.81)
"""Gravity in the palm frame of a hand in space whose palm looks up [m/s^2]."""
FAR = 1.0
"""Distances beyond this read as this [m]; larger than any hand."""


@dataclass(frozen=True)
class SceneSpec:
    """What surrounds hand and object."""

    timestep: float = 0.004
    """Physics step [s] (thesis 3.4)."""
    floor_friction: float = 0.2
    """Friction coefficient of the plane (the laboratory's RL setting)."""
    gravity: float = 9.81
    """Gravity along -z [m/s^2]."""
    walls: tuple[Wall, ...] = ()
    """Fixed walls, which object and links run against; none may stand in the object."""
    pull: tuple[float, float, float] | None = None
    """Gravity in the palm frame [m/s^2] of a hand in space, which has no floor; None for a palm that looks up."""

    def __post_init__(self) -> None:
        """Refuse surroundings that no simulation has."""
        if not (np.isfinite(self.timestep) and self.timestep > 0):
            raise InputError(f"timestep {self.timestep:g} s: a physics step must be positive")
        if not (np.isfinite(self.floor_friction) and self.floor_friction >= 0):
            raise InputError(f"floor_friction {self.floor_friction:g}: friction must be 0 or more")
        if self.pull is not None and not np.isfinite(self.pull).all():
            raise InputError(f"pull {self.pull} m/s^2: gravity needs three finite numbers")
        if not np.isfinite(self.gravity):
            raise InputError(f"gravity {self.gravity:g} m/s^2: it must be a finite number")


DECISION_S = SUBSTEPS * SceneSpec.timestep
"""Time between two decisions in the standard scene [s]."""
