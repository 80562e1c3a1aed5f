"""How far the grips that are held now go on along their paths: the rolling prediction from what was measured."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from inhand.geometry import Array
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.forces import GripRules
from inhand.hands.spatial.grasp_search import follow_tuples, rules_for, weights_of
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.rolling import Margins, Starts, off_the_palm, roll
from inhand.hands.spatial.start_contacts import stack_of
from inhand.rotations import SpatialPath, seen_from


@dataclass(frozen=True)
class FollowRules:
    """What a prediction keeps; less than planning, as the grip is there (guessed, near the prototype's)."""

    margins: Margins = field(default_factory=lambda: Margins(6e-4, 4e-4, 0.001, 0.001, 0.02))
    """What fingers keep."""
    share: float = 0.9
    """Share of the friction that may be used."""
    rules: GripRules = field(default_factory=lambda: GripRules(rounds=60))
    """How contacts hold; their friction is the hand's and the object's."""
    stride: int = 2
    """Each so many poses of the paths are looked at, and the last."""
    every: int = 3
    """Forces and fingers on one of so many of those, and where they end on each."""


def follow_grips(
    held: tuple[SpatialHand, SolidSpec],
    now: tuple[Array, Array],
    asked: tuple[SpatialPath, Array, Array],
    config: FollowRules | None = None,
) -> Array:
    """Return the way `(B,)` [m] up to which each grip follows its path: contacts roll, forces balance, fingers apart.

    Args:
        held: hand and object.
        now: joint angles `(B, n)` [rad] and poses of the object `(B, 7)` as measured; all tips touch.
        asked: one path for each world, in steps of a few millimetres and degrees; poses `(B, 7)` from which they count;
            gravity of each world `(B, 3)` [m/s^2].
        config: what is kept.
    """
    config = config or FollowRules()
    (hand, spec), (joints, pose), (path, starts, gravities) = held, now, asked
    looked = np.append(np.arange(0, path.moves.shape[1] - 1, config.stride), path.moves.shape[1] - 1)
    moves, turns = path.moves[:, looked], path.turns[:, looked]
    poses = SpatialPath(moves, turns).poses(starts)
    rows = kinematics.rows_of(poses)
    told = kinematics.measure(hand, spec, joints, pose)
    points = seen_from(pose[:, None], told.points)
    normals = seen_from(np.concatenate([np.zeros_like(pose[:, None, :3]), pose[:, None, 3:]], axis=-1), told.normals)
    tracks = [
        roll(held, f, Starts(points[:, f], normals[:, f], joints[:, place]), rows, config.margins)
        for f, place in enumerate(hand.slices)
    ]
    clear = off_the_palm(hand, spec, rows, config.margins.palm).sum(axis=1)
    lengths = np.minimum(np.min([each.lengths for each in tracks], axis=0), clear)
    numbers = np.repeat(np.arange(len(joints))[:, None], len(tracks), axis=1)
    weights = weights_of(spec, poses, gravities[:, None, None])
    rules = rules_for(held, config.rules, config.share)
    reached, _ = follow_tuples(stack_of(hand, tracks, config.margins), numbers, lengths, (weights, rules), config.every)
    way = path.way[:, looked]
    return np.where(reached > 0, way[np.arange(len(way)), np.maximum(reached - 1, 0)], 0.0)
