"""Any hand and object told alike by what a hand can know: the rows of `joint_rows.py`, of what is believed.

What an estimator believes of object and contacts takes the place of what is so; beside it rows have what encoders and
commands were before, of which friction, weight, play and delays of a world can be told. The object's velocity is
believed too, over some decisions; that of joints is a difference of readings.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inhand.geometry import Array, transform
from inhand.once import once
from inhand.sim.state import State, believed
from inhand.tasks.hand_arrays import SLOTS, slots_of, slotted
from inhand.tasks.joint_rows import COLUMNS, JOINTS, ROWS, joint_rows
from inhand.tasks.observations import Aim, Layout, Part, Scene
from inhand.tasks.past import LAGS, SENSES, Past, of_believed, speeds_of

MOVED, AHEAD = 1 / 30, 0.2
"""What becomes 1 of how far joints have moved since a lag, and of how far commands were ahead of them [rad]."""
BEFORE = (*[f"moved since {lag} decisions" for lag in LAGS[1:]], *[f"command ahead {lag} before" for lag in LAGS[1:]])
"""What a row has besides, each [rad]."""


@once
def believed_state(past: Past, scene: Scene) -> State:
    """Return what is believed of the worlds as a state: each finger touches with its last link."""
    joints, speed = past.joint_angles, speeds_of(past)
    last = np.array([len(finger.links) - 1 for finger in scene.hand.fingers])
    links, points = np.tile(last, (past.n_worlds, 1)), transform(past.pose[:, None], past.points)
    time = np.zeros(past.n_worlds)
    return believed(time, (past.pose, past.velocity), (joints, speed, past.targets), links, points)


def sensed_rows(past: Past, aim: Aim, scene: Scene) -> Array:
    """Return the rows of a batch, column by column `(B, columns * SLOTS)`."""
    places = slots_of(scene.hand)
    moved = (past.joints[0] - past.joints[1:]) / MOVED
    ahead = (past.commands[1:] - past.joints[1:]) / AHEAD
    before = [slotted(each, places) for each in (*moved, *ahead)]
    return np.concatenate([of_believed(joint_rows, believed_state)(past, aim, scene), *before], axis=-1)


WIDTH = len(COLUMNS) + len(BEFORE)
_OWN = ("frames", "age of the frames", "object at the start", "believed: how askew")
"""Parts of layout `senses` that it has as well."""
JOINT_SENSES = Layout(
    "joint-senses-1",
    (
        Part(", ".join([ROWS, *BEFORE]), sensed_rows, 1.0, fixed=WIDTH * SLOTS),
        *(replace(part, values=of_believed(part.values, believed_state)) for part in JOINTS.parts[1:]),
        *(part for part in SENSES.parts if part.name.startswith(_OWN)),
    ),
    sensed=True,
    columns=WIDTH,
)
"""Layout `joints` as far as a hand can know, and what it was like before."""
