"""Reference paths: where the object should be when it has come a given way along a primitive."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array, Path
from inhand.tasks.primitives import Primitive

TURN_STEP = math.radians(1.0)
"""Spacing of the waypoints of a turn on the spot [rad]."""


@dataclass(frozen=True, eq=False)
class ReferencePath(Path):
    """The path of a primitive `(N, 3)`, relative to the object's start, axes along the palm's."""

    name: str
    """The primitive, and the recording if it comes from one."""
    twist: float = 0.0
    """Rotation to turn on the spot before the path begins, counter-clockwise [rad]; the path holds it."""


def twist_poses(path: ReferencePath) -> Array:
    """Return the waypoints `(N, 3)` of the twist before a path, on the spot and in steps of `TURN_STEP`."""
    count = math.ceil(abs(path.twist) / TURN_STEP - 1e-9) + 1
    return np.column_stack([np.zeros((count, 2)), np.linspace(0.0, path.twist, count)])


def whole_path(path: ReferencePath) -> Array:
    """Return the poses `(N, 3)` of a twist and the path after it, relative to where the twist starts."""
    return np.concatenate([twist_poses(path)[:-1], path.poses + np.array([0.0, 0.0, path.twist])])


def stacked(paths: Sequence[Array]) -> Array:
    """Return paths `(S, 3)` of different lengths as one array `(B, S, 3)`, shorter ones held at their last waypoint."""
    longest = max(len(path) for path in paths)
    return np.stack([np.concatenate([path, np.repeat(path[-1:], longest - len(path), axis=0)]) for path in paths])


def path_of(primitive: Primitive) -> ReferencePath:
    """Return the path of a primitive: its own, or straight along its direction."""
    if primitive.path is None:
        return straight_path(primitive)
    return ReferencePath(np.array(primitive.path), primitive.name)


def straight_path(primitive: Primitive, length: float = 0.25, step: float = 0.001) -> ReferencePath:
    """Return the path straight along a primitive, in steps [m], by default farther [m] than any hand reaches.

    A translation that holds a twist has the twist before it (docs/metrics.md). A primitive that only rotates has steps
    of one degree and ignores `length` and `step`.

    Raises:
        InputError: length or step is not positive and finite, or a rotation by nothing.
    """
    turn = math.radians(primitive.rotation_deg)
    if primitive.angle_deg is None:
        progress = _grid(f"rotation of {primitive.name}", abs(turn), TURN_STEP)
        poses = np.column_stack([np.zeros((len(progress), 2)), np.copysign(progress, turn)])
    else:
        progress = _grid("length", length, step)
        poses = np.column_stack([progress[:, None] * primitive.unit, np.zeros(len(progress))])
    return ReferencePath(poses, primitive.name, 0.0 if primitive.angle_deg is None else turn)


def _grid(what: str, length: float, step: float) -> Array:
    """Return evenly spaced progress from 0 to the length, at most one step apart."""
    count = math.ceil(_checked(what, length) / _checked("step", step) - 1e-9)
    return np.linspace(0.0, length, max(count, 1) + 1)


def _checked(what: str, value: float) -> float:
    """Return a value that is positive and finite, or refuse it."""
    if not 0.0 < value < math.inf:
        raise InputError(f"{what} {value:g} is not usable: give a positive, finite number (metres; a rotation not 0)")
    return value
