"""The thesis's rough grasp: both fingers on the middle of the object's sides (thesis 3.2)."""

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array, transform
from inhand.hands.grasp_search import GraspPlan
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, polygon
from inhand.hands.touch import touch


def rough_plan(hand: HandSpec, spec: ObjectSpec) -> GraspPlan:
    """Return the grasp that puts both fingers on the middle of the object's sides.

    Raises:
        InputError: a finger does not reach its side.
    """
    half = float(polygon(spec)[:, 0].max())
    contacts, normals = np.array([[-half, 0.0], [half, 0.0]]), np.array([[-1.0, 0.0], [1.0, 0.0]])
    return GraspPlan(contacts, normals, side_joints(hand, spec, 0.0), 1)


def side_joints(hand: HandSpec, spec: ObjectSpec, away: float) -> Array:
    """Return joint angles `(n_joints,)` [rad] that touch points so far off the object's sides [m], where it starts.

    Raises:
        InputError: a finger does not reach its side.
    """
    joints, pose, distance = np.empty(hand.n_joints), hand.start_pose, float(polygon(spec)[:, 0].max()) + away
    for sign, side, finger, place in zip((-1, 1), hand.finger_names, hand.fingers, hand.slices, strict=True):
        normal = np.array([sign, 0.0])
        found = touch(hand, finger, transform(pose, distance * normal), normal)
        if not found.reached:
            raise InputError(
                f"no start grasp holds object {spec.name!r} with hand {hand.name!r}: the {side} finger does not"
                " reach the middle of its side; use another object or hand, or the controller 'ik'"
            )
        joints[place] = found.joints
    return joints
