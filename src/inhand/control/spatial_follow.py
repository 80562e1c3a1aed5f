"""How far the grip that is held now can follow its path in space: the search's prediction, from what was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import SpatialTask
from inhand.geometry import TURN_ARM, Array, inverse_quaternion, turn
from inhand.hands.spatial.forces import GripRules
from inhand.hands.spatial.grasp_search import follow_tuples, weights_of
from inhand.hands.spatial.kinematics import rows_of
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.rolling import Margins, Starts, off_the_palm, roll
from inhand.hands.spatial.start_contacts import stack_of
from inhand.rotations import seen_from
from inhand.sim.state import State, select

EVERY = 3
"""Poses of a path from one at which forces and fingers are looked at to the next."""
ROUNDS = 60
"""Most rounds of the search for forces at such a pose."""
FOLLOWED = Margins(tolerance=6e-4, links=8e-4, edge=0.001, fingers=0.001, joints=0.02, palm=0.001)
"""What is kept of a grip that is held: less than of one that is planned, which is still to be closed."""


@dataclass(frozen=True, eq=False)
class Hold:
    """How objects are held."""

    grip: Array
    """Normal force that each contact would rather have `(B,)` [N]."""
    friction: Array
    """Friction coefficient that may be used `(B,)`."""
    least: float
    """Least normal force of a contact [N]."""


def spatial_limit(task: SpatialTask, state: State, hold: Hold, margin: tuple[float, float]) -> Array:
    """Return the way `(B,)` [m] up to which rolling contacts hold, from the measured grip and object pose.

    Of the margin [m, rad] nothing is kept from the end of the path.
    """
    path, start = task.path, task.origin(state)
    poses = path.poses(start)
    poses[:, 0] = state.object_pose
    lengths = np.zeros(task.n_worlds, dtype=np.int64)
    for spec in dict.fromkeys(task.objects):
        worlds = np.flatnonzero([each == spec for each in task.objects])
        lengths[worlds] = _followed(task, select(state, worlds), (spec, worlds), poses[worlds], hold)
    rows, last = np.arange(len(lengths)), np.maximum(lengths - 1, 0)
    turned = TURN_ARM * np.linalg.norm(np.diff(path.turns, axis=1, prepend=path.turns[:, :1]), axis=-1)
    share = (turned / np.maximum(np.diff(path.way, axis=1, prepend=0.0), 1e-9))[rows, last]
    kept = (1 - share) * margin[0] + share * TURN_ARM * margin[1]
    end = path.way[rows, last]
    return np.asarray(np.where(lengths == poses.shape[1], end, np.maximum(end - kept, 0.0)))


def _followed(
    task: SpatialTask, state: State, which: tuple[SolidSpec, NDArray[np.int64]], poses: Array, hold: Hold
) -> NDArray[np.int64]:
    """Return how many poses `(K, S, 7)` the grips of worlds `(K,)` with one object follow `(K,)`."""
    (spec, worlds), hand = which, task.hand
    held, rows = (hand, spec), rows_of(poses)
    points = seen_from(state.object_pose[:, None], state.object_points)
    normals = -turn(inverse_quaternion(state.object_pose[:, None, 3:]), state.normals)
    tracks = [
        roll(held, f, Starts(points[:, f], normals[:, f], state.joint_angles[:, own]), rows, FOLLOWED)
        for f, own in enumerate(hand.slices)
    ]
    off = off_the_palm(hand, spec, rows, FOLLOWED.palm).sum(axis=-1)
    lengths = np.minimum(np.min([track.lengths for track in tracks], axis=0), off)
    stack, numbers = stack_of(hand, tracks, FOLLOWED), np.arange(len(worlds))
    found = np.zeros(len(worlds), dtype=np.int64)
    # Each gravity, grip and friction is a question of its own, and worlds that share all three are asked together.
    asked = np.column_stack([task.gravity[worlds], hold.grip[worlds], hold.friction[worlds]])
    for question in np.unique(asked, axis=0):
        mine = numbers[(asked == question).all(axis=1)]
        weights = weights_of(spec, poses[mine], question[None, :3])
        rules = GripRules(float(question[3]), float(question[4]), hold.least, ROUNDS)
        tuples = np.repeat(mine[:, None], len(tracks), axis=1)
        found[mine] = follow_tuples(stack, tuples, lengths[mine], (weights, rules), EVERY)[0]
    return found
