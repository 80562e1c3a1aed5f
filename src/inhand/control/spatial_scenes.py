"""Hand and object of a trial in space as bodies to draw."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from inhand.control.spatial_trial import SpatialTrial
from inhand.geometry import Array, turn
from inhand.hands.spatial.hand import Box, SpatialFinger, SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.plots.spatial_replay import SolidFrame
from inhand.rotations import multiply, placed, quaternion_of

ROUND, HEIGHTS = 24, 12
"""Corners round a curved surface, and of one from pole to pole."""


def solid_frames(trial: SpatialTrial, rows: Sequence[int], origin: Array) -> list[SolidFrame]:
    """Return hand and object at some rows, in mm from an origin `(3,)` [m] of the palm frame."""
    hand, spec = trial.passport.hand, trial.passport.object
    rods, fingers = rods_at(hand, trial.joint_angles[list(rows)])
    rods[..., :3] -= origin
    rods[..., 3:6] -= origin
    palm = tuple(1e3 * (face - origin) for face in box_faces(hand.palm))
    faces, frames = faces_of(spec), []
    for row, lines in zip(rows, rods, strict=True):
        body = tuple(1e3 * (placed(trial.object_pose[row], face) - origin) for face in faces)
        frames.append(SolidFrame(1e3 * lines, fingers, body, palm))
    return frames


def rods_at(hand: SpatialHand, joints: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return ends and radii of links and tips `(T, R, 7)` [m] at joint angles `(T, n)` [rad], and their fingers `(R,)`.

    Tips are balls, both ends of which are one.
    """
    found: list[Array] = []
    whose: list[int] = []
    for number, (finger, own) in enumerate(zip(hand.fingers, hand.slices, strict=True)):
        rods = _finger_rods(finger, joints[:, own])
        found += rods
        whose += [number] * len(rods)
    return np.stack(found, axis=1), np.array(whose)


def _finger_rods(finger: SpatialFinger, joints: Array) -> list[Array]:
    """Return ends and radius `(T, 7)` of each capsule of a finger, and of its tip."""
    place, turned = np.zeros((len(joints), 3)), np.tile([1.0, 0.0, 0.0, 0.0], (len(joints), 1))
    rods: list[Array] = []

    def rod(start: Array, end: Array, radius: float) -> None:
        ends = [place + turn(turned, np.broadcast_to(point, place.shape)) for point in (start, end)]
        rods.append(np.concatenate([*ends, np.full((len(joints), 1), radius)], axis=-1))

    for k, link in enumerate(finger.links):
        place = place + turn(turned, np.broadcast_to(link.origin, place.shape))
        turned = multiply(turned, np.broadcast_to(link.turn, turned.shape))
        turned = multiply(turned, quaternion_of(joints[:, k, None] * np.array(link.axis)))
        for capsule in link.capsules:
            rod(np.array(capsule.start), np.array(capsule.end), capsule.radius)
    rod(np.array(finger.tip), np.array(finger.tip), finger.tip_radius)
    return rods


def box_faces(box: Box) -> list[Array]:
    """Return the corners `(4, 3)` [m] of the faces of a box along the axes."""
    return [face + np.array(box.centre) for face in _cuboid(np.array(box.half))]


def faces_of(spec: SolidSpec) -> list[Array]:
    """Return the corners `(K, 3)` [m] of an object's faces in its own frame, counter-clockwise seen from outside."""
    half = np.array(spec.half)
    if spec.mesh is not None:
        corners = np.array(spec.mesh.corners)
        return [corners[list(triangle)] for triangle in spec.mesh.triangles]
    if spec.shape == "box":
        return _cuboid(half)
    around = np.arange(ROUND) * 2 * np.pi / ROUND
    rim = np.stack([np.cos(around), np.sin(around), np.zeros(ROUND)], axis=-1)
    if spec.shape == "cylinder":
        low, high = rim * half - (0, 0, half[2]), rim * half + (0, 0, half[2])
        sides = [np.stack([low[k - 1], low[k], high[k], high[k - 1]]) for k in range(ROUND)]
        return [*sides, high, low[::-1]]
    heights = np.linspace(-np.pi / 2, np.pi / 2, HEIGHTS + 1)
    rings = [half * (np.cos(h) * rim + np.array([0.0, 0.0, np.sin(h)])) for h in heights]
    return [
        _without_repeats(np.stack([low[k - 1], low[k], high[k], high[k - 1]]))
        for low, high in pairwise(rings)
        for k in range(ROUND)
    ]


def _without_repeats(corners: Array) -> Array:
    """Return the corners of a face without those that repeat the one before, as at a pole."""
    away = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=-1) > 1e-9
    return np.asarray(corners[away])


def _cuboid(half: Array) -> list[Array]:
    """Return the six faces of a box about the origin."""
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    faces = []
    for axis in range(3):
        for way in (-1, 1):
            mine = signs[signs[:, axis] == way]
            order = ConvexHull(np.delete(mine, axis, axis=1)).vertices  # counter-clockwise seen along the other axes
            outward = (way > 0) == (axis != 1)
            faces.append((mine[order] if outward else mine[order[::-1]]) * half)
    return faces
