"""What a learned controller in space sees of what a hand can know: layout `space` of what is believed, and a history.

What an estimator believes of object and contacts takes the place of what is so, the object's mass and friction are
those of the drawing; beside it stands what encoders and commands were before, of which weight, friction, play and
delays of a world can be told, and how old frames are.
"""

from dataclasses import replace

import numpy as np

from inhand.geometry import Array
from inhand.once import once
from inhand.rotations import placed
from inhand.sim.scene import DECISION_S
from inhand.sim.state import SpatialState, believed_in_space
from inhand.tasks.observations import TRUTH, AnyAim, Layout, Scene
from inhand.tasks.past import SENSES, Past, of_believed, speeds_of
from inhand.tasks.spatial.rows import SPACE


@once
def believed_now(past: Past, scene: Scene) -> SpatialState:
    """Return what is believed of the worlds as a state: each finger touches with its tip."""
    last = np.tile([len(finger.links) - 1 for finger in scene.hand.fingers], (past.n_worlds, 1))
    joints = past.joint_angles, speeds_of(past), past.targets
    contacts = last, placed(past.pose[:, None], past.points), past.askew
    return believed_in_space(np.zeros(past.n_worlds), (past.pose, past.velocity), joints, contacts)


YOUNGEST = DECISION_S
"""Age that a frame is told to have at least [s]: none of `field` is younger, so what a policy makes of 0 is chance.
Told 0 in undisturbed worlds one pressed with 11 N and went 11 mm aside."""


def _ages(past: Past, _aim: AnyAim, _scene: Scene) -> Array:
    return np.maximum(past.ages, YOUNGEST).T


_AGES = "age of the frames"
_BEFORE = ("encoders since then", "commands ahead", _AGES)
"""Parts of layout `senses` that it has as well."""
SPACE_SENSES = Layout(
    "space-senses-1",
    (
        *(replace(part, values=of_believed(part.values, believed_now)) for part in SPACE.parts),
        *(
            replace(part, values=_ages) if part.name.startswith(_AGES) else part
            for part in SENSES.parts
            if part.name.startswith(_BEFORE)
        ),
    ),
    sensed=True,
    space=True,
)
"""257 numbers with three fingers of three joints."""
SPACE_TRUTH = Layout("space-truth-1", (*SPACE.parts, TRUTH.parts[-1]), space=True)
"""Layout `space` of what is so, with what differs between worlds: what critics may see."""
