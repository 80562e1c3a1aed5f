"""The teacher in space: the expert's law from the state alone, so that it can judge any state, of worlds as drawn.

As in the plane (`control/teacher.py`) it moves the object along its aim at a speed that falls towards the end, at which
the object may come up only by little at a time, and takes back what the object is off. There is no integral part: the
forces carry the whole weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from inhand.control.ik import finger_law
from inhand.control.spatial_ik import SpatialIkConfig, grip_for
from inhand.control.teacher import drawn_of, servos_of
from inhand.geometry import Array
from inhand.hands.spatial.forces import GripRules, hold, weight_held
from inhand.hands.spatial.kinematics import place, point_jacobian
from inhand.hands.spatial.pair import SpatialPair
from inhand.rotations import carried, placed
from inhand.sim.drawn import Disturbed
from inhand.sim.state import State
from inhand.tasks.spatial.aims import SpatialAim


@dataclass(frozen=True)
class SpatialTeacherConfig:
    """Numbers of the teacher, guessed but where said."""

    speed: float = 0.035
    """Speed along the aim [m/s],"""
    turning: float = 0.025
    """and of a turn as an arc at `TURN_ARM` [m/s]: of 98 turns about x and -x 0.035 loses 8, 0.03 one, this none."""
    acceleration: float = 0.1
    """Braking towards the end [m/s^2],"""
    near: float = 5.0
    """at most so much speed for each metre left [1/s],"""
    faster: float = 0.03
    """and by how much faster than it is the object is asked to become [m/s]."""
    lead: float = 0.015
    """Time in which speeds that are off are to be made up for [s]."""
    push: float = 0.001
    """Displacement along the aim that is asked for beside [m], near the end `proportional` of the way left."""
    proportional: float = 2.5
    """Displacement for each metre (radian) that the object is off; with 1.2 it is twice as far off its line."""
    most: tuple[float, float] = (0.006, 0.2)
    """Largest displacement along and angle about each axis asked for in a decision [m, rad]."""
    law: SpatialIkConfig = field(default_factory=lambda: SpatialIkConfig(grip=4.0))
    """The expert's friction and damping, and a stronger grip: with 2.5 N a policy, whose forces are never quite the
    teacher's, loses some of the turns that use three quarters of a cone."""


class SpatialTeacher:
    """Joint targets for B worlds, from each as it is."""

    def __init__(
        self,
        held: SpatialPair,
        disturbed: Sequence[Disturbed] | None,
        count: int,
        config: SpatialTeacherConfig | None = None,
    ) -> None:
        """Know hand and object, and how each of `count` worlds is disturbed; None where none is."""
        self.config, (self._hand, spec) = config or SpatialTeacherConfig(), held
        self._servos = servos_of(held.hand, disturbed, count)
        self._mass = spec.mass * drawn_of(disturbed, "mass", count)
        self._friction = held.hand.friction * spec.friction * drawn_of(disturbed, "friction", count)[:, 0]
        off = np.zeros((count, 3)) if disturbed is None else np.array([each.drawn.centre for each in disturbed])
        self._centre = np.array(spec.centre) + off

    def act(self, state: State, aim: SpatialAim, gravity: Array) -> Array:
        """Return the commands `(B, n_joints)` [rad] for a true state, what is asked and gravity `(B, 3)` [m/s^2]."""
        law, hand, servos = self.config.law, self._hand, self._servos
        held = hold(
            (state.object_points, state.normals),
            weight_held(1.0, self._mass * gravity),
            placed(state.object_pose, self._centre),
            rules=GripRules(least=law.least, rounds=2 * law.rounds),  # as it remembers none to begin from
            grip=grip_for(self._mass[:, 0] * np.linalg.norm(gravity, axis=-1), law),
            friction=law.friction_share * self._friction,
        )
        (step, velocity), points = self._wanted(state, aim), state.object_points
        told, targets = place(hand, state.joint_angles), state.joint_angles + servos.zero
        for i, own in enumerate(hand.slices):
            jacobian = point_jacobian(told.places[:, own], told.axes[:, own], points[:, i])
            arm = points[:, i] - state.object_pose[:, :3]
            closer = np.maximum(state.gaps[:, i], 0.0)[:, None] * state.normals[:, i]
            moves = carried(step + servos.late * velocity, arm) + closer, carried(velocity, arm)
            targets[:, own] += finger_law(servos, jacobian, moves, held.forces[:, i], law.damping)
        return targets

    def _wanted(self, state: State, aim: SpatialAim) -> tuple[Array, Array]:
        """Return the wanted displacement of each object and its velocity, each `(B, 6)` in palm axes [m, rad]."""
        config = self.config
        now = aim.speed(state)
        room = aim.left(state.object_pose)
        brake = np.minimum(np.sqrt(2 * config.acceleration * np.abs(room)), config.near * np.abs(room))
        fastest = np.where(aim.turning, config.turning, config.speed)
        speed = np.sign(room) * np.minimum(fastest, brake)
        speed = np.minimum(speed, np.maximum(now, 0.0) + config.faster)[:, None]
        aside = state.object_velocity - now[:, None] * aim.motion
        away = -config.proportional * aim.off_by(state.object_pose) - config.lead * aside
        push = np.sign(room) * np.minimum(config.proportional * np.abs(room), config.push)
        away += (config.lead * (speed - now[:, None]) + push[:, None]) * aim.motion
        most = np.repeat(config.most, 3)
        return np.clip(away, -most, most), speed * aim.motion
