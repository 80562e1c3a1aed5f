"""What is to be demonstrated: how, in which directions, and what is seen, done and paid for."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from inhand.geometry import Array
from inhand.hands.fit import Held
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.hand import SpatialHand, Vector
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.pair import SpatialPair
from inhand.learning.starts import Noise, grid_of
from inhand.learning.worlds import Interface
from inhand.records import Config
from inhand.sim.disturbance import Disturbance
from inhand.sim.names import ENGINE, SPATIAL, Engine
from inhand.tasks.primitives import UNSEEN
from inhand.tasks.spatial.primitives import DIRECTIONS, TURNS, SpatialPrimitive

SEEN = (*DIRECTIONS, *TURNS)
"""Primitives in space that evaluations count as shown."""


@dataclass(frozen=True)
class Recipe(Config):
    """How demonstrations are made."""

    episodes: int = 5000
    """Number of episodes (thesis 3.3.4 keeps 5,000 of the expert)."""
    expert: str = "ik"
    """Who demonstrates: ik, ik-cautious, thesis-ik, or teacher, mild-teacher or soft-teacher, which know all worlds; of
    hands in space ik or teacher."""
    push: float = 0.01
    """Largest standard deviation of the noise added to joint targets [rad]; each episode draws its own up to it."""
    midway: float = 0.25
    """Share of the episodes that start where an earlier one was under way, in a new direction."""
    grasp: Literal["planned", "rough", "sensed"] = "planned"
    """Grip of the starts: planned for each direction; rough, on the middle of the object's sides (thesis 3.2); or
    sensed, one of several for each direction that are planned for less friction than is told too."""
    whole: float = 1.0
    """Share of the episodes that go as far as their grip reaches; the others stop somewhere before."""
    grip_spread: float = 0.0
    """Standard deviation of the angle between an episode's direction and the one whose grip it starts with [deg]."""
    turns: float = 0.0
    """Share of the episodes that turn the object on the spot instead (the teacher's)."""
    legs: float = 0.0
    """Share of the episodes in which primitive follows primitive, as in a sequence (the teacher's)."""
    palms: float = 0.25
    """Share of the gravities that are those of the palms, up, down and sideways; the others are drawn (in space)."""
    steered: float = 0.15
    """Share of the episodes that the expert steers where it labels those of an actor."""

    def shares(self, count: int, rng: np.random.Generator) -> Array:
        """Return the shares of the way that their grips reach which so many episodes are told to go `(count,)`."""
        return np.where(rng.random(count) < self.whole, 1.0, rng.random(count))


@dataclass(frozen=True)
class Recording:
    """What is to be recorded."""

    hand: HandSpec
    object: ObjectSpec
    angles_deg: tuple[float, ...]
    """Directions, drawn evenly [deg]."""
    recipe: Recipe
    interface: Interface
    """What is seen, done and rewarded."""
    noise: Noise
    seed: int
    engine: Engine = ENGINE
    continuous: bool = False
    """Whether half of the directions are drawn anywhere on the circle but near the 8 unseen ones."""
    held_out: float = 5.0
    """Half width of the sectors about those that are left out [deg]."""
    task: str = ""
    """Whole task to show instead of directions."""
    disturb: Disturbance | None = None
    """What disturbs the worlds, each of which an episode has for itself."""

    @property
    def held(self) -> Held:
        """The hand and the object."""
        return Held(self.hand, self.object)

    @property
    def grid(self) -> tuple[float, ...]:
        """Directions that grasps are planned for [deg]."""
        anywhere = self.continuous or self.recipe.grip_spread > 0
        return grid_of(np.arange(0.0, 360.0) if anywhere else np.array(self.angles_deg))

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Return drawn directions `(count,)` [deg]."""
        named = np.asarray(rng.choice(np.array(self.angles_deg), count))
        if not self.continuous:
            return named
        anywhere = 360.0 * rng.random((20, count))
        allowed = from_unseen(anywhere) >= self.held_out
        found = np.where(allowed.any(axis=0), anywhere[allowed.argmax(axis=0), np.arange(count)], named)
        return np.where(rng.random(count) < 0.5, named, found)


@dataclass(frozen=True)
class SpatialRecording:
    """What is to be recorded with a hand in space."""

    held: SpatialPair
    primitives: tuple[SpatialPrimitive, ...]
    """Directions and turns, drawn evenly."""
    recipe: Recipe
    interface: Interface
    """What is seen, done and rewarded."""
    noise: Noise
    seed: int
    drawn: int = 0
    """Directions drawn on the sphere beside the primitives, and half as many axes to turn about."""
    held_out: float = 5.0
    """Half width of the cones about directions that are never shown, which drawn ones leave out [deg]."""
    gravity: Vector | None = None
    """Gravity in the palm frame [m/s^2]; None draws one for each start."""
    disturb: Disturbance | None = None
    """What disturbs the worlds, each of which an episode has for itself."""

    @property
    def hand(self) -> SpatialHand:
        """The hand."""
        return self.held.hand

    @property
    def object(self) -> SolidSpec:
        """The object."""
        return self.held.object

    @property
    def engine(self) -> Engine:
        """The engine of hands in space."""
        return SPATIAL


AnyRecording: TypeAlias = Recording | SpatialRecording
"""What is to be recorded, in the plane or in space."""


def from_unseen(angle_deg: Array) -> Array:
    """Return how far directions [deg] are from the nearest of the 8 unseen ones [deg]."""
    unseen = np.array([primitive.angle_deg for primitive in UNSEEN])
    return np.asarray(np.abs((angle_deg[..., None] - unseen + 180.0) % 360.0 - 180.0).min(axis=-1))
