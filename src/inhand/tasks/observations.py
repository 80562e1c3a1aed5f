"""What a learned controller sees: named parts of a `State` in a fixed order, each scaled to [-1, 1].

Two layouts: `thesis` is table 3.1 of the thesis; `grip` tells position along and across the primitive and adds what
holding and stopping depend on: velocities, commands and contact points. A change of a layout takes a new name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from inhand.errors import InputError, near_matches
from inhand.geometry import Array, inverse_transform, perpendicular, unit, wrap_angle
from inhand.hands.hand import HandSpec
from inhand.hands.kinematics import joint_positions
from inhand.hands.objects import ObjectSpec
from inhand.registry import Registry, describe
from inhand.sim.state import State
from inhand.tasks.aim import Aim

LARGEST_SIZE = 0.12
"""Object sizes are normalised over 0 to this [m], guessed: more than the catalogue's hands can hold."""


@dataclass(frozen=True)
class Scene:
    """What stays the same while a batch runs."""

    hand: HandSpec
    """The hand."""
    objects: tuple[ObjectSpec, ...]
    """The object of each world."""


OfHand = float | tuple[float, ...] | Callable[[HandSpec], Array | float]
"""A number, numbers, or what gives them for a hand."""


@dataclass(frozen=True)
class Part:
    """Some neighbouring numbers of an observation."""

    name: str
    """What they are, and their unit before they are scaled."""
    values: Callable[[State, Aim, Scene], Array]
    """Gives them `(B, size)`."""
    half: OfHand
    """How far from the middle becomes 1."""
    middle: OfHand = 0.0
    """What becomes 0."""
    fixed: int = 0
    """How many they are with every hand,"""
    for_joint: int = 0
    """and how many more for each joint."""

    def size(self, hand: HandSpec) -> int:
        """Return how many numbers they are with a hand."""
        return self.fixed + self.for_joint * hand.n_joints


@dataclass(frozen=True)
class Layout:
    """The parts of an observation in their order."""

    name: str
    """Name, which changes with the parts."""
    parts: tuple[Part, ...]
    """The parts."""

    def size(self, hand: HandSpec) -> int:
        """Return how many numbers an observation has."""
        return sum(part.size(hand) for part in self.parts)


def observe(layout: Layout, state: State, aim: Aim, scene: Scene) -> Array:
    """Return the observations of a batch `(B, size)`, cut to [-1, 1]."""
    hand = scene.hand
    parts = [
        (part.values(state, aim, scene) - numbers_for(part.middle, hand)) / numbers_for(part.half, hand)
        for part in layout.parts
    ]
    return np.clip(np.concatenate(parts, axis=-1), -1.0, 1.0)


def find_layout(name: str) -> Layout:
    """Return a layout by name; `grip,tip_speed` adds a user's part to one.

    Raises:
        InputError: there is none of that name.
    """
    first, *more = name.split(",")
    if first not in LAYOUTS:
        near, known = near_matches(first, LAYOUTS), ", ".join(LAYOUTS)
        raise InputError(f"unknown observation {first!r}{near}; allowed are {known}")
    layout = LAYOUTS[first]
    return Layout(",".join([layout.name, *more]), (*layout.parts, *(PARTS.known(word) for word in more)))


def numbers_for(given: OfHand, hand: HandSpec) -> Array:
    """Return a scale or a middle with a hand."""
    return np.asarray(given(hand) if callable(given) else given)


def _reach(hand: HandSpec) -> float:
    """Return how far from the palm's middle a fingertip can come [m]."""
    return float(max(abs(finger.base[0]) + finger.length for finger in hand.fingers))


def _share_of_reach(hand: HandSpec, share: float) -> float:
    return share * _reach(hand)


def _position_middle(hand: HandSpec) -> Array:
    return np.array([0.0, _reach(hand) / 2])


def _position_half(hand: HandSpec) -> Array:
    return np.array([_reach(hand), _reach(hand) / 2])


def by_rank(hand: HandSpec) -> list[int]:
    """Return the joints in the order of table 3.1: both proximal ones, left first, then the next of each finger."""
    count = max(len(finger.links) for finger in hand.fingers)
    return [place.start + k for k in range(count) for place in hand.slices if place.start + k < place.stop]


def _angles_middle(hand: HandSpec) -> Array:
    return np.asarray(hand.limits[by_rank(hand)].mean(axis=-1))


def _angles_half(hand: HandSpec) -> Array:
    return np.asarray(np.ptp(hand.limits[by_rank(hand)], axis=-1) / 2)


def _direction(state: State, aim: Aim, scene: Scene) -> Array:
    del state, scene
    return wrap_angle(aim.angle)[:, None]


def _unit_direction(state: State, aim: Aim, scene: Scene) -> Array:
    del state, scene
    return np.asarray(unit(aim.angle))


def _position(state: State, aim: Aim, scene: Scene) -> Array:
    del aim, scene
    return state.pose[:, :2]


def _orientation(state: State, aim: Aim, scene: Scene) -> Array:
    del aim, scene
    return state.pose[:, 2:]


def _from_start(state: State, aim: Aim, scene: Scene) -> Array:
    """Position of the object seen from where the hand places it (thesis 3.1)."""
    del aim
    return np.asarray(state.pose[:, :2] - np.array(scene.hand.start_position))


def _sizes(state: State, aim: Aim, scene: Scene) -> Array:
    del state, aim
    return np.array([spec.size for spec in scene.objects])


def _distances(state: State, aim: Aim, scene: Scene) -> Array:
    del aim
    return state.link_gaps[:, by_rank(scene.hand)]


def _link_ends(state: State, aim: Aim, scene: Scene) -> Array:
    """Ends of the links: the next joint or the fingertip. The proximal joints themselves never move."""
    del aim
    hand = scene.hand
    ends = [
        joint_positions(finger, state.joint_angles[:, place])[:, 1:]
        for finger, place in zip(hand.fingers, hand.slices, strict=True)
    ]
    ranked = np.concatenate(ends, axis=1)[:, by_rank(hand)]
    return ranked.reshape(len(ranked), -1)


def _joint_angles(state: State, aim: Aim, scene: Scene) -> Array:
    del aim
    return state.joint_angles[:, by_rank(scene.hand)]


def _joint_velocities(state: State, aim: Aim, scene: Scene) -> Array:
    del aim
    return state.joint_velocities[:, by_rank(scene.hand)]


def _commands(state: State, aim: Aim, scene: Scene) -> Array:
    """How far the commanded angles are ahead of the joints, which is what presses on the object."""
    del aim
    return (state.targets - state.joint_angles)[:, by_rank(scene.hand)]


def _way(state: State, aim: Aim, scene: Scene, part: slice) -> Array:
    """Way along, way to the left or angle turned since the primitive started."""
    del scene
    return aim.shift(state.pose)[:, part]


def _left(state: State, aim: Aim, scene: Scene) -> Array:
    """Way left to where the object is to stay."""
    del scene
    return aim.left(state.pose)[:, None]


def _share(state: State, aim: Aim, scene: Scene) -> Array:
    del scene
    return np.broadcast_to(aim.share, (state.n_worlds,))[:, None]


def _end(aim: Aim) -> Array:
    """Return the end of the task.

    Raises:
        InputError: a primitive is asked for, which has none.
    """
    if aim.end is None:
        raise InputError("observation 'whole' tells the end of a whole task and primitives have none: use 'grip'")
    return aim.end


def _end_place(state: State, aim: Aim, scene: Scene) -> Array:
    del state
    return np.asarray(_end(aim)[:, :2] - np.array(scene.hand.start_position))


def _end_angle(state: State, aim: Aim, scene: Scene) -> Array:
    del state, scene
    return _end(aim)[:, 2:]


def _palm_velocity(state: State, aim: Aim, scene: Scene) -> Array:
    """Velocity of the object in the palm frame."""
    del aim, scene
    return state.object_velocity[:, :2]


def _velocity(state: State, aim: Aim, scene: Scene) -> Array:
    """Velocity of the object along the primitive and to its left."""
    del scene
    direction, linear = unit(aim.angle), state.object_velocity[:, :2]
    return np.stack([(linear * direction).sum(-1), (linear * perpendicular(direction)).sum(-1)], axis=-1)


def _spin(state: State, aim: Aim, scene: Scene) -> Array:
    del aim, scene
    return state.object_velocity[:, 5:]


def _contacts(state: State, aim: Aim, scene: Scene) -> Array:
    """Where each finger touches the object, in the object's frame."""
    del aim, scene
    points = inverse_transform(state.pose[:, None], state.object_xy)
    return points.reshape(state.n_worlds, -1)


def _gaps(state: State, aim: Aim, scene: Scene) -> Array:
    del aim, scene
    return state.gaps


_HALF_REACH = partial(_share_of_reach, share=0.5)

THESIS = Layout(
    "thesis-1",
    (
        Part("direction [rad]", _direction, np.pi, fixed=1),
        Part("object position x, y [m]", _position, _position_half, _position_middle, fixed=2),
        Part("object orientation [rad]", _orientation, np.pi, fixed=1),
        Part("object size l, b, h [m]", _sizes, LARGEST_SIZE / 2, LARGEST_SIZE / 2, fixed=3),
        Part("distance of each link to the object [m]", _distances, _HALF_REACH, _HALF_REACH, for_joint=1),
        Part("end of each link x, y [m]", _link_ends, _reach, for_joint=2),
        Part("joint angles [rad]", _joint_angles, _angles_half, _angles_middle, for_joint=1),
    ),
)
"""Table 3.1 of the thesis: 23 numbers with two links a finger, each normalised over its range (thesis 3.3.1)."""

GRIP = Layout(
    "grip-1",
    (
        Part("direction, unit vector", _unit_direction, 1.0, fixed=2),
        Part("way left to go [m]", _left, 0.1, fixed=1),
        Part("the same, near the end [m]", _left, 0.01, fixed=1),
        Part("way along [m]", partial(_way, part=slice(0, 1)), 0.1, fixed=1),
        Part("way to the left [m]", partial(_way, part=slice(1, 2)), 0.01, fixed=1),
        Part("angle turned [rad]", partial(_way, part=slice(2, 3)), 0.2, fixed=1),
        Part("velocity along and to the left [m/s]", _velocity, 0.2, fixed=2),
        Part("spin [rad/s]", _spin, 2.0, fixed=1),
        Part("object position from the start [m]", _from_start, 0.15, fixed=2),
        Part("object orientation [rad]", _orientation, 1.0, fixed=1),
        Part("joint angles [rad]", _joint_angles, np.pi, for_joint=1),
        Part("joint velocities [rad/s]", _joint_velocities, 4.0, for_joint=1),
        Part("commands ahead of the joints [rad]", _commands, 0.2, for_joint=1),
        Part("contacts in the object frame [m]", _contacts, 0.04, fixed=4),
        Part("gaps of the fingers [m]", _gaps, 0.005, fixed=2),
    ),
)
"""31 numbers with two links a finger; scales are guessed from what the expert's episodes hold."""

OPEN = Layout("grip-open-1", tuple(part for part in GRIP.parts if part.values is not _left))
"""The same without the way left to go: a policy must learn by itself how far each grip carries."""

_FRAMELESS = tuple(
    part
    for part in GRIP.parts
    if part.values not in (_unit_direction, _left, _velocity) and not isinstance(part.values, partial)
)
WHOLE = Layout(
    "whole-1",
    (
        Part("share of the task's way come", _share, 0.5, 0.5, fixed=1),
        Part("end of the task from the start x, y [m]", _end_place, 0.15, fixed=2),
        Part("end of the task, orientation [rad]", _end_angle, 1.0, fixed=1),
        Part("velocity x, y [m/s]", _palm_velocity, 0.2, fixed=2),
        *_FRAMELESS,
    ),
)
"""28 numbers with two links a finger for training on a whole task that sees its end but not its path."""

LAYOUTS = {"thesis": THESIS, "grip": GRIP, "grip-open": OPEN, "whole": WHOLE}
"""Layouts by the name that configurations use."""


def _user_part(name: str, given: object) -> Part:
    """Return a user's part, its values looked at; raise InputError where it is none."""
    if not isinstance(given, Part) or not callable(given.values) or given.fixed + given.for_joint < 1:
        raise InputError(
            f"observation part {name!r} is {describe(getattr(given, 'values', given))}: it must be a function of state,"
            " aim and scene that gives at least one number a world; tell how many by fixed or for_joint"
        )

    def values(state: State, aim: Aim, scene: Scene) -> Array:
        found, wanted = np.asarray(given.values(state, aim, scene), float), (state.n_worlds, given.size(scene.hand))
        if found.shape != wanted:
            raise InputError(f"observation part {name!r} gives {found.shape}: it must give {wanted}, worlds by numbers")
        return found

    return replace(given, name=name, values=values)


PARTS: Registry[Part] = Registry("observation part", {}, _user_part)
"""Parts that users add to an observation."""
