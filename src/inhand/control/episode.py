"""What is measured in an episode of any hand, and what every trial says of where it comes from."""

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.sim.disturbance_files import NONE
from inhand.sim.drawn import Disturbed
from inhand.sim.names import UNTOLD
from inhand.sim.state import CONTACT_TOLERANCE

MANIPULATE = "manipulate"
"""Name of the phase that metrics measure (thesis 3.4)."""
TWIST = "twist"
"""Name of the phase before it in which the object is turned on the spot."""

DEEP_MM = 0.5
"""Overlap above which a contact is softer than a hand's is [mm]: guessed, where reports of simulated hands draw it."""


@dataclass(frozen=True, kw_only=True)
class Source:
    """Where a trial comes from: enough to run it again."""

    hand: Any
    object: Any
    controller: str
    """Name of the controller that manipulates."""
    primitive: str
    trial: int
    """Number of the trial in its direction, from 1."""
    seed: int
    substeps: int
    """Physics steps between two rows."""
    timestep: float
    """Physics step [s]."""
    versions: dict[str, str]
    """Versions of this package and of what it ran on."""
    engine: str = UNTOLD
    limit: float | None = None
    """How far the hand could carry the object along the primitive [m], or turn it [rad]; None where unknown."""
    reads: str = "privileged"
    """What the controller reads: privileged, or sensed where it knows no more than a hand can."""
    disturbed: Disturbed | None = None
    """How its world was disturbed, with all that was drawn; None where nothing was. Hand and object are those that the
    controller was told."""

    @property
    def disturb(self) -> str:
        """Name of what disturbed its world; none where nothing did."""
        return NONE if self.disturbed is None else self.disturbed.spec.name

    @property
    def settings(self) -> tuple[str, ...]:
        """Hand, object, controller, engine and disturbance by their names."""
        return self.hand.name, self.object.name, self.controller, self.engine, self.disturb

    @property
    def period(self) -> float:
        """Time between two rows [s]."""
        return self.substeps * self.timestep

    def __post_init__(self) -> None:
        """Refuse what no trial has."""
        for name in ("trial", "substeps", "timestep"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} is {getattr(self, name)}; it must be above 0")


P = TypeVar("P", bound=Source)


@dataclass(frozen=True, eq=False)
class Episode(Generic[P]):
    """What is measured in one recorded episode of T rows, in the palm frame and SI units."""

    passport: P
    """Where it comes from."""
    outcome: str
    """How it ended, one of `OUTCOMES`."""
    phases: tuple[str, ...]
    """Names of the phases in their order."""
    phase: NDArray[np.int64]
    """The phase of each row `(T,)`, an index into `phases`."""
    time: Array
    """Simulated time `(T,)` [s]."""
    object_pose: Array
    """Object poses `(T, 7)`: position [m], quaternion w x y z."""
    joint_angles: Array
    """Joint angles `(T, n)` [rad]."""
    targets: Array
    """Commanded joint angles `(T, n)` [rad]."""
    gaps: Array
    """Distance of each finger to the object `(T, F)` [m]."""
    contact_links: NDArray[np.int64]
    """Link of each finger nearest to the object `(T, F)`."""
    finger_points: Array
    """Nearest points of the fingers `(T, F, 3)` [m]."""
    object_points: Array
    """Nearest points of the object `(T, F, 3)` [m]."""
    forces: Array
    """Force of each finger on the object during the physics step before each row `(T, F, 3)` [N]."""
    penetration: Array
    """Deepest overlap of a link and the object `(T,)` [m]."""
    reference: Array
    """The reference path `(S, 3)` relative to the start of manipulation, in palm axes [m, m, rad]; in space `(S, 6)`,
    positions [m] and rotation vectors [rad]."""

    @property
    def label(self) -> tuple[str, int]:
        """Its primitive, and its number in that direction."""
        return self.passport.primitive, self.passport.trial

    @property
    def manipulation(self) -> slice:
        """Rows of the manipulation phase; empty where the grasp failed."""
        if MANIPULATE not in self.phases:
            raise InputError(
                f"no phase is called {MANIPULATE!r}, only {', '.join(self.phases)}; metrics measure that one"
            )
        rows = np.flatnonzero(self.phase == self.phases.index(MANIPULATE))
        return slice(int(rows[0]), int(rows[-1]) + 1) if len(rows) else slice(len(self.time), len(self.time))

    @property
    def onset(self) -> int:
        """Row where manipulation begins, or the last one where the grasp failed."""
        return min(int(self.manipulation.start), len(self.time) - 1)

    @property
    def grasped(self) -> int:
        """Row at which the object is held and nothing has moved yet: the start of the twist or of manipulation."""
        held = [self.phases.index(name) for name in (TWIST, MANIPULATE) if name in self.phases]
        return int(np.argmax(np.isin(self.phase, held)))

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Whether each finger touches the object `(T, F)`."""
        return self.gaps <= CONTACT_TOLERANCE

    @property
    def force_max_n(self) -> float:
        """Largest force of a finger on the object in any row [N]."""
        return float(np.linalg.norm(self.forces, axis=-1).max())

    @property
    def penetration_max_mm(self) -> float:
        """Deepest overlap of a link and the object in any row [mm]."""
        return 1e3 * float(self.penetration.max())

    @property
    def penetration_mean_mm(self) -> float:
        """Mean over time of the deepest overlap while the object is manipulated [mm]; 0 where it never was."""
        held = self.penetration[self.manipulation]
        return 1e3 * float(held.mean()) if len(held) else 0.0

    @property
    def penetration_share(self) -> float:
        """Share of that time in which it is more than `DEEP_MM`."""
        held = self.penetration[self.manipulation]
        return float((1e3 * held > DEEP_MM).mean()) if len(held) else 0.0


SHAPES: dict[str, tuple[str | int, ...]] = {
    "phase": ("T",),
    "time": ("T",),
    "object_pose": ("T", 7),
    "joint_angles": ("T", "n"),
    "targets": ("T", "n"),
    "gaps": ("T", "F"),
    "contact_links": ("T", "F"),
    "finger_points": ("T", "F", 3),
    "object_points": ("T", "F", 3),
    "forces": ("T", "F", 3),
    "penetration": ("T",),
    "reference": ("S", 3),
}
"""Shapes of a trial's arrays: T rows, n joints, F fingers, S way-points; in space paths have rows of six."""
