"""The expert: inverse kinematics with a commanded grip force and feedback on the object's pose.

Each control step moves a set point along the path and asks for the object's displacement that feedback wants,

    d = kp e + ki integral(e) dt,   e = pose_reference - pose_object.

The point of each finger that touches is to move as the object there should, dx = d_xy + d_theta x (c - p), solved by
damped least squares for the joints, starting from the measured contact, so that sliding and rolling are never
fought. Added to it are what the servos' damping needs to follow the path's speed and the joint torques
tau = J' f of the grip force f along the line between the contacts:

    targets = q + DLS(J, dx) + (damping / stiffness) DLS(J, v) + J' f / stiffness.
"""

from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from inhand.control.controller import Carrying, Task
from inhand.control.follow import follow_limit
from inhand.control.seen import PRIVILEGED
from inhand.geometry import Array, compose, from_parts, rotate, wrap_angle
from inhand.hands.kinematics import damped_least_squares, joint_positions, link_jacobian
from inhand.hands.spatial import kinematics as spatial
from inhand.sim.state import State


@dataclass(frozen=True)
class LawConfig:
    """Numbers of the expert in the plane and in space; lengths in metres, angles in radians."""

    speed: float = 0.04
    """Speed of the set point along the path [m/s]; a turn counts as an arc at `TURN_ARM`."""
    acceleration: float = 0.1
    """Acceleration of the set point [m/s^2]."""
    proportional: float = 1.5
    """Wanted displacement for each metre (radian) of error."""
    integral: float = 4.0
    """Growth of the wanted displacement for each metre (radian) of error and second [1/s]."""
    lag: float = 0.004
    """The set point waits where the object is farther than this behind it [m]."""
    damping: float = 0.005
    """Damping of the least squares [m/rad]."""
    posture: float = 0.02
    """Share of the way back to the start posture that a finger's spare joints are asked to take."""
    settle: float = 0.3
    """Time for which the object is held at the end of its path [s]."""


@dataclass(frozen=True)
class IkConfig(LawConfig):
    """Numbers of the expert in the plane."""

    grip: float = 1.5
    """Grip force [N]."""
    integral_limit: tuple[float, float, float] = (0.008, 0.008, 0.2)
    """Largest integral part in x, y [m] and theta [rad]."""
    along: tuple[float, float] = (1.0, 1.0)
    """Shares of the proportional and of the integral feedback that are given along the path, where the friction cones
    end: across it and in rotation all is."""
    lasting: bool = True
    """Whether the integral part stays where the set point slows down, or is what drags on a moving object alone."""
    margin: tuple[float, float] = (0.002, 0.16)
    """Distance [m], and where the path turns the object angle [rad], kept from where the grip is predicted to end."""
    friction_share: float = 0.96
    """Share of the friction coefficient that the predicted grip may use."""
    push: float = 0.0
    """Force on the object along its path, where its position is not controlled then [N]: hybrid force/position control,
    for pushing against what resists."""


C = TypeVar("C", bound=LawConfig)


class Expert(Generic[C]):
    """What the expert is in the plane and in space: a set point that goes along the path, and the law of a finger."""

    reads = PRIVILEGED

    def __init__(self, task: Carrying[Any, Any, Any], config: C) -> None:
        """Carry objects along the task's paths."""
        self.config, self._period = config, task.control_period
        self.limit, self.progress, self.held, self._speed = np.zeros((4, task.n_worlds))
        """Way along each path to which the set point goes `(B,)` [m], how far it has gone [m], for how long it has been
        at the end of its way [s], and its speed [m/s]."""

    def finished(self, state: State) -> NDArray[np.bool_]:
        """Return which worlds have held the end of their path for a while `(B,)`."""
        del state
        return np.asarray(self.held >= self.config.settle)

    def _set_off(self, limit: Array) -> None:
        """Put the set points at the start of their ways, which end at a limit `(B,)` [m]."""
        self.limit = limit
        self.progress, self.held, self._speed = np.zeros((3, len(limit)))

    def _go_on(self, behind: Array) -> None:
        """Move the set points on, unless objects are too far behind them `(B,)` [m]."""
        config, period = self.config, self._period
        room = np.maximum(self.limit - self.progress, 0.0)
        brake = np.sqrt(2 * config.acceleration * room)
        speed = np.where(behind > config.lag, 0.0, np.minimum(config.speed, brake))
        self._speed = np.minimum(self._speed + config.acceleration * period, speed)
        self.progress = np.minimum(self.progress + self._speed * period, self.limit)
        self.held = np.where(room < 2e-4, self.held + period, 0.0)

    def _summed(self, integral: Array, error: Array, limit: Array) -> Array:
        """Return the integral part of the feedback after one more decision with an error, up to a limit."""
        return np.clip(integral + self.config.integral * self._period * error, -limit, limit)


class Springs(Protocol):
    """What tells how servos give way: a hand, or the servos of worlds that differ."""

    @property
    def stiffness(self) -> float | Array:
        """Of each joint [N m/rad]."""

    @property
    def damping(self) -> float | Array:
        """The same of speeds [N m s/rad]."""


def finger_law(
    hand: Springs,
    jacobian: Array,
    moves: tuple[Array, Array],
    force: Array,
    damping: float,
    *,
    posture: Array | None = None,
) -> Array:
    """Return what a finger's targets are beyond its joint angles `(B, n)` [rad], in the plane or in space.

    Args:
        hand: whose servos it has, or those of each world, numbers `(B, 1)`.
        jacobian: of its contact `(B, d, n)`, d = 2 in the plane and 3 in space.
        moves: how the contact is to move now [m], and its velocity [m/s], `(B, d)` each.
        force: on the object there `(B, d)` [N].
        damping: of the least squares [m/rad].
        posture: where spare joints drift to `(B, n)` [rad].
    """
    solve = damped_least_squares if jacobian.shape[-2] == 2 else spatial.damped_least_squares
    step, speed = solve(jacobian, moves[0], damping, posture), solve(jacobian, moves[1], damping)
    torque = (jacobian * force[..., None]).sum(axis=-2)
    return np.asarray(step + (hand.damping * speed + torque) / hand.stiffness)


class IkController(Expert[IkConfig]):
    """Carries the object of every world along its path as far as its grip can follow, and holds it there."""

    def __init__(self, task: Task, config: IkConfig | None = None) -> None:
        """Carry objects along the task's paths."""
        super().__init__(task, config or IkConfig())
        self._task = task

    def begin(self, state: State) -> None:
        """Start from the grip that holds the object now, and plan how far it can go."""
        config = self.config
        known = self._task.distance
        if known is None or np.isnan(known).any():
            end = follow_limit(self._task, state, config.friction_share, config.margin)
            known = end if known is None else np.where(np.isnan(known), end, known)
        self._set_off(known)
        n = state.n_worlds
        way = self._task.path.poses[:, -1, :2]
        self._ahead = way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-9)
        self._start = self._task.origin(state)
        self._rest = state.joint_angles
        self._point = self._set_point()
        self._integral = np.zeros((n, 3))
        self._heading = np.zeros((n, 2))

    def act(self, state: State) -> Array:
        """Return joint targets `(B, n_joints)` [rad]."""
        config, hand = self.config, self._task.hand
        pose = state.pose
        wanted, velocity = self._wanted(pose)
        push = config.push * self._ahead
        if config.push:
            wanted = _along(wanted, self._ahead, 0.0)
        targets = state.joint_angles.copy()
        line = state.finger_xy[:, 1] - state.finger_xy[:, 0]
        line /= np.maximum(np.linalg.norm(line, axis=-1, keepdims=True), 1e-9)
        for i, (finger, place) in enumerate(zip(hand.fingers, hand.slices, strict=True)):
            angles = state.joint_angles[:, place]
            point = state.finger_xy[:, i]
            jacobian = link_jacobian(joint_positions(finger, angles)[:, :-1], point, state.contact_links[:, i])
            arm = point - pose[:, :2]
            step = carried_point(wanted, arm) + np.maximum(state.gaps[:, i], 0.0)[:, None] * _towards(state, i)
            posture = config.posture * (self._rest[:, place] - angles) if len(finger.links) > 2 else None
            force = config.grip * line * (1 - 2 * i) + push / len(hand.fingers)
            moves = step, carried_point(velocity, arm)
            targets[:, place] += finger_law(hand, jacobian, moves, force, config.damping, posture=posture)
        return targets

    def _wanted(self, pose: Array) -> tuple[Array, Array]:
        """Move the set point; return the wanted displacement of the object and its velocity, each `(B, 3)`."""
        config, before = self.config, self._point
        self._go_on(np.linalg.norm(before[:, :2] - pose[:, :2], axis=-1))
        self._point = self._set_point()
        error = self._point - pose
        error[:, 2] = wrap_angle(error[:, 2])
        now, lasting = self._shared(error, self._point[:, :2] - before[:, :2])
        self._integral = self._summed(self._integral, lasting, np.array(config.integral_limit))
        kept = 1.0 if config.lasting else (self._speed / config.speed)[:, None]
        return config.proportional * now + kept * self._integral, (self._point - before) / self._period

    def _shared(self, error: Array, moved: Array) -> tuple[Array, Array]:
        """Return what the proportional and the integral part are given of errors, where set points have moved on."""
        if self.config.along == IkConfig.along:
            return error, error
        size = np.linalg.norm(moved, axis=-1, keepdims=True)
        self._heading = np.where(size > 0, moved / np.maximum(size, 1e-12), self._heading)
        now, lasting = (_along(error, self._heading, share) for share in self.config.along)
        return now, lasting

    def _set_point(self) -> Array:
        """Return the pose that each set point has come to `(B, 3)`."""
        return compose(self._start, _in_start_frame(self._start, self._task.path.at(self.progress)))


def _along(motion: Array, heading: Array, share: float) -> Array:
    """Return motions `(B, 3)` with a share of their part along unit vectors `(B, 2)`."""
    part = (motion[:, :2] * heading).sum(axis=-1, keepdims=True) * heading
    return np.concatenate([motion[:, :2] - (1.0 - share) * part, motion[:, 2:]], axis=-1)


def _in_start_frame(start: Array, relative: Array) -> Array:
    """Return relative poses given in palm axes as poses in the start pose's frame."""
    return np.concatenate([rotate(-start[:, 2], relative[:, :2]), relative[:, 2:]], axis=-1)


def carried_point(motion: Array, arm: Array) -> Array:
    """Return how a point at `arm` `(B, 2)` from the object's origin moves with motions `(B, 3)`."""
    return from_parts(motion[:, 0] - motion[:, 2] * arm[:, 1], motion[:, 1] + motion[:, 2] * arm[:, 0])


def _towards(state: State, finger: int) -> Array:
    """Return the unit vectors from a finger to the object `(B, 2)`, zero where they touch."""
    way = state.object_xy[:, finger] - state.finger_xy[:, finger]
    return np.asarray(way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-9))
