"""Reference paths: where the object should be when it has come a given way along a primitive."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inhand import geometry
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.tasks.primitives import Primitive
from inhand.trials.directions import ROTATION_SIGNS
from inhand.trials.human_trial import HumanTrial

TURN_STEP = math.radians(1.0)
"""Spacing of the waypoints where progress is an angle [rad]."""
BIN_STEPS = 2.0
"""Half width of a bin of progress, in steps: wide enough that fast frames, up to 5 mm apart, fill most bins."""
SMOOTH_STEPS = 5
"""Window of the mean over neighbouring waypoints."""


@dataclass(frozen=True, eq=False)
class ReferencePath:
    """A path for the object's pose, ordered by progress, so that it can be followed but not timed."""

    name: str
    """The primitive, and the recording if it comes from one."""
    poses: Array
    """Waypoints `(N, 3)` relative to the start position, axes along the palm's: x [m], y [m], theta [rad]."""
    progress: Array
    """Progress `(N,)` at each waypoint, rising from 0: along the direction [m], or the angle turned [rad]."""
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


def straight_path(primitive: Primitive, length: float = 0.25, step: float = 0.001) -> ReferencePath:
    """Return the path straight along a primitive.

    A translation that holds a twist has the twist before it (asterisk-test.md). A primitive that only rotates has its
    angle as progress, in steps of one degree, and ignores `length` and `step`.

    Args:
        primitive: What to do.
        length: How far [m], longer than any hand reaches.
        step: Spacing of the waypoints [m].

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
    return ReferencePath(primitive.name, poses, progress, 0.0 if primitive.angle_deg is None else turn)


def human_path(trial: HumanTrial, *, step: float = 0.001, keep_rotation: bool = False) -> ReferencePath:
    """Return the path that a person took, as a function of progress instead of time.

    From the filtered rows up to the one of farthest progress (what follows is release): in bins around each
    waypoint the median of the rows' lateral part, gaps filled linearly, then a mean over neighbours that keeps
    the start. So a person who walks the object to and fro leaves one point per step, and dwelling counts once.
    The lateral part of recordings is uncertain by up to 14 mm (asterisk-test.md).

    Args:
        trial: The recording.
        step: Spacing of the waypoints [m]; a trial that only rotates has steps of one degree instead.
        keep_rotation: Follow the recorded rotation too; by default a translation keeps theta at 0. Only trials
            whose label tells its sign can.

    Raises:
        InputError: the object moved less than one step along its direction, the step is not positive and finite,
            or the rotation is to be kept but its sign is unknown.
    """
    if keep_rotation and not trial.rotation_signed:
        raise InputError(
            f"{trial.source}: the sign of the rotation is unknown in trials without a twist, so it cannot be"
            " followed: leave keep_rotation off, or use a trial with p15, m15, cw or ccw"
        )
    rows = slice(*trial.moving)
    place = (trial.filtered_mm[rows] - trial.filtered_mm[rows][0]) / 1000.0
    theta = np.radians(trial.filtered_rotation_deg[rows]) if trial.rotation_signed else np.zeros(len(place))
    name = f"{trial.primitive} of {trial.source}"
    if trial.angle_deg is None:
        sign = ROTATION_SIGNS[trial.primitive]
        progress, drift = _along(name, sign * (theta - theta[0]), place, TURN_STEP)
        return ReferencePath(name, np.column_stack([drift, sign * progress]), progress)
    aligned = geometry.rotate(-math.radians(trial.angle_deg), place)
    across = np.column_stack([aligned[:, 1], theta])
    progress, parts = _along(name, aligned[:, 0], across, step)
    points = geometry.rotate(math.radians(trial.angle_deg), np.column_stack([progress, parts[:, 0]]))
    held = parts[:, 1] + theta[0] if keep_rotation else np.zeros(len(progress))
    twist = 0.0 if keep_rotation else math.radians(trial.twist_deg)
    return ReferencePath(name, np.column_stack([points, held]), progress, twist)


def _along(name: str, progress: Array, across: Array, step: float) -> tuple[Array, Array]:
    """Return a grid `(N,)` of progress and, at each of its points, the other columns `(N, K)` minus their start."""
    farthest = int(np.argmax(progress))
    whole_steps = math.floor(progress[farthest] / _checked("step", step) + 1e-9)
    if whole_steps < 1:
        raise InputError(
            f"{name}: the object moves less than one step ({step:g}) along its direction, so there is no path to"
            " follow: use another trial"
        )
    grid = step * np.arange(whole_steps + 1)
    rows, values = progress[: farthest + 1], across[: farthest + 1] - across[0]
    medians = np.full((len(grid), values.shape[1]), np.nan)
    for i, centre in enumerate(grid):
        near = np.abs(rows - centre) <= BIN_STEPS * step
        if near.any():
            medians[i] = np.median(values[near], axis=0)
    medians[0] = 0.0
    columns = [_smoothed(_filled(grid, medians[:, k])) for k in range(values.shape[1])]
    return grid, np.column_stack(columns)


def _filled(grid: Array, values: Array) -> Array:
    known = ~np.isnan(values)
    return np.asarray(np.interp(grid, grid[known], values[known]))


def _smoothed(values: Array) -> Array:
    """Return the mean over neighbours; mirrored through its end points, so that start and end stay in place."""
    half = min(SMOOTH_STEPS // 2, len(values) - 1)
    padded = np.pad(values, half, mode="reflect", reflect_type="odd")
    return np.convolve(padded, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="valid")


def _grid(what: str, length: float, step: float) -> Array:
    """Return evenly spaced progress from 0 to the length, at most one step apart."""
    count = math.ceil(_checked(what, length) / _checked("step", step) - 1e-9)
    return np.linspace(0.0, length, max(count, 1) + 1)


def _checked(what: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"{what} {value:g} is not usable: give a positive, finite number (metres; a rotation not 0)")
    return value
