"""What a decision of a batch of worlds of learning led to."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.sim.state import State


@dataclass(frozen=True, eq=False)
class Step:
    """What one decision of B worlds led to."""

    observation: Array
    """Observations to decide on next `(B, d + c)`: of the new episode where one has ended; c are what critics see."""
    successor: Array
    """Observations of the states the decision led to `(B, d + c)`."""
    reward: Array
    """Rewards `(B,)`."""
    terms: dict[str, Array]
    """The reward's weighted terms by name `(B,)`."""
    terminated: NDArray[np.bool_]
    """Whether the object was lost `(B,)`."""
    truncated: NDArray[np.bool_]
    """Whether the horizon was reached `(B,)`."""
    shift: Array
    """Way along, way to the left [m] and angle turned [rad] since the primitive started, or along, beside and away from
    a route `(B, 3)`."""
    after: State
    """The state the decision led to; the object's pose there hindsight takes for a goal."""
