"""Grasps tried out in simulation: how a plan closes on the object, and which of several holds it best.

A search on paper does not know what closing the fingers does: the object turns a little, a contact settles elsewhere.
So the best few grasps of every path are closed in simulated worlds of their own, by the phases of every trial, and
carry the object to where the grip that is measured there is predicted to end. Of those that keep it the one that goes
farthest is taken.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inhand.control.controller import Task
from inhand.control.ik import IkConfig, IkController
from inhand.control.loop import Bench, simulate
from inhand.control.phases import Grasp
from inhand.control.trial import REACHED, TIME_OUT
from inhand.geometry import Array, Path, rotate, transform
from inhand.hands.grasp_search import GraspPlan, SearchConfig, moved_along
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec, convex_pieces
from inhand.hands.rolling import Starts, roll
from inhand.sim.names import MUJOCO

LOSS = 1.0
"""Way that losing the object costs a grasp [m]: more than any other grasp can gain."""
APPROACH = 5
"""Poses on the way from a path's start to where the object stands."""


def closing_joints(
    hand: HandSpec, spec: ObjectSpec, plans: Sequence[GraspPlan], poses: Array, starts: Array
) -> tuple[Array, Array]:
    """Return joint angles that stand off the contacts of plans and that press on them, each `(P, n_joints)` [rad].

    Args:
        hand: the hand.
        spec: the object.
        plans: a plan for each path.
        poses: the object's pose that each was planned for `(P, 3)`.
        starts: where the object stands `(P, 3)`; the fingers roll to it from the planned grasp.
    """
    way = poses[:, None] + np.linspace(0.0, 1.0, APPROACH)[:, None] * (starts - poses)[:, None]
    config = SearchConfig()
    opened, closed = np.empty((2, len(poses), hand.n_joints))
    for i, (finger, place) in enumerate(zip(hand.fingers, hand.slices, strict=True)):
        contacts = np.stack([plan.contacts[i] for plan in plans])
        planned = Starts(contacts, np.stack([plan.joints[place] for plan in plans]), convex_pieces(spec))
        tracks = roll(hand, finger, planned, way)
        rows, last = np.arange(len(poses)), np.where(tracks.held[:, -1], APPROACH - 1, 0)
        pose, joints = way[rows, last], tracks.joints[rows, last]
        points, normals = transform(pose, tracks.points[rows, last]), rotate(pose[:, 2], tracks.normals[rows, last])
        opened[:, place] = moved_along(finger, joints, points, config.opening * normals)
        closed[:, place] = moved_along(finger, joints, points, -config.squeeze * normals)
    return opened, closed


def best_plans(
    held: tuple[HandSpec, ObjectSpec],
    plans: Sequence[Sequence[GraspPlan]],
    poses: Array,
    starts: Array,
    config: IkConfig | None = None,
    *,
    engine: str = MUJOCO,
) -> list[GraspPlan]:
    """Return for every path the plan that carries its object farthest in simulation.

    Args:
        held: the hand and the object.
        plans: several plans for each of P paths.
        poses: the paths `(P, S, 3)`.
        starts: where each path's object stands `(P, 3)`.
        config: numbers of the expert that will carry the object.
        engine: the engine that it will be carried in.
    """
    hand, spec = held
    owner = np.repeat(np.arange(len(plans)), [len(group) for group in plans])
    each = [plan for group in plans for plan in group]
    opened, closed = closing_joints(hand, spec, each, poses[owner, 0], starts[owner])
    task = Task(hand, (spec,) * len(each), Path(poses[owner] - poses[owner, :1]))
    expert = IkController(task, config)
    _, found = simulate(task, Grasp(opened, closed), starts[owner], lambda _: expert, Bench(engine))
    value = expert.progress - np.where(np.isin(found.outcomes, (REACHED, TIME_OUT)), 0.0, LOSS)
    best = [int(np.flatnonzero(owner == number)[value[owner == number].argmax()]) for number in range(len(plans))]
    return [each[number] for number in best]
