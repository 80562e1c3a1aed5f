"""Where the fingers of a hand in space can touch an object at its start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from inhand.geometry import Array
from inhand.hands.spatial import kinematics
from inhand.hands.spatial.forces import GripRules
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.lattices import surface_points
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.rolling import Margins, Starts, Tracks, roll
from inhand.rotations import placed

if TYPE_CHECKING:
    from inhand.hands.spatial.tuples import Balancing, Stack

POSTURES = 3
"""Postures of a finger that are tried at one contact, those with most room to their joints' limits."""
RIM = 0.0025
"""First contacts tried on boxes and cylinders keep this off their edges [m]: planning's margin and a little to roll."""


def contacts_at(
    held: tuple[SpatialHand, SolidSpec], pose: Array, spacing: float, margins: Margins
) -> tuple[Starts, ...]:
    """Return the contacts that each finger reaches with its object at a pose `(7,)`, on a lattice of a spacing [m]."""
    hand, spec = held
    points, normals = surface_points(spec, spacing, RIM)
    rows, found = kinematics.rows_of(pose)[None, None], []
    for f, finger in enumerate(hand.fingers):
        goals = placed(pose, points + finger.tip_radius * normals)
        joints, misses = kinematics.inverse(finger, goals)
        contact, posture = _postures(finger.limits, joints, misses < 10 * kinematics.MISS)
        starts = Starts(points[contact], normals[contact], joints[contact, posture])
        good = roll(held, f, starts, rows, margins).lengths > 0
        found.append(Starts(starts.points[good], starts.normals[good], starts.joints[good]))
    return tuple(found)


def _postures(limits: Array, joints: Array, reached: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return contacts and postures, of those `(K, M, n)` that reach, that differ; most room in their joints first."""
    low, high = limits.T
    room = np.where(reached, np.minimum(joints - low, high - joints).min(axis=-1), -np.inf)
    contacts, chosen = [], []
    for _ in range(POSTURES):
        best = room.argmax(axis=1)
        left = np.isfinite(room.max(axis=1))
        contacts.append(np.flatnonzero(left))
        chosen.append(best[left])
        alike = np.abs(joints - joints[np.arange(len(joints)), best][:, None]).max(axis=-1) < kinematics.ALIKE
        room[alike] = -np.inf
    return np.concatenate(contacts), np.concatenate(chosen)


def stack_of(hand: SpatialHand, tracks: list[Tracks], margins: Margins) -> Stack:
    """Return tracks of all fingers side by side, with what their bodies keep off each other."""
    from inhand.hands.spatial.tuples import Stack

    most, bodies = max(len(each.lengths) for each in tracks), max(each.bodies.shape[2] for each in tracks)
    steps, n = tracks[0].points.shape[1], len(tracks)
    points, normals = np.zeros((2, n, most, steps, 3))
    shapes = np.zeros((n, most, steps, bodies, 7))
    for f, each in enumerate(tracks):
        points[f, : len(each.lengths)], normals[f, : len(each.lengths)] = each.points, each.normals
        shapes[f, : len(each.lengths), :, : each.bodies.shape[2]] = each.bodies
    return Stack(points, normals, shapes, gaps_of(hand, margins.fingers, bodies))


def gaps_of(hand: SpatialHand, wanted: float, bodies: int) -> Array:
    """Return how far bodies of two fingers must be apart `(N, N, M, M)` [m]: never more than in the straight hand.

    Bodies that overlap there, as knuckles do, may do so always; that is told by a gap below minus their radii.
    """
    straight = kinematics.bodies_of(hand, np.clip(np.zeros((1, hand.n_joints)), *hand.limits.T), bodies)[0]
    shares = np.linspace(0, 1, 11)[:, None]
    lines = (1 - shares) * straight[..., None, :3] + shares * straight[..., None, 3:6]
    apart = np.linalg.norm(lines[:, None, :, None, :, None] - lines[None, :, None, :, None, :], axis=-1).min(
        axis=(-2, -1)
    )
    room = apart - straight[:, None, :, None, 6] - straight[None, :, None, :, 6]
    return np.asarray(np.where(room > 0, np.minimum(wanted, room), -1.0))


def balancing_of(fingers: int, rules: GripRules) -> Balancing:
    """Return how the forces of some contacts are looked for, with room for one world."""
    from inhand.hands.spatial.balancing import Problem
    from inhand.hands.spatial.tuples import Balancing

    contacts, forces = np.zeros((2, 1, fingers, 3)), np.zeros((3, 1, fingers, 3))
    preferred, allowed = np.array([rules.grip]), np.array([rules.friction])
    wanted = np.zeros((1, 6)), np.zeros((1, 3)), preferred, allowed
    problem = Problem(contacts[0], contacts[1], *wanted, forces[0], forces[1], forces[2], np.zeros(1))
    return Balancing(problem, (rules.least, float(rules.rounds), rules.close))
