"""How far the grip that is held now can follow its path: the expert's plan, made again from what was measured."""

import numpy as np

from inhand.control.controller import Task
from inhand.geometry import TURN_ARM, Array, inverse_transform
from inhand.hands.force_closure import force_closure
from inhand.hands.grasp_search import clear_for
from inhand.hands.objects import stacked_pieces
from inhand.hands.rolling import Starts, roll
from inhand.sim.state import State

EVERY = 1
"""Waypoints of the path from one prediction to the next."""


def follow_limit(task: Task, state: State, friction_share: float, margin: tuple[float, float]) -> Array:
    """Return the way `(B,)` [m] up to which rolling contacts hold, from the measured grip and object pose.

    `friction_share` is the share of the friction coefficient that the line between the contacts may use; of the margin
    [m, rad] nothing is kept from the end of the path.
    """
    hand, start = task.hand, state.pose
    last = task.path.poses.shape[1] - 1
    looked = np.unique([*range(0, last, EVERY), last])
    poses = task.origin(state)[:, None] + task.path.poses[:, looked]
    poses[:, 0] = start
    bodies = stacked_pieces(task.objects)
    tracks = []
    for i, (finger, place) in enumerate(zip(hand.fingers, hand.slices, strict=True)):
        points = inverse_transform(start, state.object_xy[:, i])
        tracks.append(roll(hand, finger, Starts(points, state.joint_angles[:, place], bodies), poses))
    left, right = tracks
    friction = np.array([friction_share * hand.friction * spec.friction for spec in task.objects])
    held = left.held & right.held
    held &= force_closure(friction[:, None], (left.points, left.normals), (right.points, right.normals))
    reach = clear_for(hand, left.joints, right.joints, np.cumprod(held, axis=-1).sum(axis=-1))
    rows, last = np.arange(len(reach)), np.maximum(reach - 1, 0)
    way = task.path.way[:, looked]
    turned = TURN_ARM * np.abs(np.diff(task.path.poses[:, looked, 2], axis=1, prepend=0.0))
    share = (turned / np.maximum(np.diff(way, axis=1, prepend=0.0), 1e-9))[rows, last]
    kept = (1 - share) * margin[0] + share * TURN_ARM * margin[1]
    end = way[rows, last]
    return np.asarray(np.where(reach == len(looked), end, np.maximum(end - kept, 0.0)))
