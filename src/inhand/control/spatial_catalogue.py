"""Controllers of hands in space by name: how each prepares a grasp, and what it manipulates with."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from inhand.control.controller import Controller, SpatialTask
from inhand.control.loop import Bench
from inhand.control.phases import Grasp
from inhand.control.seen import PRIVILEGED, Reads
from inhand.control.spatial_ik import SpatialIkController
from inhand.control.spatial_rehearsal import planned_in_space
from inhand.errors import InputError, near_matches
from inhand.geometry import Array
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.tasks.spatial.paths import SpatialReference


class SpatialPlanner(Protocol):
    """Chooses a grasp for every path."""

    def __call__(
        self,
        hand: SpatialHand,
        spec: SolidSpec,
        paths: Sequence[SpatialReference],
        gravity: Array,
        starts: Array,
        *,
        bench: Bench,
        fixed: bool = False,
    ) -> Grasp:
        """Return a grasp for every path, of objects that start at `starts` `(B, 7)` under gravities `(B, 3)`.

        Paths count from where their objects stand, or, if they are `fixed`, from where the hand starts them.
        """


@dataclass(frozen=True)
class SpatialEntry:
    """One controller of hands in space."""

    name: str
    """What the command line calls it."""
    summary: str
    """One line for lists."""
    grasp: SpatialPlanner
    """Chooses where the fingers hold the object."""
    manipulate: Callable[[SpatialTask], Controller]
    """Makes the controller of the manipulation phase."""
    reads: Reads = PRIVILEGED
    """What it reads."""


CONTROLLERS = {
    "ik": SpatialEntry(
        "ik",
        "the expert: searched contacts, forces that hold the weight, feedback on the object's pose",
        planned_in_space,
        SpatialIkController,
    )
}
"""Controllers of hands in space."""


def find_spatial_controller(name: str) -> SpatialEntry:
    """Return a controller of hands in space.

    Raises:
        InputError: there is none of that name.
    """
    if name not in CONTROLLERS:
        raise InputError(
            f"controller {name!r} with a hand in space{near_matches(name, CONTROLLERS)}; allowed are"
            f" {', '.join(CONTROLLERS)}: learned policies and the others are of hands in the plane"
        )
    return CONTROLLERS[name]
