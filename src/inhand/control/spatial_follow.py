"""How far the grips that are held now can follow their paths in space, less a margin: where set points stop."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import SpatialTask
from inhand.geometry import TURN_ARM, Array
from inhand.hands.spatial.following import FollowRules, follow_grips
from inhand.hands.spatial.objects import SolidSpec
from inhand.rotations import SpatialPath
from inhand.sim.state import State

SHORT = 0.005
"""A grip that is predicted to end sooner is looked at again, with no room between fingers and none beside links [m]: a
start some tenths of a millimetre off can cost the room that planning left."""


@dataclass(frozen=True)
class Ending:
    """How the end of a grip is predicted."""

    rules: FollowRules
    """What fingers keep, and how contacts hold."""
    margin: tuple[float, float]
    """Distance [m], and where the path turns the object angle [rad], kept from the end."""


def spatial_limit(task: SpatialTask, state: State, ending: Ending) -> Array:
    """Return the way `(B,)` [m] up to which rolling contacts hold, from the measured grip and object pose.

    Of the margin nothing is kept from the end of a path.
    """
    found = np.zeros(task.n_worlds)
    for spec in dict.fromkeys(task.objects):
        worlds = np.flatnonzero([each == spec for each in task.objects])
        found[worlds] = _followed(task, state, (spec, worlds), ending.rules)
        short = worlds[found[worlds] < SHORT]
        if len(short):
            tight = replace(ending.rules.margins, fingers=0.0, links=0.0)
            found[short] = _followed(task, state, (spec, short), replace(ending.rules, margins=tight))
    return stops_at(task.path, found, ending.margin)


def stops_at(path: SpatialPath, end: Array, margin: tuple[float, float]) -> Array:
    """Return where set points stop `(B,)` [m] of grips that hold so far: a margin before, or at the end of a path."""
    before = np.maximum(end - margin_at(path, end, margin), 0.0)
    return np.asarray(np.where(end >= path.length - 1e-9, end, before))


def _followed(task: SpatialTask, state: State, which: tuple[SolidSpec, NDArray[np.int64]], rules: FollowRules) -> Array:
    """Return how far the grips of some worlds `(K,)`, all of one object, follow their paths `(K,)` [m]."""
    spec, worlds = which
    path = SpatialPath(task.path.moves[worlds], task.path.turns[worlds])
    now = state.joint_angles[worlds], state.object_pose[worlds]
    return follow_grips((task.hand, spec), now, (path, task.origin(state)[worlds], task.gravity[worlds]), rules)


def margin_at(path: SpatialPath, way: Array, margin: tuple[float, float]) -> Array:
    """Return what is kept at ways `(B,)` [m] along paths: of the margin [m, rad] what moves and what turns there."""
    rows = np.arange(len(way))
    below = np.maximum((path.way < way[:, None] - 1e-9).sum(axis=-1) - 1, 0)
    step = path.way[rows, below + 1] - path.way[rows, below]
    turned = TURN_ARM * np.linalg.norm(path.turns[rows, below + 1] - path.turns[rows, below], axis=-1)
    share = turned / np.maximum(step, 1e-9)
    return np.asarray((1 - share) * margin[0] + share * TURN_ARM * margin[1])
