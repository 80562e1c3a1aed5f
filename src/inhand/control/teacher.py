"""A privileged teacher: knows each world as it was drawn and remembers nothing, so that it can judge any state.

It moves the object along its aim by what the state alone says: a speed that falls towards the end, at which the object
may come up only by little at a time, and feedback on what it is off. Joint targets come of that as the expert's do
(`control/ik.py`), with the servos, the weight and the delay of the world instead of those on paper.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inhand.control.ik import carried_point
from inhand.geometry import TURN_ARM, Array, perpendicular
from inhand.hands.hand import HandSpec
from inhand.hands.kinematics import damped_least_squares, joint_positions, link_jacobian
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.hand import SpatialHand
from inhand.sim.drawn import Disturbed
from inhand.sim.scene import SceneSpec
from inhand.sim.state import State
from inhand.tasks.observations import Aim


@dataclass(frozen=True)
class TeacherConfig:
    """Numbers of the teacher, guessed but where said."""

    speed: float = 0.06
    """Speed along the aim [m/s]: the sooner it is there, the fewer pushes come."""
    acceleration: float = 0.3
    """Braking towards the end [m/s^2],"""
    near: float = 6.0
    """at most so much speed for each metre left [1/s],"""
    faster: float = 0.012
    """and by how much faster than it is the object is asked to become [m/s]."""
    lead: float = 0.015
    """Time in which speeds that are off are to be made up for [s]."""
    proportional: float = 1.2
    """Displacement for each metre (radian) that the object is off."""
    most: tuple[float, float] = (0.004, 0.1)
    """Largest displacement and angle asked for in a decision [m, rad]."""
    grip: float = 3.0
    """Grip force [N],"""
    room: float = 0.6
    """of which at most so large a share of a joint's largest torque is made."""
    damping: float = 0.005
    """Damping of the least squares [m/rad]."""


@dataclass(frozen=True, eq=False)
class Servos:
    """Servos of B worlds as they are drawn."""

    stiffness: Array
    """Of each world's joints `(B, 1)` [N m/rad],"""
    damping: Array
    """[N m s/rad],"""
    torque: Array
    """the largest [N m],"""
    late: Array
    """how late commands arrive [s],"""
    zero: Array
    """and what encoders read at zero `(B, n_joints)` [rad]."""


def drawn_of(disturbed: Sequence[Disturbed] | None, name: str, count: int, nominal: float = 1.0) -> Array:
    """Return a number that is drawn for each of `count` worlds `(B, 1)`; None for worlds that nothing disturbs."""
    return np.array([nominal] * count if disturbed is None else [getattr(each.drawn, name) for each in disturbed])[
        :, None
    ]


def servos_of(hand: HandSpec | SpatialHand, disturbed: Sequence[Disturbed] | None, count: int) -> Servos:
    """Return the servos of `count` worlds of a hand; None of worlds that nothing disturbs."""
    own = {name: getattr(hand, name) * drawn_of(disturbed, name, count) for name in ("stiffness", "damping", "torque")}
    zero = np.zeros((count, hand.n_joints)) if disturbed is None else np.array([each.drawn.zero for each in disturbed])
    return Servos(**own, late=drawn_of(disturbed, "command_s", count, 0.0), zero=zero)


class Teacher:
    """Joint targets for B worlds, from each as it is."""

    def __init__(
        self,
        hand: HandSpec,
        spec: ObjectSpec,
        disturbed: Sequence[Disturbed] | None,
        count: int,
        config: TeacherConfig | None = None,
    ) -> None:
        """Know how each of `count` worlds is disturbed; None where none is."""
        self.config, self._hand = config or TeacherConfig(), hand
        self._servos, scene = servos_of(hand, disturbed, count), SceneSpec()
        weight = scene.gravity * spec.mass * drawn_of(disturbed, "mass", count)
        self._drag = scene.floor_friction * spec.friction * drawn_of(disturbed, "floor", count) * weight

    def act(self, state: State, aim: Aim) -> Array:
        """Return the commands `(B, n_joints)` [rad] for a true state and what is asked."""
        config, hand, servos = self.config, self._hand, self._servos
        wanted, velocity = self._wanted(state, aim)
        speed = np.linalg.norm(velocity[:, :2], axis=-1, keepdims=True)
        push = self._drag * velocity[:, :2] / np.maximum(speed, 0.005)
        line = state.finger_xy[:, 1] - state.finger_xy[:, 0]
        line /= np.maximum(np.linalg.norm(line, axis=-1, keepdims=True), 1e-9)
        jacobians = [
            link_jacobian(
                joint_positions(finger, state.joint_angles[:, place])[:, :-1],
                state.finger_xy[:, i],
                state.contact_links[:, i],
            )
            for i, (finger, place) in enumerate(zip(hand.fingers, hand.slices, strict=True))
        ]
        levers = [np.abs((jacobian * line[..., None]).sum(axis=-2)).max(axis=-1) for jacobian in jacobians]
        most = config.room * servos.torque[:, 0] / np.maximum(np.max(levers, axis=0), 1e-9)
        grip = np.minimum(config.grip, most)[:, None]
        targets = state.joint_angles + servos.zero
        for i, (place, jacobian) in enumerate(zip(hand.slices, jacobians, strict=True)):
            point = state.finger_xy[:, i]
            arm = point - state.pose[:, :2]
            towards = state.object_xy[:, i] - point
            towards /= np.maximum(np.linalg.norm(towards, axis=-1, keepdims=True), 1e-9)
            step = carried_point(wanted, arm) + np.maximum(state.gaps[:, i], 0.0)[:, None] * towards
            joint_step = damped_least_squares(jacobian, step, config.damping)
            joint_speed = damped_least_squares(jacobian, carried_point(velocity, arm), config.damping)
            force = grip * line * (1 - 2 * i) + push / len(hand.fingers)
            torque = (jacobian * force[..., None]).sum(axis=-2)
            targets[:, place] += (
                joint_step + (servos.damping * joint_speed + torque) / servos.stiffness + servos.late * joint_speed
            )
        return targets

    def _wanted(self, state: State, aim: Aim) -> tuple[Array, Array]:
        """Return the wanted displacement of each object and its velocity, each `(B, 3)` in palm axes."""
        config, shift = self.config, aim.shift(state.pose)
        turning = np.broadcast_to(aim.turn, aim.angle.shape) != 0
        linear, spin = state.object_velocity[:, :2], state.object_velocity[:, 5]
        ahead, left = aim.direction, perpendicular(aim.direction)
        going = np.stack([(linear * ahead).sum(-1), (linear * left).sum(-1), spin], axis=-1)
        now = np.where(turning, TURN_ARM * aim.turn * spin, going[:, 0])
        room = aim.distance - aim.come(shift)
        brake = np.minimum(np.sqrt(2 * config.acceleration * np.abs(room)), config.near * np.abs(room))
        speed = np.sign(room) * np.minimum(config.speed, brake)
        speed = np.minimum(speed, np.maximum(now, 0.0) + config.faster)
        # What is asked for is a speed; in everything else to be where the primitive began.
        away = -config.proportional * shift - config.lead * going
        along = config.lead * (speed - now)
        away[:, 0] = np.where(turning, away[:, 0], along)
        away[:, 2] = np.where(turning, along * aim.turn / TURN_ARM, away[:, 2])
        away[:, :2] = np.clip(away[:, :2], -config.most[0], config.most[0])
        away[:, 2] = np.clip(away[:, 2], -config.most[1], config.most[1])
        zero = np.zeros_like(speed)
        turned = speed * aim.turn / TURN_ARM
        rate = np.stack([np.where(turning, zero, speed), zero, np.where(turning, turned, zero)], axis=-1)

        def in_palm(each: Array) -> Array:
            return np.concatenate([each[:, :1] * ahead + each[:, 1:2] * left, each[:, 2:]], axis=-1)

        return in_palm(away), in_palm(rate)
