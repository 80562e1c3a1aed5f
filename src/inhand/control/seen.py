"""What a hand can know of its worlds: the view of controllers that read no more than that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.sim.state import State

Reads = Literal["privileged", "sensed"]
"""What a controller reads: all that is measured in the simulation, or what a hand can know."""
PRIVILEGED: Reads = "privileged"
SENSED: Reads = "sensed"


View: TypeAlias = Any
"""What a controller sees: a `State` where it is privileged, a `Seen` where it is not."""


class NotSensedError(InputError, AttributeError):
    """A controller that reads what is sensed asked for what no hand can know."""


@dataclass(frozen=True)
class Seen:
    """What is sensed of B worlds with n joints at one decision, in the palm frame and SI units."""

    time: Array
    """The hand's own clock `(B,)` [s]."""
    joint_angles: Array
    """What the encoders read `(B, n)` [rad]."""
    joint_velocities: Array
    """Differences of two readings, over the time between them `(B, n)` [rad/s]; exact where encoders are."""
    targets: Array
    """The commands that were last given `(B, n)` [rad]."""
    frame_pose: Array
    """The object's pose in the camera's last frame `(B, 3)` [m, m, rad], in space `(B, 7)`: place and quaternion."""
    frame_time: Array
    """When that frame was taken, by the hand's clock `(B,)` [s]."""

    @property
    def age(self) -> Array:
        """How old the last frame is `(B,)` [s]."""
        return self.time - self.frame_time

    @property
    def n_worlds(self) -> int:
        """Number of worlds B."""
        return len(self.time)

    def select(self, worlds: NDArray[np.int64] | NDArray[np.bool_]) -> Seen:
        """Return what is sensed of some worlds alone."""
        return Seen(**{name: values[worlds] for name, values in vars(self).items()})

    def __getattr__(self, name: str) -> NoReturn:
        """Refuse what is not sensed.

        Raises:
            NotSensedError: also an InputError.
        """
        if name.startswith("__"):
            raise AttributeError(name)
        known = (*Seen.__annotations__, "age", "n_worlds")
        raise NotSensedError(
            f"{name} is not sensed{near_matches(name, known)}: a controller with reads = 'sensed' knows"
            f" {', '.join(known)}; one that needs more must say reads = 'privileged'"
        )


def exact(state: State) -> Seen:
    """Return what is sensed where all senses are exact and nothing is late."""
    velocities = state.joint_velocities
    return Seen(state.time, state.joint_angles, velocities, state.targets, state.pose, state.time)


def reads_of(controller: object) -> Reads:
    """Return what a controller, or its class, says that it reads; privileged where it says nothing.

    Raises:
        InputError: another word.
    """
    found = getattr(controller, "reads", PRIVILEGED)
    if found not in (PRIVILEGED, SENSED):
        raise InputError(f"reads = {found!r}: a controller reads '{PRIVILEGED}' or '{SENSED}'")
    return SENSED if found == SENSED else PRIVILEGED
