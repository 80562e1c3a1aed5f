"""Any hand and object told alike by what a hand can know: the rows of `joint_rows.py`, of what is believed.

What an estimator believes of object and contacts takes the place of what is so; beside it rows have what encoders and
commands were before, of which friction, weight, play and delays of a world can be told. The object's velocity is
believed too, over some decisions; that of joints is a difference of readings.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from inhand.geometry import Array, transform
from inhand.sim.scene import DECISION_S
from inhand.sim.state import State, believed
from inhand.tasks.hand_arrays import SLOTS, slots_of, slotted
from inhand.tasks.joint_rows import COLUMNS, JOINTS, ROWS, joint_rows
from inhand.tasks.observations import Aim, Layout, Part, Scene
from inhand.tasks.past import LAGS, SENSES, Past

SPAN = 2
"""Which of the `LAGS` a joint's velocity is measured over: two decisions."""
MOVED, AHEAD = 1 / 30, 0.2
"""What becomes 1 of how far joints have moved since a lag, and of how far commands were ahead of them [rad]."""
BEFORE = (*[f"moved since {lag} decisions" for lag in LAGS[1:]], *[f"command ahead {lag} before" for lag in LAGS[1:]])
"""What a row has besides, each [rad]."""


def believed_state(past: Past, scene: Scene) -> State:
    """Return what is believed of the worlds as a state: each finger touches with its last link."""
    joints, lag = past.joint_angles, LAGS[SPAN]
    speed = (joints - past.joints[SPAN]) / (lag * DECISION_S)
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
    return np.concatenate([_of_state(joint_rows)(past, aim, scene), *before], axis=-1)


def _of_state(values: Callable[[State, Aim, Scene], Array]) -> Callable[[Past, Aim, Scene], Array]:
    """Return what gives the numbers of a part of a state for what is believed."""

    def found(past: Past, aim: Aim, scene: Scene) -> Array:
        return values(believed_state(past, scene), replace(aim, start=past.believed), scene)

    return found


WIDTH = len(COLUMNS) + len(BEFORE)
_OWN = ("frames", "age of the frames", "object at the start", "believed: how askew")
"""Parts of layout `senses` that it has as well."""
JOINT_SENSES = Layout(
    "joint-senses-1",
    (
        Part(", ".join([ROWS, *BEFORE]), sensed_rows, 1.0, fixed=WIDTH * SLOTS),
        *(replace(part, values=_of_state(part.values)) for part in JOINTS.parts[1:]),
        *(part for part in SENSES.parts if part.name.startswith(_OWN)),
    ),
    sensed=True,
    columns=WIDTH,
)
"""Layout `joints` as far as a hand can know, and what it was like before."""
