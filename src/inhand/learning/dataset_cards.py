"""What a dataset says of itself, and what it must have in common with the controller that learns from it."""

import re
from dataclasses import dataclass
from typing import overload

from inhand.errors import InputError
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.learning.worlds import Interface
from inhand.sim.disturbance import Disturbance
from inhand.sim.names import UNTOLD, Engine
from inhand.tasks.cards import InterfaceCard, differences, interface_card
from inhand.tasks.layouts import find_layout

OURS = "inhand"
"""Where our part of Minari's metadata is, and the namespace of our datasets."""
CONTINUOUS = "continuous"
"""The word for directions anywhere on the circle, in space on the sphere, but near the unseen ones."""
SPHERE = "sphere"
"""The word for gravity that each start has along a vector of its own."""


@dataclass(frozen=True)
class DatasetKind:
    """What a dataset and the controller that learns from it must have in common."""

    hand: HandSpec | SpatialHand
    interface: InterfaceCard
    """How a controller sees and acts."""
    actions: str
    """What actions mean: angles or steps."""
    horizon: int
    """Decisions after which an episode is cut off."""

    @property
    def size(self) -> int:
        """How many numbers an observation has."""
        return self.interface.size(self.hand.n_joints, len(self.hand.fingers))


@dataclass(frozen=True)
class DatasetHead:
    """Where a dataset comes from: enough to record it again."""

    kind: DatasetKind
    """Hand, observations, actions and horizon."""
    object: ObjectSpec | SolidSpec
    expert: str
    """Controller that demonstrates."""
    grasp: str
    """Grip of the starts: planned or rough."""
    reward: str
    directions: str
    """Words for the directions, or `CONTINUOUS`."""
    noise: tuple[float, float]
    """Standard deviations of the object's start [m] and [rad]."""
    push: float
    """Largest standard deviation of the noise on joint targets [rad]."""
    midway: float
    """Share of the episodes that start where an earlier one was under way."""
    whole: float
    """Share of the episodes that go as far as their grip reaches."""
    grip_spread: float
    """Standard deviation of the angle between a direction and the one whose grip is used [deg]."""
    seed: int
    versions: dict[str, str]
    """Versions of this package and of what it ran on."""
    engine: Engine = UNTOLD
    disturb: Disturbance | None = None
    """What disturbed its worlds; what it holds of them was seen through the same senses."""

    @property
    def dataset_id(self) -> str:
        """Minari's name for the dataset; of the object's name it takes letters, digits, `_` and `-` alone."""
        return f"{OURS}/{re.sub(r'[^-0-9A-Za-z_]', '_', self.object.name)}/{self.expert}-v0"


@dataclass(frozen=True)
class PlanarKind(DatasetKind):
    """The same of a hand in the plane, as files say it."""

    hand: HandSpec


@dataclass(frozen=True)
class PlanarHead(DatasetHead):
    """Where a dataset of a hand in the plane comes from."""

    kind: PlanarKind
    object: ObjectSpec


@dataclass(frozen=True)
class SpatialKind(DatasetKind):
    """What is in common of a hand in space."""

    hand: SpatialHand


@dataclass(frozen=True)
class SpatialHead(DatasetHead):
    """Where a dataset of a hand in space comes from."""

    kind: SpatialKind
    object: SolidSpec
    gravity: str = SPHERE
    """How the hand is held, by a word or a vector; `SPHERE` for every start in its own way."""


@overload
def kind_of(hand: HandSpec, interface: Interface) -> PlanarKind: ...
@overload
def kind_of(hand: SpatialHand, interface: Interface) -> SpatialKind: ...
def kind_of(hand: HandSpec | SpatialHand, interface: Interface) -> PlanarKind | SpatialKind:
    """Return the kind of dataset that a controller with a hand and an interface can learn from."""
    told = interface_card(find_layout(interface.observation), interface.actions), interface.actions, interface.horizon
    return SpatialKind(hand, *told) if isinstance(hand, SpatialHand) else PlanarKind(hand, *told)


def check_fits(head: DatasetHead, wanted: DatasetKind, world: tuple[ObjectSpec | SolidSpec, Engine, str]) -> None:
    """Refuse a dataset from which a controller of another kind is to learn.

    Args:
        head: the dataset's.
        wanted: the kind to learn from.
        world: the object, the engine and the name of the reward to learn with.

    Raises:
        InputError: the text tells every difference, observations part by part.
    """
    there = head.kind
    pairs = {
        "hand": (there.hand, wanted.hand),
        "object": (head.object, world[0]),
        "engine": (head.engine, world[1]),
        "reward": (head.reward, world[2]),
        "actions": (there.actions, wanted.actions),
        "horizon": (there.horizon, wanted.horizon),
    }
    lines = []
    for what, (old, new) in pairs.items():
        one, other = (getattr(each, "name", each) for each in (old, new))
        if old != new:
            lines.append(f"{what}: {one} there, {other}{' of other measures' if one == other else ''} here")
    lines += differences(there.interface, wanted.interface)
    if lines:
        raise InputError(
            f"dataset {head.dataset_id} is of another kind than what is to learn from it: record one with the settings"
            " here, or learn with those there\n" + "\n".join(f"  {line}" for line in lines)
        )
