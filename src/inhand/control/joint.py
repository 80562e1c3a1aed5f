"""PID to given joint poses: the controller of the place and grasp phases (thesis 3.4)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import AnyTask
from inhand.control.seen import SENSED, Seen
from inhand.geometry import Array
from inhand.sim.state import State


@dataclass(frozen=True)
class PidConfig:
    """Gains of the joint controller, in servo targets [rad]."""

    proportional: float = 1.0
    """Share of the error commanded to the servo, whose own stiffness turns it into torque."""
    integral: float = 2.0
    """Growth of the command for each radian of error and second, once the set point has arrived [1/s]."""
    derivative: float = 0.0
    """Time by which joint velocity is damped beyond the servo's own damping [s]."""
    integral_limit: float = 0.02
    """Largest integral part [rad]."""
    speed: float = 1.2
    """Speed of the moving set point [rad/s]."""
    rest: float = 0.05
    """A joint slower than this is at rest [rad/s]."""


class JointPid:
    """Moves all joints to a goal `(B, n_joints)` along a straight line in joint space."""

    reads = SENSED

    def __init__(self, task: AnyTask, goal: Array, config: PidConfig | None = None) -> None:
        """Aim at joint angles `(B, n_joints)` [rad]."""
        self.config = config or PidConfig()
        self._period = task.control_period
        self._goal = goal
        self._set_point = goal
        self._integral = np.zeros_like(goal)

    def begin(self, state: State | Seen) -> None:
        """Start from where the joints are."""
        self._set_point = state.joint_angles
        self._integral = np.zeros_like(self._goal)

    def act(self, state: State | Seen) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        config = self.config
        way = self._goal - self._set_point
        longest = np.abs(way).max(axis=-1, keepdims=True)
        share = np.minimum(1.0, config.speed * self._period / np.maximum(longest, 1e-12))
        self._set_point = np.where(share == 1.0, self._goal, self._set_point + share * way)
        error = self._set_point - state.joint_angles
        limit, arrived = config.integral_limit, (share == 1.0)
        grown = self._integral + arrived * config.integral * self._period * error
        self._integral = np.clip(grown, -limit, limit)
        damped = config.derivative * state.joint_velocities
        return np.asarray(state.joint_angles + config.proportional * error + self._integral - damped)

    def finished(self, state: State | Seen) -> NDArray[np.bool_]:
        """Return which worlds have their set point at the goal and every joint at rest `(B,)`.

        The joints need not be at the goal: a goal inside the object is how fingers press on it.
        """
        arrived = (self._set_point == self._goal).all(axis=-1)
        resting = (np.abs(state.joint_velocities) < self.config.rest).all(axis=-1)
        return np.asarray(arrived & resting)
