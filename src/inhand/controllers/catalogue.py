"""Controllers by name: how each prepares a grasp, and what it manipulates with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal, Protocol

import numpy as np

from inhand.controllers.controller import Controller, Task
from inhand.controllers.grasp_search import GraspPlan, SearchConfig, plan_grasps
from inhand.controllers.ik import IkConfig, IkController
from inhand.controllers.rehearsal import best_plans, closing_joints
from inhand.controllers.thesis_ik import ThesisIkController
from inhand.errors import InputError, near_matches
from inhand.geometry import Array, transform
from inhand.sim.hands import FINGER_NAMES, HandSpec
from inhand.sim.objects import ObjectSpec, polygon
from inhand.sim.touch import touch


@dataclass(frozen=True)
class Grasp:
    """Joint angles that the place and grasp phases move to."""

    opened: Array
    """Fingers stand off the object `(B, n_joints)` [rad]."""
    closed: Array
    """Fingers press on the object `(B, n_joints)` [rad]."""


class Planner(Protocol):
    """Chooses a grasp for every path."""

    def __call__(self, hand: HandSpec, spec: ObjectSpec, poses: Array, starts: Array | None = None) -> Grasp:
        """Return a grasp for every path of object poses `(P, S, 3)` in the palm frame.

        Args:
            hand: the hand.
            spec: the object.
            poses: the paths.
            starts: where each path's object stands `(P, 3)`; None where its path starts.
        """


@dataclass(frozen=True)
class ControllerEntry:
    """One controller of the toolkit."""

    name: str
    """What the command line calls it."""
    summary: str
    """One line for lists."""
    grasp: Planner
    """Chooses where the fingers hold the object."""
    manipulate: Callable[[Task], Controller]
    """Makes the controller of the manipulation phase."""


def planned_grasp(
    hand: HandSpec,
    spec: ObjectSpec,
    poses: Array,
    starts: Array | None = None,
    config: tuple[SearchConfig | None, IkConfig | None] = (None, None),
) -> Grasp:
    """Return the grasps of the contact search, tried out in simulation; equal paths are searched once.

    Where an object stands elsewhere than its path starts, the fingers go to it from there.
    """
    distinct, index = np.unique(poses[:, ::PLAN_EVERY], axis=0, return_inverse=True)
    plans = plan_grasps(hand, spec, distinct, config[0])
    starts = poses[:, 0] if starts is None else starts
    best = best_plans((hand, spec), [plans[k] for k in index], distinct[index], starts, config[1])
    return Grasp(*closing_joints(hand, spec, best, poses[:, 0], starts))


def direction_plans(hand: HandSpec, spec: ObjectSpec, poses: Array) -> list[GraspPlan]:
    """Return for every path `(P, S, 3)` the planned grasp that is best where the object stands exactly at its start.

    One plan serves every trial of a direction, which is what a learned controller trains and runs with.
    """
    distinct, index = np.unique(poses[:, ::PLAN_EVERY], axis=0, return_inverse=True)
    best = best_plans((hand, spec), plan_grasps(hand, spec, distinct), distinct, distinct[:, 0])
    return [best[k] for k in index]


def rough_plan(hand: HandSpec, spec: ObjectSpec) -> GraspPlan:
    """Return the grasp that puts both fingers on the middle of the object's sides (thesis 3.2).

    Raises:
        InputError: a finger does not reach its side.
    """
    half = float(polygon(spec)[:, 0].max())
    contacts, normals = np.array([[-half, 0.0], [half, 0.0]]), np.array([[-1.0, 0.0], [1.0, 0.0]])
    return GraspPlan(contacts, normals, _sides(hand, spec, half), 1)


def rough_grasp(hand: HandSpec, spec: ObjectSpec, poses: Array, starts: Array | None = None) -> Grasp:
    """Return the same grasp for every path and start: both fingers on the middle of the object's sides (thesis 3.2).

    Raises:
        InputError: a finger does not reach its side.
    """
    del starts
    half, count = float(polygon(spec)[:, 0].max()), len(poses)
    opened, closed = (_sides(hand, spec, half + away) for away in (SearchConfig().opening, -ROUGH_SQUEEZE))
    return Grasp(np.tile(opened, (count, 1)), np.tile(closed, (count, 1)))


def _sides(hand: HandSpec, spec: ObjectSpec, distance: float) -> Array:
    """Return joint angles `(n_joints,)` that touch points left and right of the object's start at a distance [m]."""
    joints, pose = np.empty(hand.n_joints), np.array([*hand.start_position, 0.0])
    for sign, side, finger, place in zip((-1, 1), FINGER_NAMES, hand.fingers, hand.slices, strict=True):
        normal = np.array([sign, 0.0])
        found = touch(hand, finger, transform(pose, distance * normal), normal)
        if not found.reached:
            raise InputError(
                f"no start grasp holds object {spec.name!r} with hand {hand.name!r}: the {side} finger does not"
                " reach the middle of its side; use another object or hand, or the controller 'ik'"
            )
        joints[place] = found.joints
    return joints


GraspKind = Literal["planned", "rough"]
"""How an object is held: as the contact search plans it, or on the middle of its sides."""
PLAN_EVERY = 3
"""The contact search looks at every third waypoint of a path."""
ROUGH_SQUEEZE = 0.001
"""How far inside the object the thesis's rough grasp aims [m], guessed: enough to touch."""

CAUTIOUS = (SearchConfig(cone=0.7, start_cone=0.65), IkConfig(friction_share=0.8, margin=(0.004, 0.16)))
"""What `ik-cautious` uses of the friction, and how far it stays from the end."""

CONTROLLERS = {
    entry.name: entry
    for entry in (
        ControllerEntry(
            "ik",
            "the expert: searched contacts, commanded grip force, feedback on the object's pose",
            planned_grasp,
            IkController,
        ),
        ControllerEntry(
            "ik-cautious",
            "the expert with margins wide enough for another engine's contacts: shorter, harder to lose",
            partial(planned_grasp, config=CAUTIOUS),
            partial(IkController, config=CAUTIOUS[1]),
        ),
        ControllerEntry(
            "thesis-ik",
            "inverse kinematics exactly as thesis 3.2: expected contacts, open loop, no grip force",
            rough_grasp,
            ThesisIkController,
        ),
    )
}


def find_controller(name: str) -> ControllerEntry:
    """Return a controller of the catalogue.

    Raises:
        InputError: there is none of that name; the text offers near matches.
    """
    if name not in CONTROLLERS:
        raise InputError(
            f"unknown controller {name!r}{near_matches(name, CONTROLLERS)}; allowed are {', '.join(CONTROLLERS)}"
        )
    return CONTROLLERS[name]
