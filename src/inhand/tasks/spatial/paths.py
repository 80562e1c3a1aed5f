"""Reference paths in space: where the object should be when it has come a given way along a primitive."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.rotations import SpatialPath, multiply, quaternion_of, vector_of
from inhand.tasks.paths import TURN_STEP
from inhand.tasks.spatial.primitives import SpatialPrimitive

LENGTH = 0.15
"""How far straight paths go [m]: farther than the standard hand reaches (111 mm)."""


@dataclass(frozen=True, eq=False)
class SpatialReference(SpatialPath):
    """The path of a primitive `(N, 3)` each, from the object's start, along the palm's axes."""

    name: str
    """The primitive."""
    hold: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Rotation vector to turn on the spot before the path begins [rad]; the path holds it."""


def spatial_path_of(primitive: SpatialPrimitive, length: float = LENGTH, step: float = 0.001) -> SpatialReference:
    """Return the path of a primitive: a user's own, or straight along its direction in steps [m], or about its axis.

    A primitive that only rotates has steps of one degree and ignores `length` and `step`.

    Raises:
        InputError: length or step is not positive and finite.
    """
    if primitive.path is not None:
        poses = np.array(primitive.path)
        none = np.zeros((len(poses), 1))
        moves, turns = np.hstack([poses[:, :2], none]), np.hstack([none, none, poses[:, 2:]])
        return SpatialReference(moves, turns, primitive.name)
    if primitive.direction is None:
        angles = _grid("rotation", primitive.angle, TURN_STEP)
        turns = angles[:, None] * primitive.axis
        return SpatialReference(np.zeros_like(turns), turns, primitive.name)
    moves = _grid("length", length, step)[:, None] * np.array(primitive.direction)
    return SpatialReference(moves, np.zeros_like(moves), primitive.name, primitive.rotation)


def hold_path(path: SpatialReference) -> SpatialPath:
    """Return the turn on the spot before a path that holds a rotation, in steps of `TURN_STEP`."""
    count = math.ceil(float(np.linalg.norm(path.hold)) / TURN_STEP - 1e-9) + 1
    turns = np.linspace(0.0, 1.0, count)[:, None] * np.array(path.hold)
    return SpatialPath(np.zeros_like(turns), turns)


def whole_spatial_path(path: SpatialReference) -> SpatialPath:
    """Return the turn that a path holds and the path after it, seen from where the turn starts."""
    if not any(path.hold):
        return SpatialPath(path.moves, path.turns)
    before = hold_path(path)
    after = np.broadcast_to(path.hold, path.turns.shape)
    if path.turns.any():
        after = vector_of(multiply(quaternion_of(path.turns), quaternion_of(after)))
    turns = np.concatenate([before.turns[:-1], after])
    return SpatialPath(np.concatenate([before.moves[:-1], path.moves]), turns)


def stacked_paths(paths: Sequence[SpatialPath]) -> SpatialPath:
    """Return paths of different lengths as one of B paths, shorter ones held at their last pose."""
    longest = max(len(path.moves) for path in paths)

    def held(rows: Array) -> Array:
        return np.concatenate([rows, np.repeat(rows[-1:], longest - len(rows), axis=0)])

    return SpatialPath(np.stack([held(p.moves) for p in paths]), np.stack([held(p.turns) for p in paths]))


def _grid(what: str, length: float, step: float) -> Array:
    """Return evenly spaced progress from 0 to the length, at most one step apart."""
    for name, value in ((what, length), ("step", step)):
        if not 0.0 < value < math.inf:
            raise InputError(f"{name} {value:g} is not usable: give a positive, finite number (metres or radians)")
    return np.linspace(0.0, length, max(math.ceil(length / step - 1e-9), 1) + 1)
