"""Outlines of a hand's links in their own frames, for the engines, the planners and the figures alike."""

from functools import cache

import numpy as np

from inhand.geometry import Array
from inhand.hands.hand import FingerSpec, HandSpec
from inhand.hands.kinematics import joint_positions, link_angles

CAP_CORNERS = 17
"""Corners of the polygon that stands for the fingertip's half ellipse."""


@cache
def link_outline(hand: HandSpec, finger: FingerSpec, link: int) -> Array:
    """Return a link's outline `(K, 2)` [m], counter-clockwise, from its joint at the origin along +y; read only.

    Where the finger has no outlines of its own, inner links are boxes, and the last link ends in half an ellipse across
    its width (the laboratory's fingertip).
    """
    half, start, length = hand.link_width / 2, hand.joint_gap, finger.links[link]
    if finger.outlines is not None:
        corners = np.array(finger.outlines[link])
    elif link < len(finger.links) - 1:
        corners = np.array([(-half, start), (half, start), (half, length), (-half, length)])
    else:
        angle = np.linspace(0, np.pi, CAP_CORNERS)
        cap = np.stack([half * np.cos(angle), length - hand.tip_length + hand.tip_length * np.sin(angle)], axis=-1)
        corners = np.concatenate([[(-half, start), (half, start)], cap])
    corners.setflags(write=False)
    return corners


def palm_outline(hand: HandSpec) -> Array:
    """Return the palm's outline `(K, 2)` [m] in the palm frame, counter-clockwise."""
    if hand.palm is not None:
        return np.array(hand.palm)
    half = hand.palm_width / 2 + hand.link_width / 2
    return np.array([(-half, -hand.palm_depth), (half, -hand.palm_depth), (half, 0.0), (-half, 0.0)])


def link_polygons(hand: HandSpec, finger: FingerSpec, joint_angles: Array) -> list[Array]:
    """Return the outlines of a finger's links in the palm frame, each `(..., K, 2)` [m]."""
    joints = joint_positions(finger, joint_angles)
    return [link_polygon(hand, finger, (joint_angles, joints), link) for link in range(len(finger.links))]


def link_polygon(hand: HandSpec, finger: FingerSpec, posture: tuple[Array, Array], link: int) -> Array:
    """Return the outline of one of a finger's links in the palm frame `(..., K, 2)` [m].

    The posture is joint angles `(..., n)` [rad] and where they put joints and tip `(..., n + 1, 2)` [m].
    """
    angles, joints = posture
    angle = link_angles(angles)[..., link]
    cos, sin, start = np.cos(angle), np.sin(angle), joints[..., link, :]
    # In memory x and y come first and the batch last, which is how `hands/polygons.py` computes.
    corners = link_outline(hand, finger, link).reshape(-1, 2, *(1,) * angle.ndim)
    x, y = corners[:, 0], corners[:, 1]
    placed = np.stack([cos * x - sin * y + start[..., 0], sin * x + cos * y + start[..., 1]])
    return np.moveaxis(placed, (0, 1), (-1, -2))
