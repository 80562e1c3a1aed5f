"""What the loop asks of a controller, and what a controller is told of its task."""

from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from inhand.control.seen import View
from inhand.geometry import Array, Path
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.rotations import SpatialPath
from inhand.sim.scene import SUBSTEPS, SceneSpec
from inhand.sim.state import State

H = TypeVar("H", HandSpec, SpatialHand)
S = TypeVar("S", ObjectSpec, SolidSpec)
P = TypeVar("P", Path, SpatialPath)


@dataclass(frozen=True)
class Carrying(Generic[H, S, P]):
    """What a batch of B worlds has to do: carry the object along a path each."""

    hand: H
    """The hand of every world."""
    objects: tuple[S, ...]
    """The object of each world."""
    path: P
    """Object poses relative to `start`, along palm axes, S of them for each world."""
    timestep: float = SceneSpec.timestep
    """Physics step [s]."""
    substeps: int = SUBSTEPS
    """Physics steps for one decision."""
    distance: Array | None = None
    """Way along each path to go at most `(B,)` [m], planned by the caller; None for as far as the grip can follow."""
    risk: Array | None = None
    """Risk that is not taken beyond such a way `(B,)`; None for ways that end where they were planned to."""
    start: Array | None = None
    """Pose that each path counts from, as `origin` has it; None for where the object is when its controller begins."""

    @property
    def control_period(self) -> float:
        """Time between two decisions [s]."""
        return self.substeps * self.timestep

    @property
    def n_worlds(self) -> int:
        """Number of worlds B."""
        return len(self.objects)


@dataclass(frozen=True)
class Task(Carrying[HandSpec, ObjectSpec, Path]):
    """The task of a hand in the plane."""

    def origin(self, state: State) -> Array:
        """Return the poses `(B, 3)` that the paths of a controller count from which begins in a state."""
        return state.pose if self.start is None else self.start


@dataclass(frozen=True)
class SpatialTask(Carrying[SpatialHand, SolidSpec, SpatialPath]):
    """The task of a hand in space."""

    gravity: Array = field(kw_only=True)
    """Gravity in the palm frame `(B, 3)` [m/s^2]."""

    def origin(self, state: State) -> Array:
        """Return the poses `(B, 7)` that the paths of a controller count from which begins in a state."""
        return state.object_pose if self.start is None else self.start


AnyPath: TypeAlias = Path | SpatialPath
"""A path for each world, in the plane or in space."""
AnyTask: TypeAlias = Task | SpatialTask
"""What a batch has to do, in the plane or in space."""


class Controller(Protocol):
    """Turns what is seen of a batch into joint targets.

    It sees a `State`; a class attribute `reads = "sensed"` says that it sees a `Seen`, what a hand can know.
    """

    def begin(self, state: View) -> None:
        """Start a phase from what is seen."""

    def act(self, state: View) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""

    def finished(self, state: View) -> NDArray[np.bool_]:
        """Return which worlds have done what the controller was for `(B,)`."""
