"""What a sequence asks of low-level controllers: to go straight from pose to pose, in the plane or in space."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import AnyTask, SpatialTask, Task
from inhand.control.follow import follow_limit
from inhand.control.ik import IkConfig
from inhand.control.spatial_follow import spatial_limit
from inhand.control.spatial_ik import SpatialIkConfig, ending_of
from inhand.geometry import Array, Path, wrap_angle
from inhand.rotations import SpatialPath, rotation_between
from inhand.sim.state import State, select
from inhand.tasks.paths import stacked
from inhand.tracing.plan import STEP
from inhand.tracing.poses import Pose, full, plain, poses_of
from inhand.tracing.walk import Request

T = TypeVar("T", Task, SpatialTask)


def where(task: AnyTask, state: State) -> list[Pose]:
    """Return the pose of every object."""
    return [plain(pose) for pose in poses_of(state.object_pose, space=isinstance(task, SpatialTask)).tolist()]


def straight(task: AnyTask, worlds: NDArray[np.int64], asked: Sequence[Request]) -> AnyTask:
    """Return the task of carrying some worlds' objects straight from one pose to another, each as it is asked."""
    start, end = (np.array([getattr(request, name) for request in asked]) for name in ("start", "end"))
    if isinstance(task, SpatialTask):
        path = _line(from_to(start, end))
        return replace(part(task, worlds, path), distance=path.length, start=full(start))
    relative = end - start
    relative[:, 2] = wrap_angle(relative[:, 2])
    path = _line(relative)
    return replace(part(task, worlds, path), distance=path.length, start=start)


def _line(relative: Array) -> Path:
    """Return straight paths to poses `(K, k)`, in steps of `STEP` at most."""
    longest = Path(np.stack([np.zeros_like(relative), relative], axis=1)).length.max()
    shares = np.linspace(0.0, 1.0, max(int(np.ceil(longest / STEP)), 1) + 1)
    return Path(shares[:, None] * relative[:, None])


def rest_held(task: AnyTask, state: State, worlds: NDArray[np.int64], rest: Sequence[Array]) -> tuple[Path, Array]:
    """Return the rest of the plans of some worlds, and the way `(K,)` [m] that their grips are predicted to hold.

    What is left of each plan is its poses `(S, k)`, of which the first is where the object is.
    """
    if isinstance(task, SpatialTask):
        path = Path(stacked([from_to(poses[:1], poses) for poses in rest]))
        solid = part(task, worlds, path)
        return path, spatial_limit(solid, select(state, worlds), ending_of(solid, SpatialIkConfig()))
    path, config = Path(stacked([poses - poses[0] for poses in rest])), IkConfig()
    flat = part(task, worlds, path)
    return path, follow_limit(flat, select(state, worlds), config.friction_share, config.margin)


def from_to(start: Array, end: Array) -> Array:
    """Return how far poses of space `(..., 6)` are moved and turned from others `(..., 6)`, along the palm's axes."""
    one, other = full(start), full(end)
    return np.concatenate([other[..., :3] - one[..., :3], rotation_between(one[..., 3:], other[..., 3:])], axis=-1)


def part(task: T, worlds: NDArray[np.int64], path: Path) -> T:
    """Return the task of some worlds alone, along other paths."""
    objects = tuple(task.objects[world] for world in worlds)
    if isinstance(task, SpatialTask):
        ways = SpatialPath(path.poses[..., :3], path.poses[..., 3:])
        return replace(task, objects=objects, path=ways, gravity=task.gravity[worlds], start=None)
    return replace(task, objects=objects, path=path)
