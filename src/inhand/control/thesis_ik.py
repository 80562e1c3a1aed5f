"""The thesis's inverse kinematics controller, as thesis 3.2 describes it.

At step n the object pose of the path, T_obj_n, carries the current contact points to the expected ones,

    T_cp_exp = T_obj_n T_cp_curr                                                       (thesis eq. 3.2),

with the current contacts in the object's frame; damped least squares finds joint angles that bring each finger's
touching point there. A finger that lost contact moves towards the object's centre; the loop ends an episode whose
contact is not re-established in 20 simulation steps. There is no grip force and no feedback on the object's pose.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Task
from inhand.geometry import Array, inverse_transform, transform
from inhand.hands.kinematics import damped_least_squares, joint_positions, link_jacobian
from inhand.sim.state import State


@dataclass(frozen=True)
class ThesisIkConfig:
    """Numbers the thesis leaves open."""

    damping: float = 0.01
    """Damping of the least squares [m/rad], guessed."""
    iterations: int = 10
    """Steps of the least squares for one decision, guessed."""
    recovery: float = 0.002
    """Step towards the object's centre while a contact is lost [m], guessed."""


class ThesisIkController:
    """Follows its path open loop, one waypoint for each decision."""

    def __init__(self, task: Task, config: ThesisIkConfig | None = None) -> None:
        """Follow the task's paths."""
        self.config = config or ThesisIkConfig()
        self._task = task
        self._worlds = np.arange(task.n_worlds)
        self._last = task.path.poses.shape[1] - 1

    def begin(self, state: State) -> None:
        """Start from where the object is."""
        self._start = self._task.origin(state)
        self._step = np.zeros(state.n_worlds, dtype=np.int64)

    def act(self, state: State) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        hand = self._task.hand
        touching = state.touching
        self._step = np.minimum(self._step + touching.all(axis=-1), self._last)
        pose = state.pose
        expected_pose = self._start + self._task.path.poses[self._worlds, self._step]
        targets = state.joint_angles.copy()
        for i, place in enumerate(hand.slices):
            current = inverse_transform(pose, state.object_xy[:, i])
            expected = transform(expected_pose, current)
            way = pose[:, :2] - state.finger_xy[:, i]
            inward = way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-9)
            recovered = state.finger_xy[:, i] + self.config.recovery * inward
            goal = np.where(touching[:, i, None], expected, recovered)
            targets[:, place] = self._solve(state, i, goal)
        return targets

    def finished(self, state: State) -> NDArray[np.bool_]:
        """Return which worlds have come to the end of their path `(B,)`."""
        del state
        return np.asarray(self._step >= self._last)

    def _solve(self, state: State, index: int, goal: Array) -> Array:
        """Return joint angles `(B, n)` that bring a finger's touching point to its goal `(B, 2)`."""
        finger, place = self._task.hand.fingers[index], self._task.hand.slices[index]
        link = state.contact_links[:, index]
        angles = state.joint_angles[:, place]
        local = inverse_transform(_link_pose(joint_positions(finger, angles), angles, link), state.finger_xy[:, index])
        for _ in range(self.config.iterations):
            joints = joint_positions(finger, angles)
            point = transform(_link_pose(joints, angles, link), local)
            jacobian = link_jacobian(joints[:, :-1], point, link)
            angles = angles + damped_least_squares(jacobian, goal - point, self.config.damping)
        return angles


def _link_pose(joints: Array, angles: Array, link: NDArray[np.int64]) -> Array:
    """Return the poses `(B, 3)` of links `(B,)` in the palm frame."""
    worlds = np.arange(len(link))
    absolute = np.cumsum(angles, axis=-1)[worlds, link]
    return np.concatenate([joints[worlds, link], absolute[:, None]], axis=-1)
