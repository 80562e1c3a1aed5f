"""Table 3.1 of the thesis carried over into space: what its six groups of numbers are with a hand of any fingers.

The angle of a direction is a unit vector, that of the object two of its axes, and points have a height. A turn about an
axis, which the thesis has not, is told as one more vector. Nothing else is: neither gravity nor weight, velocities,
commands or contacts, of which table 3.1 has none.
"""

import numpy as np

from inhand.geometry import Array
from inhand.hands.spatial.kinematics import place
from inhand.sim.state import State
from inhand.tasks.observations import THESIS, AnyHand, Layout, Part, Scene, by_rank
from inhand.tasks.spatial.aims import SpatialAim
from inhand.tasks.spatial.rows import ASKED, object_axes

BEYOND = 1.5
"""Reach by the length of the fingers, which stand around the palm's middle (guessed)."""
TABLE = {part.name: part for part in THESIS.parts}
"""The parts of table 3.1 in the plane; some are the same here."""


def reach_in_space(hand: AnyHand) -> float:
    """Return about how far from the palm's middle a fingertip can come [m]."""
    return BEYOND * float(hand.finger_length)


def link_ends(state: State, _aim: SpatialAim, scene: Scene) -> Array:
    """Return the ends of the links, the next joint or the centre of the fingertip `(B, 3 * n_joints)` [m]."""
    hand, told = scene.hand, place(scene.hand, state.joint_angles)
    ends = np.empty((state.n_worlds, hand.n_joints, 3))
    for i, own in enumerate(hand.slices):
        ends[:, own.start : own.stop - 1] = told.places[:, own.start + 1 : own.stop]
        ends[:, own.stop - 1] = told.tips[:, i]
    return ends[:, by_rank(hand)].reshape(state.n_worlds, -1)


SPACE_THESIS = Layout(
    "space-thesis-1",
    (
        *ASKED[:2],
        Part(
            "object position x, y, z [m]",
            lambda state, _aim, _scene: state.object_pose[:, :3],
            lambda hand: reach_in_space(hand) * np.array([1.0, 1.0, 0.5]),
            lambda hand: reach_in_space(hand) * np.array([0.0, 0.0, 0.5]),
            fixed=3,
        ),
        Part("the object's x and y axes", object_axes, 1.0, fixed=6),
        TABLE["object size l, b, h [m]"],
        Part(
            "distance of each link to the object [m]",
            lambda state, _aim, scene: state.link_gaps[:, by_rank(scene.hand)],
            lambda hand: 0.5 * reach_in_space(hand),
            lambda hand: 0.5 * reach_in_space(hand),
            for_joint=1,
        ),
        Part("end of each link x, y, z [m]", link_ends, reach_in_space, for_joint=3),
        TABLE["joint angles [rad]"],
    ),
    space=True,
)
"""63 numbers with three fingers of three joints, each normalised over its range (thesis 3.3.1)."""
