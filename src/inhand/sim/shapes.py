"""Outlines of a hand's links in their own frames, for the engines, the planners and the figures alike."""

from __future__ import annotations

import numpy as np

from inhand.geometry import Array, transform
from inhand.sim.hands import FingerSpec, HandSpec
from inhand.sim.kinematics import joint_positions, link_angles

CAP_CORNERS = 17
"""Corners of the polygon that stands for the fingertip's half ellipse."""


def link_outline(hand: HandSpec, finger: FingerSpec, link: int) -> Array:
    """Return a link's outline `(K, 2)` [m], counter-clockwise, from its joint at the origin along +y.

    Where the finger has no outlines of its own, inner links are boxes, and the last link ends in half an ellipse across
    its width (the laboratory's fingertip).
    """
    if finger.outlines is not None:
        return np.array(finger.outlines[link])
    half, start, length = hand.link_width / 2, hand.joint_gap, finger.links[link]
    if link < len(finger.links) - 1:
        return np.array([(-half, start), (half, start), (half, length), (-half, length)])
    angle = np.linspace(0, np.pi, CAP_CORNERS)
    cap = np.stack([half * np.cos(angle), length - hand.tip_length + hand.tip_length * np.sin(angle)], axis=-1)
    return np.concatenate([[(-half, start), (half, start)], cap])


def palm_outline(hand: HandSpec) -> Array:
    """Return the palm's outline `(K, 2)` [m] in the palm frame, counter-clockwise."""
    if hand.palm is not None:
        return np.array(hand.palm)
    half = hand.palm_width / 2 + hand.link_width / 2
    return np.array([(-half, -hand.palm_depth), (half, -hand.palm_depth), (half, 0.0), (-half, 0.0)])


def link_polygons(hand: HandSpec, finger: FingerSpec, joint_angles: Array) -> list[Array]:
    """Return the outlines of a finger's links in the palm frame, each `(..., K, 2)` [m]."""
    joints, angles = joint_positions(finger, joint_angles), link_angles(joint_angles)
    outlines = []
    for i in range(len(finger.links)):
        shape = link_outline(hand, finger, i)
        pose = np.concatenate([joints[..., i, :], angles[..., i : i + 1]], axis=-1)
        outlines.append(transform(pose[..., None, :], shape))
    return outlines
