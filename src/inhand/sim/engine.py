"""What the rest of the toolkit asks of a physics engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from inhand.errors import InputError
from inhand.geometry import Array
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.sim.names import Engine
from inhand.sim.snapshot import Snapshot, check_indices
from inhand.sim.state import State


class Simulator(Protocol):
    """B worlds, stepped together; their hands have the same joints and may differ in their numbers."""

    @property
    def engine(self) -> Engine:
        """Name of the engine."""

    @property
    def hand(self) -> HandSpec:
        """The hand of the first world, whose joints are those of all."""

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

    def measure(self) -> State:
        """Return the state of the present instant."""

    def snapshot(self) -> Snapshot:
        """Return copies of all that the worlds' future depends on, to put worlds back to it with `restore`."""

    def restore(self, worlds: NDArray[np.int64], snapshot: Snapshot, rows: NDArray[np.int64]) -> None:
        """Put worlds `(K,)` back to rows `(K,)` of a snapshot, without measuring; the others are not touched."""

    def push(self, worlds: NDArray[np.int64], impulse: Array) -> None:
        """Push the objects of worlds `(K,)` at their centres of mass with impulses `(K, 3)` [N s], at this instant."""


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


def check_impulse(worlds: NDArray[np.int64], n_worlds: int, impulse: Array) -> None:
    """Refuse pushes on worlds that are not there, of the wrong shape or with a value that is not finite.

    Raises:
        InputError: the text says which.
    """
    check_indices(worlds, n_worlds, "world")
    if impulse.shape != (len(worlds), 3) or not np.isfinite(impulse).all():
        raise InputError(
            f"impulses of shape {impulse.shape} for {len(worlds)} worlds; give finite values of shape"
            f" {(len(worlds), 3)} [N s]"
        )


def hand_of_each(hand: HandSpec | Sequence[HandSpec], n_worlds: int) -> tuple[HandSpec, ...]:
    """Return the hand of each world: one for all, or one for each.

    Raises:
        InputError: another number of hands, or hands of other joints.
    """
    hands = (hand,) * n_worlds if isinstance(hand, HandSpec) else tuple(hand)
    if len(hands) != n_worlds:
        raise InputError(f"{len(hands)} hands for {n_worlds} objects; give one for all or one each")
    links = {tuple(len(finger.links) for finger in each.fingers) for each in hands}
    if len(links) > 1:
        given = " and ".join(str(each) for each in sorted(links))
        raise InputError(f"hands of {given} links in one simulator; use one simulator for each number")
    return hands
