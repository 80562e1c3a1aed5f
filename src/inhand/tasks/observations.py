"""What a learned controller is asked and sees: an aim, and named parts of a `State` in order, each scaled to [-1, 1].

Two layouts: `thesis` is table 3.1 of the thesis; `grip` tells position along and across the primitive and adds what
holding and stopping depend on: velocities, commands and contact points. What a hand can know is in `tasks/past.py`. A
change of a layout takes a new name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import TURN_ARM, Array, chain, inverse_transform, perpendicular, unit, wrap_angle
from inhand.hands.hand import HandSpec
from inhand.sim.state import State
from inhand.tasks.hand_arrays import SLOTS, HandArrays, arrays_of

View: TypeAlias = Any
"""What a layout is of: a `State`, or a `Past` where it is of what is sensed."""
AnyHand: TypeAlias = Any
AnyAim: TypeAlias = Any
"""A hand in the plane or in space, and what is asked of it: an `Aim` or a `SpatialAim`."""
DRAWN = 9
"""Numbers that are drawn of a world and that holding depends on."""
LARGEST_SIZE = 0.12
"""Object sizes are normalised over 0 to this [m], guessed: more than the catalogue's hands can hold."""


@dataclass(frozen=True)
class Aim:
    """The primitive of each of B worlds: a direction, and the pose from which it starts."""

    KEPT: ClassVar[tuple[str, ...]] = ("angle", "start", "distance", "turn")
    """What tells one primitive from another."""

    angle: Array
    """Direction `(B,)`, counter-clockwise from +x [rad]."""
    start: Array
    """Pose of the object where the primitive starts, in the palm frame `(B, 3)` [m, m, rad]."""
    distance: Array | float = np.inf
    """Way along the direction at which the object is to stay `(B,)` [m]; infinite where none was given."""
    share: Array | float = 0.0
    """Share of a whole route that the object has come `(B,)`; 0 of a primitive."""
    end: Array | None = None
    """Pose at the end of a whole route, in the palm frame `(B, 3)`; None of a primitive."""
    turn: Array | float = 0.0
    """Side to which the object is to turn on the spot `(B,)`, 1 counter-clockwise and -1 clockwise; 0 where it is to
    move along a direction."""

    @staticmethod
    def where(state: State) -> Array:
        """Return the poses `(B, 3)` of a state that shifts are of."""
        return state.pose

    @cached_property
    def direction(self) -> Array:
        """Unit vectors along the directions `(B, 2)`."""
        return unit(self.angle)

    @cached_property
    def heading(self) -> Array:
        """The same, 0 where the object is to turn `(B, 2)`."""
        return np.where(np.broadcast_to(self.turn, self.angle.shape)[:, None] == 0, self.direction, 0.0)

    def shift(self, pose: Array) -> Array:
        """Return the way along the direction, the way to its left [m] and the angle turned [rad] of poses `(B, 3)`."""
        moved, (x, y) = pose - self.start, self.direction.T
        shift = np.empty(moved.shape)
        shift[:, 0] = moved[:, 0] * x + moved[:, 1] * y
        shift[:, 1] = moved[:, 1] * x - moved[:, 0] * y
        shift[:, 2] = wrap_angle(moved[:, 2])
        return shift

    def come(self, shift: Array) -> Array:
        """Return the way along what is asked of shifts `(B, 3)` [m]; an angle turned counts as an arc at `TURN_ARM`."""
        return np.where(self.turn == 0, shift[:, 0], TURN_ARM * self.turn * shift[:, 2])

    def off(self, shift: Array) -> tuple[Array, Array]:
        """Return how far shifts `(B, 3)` are off what is asked [m], and turned from it [rad], each `(B,)`."""
        across = np.where(self.turn == 0, np.abs(shift[:, 1]), np.hypot(shift[:, 0], shift[:, 1]))
        return across, np.where(self.turn == 0, np.abs(shift[:, 2]), 0.0)

    def left(self, pose: Array) -> Array:
        """Return the way that poses `(B, 3)` are from where the object is to stay `(B,)` [m]."""
        return np.asarray(self.distance - self.come(self.shift(pose)))

    def take(self, rows: NDArray[np.int64]) -> Aim:
        """Return what is asked of some worlds; of primitives alone."""
        distance, turn = (np.broadcast_to(each, self.angle.shape)[rows] for each in (self.distance, self.turn))
        return Aim(self.angle[rows], self.start[rows], distance, turn=turn)

    def goal(self, distance: Array | float) -> Array:
        """Return the poses `(B, 3)` at a distance [m] along the primitives."""
        way = np.broadcast_to(distance, self.angle.shape)[:, None] * self.direction
        return np.concatenate([self.start[:, :2] + way, self.start[:, 2:]], axis=-1)


@dataclass(frozen=True)
class Scene:
    """What stays the same while a batch runs."""

    hand: AnyHand
    objects: tuple[Any, ...]
    """The object of each world."""
    drawn: Array | None = None
    """What is drawn of each world, as numbers `(B, DRAWN)`; None where nothing is."""
    told: HandArrays | None = None
    """Each world's hand and object as arrays where hands differ; None where all have `hand`."""
    gravity: Array | None = None
    """Gravity of each world in the palm frame of a hand in space `(B, 3)` [m/s^2]."""

    @cached_property
    def arrays(self) -> HandArrays:
        """Each world's hand and object as arrays."""
        return self.told or arrays_of((self.hand,) * len(self.objects), self.objects)


OfHand = float | tuple[float, ...] | Callable[[HandSpec], Array | float]
"""A number, numbers, or what gives them for a hand."""


@dataclass(frozen=True)
class Part:
    """Some neighbouring numbers of an observation."""

    name: str
    """What they are, and their unit before they are scaled."""
    values: Callable[[View, AnyAim, Scene], Array]
    """Gives them `(B, size)`."""
    half: OfHand
    """How far from the middle becomes 1."""
    middle: OfHand = 0.0
    """What becomes 0."""
    fixed: int = 0
    """How many they are with every hand,"""
    for_joint: int = 0
    """how many more for each joint,"""
    for_finger: int = 0
    """and for each finger."""

    def size(self, hand: AnyHand) -> int:
        """Return how many numbers they are with a hand."""
        return int(self.fixed + self.for_joint * hand.n_joints + self.for_finger * len(hand.fingers))


@dataclass(frozen=True)
class Layout:
    """The parts of an observation in their order."""

    name: str
    """Name, which changes with the parts."""
    parts: tuple[Part, ...]
    sensed: bool = False
    """Whether they are of what is sensed, a `Past`, instead of a `State`."""
    columns: int = 0
    """Numbers of each joint's slot (`tasks/hand_arrays.py`), column by column at first; 0 where it has no slots."""
    space: bool = False
    """Whether they are of hands in space."""

    def size(self, hand: AnyHand) -> int:
        """Return how many numbers an observation has."""
        return sum(part.size(hand) for part in self.parts)

    def actions(self, hand: AnyHand) -> int:
        """Return how many numbers an action has."""
        return SLOTS if self.columns else int(hand.n_joints)


def observe(layout: Layout, state: View, aim: AnyAim, scene: Scene) -> Array:
    """Return the observations of a batch `(B, size)`, cut to [-1, 1]."""
    hand = scene.hand
    parts = [
        (part.values(state, aim, scene) - numbers_for(part.middle, hand)) / numbers_for(part.half, hand)
        for part in layout.parts
    ]
    return np.clip(np.concatenate(parts, axis=-1), -1.0, 1.0)


def numbers_for(given: OfHand, hand: AnyHand) -> Array:
    """Return a scale or a middle with a hand."""
    return np.asarray(given(hand) if callable(given) else given)


def reach_of(hand: HandSpec) -> float:
    """Return how far from the palm's middle a fingertip can come [m]."""
    return float(max(abs(finger.base[0]) + finger.length for finger in hand.fingers))


def by_rank(hand: AnyHand) -> list[int]:
    """Return the joints in the order of table 3.1: the proximal ones, finger by finger, then the next."""
    count = max(len(finger.links) for finger in hand.fingers)
    return [place.start + k for k in range(count) for place in hand.slices if place.start + k < place.stop]


def _link_ends(state: State, _aim: Aim, scene: Scene) -> Array:
    """Ends of the links: the next joint or the fingertip. The proximal joints themselves never move."""
    hand = scene.hand
    ends = [
        chain(finger.base, finger.links, state.joint_angles[:, place])[:, 1:]
        for finger, place in zip(hand.fingers, hand.slices, strict=True)
    ]
    ranked = np.concatenate(ends, axis=1)[:, by_rank(hand)]
    return ranked.reshape(len(ranked), -1)


def _velocity(state: State, aim: Aim, _scene: Scene) -> Array:
    direction, linear = aim.direction, state.object_velocity[:, :2]
    return np.stack([(linear * direction).sum(-1), (linear * perpendicular(direction)).sum(-1)], axis=-1)


def _contacts(state: State, _aim: Aim, _scene: Scene) -> Array:
    """Where each finger touches the object, in the object's frame."""
    points = inverse_transform(state.pose[:, None], state.object_xy)
    return points.reshape(state.n_worlds, -1)


def _end(aim: Aim) -> Array:
    if aim.end is None:
        raise InputError("observation 'whole' tells the end of a whole task and primitives have none: use 'grip'")
    return aim.end


THESIS = Layout(
    "thesis-1",
    (
        Part("direction [rad]", lambda _state, aim, _scene: wrap_angle(aim.angle)[:, None], np.pi, fixed=1),
        Part(
            "object position x, y [m]",
            lambda state, _aim, _scene: state.pose[:, :2],
            lambda hand: np.array([reach_of(hand), reach_of(hand) / 2]),
            lambda hand: np.array([0.0, reach_of(hand) / 2]),
            fixed=2,
        ),
        Part("object orientation [rad]", lambda state, _aim, _scene: state.pose[:, 2:], np.pi, fixed=1),
        Part(
            "object size l, b, h [m]",
            lambda _state, _aim, scene: np.array([spec.size for spec in scene.objects]),
            LARGEST_SIZE / 2,
            LARGEST_SIZE / 2,
            fixed=3,
        ),
        Part(
            "distance of each link to the object [m]",
            lambda state, _aim, scene: state.link_gaps[:, by_rank(scene.hand)],
            lambda hand: 0.5 * reach_of(hand),
            lambda hand: 0.5 * reach_of(hand),
            for_joint=1,
        ),
        Part("end of each link x, y [m]", _link_ends, reach_of, for_joint=2),
        Part(
            "joint angles [rad]",
            lambda state, _aim, scene: state.joint_angles[:, by_rank(scene.hand)],
            lambda hand: np.ptp(hand.limits[by_rank(hand)], axis=-1) / 2,
            lambda hand: hand.limits[by_rank(hand)].mean(axis=-1),
            for_joint=1,
        ),
    ),
)
"""Table 3.1 of the thesis: 23 numbers with two links a finger, each normalised over its range (thesis 3.3.1)."""

AIMED = (
    Part("direction, unit vector", lambda _state, aim, _scene: aim.direction, 1.0, fixed=2),
    Part("way along [m]", lambda state, aim, _scene: aim.shift(state.pose)[:, :1], 0.1, fixed=1),
    Part("way to the left [m]", lambda state, aim, _scene: aim.shift(state.pose)[:, 1:2], 0.01, fixed=1),
    Part("angle turned [rad]", lambda state, aim, _scene: aim.shift(state.pose)[:, 2:], 0.2, fixed=1),
    Part("velocity along and to the left [m/s]", _velocity, 0.2, fixed=2),
)
LEFT = (
    Part("way left to go [m]", lambda state, aim, _scene: aim.left(state.pose)[:, None], 0.1, fixed=1),
    Part("the same, near the end [m]", lambda state, aim, _scene: aim.left(state.pose)[:, None], 0.01, fixed=1),
)
CONTACTS = (
    Part("contacts in the object frame [m]", _contacts, 0.04, for_finger=2),
    Part("gaps of the fingers [m]", lambda state, _aim, _scene: state.gaps, 0.005, for_finger=1),
)
_HELD = (
    Part("spin [rad/s]", lambda state, _aim, _scene: state.object_velocity[:, 5:], 2.0, fixed=1),
    Part(
        "object position from the start [m]",
        lambda state, _aim, scene: state.pose[:, :2] - np.array(scene.hand.start_position),
        0.15,
        fixed=2,
    ),
    Part("object orientation [rad]", lambda state, _aim, _scene: state.pose[:, 2:], 1.0, fixed=1),
    Part(
        "joint angles [rad]", lambda state, _aim, scene: state.joint_angles[:, by_rank(scene.hand)], np.pi, for_joint=1
    ),
    Part(
        "joint velocities [rad/s]",
        lambda state, _aim, scene: state.joint_velocities[:, by_rank(scene.hand)],
        4.0,
        for_joint=1,
    ),
    Part(  # what presses on the object
        "commands ahead of the joints [rad]",
        lambda state, _aim, scene: (state.targets - state.joint_angles)[:, by_rank(scene.hand)],
        0.2,
        for_joint=1,
    ),
    *CONTACTS,
)

GRIP = Layout("grip-1", (AIMED[0], *LEFT, *AIMED[1:], *_HELD))
"""31 numbers with two links a finger; scales are guessed from what the expert's episodes hold."""

TRUTH = Layout(
    "truth-1",
    (
        *GRIP.parts,
        Part(
            "the world as it is drawn: logarithms of factors, and delays in decisions",
            lambda state, _aim, scene: np.zeros((state.n_worlds, DRAWN)) if scene.drawn is None else scene.drawn,
            3.0,
            fixed=DRAWN,
        ),
    ),
)
"""The same with what differs between worlds: what critics may see of worlds of which an actor has its senses alone."""

OPEN = Layout("grip-open-1", (*AIMED, *_HELD))
"""The same without the way left to go: a policy must learn by itself how far each grip carries."""

WHOLE = Layout(
    "whole-1",
    (
        Part(
            "share of the task's way come",
            lambda state, aim, _scene: np.broadcast_to(aim.share, (state.n_worlds,))[:, None],
            0.5,
            0.5,
            fixed=1,
        ),
        Part(
            "end of the task from the start x, y [m]",
            lambda _state, aim, scene: _end(aim)[:, :2] - np.array(scene.hand.start_position),
            0.15,
            fixed=2,
        ),
        Part("end of the task, orientation [rad]", lambda _state, aim, _scene: _end(aim)[:, 2:], 1.0, fixed=1),
        Part("velocity x, y [m/s]", lambda state, _aim, _scene: state.object_velocity[:, :2], 0.2, fixed=2),
        *_HELD,
    ),
)
"""28 numbers with two links a finger for training on a whole task that sees its end but not its path."""
