"""Tasks of hands in space: poses to go to and to hold, and turns there and back."""

from functools import lru_cache, partial

import numpy as np

from inhand.control.spatial_rehearsal import search_of
from inhand.geometry import Array
from inhand.hands.spatial.fit import SpatialHeld
from inhand.hands.spatial.grasp_search import search_grasps
from inhand.tasks.spatial.paths import spatial_path_of
from inhand.tasks.spatial.primitives import along
from inhand.tracing.plan import Plan, plan_along
from inhand.tracing.tasks import POSE_STAY, SHARE, TURNS, SequenceTask

REORIENT = np.deg2rad(30.0)
"""How far the object is turned about each axis, and back [rad]."""


def _goal(held: SpatialHeld, rng: np.random.Generator, most: float = 0.0) -> Plan:
    """Draw a place in half of what grips reach along the axes, and how the object is turned there [rad]."""
    inside, axis = (_on_sphere(rng) for _ in range(2))
    drawn = inside * rng.random() ** (1 / 3)
    ways = _ways(held)
    place = SHARE * np.where(drawn > 0, ways[:3], ways[3:]) * drawn
    goal = held.start + np.concatenate([place, rng.uniform(0.0, most) * axis if most else np.zeros(3)])
    return plan_along("pose" if most else "place", np.stack([held.start, goal]), held.start, stay=POSE_STAY)


def _on_sphere(rng: np.random.Generator) -> Array:
    drawn = rng.standard_normal(3)
    return np.asarray(drawn / np.linalg.norm(drawn))


@lru_cache(maxsize=8)
def _ways(held: SpatialHeld) -> Array:
    """Return how far the best grip is planned to carry the object along x, y, z and against them `(6,)` [m]."""
    hand, spec, gravity = held
    pulls = np.array([gravity])
    paths = [spatial_path_of(along(axis)) for axis in (*np.eye(3), *-np.eye(3))]
    found = search_grasps((hand, spec), hand.start_pose, paths, pulls, config=search_of(spec, pulls))
    return np.array([grasps[0].way if grasps else 0.0 for grasps in found])


def _reorient(held: SpatialHeld, rng: np.random.Generator) -> Plan:
    del rng
    poses = np.tile(held.start, (7, 1))
    poses[1::2, 3:] = REORIENT * np.eye(3)
    return plan_along("reorient", poses, held.start, tolerance=0.0)


SPATIAL_TASKS = {
    task.name: task
    for task in (
        SequenceTask("pose", "go to a drawn pose in space and hold it for a second", partial(_goal, most=TURNS)),
        SequenceTask("place", "go to a drawn place in space without turning and hold the object there", _goal),
        SequenceTask("reorient", "turn by 30 deg about each axis, and back", _reorient),
    )
}
"""Tasks of hands in space by name."""
