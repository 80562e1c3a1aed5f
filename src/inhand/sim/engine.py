"""What the rest of the toolkit asks of a physics engine."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.state import State


class Simulator(Protocol):
    """B worlds of one hand, stepped together."""

    @property
    def hand(self) -> HandSpec:
        """The hand of every world."""

    @property
    def objects(self) -> tuple[ObjectSpec, ...]:
        """The object of each world."""

    @property
    def timestep(self) -> float:
        """Length of a physics step [s]."""

    def reset(self, object_pose: Array, joint_angles: Array) -> State:
        """Place objects `(B, 3)` and joints `(B, n)` at rest and return what is measured there."""

    def step(self, targets: Array, substeps: int) -> State:
        """Hold joint targets `(B, n)` [rad] for some physics steps and measure the instant after the last.

        A world that diverges ends no batch: it is put back and told in `State.diverged`.
        """


def check_start(object_pose: Array, n_worlds: int) -> None:
    """Refuse start poses of the wrong shape or with a value that is not finite.

    Raises:
        InputError: the text names the world.
    """
    if object_pose.shape != (n_worlds, 3):
        raise InputError(f"object poses of shape {object_pose.shape}; {n_worlds} worlds need {(n_worlds, 3)}")
    if not np.isfinite(object_pose).all():
        world = np.argwhere(~np.isfinite(object_pose))[0, 0]
        raise InputError(f"the object's start pose in world {world} is {object_pose[world]}; give finite x, y, theta")


def check_substeps(substeps: int) -> None:
    """Refuse a control step of no physics steps.

    Raises:
        InputError: fewer than one.
    """
    if substeps < 1:
        raise InputError(f"substeps {substeps}: a control step needs at least one physics step")


def check_targets(targets: Array, n_worlds: int, n_joints: int) -> None:
    """Refuse commands of the wrong shape or with a value that is not finite.

    Raises:
        InputError: the text names the world and the joint.
    """
    if targets.shape != (n_worlds, n_joints):
        raise InputError(f"joint targets of shape {targets.shape}; {n_worlds} worlds need {(n_worlds, n_joints)}")
    if not np.isfinite(targets).all():
        world, joint = np.argwhere(~np.isfinite(targets))[0]
        raise InputError(
            f"the target of joint {joint} in world {world} is {targets[world, joint]}; commands must be finite"
            " joint angles [rad]: look for a division by zero or a missing value in the controller"
        )
